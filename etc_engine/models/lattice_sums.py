"""Sums of multipoles over the five lattices whose arrays of disks or spheres are solved, cached."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy.special import gamma, gammaincc, gammaln

from etc_engine.arrays import Floats, Ints


@dataclass(frozen=True)
class Lattice:
    """A lattice of equal disks or spheres with unit nearest-neighbour distance.

    Parameters
    ----------
    name : str
        Name in messages.
    dimension : int
        2 or 3.
    cell : float
        Area or volume per lattice point, in units of the nearest-neighbour distance.
    symmetry : int
        In 2D, multipoles l and l' couple when l + l' is a multiple of it; in 3D unused.
    """

    name: str
    dimension: int
    cell: float
    symmetry: int

    @property
    def touching_fraction(self) -> float:
        """Fraction at which neighbours touch."""
        measure = np.pi / 4.0 if self.dimension == 2 else np.pi / 6.0
        return float(measure / self.cell)


SQUARE = Lattice("square array", 2, 1.0, 4)
HEXAGONAL = Lattice("hexagonal array", 2, np.sqrt(3.0) / 2.0, 6)
SIMPLE_CUBIC = Lattice("simple cubic array", 3, 1.0, 0)
BCC = Lattice("body-centred cubic array", 3, 4.0 / (3.0 * np.sqrt(3.0)), 0)
FCC = Lattice("face-centred cubic array", 3, 1.0 / np.sqrt(2.0), 0)


def plane_sums(lattice: Lattice, highest: int) -> Floats:
    r"""Lattice sums :math:`S_L = \sum' z^{-L}` of a square or hexagonal lattice, for L = 0 .. highest.

    From the recursion of the Laurent coefficients of Weierstrass's function; S_2 is 0 for summation in
    circles. All terms of the recursion are positive, so it loses no digits.

    References
    ----------
    M. Abramowitz and I. A. Stegun, *Handbook of Mathematical Functions* (1964), 18.5.3.

    Examples
    --------
    >>> round(float(plane_sums(SQUARE, 4)[4]), 9)
    3.151212002
    """
    c = np.zeros(max(highest // 2 + 1, 4))  # c_k = (2k - 1) S_2k
    if lattice.symmetry == 4:
        c[2] = 3.0 * gamma(0.25) ** 8 / (960.0 * np.pi**2)
    else:
        c[3] = 5.0 * gamma(1.0 / 3.0) ** 18 / (8960.0 * np.pi**6)
    for k in range(4, c.size):
        c[k] = 3.0 / ((2 * k + 1) * (k - 3)) * np.dot(c[2 : k - 1], c[k - 2 : 1 : -1])
    sums = np.zeros(2 * c.size)
    sums[2::2] = c[1:] / (2.0 * np.arange(1, c.size) - 1.0)
    return sums[: highest + 1]


def _points(lattice: Lattice, reciprocal: bool, shells: int = 8) -> Floats:
    """Lattice (or reciprocal lattice) points other than the origin, shape (n, 3)."""
    n = np.mgrid[-shells : shells + 1, -shells : shells + 1, -shells : shells + 1].reshape(3, -1).T
    parity = n % 2
    if lattice is SIMPLE_CUBIC:
        scale, keep = 1.0, np.ones(len(n), dtype=bool)
    else:
        body_centred = (parity == parity[:, :1]).all(axis=1)  # all even or all odd
        face_centred = n.sum(axis=1) % 2 == 0
        # In half cube edges; bcc and fcc are each other's reciprocal.
        scale = 1.0 / np.sqrt(3.0) if lattice is BCC else 1.0 / np.sqrt(2.0)
        keep = body_centred if (lattice is BCC) != reciprocal else face_centred
    if reciprocal:
        # The points above have edge 2 * scale for bcc and fcc, edge 1 for simple cubic.
        scale = 2.0 * np.pi if lattice is SIMPLE_CUBIC else np.pi / scale
    return scale * n[keep & n.any(axis=1)].astype(np.float64)


def _harmonics(points: Floats, m: int, highest: int) -> Floats:
    """Real harmonics sqrt((l-m)!/(l+m)!) P_lm(cos theta) cos(m phi) at unit directions, [l, point]."""
    r = np.linalg.norm(points, axis=1)
    cos_theta, sin_theta = points[:, 2] / r, np.hypot(points[:, 0], points[:, 1]) / r
    k = np.arange(1.0, m + 1.0)
    p = np.zeros((highest + 1, len(points)))
    p[m] = np.prod(np.sqrt((2.0 * k - 1.0) / (2.0 * k))) * sin_theta**m
    if m < highest:
        p[m + 1] = np.sqrt(2.0 * m + 1.0) * cos_theta * p[m]
    for l in range(m + 2, highest + 1):
        step = (2 * l - 1) * cos_theta * p[l - 1] - np.sqrt((l - 1.0) ** 2 - m * m) * p[l - 2]
        p[l] = step / np.sqrt(float(l * l - m * m))
    harmonics: Floats = p * np.cos(m * np.arctan2(points[:, 1], points[:, 0]))
    return harmonics


def space_sums(lattice: Lattice, highest: int) -> Floats:
    r"""Lattice sums :math:`\sum' \sqrt{(L-M)!/(L+M)!}\, P_{LM} \cos(M\phi) / r^{L+1}`, array [L, M].

    Split by Ewald's method into a sum over the lattice and one over its reciprocal, both Gaussian;
    the conditionally convergent L = 2 is 0, as for summation in spheres. Only even L >= 4 and M
    in steps of 4 are filled: the others vanish by cubic symmetry.

    References
    ----------
    P. P. Ewald, Ann. Phys. 369, 253 (1921), 10.1002/andp.19213690304.

    Examples
    --------
    >>> round(float(space_sums(SIMPLE_CUBIC, 4)[4, 0]), 6)
    3.108227
    """
    alpha = np.sqrt(np.pi) / lattice.cell ** (1.0 / 3.0)
    real, dual = _points(lattice, reciprocal=False), _points(lattice, reciprocal=True)
    r, g = np.linalg.norm(real, axis=1), np.linalg.norm(dual, axis=1)
    orders = np.arange(4, highest + 1, 2)
    near = np.array([gammaincc(l + 0.5, (alpha * r) ** 2) / r ** (l + 1) for l in orders])
    log_far = [(l - 2) * np.log(g / 2.0) - (g / (2.0 * alpha)) ** 2 - gammaln(l + 0.5) for l in orders]
    far = ((-1.0) ** (orders // 2) * np.pi**1.5 / lattice.cell)[:, None] * np.exp(log_far)
    sums = np.zeros((highest + 1, highest + 1))
    for m in range(0, highest + 1, 4):
        real_part = np.einsum("lp,lp->l", _harmonics(real, m, highest)[orders], near)
        sums[orders, m] = real_part + np.einsum("lp,lp->l", _harmonics(dual, m, highest)[orders], far)
    return sums


@functools.lru_cache(maxsize=32)
def coupling(lattice: Lattice, highest: int) -> tuple[Floats, Floats]:
    r"""Coupling C of the odd multipoles up to ``highest`` of touching neighbours, and their orders l.

    The amplitudes y of an array of radius a solve :math:`y_i / \beta_i - \sum_j K_{ij} y_j = \delta_{i1}`
    with :math:`K_{ij} = C_{ij} (2a)^{p_i + p_j}`, p = l in 2D and l + 1/2 in 3D; C is symmetric.

    Returns
    -------
    coefficients : ndarray, shape (n, n)
    orders : ndarray, shape (n,)
    """
    couple = _plane_coupling if lattice.dimension == 2 else _space_coupling
    coefficients, orders = couple(lattice, highest)
    coefficients.setflags(write=False)
    orders.setflags(write=False)
    return coefficients, orders


def _plane_coupling(lattice: Lattice, highest: int) -> tuple[Floats, Floats]:
    step = lattice.symmetry
    l = np.array([order for order in range(1, highest + 1, 2) if order % step in (1, step - 1)])
    total = l[:, None] + l
    sums = plane_sums(lattice, int(total.max()))[total]
    # (l + l' - 1)! / sqrt(l! (l - 1)! l'! (l' - 1)!), with the radius in units of its touching value
    single = 0.5 * (gammaln(l + 1.0) + gammaln(l)) + l * np.log(2.0)
    return sums * np.exp(gammaln(total) - single[:, None] - single), l.astype(np.float64)


def _space_coupling(lattice: Lattice, highest: int) -> tuple[Floats, Floats]:
    lm = np.array([(l, m) for l in range(1, highest + 1, 2) for m in range(0, l + 1, 4)])
    l, m = lm[:, 0], lm[:, 1]
    total = l[:, None] + l
    sums = space_sums(lattice, int(total.max()))

    def interaction(m2: Ints) -> Floats:
        up, down = l[:, None] - m[:, None] + l + m2, l[:, None] + m[:, None] + l - m2
        shift = np.abs(m2 - m[:, None])
        single = 0.5 * (gammaln(l - m + 1.0) + gammaln(l + m + 1.0)) + (l + 0.5) * np.log(2.0)
        log = 0.5 * (gammaln(up + 1.0) + gammaln(down + 1.0)) - single[:, None] - single
        product: Floats = sums[total, shift] * np.exp(log)
        return product

    # Even combinations of +m and -m: cos(m phi).
    weight = np.where(m == 0, np.sqrt(0.5), 1.0)
    return weight[:, None] * weight * (interaction(m) + interaction(-m)), l.astype(np.float64)
