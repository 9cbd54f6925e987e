"""Transient elements against the fine finite elements of studies/feng2009, whose results are kept there."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

STUDY = Path(__file__).parents[2] / "studies" / "feng2009"


@pytest.fixture(scope="module")
def study():
    """The study's modules; its folder leaves the path again."""
    sys.path.insert(0, str(STUDY))
    try:
        import cases
        import transient

        return cases, transient
    finally:
        sys.path.remove(str(STUDY))
        for name in ("cases", "transient"):
            sys.modules.pop(name, None)


# Largest error of a mean temperature [K] of the whole march and beyond a Fourier number of 1 and 10; the wall steps by
# 1 K. The reference itself is good to 1e-4 K: elements of twice the size change it by 6e-5 K.
BOUNDS = {
    "chord with dipoles": (0.017, 0.004, 5e-4),
    "chord": (0.025, 0.018, 4e-3),
    "standard": (0.035, 0.029, 0.028),
    "pipe, chord": (0.085, 0.085, 0.028),
}


@pytest.mark.parametrize("model", BOUNDS)
@pytest.mark.parametrize("case", [0, 1])
def test_mean_temperatures_against_finite_elements(study, case, model):
    cases, transient = study
    fourier, error, _ = transient.errors(cases.CASES[case], model)
    whole, late, latest = BOUNDS[model]
    assert error.max() < whole
    assert error[fourier >= 1.0].max() < late
    assert error[fourier >= 10.0].max() < latest
    # the bounds say something: before the first Fourier number every model is wrong by a per cent of the step
    assert error[fourier < 0.3].max() > 0.009


def test_dipoles_and_elements_earn_their_keep(study):
    """Wherever the finite elements can tell, beyond a Fourier number of 0.3: dipoles beat none, elements beat pipes."""
    cases, transient = study
    for case in cases.CASES:
        errors = {model: transient.errors(case, model) for model in BOUNDS}
        fourier = errors["chord"][0]
        window = (fourier > 0.3) & (fourier < 5.0)
        mean = {model: float(np.exp(np.log(error[window]).mean())) for model, (_, error, _) in errors.items()}
        assert mean["chord with dipoles"] < 0.4 * mean["chord"] < 0.2 * mean["pipe, chord"]


def test_heat_into_the_wall_against_finite_elements(study):
    """Within 1 % from a Fourier number of 2 on, with dipoles."""
    cases, transient = study
    for case in cases.CASES:
        fourier, _, flow = transient.errors(case, "chord with dipoles")
        assert np.nanmax(flow[fourier >= 2.0]) < 0.01
        assert np.nanmax(flow[fourier <= 0.011]) > 0.25  # the wall's flux is singular at the start


def test_the_reference_is_conservative_and_steady_at_the_end(study):
    """Heat that came in is the heat stored, and the last flow is the converged conductivity of the assembly."""
    cases, transient = study
    fourier, flows, means = transient.reference(cases.CASES[1])
    # what is left of the slowest mode enters on one side what it lacks on the other
    assert 0.5 * (flows[-1, 0] - flows[-1, 1]) == pytest.approx(0.2787774, abs=2e-4)
    _, steady = transient.run(cases.CASES[1], "chord with dipoles", fourier)
    np.testing.assert_allclose(means[-1], steady[-1], atol=1e-4)
    fourier, flows, means = transient.reference(cases.CASES[0])
    pass

    areas = cases.CASES[0].network().cut_measures(prescribed=True)
    stored = means @ areas
    times = fourier * cases.CASES[0].radius ** 2
    # the flow falls smoothly: its integral between outputs, as a power law of the time
    power = np.log(flows[1:, 0] / flows[:-1, 0]) / np.log(times[1:] / times[:-1])
    came = (flows[1:, 0] * times[1:] - flows[:-1, 0] * times[:-1]) / (power + 1.0)
    early = fourier[1:] < 5.0
    np.testing.assert_allclose(np.diff(stored)[early], came[early], rtol=3e-3)
