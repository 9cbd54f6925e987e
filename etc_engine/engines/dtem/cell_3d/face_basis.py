r"""Frame of a facet: what the temperature on it may be.

Vertices and edge bubbles fix the boundary, and are extended harmonically into the facet; facet bubbles v solve
-Lap v = x^a y^b (a + b <= degree, about the centroid), v = 0 on the boundary. The functions are continuous on any
polygon: they are a virtual-element space (Beirao da Veiga et al. 2013, doi:10.1142/S0218202512500492).
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def edge_bubble(degree, y):  # type: ignore[no-untyped-def]
    """P_k(y) - P_{k-2}(y), zero at y = -1 and 1."""
    before, now = 1.0, y
    for k in range(2, degree + 1):
        following = ((2 * k - 1) * y * now - (k - 1) * before) / k
        if k == degree:
            return following - before
        before, now = now, following
    return 0.0


@njit(cache=True)
def planar_matrices(nodes, triangles, shapes, weights):  # type: ignore[no-untyped-def]
    """Stiffness of the Laplacian in the facet, and the integral of each node's function."""
    n = len(nodes)
    stiffness, mass = np.zeros((n, n)), np.zeros(n)
    for t in range(len(triangles)):
        for g in range(len(weights)):
            a11 = a12 = a21 = a22 = 0.0
            for a in range(6):
                u, v = nodes[triangles[t, a], 0], nodes[triangles[t, a], 1]
                a11 += shapes[g, 1, a] * u
                a12 += shapes[g, 1, a] * v
                a21 += shapes[g, 2, a] * u
                a22 += shapes[g, 2, a] * v
            det = a11 * a22 - a12 * a21
            w = weights[g] / abs(det)
            for a in range(6):
                ga = a22 * shapes[g, 1, a] - a12 * shapes[g, 2, a]
                ha = a11 * shapes[g, 2, a] - a21 * shapes[g, 1, a]
                mass[triangles[t, a]] += weights[g] * abs(det) * shapes[g, 0, a]
                for b in range(6):
                    gb = a22 * shapes[g, 1, b] - a12 * shapes[g, 2, b]
                    hb = a11 * shapes[g, 2, b] - a21 * shapes[g, 1, b]
                    stiffness[triangles[t, a], triangles[t, b]] += w * (ga * gb + ha * hb)
    return stiffness, mass


@njit(cache=True)
def face_basis(nodes, triangles, inner, edges, bubbles, rule):  # type: ignore[no-untyped-def]
    """Values of the frame functions at the nodes, shape (nodes, vertices + edge bubbles + facet bubbles).

    `edges` = (pieces of each edge, whether the facet runs along it, bubbles of each edge); `bubbles` = powers (a, b)
    of the facet bubbles.
    """
    counts, forward, on_edge = edges
    shapes, weights = rule
    corners, n = len(counts), len(nodes)
    size = corners + on_edge.sum() + len(bubbles)
    values = np.zeros((n, size))
    place, column = inner, corners
    for k in range(corners):
        pieces = 2 * counts[k]
        for step in range(pieces):
            z = step / pieces
            values[place, k] += 1.0 - z
            values[place, (k + 1) % corners] += z
            y = 2.0 * z - 1.0 if forward[k] else 1.0 - 2.0 * z
            for b in range(on_edge[k]):
                values[place, column + b] = edge_bubble(2 + b, y)
            place += 1
        column += on_edge[k]
    stiffness, mass = planar_matrices(nodes, triangles, shapes, weights)
    right = np.zeros((inner, size))
    outer = np.ascontiguousarray(values[inner:, :column])
    right[:, :column] = -np.dot(np.ascontiguousarray(stiffness[:inner, inner:]), outer)
    area = cu = cv = 0.0
    for a in range(n):
        area, cu, cv = area + mass[a], cu + mass[a] * nodes[a, 0], cv + mass[a] * nodes[a, 1]
    for b in range(len(bubbles)):
        for a in range(inner):
            u, v = (nodes[a, 0] - cu / area) / np.sqrt(area), (nodes[a, 1] - cv / area) / np.sqrt(area)
            right[a, column + b] = mass[a] * u ** bubbles[b, 0] * v ** bubbles[b, 1]
    values[:inner] = np.linalg.solve(np.ascontiguousarray(stiffness[:inner, :inner]), right)
    for b in range(len(bubbles)):
        largest = 0.0
        for a in range(inner):
            largest = max(largest, abs(values[a, column + b]))
        for a in range(inner):
            values[a, column + b] /= largest
    return values
