"""Voxel images in ``homogenize``: the options that they take, and their conductivity."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError

if TYPE_CHECKING:
    from etc_engine.particle_files.images import LabelImage

OPTIONS = (
    click.option("--phases", help="Conductivity of each label of a voxel image [W/(m K)], such as 0=0.2,1=30."),
    click.option("--shape", help="Number of voxels of a raw image along x, y and z, such as 100,100,100."),
    click.option("--voxel-type", default="uint8", show_default=True, help="Number type of a raw voxel image."),
)


@dataclass(frozen=True)
class ImageWords:
    """The words of the options."""

    phases: str | None = None
    shape: str | None = None
    voxel_type: str = "uint8"

    def asked(self, path: Path) -> bool:
        """Whether a file is an image.

        Raises
        ------
        InputError
            If it is none and an option of images is given.
        """
        from etc_engine.particle_files.images import is_image

        found = is_image(path, raw=self.shape is not None)
        if not found and self.phases is not None:
            raise InputError(f"--phases is only valid with voxel images (.npy, TIFF, raw); {path} is none")
        return found

    def solve(self, path: Path, matrix: float | None, inclusion: float | None, given: ImageTask) -> dict[str, Any]:
        """The record of an image's conductivity.

        Raises
        ------
        InputError, ConvergenceError
        """
        from etc_engine.cli.options import per_axis_and_tensor
        from etc_engine.engines.voxel.images import homogenize_image
        from etc_engine.models.bounds import parallel, series
        from etc_engine.particle_files.images import read_image

        image = read_image(path, () if self.shape is None else _numbers(self.shape), self.voxel_type)
        phases = self._conductivities(image, matrix, inclusion)
        lengths = given.lengths or tuple(map(float, image.labels.shape))
        if len(lengths) != image.labels.ndim:
            raise InputError(f"--box needs {image.labels.ndim} edge lengths for this image, found {len(lengths)}")
        solution, error = homogenize_image(
            image.labels, phases, lengths, boundary=given.boundary, solver=given.solver, threads=given.threads
        )
        record: dict[str, Any] = {
            "engine": "voxel",
            "method": "image",
            "boundary": given.boundary,
            "dimension": image.labels.ndim,
            "voxels": list(image.labels.shape),
            **per_axis_and_tensor(solution.tensor, tuple(range(image.labels.ndim))),
            "phases": {str(label): phases[label] for label in image.phases},
            "fractions": {str(label): share for label, share in zip(image.phases, image.fractions, strict=True)},
        }
        if len(image.phases) == 2:
            low, high = (phases[label] for label in image.phases)
            record["conductivity_bounds"] = [
                float(bound(low, high, image.fractions[1])) for bound in (series, parallel)
            ]
        return record | {
            "unknowns": image.labels.size,
            "iterations": solution.iterations,
            "relative_error_estimate": error,
        }

    def _conductivities(self, image: LabelImage, matrix: float | None, inclusion: float | None) -> dict[int, float]:
        """Conductivity of each label."""
        if self.phases is None:
            if matrix is None or inclusion is None or len(image.phases) != 2:
                raise InputError(
                    f"the image has the labels {', '.join(map(str, image.phases))}: give the conductivity of "
                    f"each, such as --phases {','.join(f'{label}=1' for label in image.phases)}"
                )
            return dict(zip(image.phases, (matrix, inclusion), strict=True))
        if matrix is not None or inclusion is not None:
            raise InputError(
                "--phases and --matrix or --inclusion both say what the image is made of: give one of them"
            )
        found: dict[int, float] = {}
        for part in self.phases.split(","):
            label, mark, value = part.partition("=")
            try:
                if not mark or int(label) in found:
                    raise ValueError(part)
                found[int(label)] = float(value)
            except ValueError:
                raise InputError(
                    f"--phases takes LABEL=CONDUCTIVITY words such as 0=0.2,1=30, found {part!r}"
                ) from None
        return found


@dataclass(frozen=True)
class ImageTask:
    """How an image is solved."""

    lengths: tuple[float, ...] | None
    boundary: str
    solver: str
    threads: int


def image_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options, as one argument ``image``."""

    @wraps(command)
    def gathered(**given: Any) -> Any:
        own = {name: given.pop(name) for name in ImageWords.__dataclass_fields__}
        return command(image=ImageWords(**own), **given)

    for option in reversed(OPTIONS):
        gathered = option(gathered)
    return gathered


def write_image_result(path: Path, record: dict[str, Any]) -> None:
    """The tensor, the image and the conductivities, as netCDF.

    Raises
    ------
    OutputError
    """
    import xarray

    from etc_engine.box import AXES
    from etc_engine.cli.options import tensor_of
    from etc_engine.durable.files import replacing
    from etc_engine.durable.provenance import engine_version

    axes = list(AXES[: record["dimension"]])
    apart = ("conductivity_tensor", "conductivity_per_axis", "phases", "fractions")
    attributes = {key: value for key, value in record.items() if key not in apart}
    labels = [int(label) for label in record["phases"]]
    dataset = xarray.Dataset(
        {
            "effective_conductivity": (
                ("direction_i", "direction_j"),
                tensor_of(record),
                {"long_name": "effective conductivity", "units": "W m-1 K-1"},
            ),
            "phase_conductivity": (
                "phase",
                list(record["phases"].values()),
                {"long_name": "conductivity of the phase", "units": "W m-1 K-1"},
            ),
            "phase_fraction": (
                "phase",
                list(record["fractions"].values()),
                {"long_name": "volume fraction of the phase", "units": "1"},
            ),
        },
        coords={"direction_i": axes, "direction_j": axes, "phase": labels},
        attrs={
            "Conventions": "CF-1.11",
            "title": f"effective conductivity of a voxel image of {len(labels)} phases",
            **attributes,
            "source": f"etc_engine {engine_version()}",
            "command": " ".join(["etc-engine", *sys.argv[1:]]),
        },
    )
    with replacing(path) as file:
        dataset.to_netcdf(file, engine="netcdf4")


def _numbers(word: str) -> tuple[int, ...]:
    try:
        found = tuple(int(part) for part in word.split(","))
    except ValueError:
        found = ()
    if len(found) not in (2, 3) or min(found) < 1:
        raise InputError(f"--shape takes two or three numbers of voxels, such as 100,100,100: found {word!r}")
    return found
