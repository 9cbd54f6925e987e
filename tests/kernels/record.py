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
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
RECORD = "ETC_ENGINE_KERNEL_RECORD"
"""Environment variable with the file where a process writes what it compiled."""

DISKS, SPHERES = "--box 1,1 --periodic xy --seed 3", "--box 1,1,1 --periodic xyz --seed 3"
BONDED, FLUID = "--contact-angle 5 --json", "--pore-conductivity 0.1"
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
JOBS = (
    "pack --radii uniform:0.05:0.1 --box 1,1 --seed 3 -o walls.csv --plot walls.png",
    f"pack --method lubachevsky-stillinger --radii uniform:0.5:1 --count 60 --density 0.7 {DISKS} -o jammed.csv",
    f"pack --method random-sequential --radii equal:0.06 --density 0.3 {DISKS} -o loose.csv",
    f"pack --method lubachevsky-stillinger --radii uniform:0.5:1 --count 60 --density 0.5 {SPHERES} -o balls.csv",
    f"pack --method random-sequential --radii equal:0.1 --density 0.2 {SPHERES} -o thin.csv",
    f"solve walls.csv --box 1,1 {BONDED} -o field.nc --plot field.png",
    f"solve jammed.csv --box 1,1 --periodic xy --bond-gap 0.1 {BONDED}",
    *(f"solve walls.csv --box 1,1 {BONDED} --method {method}" for method in ("standard", "enhanced", "arc", "exact")),
    f"solve walls.csv --box 1,1 {BONDED} --method exact -o exact.nc --plot exact.png",
    f"solve walls.csv --box 1,1 {BONDED} --method exact --area-resistance 0.1",
    *(f"solve walls.csv --box 1,1 {BONDED} --engine pipe --method {method}" for method in ("chord", "uniform")),
    f"solve walls.csv --box 1,1 {BONDED} {FLUID} -o pores.nc --plot pores.png",
    f"solve walls.csv --box 1,1 --json {FLUID} --bounds",
    f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED}",
    f"solve balls.csv --box 1,1,1 --bond-gap 0.1 {BONDED} -o balls.nc --plot balls.png",
    *(
        f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED} --method {method}"
        for method in ("standard", "exact")
    ),
    f"solve balls.csv --box 1,1,1 --bond-gap 0.1 {BONDED} --method exact -o modes.nc --plot modes.png",
    f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED} --engine pipe",
    f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED} {FLUID}",
    f"solve balls.csv --box 1,1,1 --bond-gap 0.1 {BONDED} {FLUID}",
    f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED} {FLUID} --method cell",
    f"solve balls.csv --box 1,1,1 --periodic xyz --bond-gap 0.1 {BONDED} {GAS} --conductivity 2",
    "homogenize loose.csv --box 1,1 --periodic xy --matrix 1 --inclusion 10 --resolution 40 --json",
    "homogenize thin.csv --box 1,1,1 --periodic xyz --matrix 1 --inclusion 10 --resolution 24 --json",
    "homogenize thin.csv --box 1,1,1 --periodic xyz --matrix 1 --inclusion 10 --resolution 24 --method binary --json",
    "homogenize thin.csv --box 1,1,1 --boundary walls --matrix 1 --inclusion 10 --resolution 24 --json",
    "homogenize loose.csv --box 1,1 --boundary walls --matrix 1 --inclusion 10 --resolution 40 --json",
    "homogenize loose.csv --box 1,1 --periodic xy --matrix 1 --inclusion 10 --resolution 40 --solver eyre-milton",
    "homogenize thin.csv --box 1,1,1 --matrix 1 --inclusion 10 --engine lattice --particles 500 --json",
    "sweep disks.toml -o disks.nc",
    "sweep front.toml -o front.nc",
    "sweep spheres.toml -o spheres.nc",
    "transient elements.toml -o elements.nc",
    "transient pipes.toml -o pipes.nc",
)


def run(words: str, folder: Path, cache: Path) -> list[Any]:
    """What a command compiles in a process of its own, innermost kernels first: names and types of arguments."""
    record = folder / "record.json"
    record.unlink(missing_ok=True)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), RECORD: str(record), "PYTHONPATH": str(ROOT)}
    line = [sys.executable, __file__, *words.split()]
    done = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"etc-engine {words}: {done.stderr}")
    return list(json.loads(record.read_text()))


def prepare(folder: Path) -> None:
    """Write the studies of `JOBS`."""
    for name, text in FILES.items():
        (folder / name).write_text(text)


def child() -> None:
    """Run the command line of this process, and write down what it compiles."""
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
    atexit.register(lambda: Path(os.environ[RECORD]).write_text(json.dumps(rows)))
    from etc_engine.cli import main

    main()


def main() -> None:
    """Write the list."""
    from etc_engine.kernels import LIST

    seen: dict[str, None] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for words in JOBS:
            rows = run(words, folder, folder / "cache")
            print(f"{len(rows):4d}  {words}", flush=True)
            seen |= dict.fromkeys(map(json.dumps, rows))
    LIST.write_text("".join(f"{row}\n" for row in seen))


if __name__ == "__main__":
    child() if os.environ.get(RECORD) else main()
