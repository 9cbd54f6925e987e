"""The model of Zehner, Bauer and Schluender at the best estimates of the measured sets: ``python zbs.py``"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from analyse import conditions
from sets import read

from etc_engine.materials import gas_state, jump_length
from etc_engine.models.heated_beds import zehner_bauer_schluender

DENSITY = 0.61

for measured in read(Path(__file__).parent / "measured.csv"):
    off = []
    for point in measured.points:
        c = conditions(measured, point, {name: best for name, (_, best, _) in measured.assumed.items()})
        if c.gas is None:
            continue
        gas = gas_state(c.gas, c.temperature, c.pressure)
        k = zehner_bauer_schluender(
            gas.conductivity,
            c.solid,
            DENSITY,
            diameter=c.diameter,
            temperature=c.temperature,
            emissivity=c.emissivity,
            jump_length=jump_length(gas, c.accommodation),
        )
        off.append(100.0 * (float(k) / point.measured - 1.0))
    if off:
        print(
            f"{measured.key:18s}{len(off):4d} points, misfit median {np.median(off):+.0f} %, "
            f"{min(off):+.0f} to {max(off):+.0f} %"
        )
