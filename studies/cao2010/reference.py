"""The examples of Cao, Qin and Zhao (2010): layouts, exact series, and the numbers printed in the paper.

Recent Patents on Space Technology 2 (2010) 41-50. The printed series of example 2 has a sine in x where the
boundary conditions ask for a cosine; example 3 is consistent with k/(rho c) = 1 and no source.
"""

from __future__ import annotations

import numpy as np

from etc_engine.engines.meshless import Dirichlet, HeatProblem, Neumann

SIDE, CONDUCTIVITY, INITIAL = 3.0, 1.25, 30.0
SQUARE = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)]
L_SHAPE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]

POINTS_1 = np.array([(2.4, 1.5), (2.4, 2.4), (1.8, 1.5), (1.8, 1.8), (1.5, 1.5)])
POINTS_2 = np.array([(1.5, 0.3), (1.5, 0.6), (1.5, 0.9), (1.5, 1.2), (1.5, 1.5)])

# Table 1: DRM-Trefftz, DRM-MFS and what the paper compares them with
TABLE_1 = {
    "DRM-Trefftz": [1.0263, 0.5985, 1.6868, 1.6022, 1.7760],
    "DRM-MFS": [1.0263, 0.5985, 1.6868, 1.6022, 1.7760],
    "BEM1": [1.114, 0.657, 1.798, 1.713, 1.887],
    "BEM2": [1.122, 0.663, 1.809, 1.721, 1.902],
    "FEM": [1.139, 0.670, 1.843, 1.753, 1.938],
    "DRBEM": [1.099, 0.645, 1.784, 1.695, 1.877],
    "Trefftz FEM": [1.103, 0.660, 1.797, 1.715, 1.894],
}
# Table 2: splines r^{2i} ln r without (S) and with (PS) polynomials, and the reverse basis
TABLE_2 = {
    "S1": [1.048, 0.611, 1.721, 1.635, 1.812],
    "S2": [1.119, 0.658, 1.817, 1.728, 1.910],
    "S3": [1.118, 0.649, 1.820, 1.730, 1.914],
    "S4": [1.204, 0.720, 1.933, 1.840, 2.031],
    "S5": [1.021, 0.560, 1.686, 1.599, 1.777],
    "PS1": [1.034, 0.599, 1.703, 1.618, 1.793],
    "PS2": [1.104, 0.642, 1.797, 1.708, 1.890],
    "PS3": [1.137, 0.668, 1.841, 1.751, 1.936],
    "PS4": [1.157, 0.681, 1.871, 1.779, 1.967],
    "PS5": [1.158, 0.680, 1.874, 1.782, 1.971],
    "reverse": [1.026, 0.599, 1.687, 1.602, 1.776],
}
# Table 3 (its MFS value 2.6719 at the second point is a misprint of 2.6179)
TABLE_3 = {
    "DRM-Trefftz": [1.3780, 2.6178, 3.6002, 4.2332, 4.4519],
    "DRM-MFS": [1.3779, 2.6179, 3.6001, 4.2332, 4.4519],
    "FEM": [1.418, 2.697, 3.713, 4.364, 4.589],
    "Trefftz FEM": [1.393, 2.615, 3.649, 4.298, 4.524],
}
TABLE_4 = {20: 0.218, 40: 0.121, 60: 0.119, 80: 0.118}


def exact_1(points: np.ndarray, t: float) -> np.ndarray:
    """Square cooled by zero temperature on all sides."""
    n = np.arange(1, 80, 2)
    decay = np.exp(-CONDUCTIVITY * np.pi**2 * n**2 * t / SIDE**2)
    x, y = (np.sin(np.outer(points[:, i], n) * np.pi / SIDE) @ (4.0 / (n * np.pi) * decay) for i in (0, 1))
    return INITIAL * x * y


def exact_2(points: np.ndarray, t: float) -> np.ndarray:
    """The same with the side x = 0 insulated."""
    n = np.arange(1, 60)
    decay = np.exp(-CONDUCTIVITY * np.pi**2 * (n - 0.5) ** 2 * t / SIDE**2)
    weight = -4.0 * (-1.0) ** n / ((2 * n - 1) * np.pi) * decay
    x = np.cos(np.outer(points[:, 0], 2 * n - 1) * np.pi / (2 * SIDE)) @ weight
    odd = np.arange(1, 80, 2)
    decay = np.exp(-CONDUCTIVITY * np.pi**2 * odd**2 * t / SIDE**2)
    return INITIAL * x * (np.sin(np.outer(points[:, 1], odd) * np.pi / SIDE) @ (4.0 / (odd * np.pi) * decay))


def shape_3(points: np.ndarray) -> np.ndarray:
    """Example 3 at t = 0."""
    return np.cos(3.0 * points[:, 0]) * np.sinh(2.0 * points[:, 1])


def exact_3(points: np.ndarray, t: float) -> np.ndarray:
    """L-shaped body with u = cos(3x) sinh(2y) exp(-5t) on its boundary."""
    return shape_3(points) * np.exp(-5.0 * t)


def example(number: int, lag: float = 0.0) -> HeatProblem:
    """The three examples; ``lag`` delays the boundary values of the third."""
    if number == 3:
        boundary = [Dirichlet(lambda x, t: exact_3(x, t - lag), lambda x, s: shape_3(x) / (s + 5.0))] * 6
        return HeatProblem(vertices=L_SHAPE, conductivity=1.0, heat_capacity=1.0, initial=shape_3, boundary=boundary)
    sides = [Dirichlet(0.0)] * 3 + [Dirichlet(0.0) if number == 1 else Neumann(0.0)]
    return HeatProblem(vertices=SQUARE, conductivity=CONDUCTIVITY, heat_capacity=1.0, initial=INITIAL, boundary=sides)


def square_boundary() -> np.ndarray:
    """40 boundary nodes of the square, spacing 0.3, corners included."""
    s = 0.3 * np.arange(10)
    zero, full = np.zeros(10), np.full(10, SIDE)
    return np.vstack([np.column_stack(side) for side in ((s, zero), (full, s), (SIDE - s, full), (zero, SIDE - s))])


def square_interior() -> np.ndarray:
    """33 interior nodes: a 3 x 3 block about the centre and a square ring of half-width 0.9."""
    steps = 0.3 * np.arange(-3, 4)
    grid = np.array([(a, b) for a in steps for b in steps])
    reach = np.abs(grid).max(axis=1)
    return 1.5 + grid[(reach < 0.35) | (reach > 0.85)]


def l_boundary(count: int) -> np.ndarray:
    """Equally spaced nodes along the L, starting at its lower left corner."""
    corners = np.array(L_SHAPE)
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.abs(edges).sum(axis=1)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    walk = starts[-1] * np.arange(count) / count
    edge = np.searchsorted(starts, walk + 1e-12, side="right") - 1
    return corners[edge] + edges[edge] * ((walk - starts[edge]) / lengths[edge])[:, None]


def l_interior() -> np.ndarray:
    """261 interior nodes of the L: a lattice with spacing 0.1."""
    steps = np.arange(-9, 10) / 10.0
    return np.array([(a, b) for a in steps for b in steps if a < -0.05 or b < -0.05])


def relative_error(found: np.ndarray, exact: np.ndarray) -> float:
    """Relative root mean square of Eq. 44 ("average relative error" in the paper)."""
    return float(np.sqrt(((found - exact) ** 2).sum() / (exact**2).sum()))
