"""``etc-engine pack``: a random packing of disks or spheres."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from etc_engine.packing import ParticlePacking


STDOUT = Path("-")


@click.command("pack")
@click.option(
    "--method",
    default="advancing-front",
    show_default=True,
    help="advancing-front: disks between walls, each touching others. lubachevsky-stillinger: disks or spheres, up to "
    "jamming. random-sequential: disks or spheres, loose.",
)
@click.option("--growth-rate", type=float, help="Growth rate of lubachevsky-stillinger.")
@click.option(
    "--radii",
    required=True,
    help="equal[:r], uniform:a:b, gaussian:mean:sd, lognormal:mean:sd or bidisperse:a:b:fraction.",
)
@click.option("--box", required=True, help="Edge lengths, such as 1,1 or 1,1,1.")
@click.option("--count", type=int, help="Number of particles.")
@click.option("--density", type=float, help="Sum of the particle areas (volumes) over that of the box.")
@click.option("--periodic", default="", help="Periodic axes: x, y, xy or xyz. Walls elsewhere.")
@click.option("--seed", type=int, help="Seed of the random stream. By default one is drawn and printed.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    help="File to write: .csv, .dump or .lammpstrj (LAMMPS), .nc (netCDF) or .vtp (VTK). - is CSV on stdout.",
)
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the packing and its structure.")
@click.option(
    "--bond-gap",
    type=float,
    default=1e-6,
    show_default=True,
    help="Largest gap that counts as a contact, in mean radii.",
)
@click.option("--contact-gap", hidden=True)
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
    bond_gap: float,
    contact_gap: str | None,
    as_json: bool,
) -> None:
    """Make a random packing and write it to a file, in the format of its ending."""
    from numpy.random import SeedSequence, default_rng

    from etc_engine.cli.clock import Clock
    from etc_engine.cli.options import check_picture, check_place, parse_box, print_json
    from etc_engine.cli.progress import PackingProgress
    from etc_engine.durable.files import replacing
    from etc_engine.errors import InputError
    from etc_engine.packing import PackingSpec, pack
    from etc_engine.packing.neighbors import neighbor_pairs
    from etc_engine.packing.radii import parse_radii
    from etc_engine.particle_files.csv_files import write_csv
    from etc_engine.particle_files.formats import write_particles
    from etc_engine.particle_files.table import ParticleTable

    if seed is not None and seed < 0:
        raise InputError(f"--seed must not be negative, found {seed}")
    if contact_gap is not None:
        raise InputError(f"--contact-gap {contact_gap} is now --bond-gap {contact_gap}, the same word as in solve")
    if not 0.0 <= bond_gap <= 1.0:
        raise InputError(f"--bond-gap must lie between 0 and 1 mean radius, found {bond_gap:g}")
    spec = PackingSpec(
        method=method,
        radii=parse_radii(radii),
        box=parse_box(box, periodic),
        count=count,
        density=density,
        growth_rate=growth_rate,
    )
    _check_output(output, as_json)
    if plot is not None:
        check_picture(plot)
        check_place(plot)
    seed = int(SeedSequence().generate_state(1)[0]) if seed is None else seed
    clock = Clock()
    with PackingProgress() as progress:
        packing = pack(spec, default_rng(seed), progress.report)
    seconds = clock.record()
    contacts = neighbor_pairs(packing, relative_gap=bond_gap).count
    options = {
        "method": method,
        "growth-rate": growth_rate,
        "radii": radii,
        "box": box,
        "count": count,
        "density": density,
        "periodic": periodic or None,
        "seed": seed,
    }
    if output == STDOUT:
        write_csv(sys.stdout, ParticleTable(packing))
    else:
        with replacing(output) as file:
            write_particles(file, ParticleTable(packing), _provenance(options, output))
    if plot is not None:
        from etc_engine.output.figures import save_structure

        with replacing(plot) as file:
            save_structure(packing, file, bond_gap)
    record = {
        "particles": packing.count,
        "density": packing.density,
        "contacts": contacts,
        "coordination": 2.0 * contacts / packing.count,
        **seconds,
        "seed": seed,
    }
    if method == "advancing-front" and density is not None:
        _warn_of_growth(packing, density)
    if as_json:
        print_json(record)
    else:
        for name, value in record.items():
            text = f"{name:16s}{f'{value:.8g}' if isinstance(value, float) else value}"
            click.echo(text, err=output == STDOUT)


def _warn_of_growth(packing: ParticlePacking, density: float) -> None:
    """Radii that were grown beyond the packer's own density are not those that were asked for."""
    from etc_engine.packing.neighbors import neighbor_pairs

    near = neighbor_pairs(packing)
    if not near.count:
        return
    deepest = -float((near.gaps / (0.5 * packing.radii[near.pairs].sum(axis=1))).min())
    if deepest > 1e-9:
        click.echo(
            f"etc-engine: warning: density {density:g} is above the packer's own; all radii were grown to meet it, and "
            f"disks overlap by up to {deepest:.2g} mean radii (and reach over the walls)",
            err=True,
        )


def _check_output(output: Path, as_json: bool) -> None:
    """Refuse a file that could not be written, before the work begins."""
    from etc_engine.cli.options import check_place
    from etc_engine.errors import InputError
    from etc_engine.particle_files.formats import VTP, format_to_write
    from etc_engine.particle_files.vtp import require_vtk

    if output == STDOUT:
        if as_json:
            raise InputError("-o - writes the packing to stdout, where --json prints its object: give one of them")
        return
    if format_to_write(output) is VTP:
        require_vtk()
    check_place(output)


def _provenance(options: dict[str, Any], output: Path) -> dict[str, Any]:
    """What makes the packing again: method, radii, seed, and the command with the seed that was drawn."""
    words = [word for name, value in options.items() if value is not None for word in (f"--{name}", str(value))]
    return {
        "method": options["method"],
        "radii": options["radii"],
        "seed": str(options["seed"]),  # it may be larger than any integer of netCDF
        "command": shlex.join(["etc-engine", "pack", *words, "-o", str(output)]),
    }
