"""A quantity that a study gives keeps its name in the result; what is measured under that name gets another one."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.table import measured

STUDY = """
schema = 2
name = "closest pairs"
seed = 3
[packing]
radii = "uniform:0.05:0.08"
box = [1.0, 1.0]
density = 0.6
[contacts]
rule = "coordination"
contact_angle = 5.0
coordination = {given}
[statistics]
realizations = 2
"""


@pytest.mark.parametrize("given", [[3.0, 4.0], [3.5]])
def test_a_given_coordination_number_stays_the_coordinate(etc_engine, tmp_path, given):
    study, output = tmp_path / "study.toml", tmp_path / "out.nc"
    study.write_text(STUDY.format(given=given if len(given) > 1 else given[0]))
    assert etc_engine("sweep", study, "-o", output).returncode == 0
    with open_dataset(output) as dataset:
        assert np.atleast_1d(dataset["coordination"]).tolist() == given
        found = measured(dataset, "coordination")
        assert found.name == "measured_coordination"
        # whole pairs alone: as close to the number asked for as half a pair on each of the particles allows
        aside = abs(found - dataset["coordination"]) * dataset["particles"] / 2.0
        assert (aside <= 1.0).all()
    assert etc_engine("report", output, "-o", tmp_path / "report.html").returncode == 0
    assert etc_engine("compare", output).returncode == 0
