"""Rigs: what a user believes about a bench."""

from __future__ import annotations

import os
from collections.abc import Mapping

from bowden import _bowden
from bowden.errors import InputError

__all__ = ["Rig", "RigLike"]


class Rig:
    """A rig file (`bowden-rig/1`) in memory. A rig never changes; methods that change something return another one.

    Args:
        text: Text of a rig file.
        source: Name in messages.

    Raises:
        InputError: The text is no rig file; `line` and `column` say where, `hint` what to do.
    """

    __slots__ = ("_native",)
    _native: _bowden.NativeRig

    def __init__(self, text: str, source: str = "rig") -> None:
        self._native = _bowden.NativeRig.parse(text, source)

    @classmethod
    def _of(cls, native: _bowden.NativeRig) -> Rig:
        rig = cls.__new__(cls)
        rig._native = native
        return rig

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Rig:
        """Reads a rig file."""
        return cls._of(_bowden.NativeRig.load(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a rig file; it appears under its name only when it is complete."""
        self._native.save(path)

    @property
    def text(self) -> str:
        """The file's text, with comments and layout."""
        return self._native.text

    @property
    def name(self) -> str:
        """Name of the bench."""
        return self._native.name

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects and laws that the simulation contains beyond the nominal model."""
        return tuple(self._native.effects)

    @property
    def columns(self) -> dict[str, str]:
        """Name of the column that a role is read from, for every role that `[recording.columns]` maps."""
        return dict(self._native.columns)

    def __getitem__(self, parameter: str) -> float:
        """Value of a parameter, SI: `rig["load.mass_kg"]`, `rig["effects.joint_spring.stiffness_nm_per_rad"]`.

        Raises:
            KeyError: The rig lacks the part.
            InputError: There is no such parameter; `hint` has the nearest name.
        """
        value = self._native.value(parameter)
        if value is None:
            raise KeyError(parameter)
        return value

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """The rig with other values: `rig.with_values({"load.mass_kg": 2.0})`.

        Raises:
            InputError: A value outside its range, or a part that the rig lacks.
        """
        native = self._native
        for parameter, value in values.items():
            native = native.with_value(parameter, float(value))
        return Rig._of(native)

    def without(self, effect: str) -> Rig:
        """The rig without an effect; `"law"` leaves out all laws.

        Raises:
            InputError: The rig does not contain it.
        """
        native = self._native.without(effect)
        if native is None:
            has = ", ".join(dict.fromkeys(self.effects)) or "none"
            message = f"{self.name}: no effect `{effect}` to leave out; the rig has {has}"
            raise InputError(message, self.name, hint=f"the rig has {has}")
        return Rig._of(native)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Rig) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"Rig({self.name!r}, effects={list(self.effects)})"

    def __reduce__(self) -> tuple[type[Rig], tuple[str, str]]:
        return Rig, (self.text, self.name)


RigLike = Rig | str | os.PathLike[str]
"""A rig, or the path of a rig file."""


def as_rig(rig: RigLike) -> Rig:
    """The rig, read where it is a path."""
    return rig if isinstance(rig, Rig) else Rig.load(rig)
