"""Ordered arrays of disks and spheres: Rayleigh's multipole solution, to convergence."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.models.broadcasting import elementwise
from etc_engine.models.lattice_sums import (
    BCC,
    FCC,
    HEXAGONAL,
    SIMPLE_CUBIC,
    SQUARE,
    Lattice,
    coupling,
)
from etc_engine.models.phases import polarizability, with_pure_phases

# (radius over touching radius up to, highest multipole order): perfectly conducting particles, the worst
# case, are then good to 1e-9 up to 0.999 of the touching radius in the plane, to 1e-8 up to 0.99 in space.
PLANE_ORDERS = ((0.8, 25), (0.95, 39), (0.98, 119), (1.0, 239))
SPACE_ORDERS = ((0.7, 13), (0.85, 25), (0.93, 31), (1.0, 61))
BATCH = 512
RESIDUAL = 1e-10


def _array_conductivity(lattice: Lattice, k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    """Clausius-Mossotti with the dipole of a particle in the field of all the others' multipoles."""
    d = lattice.dimension
    size = (fraction.ravel() / lattice.touching_fraction) ** (1.0 / d)
    flat1, flat2 = k1.ravel(), k2.ravel()
    dipole = np.full(size.shape, np.nan)
    lower = -1.0
    for upper, highest in PLANE_ORDERS if d == 2 else SPACE_ORDERS:
        rows = np.flatnonzero((size > lower) & (size <= upper))
        for start in range(0, len(rows), BATCH):
            at = rows[start : start + BATCH]
            dipole[at] = _dipole(lattice, highest, flat1[at], flat2[at], size[at])
        lower = upper
    x = fraction * dipole.reshape(fraction.shape)
    k = with_pure_phases(k1 * (1.0 + (d - 1) * x) / (1.0 - x), k1, k2, fraction)
    return np.where((fraction >= 0.0) & (fraction < lattice.touching_fraction), k, np.nan)


def _dipole(lattice: Lattice, highest: int, k1: Floats, k2: Floats, size: Floats) -> Floats:
    """Dipole amplitude y_1 of (1/beta - K) y = e_1, for a batch of radii and contrasts, shape (n,).

    Scaled by sqrt(|beta|) the matrix is 1 - sign(beta) M, symmetric and positive definite, with
    M = G C G and one C for the whole batch: conjugate gradients need a matrix product a step and no
    factorization. y_1 is the energy of the solution, so its error is the residual's square.
    """
    coefficients, orders = coupling(lattice, highest)
    beta = polarizability(k1[:, None], k2[:, None], lattice.dimension, orders)
    root = np.sqrt(np.abs(beta))
    gain = root * size[:, None] ** (orders + 0.5 * (lattice.dimension - 2))
    sign = np.sign(beta[:, :1])
    residual = np.zeros_like(beta)
    residual[:, 0] = root[:, 0]
    solution, direction = np.zeros_like(beta), residual.copy()
    norm2 = start = np.sum(residual**2, axis=1)
    for _ in range(4 * len(orders)):
        if np.all(norm2 <= RESIDUAL**2 * start):
            break
        image = direction - sign * gain * ((gain * direction) @ coefficients)
        curvature = np.sum(direction * image, axis=1)
        step = np.where(curvature > 0.0, norm2 / curvature, 0.0)
        solution += step[:, None] * direction
        residual = residual - step[:, None] * image
        previous, norm2 = norm2, np.sum(residual**2, axis=1)
        direction = residual + np.where(previous > 0.0, norm2 / previous, 0.0)[:, None] * direction
    converged = norm2 <= RESIDUAL**2 * start
    return np.where(converged, sign[:, 0] * root[:, 0] * solution[:, 0], np.nan)


