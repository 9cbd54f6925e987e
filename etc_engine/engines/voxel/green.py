"""Discrete Green operators: the projection onto gradients of periodic temperatures, by FFT."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.fft import fftfreq, irfftn, rfftfreq, rfftn

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

GREEN_OPERATORS = ("rotated", "continuous")


@dataclass(frozen=True, eq=False)
class GradientProjection:
    r"""Orthogonal projection of periodic vector fields onto gradients of zero mean.

    .. math:: \hat\Gamma_{ab}(\xi) = \frac{q_a q_b}{|q|^2}, \qquad q_a = o_a(\xi_a) \prod_{b \ne a} c_b(\xi_b)

    Parameters
    ----------
    shape : tuple of int
        Voxels along each axis.
    own, cross : tuple of ndarray
        The factors o and c along each axis, of which the last has the half spectrum of a real transform.
    threads : int
        Threads of the transforms.
    """

    shape: tuple[int, ...]
    own: tuple[Floats, ...]
    cross: tuple[Floats, ...]
    threads: int = 1

    def onto_gradients(self, field: Floats) -> Floats:
        """The gradient part of a vector field, shape (d, *shape), its mean left out."""
        axes = tuple(range(1, field.ndim))
        spectrum = rfftn(field, axes=axes, workers=self.threads)
        flat = (1,) * (3 - len(self.shape))
        _project(spectrum.reshape(-1, *flat, *spectrum.shape[1:]), *self._padded(self.own), *self._padded(self.cross))
        return irfftn(spectrum, s=self.shape, axes=axes, workers=self.threads, overwrite_x=True)

    def onto_fluxes(self, field: Floats) -> Floats:
        """The divergence-free part of a vector field, shape (d, *shape), its mean left out."""
        rest = field - self.onto_gradients(field)
        rest -= rest.mean(axis=tuple(range(1, field.ndim)), keepdims=True)
        return rest

    def _padded(self, factors: tuple[Floats, ...]) -> tuple[Floats, ...]:
        """Three factors: a plane is one layer of space."""
        return (np.ones(1),) * (3 - len(factors)) + factors


def gradient_projection(
    shape: tuple[int, ...], spacing: tuple[float, ...], green: str = "rotated", threads: int = 1
) -> GradientProjection:
    r"""The projection of a discretization of the gradient.

    Parameters
    ----------
    shape : tuple of int
        Voxels along each axis.
    spacing : tuple of float [m]
        Edges of a voxel.
    green : str
        ``continuous`` differentiates the trigonometric interpolant, :math:`q_a = \xi_a`. ``rotated`` takes the
        temperatures at the corners of the voxels and the gradient at their centres,
        :math:`q_a = \tfrac{2}{h_a} \sin\tfrac{\xi_a h_a}{2} \prod_{b \ne a} \cos\tfrac{\xi_b h_b}{2}` up to a
        common phase.
    threads : int
        Threads of the transforms.

    Returns
    -------
    GradientProjection

    Raises
    ------
    InputError
        If there is no such operator.

    Notes
    -----
    The rotated operator is that of trilinear (bilinear) finite elements with one integration point. It neither rings at
    interfaces nor fails at contrast 0 or infinity; the continuous one does both.

    References
    ----------
    H. Moulinec and P. Suquet, Comput. Methods Appl. Mech. Eng. 157, 69 (1998), 10.1016/S0045-7825(97)00218-1.
    F. Willot, C. R. Mécanique 343, 232 (2015), 10.1016/j.crme.2014.12.005.

    Examples
    --------
    >>> projection = gradient_projection((4, 4), (0.25, 0.25))
    >>> wave = np.cos(0.5 * np.pi * np.arange(4))[:, None] * np.ones(4)
    >>> projection.onto_gradients(np.array([wave, wave]))[:, 0, 0].round(12)  # along x a gradient, along y a flux
    array([1., 0.])
    """
    if green not in GREEN_OPERATORS:
        raise InputError(f"unknown Green operator {green!r}: choose {' or '.join(GREEN_OPERATORS)}")
    own, cross = [], []
    for axis, (count, step) in enumerate(zip(shape, spacing, strict=True)):
        half = axis == len(shape) - 1
        angle = 2.0 * np.pi * (rfftfreq(count) if half else fftfreq(count))
        if green == "rotated":
            own.append(2.0 / step * np.sin(0.5 * angle))
            cross.append(np.cos(0.5 * angle))
            if count % 2 == 0:
                cross[-1][count // 2] = 0.0  # cos(pi / 2), not its rounding
        else:
            own.append(angle / step)
            cross.append(np.ones_like(angle))
            if count % 2 == 0:
                own[-1][count // 2] = 0.0  # the alternating wave has no derivative at the points
    return GradientProjection(tuple(shape), tuple(own), tuple(cross), threads)


@njit(cache=True)
def _project(spectrum, own_x, own_y, own_z, cross_x, cross_y, cross_z):  # type: ignore[no-untyped-def]
    """Project the spectrum of a vector field in place; the last components of q belong to the last axes."""
    d = spectrum.shape[0]
    q = np.empty(3)
    for i in range(spectrum.shape[1]):
        for j in range(spectrum.shape[2]):
            for k in range(spectrum.shape[3]):
                q[0] = own_x[i] * cross_y[j] * cross_z[k]
                q[1] = cross_x[i] * own_y[j] * cross_z[k]
                q[2] = cross_x[i] * cross_y[j] * own_z[k]
                square, along = 0.0, 0.0j
                for a in range(d):
                    component = q[3 - d + a]
                    square += component * component
                    along += component * spectrum[a, i, j, k]
                amplitude = along / square if square > 0.0 else 0.0j
                for a in range(d):
                    spectrum[a, i, j, k] = q[3 - d + a] * amplitude
