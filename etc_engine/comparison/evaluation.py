"""Closed-form models on the dimensions of a sweep, their differences, and the bounds that apply."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from etc_engine.arrays import Flags, Floats
from etc_engine.comparison.closest import add_closest, further_inputs
from etc_engine.comparison.inputs import known_inputs
from etc_engine.comparison.simulation import Phases, mean_diagonal, phases, simulated, study_of
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

FILLED_MODELS = (
    "hashin_shtrikman_lower",
    "hashin_shtrikman_upper",
    "maxwell",
    "third_order",
    "effective_medium",
    "differential",
)
"""Those of particles in a medium that conducts, which need no contacts."""

HEATED_MODELS = ("zehner_bauer_schluender", "breitbach_barthels", "kunii_smith_radiation")
"""Beside those for beds of spheres at a temperature, with gas and radiation."""

INPUT = "input_"
"""Of the names of variables that hold further inputs of models."""

BINDING = ("series", "parallel", "hashin_shtrikman_lower", "hashin_shtrikman_upper")
"""Bounds of every isotropic two-phase medium; three-point bounds hold for their own zeta2 only."""

ROUNDING = 1e-9
"""A bound is broken when it is passed by more than this part of it."""

UNESTIMATED = 0.01
"""Relative discretization error of conducting pores where the method gave no estimate: no method for random packings
is known to be better than this in every case, so that no bound is called broken by less."""

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
        this bound) and ``bound_broken`` (and the bound applies to this geometry). Without ``model``: the simulated
        conductivity with its interval (see `etc_engine.comparison.simulation.simulated`), ``inside_bounds``,
        ``realizations_outside_bounds``. Over the densities: ``rms_relative_difference`` and ``best_model``,
        among estimates. Coordinates ``model_kind``, ``model_title``, ``model_note`` (why a value is
        missing, or 0) and ``model_inputs`` (what the model knows beyond k1, k2 and the fraction). Attributes:
        ``bounds_bind``, ``bounds_unbound`` (why not), ``bound_broken``, ``best_model`` and what belongs to it (see
        `etc_engine.comparison.closest.add_closest`), the phases, and ``model_parameters`` as JSON.

    Raises
    ------
    InputError
        If the dataset is not the result of a sweep, or a model or a parameter is not known.

    Notes
    -----
    Further inputs of a model that the sweep knows are taken from it, see `etc_engine.comparison.inputs.known_inputs`,
    and stand in the result as ``input_<name>``; ``parameters`` given for a model come first.

    k1 is the conductivity of the pores, k2 that of the particles, the fraction the mean solid fraction of the density.
    Where the pores insulate (k1 = 0) every model with the pores as its matrix is 0: Maxwell, differential medium, lower
    Hashin-Shtrikman. The contact mean field is the sweep's own, on the networks it solved; it takes the pipe resistance
    of the ``chord`` method whatever the method.

    The bounds apply to a body of two phases whose volumes the solid fraction gives: overlapping particles, and whole
    cells with pores that conduct (there beyond the interval of the mean and the estimated error of the discretization).
    A bonded contact conducts through a neck that the solid fraction does not count: for it the bounds are a comparison.
    The Hashin-Shtrikman bounds are for the mean over isotropic ensembles. Every single realization and direction is
    compared with the Wiener bounds (series, parallel) of its own solid fraction, which need no isotropy.
    """
    import xarray

    medium = phases(dataset)
    inputs = known_inputs(dataset)
    parameters = _with_bounds(_wanted(dataset, models, medium, inputs))
    simulation = simulated(dataset)
    fraction = simulation["solid_fraction"]
    columns, notes = [], []
    for name, values in parameters.items():
        if name == MEAN_FIELD and "mean_field_conductivity" in dataset and not values:
            valid = dataset["status"] <= int(Status.NOT_PERCOLATING)
            columns.append(dataset["mean_field_conductivity"].where(valid).mean("realization"))
            notes.append("")
        else:
            column, note = model_curve(name, medium, fraction, {**_of_model(name, inputs), **values})
            columns.append(column)
            notes.append(note)
    result = simulation
    k = result["conductivity_mean"]
    labels = xarray.DataArray(np.array(list(parameters), dtype=object), dims="model", name="model")
    columns = [column.broadcast_like(k).transpose(*k.dims) for column in columns]
    result["model_conductivity"] = xarray.concat(columns, dim=labels, coords="minimal", compat="override")
    records = [find_model(name) for name in parameters]
    known = [_inputs_of(name, inputs, values) for name, values in parameters.items()]
    result = result.assign_coords(
        model_kind=("model", np.array([model.kind for model in records], dtype=object)),
        model_title=("model", np.array([model.title for model in records], dtype=object)),
        model_note=("model", np.array(notes, dtype=object)),
        model_inputs=("model", np.array(known, dtype=object)),
    )
    result.attrs |= {
        "pore_conductivity": medium.pores.values.tolist(),
        "particle_conductivity": medium.particles.values.tolist(),
        "pores_conduct": int(medium.pores_conduct),
        "dimension": medium.dimension,
        "model_parameters": json.dumps({name: dict(values) for name, values in parameters.items()}),
    }
    for name, found in inputs.items():
        result[INPUT + name] = found
    _add_differences(result)
    _add_bounds(result, dataset, medium)
    add_closest(result)
    for name, (meaning, units) in _MEANINGS.items():
        result[name].attrs |= {"long_name": meaning, "units": units}
    return result


