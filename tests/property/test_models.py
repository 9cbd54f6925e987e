"""Limits, ordering, symmetry, duality and scaling of the conductivity models, for any input."""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.models import CATALOGUE, evaluate

INF = math.inf
HOT = {"diameter": 1e-3, "temperature": 900.0, "emissivity": 0.8}
BOX = {
    "hasselman_johnson": {"radius": 0.5, "interface_conductance": INF},
    "yagi_kunii": {"film_thickness": 0.05},
    "contact_mean_field": {"coordination": 4.0, "conductance_distance2": 1.5, "radius_moment": 1.0},
    "kirkpatrick": {"coordination": 5.0},
    "percolation_power_law": {"threshold": 0.4},
    "zehner_bauer_schluender": HOT | {"jump_length": 1e-5},
    "breitbach_barthels": HOT,
    "kunii_smith_radiation": HOT,
}
CASES = [(name, d) for name, model in CATALOGUE.items() for d in model.dimensions]
ARRAYS = ("square_array", "hexagonal_array", "simple_cubic", "bcc", "fcc")
# Two-phase geometries, with every fraction from 0 to 1 and every conductivity.
MEDIA = (
    "series",
    "parallel",
    "hashin_shtrikman_lower",
    "hashin_shtrikman_upper",
    "three_point_lower",
    "three_point_upper",
    "maxwell",
    "maxwell_inverse",
    "effective_medium",
    "differential",
    "differential_inverse",
    "hasselman_johnson",
    "third_order",
    "kirkpatrick",
)
EQUAL_PHASES = (
    *MEDIA,
    *ARRAYS,
    "russell",
    "zehner_schluender",
    "zbs_contact",
    "kunii_smith",
    "krupiczka",
    "woodside_messmer",
    "hadley",
    "agari_uno",
    "lewis_nielsen",
    "hsu_cubes",
    "hsu_square_cylinders",
    "hamilton_crosser",
)
PURE_SOLID = (
    *MEDIA,
    "russell",
    "zehner_schluender",
    "zbs_contact",
    "hadley",
    "agari_uno",
    "percolation_power_law",
    "hsu_cubes",
    "hsu_square_cylinders",
    "hamilton_crosser",
)
PURE_FLUID = (
    *MEDIA,
    *ARRAYS,
    "russell",
    "zehner_schluender",
    "zbs_contact",
    "kunii_smith",
    "lewis_nielsen",
    "hsu_cubes",
    "hsu_square_cylinders",
    "hamilton_crosser",
)

conductivities = st.floats(1e-3, 1e3)
fractions = st.floats(0.0, 1.0)
dimensions = st.sampled_from([2, 3])
quick = settings(deadline=None, max_examples=40)


def conductivity(name, k1, k2, fraction, dimension, **parameters):
    given_parameters = {**BOX.get(name, {}), **parameters}
    return evaluate(name, k1=k1, k2=k2, fraction=fraction, dimension=dimension, **given_parameters)


def pairs(names):
    return [(name, d) for name in names for d in CATALOGUE[name].dimensions]


@pytest.mark.parametrize(("name", "dimension"), pairs(PURE_FLUID))
@given(k1=conductivities, k2=conductivities)
@quick
def test_without_phase_2_it_is_phase_1(name, dimension, k1, k2):
    assert conductivity(name, k1, k2, 0.0, dimension) == pytest.approx(k1, rel=1e-12)


@pytest.mark.parametrize(("name", "dimension"), pairs(PURE_SOLID))
@given(k1=conductivities, k2=conductivities)
@quick
def test_without_phase_1_it_is_phase_2(name, dimension, k1, k2):
    assert conductivity(name, k1, k2, 1.0, dimension) == pytest.approx(k2, rel=1e-12)


@pytest.mark.parametrize(("name", "dimension"), pairs(MEDIA))
@given(k1=conductivities, k2=conductivities, small=st.floats(1e-9, 1e-6))
@quick
def test_pure_phases_are_reached_continuously(name, dimension, k1, k2, small):
    """The exact values at f = 0 and 1 patch nothing over: their neighbours approach them."""
    contrast = max(k1 / k2, k2 / k1)
    for fraction, pure in ((small, k1), (1.0 - small, k2)):
        k = conductivity(name, k1, k2, fraction, dimension)
        # Where one phase is dilute, no model of the list changes faster than the contrast.
        assert k == pytest.approx(pure, rel=20.0 * contrast * small)


@pytest.mark.parametrize(("name", "dimension"), pairs(EQUAL_PHASES))
@given(k=conductivities, fraction=st.floats(0.43, 0.52))
@quick
def test_equal_phases(name, dimension, k, fraction):
    assert conductivity(name, k, k, fraction, dimension) == pytest.approx(k, rel=1e-12)


