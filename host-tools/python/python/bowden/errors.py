"""What goes wrong, as exceptions and warnings."""

from __future__ import annotations

__all__ = ["Error", "InputError", "RepairedWarning", "StoppedEarlyWarning"]


class Error(Exception):
    """The work did not succeed although the input was usable.

    Attributes:
        message: One line: what is wrong, where, and what to do.
        file: File, or what else the message is about (the name given to a frame).
        line: Line in the file, from 1.
        column: Column in the line, from 1.
        hint: What to do.
    """

    def __init__(
        self,
        message: str,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.file = file
        self.line = line
        self.column = column
        self.hint = hint


class InputError(Error, ValueError):
    """The input cannot be used: a file, an array, or an argument."""


class RepairedWarning(UserWarning):
    """A recording was repaired or shortened when it was read; the message says where."""


class StoppedEarlyWarning(UserWarning):
    """Ctrl-C ended the work; the result holds what was found until then."""
