"""``etc-engine solve``: the effective conductivity of one packing."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from etc_engine.cli.particle_options import (
    SampleWords,
    particle_options,
    read_sample,
    warn_of_digits,
    warn_of_excess,
    warn_of_sample,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from etc_engine.engines.dtem.field import ParticleField
    from etc_engine.engines.dtem.steady import SteadySolution
    from etc_engine.engines.pipe.steady import PipeSolution
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.network import ContactNetwork

    Result = EffectiveConductivity[SteadySolution] | EffectiveConductivity[PipeSolution]


BOND_GAP = 1e-6


@click.command("solve")
@click.argument("particles", type=click.Path(path_type=Path))
@particle_options
@click.option("--method", default="chord", show_default=True, help="chord, standard, enhanced, arc, exact or pipe.")
@click.option("--pipe-resistance", help="Resistance of a pipe, with --method pipe: chord (the default) or uniform.")
@click.option("--modes", type=int, help="Flux modes of a contact, with --method exact or arc.")
@click.option(
    "--contact-angle", type=float, help="Half-angle in degrees of bonded contacts; without it contacts are overlaps."
)
@click.option("--bond-gap", type=float, default=BOND_GAP, show_default=True, help="Largest bonded gap, in mean radii.")
@click.option(
    "--conductivity", type=float, help="Conductivity of the particles [W/(m K)]; 1 by default, or the file's column."
)
@click.option(
    "--contact-resistance",
    type=float,
    default=0.0,
    show_default=True,
    help="Resistance of every contact, walls included, per unit thickness [m K/W].",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="netCDF with particles, contacts and fields.")
@click.option("--vtk", type=click.Path(path_type=Path), help="VTK PolyData (.vtp) for ParaView.")
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the temperature field.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def solve_command(
    particles: Path,
    words: SampleWords,
    method: str,
    pipe_resistance: str | None,
    modes: int | None,
    contact_angle: float | None,
    bond_gap: float,
    conductivity: float | None,
    contact_resistance: float,
    output: Path | None,
    vtk: Path | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Effective conductivity of the disks in a file.

    PARTICLES is a CSV file with the columns x,y,radius[,conductivity], a LAMMPS/LIGGGHTS text dump, a netCDF (.nc)
    or VTK (.vtp) file as ``pack`` writes it, or a file of another DEM code (VTK, extended XYZ, YADE, MercuryDPM); -
    is standard input. Walls at x = 0 (temperature 1) and x = L (temperature 0), unless the box is periodic along x.
    """
    start = time.perf_counter()
    from math import radians

    from etc_engine.cli.options import print_json
    from etc_engine.errors import InputError
    from etc_engine.medium.rules import bonded_contacts, overlap_contacts

    outputs = _Outputs(output, vtk, plot)
    outputs.check(particles)
    if method != "pipe" and pipe_resistance is not None:
        raise InputError(f"--pipe-resistance goes with --method pipe, found --method {method}")
    if method == "pipe" and modes is not None:
        raise InputError("--modes goes with --method exact or arc: a pipe has one heat flow")
    if contact_angle is None and bond_gap != BOND_GAP:
        raise InputError("--bond-gap goes with --contact-angle, which is missing: overlaps have no gap")
    table = read_sample(particles, words)
    if conductivity is not None and table.conductivity is not None:
        raise InputError(f"{particles} has a conductivity column: leave --conductivity out, or take the column out")
    given = 1.0 if conductivity is None else conductivity
    if contact_angle is None:
        network = overlap_contacts(table.packing)
    else:
        network = bonded_contacts(table.packing, radians(contact_angle), bond_gap)
    asked = _Asked(
        table.packing.box.periodic,
        method,
        pipe_resistance or "chord",
        modes,
        given if table.conductivity is None else table.conductivity,
        contact_resistance,
    )
    result, field = asked.solve(network)
    record = _record(network, asked, result, field)
    _warn_of_close_arcs(method, result.solutions[0])
    _warn_of_missing_contacts(network, contact_angle, bond_gap)
    gap = 0.0 if contact_angle is None else bond_gap
    warn_of_digits(table, gap, bonded=contact_angle is not None)
    warn_of_sample(table, [] if table.packing.box.periodic[0] else [0], gap)
    warn_of_excess(result.tensor, asked.conductivity)
    _write(outputs, result, field, record)
    record["seconds"] = time.perf_counter() - start
    if as_json:
        print_json(record)
    else:
        _print_table(record)


@dataclass(frozen=True)
class _Asked:
    """The physics asked for."""

    periodic: tuple[bool, ...]
    method: str
    pipe_resistance: str
    modes: int | None
    conductivity: ArrayLike
    contact_resistance: float

    def solve(self, network: ContactNetwork) -> tuple[Result, ParticleField]:
        """Conductivity, and the field of the load along x."""
        axes = (0, 1) if all(self.periodic) else (0,)
        if self.method == "pipe":
            from etc_engine.engines.pipe.field import pipe_field
            from etc_engine.engines.pipe.steady import pipe_conductivity

            pipes = pipe_conductivity(
                network,
                resistance=self.pipe_resistance,
                conductivity=self.conductivity,
                contact_resistance=self.contact_resistance,
                axes=axes,
            )
            return pipes, pipe_field(pipes.solutions[0])
        from etc_engine.engines.dtem.effective import effective_conductivity
        from etc_engine.engines.dtem.field import recover_field

        elements = effective_conductivity(
            network,
            method=self.method,
            conductivity=self.conductivity,
            contact_resistance=self.contact_resistance,
            modes=self.modes,
            axes=axes,
        )
        return elements, recover_field(elements.solutions[0])


