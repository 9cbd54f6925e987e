"""The cell element of spheres on media: through the engine table, its options, what it refuses and what it warns of."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.cell_3d.medium import frame_of
from etc_engine.engines.dtem.families import remarks_on
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.realization import effective_conductivity, field_along, find_engine


@pytest.fixture(scope="module")
def cubic():
    return ParticlePacking([[1.0, 1.0, 1.0]], [1.0], Box((2.1, 2.1, 2.1), (True, True, True)))


def test_facets_stay_the_default_of_spheres():
    engine = find_engine("dtem")
    assert engine.default_method(3, True) == "facets"
    assert engine.default_method(2, True) == "cell"


def test_simple_cubic_through_the_table(cubic):
    """Multipole sums give 2.7070 at contrast 10 and a gap of .1 R; facet links are 7.6 % low there."""
    medium = Medium(cubic, 10.0, overlap_contacts(cubic), Pores(1.0))
    plain = effective_conductivity(medium, method="cell", error_estimate=True)
    better = effective_conductivity(medium, method="cell", frame="3/1")
    assert plain.mean == pytest.approx(2.7070, rel=6e-3)
    assert better.mean == pytest.approx(2.7070, rel=3e-3)
    assert 0.001 < plain.model_error < 0.008
    assert plain.spans == (True, True, True)
    assert np.isnan(better.model_error)
    assert remarks_on("cell", plain) == ()


def test_bonded_spheres_with_resistance_between_walls():
    """A chain between walls: more resistance less heat, and so with tiny contacts; all above the fluid."""
    chain = ParticlePacking([[0.5, 0.5, 0.5], [0.5, 0.5, 1.5]], [0.5, 0.5], Box((1.0, 1.0, 2.0)))
    network = bonded_contacts(chain, np.radians(10.0))
    loose = bonded_contacts(chain, np.radians(0.05))
    values = [
        effective_conductivity(Medium(chain, 50.0, links, Pores(1.0)), method="cell", axes=(2,)).tensor[2, 2]
        for links in (network, network.with_area_resistance(0.01), loose)
    ]
    assert values[0] > values[1] > 1.0
    assert values[0] > values[2] > 1.0


def test_media_of_one_packing_together(cubic):
    network = overlap_contacts(cubic)
    media = [Medium(cubic, k, network, Pores(f)) for k, f in ((10.0, 1.0), (10.0, 0.1), (3.0, 1.0))]
    together = find_engine("dtem").results(media, Conduction("dtem", "cell"), 1)
    for medium, result in zip(media, together, strict=True):
        assert result.tensor.tobytes() == effective_conductivity(medium, method="cell").tensor.tobytes()


def test_spheres_that_insulate_are_warned_about(cubic):
    """Frame 3/3 by default: multipole sums give .50226 at contrast .1; .43 % high, where 1/1 is 1.6 % high."""
    medium = Medium(cubic, 0.1, overlap_contacts(cubic), Pores(1.0))
    result = effective_conductivity(medium, method="cell", axes=(0,))
    assert result.tensor[0, 0] == pytest.approx(0.5022558, rel=6e-3)
    (remark,) = remarks_on("cell", result)
    assert "conduct worse than the fluid" in remark


def test_what_is_refused(cubic):
    network = overlap_contacts(cubic)
    medium = Medium(cubic, 10.0, network, Pores(1.0))
    with pytest.raises(InputError, match="pores that conduct"):
        effective_conductivity(Medium(cubic, 10.0, network), method="cell")
    with pytest.raises(InputError, match="option degree has no effect"):
        effective_conductivity(medium, method="cell", degree=4)
    with pytest.raises(InputError, match="positive and finite"):
        effective_conductivity(Medium(cubic, 0.0, network, Pores(1.0)), method="cell")
    with pytest.raises(InputError, match="two degrees"):
        frame_of("3")
    result = effective_conductivity(medium, method="cell", axes=(0,))
    with pytest.raises(InputError, match="use method facets"):
        field_along(medium, result, engine="dtem", method="cell")
