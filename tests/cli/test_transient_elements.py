"""etc-engine transient with kind = "network" and the discrete thermal elements."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

STUDY = """
schema = 2
kind = "network"
name = "elements"
seed = 7
[packing]
radii = "uniform:0.06:0.1"
box = [1.0, 1.0]
[contacts]
rule = "bonded"
contact_angle = {angle}
bond_gap = 1e-3
[conduction]
method = "{method}"
dipoles = {dipoles}
[particles]
heat_capacity = 2.0
initial = 0.0
[walls]
left = {{ type = "fixed", value = 1.0 }}
bottom = {{ type = "flux", value = 0.05 }}
right = {{ type = "convective", coefficient = 1.5, value = 0.0 }}
[time]
scheme = "{scheme}"
{control}
times = [0.0, 0.1, 0.2, 2.0]
"""


def write(folder, method, dipoles, angle=10.0, scheme="bdf2"):
    control = "tolerance = 1e-4" if scheme == "adaptive" else "steps = 20"
    path = folder / f"{method}_{dipoles}.toml"
    path.write_text(
        STUDY.format(method=method, dipoles=str(dipoles).lower(), angle=angle, scheme=scheme, control=control)
    )
    return path


@pytest.mark.parametrize("dipoles", [False, True])
@pytest.mark.parametrize("method", ["chord", "standard", "enhanced", "arc"])
def test_every_method_balances_its_heat(etc_engine, tmp_path, method, dipoles):
    done = etc_engine("transient", write(tmp_path, method, dipoles), "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(tmp_path / "out.nc") as data:
        rise = (data.temperature - data.temperature.isel(time=0)) @ data.heat_capacity
        gained = data.wall_heat.sum("wall") + data.source_heat
        np.testing.assert_allclose(rise, gained, rtol=1e-9, atol=1e-10)
        assert rise[-1] > 0.1


def test_resumed_run_gives_the_same_bits(tmp_path):
    """Three states a particle, of which two are not its temperature: a restart needs them all."""
    import tomllib

    from etc_engine.study.transient import parse_study
    from etc_engine.transient.run import run_transient

    text = write(tmp_path, "chord", True).read_text()
    study = parse_study(tomllib.loads(text))
    whole = run_transient(study, tmp_path, tmp_path / "a.nc")
    for state in sorted((tmp_path).glob("a.nc*/*"))[2:]:
        state.unlink()
    resumed = run_transient(study, tmp_path, tmp_path / "a.nc", resume=True)
    assert resumed.resumed > 0
    np.testing.assert_array_equal(whole.states[-1].temperatures, resumed.states[-1].temperatures)


def test_angles_too_wide_are_one_line(etc_engine, tmp_path):
    done = etc_engine("transient", write(tmp_path, "chord", True, angle=29.0), "-o", tmp_path / "out.nc")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out.nc").exists()
