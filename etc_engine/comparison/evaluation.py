"""Closed-form models on the dimensions of a sweep, their differences, and the bounds that bind."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from etc_engine.comparison.simulation import Phases, half_trace, phases, simulated, study_of
from etc_engine.errors import InputError
from etc_engine.models import evaluate
from etc_engine.models.bounds import parallel, series
from etc_engine.models.catalogue import find_model
from etc_engine.realization import Status

if TYPE_CHECKING:
    import xarray

MEAN_FIELD = "contact_mean_field"
"""The model whose value is not a formula of the solid fraction: the sweep computes it on its own networks."""

DEFAULT_MODELS = (
    "hashin_shtrikman_lower",
    "hashin_shtrikman_upper",
    "maxwell",
    "effective_medium",
    "differential",
    "differential_inverse",
    MEAN_FIELD,
)

COMPOSITE_MODELS = (
    "hashin_shtrikman_lower",
    "hashin_shtrikman_upper",
    "maxwell",
    "third_order",
    "effective_medium",
    "differential",
)
"""Those of a composite, whose particles need no contacts."""

BINDING = ("series", "parallel", "hashin_shtrikman_lower", "hashin_shtrikman_upper")
"""Bounds of every isotropic two-phase medium; three-point bounds hold for their own zeta2 only."""

ROUNDING = 1e-9
"""A bound is broken when it is passed by more than this part of it."""

Models = Sequence[str] | Mapping[str, Mapping[str, float]]


def evaluate_models(dataset: xarray.Dataset, models: Models | None = None) -> xarray.Dataset:
    """Closed-form models beside the simulated conductivity, cell by cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.
    models : sequence of str, or mapping of str to parameters, optional
        Names of the catalogue, or names with their further inputs. By default those of the study, and
        `DEFAULT_MODELS` if it names none. The Hashin-Shtrikman bounds are always there.

    Returns
    -------
    xarray.Dataset
        On ``model`` and the dimensions of the sweep: ``model_conductivity`` [W/(m K)],
        ``relative_difference`` (model - simulation)/simulation, ``outside_bound`` (the simulation lies beyond
        this bound) and ``bound_broken`` (and the bound binds this geometry). Without ``model``: the simulated
        conductivity with its interval (see `etc_engine.comparison.simulation.simulated`), ``inside_bounds``,
        ``realizations_outside_bounds``. Over the densities: ``rms_relative_difference`` and ``best_model``,
        among estimates. Coordinates ``model_kind``, ``model_title`` and ``model_note`` (why a value is
        missing, or 0). Attributes: ``bounds_bind``, ``bound_broken``, ``best_model``, the phases, and
        ``model_parameters`` as JSON.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, or a model or a parameter is not known.

    Notes
    -----
    k1 is the study's ``pore_conductivity`` (of a composite, the matrix), k2 the conductivity of the particles, the
    fraction the mean solid fraction of the density. Where the pores insulate (k1 = 0) every model with the pores as its
    matrix is 0: Maxwell, differential medium, lower Hashin-Shtrikman. The contact mean field is the sweep's own, on the
    networks it solved; it takes the pipe resistance of the ``chord`` method whatever the method.

    The bounds bind a body whose two phases are what the solid fraction says: overlapping disks, and composites (there
    beyond the interval of the mean and the estimated error of the discretization). A bonded contact conducts through a
    neck that the solid fraction does not count, so for it they are a comparison. The Hashin-Shtrikman bounds are for
    the mean over isotropic ensembles; every single realization and direction is held against the Wiener bounds (series,
    parallel) of its own solid fraction, which need no isotropy. The pores of a contact network insulate: if the study
    gives them a conductivity, a simulation below the lower bound says that their heat may not be left out.
    """
    import xarray

    media = phases(dataset)
    medium = media[0]
    parameters = _with_bounds(_wanted(dataset, models))
    simulation = simulated(dataset)
    fraction = simulation["solid_fraction"]
    columns, notes = [], []
    for name, values in parameters.items():
        if name == MEAN_FIELD and "mean_field_conductivity" in dataset and not values:
            valid = dataset["status"] <= int(Status.NOT_PERCOLATING)
            columns.append(dataset["mean_field_conductivity"].where(valid).mean("realization"))
            notes.append("")
        else:
            curves = [model_curve(name, one, fraction.values, values) for one in media]
            columns.append(_by_contrast([fraction.copy(data=curve) for curve, _ in curves], simulation))
            notes.append(next((note for _, note in curves if note), ""))
    result = simulation
    k = result["conductivity_mean"]
    labels = xarray.DataArray(np.array(list(parameters), dtype=object), dims="model", name="model")
    columns = [column.broadcast_like(k).transpose(*k.dims) for column in columns]
    result["model_conductivity"] = xarray.concat(columns, dim=labels, coords="minimal", compat="override")
    records = [find_model(name) for name in parameters]
    result = result.assign_coords(
        model_kind=("model", np.array([model.kind for model in records], dtype=object)),
        model_title=("model", np.array([model.title for model in records], dtype=object)),
        model_note=("model", np.array(notes, dtype=object)),
    )
    result.attrs |= {
        "pore_conductivity": medium.pores,
        "particle_conductivity": medium.particles if len(media) == 1 else [one.particles for one in media],
        "composite": int(medium.composite),
        "dimension": medium.dimension,
        "model_parameters": json.dumps({name: dict(values) for name, values in parameters.items()}),
    }
    _add_differences(result)
    _add_bounds(result, dataset, media)
    _add_best(result)
    for name, (meaning, units) in _MEANINGS.items():
        result[name].attrs |= {"long_name": meaning, "units": units}
    return result


def _by_contrast(columns: Sequence[xarray.DataArray], simulation: xarray.Dataset) -> xarray.DataArray:
    """One column, or one a contrast side by side."""
    import xarray

    if "contrast" not in simulation.dims:
        return columns[0]
    return xarray.concat(columns, dim=simulation["contrast"])


def model_curve(
    name: str, medium: Phases, fraction: NDArray[np.float64], parameters: Mapping[str, float] | None = None
) -> tuple[NDArray[np.float64], str]:
    """A model over solid fractions, NaN where it has no value, and a note that says why or why it is 0.

    Parameters
    ----------
    name : str
        A name of the catalogue.
    medium : Phases
        Conductivities and dimension.
    fraction : ndarray, shape (n,)
        Solid fractions; NaN where there is none.
    parameters : mapping, optional
        Further inputs of the model.

    Returns
    -------
    conductivity : ndarray, shape (n,) [W/(m K)]
    note : str

    Examples
    --------
    >>> model_curve("maxwell_inverse", Phases(0.0, 1.0, 2, True), np.array([0.8, 1.0]))[0].round(6)
    array([0.666667, 1.      ])
    >>> model_curve("maxwell", Phases(0.0, 1.0, 2, True), np.array([0.8]))
    (array([0.]), 'is 0: the pores insulate')
    """
    values, reasons = np.full(fraction.shape, np.nan), []
    for i, f in enumerate(fraction):
        if np.isnan(f):
            continue
        try:
            values[i] = evaluate(
                name,
                k1=medium.pores,
                k2=medium.particles,
                fraction=float(f),
                dimension=medium.dimension,
                **(parameters or {}),
            )
        except InputError as error:
            reasons.append(str(error))
    if reasons:
        return values, reasons[0]
    zero = medium.pores == 0.0 and bool((values[~np.isnan(values)] == 0.0).all())
    return values, "is 0: the pores insulate" if zero else ""


def model_lines(comparison: xarray.Dataset, points: int = 60) -> xarray.Dataset:
    """The models of a comparison on many densities, for smooth lines.

    Parameters
    ----------
    comparison : xarray.Dataset
        From `evaluate_models`.
    points : int
        Number of densities; those of the sweep if it has fewer than two with a solid fraction.

    Returns
    -------
    xarray.Dataset
        ``model_conductivity`` on ``model``, ``density`` and, if there, ``contrast``, with the solid fraction
        interpolated between the densities of the sweep. Without the contact mean field, which has values on the sweep
        only.
    """
    import xarray

    density, fraction = comparison["density"].values, comparison["solid_fraction"].values
    known = np.isfinite(fraction)
    if known.sum() >= 2:
        fine = np.linspace(density[known][0], density[known][-1], points)
        density, fraction = fine, np.interp(fine, density[known], fraction[known])
    attrs = comparison.attrs
    media = [
        Phases(attrs["pore_conductivity"], float(particles), attrs["dimension"], bool(attrs["bounds_bind"]))
        for particles in np.atleast_1d(attrs["particle_conductivity"])
    ]
    parameters = json.loads(attrs["model_parameters"])
    names = [str(name) for name in comparison["model"].values if str(name) != MEAN_FIELD]
    values = np.array([[model_curve(name, one, fraction, parameters[name])[0] for one in media] for name in names])
    lines = xarray.Dataset({"model_conductivity": (("model", "contrast", "density"), values)})
    lines = lines.assign_coords(model=np.array(names, dtype=object), density=density)
    if "contrast" not in comparison.dims:
        return lines.isel(contrast=0)
    return lines.assign_coords(contrast=comparison["contrast"].values)


def _wanted(dataset: xarray.Dataset, models: Models | None) -> dict[str, Mapping[str, float]]:
    """Names and parameters asked for, checked."""
    if models is None:
        study = study_of(dataset)
        models = study["models"]["names"] or (DEFAULT_MODELS if study.get("composite") is None else COMPOSITE_MODELS)
    wanted = dict(models) if isinstance(models, Mapping) else {name: {} for name in models}
    for name, parameters in wanted.items():
        known = {item.name for item in find_model(name).inputs} - {"k1", "k2", "fraction"}
        strange = sorted(set(parameters) - known)
        if strange:
            allowed = ", ".join(sorted(known)) or "none"
            raise InputError(f"model {name} has no parameter {strange[0]!r}; its parameters are: {allowed}")
    return wanted


def _with_bounds(wanted: dict[str, Mapping[str, float]]) -> dict[str, Mapping[str, float]]:
    return {"hashin_shtrikman_lower": {}, "hashin_shtrikman_upper": {}, **wanted}


def _add_differences(result: xarray.Dataset) -> None:
    k = result["conductivity_mean"]
    result["relative_difference"] = (result["model_conductivity"] - k) / k.where(k > 0.0)
    square = (result["relative_difference"] ** 2).where(k > 0.0, 0.0)  # a model without a value somewhere has no mean
    points = (k > 0.0).sum("density")
    result["rms_relative_difference"] = np.sqrt(square.sum("density", skipna=False) / points.where(points > 0))


def _add_bounds(result: xarray.Dataset, dataset: xarray.Dataset, media: Sequence[Phases]) -> None:
    k, model = result["conductivity_mean"], result["model_conductivity"]
    kind, binding = result["model_kind"], media[0].overlapping
    slack = ROUNDING + _doubt(result, dataset, media[0])
    above = (kind == "upper bound") & (k > model * (1.0 + slack))
    below = (kind == "lower bound") & (k < model * (1.0 - slack))
    result["outside_bound"] = (above | below).transpose(*model.dims)
    universal = result["model"].isin(BINDING)
    outside = (result["outside_bound"] & universal).any("model")
    result["realizations_outside_bounds"] = _outside_wiener(result, dataset, media)
    result["inside_bounds"] = ~outside & (result["realizations_outside_bounds"] == 0)
    result["bound_broken"] = result["outside_bound"] & universal & binding
    broken = binding and not bool(result["inside_bounds"].all())
    result.attrs |= {"bounds_bind": int(binding), "bound_broken": int(broken)}


def _doubt(result: xarray.Dataset, dataset: xarray.Dataset, medium: Phases) -> xarray.DataArray | float:
    """Relative doubt about the mean of a composite: its interval, and the error that its discretization leaves.

    Dilute composites lie on a bound, where the scatter of a few realizations passes it.
    """
    if not medium.composite:
        return 0.0
    discretization = dataset["relative_energy_error"].mean("realization")
    return (result["half_width"] / result["conductivity_mean"]).fillna(0.0) + discretization.fillna(0.0)


def _outside_wiener(result: xarray.Dataset, dataset: xarray.Dataset, media: Sequence[Phases]) -> xarray.DataArray:
    """Number of realizations with a direction beyond the Wiener bounds of their own solid fraction."""
    fraction, pores = dataset["solid_fraction"], media[0].pores
    known = fraction.fillna(0.0)
    slack: xarray.DataArray | float = ROUNDING
    if media[0].composite:
        slack = ROUNDING + dataset["relative_energy_error"].fillna(0.0)
    upper = _by_contrast([parallel(pores, one.particles, known) for one in media], result) * (1.0 + slack)
    lower = _by_contrast([series(pores, one.particles, known) for one in media], result) * (1.0 - slack)
    outside = fraction.isnull() & False
    for i in range(media[0].dimension):
        k = dataset["conductivity"].isel(direction_i=i, direction_j=i, drop=True)
        outside = outside | (k > upper) | (k < lower)
    dims = [dim for dim in half_trace(dataset["conductivity"]).dims if dim != "realization"]
    return outside.where(fraction.notnull(), False).sum("realization").transpose(*dims)


def _add_best(result: xarray.Dataset) -> None:
    """The estimate of the smallest root mean square relative difference, over densities and over all cells.

    A model that is 0 is 100 % off everywhere and would beat every one that is too high by more: it stays out.
    """
    estimates = result["model_kind"].isin(("estimate", "exact"))
    nonzero = (result["model_conductivity"] > 0.0).any([d for d in result["model_conductivity"].dims if d != "model"])
    rms = result["rms_relative_difference"].where(estimates & nonzero)
    names = result["model"].values
    filled = rms.fillna(np.inf)
    best = names[filled.argmin("model").values]
    nearest = filled.min("model")
    result["best_model"] = nearest.copy(data=np.where(np.isfinite(nearest.values), best, "").astype(object))
    total = (rms**2).mean([dim for dim in rms.dims if dim != "model"]).fillna(np.inf).values
    result.attrs["best_model"] = str(names[int(np.argmin(total))]) if np.isfinite(total).any() else ""


_MEANINGS = {
    "model_conductivity": ("conductivity by the model", "W m-1 K-1"),
    "relative_difference": ("relative difference of the model to the simulation", "1"),
    "rms_relative_difference": ("root mean square relative difference over the densities", "1"),
    "outside_bound": ("the simulation lies beyond this bound", "1"),
    "bound_broken": ("the simulation lies beyond this bound, which binds its geometry", "1"),
    "inside_bounds": ("the simulation lies inside the bounds of isotropic two-phase media", "1"),
    "realizations_outside_bounds": ("realizations beyond the Wiener bounds of their own solid fraction", "1"),
    "best_model": ("estimate of the smallest root mean square relative difference", "1"),
}
