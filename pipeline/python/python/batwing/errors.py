# SPDX-License-Identifier: MIT OR Apache-2.0
"""Exceptions of the package.

Every exception is an `Error`. Its attributes `key`, `got` and `expected` say which argument or key
is wrong, what was found there and what was expected, where the message names them.
"""

from __future__ import annotations

__all__ = [
    "ConvergenceError",
    "ConvergenceWarning",
    "DesignWarning",
    "Error",
    "FileError",
    "InputError",
    "InternalError",
    "ReliefWarning",
    "SolverError",
    "UnitWarning",
]


def __dir__() -> list[str]:
    return sorted(__all__)


class Error(Exception):
    """Base class of all exceptions of this package.

    Parameters
    ----------
    message : str
        The whole message.
    key : str, optional
        Argument of the call, or key of the design file.
    got : str, optional
        What was found.
    expected : str, optional
        What was expected.
    """

    def __init__(
        self,
        message: str = "",
        key: str | None = None,
        got: str | None = None,
        expected: str | None = None,
    ) -> None:
        super().__init__(message)
        self.key = key
        self.got = got
        self.expected = expected

    def __reduce__(self) -> tuple[type[Error], tuple[str, str | None, str | None, str | None]]:
        return type(self), (str(self), self.key, self.got, self.expected)


class InputError(Error, ValueError):
    """An argument, or a key of a file, that cannot be used."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class ConvergenceError(Error):
    """A tolerance that was not reached within the orders and slices allowed."""


class SolverError(Error):
    """A solution that does not keep energy, or an eigenproblem that failed."""


class InternalError(Error):
    """A mistake in this program; please report it."""


class ConvergenceWarning(UserWarning):
    """Results of a grating whose stated error is above the tolerance, or next to 1."""


class DesignWarning(UserWarning):
    """A warning on a design or a table, as it stands on the terminal."""


class ReliefWarning(UserWarning):
    """Ridges that do not stand on the half-space of their material, or whose base is a guess."""


class UnitWarning(UserWarning):
    """Lengths whose ratio suggests two different units."""
