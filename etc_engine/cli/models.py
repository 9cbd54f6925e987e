"""``etc-engine models``: the catalogue of conductivity models, and the value of one of them."""

from __future__ import annotations

from typing import Any

import click


@click.command("models")
@click.argument("name", required=False)
@click.option(
    "--k1", type=float, help="Conductivity of phase 1 (matrix, fluid, pores) [W/(m K)]. 0 and inf are allowed."
)
@click.option("--k2", type=float, help="Conductivity of phase 2 (inclusions, solid) [W/(m K)]. 0 and inf are allowed.")
@click.option("--fraction", type=float, help="Fraction of phase 2, 0 to 1.")
@click.option("--dimension", type=int, help="2 (disks) or 3 (spheres). Needed where both are possible.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A further parameter of the model.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def models_command(
    name: str | None,
    k1: float | None,
    k2: float | None,
    fraction: float | None,
    dimension: int | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """List the conductivity models, show the record of one, or evaluate it.

    Without NAME: the whole catalogue. With NAME alone: its inputs, validity, limits and reference.
    With the values of its inputs: the conductivity.
    """
    from etc_engine.cli.options import print_json
    from etc_engine.errors import InputError
    from etc_engine.models import CATALOGUE
    from etc_engine.models.catalogue import find_model
    from etc_engine.models.records import evaluation, record

    phases = {"k1": k1, "k2": k2, "fraction": fraction}
    evaluating = bool(settings) or any(value is not None for value in (*phases.values(), dimension))
    if name is None:
        if evaluating:
            raise InputError("which model? give its name: etc-engine models NAME --k1 A --k2 B ...")
        records = [record(model) for model in CATALOGUE.values()]
        if as_json:
            print_json({"models": records})
        else:
            _print_list(records)
        return
    model = find_model(name)
    if not evaluating:
        if as_json:
            print_json(record(model))
        else:
            _print_record(record(model))
        return
    result = evaluation(model, phases, dimension, _parsed(settings), spelling="--{}")
    if as_json:
        print_json(result)
    else:
        click.echo(f"{result['conductivity']:.10g} W/(m K)  {model.title}, {result['dimension']}D, {model.kind}")


def _parsed(settings: tuple[str, ...]) -> dict[str, float]:
    from etc_engine.errors import InputError

    parameters: dict[str, float] = {}
    for setting in settings:
        key, _, value = setting.partition("=")
        key = key.strip()
        if key in parameters:
            raise InputError(f"--set {key} is given twice")
        try:
            parameters[key] = float(value)
        except ValueError:
            raise InputError(f"--set takes NAME=VALUE with a number, such as zeta2=0.1: found {setting!r}") from None
    return parameters


def _print_list(records: list[dict[str, Any]]) -> None:
    for record in records:
        dimensions = ", ".join(f"{d}D" for d in record["dimensions"])
        inputs = ", ".join(item["name"] if item["required"] else f"[{item['name']}]" for item in record["inputs"])
        click.echo(f"{record['model']:24s}{dimensions:8s}{record['kind']:13s}{inputs}")
        click.echo(f"{'':24s}{record['reference']}")
    click.echo("Inputs in brackets have a default. etc-engine models NAME prints one in full.")


def _print_record(record: dict[str, Any]) -> None:
    click.echo(f"{record['model']}: {record['title']}, {record['kind']}")
    click.echo(f"{'dimension':12s}{', '.join(f'{d}D' for d in record['dimensions'])}")
    for item in record["inputs"]:
        default = "" if item["default"] is None else f"; default {item['default']:g}"
        unit = "" if item["unit"] == "-" else f" [{item['unit']}]"
        click.echo(f"{'input':12s}{item['name']}: {item['meaning']}{unit}, in {item['allowed']}{default}")
    for key in ("validity", "limits", "reference"):
        click.echo(f"{key:12s}{record[key]}")