@dataclass(frozen=True)
class _Outputs:
    """Files asked for."""

    netcdf: Path | None
    vtk: Path | None
    plot: Path | None

    def check(self, particles: Path) -> None:
        """Refuse what cannot be written, or would replace the input, before the work begins."""
        from etc_engine.cli.options import check_picture, check_place
        from etc_engine.errors import InputError

        if self.plot is not None:
            check_picture(self.plot)
        if self.vtk is not None and self.vtk.suffix != ".vtp":
            raise InputError(f"VTK PolyData is written to a .vtp file, found {str(self.vtk)!r}")
        for path in (self.netcdf, self.vtk, self.plot):
            if path is not None:
                check_place(path, particles)


def _write(
    outputs: _Outputs,
    result: Result,
    field: ParticleField,
    record: dict[str, Any],
) -> None:
    """Write what was asked for: every file whole, or none of them."""
    from etc_engine.durable.files import replacing

    solution = result.solutions[0]
    with ExitStack() as files:
        if outputs.netcdf is not None:
            from etc_engine.durable.provenance import engine_version
            from etc_engine.output.single import solve_dataset

            plain = {key: value for key, value in record.items() if key != "contact_temperatures"}
            plain["percolates"] = int(plain["percolates"])
            plain["conductivity_units"] = "W m-1 K-1"
            plain["source"] = f"etc_engine {engine_version()}"
            if "conductivity_tensor" in plain:
                plain["conductivity_tensor"] = plain["conductivity_tensor"].ravel()
            plain["command"] = " ".join(["etc-engine", *sys.argv[1:]])
            file = files.enter_context(replacing(outputs.netcdf))
            solve_dataset(solution, field, plain).to_netcdf(file, engine="netcdf4")
        if outputs.vtk is not None:
            from etc_engine.output.vtk import write_vtp

            write_vtp(files.enter_context(replacing(outputs.vtk)), solution, field)
        if outputs.plot is not None:
            from etc_engine.output.figures import save_field

            caption = f"{record['method']}: k = {record['conductivity']:.6g} W/(m K), {record['particles']} particles"
            if "conductivity_bounds" in record:
                low, high = record["conductivity_bounds"]
                caption += f", bounds {low:.8g} to {high:.8g}"
            save_field(files.enter_context(replacing(outputs.plot)), solution, field, caption)


def _warn_of_close_arcs(method: str, solution: SteadySolution | PipeSolution) -> None:
    from etc_engine.engines.pipe.steady import PipeSolution
    from etc_engine.medium.sides import count_close_arcs

    if method == "exact" or isinstance(solution, PipeSolution):
        return
    close = count_close_arcs(solution.sides)
    if close:
        click.echo(
            f"etc-engine: warning: between {close} pairs of contact arcs of one particle the gap is less than the sum "
            f"of their half-angles; {method} loses accuracy there, method exact does not",
            err=True,
        )


def _warn_of_missing_contacts(network: ContactNetwork, contact_angle: float | None, bond_gap: float) -> None:
    """A packing without a single contact is most likely a misunderstanding about the contact rule."""
    from etc_engine.packing.neighbors import neighbor_pairs

    packing = network.packing
    if network.count or packing.count < 2:
        return
    near = neighbor_pairs(packing, relative_gap=1.0)
    if not near.count:
        return
    closest = float((near.gaps / (0.5 * packing.radii[near.pairs].sum(axis=1))).min())
    rule = "no particles overlap" if contact_angle is None else f"no surfaces are within {bond_gap:g} mean radii"
    remedy = "touching particles conduct with --contact-angle" if contact_angle is None else "see --bond-gap"
    click.echo(
        f"etc-engine: warning: {rule}, so nothing conducts; the closest pair is {max(closest, 0.0):.2g} mean radii "
        f"apart: {remedy}",
        err=True,
    )


def _record(
    network: ContactNetwork,
    asked: _Asked,
    result: Result,
    field: ParticleField,
) -> dict[str, Any]:
    from etc_engine.engines.dtem.effective import conductivity_bounds
    from etc_engine.engines.dtem.model_error import chord_error_estimate
    from etc_engine.engines.pipe.steady import PipeSolution
    from etc_engine.realization import Status
    from etc_engine.structure.filling import find_filling

    percolates = bool(result.spans[0])
    record: dict[str, Any] = {"method": asked.method, "conductivity": float(result.tensor[0, 0])}
    if all(network.packing.box.periodic):
        record["conductivity_tensor"] = result.tensor
    solution = result.solutions[0]
    if isinstance(solution, PipeSolution):
        record["pipe_resistance"] = asked.pipe_resistance
    elif asked.method == "exact":
        bounds = conductivity_bounds(cast("EffectiveConductivity[SteadySolution]", result))[0]
        record["conductivity_bounds"] = bounds
        record["model_error_estimate"] = float(bounds[1] / bounds[0] - 1.0) if percolates else 0.0
    elif asked.method == "chord":
        record["model_error_estimate"] = chord_error_estimate(solution)
    return record | {
        "particles": network.packing.count,
        "density": network.packing.density,
        "fill_height": find_filling(network.packing).fill_height,
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
        elif name == "conductivity_bounds":
            text = " to ".join(f"{k:.8g}" for k in value)
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        label = "wall contacts along x" if name == "wall_contacts" else name.replace("_", " ")
        click.echo(f"{label:24s}{text}{unit}")
