from __future__ import annotations

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, TimeTable


def test_values_are_numbers_tables_or_functions():
    assert FixedTemperature(300).temperature(5.0) == 300.0
    ramp = FixedTemperature(([0.0, 2.0], [1.0, 3.0]))
    assert ramp == FixedTemperature(TimeTable((0.0, 2.0), (1.0, 3.0)))
    assert [ramp.temperature(t) for t in (-1.0, 0.5, 9.0)] == [1.0, 1.5, 3.0]
    assert HeatFlux(np.sin).flux(1.0) == np.sin(1.0)
    assert Convective(10.0, lambda t: 2.0 * t).temperature(4.0) == 8.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FixedTemperature(np.nan), "wall temperature must be a finite number"),
        (lambda: HeatFlux("much"), "wall heat flux must be"),
        (lambda: FixedTemperature(([0.0, 0.0], [1.0, 2.0])), "increasing times"),
        (lambda: FixedTemperature(([0.0, 1.0], [1.0])), "2 times and 1 values"),
        (lambda: Convective(0.0, 300.0), "coefficient of a convective wall must be positive"),
        (lambda: Convective(1.0, np.inf), "ambient temperature must be"),
    ],
)
def test_conditions_that_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
