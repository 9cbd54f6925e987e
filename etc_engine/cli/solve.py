"""``etc-engine solve``: the effective conductivity of one packing."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.cli.contact_options import ContactWords, contact_options
from etc_engine.cli.particle_options import (
    SampleWords,
    particle_options,
    read_sample,
    warn,
)
from etc_engine.cli.physics_options import PhysicsWords, physics_options

if TYPE_CHECKING:
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.field import ParticleField
    from etc_engine.medium.medium import Medium
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.particle_files.table import ParticleTable
    from etc_engine.realization import Engine

BOND_GAP = 1e-6
ESTIMATED = 5_000
"""Up to so many particles the discretization error is estimated where a method can; it takes three times as long."""
LABELS = {"wall_contacts": "wall contacts on axis", "status_name": "status", "fill_height": "fill height [m]"}


@click.command("solve")
@click.argument("particles", type=click.Path(path_type=Path))
@particle_options
@click.option("--axis", help="Load axis: x (the default), y, z or all.")
@click.option("--engine", default="dtem", show_default=True, help="dtem: thermal elements; pipe: pipe network.")
@click.option(
    "--method",
    help="Of dtem: chord, standard, enhanced, arc, exact, cell (disks or spheres) or facets (spheres, where the pores "
    "conduct); of pipe: chord or uniform, for spheres also holm or root-area. By default the first that fits.",
)
@click.option("--pipe-resistance", hidden=True)
@click.option("--modes", type=int, help="Flux modes of a contact, with --method exact or arc.")
@click.option("--degree", type=int, help="Polynomial degree on the edges of cells, with --method cell: 1 to 5.")
@click.option("--bounds", is_flag=True, help="Rigorous bounds too, with --method cell and few disks.")
@click.option(
    "--contact-angle", type=float, help="Half-angle in degrees of bonded contacts; without it contacts are overlaps."
)
@click.option("--bond-gap", type=float, default=BOND_GAP, show_default=True, help="Largest bonded gap, in mean radii.")
@click.option(
    "--conductivity", type=float, help="Conductivity of the particles [W/(m K)]; 1 by default, or the file's column."
)
@click.option(
    "--pore-conductivity",
    type=float,
    default=0.0,
    show_default=True,
    help="Conductivity of what fills the pores [W/(m K)].",
)
@physics_options
@click.option(
    "--contact-resistance",
    type=float,
    default=0.0,
    show_default=True,
    help="Resistance of every contact, walls included, in 2D per unit thickness [K/W, m K/W].",
)
@contact_options
@click.option("-o", "--output", type=click.Path(path_type=Path), help="netCDF with particles, contacts and fields.")
@click.option("--vtk", type=click.Path(path_type=Path), help="VTK PolyData (.vtp) for ParaView.")
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the temperature field.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option("--full", is_flag=True, help="With --json, the temperature of every contact too.")
def solve_command(
    particles: Path,
    words: SampleWords,
    dumped: ContactWords,
    output: Path | None,
    vtk: Path | None,
    plot: Path | None,
    as_json: bool,
    full: bool,
    **given: Any,
) -> None:
    """Effective conductivity of the particles in a file.

    PARTICLES is a CSV file with the columns x,y[,z],radius[,conductivity], a LAMMPS/LIGGGHTS text dump, a netCDF (.nc)
    or VTK (.vtp) file as ``pack`` writes it, or a file of another DEM code (VTK, extended XYZ, YADE, MercuryDPM); -
    is standard input. Along the load axis the walls are held at 1 (low end) and 0 (far end), unless the box is
    periodic along it.
    """
    start = time.perf_counter()
    import numpy as np

    from etc_engine.cli.options import print_json
    from etc_engine.errors import InputError
    from etc_engine.medium.sample_warnings import box_warnings, digit_warnings, excess_warnings
    from etc_engine.realization import field_along, find_engine

    asked = _Asked(**given)
    asked.refuse_old_words()
    engine = find_engine(asked.engine)
    outputs = _Outputs(output, vtk, plot)
    outputs.check(particles)
    table = read_sample(particles, words)
    elastic = asked.physics.youngs_modulus, asked.physics.poisson_ratio
    medium = asked.medium(table, particles, dumped.network(table, words.frame, *elastic))
    axes = _load_axes(asked.axis, medium)
    medium = _trimmed(medium, table, axes)
    method = asked.method or engine.default_method(medium.dimension, medium.pores.conduct)
    result = asked.solve(medium, engine, method, axes)
    between = asked.between_walls(medium, method, axes)
    try:
        field = field_along(medium, result, engine=engine.name, method=method, axis=axes[0])
    except InputError:
        if full or outputs.wanted:
            raise
        field = None  # a method without fields still has its conductivity
    record = {**_record(asked, method, result, medium if field is None else field.medium, axes), **between}
    if field is not None:
        each = zip(field.medium.links.pairs.tolist(), field.contact_temperatures.tolist(), strict=True)
        record["contact_temperatures"] = [{"particles": pair, "temperature": value} for pair, value in each]
    for remark in engine.remarks(method, result):
        click.echo(f"etc-engine: warning: {remark}", err=True)
    if not medium.pores.conduct:
        _warn_of_missing_contacts(medium.links, asked, given=dumped.contacts is not None)
    gap = asked.gap(medium.links)
    if dumped.contacts is None and not asked.closest:  # of the closest pairs there are as many, whatever the digits
        warn(digit_warnings(table, gap, bonded=asked.takes_gap))
    driven = [] if medium.pores.conduct else [axis for axis in axes if not medium.box.periodic[axis]]
    warn(box_warnings(table, driven, gap))
    warn(excess_warnings(result.tensor, np.append(medium.conductivity, medium.pores.conductivity)))
    if field is not None:
        _write(outputs, field, record, table)
    record["seconds"] = time.perf_counter() - start
    if not full:
        record.pop("contact_temperatures", None)
    if as_json:
        print_json(record)
    else:
        _print_table(record)


@dataclass(frozen=True)
class _Asked:
    """The physics asked for, in the words of the options."""

    axis: str | None
    engine: str
    method: str | None
    pipe_resistance: str | None
    modes: int | None
    degree: int | None
    bounds: bool
    contact_angle: float | None
    bond_gap: float
    conductivity: float | None
    pore_conductivity: float
    contact_resistance: float
    physics: PhysicsWords

    def refuse_old_words(self) -> None:
        """Refuse spellings of earlier versions, and options that mean nothing together."""
        from etc_engine.errors import InputError

        if self.method == "pipe" or self.pipe_resistance is not None:
            found = "--method pipe" if self.method == "pipe" else f"--pipe-resistance {self.pipe_resistance}"
            raise InputError(f"{found} is now --engine pipe --method {self.pipe_resistance or 'chord'}")
        if self.bond_gap != BOND_GAP and not self.takes_gap:
            if self.rule == "overlap":
                raise InputError(
                    "--bond-gap is only valid with --contact-angle, which is missing: overlaps have no gap"
                )
            raise InputError(f"--bond-gap means nothing to the contact rule {self.rule}: leave it out")
        if self.contact_resistance > 0.0 and self.physics.roughness is not None:
            raise InputError("--contact-resistance and --roughness both resist at contacts: leave one of them out")

    @property
    def bonded(self) -> bool:
        """Whether contacts are bonds of a given width."""
        return self.contact_angle is not None or self.physics.contact_radius is not None

    @property
    def rule(self) -> str:
        """The word of the contact rule."""
        return self.physics.rule_for(self.contact_angle)

    @property
    def takes_gap(self) -> bool:
        """Whether the contact rule joins particles across a gap that the user gives."""
        from etc_engine.medium.rules import find_rule

        return "bond_gap" in find_rule(self.rule).keys and not self.closest

    @property
    def closest(self) -> bool:
        """Whether the contacts are the closest pairs, as many as give a coordination number."""
        return self.physics.coordination is not None

    def gap(self, network: ContactNetwork) -> float:
        """Largest gap of a contact in mean radii: the user's, that of the closest pairs, or 0."""
        from etc_engine.medium.sample_warnings import widest_gap

        if self.closest:
            return widest_gap(network)
        return self.bond_gap if self.takes_gap else 0.0

    def medium(self, table: ParticleTable, particles: Path, dumped: ContactNetwork | None) -> Medium:
        """The particles of a file with contacts, those of a contact dump if there is one, and materials."""
        from math import radians

        import numpy as np

        from etc_engine.errors import InputError
        from etc_engine.medium.medium import Medium

        if self.conductivity is not None and self.physics.material is not None:
            raise InputError("--material and --conductivity both say what the particles are: leave one of them out")
        if self.conductivity is not None and table.conductivity is not None:
            raise InputError(
                f"{particles} has a conductivity column (or --types gives one): leave --conductivity out, or "
                "take the column out"
            )
        if dumped is not None and (self.bonded or self.physics.contact_rule is not None):
            raise InputError("--contacts and --contact-angle or --rule say how wide contacts are: give one of them")
        solid = self.physics.solid() if self.conductivity is None else self.conductivity
        given = 1.0 if solid is None else solid
        kappa = np.asarray(given if table.conductivity is None else table.conductivity)
        half_angle = None if self.contact_angle is None else radians(self.contact_angle)
        network = dumped or self.physics.network(table.packing, half_angle, self.bond_gap)
        pores = self.physics.pores(table.packing, self.pore_conductivity)
        if self.contact_resistance > 0.0 or self.physics.roughness is None:
            network = network.with_resistance(self.contact_resistance)
        network = self.physics.roughened(network, kappa, pores)
        return Medium(table.packing, kappa, network, pores)

    def solve(self, medium: Medium, engine: Engine, method: str, axes: tuple[int, ...]) -> EffectiveConductivity[Any]:
        """The conductivity along the axes."""
        from etc_engine.errors import InputError
        from etc_engine.realization import effective_conductivity

        if not engine.needs_contacts:
            raise InputError(
                f"engine {engine.name} resolves the pores: use etc-engine homogenize FILE --engine {engine.name} "
                "--matrix ... --inclusion ..."
            )
        given = {"modes": self.modes, "degree": self.degree, "bounds": self.bounds or None}
        options = {name: value for name, value in given.items() if value is not None}
        if "error_estimate" in engine.find_method(method).options and medium.packing.count <= ESTIMATED:
            options["error_estimate"] = True
        return effective_conductivity(medium, engine=engine.name, method=method, axes=axes, **options)

    def between_walls(self, medium: Medium, method: str, axes: tuple[int, ...]) -> dict[str, Any]:
        """Record of the conduction between two walls at the local temperature, if it is asked for."""
        from etc_engine.errors import InputError

        if self.physics.walls is None:
            return {}
        if method != "facets" or len(axes) != 1:
            raise InputError("--wall-temperatures take method facets and one --axis")
        return self.physics.between_walls(medium, axes[0])