@elementwise
def square_array(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Equal disks on a square lattice.

    .. math:: \frac{k}{k_1} = \frac{1 + x}{1 - x}, \quad x = f y_1, \qquad
              \frac{y_l}{\beta} - \sum_{l'} K_{l l'} y_{l'} = \delta_{l1}

    with K from the lattice sums :math:`S_{l + l'}` over all neighbours, l and l' odd.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and disks; 0 and inf allowed.
    fraction : array_like [-]
        Area fraction f of the disks, up to pi/4 (touching); NaN from there on.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    Lord Rayleigh, Phil. Mag. 34, 481 (1892), 10.1080/14786449208620364.
    W. T. Perrins, D. R. McKenzie and R. C. McPhedran, Proc. R. Soc. Lond. A 369, 207 (1979),
    10.1098/rspa.1979.0160.

    Examples
    --------
    >>> round(float(square_array(1.0, 7.7, 0.5)), 8)
    2.27600343
    """
    return _array_conductivity(SQUARE, k1, k2, fraction)


@elementwise
def hexagonal_array(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Equal disks on a hexagonal (triangular) lattice; the equations of `square_array`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and disks; 0 and inf allowed.
    fraction : array_like [-]
        Area fraction f of the disks, up to pi/sqrt(12) (touching); NaN from there on.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    W. T. Perrins, D. R. McKenzie and R. C. McPhedran, Proc. R. Soc. Lond. A 369, 207 (1979),
    10.1098/rspa.1979.0160.

    Examples
    --------
    >>> round(float(hexagonal_array(2.0, 2.0, 0.6)), 12)
    2.0
    """
    return _array_conductivity(HEXAGONAL, k1, k2, fraction)


@elementwise
def simple_cubic(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Equal spheres on a simple cubic lattice.

    .. math:: \frac{k}{k_1} = \frac{1 + 2x}{1 - x}, \quad x = f y_{10}, \qquad
              \frac{y_{lm}}{\beta_l} - \sum_{l'm'} K_{lm,l'm'} y_{l'm'} = \delta_{l1}

    with :math:`\beta_l = l (k_2 - k_1)/(l k_2 + (l + 1) k_1)` and K from the lattice sums of
    spherical harmonics, l odd and m in steps of 4.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and spheres; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the spheres, up to pi/6 (touching); NaN from there on.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    R. C. McPhedran and D. R. McKenzie, Proc. R. Soc. Lond. A 359, 45 (1978), 10.1098/rspa.1978.0031.

    Examples
    --------
    >>> round(float(simple_cubic(1.0, 7.7, 0.3)), 7)
    1.7967699
    """
    return _array_conductivity(SIMPLE_CUBIC, k1, k2, fraction)


@elementwise
def bcc(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Equal spheres on a body-centred cubic lattice; the equations of `simple_cubic`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and spheres; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the spheres, up to pi sqrt(3)/8 (touching); NaN from there on.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    D. R. McKenzie, R. C. McPhedran and G. H. Derrick, Proc. R. Soc. Lond. A 362, 211 (1978),
    10.1098/rspa.1978.0129.

    Examples
    --------
    >>> round(float(bcc(2.0, 2.0, 0.6)), 12)
    2.0
    """
    return _array_conductivity(BCC, k1, k2, fraction)


@elementwise
def fcc(k1: Floats, k2: Floats, fraction: Floats) -> Floats:
    r"""Equal spheres on a face-centred cubic lattice; the equations of `simple_cubic`.

    Parameters
    ----------
    k1, k2 : array_like [W/(m K)]
        Conductivity of matrix and spheres; 0 and inf allowed.
    fraction : array_like [-]
        Volume fraction f of the spheres, up to pi/sqrt(18) (touching); NaN from there on.

    Returns
    -------
    array_like [W/(m K)]

    References
    ----------
    D. R. McKenzie, R. C. McPhedran and G. H. Derrick, Proc. R. Soc. Lond. A 362, 211 (1978),
    10.1098/rspa.1978.0129.

    Examples
    --------
    >>> round(float(fcc(2.0, 2.0, 0.6)), 12)
    2.0
    """
    return _array_conductivity(FCC, k1, k2, fraction)
