"""A sweep with a cheap engine in place of the real one: ``python stand_in.py STUDY -o OUT [options]``.

The engine draws everything from the random stream it is given, so that its bits tell whether a unit got
its own. Run with ``--help`` for what it can be made to do.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from etc_engine.cli.sweep import launch
from etc_engine.cli.threads import hold_one_thread
from etc_engine.errors import EtcError
from etc_engine.realization import Outcome, Realization, RealizationSpec, Status
from etc_engine.sweep.parts import Part


def realize(
    spec: RealizationSpec,
    rng: np.random.Generator,
    *,
    seconds: float = 0.0,
    burn: bool = False,
    log: Path | None = None,
    trouble: bool = False,
) -> Realization:
    """Conductivity = density * (1 + angle) * (1 + noise), one number of the stream per cell."""
    density = spec.packing.density or 0.8
    started = time.perf_counter()
    draw = float(rng.random())
    wait(seconds * (0.5 + draw) * density, burn)
    if trouble and 0.5 < draw < 0.6:
        raise ZeroDivisionError(f"a draw of {draw}")
    cells = tuple(
        _cell(density, values.get("contact_angle", 0.1), m, rng, trouble)
        for values in spec.combinations()
        for m in range(spec.shape[-1])
    )
    if log is not None:
        with log.open("a") as stream:  # one short write in append mode: whole lines, also from many ranks
            stream.write(f"{density} {draw}\n")
    elapsed = time.perf_counter() - started
    return Realization(int(1000 * density), density, density * 0.99, elapsed, cells)


def _cell(density: float, angle: float, method: int, rng: np.random.Generator, trouble: bool) -> Outcome:
    noise, fate = rng.normal(), rng.random()
    if trouble and fate < 0.1:
        return Outcome(Status.NOT_CONVERGED, "stopped after 100 iterations")
    value = 0.0 if trouble and fate < 0.2 else density * (1.0 + angle + method) * (1.0 + 0.05 * noise)
    status = Status.OK if value else Status.NOT_PERCOLATING
    conductivity = np.array([[value, np.nan], [np.nan, 1.01 * value]])
    return Outcome(status, "", conductivity, 17, 4, 3.5, 20, 6, 1e-11, 0.001)


def wait(seconds: float, burn: bool) -> None:
    """Pass the time asleep or at work."""
    until = time.perf_counter() + seconds
    if not burn:
        time.sleep(seconds)
    while time.perf_counter() < until:
        pass


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line of the stand-in."""
    parser = argparse.ArgumentParser()
    parser.add_argument("study", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--policy", default="fresh", choices=("fresh", "resume", "overwrite"))
    parser.add_argument("--seconds", type=float, default=0.0, help="mean length of a unit")
    parser.add_argument("--burn", action="store_true", help="pass the time at work, not asleep")
    parser.add_argument("--log", type=Path, help="write a line for every unit computed")
    parser.add_argument("--trouble", action="store_true", help="some units and cells fail")
    parser.add_argument("--part", type=lambda text: Part(*map(int, text.split("/"))), help="K/N: this part only")
    parser.add_argument("--file-limit", type=int, help="no file may grow beyond so many bytes, as on a full disk")
    options = parser.parse_args(arguments)
    hold_one_thread()
    if options.file_limit:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (options.file_limit, options.file_limit))
    engine = partial(realize, seconds=options.seconds, burn=options.burn, log=options.log, trouble=options.trouble)
    try:
        return launch(options.study, options.output, options.policy, engine, part=options.part)
    except EtcError as error:
        print(f"etc-engine: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