def _load_axes(word: str | None, medium: Medium) -> tuple[int, ...]:
    """Axes of a word; without one x, and the other axes too that come at no price in a periodic box."""
    from etc_engine.box import AXES
    from etc_engine.errors import InputError

    box = medium.box
    if word == "all" or (word is None and all(box.periodic)):
        return tuple(range(box.dimension))
    word = "x" if word is None else word
    if word not in tuple(AXES[: box.dimension]):
        raise InputError(f"--axis is one of {', '.join(AXES[: box.dimension])} or all, found {word!r}")
    return (AXES.index(word),)


@dataclass(frozen=True)
class _Outputs:
    """Files asked for."""

    netcdf: Path | None
    vtk: Path | None
    plot: Path | None

    @property
    def wanted(self) -> bool:
        """Whether any file is."""
        return any(path is not None for path in (self.netcdf, self.vtk, self.plot))

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


def _write(outputs: _Outputs, field: ParticleField, record: dict[str, Any], table: ParticleTable) -> None:
    """Write what was asked for: every file whole, or none of them."""
    from etc_engine.durable.files import replacing

    with ExitStack() as files:
        if outputs.netcdf is not None:
            from etc_engine.durable.provenance import engine_version
            from etc_engine.output.single import solve_dataset
            from etc_engine.particle_files.netcdf import with_ids

            plain = {key: value for key, value in record.items() if key != "contact_temperatures"}
            plain |= {f"conductivity_{axis}": k for axis, k in plain.pop("conductivity_per_axis").items()}
            plain["percolates"] = int(plain["percolates"])
            plain["conductivity_units"] = "W m-1 K-1"
            plain["source"] = f"etc_engine {engine_version()}"
            if "conductivity_tensor" in plain:
                plain["conductivity_tensor"] = plain["conductivity_tensor"].ravel()
            plain["command"] = " ".join(["etc-engine", *sys.argv[1:]])
            file = files.enter_context(replacing(outputs.netcdf))
            with_ids(solve_dataset(field, plain), table).to_netcdf(file, engine="netcdf4")
        if outputs.vtk is not None:
            from etc_engine.output.vtk import write_vtp

            write_vtp(files.enter_context(replacing(outputs.vtk)), field)
        if outputs.plot is not None:
            from etc_engine.output.figures import save_field

            name = f"{record['engine']}, {record['method']}"
            caption = f"{name}: k = {record['conductivity']:.6g} W/(m K), {record['particles']} particles"
            if "conductivity_bounds" in record:
                low, high = record["conductivity_bounds"]
                caption += f", bounds {low:.8g} to {high:.8g}"
            save_field(files.enter_context(replacing(outputs.plot)), field, caption)


