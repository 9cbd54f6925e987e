"""``etc-engine pack``: a random packing of disks or spheres."""

from __future__ import annotations

import time
from pathlib import Path

import click


@click.command("pack")
@click.option("--method", default="advancing-front", show_default=True, help="Packing algorithm.")
@click.option("--growth-rate", type=float, help="Growth rate of lubachevsky-stillinger.")
@click.option(
    "--radii",
    required=True,
    help="equal, uniform:a:b, gaussian:mean:sd, lognormal:mean:sd or bidisperse:a:b:fraction.",
)
@click.option("--box", required=True, help="Edge lengths, such as 1,1.")
@click.option("--count", type=int, help="Number of particles.")
@click.option("--density", type=float, help="Sum of the particle areas over the box area.")
@click.option("--periodic", default="", help="Periodic axes: x, y, xy or xyz; walls elsewhere.")
@click.option("--seed", type=int, help="Seed of the random stream; a new one is drawn and told without it.")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="CSV file to write.")
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the packing.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def pack_command(
    method: str,
    growth_rate: float | None,
    radii: str,
    box: str,
    count: int | None,
    density: float | None,
    periodic: str,
    seed: int | None,
    output: Path,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Make a random packing and write it as CSV."""
    from numpy.random import SeedSequence, default_rng

    from etc_engine.cli.options import check_picture, check_place, parse_box, print_json, replacing
    from etc_engine.errors import InputError
    from etc_engine.packing import PackingSpec, pack
    from etc_engine.packing.files import ParticleTable, write_csv
    from etc_engine.packing.neighbors import neighbor_pairs
    from etc_engine.packing.radii import parse_radii

    if seed is not None and seed < 0:
        raise InputError(f"--seed must not be negative, found {seed}")
    spec = PackingSpec(
        method=method,
        radii=parse_radii(radii),
        box=parse_box(box, periodic),
        count=count,
        density=density,
        growth_rate=growth_rate,
    )
    if plot is not None:
        check_picture(plot)
        check_place(plot)
    seed = int(SeedSequence().generate_state(1)[0]) if seed is None else seed
    with replacing(output) as file:
        start = time.perf_counter()
        packing = pack(spec, default_rng(seed))
        seconds = time.perf_counter() - start
        contacts = neighbor_pairs(packing, relative_gap=1e-6).count
        write_csv(file, ParticleTable(packing))
    if plot is not None:
        from etc_engine.figures import save_packing

        with replacing(plot) as file:
            save_packing(packing, file)
    record = {
        "particles": packing.count,
        "density": packing.density,
        "contacts": contacts,
        "coordination": 2.0 * contacts / packing.count,
        "seconds": seconds,
        "seed": seed,
    }
    if as_json:
        print_json(record)
    else:
        for name, value in record.items():
            click.echo(f"{name:14s}{f'{value:.8g}' if isinstance(value, float) else value}")
