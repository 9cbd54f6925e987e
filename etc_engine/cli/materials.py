"""``etc-engine materials``: the solids and gases that are known, and their properties at a temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from etc_engine.materials import Gas, Solid

ATMOSPHERE = 101325.0


@click.command("materials")
@click.argument("name", required=False)
@click.option("--temperature", type=float, help="Temperature [K] at which to evaluate.")
@click.option("--pressure", type=float, help="Pressure of a gas [Pa]. 0 is vacuum. By default 101325.")
@click.option("--accommodation", type=float, help="Accommodation coefficient of a surface: adds the jump length.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def materials_command(
    name: str | None, temperature: float | None, pressure: float | None, accommodation: float | None, as_json: bool
) -> None:
    """List the materials, show the record of one, or evaluate it at a temperature.

    Without NAME: every solid and gas. With NAME alone: its properties, their ranges and sources. With
    --temperature: its values there. A temperature outside the range of a source is refused.
    """
    from etc_engine.cli.options import print_json
    from etc_engine.errors import InputError

    if name is None:
        if any(value is not None for value in (temperature, pressure, accommodation)):
            raise InputError("which material? give its name: etc-engine materials NAME --temperature T")
        _show(_listed(), as_json, _print_list)
        return
    from etc_engine.materials.gases import NAMES

    if name.lower() in NAMES:
        record = _gas_record(name.lower(), temperature, pressure, accommodation)
    else:
        record = _solid_record(name, temperature, pressure, accommodation)
    if as_json:
        print_json(record)
    else:
        _print_record(record)


def _show(record: dict[str, Any], as_json: bool, show: Any) -> None:
    from etc_engine.cli.options import print_json

    if as_json:
        print_json(record)
    else:
        show(record)


def _listed() -> dict[str, Any]:
    from etc_engine.materials import CATALOGUE
    from etc_engine.materials.gases import NAMES

    by_fluid: dict[str, list[str]] = {}
    for name, fluid in NAMES.items():
        by_fluid.setdefault(fluid, []).append(name)
    return {
        "solids": [_described(solid) for solid in CATALOGUE.values()],
        "gases": [{"gas": names[0], "aliases": names[1:]} for names in by_fluid.values()],
    }


def _described(solid: Solid) -> dict[str, Any]:
    return {
        "material": solid.name,
        "title": solid.title,
        "properties": [
            {"property": item.name, "unit": item.unit, "low": item.low, "high": item.high, "source": item.source}
            for item in solid.properties
        ],
        "atomic_mass": solid.atomic_mass,
    }


def _solid_record(
    name: str, temperature: float | None, pressure: float | None, accommodation: float | None
) -> dict[str, Any]:
    from etc_engine.errors import InputError
    from etc_engine.materials import find_solid

    solid = find_solid(name)
    if pressure is not None or accommodation is not None:
        raise InputError(f"{solid.name} is a solid: --pressure and --accommodation are only valid with a gas")
    record = _described(solid)
    if temperature is not None:
        record["temperature"] = temperature
        record["conductivity"] = float(solid.conductivity.at(temperature))
        for key in ("youngs_modulus", "poisson_ratio", "emissivity"):
            item = getattr(solid, key)
            if item is not None and item.low <= temperature <= item.high:
                record[key] = float(item.at(temperature))
    return record


def _gas_record(
    name: str, temperature: float | None, pressure: float | None, accommodation: float | None
) -> dict[str, Any]:
    from etc_engine.errors import InputError
    from etc_engine.materials import gas_state, jump_length

    if temperature is None:
        if pressure is not None or accommodation is not None:
            raise InputError(f"the properties of {name} also need --temperature")
        return {"gas": name, "source": "CoolProp; give --temperature and --pressure"}
    state = gas_state(name, temperature, ATMOSPHERE if pressure is None else pressure)
    record = _gas_values(state)
    if accommodation is not None:
        record["accommodation"] = accommodation
        record["jump_length"] = jump_length(state, accommodation)
    return record


def _gas_values(state: Gas) -> dict[str, Any]:
    return {
        "gas": state.name,
        "temperature": state.temperature,
        "pressure": state.pressure,
        "conductivity": state.conductivity,
        "viscosity": state.viscosity,
        "heat_capacity": state.heat_capacity,
        "heat_capacity_ratio": state.heat_capacity_ratio,
        "prandtl": state.prandtl,
        "molar_mass": state.molar_mass,
        "mean_free_path": state.mean_free_path,
        "source": "CoolProp",
    }


UNITS = {
    "temperature": "K",
    "pressure": "Pa",
    "conductivity": "W/(m K)",
    "youngs_modulus": "Pa",
    "viscosity": "Pa s",
    "heat_capacity": "J/(kg K)",
    "molar_mass": "kg/mol",
    "atomic_mass": "kg/mol",
    "mean_free_path": "m",
    "jump_length": "m",
}


def _print_list(record: dict[str, Any]) -> None:
    for solid in record["solids"]:
        k = solid["properties"][0]
        click.echo(f"{solid['material']:22s}{k['low']:g} to {k['high']:g} K: {k['source']}")
    for gas in record["gases"]:
        also = f" ({', '.join(gas['aliases'])})" if gas["aliases"] else ""
        click.echo(f"{gas['gas'] + also:22s}gas, from CoolProp")
    click.echo("etc-engine materials NAME --temperature T evaluates one.")


def _print_record(record: dict[str, Any]) -> None:
    click.echo(f"{record.get('title', record.get('gas'))}")
    for item in record.get("properties", []):
        unit = "" if item["unit"] == "-" else f" [{item['unit']}]"
        span = f"{item['low']:g} to {item['high']:g} K" if item["high"] > item["low"] else f"at {item['low']:g} K"
        click.echo(f"  {item['property']}{unit}, {span}: {item['source']}")
    for key, value in record.items():
        if isinstance(value, float):
            click.echo(f"{key:22s}{value:.6g} {UNITS.get(key, '')}".rstrip())
    if "source" in record:
        click.echo(f"{'source':22s}{record['source']}")
