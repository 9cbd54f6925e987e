"""``python -m etc_engine``: the command line without the console script."""

from __future__ import annotations

from etc_engine.cli import main

if __name__ == "__main__":
    main()
