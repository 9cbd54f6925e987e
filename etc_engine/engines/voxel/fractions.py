"""Exact area of a disk in a rectangle, and volume of a sphere in a box, in closed form."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def _quarter_area(radius, x, y):  # type: ignore[no-untyped-def]
    """Area of the disk's part in [0, x] x [0, y], x and y not negative."""
    if x * x + y * y <= radius * radius:
        return x * y
    x, y = min(x, radius), min(y, radius)
    up, across = np.sqrt((radius - x) * (radius + x)), np.sqrt((radius - y) * (radius + y))
    return 0.5 * (x * up + y * across + radius * radius * (np.arcsin(y / radius) - np.arccos(x / radius)))


@njit(cache=True)
def _two_caps(a, b):  # type: ignore[no-untyped-def]
    """Area of the unit sphere's part with x > a and y > b, a and b in [0, 1], by Gauss and Bonnet."""
    if a * a + b * b >= 1.0:
        return 0.0
    p, q = np.sqrt(1.0 - a * a), np.sqrt(1.0 - b * b)
    corner = np.arccos(-a * b / (p * q))
    return 2.0 * (np.pi - corner - a * np.arccos(min(b / p, 1.0)) - b * np.arccos(min(a / q, 1.0)))


@njit(cache=True)
def _octant_volume(radius, x, y, z):  # type: ignore[no-untyped-def]
    """Volume of the sphere's part in [0, x] x [0, y] x [0, z], none of them negative.

    The divergence of the position is 3: a third of R times the free part of the sphere, and of the distance times
    the area of each plane face away from the centre. Of the eighth of the sphere three caps are cut off.
    """
    if x * x + y * y + z * z <= radius * radius:
        return x * y * z
    a, b, c = min(x / radius, 1.0), min(y / radius, 1.0), min(z / radius, 1.0)
    free = 0.5 * np.pi * (a + b + c - 2.0) + 0.5 * (_two_caps(a, b) + _two_caps(b, c) + _two_caps(c, a))
    faces = 0.0
    if a < 1.0:
        faces += a * _quarter_area(np.sqrt(1.0 - a * a), b, c)
    if b < 1.0:
        faces += b * _quarter_area(np.sqrt(1.0 - b * b), c, a)
    if c < 1.0:
        faces += c * _quarter_area(np.sqrt(1.0 - c * c), a, b)
    return radius**3 * (free + faces) / 3.0


@njit(cache=True)
def _signed_volume(radius, x, y, z):  # type: ignore[no-untyped-def]
    return np.sign(x) * np.sign(y) * np.sign(z) * _octant_volume(radius, abs(x), abs(y), abs(z))


@njit(cache=True)
def _signed_area(radius, x, y):  # type: ignore[no-untyped-def]
    return np.sign(x) * np.sign(y) * _quarter_area(radius, abs(x), abs(y))


@njit(cache=True)
def ball_in_box(radius, low, high):  # type: ignore[no-untyped-def]
    """Exact area (volume) of a disk (sphere) about the origin inside a rectangle (box).

    Parameters
    ----------
    radius : float [m]
    low, high : ndarray, shape (2,) or (3,) [m]
        Opposite corners.

    Returns
    -------
    float

    Examples
    --------
    >>> corners = np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, 2.0])
    >>> round(ball_in_box(1.0, *corners), 9)  # an eighth of the unit sphere
    0.523598776
    """
    total = 0.0
    if low.size == 2:
        for i in range(2):
            for j in range(2):
                x, y = high[0] if i else low[0], high[1] if j else low[1]
                total += (1.0 if i == j else -1.0) * _signed_area(radius, x, y)
        return max(total, 0.0)
    for i in range(2):
        for j in range(2):
            for k in range(2):
                x, y, z = high[0] if i else low[0], high[1] if j else low[1], high[2] if k else low[2]
                sign = 1.0 if (i + j + k) % 2 else -1.0
                total += sign * _signed_volume(radius, x, y, z)
    return max(total, 0.0)
