r"""Energy of the shell between a sphere and a facet of its Laguerre cell.

Every point x_f of the facet, at distance rho from the centre, is joined to the rim by its ray:

    x = x_f [1 - (1 - t) B / rho],   B = rho - R,   0 <= t <= 1 from rim to facet,
    T = t T_face + (1 - t) z + sum_k m_k b_k(t),    b_k integrated Legendre polynomials.

On the unit square of (facet) x (t) the energy is

    int int k { |grad_f T - t T_t grad_f rho / B|^2 B + T_t^2 (1 - (1 - t) B / rho)^2 / B } dS dt

with grad_f the gradient along the facet as seen from the centre (the projected metric e_i . e_j - rho_i rho_j) and
dS its area: the powers of the radius cancel. All integrals over t are polynomials and done beforehand. There is no
fluid on a contact disk.
"""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numpy.polynomial import Legendre

from etc_engine.arrays import Floats


@functools.cache
def radial_moments(degree: int) -> Floats:
    r"""Integrals over t of the radial functions t, 1 - t, b_2 .. b_degree; shape (6, degree + 1, degree + 1).

    In turn b_p b_q, b_p t b_q', t^2 b_p' b_q', and (1 - t)^n b_p' b_q' for n = 0, 1, 2.
    """
    points, weights = np.polynomial.legendre.leggauss(degree + 2)
    t, w = 0.5 * (points + 1.0), 0.5 * weights
    values, slopes = [t, 1.0 - t], [np.ones_like(t), -np.ones_like(t)]
    for k in range(2, degree + 1):
        bubble = Legendre.basis(k) - Legendre.basis(k - 2)
        values.append(bubble(points))
        slopes.append(2.0 * bubble.deriv()(points))
    b, d = np.array(values), np.array(slopes)
    moments = np.array(
        [(b * w) @ b.T, (b * w * t) @ d.T, (d * w * t * t) @ d.T] + [(d * w * (1.0 - t) ** n) @ d.T for n in range(3)]
    )
    moments.setflags(write=False)
    return moments


@njit(cache=True)
def shell_matrices(nodes, offsets, triangles, on_disk, medium, moments, rule):  # type: ignore[no-untyped-def]
    """Energy of the shell over all radial functions of all nodes; Laplace-Beltrami stiffness and angles of the rim.

    `nodes`, shape (2, n, 2), and `offsets`, shape (2, n) (height of the facet above the sphere's radius): around the
    contact disk and on it. `medium` = (R, conductivity of the fluid). Returns arrays of shape (functions * n,
    functions * n), (n, n) and (n,).
    """
    shapes, weights = rule
    radius, fluid = medium
    n, functions = nodes.shape[1], moments.shape[1]
    energy, rim, angles = np.zeros((functions * n, functions * n)), np.zeros((n, n)), np.zeros(n)
    grad, slope = np.empty((6, 6)), np.empty(6)
    for t in range(len(triangles)):
        where = 1 if on_disk[t] else 0
        for g in range(len(weights)):
            # point, its two derivatives: (offset, u, v)
            p0 = p1 = p2 = 0.0
            x0 = x1 = x2 = 0.0
            y0 = y1 = y2 = 0.0
            for a in range(6):
                node = triangles[t, a]
                h, u, v = offsets[where, node], nodes[where, node, 0], nodes[where, node, 1]
                p0, p1, p2 = p0 + shapes[g, 0, a] * h, p1 + shapes[g, 0, a] * u, p2 + shapes[g, 0, a] * v
                x0, x1, x2 = x0 + shapes[g, 1, a] * h, x1 + shapes[g, 1, a] * u, x2 + shapes[g, 1, a] * v
                y0, y1, y2 = y0 + shapes[g, 2, a] * h, y1 + shapes[g, 2, a] * u, y2 + shapes[g, 2, a] * v
            height, square = radius + p0, p1 * p1 + p2 * p2
            rho = np.sqrt(height * height + square)
            thickness = (p0 * (height + radius) + square) / (rho + radius)
            rx, ry = (height * x0 + p1 * x1 + p2 * x2) / rho, (height * y0 + p1 * y1 + p2 * y2) / rho
            g11 = x0 * x0 + x1 * x1 + x2 * x2 - rx * rx
            g12 = x0 * y0 + x1 * y1 + x2 * y2 - rx * ry
            g22 = y0 * y0 + y1 * y1 + y2 * y2 - ry * ry
            det = g11 * g22 - g12 * g12
            area = weights[g] * np.sqrt(det)
            for a in range(6):
                da, ea = shapes[g, 1, a], shapes[g, 2, a]
                up, vp = (g22 * da - g12 * ea) / det, (g11 * ea - g12 * da) / det
                slope[a] = up * rx + vp * ry
                for b in range(6):
                    grad[a, b] = up * shapes[g, 1, b] + vp * shapes[g, 2, b]
            steep = (g22 * rx * rx - 2.0 * g12 * rx * ry + g11 * ry * ry) / det
            w, beta = fluid * area, thickness / rho
            for a in range(6):
                angles[triangles[t, a]] += area / (rho * rho) * shapes[g, 0, a]
                for b in range(6):
                    rim[triangles[t, a], triangles[t, b]] += area * grad[a, b]
            if on_disk[t]:
                continue
            for p in range(functions):
                for q in range(functions):
                    along = w * thickness * moments[0, p, q]
                    across = (
                        steep * moments[2, p, q]
                        + moments[3, p, q]
                        - 2.0 * beta * moments[4, p, q]
                        + beta * beta * moments[5, p, q]
                    ) * (w / thickness)
                    m1, m2 = w * moments[1, p, q], w * moments[1, q, p]
                    for a in range(6):
                        na, row = shapes[g, 0, a], p * n + triangles[t, a]
                        for b in range(6):
                            nb = shapes[g, 0, b]
                            energy[row, q * n + triangles[t, b]] += (
                                along * grad[a, b] - m1 * slope[a] * nb - m2 * na * slope[b] + across * na * nb
                            )
    return energy, rim, angles
