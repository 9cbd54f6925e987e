"""The command ``etc-engine`` whose units take a while: ``python slow_engine.py sweep STUDY -o OUT --resume``.

ETC_TEST_SECONDS is the mean length of a unit, ETC_TEST_LOG a file that gets a line for every unit computed.
"""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from stand_in import realize

from etc_engine.cli import run
from etc_engine.cli.sweep import launch
from etc_engine.cli.threads import hold_one_thread
from etc_engine.errors import EtcError
from etc_engine.sweep.parts import Part


def main() -> int:
    if sys.argv[1] != "sweep":
        return run(sys.argv[1:])
    hold_one_thread()
    log = os.environ.get("ETC_TEST_LOG")
    seconds = float(os.environ.get("ETC_TEST_SECONDS", "0"))
    engine = partial(realize, seconds=seconds, log=Path(log) if log else None)
    try:
        part = Part(*map(int, sys.argv[-1].split("/"))) if sys.argv[-2] == "--part" else None
        return launch(Path(sys.argv[2]), Path(sys.argv[4]), "resume", engine, part=part)
    except EtcError as error:
        print(f"etc-engine: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
