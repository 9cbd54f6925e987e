"""Properties of meshless solutions that hold for any body and any steps."""

from itertools import pairwise

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from etc_engine.engines.meshless import (
    Dirichlet,
    Discretization,
    Disk,
    HeatProblem,
    Neumann,
    Polygon,
    solve_transient,
)

# a shock between few nodes leaves boundary residuals that are not what these tests are about
LAYOUT = Discretization(boundary=48, interior=70, residual_limit=np.inf)
FEW = settings(max_examples=8, deadline=None)


@st.composite
def star_polygons(draw):
    """Star-shaped polygons about the origin with moderate corners, either way round."""
    count = draw(st.integers(4, 7))
    radii = np.array(draw(st.lists(st.floats(0.7, 1.3), min_size=count, max_size=count)))
    angles = 2.0 * np.pi * (np.arange(count) + draw(st.floats(0.0, 1.0))) / count
    corners = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return corners[::-1] if draw(st.booleans()) else corners


@FEW
@given(star_polygons(), st.sampled_from(["sdirk2", "bdf2", "backward-euler", "laplace"]))
def test_a_uniform_state_in_balance_stays(corners, scheme):
    # Crank-Nicolson is left out: undamped by design, it is refused as unstable on some of these bodies
    edges = len(corners)
    problem = HeatProblem(
        vertices=corners,
        conductivity=2.0,
        heat_capacity=3.0,
        initial=17.0,
        boundary=[Dirichlet(17.0) if i % 2 else Neumann(0.0) for i in range(edges)],
    )
    result = solve_transient(problem, [0.2], [(0.1, -0.1)], scheme=scheme, steps=8, discretization=LAYOUT)
    assert abs(float(result.temperature[0, 0]) - 17.0) < 1e-5
    assert abs(float(result.mean_temperature[0]) - 17.0) < 1e-5


@FEW
@given(star_polygons(), st.floats(-50.0, 50.0), st.floats(0.5, 20.0))
def test_solutions_are_linear_in_the_temperatures(corners, shift, factor):
    def rise(initial, wall):
        problem = HeatProblem(
            vertices=corners,
            conductivity=2.0,
            heat_capacity=3.0,
            initial=initial,
            boundary=[Dirichlet(wall)] * len(corners),
        )
        result = solve_transient(problem, [0.1], [(0.1, -0.1)], steps=6, discretization=LAYOUT)
        return float(result.temperature[0, 0])

    unit = rise(1.0, 0.0)
    assert -1e-3 < unit < 1.0 + 1e-3  # maximum principle, up to the discretization
    assert abs(rise(shift + factor, shift) - (shift + factor * unit)) < 1e-5 * (abs(shift) + factor)


@FEW
@given(star_polygons(), st.floats(0.0, 6.2))
def test_solutions_turn_with_the_body(corners, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def solve(vertices, point):
        problem = HeatProblem(
            vertices=vertices,
            conductivity=1.0,
            heat_capacity=1.0,
            initial=1.0,
            boundary=[Dirichlet(0.0)] * (len(vertices) - 1) + [Neumann(0.5)],
        )
        layout = Discretization(boundary=80, interior=50, residual_limit=np.inf)
        result = solve_transient(problem, [0.15], [point], scheme="laplace", discretization=layout)
        return float(result.temperature[0, 0]), result.heat_flux.values[0, 0]

    temperature, flux = solve(corners, np.array([0.1, -0.1]))
    turned, turned_flux = solve(corners @ turn.T, turn @ np.array([0.1, -0.1]))
    assert abs(turned - temperature) < 1e-3
    assert np.abs(turned_flux - turn @ flux).max() < 5e-3


@settings(max_examples=60, deadline=None)
@given(star_polygons())
def test_triangles_tile_the_polygon(corners):
    polygon = Polygon(corners)
    points, weights = polygon.quadrature(3)
    assert (weights > 0.0).all() and np.isclose(weights.sum(), polygon.area)
    assert polygon.contains(points).all()


@settings(max_examples=60, deadline=None)
@given(st.floats(0.1, 10.0), st.lists(st.floats(0.0, 6.28), min_size=1, max_size=6, unique=True))
def test_arcs_of_a_disk_cover_the_circle_once(radius, angles):
    breaks = tuple(sorted(angles))
    assume(all(b - a > 1e-6 for a, b in pairwise(breaks)))
    disk = Disk((0.3, 0.4), radius, breaks)
    assert np.isclose(disk.edge_lengths.sum(), 2 * np.pi * radius)
    for edge in range(len(breaks)):
        points, _ = disk.edge_points(edge, np.array([0.3, 0.5, 0.7]))
        assert (disk.nearest_edge(points) == edge).all()
