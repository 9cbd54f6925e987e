"""A binary heap of event times, one event for each particle, with changes of time in O(log n)."""

from __future__ import annotations

import numpy as np
from numba import njit


def empty_queue(count: int):  # type: ignore[no-untyped-def]
    """Heap of `count` particles whose events are all infinitely far: (heap, place)."""
    return np.arange(count, dtype=np.int32), np.arange(count, dtype=np.int32)


@njit(cache=True)
def reschedule(heap, place, times, particle):  # type: ignore[no-untyped-def]
    """Restore the heap after ``times[particle]`` has changed."""
    slot, time = place[particle], times[particle]
    while slot > 0:
        above = (slot - 1) >> 1
        parent = heap[above]
        if times[parent] <= time:
            break
        heap[slot] = parent
        place[parent] = slot
        slot = above
    count = heap.size
    while True:
        below = 2 * slot + 1
        if below >= count:
            break
        child = heap[below]
        if below + 1 < count and times[heap[below + 1]] < times[child]:
            below += 1
            child = heap[below]
        if times[child] >= time:
            break
        heap[slot] = child
        place[child] = slot
        slot = below
    heap[slot] = particle
    place[particle] = slot
