"""Bad input of the meshless room: a clear refusal or a stated fallback, never a silent wrong field."""

import numpy as np
import pytest

from etc_engine.engines.meshless import (
    ContactArc,
    Convective,
    Dirichlet,
    Discretization,
    DiscretizationWarning,
    Disk,
    HeatProblem,
    Neumann,
    Polygon,
    PolyharmonicSpline,
    heat_disk_through_arcs,
    solve_transient,
)
from etc_engine.errors import ConvergenceError, GeometryError, InputError

UNIT = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
L_SHAPE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]
SMALL = Discretization(boundary=60, interior=80)
CENTER = [(0.5, 0.5)]


def unit_square(**changes):
    values = {
        "vertices": UNIT,
        "conductivity": 1.0,
        "heat_capacity": 1.0,
        "initial": 1.0,
        "boundary": [Dirichlet(0.0)] * 4,
    }
    return HeatProblem(**(values | changes))


def solve(problem=None, times=(0.1,), points=CENTER, discretization=SMALL, **options):
    return solve_transient(problem or unit_square(), list(times), points, discretization=discretization, **options)


@pytest.mark.parametrize(
    "vertices, message",
    [
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "edges 0 and 2 touch or cross"),
        ([(0, 0), (1, 0)], "at least three vertices"),
        ([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], "coincide"),
        ([(0, 0), (1, 0), (1, np.nan)], "finite"),
        ([(0, 0), (2, 0), (1, 0), (1, 1)], "folds back"),
        ([(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)], "touch or cross"),
    ],
)
def test_polygons_that_are_not_simple(vertices, message):
    with pytest.raises(GeometryError, match=message):
        Polygon(vertices)


@pytest.mark.parametrize("name", ["conductivity", "heat_capacity"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "2"])
def test_material_constants_must_be_positive(name, value):
    with pytest.raises(InputError, match=name):
        unit_square(**{name: value})


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"boundary": [Dirichlet(0.0)] * 3}, "4 edges but 3 boundary conditions"),
        ({"boundary": [Dirichlet(0.0)] * 3 + [0.0]}, "boundary condition 3"),
        ({"vertices": None}, "exactly one"),
        ({"disk": Disk((0.0, 0.0), 1.0)}, "exactly one"),
    ],
)
def test_problems_that_do_not_fit_together(changes, message):
    with pytest.raises(InputError, match=message):
        unit_square(**changes)


def test_convective_coefficient_must_be_positive():
    with pytest.raises(InputError, match="Neumann"):
        Convective(0.0, 1.0)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"times": [-0.1]}, "not negative"),
        ({"times": [0.2, 0.1]}, "increasing"),
        ({"times": [np.nan]}, "finite"),
        ({"points": [(1.5, 0.5)]}, "outside the body"),
        ({"points": [0.5, 0.5]}, "positions"),
        ({"method": "fem"}, "trefftz or mfs"),
        ({"scheme": "euler"}, "sdirk2"),
        ({"steps": 0}, "at least one"),
        ({"discretization": Discretization(boundary=8)}, "too few"),
        ({"discretization": Discretization(boundary=60, interior=0)}, "at least one interior node"),
        ({"discretization": Discretization(boundary=60, functions=61)}, "at most one per node"),
        ({"discretization": Discretization(boundary=60, interior=[(2.0, 2.0)])}, "outside the body"),
        ({"discretization": Discretization(boundary=60, interior=[(0.5, 0.5)] * 2)}, "coincide"),
        ({"discretization": Discretization(boundary=[(0.5, 0.0), (1.0, 0.5), (0.0, 0.5)])}, "edge 2"),
        ({"discretization": Discretization(boundary=[(0.5, 0.1)])}, "away from the boundary"),
    ],
)
def test_requests_that_cannot_be_met(options, message):
    with pytest.raises(InputError, match=message):
        solve(**options)


def test_too_few_nodes_for_the_polynomials():
    boundary = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)]
    layout = Discretization(boundary=boundary, interior=CENTER, basis=PolyharmonicSpline(3), functions=3)
    with pytest.raises(InputError, match="5 nodes do not determine the 10 polynomial terms"):
        solve(discretization=layout)


@pytest.mark.parametrize("center, place", [((0.0, 0.0), "on the boundary of"), ((0.5, 0.5), "inside")])
def test_sources_on_or_inside_the_boundary(center, place):
    # the centre of the bounding box of an L is its re-entrant corner
    problem = HeatProblem(
        vertices=L_SHAPE, conductivity=1.0, heat_capacity=1.0, initial=1.0, boundary=[Dirichlet(0.0)] * 6
    )
    layout = Discretization(boundary=60, interior=80, source_factor=1.2, source_center=center)
    with pytest.raises(GeometryError, match=place):
        solve(problem, points=[(-0.5, -0.5)], method="mfs", discretization=layout)


