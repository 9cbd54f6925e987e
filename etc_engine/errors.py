"""The errors of the engine: each says what was found, what was expected and what to do.

Each is also the Python error that a caller would expect.
"""

from __future__ import annotations

from collections.abc import Sequence


class EtcError(Exception):
    """Base of every error the engine raises on purpose; the command line prints it as one line."""


class InputError(EtcError, ValueError):
    """The user's input (a file, an option, a study) is not what the engine can work with."""


class GeometryError(InputError):
    """Particles or contacts do not form a geometry the model describes."""


class PackingError(EtcError, RuntimeError):
    """A packing algorithm could not reach its target.

    Parameters
    ----------
    message : str
        What was asked for and what was reached.
    reached : float, optional
        The density reached before giving up.
    """

    def __init__(self, message: str, reached: float | None = None) -> None:
        super().__init__(message)
        self.reached = reached


class ConvergenceError(EtcError, RuntimeError):
    """An iterative solver stopped before its tolerance.

    Parameters
    ----------
    message : str
        What was asked for and what was reached.
    residuals : sequence of float, optional
        The history of relative residuals.
    """

    def __init__(self, message: str, residuals: Sequence[float] = ()) -> None:
        super().__init__(message)
        self.residuals = tuple(residuals)


class StudyError(InputError):
    """A study file is not valid, or does not belong to the result it is used with."""


class OutputError(EtcError, OSError):
    """A file cannot be written where it was asked for, or a result cannot be read."""