@pytest.mark.parametrize(("name", "dimension"), pairs((*MEDIA, *ARRAYS, "russell", "agari_uno")))
@given(fraction=st.floats(0.43, 0.52), offset=st.sampled_from([-1e-4, -1e-7, 1e-7, 1e-4]))
@quick
def test_nearly_equal_phases_mix_linearly(name, dimension, fraction, offset):
    """To first order in the contrast every isotropic two-phase geometry gives the mean: dk/dk2 = f."""
    k = conductivity(name, 1.0, 1.0 + offset, fraction, dimension)
    assert k - 1.0 == pytest.approx(fraction * offset, rel=3.0 * abs(offset) + 1e-7)


@given(k1=conductivities, k2=conductivities, fraction=fractions, dimension=dimensions, zeta2=fractions)
@settings(deadline=None, max_examples=300)
def test_bounds_nest(k1, k2, fraction, dimension, zeta2):
    order = [
        conductivity("series", k1, k2, fraction, dimension),
        conductivity("hashin_shtrikman_lower", k1, k2, fraction, dimension),
        conductivity("three_point_lower", k1, k2, fraction, dimension, zeta2=zeta2),
        conductivity("three_point_upper", k1, k2, fraction, dimension, zeta2=zeta2),
        conductivity("hashin_shtrikman_upper", k1, k2, fraction, dimension),
        conductivity("parallel", k1, k2, fraction, dimension),
    ]
    for lower, upper in itertools.pairwise(order):
        assert lower <= upper * (1.0 + 1e-12)


REALIZABLE = ("maxwell", "maxwell_inverse", "effective_medium", "differential", "differential_inverse")


@pytest.mark.parametrize("name", REALIZABLE)
@given(k1=conductivities, k2=conductivities, fraction=fractions, dimension=dimensions)
@quick
def test_realizable_estimates_keep_the_hashin_shtrikman_bounds(name, k1, k2, fraction, dimension):
    k = conductivity(name, k1, k2, fraction, dimension)
    assert k >= conductivity("hashin_shtrikman_lower", k1, k2, fraction, dimension) * (1.0 - 1e-12)
    assert k <= conductivity("hashin_shtrikman_upper", k1, k2, fraction, dimension) * (1.0 + 1e-12)


@pytest.mark.parametrize("name", ARRAYS)
@given(k1=conductivities, k2=conductivities, share=st.floats(0.0, 0.9))
@quick
def test_arrays_keep_the_hashin_shtrikman_bounds(name, k1, k2, share):
    (dimension,) = CATALOGUE[name].dimensions
    fraction = share * CATALOGUE[name].inputs[2].interval.high
    k = conductivity(name, k1, k2, fraction, dimension)
    assert k >= conductivity("hashin_shtrikman_lower", k1, k2, fraction, dimension) * (1.0 - 1e-12)
    assert k <= conductivity("hashin_shtrikman_upper", k1, k2, fraction, dimension) * (1.0 + 1e-12)


@pytest.mark.parametrize("name", ["square_array", "hexagonal_array", "maxwell", "differential"])
@given(k1=conductivities, k2=conductivities, fraction=st.floats(0.0, 0.75))
@quick
def test_duality_in_the_plane(name, k1, k2, fraction):
    """Keller's theorem: the conductivity with the values exchanged in place is k1 k2 / k."""
    product = conductivity(name, k1, k2, fraction, 2) * conductivity(name, k2, k1, fraction, 2)
    assert product == pytest.approx(k1 * k2, rel=1e-8)


@given(k1=conductivities, k2=conductivities)
@quick
def test_symmetric_media_are_the_geometric_mean_at_one_half(k1, k2):
    assert conductivity("effective_medium", k1, k2, 0.5, 2) == pytest.approx(math.sqrt(k1 * k2), rel=1e-12)


@pytest.mark.parametrize(
    "name", ["series", "parallel", "effective_medium", "hashin_shtrikman_lower", "hashin_shtrikman_upper"]
)
@given(k1=conductivities, k2=conductivities, fraction=fractions, dimension=dimensions)
@quick
def test_symmetric_under_exchange_of_phases(name, k1, k2, fraction, dimension):
    k = conductivity(name, k1, k2, fraction, dimension)
    assert conductivity(name, k2, k1, 1.0 - fraction, dimension) == pytest.approx(k, rel=1e-9)


@pytest.mark.parametrize(("name", "dimension"), CASES)
@given(scale=st.floats(1e-3, 1e3), fraction=st.floats(0.43, 0.5))
@quick
def test_conductivities_scale(name, dimension, scale, fraction):
    parameters = {"conductance_distance2": 1.5 * scale} if name == "contact_mean_field" else {}
    lengths = ("diameter", "jump_length")  # radiation and rarefied gas are per length: both scale with it
    parameters |= {key: scale * value for key, value in BOX.get(name, {}).items() if key in lengths}
    k = conductivity(name, 0.3, 30.0, fraction, dimension)
    scaled = conductivity(name, 0.3 * scale, 30.0 * scale, fraction, dimension, **parameters)
    assert scaled == pytest.approx(scale * k, rel=1e-9)