def test_a_body_without_star_kernel_cannot_scale_its_sources():
    u_shape = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    problem = HeatProblem(
        vertices=u_shape, conductivity=1.0, heat_capacity=1.0, initial=1.0, boundary=[Dirichlet(0.0)] * 8
    )
    assert problem.domain.star_center() is None
    with pytest.raises(GeometryError, match="star-shaped"):
        layout = Discretization(boundary=60, interior=80, source_factor=1.2)
        solve(problem, points=[(0.5, 0.5)], method="mfs", discretization=layout)


@pytest.mark.parametrize(
    "data, message",
    [
        (lambda *_: np.zeros(3), "shape"),
        (lambda *_: np.nan, "not finite"),
        (lambda x, _: x[0], "first coordinate"),
        (lambda *_: "hot", "real numbers"),
    ],
)
def test_boundary_functions_that_answer_nonsense(data, message):
    with pytest.raises(InputError, match=message):
        solve(unit_square(boundary=[Dirichlet(0.0)] * 3 + [Neumann(data)]))


def test_laplace_needs_transforms():
    moving = Dirichlet(lambda _, t: np.sin(t))
    with pytest.raises(InputError, match="edge 1 is a function without a Laplace transform"):
        solve(unit_square(boundary=[Dirichlet(0.0), moving, Dirichlet(0.0), Dirichlet(0.0)]), scheme="laplace")


def test_laplace_refuses_a_foreign_transform():
    wrong = Dirichlet(lambda _, t: np.exp(-t), lambda _, s: 1.0 / (s + 2.0))
    with pytest.raises(InputError, match="does not belong to its function"):
        solve(unit_square(boundary=[wrong] * 4), scheme="laplace")


def test_jumps_at_a_corner_are_named():
    with pytest.warns(DiscretizationWarning) as caught:
        layout = Discretization(boundary=60, interior=80, residual_limit=np.inf)
        result = solve(unit_square(boundary=[Dirichlet(0.0)] * 3 + [Dirichlet(1.0)]), discretization=layout)
    assert "jump from 1 to 0 at vertex 0" in str(caught[0].message)
    assert "jump from 0 to 1 at vertex 3" in result.attrs["warnings"]


def test_rank_deficient_systems_are_cut_off_and_named():
    layout = Discretization(boundary=60, interior=80, functions=60, source_offset=3.0)
    with pytest.warns(DiscretizationWarning, match="rank"):
        result = solve(method="mfs", discretization=layout, times=[1.0], steps=20)
    assert result.attrs["boundary_rank"] < result.attrs["functions"]
    fine = solve(method="mfs", discretization=SMALL, times=[1.0], steps=20)
    np.testing.assert_allclose(result.temperature, fine.temperature, rtol=1e-3)


def test_steps_outside_the_stable_range_are_named():
    # every step so short that lambda times the spacing exceeds 4, but the sources still march stably
    layout = Discretization(boundary=60, interior=80, source_offset=0.15, residual_limit=np.inf)
    with pytest.warns(DiscretizationWarning, match="stable range"):
        solve(times=[2e-3], method="mfs", steps=4, discretization=layout)


def test_unstable_steps_are_refused():
    # as many Trefftz functions as collocation points on an L, Cao's choice, amplifies in each step
    problem = HeatProblem(
        vertices=L_SHAPE, conductivity=1.0, heat_capacity=1.0, initial=1.0, boundary=[Dirichlet(0.0)] * 6
    )
    layout = Discretization(boundary=60, interior=120, functions=60, spacing="uniform")
    with pytest.raises(ConvergenceError, match="spectral radius"):
        solve(
            problem,
            times=[1.0],
            points=[(-0.5, -0.5)],
            scheme="backward-euler",
            steps=50,
            discretization=layout,
        )


@pytest.mark.parametrize(
    "arcs, heat, error, message",
    [
        ([ContactArc(0.0, 0.3), ContactArc(0.5, 0.3)], [1.0, 1.0], GeometryError, "overlap"),
        ([ContactArc(0.1, 0.3), ContactArc(-0.3 + 2 * np.pi, 0.3)], [1.0, 1.0], GeometryError, "overlap"),
        ([ContactArc(0.0, 0.3)], [1.0, 2.0], InputError, "as many heat histories"),
        ([], [], GeometryError, "at least one"),
        ([ContactArc(0.0, 1e-3)], [1.0], GeometryError, "too narrow"),
        ([ContactArc(0.0, 0.3)], [lambda _: np.nan], InputError, "not finite"),
    ],
)
def test_contact_arcs_that_cannot_be(arcs, heat, error, message):
    with pytest.raises(error, match=message):
        heat_disk_through_arcs(arcs, heat, [0.1])


@pytest.mark.parametrize("half_angle", [0.0, -0.1, 1.6])
def test_half_angles_out_of_range(half_angle):
    with pytest.raises(GeometryError, match="half-angle"):
        ContactArc(0.0, half_angle)


@pytest.mark.parametrize("breaks", [(1.0, 0.5), (0.0, 7.0), (0.0, 0.0)])
def test_disk_breaks_must_increase_within_a_turn(breaks):
    with pytest.raises(GeometryError, match="increase"):
        Disk((0.0, 0.0), 1.0, breaks)
