"""The projection onto gradients in a cell between walls, by sines and cosines instead of mirror images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.fft import dct, dst, idct, idst

from etc_engine.engines.voxel.green import GREEN_OPERATORS
from etc_engine.errors import InputError


@dataclass(frozen=True, eq=False)
class WallProjection:
    r"""Orthogonal projection of vector fields onto gradients, two faces isothermal and the others adiabatic.

    The cell and its mirror images repeat. Of the temperature sines remain along the normal of the isothermal faces and
    cosines along the other axes; its derivative along an axis changes that axis' kind, with opposite sign where a
    cosine becomes a sine.

    Parameters
    ----------
    shape : tuple of int
        Voxels along each axis.
    axis : int
        Normal of the isothermal faces.
    own, cross : tuple of ndarray, shape (n + 1,)
        As of `etc_engine.engines.voxel.green.GradientProjection`, for the waves of 0 to n half periods in the cell.
    threads : int
        Threads of the transforms.
    """

    shape: tuple[int, ...]
    axis: int
    own: tuple[NDArray[np.float64], ...]
    cross: tuple[NDArray[np.float64], ...]
    threads: int = 1

    def onto_gradients(self, field: NDArray[np.float64]) -> NDArray[np.float64]:
        """The gradient part of a vector field, shape (d, *shape), its mean along the normal left out."""
        d = len(self.shape)
        sine = np.array([[a != self.axis and t in (a, self.axis) for t in range(d)] for a in range(d)])
        spectrum = np.empty_like(field)
        for a in range(d):
            part = field[a]
            for t in range(d):
                part = (dst if sine[a, t] else dct)(part, type=2, axis=t, workers=self.threads)
            spectrum[a] = part
        flat = (1,) * (3 - d)
        kinds = np.concatenate((np.zeros((d, 3 - d), dtype=np.int64), sine.astype(np.int64)), axis=1)
        signs = np.where(np.arange(d) == self.axis, 1.0, -1.0)
        ones = (np.ones(1),) * (3 - d)
        _project(spectrum.reshape(d, *flat, *self.shape), kinds, signs, (*ones, *self.own), (*ones, *self.cross))
        for a in range(d):
            part = spectrum[a]
            for t in range(d):
                part = (idst if sine[a, t] else idct)(part, type=2, axis=t, workers=self.threads)
            spectrum[a] = part
        return spectrum

    def onto_fluxes(self, field: NDArray[np.float64]) -> NDArray[np.float64]:
        """The divergence-free part of a vector field, shape (d, *shape), its mean along the normal left out."""
        rest = field - self.onto_gradients(field)
        rest[self.axis] -= rest[self.axis].mean()
        return rest


def wall_projection(
    shape: tuple[int, ...], spacing: tuple[float, ...], axis: int, green: str = "rotated", threads: int = 1
) -> WallProjection:
    """The projection of a discretization of the gradient between two isothermal faces, the others adiabatic.

    Parameters
    ----------
    shape, spacing, green, threads
        As in `etc_engine.engines.voxel.green.gradient_projection`.
    axis : int
        Normal of the isothermal faces.

    Returns
    -------
    WallProjection

    Raises
    ------
    InputError
        If there is no such operator.

    Examples
    --------
    >>> projection = wall_projection((4, 4), (0.25, 0.25), 0)
    >>> wave = np.cos(np.pi * (np.arange(4) + 0.5) / 4)[:, None] * np.ones(4)
    >>> bool(np.allclose(projection.onto_gradients(np.array([wave, 0.0 * wave]))[0], wave))
    True
    """
    if green not in GREEN_OPERATORS:
        raise InputError(f"unknown Green operator {green!r}: choose {' or '.join(GREEN_OPERATORS)}")
    own, cross = [], []
    for count, step in zip(shape, spacing, strict=True):
        angle = np.pi * np.arange(count + 1) / count
        if green == "rotated":
            own.append(2.0 / step * np.sin(0.5 * angle))
            cross.append(np.cos(0.5 * angle))
            cross[-1][count] = 0.0  # cos(pi / 2), not its rounding
        else:
            own.append(angle / step)
            own[-1][count] = 0.0  # the alternating wave has no derivative at the points
            cross.append(np.ones_like(angle))
    return WallProjection(tuple(shape), axis, tuple(own), tuple(cross), threads)


@njit(cache=True)
def _project(spectrum, kinds, signs, own, cross):  # type: ignore[no-untyped-def]
    """Project spectra in place; sines (kind 1) start at the wave of one half period, cosines end before that of n."""
    own_x, own_y, own_z = own
    cross_x, cross_y, cross_z = cross
    d, n1, n2, n3 = spectrum.shape
    q = np.empty(3)
    for i in range(own_x.size):
        for j in range(own_y.size):
            for k in range(own_z.size):
                q[0] = own_x[i] * cross_y[j] * cross_z[k]
                q[1] = cross_x[i] * own_y[j] * cross_z[k]
                q[2] = cross_x[i] * cross_y[j] * own_z[k]
                square, along = 0.0, 0.0
                for a in range(d):
                    component = signs[a] * q[3 - d + a]
                    square += component * component
                    u, v, w = i - kinds[a, 0], j - kinds[a, 1], k - kinds[a, 2]
                    if 0 <= u < n1 and 0 <= v < n2 and 0 <= w < n3:
                        along += component * spectrum[a, u, v, w]
                amplitude = along / square if square > 0.0 else 0.0
                for a in range(d):
                    u, v, w = i - kinds[a, 0], j - kinds[a, 1], k - kinds[a, 2]
                    if 0 <= u < n1 and 0 <= v < n2 and 0 <= w < n3:
                        spectrum[a, u, v, w] = signs[a] * q[3 - d + a] * amplitude
