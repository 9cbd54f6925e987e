"""A disk heated as a network says: heat flows through its contacts, given at the times of a march."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.contact_heating import ContactArc, heat_disk_through_arcs
from etc_engine.errors import InputError

if TYPE_CHECKING:
    import xarray


def flow_histories(times: ArrayLike, flows: ArrayLike) -> list[Callable[[float], float]]:
    """Heat through each contact as a function of time, linear between the given ones and constant outside.

    Parameters
    ----------
    times : array_like, shape (m,) [s]
        Increasing.
    flows : array_like, shape (m, n) [W/m]
        Heat into the disk through its n contacts.

    Raises
    ------
    InputError
        If the times do not increase, the shapes do not fit, or a value is not finite.

    Examples
    --------
    >>> one, other = flow_histories([0.0, 2.0], [[1.0, 0.0], [3.0, -1.0]])
    >>> one(1.0), other(5.0)
    (2.0, -1.0)
    """
    times, flows = np.asarray(times, dtype=np.float64), np.asarray(flows, dtype=np.float64)
    fits = times.ndim == 1 and flows.ndim == 2 and flows.shape[0] == times.size and times.size > 1
    if not fits or not (np.diff(times) > 0.0).all() or not (np.isfinite(times).all() and np.isfinite(flows).all()):
        raise InputError(
            f"heat flows need at least two increasing times (m,) and finite values (m, n), found the shapes "
            f"{times.shape} and {flows.shape}"
        )

    def history(column: Floats) -> Callable[[float], float]:
        return lambda t: float(np.interp(t, times, column))

    return [history(np.ascontiguousarray(column)) for column in flows.T]


def heat_disk_by_flows(
    arcs: Sequence[ContactArc],
    times: ArrayLike,
    flows: ArrayLike,
    output_times: Sequence[float] | Floats,
    *,
    steps: int = 200,
    decades: int = 3,
    **disk: float,
) -> xarray.Dataset:
    """Temperature inside one particle of a network, under the heat flows that a transient of the network found.

    Parameters
    ----------
    arcs : sequence of ContactArc
        The n contacts of the particle.
    times : array_like, shape (m,) [s]
        Of the march, its start first.
    flows : array_like, shape (m, n) [W/m]
        Heat into the particle through each contact.
    output_times : sequence of float [s]
        Increasing, within the march.
    steps : int
        Time steps up to the last output time of each decade: earlier times, where the flows change faster, are
        marched again from the start in shorter steps.
    decades : int
        How many of the last decades are marched on their own; earlier times join the first of them. Shorter
        steps than the boundary nodes can follow end in a `DiscretizationWarning`.
    **disk
        ``radius``, ``conductivity``, ``heat_capacity`` and ``initial`` of `heat_disk_through_arcs`.

    Returns
    -------
    xarray.Dataset
        That of `heat_disk_through_arcs` at all output times: the mean temperature of the disk, ``arc_temperature``
        of its contacts, and ``lumped_arc_temperature``, what the model without dipoles takes it for.

    Raises
    ------
    InputError
        If the flows are not understood, or output times lie outside the march.
    GeometryError
        If arcs overlap.

    Examples
    --------
    >>> arcs = [ContactArc(0.0, 0.5)]
    >>> result = heat_disk_by_flows(arcs, [0.0, 2.0], [[1.0], [1.0]], [0.05, 1.0], steps=40)
    >>> result.mean_temperature.values.round(3)
    array([0.016, 0.318])
    """
    import xarray

    given = np.asarray(times, dtype=np.float64)
    wanted = np.asarray(output_times, dtype=np.float64)
    histories = flow_histories(given, flows)
    if wanted.size == 0 or wanted[0] < given[0] or wanted[-1] > given[-1] * (1.0 + 1e-12) or given[0] != 0.0:
        raise InputError(
            f"the output times must lie within the march from 0 to {given[-1]:g} s, found "
            f"{wanted[:1].tolist()} to {wanted[-1:].tolist()}"
        )
    before = np.floor(np.log10(wanted[-1] / np.maximum(wanted, 1e-12 * wanted[-1])) + 1e-9)
    ends = [0, *(np.flatnonzero(np.diff(np.minimum(before, decades - 1))) + 1), wanted.size]
    parts = [
        heat_disk_through_arcs(arcs, histories, wanted[low:high], steps=steps, **disk)  # type: ignore[arg-type]
        for low, high in pairwise(ends)
    ]
    return xarray.concat(parts, dim="time", data_vars="minimal", coords="minimal", compat="override", join="exact")
