"""A sweep whose gas is no continuum between the particles ends with a warning, as `solve` does."""

from __future__ import annotations

import pytest

pytest.importorskip("CoolProp")

STUDY = """
schema = 2
name = "rarefied"
seed = 5
[packing]
method = "random-sequential"
radii = "equal:0.0005"
count = 12
box = [0.004, 0.004, 0.004]
[particles]
conductivity = 2.0
[contacts]
rule = "bonded"
contact_angle = 2.0
[pores]
gas = "helium"
pressure = {pressure}
accommodation = 0.4
[conduction]
temperature = {temperature}
[statistics]
realizations = 1
"""


@pytest.mark.parametrize(
    ("pressure", "temperature", "words"),
    [
        ([1.0, 1e5], [600.0, 900.0], "in 2 of 4 conditions, at most"),
        (1.0, 900.0, "in 1 of 1 conditions, at most"),
        ([1e4, 1e5], 900.0, None),
    ],
)
def test_a_rarefied_gas_is_named_once(etc_engine, tmp_path, pressure, temperature, words):
    study = tmp_path / "study.toml"
    study.write_text(STUDY.format(pressure=pressure, temperature=temperature))
    done = etc_engine("sweep", study, "-o", tmp_path / "out.nc")
    assert done.returncode == 0
    if words is None:
        assert "continuum" not in done.stderr
        return
    assert done.stderr.count("the gas is no continuum there") == 1
    assert words in done.stderr
    assert "at 900 K and 1 Pa" in done.stderr
