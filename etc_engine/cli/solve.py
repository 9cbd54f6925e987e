"""``etc-engine solve``: the effective conductivity of one packing."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click


@click.command("solve")
@click.argument("particles", type=click.Path(path_type=Path))
@click.option("--box", required=True, help="Edge lengths, such as 1,1.")
@click.option("--periodic", default="", help="Periodic axes: x, y or xy; walls elsewhere.")
@click.option("--method", default="chord", show_default=True, help="standard, enhanced or chord.")
@click.option(
    "--contact-angle",
    type=float,
    help="Half-angle in degrees of bonded contacts; without it contacts are overlaps.",
)
@click.option("--bond-gap", type=float, default=1e-6, show_default=True, help="Largest bonded gap, in mean radii.")
@click.option(
    "--conductivity", type=float, help="Conductivity of the particles [W/(m K)]; 1 by default, or the file's."
)
@click.option(
    "--contact-resistance",
    type=float,
    default=0.0,
    show_default=True,
    help="Resistance of a contact per unit thickness [m K/W].",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def solve_command(
    particles: Path,
    box: str,
    periodic: str,
    method: str,
    contact_angle: float | None,
    bond_gap: float,
    conductivity: float | None,
    contact_resistance: float,
    as_json: bool,
) -> None:
    """Effective conductivity of the disks in a CSV file with the columns x,y,radius[,conductivity].

    Walls at x = 0 (temperature 1) and x = L (temperature 0), unless the box is periodic along x.
    """
    start = time.perf_counter()
    from etc_engine.cli.options import parse_box, print_json
    from etc_engine.contacts import bonded_contacts, overlap_contacts
    from etc_engine.effective import effective_conductivity
    from etc_engine.errors import InputError
    from etc_engine.packing.files import read_csv

    table = read_csv(particles, parse_box(box, periodic))
    if conductivity is not None and table.conductivity is not None:
        raise InputError(f"{particles} has a conductivity column: leave --conductivity out, or take the column out")
    if contact_angle is None:
        network = overlap_contacts(table.packing)
    else:
        network = bonded_contacts(table.packing, contact_angle * 0.017453292519943295, bond_gap)
    given = 1.0 if conductivity is None else conductivity
    result = effective_conductivity(
        network,
        method=method,
        conductivity=table.conductivity if table.conductivity is not None else given,
        contact_resistance=contact_resistance,
        axes=(0, 1) if all(table.packing.box.periodic) else (0,),
    )
    record = _record(network, method, result)
    record["seconds"] = time.perf_counter() - start
    if as_json:
        print_json(record)
    else:
        _print_table(record)


def _record(network: Any, method: str, result: Any) -> dict[str, Any]:
    from etc_engine.dtem.field import recover_field
    from etc_engine.realization import Status

    solution = result.solutions[0]
    field = recover_field(solution)
    box = network.packing.box
    percolates = bool(result.spans[0])
    record: dict[str, Any] = {
        "method": method,
        "conductivity": float(result.tensor[0, 0]),
    }
    if all(box.periodic):
        record["conductivity_tensor"] = result.tensor
    return record | {
        "particles": network.packing.count,
        "contacts": network.count,
        "wall_contacts": len(network.walls_of(0)),
        "unknowns": result.unknowns,
        "percolates": percolates,
        "status": int(Status.OK if percolates else Status.NOT_PERCOLATING),
        "iterations": result.iterations,
        "relative_energy_error": result.relative_energy_error,
        "contact_temperatures": [
            {"particles": pair, "temperature": temperature}
            for pair, temperature in zip(network.pairs.tolist(), field.contact_temperatures.tolist(), strict=True)
        ],
    }


def _print_table(record: dict[str, Any]) -> None:
    for name, value in record.items():
        if name == "contact_temperatures":
            continue
        if name == "conductivity_tensor":
            text = "; ".join(" ".join(f"{k:.8g}" for k in row) for row in value)
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        click.echo(f"{name.replace('_', ' '):24s}{text}{unit}")
