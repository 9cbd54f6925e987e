"""One realization from packing to outcomes. Serial, no I/O, no MPI."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from etc_engine.errors import EtcError, PackingError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.medium import Medium, Pores
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import find_rule
from etc_engine.packing import ParticlePacking, pack
from etc_engine.realization.engines import ENGINES
from etc_engine.realization.outcome import Cells, Outcome, Realization, Status, uniform_cells
from etc_engine.realization.specification import ContactSpec, RealizationSpec, particle_conductivities
from etc_engine.structure.union import solid_fraction


def realize(spec: RealizationSpec, rng: np.random.Generator) -> Realization:
    """Pack once, then solve every medium and method on that packing.

    Failures of the packer or the solver are recorded in the outcomes, not raised.

    Parameters
    ----------
    spec : RealizationSpec
    rng : numpy.random.Generator
        The random stream of this realization; nothing else is random.

    Returns
    -------
    Realization
    """
    start = time.perf_counter()
    nowhere = np.full((spec.packing.box.dimension,) * 2, np.nan)
    try:
        packing = pack(spec.packing, rng)
    except PackingError as error:
        failed = Outcome(Status.PACKING_FAILED, str(error), nowhere)
        return Realization(0, np.nan, np.nan, time.perf_counter() - start, uniform_cells(spec, failed))
    seconds = time.perf_counter() - start
    try:
        cells = _conduct(spec, packing, rng)
    except EtcError as error:
        cells = uniform_cells(spec, Outcome(Status.ERROR, str(error), nowhere))
    return Realization(packing.count, packing.density, solid_fraction(packing), seconds, cells)


def _conduct(spec: RealizationSpec, packing: ParticlePacking, rng: np.random.Generator) -> Cells:
    """Outcomes of all media and methods on one packing."""
    conduction, seed = spec.conduction, 0
    options: dict[str, Any] = {}
    if spec.composite is None:
        network = contact_network(packing, spec.contacts).with_resistance(conduction.contact_resistance)
        kappa = particle_conductivities(packing.count, conduction, rng)
        first = Medium(packing, kappa, network)
        angles = spec.contacts.contact_angles
        media = [first.with_network(network.with_half_angle(angle)) for angle in angles] or [first]
        options = {"angle_curve": conduction.angle_curve}
    else:
        seed = int(rng.integers(2**63))
        kappa = particle_conductivities(packing.count, conduction, rng)
        pores = Pores(spec.composite.matrix_conductivity)
        inside = [np.full(packing.count, c * pores.conductivity) for c in spec.composite.contrasts] or [kappa]
        media = [Medium(packing, values, pores=pores) for values in inside]
        options = {"resolution": spec.composite.resolution, "particles": spec.composite.nodes}
    engine, columns = ENGINES[conduction.engine], []
    for method in conduction.methods:
        heeded = {name: value for name, value in options.items() if name in engine.methods[method].options}
        task = Conduction(conduction.engine, method, heeded, conduction.tolerance)
        columns.append(engine.conduct(media, task, seed))
    return tuple(zip(*columns, strict=True))


def contact_network(packing: ParticlePacking, contacts: ContactSpec) -> ContactNetwork:
    """Contacts of a packing by the rule of a study; bonded ones with the first of the half-angles."""
    rule = find_rule(contacts.rule)
    given = {
        "contact_angle": contacts.contact_angles[0] if contacts.contact_angles else np.nan,
        "bond_gap": contacts.bond_gap,
        "coordination": np.nan if contacts.coordination is None else contacts.coordination,
    }
    return rule.contacts(packing, **{argument: given[key] for key, argument in rule.keys.items()})
