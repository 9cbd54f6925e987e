"""The catalogue of models by name, and their checked evaluation."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from etc_engine.errors import InputError
from etc_engine.models.broadcasting import Values
from etc_engine.models.entries import ENTRIES
from etc_engine.models.model import UNIT, Input, Interval, Model

__all__ = ["CATALOGUE", "Input", "Interval", "Model", "evaluate", "find_model"]

CATALOGUE: Mapping[str, Model] = MappingProxyType({model.name: model for model in ENTRIES})
"""Every model, by name, in the order of its family."""


def find_model(name: str) -> Model:
    """Return the model of that name.

    Raises
    ------
    InputError
        If there is none; the message offers names that resemble it.

    Examples
    --------
    >>> find_model("maxwell").dimensions
    (2, 3)
    """
    if name in CATALOGUE:
        return CATALOGUE[name]
    wanted = name.lower().replace("-", "_").replace(" ", "_")
    close = difflib.get_close_matches(wanted, CATALOGUE, n=3, cutoff=0.6)
    words = {word for word in wanted.split("_") if len(word) > 2}
    titled = [m.name for m in ENTRIES if words & set(re.findall(r"\w+", m.title.lower()))]
    offers = list(dict.fromkeys(close + titled))[:4]
    hint = f"did you mean {' or '.join(offers)}?" if offers else f"there are: {', '.join(CATALOGUE)}"
    raise InputError(f"there is no model named {name!r}; {hint}")


def evaluate(name: str, *, k1: Values, k2: Values, fraction: Values, dimension: int, **parameters: Values) -> Values:
    """Effective conductivity by the named model, with its inputs checked.

    Parameters
    ----------
    name : str
        A key of `CATALOGUE`.
    k1, k2 : array_like [W/(m K)]
        Conductivity of phase 1 (matrix, fluid, pores) and phase 2 (inclusions, solid). A model that has
        no use for one of them (`Model.inputs`) ignores it.
    fraction : array_like [-]
        Fraction of phase 2.
    dimension : int
        2 for disks, 3 for spheres.
    **parameters : array_like
        The model's further inputs.

    Returns
    -------
    array_like [W/(m K)]
        Of the kind and broadcast shape of the inputs.

    Raises
    ------
    InputError
        For an unknown model or parameter, a missing parameter, a dimension the model does not cover, a
        value outside what the model allows (NaN included), or a point at which it has no value.

    Examples
    --------
    >>> round(float(evaluate("maxwell", k1=1.0, k2=10.0, fraction=0.3, dimension=2)), 6)
    1.650602
    """
    model = find_model(name)
    if isinstance(dimension, bool) or dimension not in model.dimensions:
        covered = " or ".join(str(d) for d in model.dimensions)
        raise InputError(f"model {name} holds for dimension {covered}, found {dimension!r}")
    _check("fraction", fraction, UNIT, "a fraction", name)
    given = {"k1": k1, "k2": k2, "fraction": fraction, **parameters}
    inputs = {item.name: item for item in model.inputs}
    _check_names(model, parameters)
    for key, item in inputs.items():
        if given.get(key) is not None:
            _check(key, given[key], item.interval, item.meaning, name)
    values = {key: given[key] for key in inputs if key in given}
    if model.needs_dimension:
        values["dimension"] = dimension
    k = model.function(**values)
    if np.isnan(np.asarray(k)).any():
        raise InputError(
            f"model {name} has no value at {int(np.isnan(np.asarray(k)).sum())} of {np.size(k)} points: "
            f"its validity is {model.validity}"
        )
    return k


def _check_names(model: Model, parameters: Mapping[str, Values]) -> None:
    known = [item.name for item in model.inputs if item.name not in ("k1", "k2", "fraction")]
    for key in parameters:
        if key not in known:
            allowed = ", ".join(known) if known else "none"
            raise InputError(f"model {model.name} has no parameter {key!r}; its parameters are: {allowed}")
    missing = [key for key in model.required if parameters.get(key) is None]
    if missing:
        described = "; ".join(f"{i.name} ({i.meaning} [{i.unit}])" for i in model.inputs if i.name in missing)
        raise InputError(f"model {model.name} also needs {described}")


def _check(key: str, value: Values, interval: Interval, meaning: str, name: str) -> None:
    try:
        values = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{key} of model {name} must be a number, found {value!r}") from None
    inside = interval.contains(values)
    if not inside.all():
        found = float(values[~inside][0]) if values.ndim else float(values)
        raise InputError(f"{key} of model {name} ({meaning}) must lie in {interval}, found {found:g}")
