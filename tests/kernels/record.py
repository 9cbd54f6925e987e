"""Record the kernels that the commands compile, in the order in which they need them: ``etc_engine/kernels.jsonl``.

Run by hand after a kernel was added, or its arguments were changed: ``python tests/kernels/record.py``. It runs the
commands of `JOBS`, one after the other, with an empty cache, and takes three minutes on one core.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
RECORD = "ETC_ENGINE_KERNEL_RECORD"
"""Environment variable with the file where a process writes what it compiled."""

DISKS, SPHERES = "--box 1,1 --periodic xy --seed 3", "--box 1,1,1 --periodic xyz --seed 3"
FLUID = "--pore-conductivity 0.1"
GAS = "--gas helium --pressure 1e5 --temperature 700 --emissivity 0.8"
STUDY = """schema = 2
name = "{name}"
seed = 3
[packing]
{packing}
[particles]
conductivity = 1.0
[contacts]
rule = "bonded"
contact_angle = [5.0, 8.0]
[pores]
conductivity = [{pores}]
[conduction]
{conduction}
[statistics]
realizations = 1
"""
FRONT = 'method = "advancing-front"\nradii = "uniform:0.05:0.1"\nbox = [1.0, 1.0]\ndensity = 0.6'
JAMMING = 'method = "lubachevsky-stillinger"\nradii = "equal"\ncount = 40\nbox = [1.0, 1.0, 1.0]\nperiodic = "xyz"'
TRANSIENT = """schema = 2
kind = "network"
name = "transient"
seed = 3
[packing]
{packing}
[contacts]
rule = "bonded"
contact_angle = 5.0
[conduction]
{conduction}
[particles]
conductivity = 1.0
heat_capacity = 1.0
initial = 0.0
[walls]
left = {{ type = "fixed", value = 1.0 }}
[time]
scheme = "bdf2"
times = [0.0, 0.1, 0.2]
steps = 2
"""
FILES = {
    "front.toml": STUDY.format(name="front", packing=FRONT, pores="0.0, 0.1", conduction='method = "cell"'),
    "disks.toml": STUDY.format(name="disks", packing=FRONT, pores="0.0", conduction=""),
    "spheres.toml": STUDY.format(name="spheres", packing=f"{JAMMING}\ndensity = 0.55", pores="0.1", conduction=""),
    "elements.toml": TRANSIENT.format(packing=FRONT, conduction='engine = "dtem"\nmethod = "chord"\ndipoles = true'),
    "pipes.toml": TRANSIENT.format(packing=FRONT, conduction='engine = "pipe"'),
}
PLAIN = "solve walls.csv --box 1,1 --contact-angle 5 --json"
PERIODIC = "solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 --contact-angle 5 --json"
WALLED = "solve balls.csv --box 1,1,1 --bond-gap 0.1 --contact-angle 5 --json"
MATRIX = "--matrix 1 --inclusion 10 --json"
PACKERS = {
    "advancing-front 2D": "pack --radii uniform:0.05:0.1 --box 1,1 --seed 3 -o walls.csv",
    "lubachevsky-stillinger 2D": "pack --method lubachevsky-stillinger --radii uniform:0.5:1 --count 60 --density 0.7 "
    f"{DISKS} -o jammed.csv",
    "random-sequential 2D": f"pack --method random-sequential --radii equal:0.06 --density 0.3 {DISKS} -o loose.csv",
    "lubachevsky-stillinger 3D": "pack --method lubachevsky-stillinger --radii uniform:0.5:1 --count 60 --density 0.5 "
    f"{SPHERES} -o balls.csv",
    "random-sequential 3D": f"pack --method random-sequential --radii equal:0.1 --density 0.2 {SPHERES} -o thin.csv",
}
METHODS = {
    **{f"dtem {word} 2D": f"{PLAIN} --method {word}" for word in ("chord", "standard", "enhanced", "arc", "exact")},
    **{f"pipe {word} 2D": f"{PLAIN} --engine pipe --method {word}" for word in ("chord", "uniform")},
    "dtem cell 2D": f"{PLAIN} {FLUID}",
    **{f"dtem {word} 3D": f"{PERIODIC} --method {word}" for word in ("chord", "standard", "exact")},
    **{f"pipe {word} 3D": f"{PERIODIC} --engine pipe --method {word}" for word in ("chord", "uniform", "holm")},
    **{f"dtem {word} 3D": f"{PERIODIC} {FLUID} --method {word}" for word in ("facets", "cell")},
    "voxel laminate 2D": f"homogenize loose.csv --box 1,1 --periodic xy {MATRIX} --resolution 40",
    "voxel laminate 3D": f"homogenize thin.csv --box 1,1,1 --periodic xyz {MATRIX} --resolution 24",
    "voxel binary 3D": f"homogenize thin.csv --box 1,1,1 --periodic xyz {MATRIX} --resolution 24 --method binary",
    "lattice laguerre 3D": f"homogenize thin.csv --box 1,1,1 {MATRIX} --engine lattice --particles 500",
}
"""Commands of the packers and methods, by the words of `Kernel.uses`."""
OTHERS = (
    "pack --radii uniform:0.05:0.1 --box 1,1 --seed 3 -o pictured.csv --plot walls.png",
    f"{PLAIN} -o field.nc --plot field.png",
    "solve jammed.csv --box 1,1 --periodic xy --bond-gap 0.1 --contact-angle 5 --json",
    f"{PLAIN} --method exact -o exact.nc --plot exact.png",
    f"{PLAIN} --method exact --area-resistance 0.1",
    f"{PLAIN} {FLUID} -o pores.nc --plot pores.png",
    f"solve walls.csv --box 1,1 --json {FLUID} --bounds",
    f"{WALLED} -o balls.nc --plot balls.png",
    f"{WALLED} --method exact -o modes.nc --plot modes.png",
    f"{WALLED} {FLUID}",
    f"{PERIODIC} {GAS} --conductivity 2",
    f"homogenize thin.csv --box 1,1,1 --boundary walls {MATRIX} --resolution 24",
    f"homogenize loose.csv --box 1,1 --boundary walls {MATRIX} --resolution 40",
    f"homogenize loose.csv --box 1,1 --periodic xy {MATRIX} --resolution 40 --solver eyre-milton",
    f"pack --method random-sequential --radii equal:0.08 --density 0.33 {SPHERES} -o full.csv",  # near saturation
    "pack --radii uniform:0.003:0.006 --box 1,1 --seed 3 -o many.csv",  # enough unknowns for multigrid
    "solve many.csv --box 1,1 --contact-angle 5 --json",
    "sweep disks.toml -o disks.nc",
    "sweep front.toml -o front.nc",
    "sweep spheres.toml -o spheres.nc",
    "transient elements.toml -o elements.nc",
    "transient pipes.toml -o pipes.nc",
)
SWEEPS = {
    "sweep 2D": ("sweep disks.toml -o disks.nc --overwrite", ("advancing-front 2D", "dtem chord 2D")),
    "sweep 3D": ("sweep spheres.toml -o spheres.nc --overwrite", ("lubachevsky-stillinger 3D", "dtem facets 3D")),
}
JOBS = (*PACKERS.values(), *METHODS.values(), *OTHERS)


class Recorded(NamedTuple):
    """What a command compiled, innermost kernels first, and the names of the kernels that it called from Python."""

    compiled: list[Any]
    called: list[str]


def run(words: str, folder: Path, cache: Path) -> Recorded:
    """Run a command in a process of its own."""
    record = folder / "record.json"
    record.unlink(missing_ok=True)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), RECORD: str(record), "PYTHONPATH": str(ROOT)}
    line = [sys.executable, __file__, *words.split()]
    done = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"etc-engine {words}: {done.stderr}")
    return Recorded(*json.loads(record.read_text()))


def prepare(folder: Path) -> None:
    """Write the studies of `JOBS`."""
    for name, text in FILES.items():
        (folder / name).write_text(text)


def child() -> None:
    """Run the command line of this process, and write down which kernels it compiles and calls.

    A kernel that is read from the disk does not name those that it calls: with a full cache only what Python calls is
    found.
    """
    from numba.core import event, types

    from etc_engine.kernels import describe

    rows: list[Any] = []

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            pass

        def on_end(self, event: Any) -> None:
            function, arguments = event.data["dispatcher"].py_func, event.data["args"]
            if not event.data["dispatcher"].targetoptions.get("cache", True):
                return
            literal = any(isinstance(kind, types.Literal) for kind in arguments)
            if function.__module__.startswith("etc_engine.") and not literal:
                rows.append([f"{function.__module__}:{function.__qualname__}", [describe(kind) for kind in arguments]])

    event.register("numba:compile", Listener())

    def write() -> None:
        found = set()
        for name, module in list(sys.modules.items()):
            if name.startswith("etc_engine."):
                kernels = [one for one in vars(module).values() if getattr(one, "overloads", None)]
                found |= {f"{one.py_func.__module__}:{one.py_func.__qualname__}" for one in kernels}
        Path(os.environ[RECORD]).write_text(json.dumps([rows, sorted(found)]))

    atexit.register(write)
    from etc_engine.cli import main

    main()


def find_uses(folder: Path, cache: Path) -> dict[str, list[str]]:
    """The uses of each kernel, from commands that find all kernels in the cache; "sweep 2D" is what sweeps add."""
    called = {use: run(words, folder, cache).called for use, words in (PACKERS | METHODS).items()}
    for use, (words, parts) in SWEEPS.items():
        called[use] = sorted(set(run(words, folder, cache).called) - {name for part in parts for name in called[part]})
    uses = defaultdict(list)
    for use, names in called.items():
        for name in names:
            uses[name].append(use)
    return uses


def main() -> None:
    """Write the list."""
    from etc_engine.kernels import LIST, callees

    seen: dict[str, list[Any]] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for words in JOBS:
            rows = run(words, folder, folder / "cache").compiled
            print(f"{len(rows):4d}  {words}", flush=True)
            seen |= {json.dumps(row): row for row in rows}
        uses = find_uses(folder, folder / "cache")
    depths: dict[str, int] = {}

    def depth(name: str) -> int:
        if name not in depths:
            depths[name] = 1 + max(map(depth, callees(name)), default=-1)
        return depths[name]

    rows = sorted(seen.values(), key=lambda row: depth(row[0]))
    LIST.write_text("".join(f"{json.dumps([*row, uses[row[0]]])}\n" for row in rows))


if __name__ == "__main__":
    child() if os.environ.get(RECORD) else main()
