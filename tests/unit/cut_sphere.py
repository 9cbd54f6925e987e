"""Self-resistance of a cut sphere by spectral elements: a second way to the closed form of the law."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu


def lobatto(order: int) -> np.ndarray:
    inner = legendre.legroots(legendre.legder(np.eye(order + 1)[order]))
    return np.concatenate([[-1.0], np.sort(inner.real), [1.0]])


def edges(alpha: float) -> tuple[list[float], list[float]]:
    """Element edges in s and t, graded towards the centre of the sphere at (2 alpha, 0) and the disk at s = pi."""
    gap = np.pi - 2.0 * alpha
    s = [alpha]
    if gap < 0.5:
        reach = gap * 2.0 ** np.arange(1 + max(0, int(np.log2(0.7 * alpha / gap))))
        s += list(2.0 * alpha - reach[::-1])
    s.append(2.0 * alpha)
    step = alpha
    while np.pi - s[-1] > 0.9 + 1.6 * step:
        step = min(1.6 * step, 0.9)
        s.append(s[-1] + step)
    s += list(np.linspace(s[-1], np.pi, int(np.ceil((np.pi - s[-1]) / 0.9)) + 1)[1:])
    t, step = [0.0], min(alpha, gap, 0.8)
    while t[-1] < 64.0 * (np.pi - alpha) / np.pi:
        t.append(t[-1] + step)
        step = min(1.6 * step, 2.2)
    return s, t


def cut_sphere_resistance(alpha: float, order: int = 10) -> float:
    """kappa R h of the ball cut at one isothermal contact disk, point sink at the centre.

    In the toroidal coordinates of the rim, rho = c sinh t/(cosh t - cos s), the meridian plane of the cut ball is the
    strip alpha < s < pi, t > 0; the rim lies at t = infinity, so its singularity decays exponentially. With the
    temperature w - 1/(4 pi r), w = 1/(4 pi r) on the disk and dw/dn = -1/(4 pi) on the sphere; h = 1/(4 pi) - w(0).
    """
    c = np.sin(alpha)
    s_edges, t_edges = edges(alpha)
    x = lobatto(order)
    q, w = legendre.leggauss(order + 8)
    inverse = np.linalg.inv(legendre.legvander(x, order))
    value = legendre.legvander(q, order) @ inverse
    slope = np.stack([legendre.legval(q, legendre.legder(row)) for row in np.eye(order + 1)], axis=1) @ inverse
    columns = (len(t_edges) - 1) * order + 1
    size = ((len(s_edges) - 1) * order + 1) * columns
    rows, entries, rhs = [], [], np.zeros(size)
    for e, (s0, s1) in enumerate(pairwise(s_edges)):
        for f, (t0, t1) in enumerate(pairwise(t_edges)):
            hs, ht = 0.5 * (s1 - s0), 0.5 * (t1 - t0)
            s, t = s0 + hs * (q + 1.0), t0 + ht * (q + 1.0)
            below = 2.0 * np.sinh(0.5 * t) ** 2 + 2.0 * np.sin(0.5 * s[:, None]) ** 2
            weight = 2.0 * np.pi * c * np.sinh(t) / below * np.outer(w, w)
            k = np.einsum("ab,ai,aj,bk,bl->ikjl", weight * ht / hs, slope, slope, value, value, optimize=True)
            k += np.einsum("ab,ai,aj,bk,bl->ikjl", weight * hs / ht, value, value, slope, slope, optimize=True)
            local = (np.arange(order + 1)[:, None] + e * order) * columns + np.arange(order + 1) + f * order
            rows.append(local.ravel())
            entries.append(k.reshape(local.size, local.size))
            if e == 0:
                below = 2.0 * np.sinh(0.5 * t) ** 2 + 2.0 * np.sin(0.5 * alpha) ** 2
                rhs[local[0]] -= value.T @ (c * c * np.sinh(t) / below**2 * w * ht / 2.0)
    i = np.concatenate([np.repeat(r, r.size) for r in rows])
    j = np.concatenate([np.tile(r, r.size) for r in rows])
    matrix = coo_matrix((np.concatenate([k.ravel() for k in entries]), (i, j)), shape=(size, size)).tocsc()
    t = np.concatenate([t0 + 0.5 * (t1 - t0) * (x[:-1] + 1.0) for t0, t1 in pairwise(t_edges)])
    known = 1.0 / (4.0 * np.pi * np.hypot(c * np.tanh(0.5 * np.append(t, t_edges[-1])), np.cos(alpha)))
    free = slice(0, size - columns)
    rhs[free] -= matrix[free, size - columns :] @ known
    symmetric = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}, "diag_pivot_thresh": 0.0}
    u = splu(matrix[free, free], **symmetric).solve(rhs[free])
    return float(1.0 / (4.0 * np.pi) - u[order * columns * s_edges.index(2.0 * alpha)])