def _trimmed(medium: Medium, table: ParticleTable, axes: tuple[int, ...]) -> Medium:
    """The medium as the driven walls of a crop leave it; the user is told what they go through."""
    import numpy as np

    from etc_engine.medium.cut_contacts import trim_crop

    driven = np.repeat(np.isin(np.arange(medium.dimension), axes), 2)
    walls = np.array(table.cropped or (False,) * driven.size) & driven
    if not (medium.links.geometric and walls.any()):
        return medium
    network, deep, cut = trim_crop(medium.links, walls)
    if deep:
        text = f"the crop goes through the middle of {deep} particles; their cut is taken at 75 degrees"
        click.echo(f"etc-engine: warning: {text}", err=True)
    if cut:
        text = f"the crop goes through {cut} contacts between particles, which are left out"
        click.echo(f"etc-engine: warning: {text}", err=True)
    return medium.with_network(network)


def _warn_of_missing_contacts(network: ContactNetwork, asked: _Asked, *, given: bool) -> None:
    """A packing without a single contact is most likely a misunderstanding about the contact rule, or their file."""
    from etc_engine.packing.neighbors import neighbor_pairs

    packing = network.packing
    if network.count or packing.count < 2:
        return
    near = neighbor_pairs(packing, relative_gap=1.0)
    if not near.count:
        return
    closest = float((near.gaps / (0.5 * packing.radii[near.pairs].sum(axis=1))).min())
    if given:
        rule, remedy = "the file of contacts has none between these particles", "see --contacts"
    elif asked.closest:
        rule, remedy = f"--coordination {asked.physics.coordination:g} makes no contact", "give a larger one"
    elif asked.takes_gap:
        rule, remedy = f"no surfaces are within {asked.bond_gap:g} mean radii", "see --bond-gap"
    else:
        instead = "--contact-angle" if asked.rule == "overlap" else f"--rule bonded or load instead of {asked.rule}"
        rule, remedy = "no particles overlap", f"touching particles conduct with {instead}"
    click.echo(
        f"etc-engine: warning: {rule}, so nothing conducts; the closest pair is {max(closest, 0.0):.2g} mean radii "
        f"apart: {remedy}",
        err=True,
    )