def model_curve(
    name: str,
    medium: Phases,
    fraction: xarray.DataArray,
    parameters: Mapping[str, float | xarray.DataArray] | None = None,
) -> tuple[xarray.DataArray, str]:
    """A model at solid fractions, NaN where it has no value, and a note that says why, or why it is 0.

    Parameters
    ----------
    name : str
        A name of the catalogue.
    medium : Phases
        Conductivities and dimension.
    fraction : DataArray
        Solid fractions; NaN where there is none.
    parameters : mapping, optional
        Further inputs of the model: numbers, or arrays on dimensions of the sweep.

    Returns
    -------
    conductivity : DataArray [W/(m K)]
        On the dimensions of the fraction, of the two conductivities and of the further inputs.
    note : str

    Examples
    --------
    >>> from xarray import DataArray
    >>> medium, fraction = Phases(DataArray(0.0), DataArray(1.0), 2, ""), DataArray([0.8, 1.0], dims="density")
    >>> model_curve("maxwell_inverse", medium, fraction)[0].values.round(6)
    array([0.666667, 1.      ])
    >>> model_curve("maxwell", medium, fraction[:1])[1]
    'is 0: the pores insulate'
    """
    import xarray

    further = {key: xarray.DataArray(value) for key, value in (parameters or {}).items()}
    plain = [array.reset_coords(drop=True) for array in (fraction, medium.pores, medium.particles, *further.values())]
    f, pores, particles, *arrays = xarray.broadcast(*plain)
    values, reasons = np.full(f.shape, np.nan), []
    for place in np.ndindex(f.shape):
        if np.isnan(f.values[place]):
            continue
        k1, k2 = float(pores.values[place]), float(particles.values[place])
        here = {key: float(array.values[place]) for key, array in zip(further, arrays, strict=True)}
        try:
            values[place] = evaluate(
                name, k1=k1, k2=k2, fraction=float(f.values[place]), dimension=medium.dimension, **here
            )
        except InputError as error:
            reasons.append(str(error))
    curve = f.copy(data=values)
    if reasons:
        return curve, reasons[0]
    zero = not medium.pores_conduct and bool((values[~np.isnan(values)] == 0.0).all())
    return curve, "is 0: the pores insulate" if zero else ""


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
        ``model_conductivity`` on ``model``, ``density`` and the dimensions that vary a conductivity, with the solid
        fraction interpolated between the densities of the sweep. Without the contact mean field, which has values on
        the sweep only.
    """
    import xarray

    density, fraction = comparison["density"].values, comparison["solid_fraction"].values
    known = np.isfinite(fraction)
    if known.sum() >= 2:
        fine = np.linspace(density[known][0], density[known][-1], points)
        density, fraction = fine, np.interp(fine, density[known], fraction[known])
    attrs = comparison.attrs
    pores, particles = comparison["pore_conductivity"], comparison["particle_conductivity"]
    medium = Phases(pores, particles, attrs["dimension"], str(attrs["bounds_unbound"]))
    parameters = json.loads(attrs["model_parameters"])
    names = [str(name) for name in comparison["model"].values if str(name) != MEAN_FIELD]
    fractions = xarray.DataArray(fraction, coords={"density": density}, dims="density")
    inputs = {
        name.removeprefix(INPUT): _along(comparison[name], known, density)
        for name in map(str, comparison.data_vars)
        if name.startswith(INPUT)
    }
    given = {name: {**_of_model(name, inputs), **parameters[name]} for name in names}
    curves = [model_curve(name, medium, fractions, given[name])[0] for name in names]
    labels = xarray.DataArray(np.array(names, dtype=object), dims="model", name="model")
    return xarray.concat(curves, dim=labels, coords="minimal", compat="override").to_dataset(name="model_conductivity")


def _inputs_of(name: str, inputs: Mapping[str, xarray.DataArray], given: Mapping[str, float]) -> str:
    """What a model knows beyond the two conductivities and the solid fraction, in words."""
    if name == MEAN_FIELD and not given:
        return "the contacts of every packing"
    return ", ".join(word.replace("_", " ") for word in further_inputs(name, {**inputs, **given}))


def _of_model(name: str, inputs: Mapping[str, xarray.DataArray]) -> dict[str, float | xarray.DataArray]:
    """Those of the known inputs that a model takes."""
    return {item.name: inputs[item.name] for item in find_model(name).inputs if item.name in inputs}


def _along(values: xarray.DataArray, known: Flags, density: Floats) -> xarray.DataArray:
    """An input between the densities of the sweep that have a solid fraction."""
    if "density" not in values.dims:
        return values
    if known.sum() < 2:
        return values.assign_coords(density=density)
    return values.isel(density=known).interp(density=density)


def _wanted(
    dataset: xarray.Dataset, models: Models | None, medium: Phases, inputs: Mapping[str, xarray.DataArray]
) -> dict[str, Mapping[str, float]]:
    """Names and parameters asked for, checked."""
    if models is None:
        by_default = FILLED_MODELS if medium.pores_conduct else DEFAULT_MODELS
        if medium.dimension == 3 and "temperature" in inputs:
            by_default = (*by_default, *HEATED_MODELS)
        models = study_of(dataset)["models"]["names"] or by_default
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


def _add_bounds(result: xarray.Dataset, dataset: xarray.Dataset, medium: Phases) -> None:
    k, model = result["conductivity_mean"], result["model_conductivity"]
    kind, binding = result["model_kind"], medium.bounds_bind
    slack = ROUNDING + _doubt(result, dataset, medium)
    above = (kind == "upper bound") & (k > model * (1.0 + slack))
    below = (kind == "lower bound") & (k < model * (1.0 - slack))
    result["outside_bound"] = (above | below).transpose(*model.dims)
    universal = result["model"].isin(BINDING)
    outside = (result["outside_bound"] & universal).any("model")
    result["realizations_outside_bounds"] = _outside_wiener(dataset, medium)
    result["inside_bounds"] = ~outside & (result["realizations_outside_bounds"] == 0)
    result["bound_broken"] = result["outside_bound"] & universal & binding
    broken = binding and not bool(result["inside_bounds"].all())
    result.attrs |= {"bounds_bind": int(binding), "bounds_unbound": medium.unbound, "bound_broken": int(broken)}


def _doubt(result: xarray.Dataset, dataset: xarray.Dataset, medium: Phases) -> xarray.DataArray | float:
    """Relative doubt about the mean of a cell with pores that conduct: its interval, and its discretization error.

    Dilute suspensions lie on a bound, where the scatter of a few realizations passes it.
    """
    if not medium.pores_conduct:
        return 0.0
    errors = _errors(dataset).mean("realization")
    return (result["half_width"] / result["conductivity_mean"]).fillna(0.0) + errors


def _errors(dataset: xarray.Dataset) -> xarray.DataArray:
    """Relative errors that the solver and the discretization leave in every cell whose pores conduct."""
    return dataset["relative_energy_error"].fillna(0.0) + dataset["model_error_estimate"].fillna(UNESTIMATED)


def _outside_wiener(dataset: xarray.Dataset, medium: Phases) -> xarray.DataArray:
    """Number of realizations with a direction beyond the Wiener bounds of their own solid fraction."""
    fraction = dataset["solid_fraction"]
    known = fraction.fillna(0.0)
    slack: xarray.DataArray | float = ROUNDING
    if medium.pores_conduct:
        slack = ROUNDING + _errors(dataset)
    upper = parallel(medium.pores, medium.particles, known) * (1.0 + slack)
    lower = series(medium.pores, medium.particles, known) * (1.0 - slack)
    outside = fraction.isnull() & False
    for i in range(medium.dimension):
        k = dataset["conductivity"].isel(direction_i=i, direction_j=i, drop=True)
        outside = outside | (k > upper) | (k < lower)
    dims = [dim for dim in mean_diagonal(dataset["conductivity"]).dims if dim != "realization"]
    return outside.where(fraction.notnull(), False).sum("realization").transpose(*dims)


_MEANINGS = {
    "model_conductivity": ("conductivity by the model", "W m-1 K-1"),
    "relative_difference": ("relative difference of the model to the simulation", "1"),
    "rms_relative_difference": ("root mean square relative difference over the densities", "1"),
    "outside_bound": ("the simulation lies beyond this bound", "1"),
    "bound_broken": ("the simulation lies beyond this bound, which applies to its geometry", "1"),
    "inside_bounds": ("the simulation lies inside the bounds of isotropic two-phase media", "1"),
    "realizations_outside_bounds": ("realizations beyond the Wiener bounds of their own solid fraction", "1"),
    "best_model": ("estimate of the smallest root mean square relative difference, where the band determines it", "1"),
}
