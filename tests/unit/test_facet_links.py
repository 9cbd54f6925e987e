"""Facet links: certified lattices and random packings with fluid, walls, contact resistance, invariance, refusals."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.facet_steady import (
    facet_conductivity,
    low_coordination_warning,
    solve_facets,
    uniform_material,
)
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.facets import facet_links
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.models.lattice_sums import BCC, FCC, coupling
from etc_engine.packing.particles import ParticlePacking

DATA = Path(__file__).parent.parent / "published" / "data" / "spheres"
SITES = {
    "simple_cubic": [[0, 0, 0]],
    "bcc": [[0, 0, 0], [0.5, 0.5, 0.5]],
    "fcc": [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
}
NEAREST = {"simple_cubic": 1.0, "bcc": np.sqrt(0.75), "fcc": np.sqrt(0.5)}
REFERENCE = json.loads((DATA / "fluid_cases.json").read_text())


def lattice(name, distance, replicas=(1, 1, 1)):
    """Unit spheres, nearest neighbours at the given distance, periodic."""
    a = distance / NEAREST[name]
    cells = np.stack(np.meshgrid(*map(np.arange, replicas), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centers = (a * (cells + np.array(SITES[name], float) + 0.25)).reshape(-1, 3)
    return ParticlePacking(centers, np.ones(len(centers)), Box(tuple(a * r for r in replicas), (True, True, True)))


def random_packing(name):
    with (DATA / name).open() as file:
        rows = np.array([[float(v) for v in row.values()] for row in csv.DictReader(file)])
    return ParticlePacking(rows[:, :3] % 1.0, rows[:, 3], Box((1.0, 1.0, 1.0), (True, True, True)))


def conductivity(packing, solid, fluid=1.0, **material):
    links = facet_links(overlap_contacts(packing))
    return facet_conductivity(links, uniform_material(links, solid, fluid, **material)).tensor


@pytest.mark.parametrize(
    "case", REFERENCE["lattices"], ids=lambda c: f"{c['lattice']}-{c['contrast']:g}-{c['gap_over_R']}"
)
def test_lattices_against_multipole_sums(case):
    k = conductivity(lattice(case["lattice"], 2.0 + case["gap_over_R"]), case["contrast"])[0, 0]
    low, high = (-0.136, -0.008) if case["lattice"] == "simple_cubic" else (-0.007, 0.01)
    assert low <= k / case["value"] - 1.0 <= high


@pytest.mark.parametrize("case", REFERENCE["disks"], ids=lambda c: f"{c['lattice']}-{c['contrast']:g}")
def test_lattices_with_contact_disk_and_fluid_against_finite_elements(case):
    packing = lattice(case["lattice"], 2.0 * np.cos(np.radians(case["angle_deg"])))
    k = conductivity(packing, case["contrast"])[0, 0] / case["contrast"]
    low = -0.04 if case["lattice"] == "simple_cubic" else -0.002
    assert low <= k / case["value"] - 1.0 <= 0.002


@pytest.mark.parametrize("case", REFERENCE["random"], ids=lambda c: f"{c['packing']}-{c['contrast']:g}")
def test_random_packings_against_voxels(case):
    k = np.trace(conductivity(random_packing(case["packing"]), case["contrast"])) / 3.0
    assert k == pytest.approx(case["value"], rel=0.015)


@pytest.mark.parametrize("case", REFERENCE["unlike"], ids=lambda c: "-".join(f"{k:g}" for k in c["conductivities"]))
def test_unlike_spheres_against_voxels(case):
    """Radii 1 and .75, conductivities up to 1:10, a gap of 1 %."""
    a = 1.75 * 1.01 * 2.0 / np.sqrt(3.0)
    packing = ParticlePacking([[0.25 * a] * 3, [0.75 * a] * 3], [1.0, 0.75], Box((a, a, a), (True, True, True)))
    k = np.trace(conductivity(packing, np.array(case["conductivities"]))) / 3.0
    assert k == pytest.approx(case["value"], rel=0.016)


def test_equal_phases_conduct_as_one():
    assert np.trace(conductivity(random_packing("rp1.csv"), 1.0)) / 3.0 == pytest.approx(1.0, abs=0.025)


def test_vacuum_limit_is_the_contact_disk():
    """Certified finite elements: body-centred cubic, disks of 10 degrees, k = .267094 kappa."""
    links = facet_links(overlap_contacts(lattice("bcc", 2.0 * np.cos(np.radians(10.0)))))
    k = facet_conductivity(links, uniform_material(links, 1.0, 1e-7)).tensor[0, 0]
    assert k == pytest.approx(0.267094, rel=5e-4)


def test_touching_is_the_limit_of_a_closing_gap():
    gaps = [conductivity(lattice("fcc", 2.0 + gap), 50.0)[0, 0] for gap in (1e-4, 1e-6, 1e-8, 0.0)]
    assert np.all(np.diff(gaps) > 0.0)
    assert gaps[-1] / gaps[-2] - 1.0 < 2e-4


def test_conductivity_grows_with_either_phase():
    packing = random_packing("rp5.csv")
    by_solid = [np.trace(conductivity(packing, solid)) for solid in (1.0, 3.0, 30.0, 1e3, 1e4)]
    by_fluid = [np.trace(conductivity(packing, 1e4, fluid)) for fluid in (1.0, 2.0, 10.0, 100.0)]
    assert np.all(np.diff(by_solid) > 0.0)
    assert np.all(np.diff(by_fluid) > 0.0)


def test_tensor_is_symmetric_positive_and_turns_with_the_packing():
    packing = random_packing("rp2.csv")
    k = conductivity(packing, 20.0)
    np.testing.assert_allclose(k, k.T, rtol=1e-12)
    assert np.linalg.eigvalsh(k).min() > 1.0
    turned = ParticlePacking(packing.centers[::-1, [2, 0, 1]], packing.radii[::-1], packing.box)
    np.testing.assert_allclose(conductivity(turned, 20.0), k[np.ix_([2, 0, 1], [2, 0, 1])], rtol=1e-7, atol=1e-7)


def test_units_and_replicas_scale_out():
    k = conductivity(lattice("bcc", 2.01), 30.0)
    np.testing.assert_allclose(conductivity(lattice("bcc", 2.01, (2, 1, 2)), 30.0), k, rtol=1e-8, atol=1e-8)
    packing = lattice("bcc", 2.01)
    small = ParticlePacking(
        packing.centers * 1e-3, packing.radii * 1e-3, Box(tuple(1e-3 * v for v in packing.box.lengths), (True,) * 3)
    )
    np.testing.assert_allclose(conductivity(small, 30.0 * 0.026, 0.026), 0.026 * k, rtol=1e-8, atol=1e-9)


def test_walls_are_mirrors():
    """A packing between walls conducts like itself and its mirror image, periodic."""
    base = random_packing("rp5.csv")
    inside = (base.centers[:, 2] > 0.17) & (base.centers[:, 2] < 0.83)
    centers, radii = base.centers[inside], base.radii[inside]
    walled = ParticlePacking(centers, radii, Box((1.0, 1.0, 1.0), (True, True, False)))
    mirrored = np.concatenate([centers, centers * [1, 1, -1] + [0, 0, 2]])
    periodic = ParticlePacking(mirrored, np.tile(radii, 2), Box((1.0, 1.0, 2.0), (True, True, True)))
    between, around = conductivity(walled, 40.0), conductivity(periodic, 40.0)
    assert between[2, 2] == pytest.approx(around[2, 2], rel=1e-7)
    np.testing.assert_allclose(between[:2, :2], around[:2, :2], rtol=0.02)  # across, insulated walls bend no heat
    assert np.isnan(between[0, 2])


def test_contact_resistance_blocks_the_disk_alone():
    packing = lattice("fcc", 2.0 * np.cos(np.radians(10.0)))
    network = overlap_contacts(packing)
    links = {r: facet_links(network.with_resistance(r)) for r in (0.0, 0.05, 1e9)}
    k = {r: facet_conductivity(v, uniform_material(v, 100.0, 1.0)).tensor[0, 0] for r, v in links.items()}
    assert k[0.0] > k[0.05] > k[1e9]
    vacuum = [facet_conductivity(v, uniform_material(v, 100.0, 1e-6)).tensor[0, 0] for v in links.values()]
    # in vacuum every contact has 2 h + R_c in series: 1/k grows in proportion
    h = 1.0 / vacuum[0]
    assert 1.0 / vacuum[1] - h == pytest.approx(
        0.05 * packing.box.volume / (packing.count * 2.0 * 4.0 * np.cos(np.radians(10.0)) ** 2), rel=1e-3
    )


def test_bonds_are_disks_in_touching_spheres():
    packing = lattice("bcc", 2.0)
    open_bed = conductivity(packing, 1e3)[0, 0]
    links = facet_links(bonded_contacts(packing, np.radians(3.0)))
    bonded = facet_conductivity(links, uniform_material(links, 1e3, 1.0)).tensor[0, 0]
    assert links.solid_contacts == 8
    assert bonded > open_bed
    tiny = facet_links(bonded_contacts(packing, 1e-6))
    assert facet_conductivity(tiny, uniform_material(tiny, 1e3, 1.0)).tensor[0, 0] == pytest.approx(open_bed, rel=0.02)


def test_wall_heat_and_sphere_temperatures():
    packing = ParticlePacking([[0.5, 0.5, 0.5]], [0.45], Box((1.0, 1.0, 1.0), (True, True, False)))
    links = facet_links(overlap_contacts(packing))
    solution = solve_facets(links, uniform_material(links, 10.0, 1.0), (2,))
    assert solution.sphere_temperatures.ravel().tolist() == pytest.approx([0.5])
    cube = ParticlePacking(packing.centers, packing.radii, Box((1.0, 1.0, 1.0), (True, True, True)))
    assert float(solution.energies[0, 0]) == pytest.approx(conductivity(cube, 10.0)[2, 2], rel=1e-9)


def test_radiation_and_rarefied_gas_reach_every_link():
    packing = random_packing("rp1.csv")
    k = np.trace(conductivity(packing, 100.0))
    assert (
        np.trace(conductivity(packing, 100.0, jumps=0.01)) < k < np.trace(conductivity(packing, 100.0, radiation=5.0))
    )
    assert np.trace(conductivity(packing, 100.0, 0.0, radiation=5.0)) > 0.0


def multipole_sum(name, contrast, jump, gap, highest=61):
    """k/k_f of an array with a temperature jump T_s - T_f = jump dT/dn at the surfaces (radius 1).

    Inside, multipole l has T = A r^l; with the jump the fluid at the surface sees the conductivity
    kappa/(1 + l jump kappa/k_f), for every l its own. All else is the multipole expansion of the array.
    """
    coefficients, l = coupling({"bcc": BCC, "fcc": FCC}[name], highest)
    seen = contrast / (1.0 + contrast * l * jump)
    beta = l * (seen - 1.0) / (l * seen + l + 1.0)
    gain, size = (2.0 / (2.0 + gap)) ** (l + 0.5), 2.0 / (2.0 + gap)
    matrix = np.eye(l.size) - (beta * gain)[:, None] * coefficients * gain
    dipole = np.linalg.solve(matrix, np.where(np.arange(l.size) == 0, beta, 0.0))[0]
    x = dipole * {"bcc": BCC, "fcc": FCC}[name].touching_fraction * size**3
    return (1.0 + 2.0 * x) / (1.0 - x)


@pytest.mark.parametrize("name", ["bcc", "fcc"])
@pytest.mark.parametrize(("jump", "tolerance"), [(1e-3, 0.011), (0.01, 0.018), (0.1, 0.046), (0.3, 0.035)])
def test_rarefied_gas_against_multipole_sums_with_jumps(name, jump, tolerance):
    for contrast in (10.0, 1e3):
        for gap in (0.1, 0.02):
            k = conductivity(lattice(name, 2.0 + gap), contrast, jumps=2.0 * jump)[0, 0]
            assert k == pytest.approx(multipole_sum(name, contrast, jump, gap), rel=tolerance)


def test_low_coordination_is_reported():
    for name, contrast, expected in (
        ("simple_cubic", 100.0, True),
        ("simple_cubic", 2.0, False),
        ("fcc", 100.0, False),
    ):
        links = facet_links(overlap_contacts(lattice(name, 2.01)))
        text = low_coordination_warning(links, uniform_material(links, contrast, 1.0))
        assert ("fewer than" in text) is expected


def test_hidden_spheres_and_bad_material_are_refused():
    box = Box((1.0, 1.0, 1.0), (True, True, True))
    hidden = ParticlePacking([[0.5, 0.5, 0.5], [0.6, 0.5, 0.5]], [0.4, 0.05], box)
    with pytest.raises(GeometryError, match="particles 0 and 1"):
        facet_links(bonded_contacts(hidden, 0.1))
    links = facet_links(overlap_contacts(lattice("bcc", 2.01)))
    for arguments, words in (
        ((0.5, 1.0), "at least as well as the pores"),
        ((10.0, -1.0), ">= 0"),
        ((10.0, np.ones(3)), "shape"),
    ):
        with pytest.raises(InputError, match=words):
            uniform_material(links, *arguments)
    with pytest.raises(InputError, match="pores that conduct"):
        facet_conductivity(links, uniform_material(links, 10.0, 0.0))
    with pytest.raises(InputError, match="contact resistance"):
        facet_links(overlap_contacts(lattice("bcc", 2.01)).with_resistance(-1.0))


def test_rarefied_gas_goes_to_vacuum_and_to_the_continuum():
    """p -> inf: jumps vanish. p -> 0: gas carries nothing, what is left is radiation alone, also in the columns."""
    packing = random_packing("rp5.csv")
    links = facet_links(overlap_contacts(packing))
    continuum = facet_conductivity(links, uniform_material(links, 100.0, 1.0)).tensor
    dense = uniform_material(links, 100.0, 1.0, jumps=1e-9, open_fluid=1.0 - 1e-9)
    np.testing.assert_allclose(facet_conductivity(links, dense).tensor, continuum, rtol=1e-6, atol=1e-9)
    glow = facet_conductivity(links, uniform_material(links, 100.0, 0.0, radiation=0.5)).tensor
    thin = uniform_material(links, 100.0, 1.0, jumps=1e9, radiation=0.5, open_fluid=1e-9)
    np.testing.assert_allclose(facet_conductivity(links, thin).tensor, glow, rtol=1e-5, atol=1e-6)
    k = [
        np.trace(facet_conductivity(links, uniform_material(links, 100.0, 1.0, jumps=j)).tensor)
        for j in (0.0, 1e-3, 1e-2, 1e-1)
    ]
    assert (np.diff(k) < 0.0).all()
