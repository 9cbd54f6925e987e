"""A transient heat conduction problem: body, material, source, initial state and boundary conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.domain import Disk, Domain, Polygon
from etc_engine.errors import InputError

Field = NDArray

#: A constant, or a function of positions (k, 2) [m] and time [s] that returns (k,) values or one.
Data = float | Callable[[Floats, float], Floats | float]
#: The Laplace transform of such data: a function of positions (k, 2) and complex s [1/s].
Transform = Callable[[Floats, complex], Field | complex]


@dataclass(frozen=True)
class Dirichlet:
    """Prescribed temperature u(x, t) on one edge.

    Parameters
    ----------
    temperature : float or callable (x, t) [K]
        A constant, or a function of positions of shape (k, 2) and the time.
    transform : callable (x, s), optional [K s]
        Its Laplace transform; needed for ``scheme="laplace"`` unless the temperature is constant.

    Examples
    --------
    >>> Dirichlet(300.0).sample(np.zeros((2, 2)), 0.0)
    array([300., 300.])
    """

    temperature: Data
    transform: Transform | None = None

    def coefficients(self) -> tuple[float, float]:
        """(B1, B2) of B1 u + B2 k du/dn = B3."""
        return 1.0, 0.0

    @property
    def data(self) -> Data:
        """The prescribed value."""
        return self.temperature

    @property
    def factor(self) -> float:
        """B3 is this factor times the data."""
        return 1.0

    def sample(self, points: Floats, t: float) -> Floats:
        """B3 at points and a time."""
        return sample(self.data, points, t, "a prescribed temperature")


@dataclass(frozen=True)
class Neumann:
    """Prescribed heat flux into the body, k du/dn = q_in, on one edge.

    Parameters
    ----------
    flux_in : float or callable (x, t) [W/m2]
        Positive heats the body; 0 insulates it.
    transform : callable (x, s), optional [W s/m2]
        Its Laplace transform, as for Dirichlet.
    """

    flux_in: Data
    transform: Transform | None = None

    def coefficients(self) -> tuple[float, float]:
        """(B1, B2) of B1 u + B2 k du/dn = B3."""
        return 0.0, 1.0

    @property
    def data(self) -> Data:
        """The prescribed value."""
        return self.flux_in

    @property
    def factor(self) -> float:
        """B3 is this factor times the data."""
        return 1.0

    def sample(self, points: Floats, t: float) -> Floats:
        """B3 at points and a time."""
        return sample(self.data, points, t, "a prescribed heat flux")


@dataclass(frozen=True)
class Convective:
    """Heat exchange -k du/dn = h (u - u_ambient) on one edge.

    Parameters
    ----------
    coefficient : float [W/(m2 K)]
        h, positive.
    ambient : float or callable (x, t) [K]
        The ambient temperature.
    transform : callable (x, s), optional [K s]
        Its Laplace transform, as for Dirichlet.
    """

    coefficient: float
    ambient: Data
    transform: Transform | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.coefficient) and self.coefficient > 0.0):
            raise InputError(
                f"a heat transfer coefficient must be positive and finite, found {self.coefficient}: "
                "write Neumann(0) for an insulated edge"
            )

    def coefficients(self) -> tuple[float, float]:
        """(B1, B2) of B1 u + B2 k du/dn = B3."""
        return self.coefficient, 1.0

    @property
    def data(self) -> Data:
        """The prescribed value."""
        return self.ambient

    @property
    def factor(self) -> float:
        """B3 is this factor times the data."""
        return self.coefficient

    def sample(self, points: Floats, t: float) -> Floats:
        """B3 at points and a time."""
        return self.coefficient * sample(self.data, points, t, "an ambient temperature")


BoundaryCondition = Dirichlet | Neumann | Convective


@dataclass(frozen=True, eq=False)
class HeatProblem:
    """Transient conduction k lap u + Q = rho c du/dt in a homogeneous plane body.

    Parameters
    ----------
    vertices : sequence of (x, y), optional [m]
        Corners of a simple polygon; edge i runs from vertex i to vertex i + 1. Give this or ``disk``.
    conductivity : float [W/(m K)]
        k, positive.
    heat_capacity : float [J/(m3 K)]
        rho c, positive.
    initial : float or callable (x) [K]
        Initial temperature; a callable takes positions of shape (n, 2) and returns (n,) values.
    boundary : sequence of Dirichlet, Neumann or Convective
        One condition per edge, in the order of the edges.
    source : float or callable (x, t), optional [W/m3]
        Heat source Q.
    source_transform : callable (x, s), optional [J/m3]
        Laplace transform of Q, needed for ``scheme="laplace"`` unless Q is constant.
    disk : Disk, optional
        A disk instead of a polygon; its breaks cut the circle into edges.

    Raises
    ------
    InputError
        If a material constant is not positive, or the number or kind of boundary conditions does not fit.
    GeometryError
        If the polygon is not simple.

    Examples
    --------
    >>> square = HeatProblem(vertices=[(0, 0), (3, 0), (3, 3), (0, 3)], conductivity=1.25,
    ...                      heat_capacity=1.0, initial=30.0, boundary=[Dirichlet(0.0)] * 4)
    >>> square.domain.area
    9.0
    """

    vertices: Sequence[Sequence[float]] | Floats | None = None
    conductivity: float = field(kw_only=True)
    heat_capacity: float = field(kw_only=True)
    initial: float | Callable[[Floats], Floats | float] = field(kw_only=True)
    boundary: Sequence[BoundaryCondition] = field(kw_only=True)
    source: Data | None = field(default=None, kw_only=True)
    source_transform: Transform | None = field(default=None, kw_only=True)
    disk: Disk | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        for name, value in (("conductivity", self.conductivity), ("heat_capacity", self.heat_capacity)):
            if not (isinstance(value, int | float | np.number) and np.isfinite(value) and value > 0.0):
                raise InputError(f"the {name} must be a positive finite number, found {value!r}")
        if (self.vertices is None) == (self.disk is None):
            raise InputError("a heat problem needs either polygon vertices or a disk: give exactly one of them")
        boundary = tuple(self.boundary)
        edges = len(self.domain.edge_lengths)
        if len(boundary) != edges:
            raise InputError(f"the body has {edges} edges but {len(boundary)} boundary conditions: give one per edge")
        for edge, condition in enumerate(boundary):
            if not isinstance(condition, Dirichlet | Neumann | Convective):
                raise InputError(
                    f"boundary condition {edge} is {condition!r}: expected Dirichlet, Neumann or Convective"
                )
        object.__setattr__(self, "boundary", boundary)

    @cached_property
    def domain(self) -> Domain:
        """The body."""
        if self.disk is not None:
            return self.disk
        assert self.vertices is not None
        return Polygon(np.asarray(self.vertices, dtype=float))

    @property
    def diffusivity(self) -> float:
        """Thermal diffusivity k / (rho c) [m2/s]."""
        return self.conductivity / self.heat_capacity

    def initial_values(self, points: Floats) -> Floats:
        """Initial temperature at points [K]."""
        if callable(self.initial):
            initial = self.initial
            return sample(lambda x, _: initial(x), points, 0.0, "the initial temperature")
        return sample(self.initial, points, 0.0, "the initial temperature")

    def source_values(self, points: Floats, t: float) -> Floats:
        """Heat source at points [W/m3]."""
        return sample(0.0 if self.source is None else self.source, points, t, "the heat source")


def sample(data: Data, points: Floats, t: float, what: str) -> Floats:
    """Constant or callable data at points and a time, checked for shape and finiteness.

    Raises
    ------
    InputError
        If a callable returns another shape than (k,) or one number, or a value is not finite.
    """
    values = data(points, t) if callable(data) else data
    try:
        values = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} must be real numbers, found {values!r}") from error
    if values.shape not in ((), (len(points),)):
        raise InputError(
            f"{what} returned an array of shape {values.shape} for positions of shape {points.shape}: "
            f"expected ({len(points)},) or one number (x[:, 0] is the first coordinate)"
        )
    if not np.isfinite(values).all():
        raise InputError(f"{what} is not finite at t = {t:g}: found {values[~np.isfinite(values)].ravel()[0]}")
    return np.broadcast_to(values, (len(points),)).copy()


def transformed(data: Data, transform: Transform | None, points: Floats, s: complex, what: str) -> Field:
    """Laplace transform of data at points: c/s for a constant, otherwise the transform that came with it.

    Raises
    ------
    InputError
        If the data is a function of time without a transform.
    """
    if transform is None:
        if callable(data):
            raise InputError(
                f"{what} is a function without a Laplace transform: give transform=U(x, s) with it, or "
                "choose a marching scheme (sdirk2, bdf2, crank-nicolson, backward-euler)"
            )
        return np.full(len(points), float(data) / s, dtype=complex)
    values = np.asarray(transform(points, s), dtype=complex)
    if values.shape not in ((), (len(points),)) or not np.isfinite(values).all():
        raise InputError(
            f"the Laplace transform of {what} returned shape {values.shape} (or values that are not finite) "
            f"for {len(points)} positions at s = {s:g}"
        )
    return np.broadcast_to(values, (len(points),)).copy()
