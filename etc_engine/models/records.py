"""A model and its value as plain records, for whoever shows them: the command line, the service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from etc_engine.errors import InputError
from etc_engine.models.catalogue import evaluate
from etc_engine.models.model import Model


def record(model: Model) -> dict[str, Any]:
    """The record of a model as plain values.

    Examples
    --------
    >>> from etc_engine.models import CATALOGUE
    >>> [item["name"] for item in record(CATALOGUE["maxwell"])["inputs"]]
    ['k1', 'k2', 'fraction']
    """
    defaults = model.defaults
    return {
        "model": model.name,
        "title": model.title,
        "label": model.label,
        "dimensions": list(model.dimensions),
        "kind": model.kind,
        "inputs": [
            {
                "name": item.name,
                "meaning": item.meaning,
                "unit": item.unit,
                "allowed": str(item.interval),
                "required": item.name not in defaults,
                "default": defaults.get(item.name),
            }
            for item in model.inputs
        ],
        "validity": model.validity,
        "limits": model.limits,
        "reference": model.reference,
    }


def evaluation(
    model: Model,
    phases: Mapping[str, float | None],
    dimension: int | None,
    parameters: Mapping[str, float],
    spelling: str = "{}",
) -> dict[str, Any]:
    """The conductivity by a model, with the inputs of the formula.

    Parameters
    ----------
    model : Model
    phases : mapping
        ``k1``, ``k2`` [W/(m K)] and ``fraction``; None where it is not given.
    dimension : int, optional
        May be left out where only one is possible.
    parameters : mapping
        The model's further inputs.
    spelling : str
        How an error spells the name of an input.

    Raises
    ------
    InputError
        If an input is missing, or not allowed.

    Examples
    --------
    >>> from etc_engine.models import CATALOGUE
    >>> evaluation(CATALOGUE["maxwell"], {"k1": 1.0, "k2": 1.0, "fraction": 0.3}, 2, {})["conductivity"]
    1.0
    """
    used = {item.name for item in model.inputs}
    missing = [spelling.format(key) for key, value in phases.items() if value is None and key in used]
    if dimension is None:
        if len(model.dimensions) > 1:
            missing.append(spelling.format("dimension"))
        dimension = model.dimensions[0]
    if missing:
        raise InputError(f"model {model.name} also needs {' '.join(missing)}")
    # An input that the model has no use for may be left out; 0 then fills its place in the call.
    filled = {key: 0.0 if value is None else value for key, value in phases.items()}
    k = evaluate(
        model.name,
        k1=filled["k1"],
        k2=filled["k2"],
        fraction=filled["fraction"],
        dimension=dimension,
        **parameters,
    )
    given = {key: value for key, value in phases.items() if value is not None}
    return {
        "model": model.name,
        "conductivity": float(k),
        "dimension": dimension,
        "kind": model.kind,
        **given,
        "parameters": dict(parameters),
        "reference": model.reference,
    }
