"""Temperature inside one disk heated through its contact arcs, and the lumped relation beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.discretization import Discretization
from etc_engine.engines.meshless.domain import Disk
from etc_engine.engines.meshless.problem import HeatProblem, Neumann
from etc_engine.engines.meshless.solve import Scheme, solve_transient
from etc_engine.errors import GeometryError, InputError

if TYPE_CHECKING:
    import xarray

#: Heat through one contact per unit thickness [W/m]: a constant or a function of time.
HeatHistory = float | Callable[[float], float]

CELLS_PER_HALF_ANGLE = 8
FEWEST_CELLS, MOST_CELLS = 240, 1440
GAUSS_POINTS = 10
SERIES_TERMS = 40000


@dataclass(frozen=True)
class ContactArc:
    """Contact zone of a disk.

    Parameters
    ----------
    theta : float [rad]
        Position angle of its middle.
    half_angle : float [rad]
        Contact half-angle alpha, between 0 and pi/2.
    """

    theta: float
    half_angle: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.theta) and 0.0 < self.half_angle < 0.5 * np.pi):
            raise GeometryError(
                f"a contact arc needs a finite angle and a half-angle between 0 and pi/2 rad, found theta = "
                f"{self.theta}, half_angle = {self.half_angle}"
            )


def arc_resistances(arcs: Sequence[ContactArc], conductivity: float) -> Floats:
    """Resistances h'_ij between contact arcs with uniform flux, shape (n, n) [m K/W].

    h'_ij = 1/(pi kappa) sum_{k >= 1} cos(k (theta_i - theta_j)) sinc(k alpha_i) sinc(k alpha_j)/k,
    sinc(x) = sin(x)/x: the kernel -ln|2 sin(x/2)| averaged over both arcs.

    References
    ----------
    Feng, Han, Li and Owen (2008), Int. J. Numer. Meth. Engng, the resistance integral of the discrete
    thermal element.

    Examples
    --------
    >>> arcs = [ContactArc(0.0, 0.1), ContactArc(3.141592653589793, 0.1)]
    >>> arc_resistances(arcs, 1.0).round(4)
    array([[ 0.9899, -0.2204],
           [-0.2204,  0.9899]])
    """
    k = np.arange(1, SERIES_TERMS + 1)
    theta = np.array([arc.theta for arc in arcs])
    damped = np.array([np.sin(k * arc.half_angle) / (k * arc.half_angle) for arc in arcs])
    cosine, sine = damped * np.cos(np.outer(theta, k)), damped * np.sin(np.outer(theta, k))
    return np.asarray(((cosine / k) @ cosine.T + (sine / k) @ sine.T) / (np.pi * conductivity))


def lumped_arc_temperatures(
    arcs: Sequence[ContactArc], conductivity: float, heat: Floats, mean_temperature: Floats
) -> Floats:
    """Arc temperatures of the lumped model, shape (nt, n) [K].

    T_i - T_o = sum_j h'_ij Q_j + S/(8 pi kappa), S = sum_j Q_j: the quasi-steady field of constant fluxes, in
    which all of the disk warms at the same rate.

    Parameters
    ----------
    arcs : sequence of ContactArc
        The n contact arcs.
    conductivity : float [W/(m K)]
        kappa of the disk.
    heat : ndarray, shape (nt, n) [W/m]
        Heat Q_j entering through each arc.
    mean_temperature : ndarray, shape (nt,) [K]
        Mean temperature T_o of the disk.
    """
    steady = heat @ arc_resistances(arcs, conductivity)
    return np.asarray(
        mean_temperature[:, None] + steady + heat.sum(axis=1, keepdims=True) / (8.0 * np.pi * conductivity)
    )


def heat_disk_through_arcs(
    arcs: Sequence[ContactArc],
    heat: Sequence[HeatHistory],
    times: Sequence[float] | Floats,
    *,
    radius: float = 1.0,
    conductivity: float = 1.0,
    heat_capacity: float = 1.0,
    initial: float = 0.0,
    points: Sequence[Sequence[float]] | Floats = ((0.0, 0.0),),
    scheme: Scheme = "sdirk2",
    steps: int = 200,
    discretization: Discretization | None = None,
) -> xarray.Dataset:
    """Transient temperature inside a disk (centre at the origin) heated through its contact arcs.

    Each arc carries a uniform flux Q_i(t)/(2 alpha_i R) - what a transient discrete element or pipe network
    hands over; the rest of the circle is insulated.

    Parameters
    ----------
    arcs : sequence of ContactArc
        Contact arcs, not overlapping.
    heat : sequence of float or callable (t) [W/m]
        Heat entering through each arc per unit thickness.
    times : sequence of float [s]
        Output times, increasing.
    radius, conductivity, heat_capacity, initial : float
        R [m], kappa [W/(m K)], rho c [J/(m3 K)] and the initial temperature [K].
    points : array_like, shape (k, 2) [m]
        Where the field is wanted.
    scheme : str
        As in ``solve_transient``; "laplace" needs constant heat.
    steps : int
        Time steps up to the last output time.
    discretization : Discretization, optional
        By default fine enough for eight boundary nodes per half-angle, Trefftz functions.

    Returns
    -------
    xarray.Dataset
        That of ``solve_transient`` and, per arc, ``arc_temperature`` (mean over the arc),
        ``lumped_arc_temperature`` (from the mean temperature of the disk and the heat of the moment) and
        ``heat_input``.

    Raises
    ------
    GeometryError
        If arcs overlap, or are too narrow for the default nodes.
    InputError
        If the number of heat histories does not fit.

    Examples
    --------
    >>> result = heat_disk_through_arcs([ContactArc(0.0, 0.5)], [1.0], [1.0], scheme="laplace")
    >>> round(float(result.mean_temperature[0]), 4), round(float(result.arc_temperature[0, 0]), 3)
    (0.3183, 0.83)
    """
    if len(heat) != len(arcs):
        raise InputError(f"{len(arcs)} contact arcs need as many heat histories, found {len(heat)}")
    _refuse_overlap(arcs)
    chosen = discretization or _fine_enough(arcs)
    if not isinstance(chosen.boundary, int):
        raise InputError("contact arcs need equally spaced boundary nodes: give their number")
    cell = 2.0 * np.pi / chosen.boundary
    density = np.array([1.0 / (2.0 * arc.half_angle * radius) for arc in arcs])

    def flux(x: Floats, t: float) -> Floats:
        covered = np.array([_covered(arc, np.arctan2(x[:, 1], x[:, 0]), cell) for arc in arcs])
        return np.asarray((_heat_at(heat, t) * density) @ covered)

    constant = not any(callable(history) for history in heat)
    problem = HeatProblem(
        disk=Disk((0.0, 0.0), radius),
        conductivity=conductivity,
        heat_capacity=heat_capacity,
        initial=initial,
        boundary=[Neumann(flux, (lambda x, s: flux(x, 0.0) / s) if constant else None)],
    )
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    angles = np.concatenate([arc.theta + arc.half_angle * nodes for arc in arcs])
    on_arcs = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    places = np.vstack([np.asarray(points, dtype=float), on_arcs])
    result = solve_transient(problem, times, places, scheme=scheme, steps=steps, discretization=chosen)
    at_arcs = result.temperature.values[:, -len(angles) :].reshape(len(result.time), len(arcs), GAUSS_POINTS)
    inputs = np.array([_heat_at(heat, float(t)) for t in result.time])
    return _with_arcs(
        result.isel(point=slice(0, len(places) - len(angles))),
        arcs,
        at_arcs @ (0.5 * weights),
        inputs,
        problem,
    )


def _with_arcs(
    result: xarray.Dataset,
    arcs: Sequence[ContactArc],
    temperatures: Floats,
    inputs: Floats,
    problem: HeatProblem,
) -> xarray.Dataset:
    """Add the readings per arc."""
    mean = result.mean_temperature.values
    lumped = lumped_arc_temperatures(arcs, problem.conductivity, inputs, mean)
    per_arc = ("time", "arc")
    return result.assign(
        arc_temperature=(
            per_arc,
            temperatures,
            {"units": "K", "long_name": "mean temperature of a contact arc"},
        ),
        lumped_arc_temperature=(
            per_arc,
            lumped,
            {"units": "K", "long_name": "the same by the lumped relation"},
        ),
        heat_input=(per_arc, inputs, {"units": "W m-1", "long_name": "heat entering through a contact arc"}),
    ).assign_coords(
        theta=(
            "arc",
            [arc.theta for arc in arcs],
            {"units": "rad", "long_name": "position angle of the arc"},
        ),
        half_angle=(
            "arc",
            [arc.half_angle for arc in arcs],
            {"units": "rad", "long_name": "contact half-angle"},
        ),
    )


def _heat_at(heat: Sequence[HeatHistory], t: float) -> Floats:
    values = np.array([history(t) if callable(history) else history for history in heat], dtype=float)
    if not np.isfinite(values).all():
        raise InputError(f"the heat through the contact arcs is not finite at t = {t:g}: found {values.tolist()}")
    return values


def _covered(arc: ContactArc, angle: Floats, cell: float) -> Floats:
    """Part of the cell of width ``cell`` about each angle that the arc covers: heat is kept exactly."""
    distance = np.abs(np.mod(angle - arc.theta + np.pi, 2.0 * np.pi) - np.pi)
    overlap = np.minimum(distance + 0.5 * cell, arc.half_angle) - np.maximum(distance - 0.5 * cell, -arc.half_angle)
    return np.clip(overlap / cell, 0.0, 1.0)


def _fine_enough(arcs: Sequence[ContactArc]) -> Discretization:
    narrowest = min(arc.half_angle for arc in arcs)
    cells = max(FEWEST_CELLS, int(np.ceil(2.0 * np.pi * CELLS_PER_HALF_ANGLE / narrowest)))
    if cells > MOST_CELLS:
        if 2.0 * np.pi * 2 / narrowest > MOST_CELLS:
            raise GeometryError(
                f"a contact half-angle of {narrowest:.3g} rad is too narrow for {MOST_CELLS} boundary nodes: "
                "give your own discretization"
            )
        cells = MOST_CELLS
    # the flux jumps at the ends of the arcs, which no smooth function follows point by point
    return Discretization(boundary=cells, interior=1000, functions=cells // 2 + 1, residual_limit=np.inf)


def _refuse_overlap(arcs: Sequence[ContactArc]) -> None:
    if not arcs:
        raise GeometryError("a disk heated through contact arcs needs at least one of them")
    order = sorted(range(len(arcs)), key=lambda i: arcs[i].theta % (2.0 * np.pi))
    for here, there in zip(order, [*order[1:], order[0]], strict=True):
        a, b = arcs[here], arcs[there]
        gap = (b.theta - a.theta) % (2.0 * np.pi) or 2.0 * np.pi
        if gap < a.half_angle + b.half_angle - 1e-12:
            raise GeometryError(
                f"contact arcs {here} and {there} overlap: their middles are {gap:.4g} rad apart, their "
                f"half-angles add to {a.half_angle + b.half_angle:.4g} rad"
            )
