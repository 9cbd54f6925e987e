"""Quantities of a solution: temperatures and fluxes at points, means, heat inflow, boundary residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.discretization import Layout
from etc_engine.engines.meshless.domain import boundary_quadrature
from etc_engine.engines.meshless.helmholtz import HelmholtzOperator

Field = NDArray

CHUNK = 2000
AREA_ORDER = 8
EDGE_ORDER = 10


@dataclass(frozen=True, eq=False)
class Probe:
    """Points and quadratures at which solutions of one layout are read (physical coordinates)."""

    layout: Layout
    points: Floats
    area_points: Floats
    area_weights: Floats
    edge_points: Floats
    edge_normals: Floats
    edge_weights: Floats


@dataclass(frozen=True, eq=False)
class Observation:
    """Readings, one column per solution.

    Attributes
    ----------
    temperature : ndarray, shape (points, k) [K]
    heat_flux : ndarray, shape (points, 2, k) [W/m2]
        -k grad u.
    mean_temperature : ndarray, shape (k,) [K]
    heat_inflow : ndarray, shape (k,) [W/m]
        Heat entering through the whole boundary per unit thickness.
    boundary_values : ndarray, shape (check points, k)
        B1 u + B2 du/dn between the collocation points.
    """

    temperature: Field
    heat_flux: Field
    mean_temperature: Field
    heat_inflow: Field
    boundary_values: Field

    def weighted(self, weights: Field) -> Observation:
        """Real part of the weighted columns, each turned by ``weights`` of shape (k, m) into m columns."""
        return Observation(
            temperature=np.asarray((self.temperature @ weights).real),
            heat_flux=np.asarray((self.heat_flux @ weights).real),
            mean_temperature=np.asarray((self.mean_temperature @ weights).real),
            heat_inflow=np.asarray((self.heat_inflow @ weights).real),
            boundary_values=np.asarray((self.boundary_values @ weights).real),
        )


def prepare_probe(layout: Layout, points: Floats) -> Probe:
    """A probe for the given output points of a layout's body."""
    domain = layout.problem.domain
    return Probe(layout, points, *domain.quadrature(AREA_ORDER), *boundary_quadrature(domain, EDGE_ORDER))


def observe(probe: Probe, operator: HelmholtzOperator, coefficients: Field) -> Observation:
    """Read the solutions whose coefficient vectors are the columns of an array (c, k)."""
    layout = probe.layout
    k = coefficients.shape[1]
    dtype = coefficients.dtype
    temperature = np.empty((len(probe.points), k), dtype=dtype)
    flux = np.empty((len(probe.points), 2, k), dtype=dtype)
    for start in range(0, len(probe.points), CHUNK):
        part = slice(start, start + CHUNK)
        at = layout.scaled(probe.points[part])
        temperature[part] = operator.value_rows(at) @ coefficients
        for axis, rows in enumerate(operator.gradient_rows(at)):
            flux[part, axis] = -layout.problem.conductivity * (rows @ coefficients)
    inside = operator.value_rows(layout.scaled(probe.area_points))
    along_x, along_y = operator.gradient_rows(layout.scaled(probe.edge_points))
    weights = layout.problem.conductivity * probe.edge_weights
    inflow = (weights * probe.edge_normals[:, 0]) @ along_x + (weights * probe.edge_normals[:, 1]) @ along_y
    return Observation(
        temperature=temperature,
        heat_flux=flux,
        mean_temperature=(probe.area_weights @ inside / layout.problem.domain.area) @ coefficients,
        heat_inflow=inflow @ coefficients,
        boundary_values=operator.residual_rows(layout.check) @ coefficients,
    )


def observe_initial(probe: Probe, gradient: tuple[Field, Field], nodal: Floats) -> Observation:
    """Readings at t = 0: the prescribed state; its flux by the gradient rows of the node interpolation.

    What depends on the boundary conditions (inflow, residual) is not defined yet and answered by NaN.
    """
    problem = probe.layout.problem
    slopes = np.stack([rows @ nodal for rows in gradient], axis=1) / probe.layout.scale
    return Observation(
        temperature=problem.initial_values(probe.points)[:, None],
        heat_flux=-problem.conductivity * slopes[:, :, None],
        mean_temperature=np.array(
            [probe.area_weights @ problem.initial_values(probe.area_points) / problem.domain.area]
        ),
        heat_inflow=np.array([np.nan]),
        boundary_values=np.full((probe.layout.check.count, 1), np.nan),
    )


def boundary_residual(layout: Layout, values: Field, t: float, span: float) -> float:
    """Largest violation of the boundary conditions between the collocation points, over the temperature span.

    Each row B1 u + B2 du/dn - B3 is divided by |B1| + |B2| (B2 = k over the domain radius), which makes
    it a temperature.
    """
    b1, b2 = layout.boundary_coefficients(layout.check.edges)
    size = np.abs(b1) + np.abs(b2) * layout.scale / layout.radius
    gap = (values - layout.boundary_data(layout.check, t)) / size
    return float(np.abs(gap).max() / span)