def _record(
    asked: _Asked, method: str, result: EffectiveConductivity[Any], medium: Medium, axes: tuple[int, ...]
) -> dict[str, Any]:
    import numpy as np

    from etc_engine.box import AXES
    from etc_engine.realization import Status
    from etc_engine.structure.filling import find_filling

    network, axis = medium.links, axes[0]
    percolates = bool(result.spans[axis])
    status = Status.OK if percolates else Status.NOT_PERCOLATING
    record: dict[str, Any] = {
        "engine": asked.engine,
        "method": method,
        "conductivity": float(result.tensor[axis, axis]),
        "conductivity_per_axis": {AXES[a]: float(result.tensor[a, a]) for a in axes},
    }
    if all(medium.box.periodic):
        record["conductivity_tensor"] = result.tensor
    if result.bounds is not None:
        record["conductivity_bounds"] = result.bounds[axis]
    if np.isfinite(result.model_error):
        record["model_error_estimate"] = result.model_error
    return record | {
        "particles": medium.packing.count,
        "density": medium.packing.density,
        "fill_height": find_filling(medium.packing).fill_height,
        "pore_conductivity": medium.pores.conductivity,
        "contact_rule": network.rule,
        **asked.physics.record,
        "contacts": int(np.count_nonzero(network.angles[:, 0])),
        "links": network.count,
        "wall_contacts": int(np.count_nonzero(network.wall_angles[network.walls_of(axis)])),
        "unknowns": result.unknowns,
        "percolates": percolates,
        "status": int(status),
        "status_name": status.name.lower(),
        "iterations": result.iterations,
        "relative_energy_error": result.relative_energy_error,
    }


def _print_table(record: dict[str, Any]) -> None:
    for name, value in record.items():
        if name in ("contact_temperatures", "status"):  # the name of the status is printed
            continue
        if name == "conductivity_tensor":
            text = "; ".join(" ".join(f"{k:.8g}" for k in row) for row in value)
        elif name == "conductivity_per_axis":
            text = ", ".join(f"{axis} {k:.8g}" for axis, k in value.items())
        elif name == "conductivity_bounds":
            text = " to ".join(f"{k:.8g}" for k in value)
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        label = LABELS.get(name, name.replace("_", " "))
        click.echo(f"{label:24s}{text}{unit}")
