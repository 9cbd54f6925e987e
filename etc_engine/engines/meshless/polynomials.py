"""Monomials x^a y^b and their particular solutions of the modified Helmholtz operator."""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats

Field = NDArray
Polynomial = dict[tuple[int, int], complex]

#: Below this |lambda| (coordinates of order one) the series in rising powers of lambda^2 is used.
SMALL_LAMBDA = 1.0
SERIES_TERMS = 9


def exponents(degree: int) -> list[tuple[int, int]]:
    """Exponents (a, b) of the monomials up to a total degree, none for degree -1.

    Examples
    --------
    >>> exponents(1)
    [(0, 0), (1, 0), (0, 1)]
    """
    return [(total - b, b) for total in range(degree + 1) for b in range(total + 1)]


def monomials(points: Floats, degree: int) -> tuple[Field, Field, Field]:
    """Values and both derivatives of the monomials at points, each of shape (k, number of monomials)."""
    return _evaluate([{powers: 1.0} for powers in exponents(degree)], points, complex_valued=False)


def particular_monomials(points: Floats, lam: complex, degree: int) -> tuple[Field, Field, Field]:
    """Solutions p of (laplacian - lambda^2) p = x^a y^b: values and derivatives, each (k, monomials).

    p = - sum_k lambda^{-2(k+1)} lap^k (x^a y^b), a finite sum; for small lambda, where that sum
    cancels, p = sum_k lambda^{2k} L^{k+1} (x^a y^b) with L an inverse of the Laplacian on polynomials.

    Examples
    --------
    >>> particular_monomials(np.array([[2.0, 0.5]]), 2.0, 2)[0].round(4)
    array([[-0.25  , -0.5   , -0.125 , -1.125 , -0.25  , -0.1875]])
    """
    build = _rising if abs(lam) < SMALL_LAMBDA else _finite
    solutions = [build({powers: 1.0}, lam) for powers in exponents(degree)]
    return _evaluate(solutions, points, complex_valued=isinstance(lam, complex))


def _laplacian(polynomial: Polynomial) -> Polynomial:
    result: Polynomial = {}
    for (a, b), value in polynomial.items():
        if a >= 2:
            result[a - 2, b] = result.get((a - 2, b), 0.0) + a * (a - 1) * value
        if b >= 2:
            result[a, b - 2] = result.get((a, b - 2), 0.0) + b * (b - 1) * value
    return result


def _inverse_laplacian(polynomial: Polynomial) -> Polynomial:
    """A polynomial whose Laplacian is the given one: integrate twice in x, then remove what y adds."""
    result: Polynomial = {}
    for (a, b), value in polynomial.items():
        for j in range(b // 2 + 1):
            factor = (-1.0) ** j * factorial(a) / factorial(a + 2 * j + 2) * factorial(b) / factorial(b - 2 * j)
            powers = (a + 2 * j + 2, b - 2 * j)
            result[powers] = result.get(powers, 0.0) + factor * value
    return result


def _finite(polynomial: Polynomial, lam: complex) -> Polynomial:
    result: Polynomial = {}
    factor: complex = -1.0
    while polynomial:
        factor = factor / lam**2
        for powers, value in polynomial.items():
            result[powers] = result.get(powers, 0.0) + factor * value
        polynomial = _laplacian(polynomial)
    return result


def _rising(polynomial: Polynomial, lam: complex) -> Polynomial:
    result: Polynomial = {}
    for k in range(SERIES_TERMS):
        polynomial = _inverse_laplacian(polynomial)
        for powers, value in polynomial.items():
            result[powers] = result.get(powers, 0.0) + lam ** (2 * k) * value
    return result


def _evaluate(polynomials: list[Polynomial], points: Floats, complex_valued: bool) -> tuple[Field, Field, Field]:
    dtype = complex if complex_valued else float
    highest = max((a + b for polynomial in polynomials for a, b in polynomial), default=0)
    x, y = (np.vander(column, highest + 1, increasing=True) for column in np.asarray(points, dtype=float).T)
    tables = [np.zeros((len(points), len(polynomials)), dtype=dtype) for _ in range(3)]
    for column, polynomial in enumerate(polynomials):
        for (a, b), value in polynomial.items():
            tables[0][:, column] += value * x[:, a] * y[:, b]
            if a:
                tables[1][:, column] += value * a * x[:, a - 1] * y[:, b]
            if b:
                tables[2][:, column] += value * b * x[:, a] * y[:, b - 1]
    return tables[0], tables[1], tables[2]
