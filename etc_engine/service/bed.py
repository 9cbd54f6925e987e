"""The packing of a finished study as a picture, drawn by a process of its own.

``python -m etc_engine.service.bed result.nc bed.png`` draws the first realization, made again from its random stream.
A result that does not allow it is one line on stderr and exit status 2.
"""

from __future__ import annotations

import sys
from pathlib import Path

from etc_engine.durable.files import replacing
from etc_engine.errors import EtcError
from etc_engine.service.held import ENGINE, REFUSED


def main(result: Path, picture: Path) -> int:
    """Draw the packing; returns the exit status."""
    try:
        from etc_engine.output import figures
        from etc_engine.sweep.packing import first_packing
        from etc_engine.sweep.result_file import open_dataset

        drawn = figures.png(figures.draw_bed(first_packing(open_dataset(result))[0]))
        with replacing(picture) as file:
            file.write_bytes(drawn)
    except EtcError as error:
        sys.stderr.write(f"{ENGINE}{error}\n")
        return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
