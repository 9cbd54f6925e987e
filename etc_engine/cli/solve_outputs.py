"""The files that ``etc-engine solve`` writes."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from etc_engine.medium.field import ParticleField
    from etc_engine.particle_files.table import ParticleTable

PER_AXIS = ("conductivity", "conductivity_between_walls")
"""Values of a record that stand in it by axis."""


LABELS = {
    "wall_contacts": "wall contacts on axis",
    "status_name": "status",
    "fill_height": "fill height [m]",
    "model_error_estimate": "relative error estimate",
}


@dataclass(frozen=True)
class SolveOutputs:
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
        from etc_engine.cli.options import check_netcdf, check_picture, check_place
        from etc_engine.errors import InputError

        if self.plot is not None:
            check_picture(self.plot)
        if self.vtk is not None and self.vtk.suffix != ".vtp":
            raise InputError(f"VTK PolyData is written to a .vtp file, found {str(self.vtk)!r}")
        for path in (self.netcdf, self.vtk, self.plot):
            if path is not None:
                check_place(path, particles)
        if self.netcdf is not None:
            check_netcdf(self.netcdf)


def write_outputs(outputs: SolveOutputs, field: ParticleField, record: dict[str, Any], table: ParticleTable) -> None:
    """Write what was asked for: every file whole, or none of them."""
    from etc_engine.durable.files import replacing

    with ExitStack() as files:
        if outputs.netcdf is not None:
            from etc_engine.durable.provenance import engine_version
            from etc_engine.output.single import solve_dataset
            from etc_engine.particle_files.netcdf import with_ids

            plain = {key: value for key, value in record.items() if key != "contact_temperatures"}
            for name in PER_AXIS:
                plain |= {f"{name}_{axis}": k for axis, k in plain.pop(f"{name}_per_axis", {}).items()}
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


def print_table(record: dict[str, Any]) -> None:
    """Print a record, a line for each value."""
    labels = {name: LABELS.get(name, name.replace("_", " ")) for name in record}
    if len(axes := list(record.get("conductivity_per_axis", ()))) > 1:
        labels["conductivity"] = f"conductivity along {axes[0]}"
    width = max(24, 1 + max(map(len, labels.values())))
    for name, value in record.items():
        if name in ("contact_temperatures", "status"):  # the name of the status is printed
            continue
        if name == "conductivity_tensor":
            text = "; ".join(" ".join(f"{k:.8g}" for k in row) for row in value)
        elif name.endswith("_per_axis"):
            text = ", ".join(f"{axis} {k:.8g}" for axis, k in value.items())
        elif name == "conductivity_bounds":
            text = " to ".join(f"{k:.8g}" for k in value)
        else:
            text = f"{value:.8g}" if isinstance(value, float) else str(value)
        unit = " W/(m K)" if name.startswith("conductivity") else ""
        click.echo(f"{labels[name]:{width}s}{text}{unit}")
