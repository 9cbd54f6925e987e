"""Two-sided bounds of the effective conductivity from the energies of method ``exact``."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.exact.jumps import jump_energies
from etc_engine.engines.dtem.steady import SteadySolution
from etc_engine.errors import InputError


def element_error(modes: int) -> float:
    """Relative error of the energy that the points on the chords leave.

    The largest found on assemblies with half-angles up to 66 degrees and chord ends down to a hundredth of a
    half-chord apart is 8e-8 with up to 4 modes and 2e-8 with more, which take more points.
    """
    return 1e-7 if modes <= 4 else 2e-8


def energy_bounds(solution: SteadySolution) -> Floats:
    r"""Bounds of the energy of every load, shape (k, 2): lower, upper.

    Thomson's principle: the fluxes of the method are equilibrated in every disk and equal and opposite across every
    contact, so that their energy is a lower bound of E(T). Dirichlet's: temperatures made continuous across every
    contact give an upper one, larger by the energy of the correction (see `etc_engine.engines.dtem.exact.jumps`).

    Parameters
    ----------
    solution : SteadySolution
        Of method ``exact``.

    Returns
    -------
    ndarray, shape (k, 2) [W K/m]

    Raises
    ------
    InputError
        If the method is another one.

    Notes
    -----
    Both principles, and the correction, whose energy is an upper estimate by construction, are rigorous, for the union
    of the disks as cut, with a temperature jump that is uniform over a contact where there is a contact resistance.
    Estimated are: the energy error of the iterative solver (`SolveReport.relative_energy_error`), the
    discretization of the chords (`element_error`, measured), and the quadrature of the correction (some per
    cent of the distance of the two bounds). The first two widen the bounds.
    """
    if solution.method != "exact":
        raise InputError(f"bounds are only available with method exact, found a solution by {solution.method}")
    energies = np.diag(solution.energies)
    bounds = np.empty((energies.size, 2))
    for load, (energy, report) in enumerate(zip(energies, solution.reports, strict=True)):
        gap = jump_energies(solution, load).sum()
        error = element_error(solution.modes)
        bounds[load] = energy * (1.0 - error - report.relative_energy_error), (energy + gap) * (1.0 + error)
    return bounds