@pytest.mark.parametrize(("name", "dimension"), pairs((*MEDIA, *ARRAYS, "russell")))
@given(phases=st.tuples(conductivities, conductivities), fraction=st.floats(0.0, 0.5), more=st.floats(1.0, 10.0))
@quick
def test_a_better_phase_never_worsens_it(name, dimension, phases, fraction, more):
    k1, k2 = phases
    k = conductivity(name, k1, k2, fraction, dimension)
    assert conductivity(name, k1, k2 * more, fraction, dimension) >= k * (1.0 - 1e-10)
    assert conductivity(name, k1 * more, k2, fraction, dimension) >= k * (1.0 - 1e-10)


@pytest.mark.parametrize(("name", "dimension"), pairs((*MEDIA, *ARRAYS)))
@pytest.mark.parametrize("fraction", [0.17, 0.45])
def test_insulating_and_superconducting_limits_are_approached(name, dimension, fraction):
    for limit, near in ((0.0, 1e-12), (INF, 1e12)):
        for pair, close in (((1.0, limit), (1.0, near)), ((limit, 1.0), (near, 1.0))):
            exact = conductivity(name, *pair, fraction, dimension)
            k = conductivity(name, *close, fraction, dimension)
            if math.isinf(exact):
                assert k > 1e10
            else:
                assert k == pytest.approx(exact, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("dimension", [2, 3])
@given(fraction=st.floats(0.05, 0.95))
@quick
def test_insulating_pores(dimension, fraction):
    """k1 = 0 with the density as the solid fraction: what a dry granular medium needs."""
    d, f = dimension, fraction
    expected = {
        "maxwell": 0.0,
        "differential": 0.0,
        "hashin_shtrikman_lower": 0.0,
        "hashin_shtrikman_upper": (d - 1) * f / (d - f),
        "effective_medium": max(0.0, (d * f - 1) / (d - 1)),
        "differential_inverse": f ** (d / (d - 1)),
    }
    for name, value in expected.items():
        k = conductivity(name, 0.0, 1.0, fraction, dimension)
        assert k == pytest.approx(value, rel=1e-12, abs=1e-15), name


@pytest.mark.parametrize(("k1", "k2"), [(0.195, 1.5), (2.0, 1e-3), (1e-3, 50.0)])
@given(fraction=st.floats(0.01, 0.99), dimension=dimensions)
@quick
def test_implicit_equations_hold(k1, k2, fraction, dimension):
    """The closed roots satisfy the equations that define the two Bruggeman models."""
    d, f = dimension, fraction
    k = conductivity("effective_medium", k1, k2, f, d)
    terms = [(1 - f) * (k1 - k) / (k1 + (d - 1) * k), f * (k2 - k) / (k2 + (d - 1) * k)]
    assert sum(terms) == pytest.approx(0.0, abs=1e-9 * max(map(abs, terms)) + 1e-12)
    k = conductivity("differential", k1, k2, f, d)
    assert (k2 - k) / (k2 - k1) * (k1 / k) ** (1 / d) == pytest.approx(1 - f, rel=1e-9)


@pytest.mark.parametrize(("name", "dimension"), CASES)
def test_arrays_in_arrays_out(name, dimension):
    """Numbers, broadcast ndarrays and labelled arrays give the same figures, each in its own kind."""
    k2, fraction = np.array([30.0, 90.0, 400.0]), np.array([0.44, 0.5])
    labelled_k2 = xr.DataArray(k2, dims="contrast", coords={"contrast": k2 / 0.3})
    labelled_fraction = xr.DataArray(fraction, dims="density", coords={"density": fraction})
    plain = conductivity(name, 0.3, k2, fraction[:, None], dimension)
    labelled = conductivity(name, 0.3, labelled_k2, labelled_fraction, dimension)
    assert isinstance(labelled, xr.DataArray)
    used = {item.name for item in CATALOGUE[name].inputs}
    for i, f in enumerate(fraction):
        for j, k in enumerate(k2):
            single = conductivity(name, 0.3, k, f, dimension)
            assert np.ndim(single) == 0
            at = {}
            if "fraction" in used:
                at["density"] = i
            if "k2" in used:
                at["contrast"] = j
            assert float(labelled.isel(at)) == pytest.approx(float(single), rel=1e-12)
            assert np.broadcast_to(plain, (2, 3))[i, j] == pytest.approx(float(single), rel=1e-12)
