"""Constants of models fitted to a sweep by least squares, with confidence intervals."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.comparison.simulation import phases, simulated
from etc_engine.models.filled_polymers import agari_uno, lewis_nielsen
from etc_engine.sweep.statistics import student_t

if TYPE_CHECKING:
    import xarray


OPEN = 1.0
"""An interval wider than this many times the value leaves the constant open."""

UNDETERMINED = "not determined by these densities"


@dataclass(frozen=True)
class Parameter:
    """A fitted constant; ``low`` and ``high`` end its confidence interval, NaN where the data do not bound it.

    Examples
    --------
    >>> Parameter("threshold", 0.3653, -0.81, 1.54).determined, Parameter("exponent", 1.303, 1.251, 1.356).determined
    (False, True)
    """

    name: str
    value: float
    low: float
    high: float

    @property
    def determined(self) -> bool:
        """Whether the data determine the constant: its interval is finite and narrower than `OPEN` times its value."""
        return bool(self.high - self.low <= OPEN * abs(self.value))


@dataclass(frozen=True)
class Fit:
    """A model fitted to conductivities over the density.

    Parameters
    ----------
    model : str
    selection : dict
        Values of the dimensions of the sweep, besides the density, at which the points are.
    points : int
        Number of densities that entered.
    parameters : tuple of Parameter
        Empty if there is no fit.
    rms_relative_residual : float
    note : str
        Why there is no fit, or what limits it.
    """

    model: str
    selection: dict[str, Any]
    points: int
    parameters: tuple[Parameter, ...] = ()
    rms_relative_residual: float = np.nan
    note: str = ""

    @property
    def constants(self) -> str:
        """The constants with their intervals, in words; without numbers where the data do not determine them."""
        found = [f"{p.name} {p.value:.4g} [{p.low:.4g}, {p.high:.4g}]" for p in self.parameters if p.determined]
        open_ones = " and ".join(p.name for p in self.parameters if not p.determined)
        return ", ".join([*found, *([f"{open_ones} {UNDETERMINED}"] if open_ones else [])])


@dataclass(frozen=True)
class _Form:
    """A curve k(f; constants) with its start and the range of its constants."""

    model: str
    names: tuple[str, ...]
    curve: Callable[..., Floats]
    start: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class _Points:
    """Solid fraction, conductivity, and its relative standard error or None for points that weigh alike."""

    f: Floats
    k: Floats
    error: Floats | None


@dataclass(frozen=True)
class _Two:
    """Conductivities of pores and particles [W/(m K)], and the dimension."""

    pores: float
    particles: float
    dimension: int


ENOUGH = 5
"""A standard error of fewer realizations is too uncertain to be a weight."""


def fit_models(dataset: xarray.Dataset) -> tuple[Fit, ...]:
    r"""Percolation, Lewis-Nielsen and Agari-Uno constants of a sweep over the density.

    .. math:: k = a (f - f_c)^t

    for the percolation law; the others as in `etc_engine.models`. Least squares of log k, each point weighted by its
    relative standard error if all have `ENOUGH` realizations for one, else all points alike.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    tuple of Fit
        One per model and combination of the other dimensions.

    Notes
    -----
    A fit needs at least one more point (density with k > 0) than constants. Intervals are those of the linearized
    problem, Student's t of the residual's degrees of freedom times the standard error, at the confidence level of
    the study: they show how well the points determine the constants, not that the law holds. The exponent is
    universal close to the threshold only; points far from it give an effective one.

    Lewis-Nielsen and Agari-Uno describe a conducting matrix, so the study has to give the pores a conductivity.
    """
    medium, simulation = phases(dataset), simulated(dataset)
    confidence = float(dataset.attrs.get("confidence_level", 0.95))
    swept = [dim for dim in simulation["conductivity_mean"].dims if dim != "density"]
    fits = []
    for values in itertools.product(*(simulation[dim].values.tolist() for dim in swept)):
        selection = dict(zip(map(str, swept), values, strict=True))
        cell = simulation.sel(selection)
        two = _Two(float(cell["pore_conductivity"]), float(cell["particle_conductivity"]), medium.dimension)
        fraction, k = cell["solid_fraction"].values, cell["conductivity_mean"].values
        used = np.isfinite(fraction) & (np.nan_to_num(k) > 0.0)
        error = cell["conductivity_sem"].values[used] / k[used]
        weighted = (cell["count"].values[used] >= ENOUGH) & (np.nan_to_num(error) > 1e-9)
        points = _Points(fraction[used], k[used], error if weighted.all() else None)
        fits += _fit_all(points, two, selection, confidence)
    return tuple(fits)


def _fit_all(points: _Points, medium: _Two, selection: dict[str, Any], confidence: float) -> list[Fit]:
    f = points.f
    if f.size < 3 or np.ptp(f) <= 0.0:
        return [Fit("percolation_power_law", selection, f.size, note="needs conductivities at 4 densities or more")]
    if medium.pores > 0.0:
        fits = [Fit("percolation_power_law", selection, f.size, note="needs pores that insulate")]
    else:
        fits = [_fit(_percolation(f, points.k), points, selection, confidence)]
    if medium.pores <= 0.0:
        note = "needs pores that conduct"
        return [
            *fits,
            Fit("lewis_nielsen", selection, f.size, note=note),
            Fit("agari_uno", selection, f.size, note=note),
        ]
    fits.append(_fit(_lewis_nielsen(f, medium), points, selection, confidence))
    if abs(np.log(medium.particles)) < 1e-6:
        note = "C2 has no effect where the particles have 1 W/(m K), the unit of the formula"
        return [*fits, Fit("agari_uno", selection, f.size, note=note)]
    return [*fits, _fit(_agari_uno(medium), points, selection, confidence)]


def _percolation(f: Floats, k: Floats) -> _Form:
    def curve(x: Floats, threshold: float, exponent: float, log_prefactor: float) -> Floats:
        return log_prefactor + exponent * np.log(x - threshold)

    lowest, span = float(f.min()), float(np.ptp(f))
    start, exponent = lowest - 0.1 * span, 1.3
    prefactor = float(np.mean(np.log(k) - exponent * np.log(f - start)))
    return _Form(
        "percolation_power_law",
        ("threshold", "exponent", "prefactor"),
        curve,
        (start, exponent, prefactor),
        (-1.0, 1e-3, -np.inf),
        (lowest - 1e-9 * span, 50.0, np.inf),
    )


def _lewis_nielsen(f: Floats, medium: _Two) -> _Form:
    def curve(x: Floats, shape: float, limit: float) -> Floats:
        k = lewis_nielsen(medium.pores, medium.particles, x, shape, limit, dimension=medium.dimension)
        return np.log(np.where(k > 0.0, k, 1e-300))

    lowest = float(f.max()) * (1.0 + 1e-9)
    return _Form(
        "lewis_nielsen",
        ("shape_factor", "maximum_fraction"),
        curve,
        (medium.dimension - 1.0, 0.5 * (lowest + 1.0)),
        (1e-6, lowest),
        (1e6, 1.0),
    )


def _agari_uno(medium: _Two) -> _Form:
    def curve(x: Floats, matrix: float, chain: float) -> Floats:
        return np.log(agari_uno(medium.pores, medium.particles, x, matrix, chain))

    return _Form("agari_uno", ("matrix_factor", "chain_factor"), curve, (1.0, 1.0), (1e-6, -50.0), (1e6, 50.0))


def _fit(form: _Form, points: _Points, selection: dict[str, Any], confidence: float) -> Fit:
    """Least squares of log k; the interval of every constant from the covariance of the linearized problem."""
    from scipy.optimize import OptimizeWarning, curve_fit

    f, k = points.f, points.k
    spare = f.size - len(form.names)
    if spare < 1:
        return Fit(
            form.model, selection, f.size, note=f"needs conductivities at {len(form.names) + 1} densities or more"
        )
    if any(low >= high for low, high in zip(form.low, form.high, strict=True)):
        return Fit(form.model, selection, f.size, note="no room for its constants at these solid fractions")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OptimizeWarning)  # an infinite covariance says the same
            values, covariance = curve_fit(
                form.curve,
                f,
                np.log(k),
                p0=form.start,
                sigma=points.error,
                bounds=(form.low, form.high),
                x_scale="jac",
                max_nfev=5000,
            )
    except (RuntimeError, ValueError) as error:
        return Fit(form.model, selection, f.size, note=f"no least-squares fit: {error}")
    for name, value, *ends in zip(form.names, values, form.low, form.high, strict=True):
        if np.isclose(value, ends, rtol=1e-4, atol=1e-12).any():
            note = f"{name} runs to the end of its range: the law does not describe these points"
            return Fit(form.model, selection, f.size, note=note)
    widths = student_t(confidence, spare + 1) * np.sqrt(np.diag(covariance))
    parameters = tuple(map(_parameter, form.names, values, widths))
    residual = np.expm1(form.curve(f, *values) - np.log(k))
    return Fit(form.model, selection, f.size, parameters, float(np.sqrt(np.mean(residual**2))))


def _parameter(name: str, value: float, width: float) -> Parameter:
    """The fitted constant; a prefactor is fitted, and bounded, by its logarithm."""
    width = width if np.isfinite(width) else np.nan
    low, high = float(value - width), float(value + width)
    if name == "prefactor":
        with np.errstate(over="ignore"):
            return Parameter(name, float(np.exp(value)), float(np.exp(low)), float(np.exp(high)))
    return Parameter(name, float(value), low, high)
