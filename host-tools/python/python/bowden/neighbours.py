"""Rigs from MuJoCo models and URDFs, and rigs as MuJoCo models."""

from __future__ import annotations

import os
from dataclasses import dataclass

from bowden import _bowden
from bowden.rig import Rig, RigLike, as_rig

__all__ = ["Imported", "Mapped", "export_mujoco", "rig_from_mujoco", "rig_from_urdf"]

_Path = str | os.PathLike[str]


@dataclass(frozen=True)
class Mapped:
    """One statement of a model or a rig, and what became of it."""

    line: int | None
    """Line of the model's file, from 1; `None` for what a rig states."""
    says: str
    becomes: str | None
    """What it is in the other format."""
    why_not: str | None
    """Why it is nothing there."""

    def __str__(self) -> str:
        place = "" if self.line is None else f"line {self.line}: "
        return f"{place}{self.says}" + (f": not mapped, {self.why_not}" if self.becomes is None else f" -> {self.becomes}")


@dataclass(frozen=True)
class Imported:
    """A rig with the load of a model's joint."""

    rig: Rig
    zero_rad: float
    """`theta_out_rad` where the model has the joint at zero: the angle of the arm from hanging straight down."""
    mapped: tuple[Mapped, ...]
    """Every statement of the model on the joint."""


def rig_from_mujoco(path: _Path, joint: str, base: RigLike) -> Imported:
    """Makes a rig of what a MuJoCo model (MJCF) says of a hinge joint.

    Args:
        path: The model, one file without `<include>`.
        joint: Name of the joint; everything that hangs on it becomes one weight.
        base: Rig with what such a model does not know: motor, pulleys, tendon, sheath, sensors.

    Raises:
        InputError: With file and line: no such joint, or one without a mass beyond it.
    """
    return _imported("mujoco", path, joint, base)


def rig_from_urdf(path: _Path, joint: str, base: RigLike) -> Imported:
    """Makes a rig of what a URDF says of a revolute joint. Arguments as for `rig_from_mujoco`."""
    return _imported("urdf", path, joint, base)


def export_mujoco(rig: RigLike, path: _Path, *, into: _Path | None = None, joint: str | None = None) -> tuple[Mapped, ...]:
    """Writes a rig as a MuJoCo model, or its joint's damping, frictionloss, armature and stiffness into one that is there.

    Args:
        rig: The rig, for example a diagnosed one.
        path: The model to write; it appears under its name only when it is complete.
        into: Model that gets the joint's values; it is not changed itself.
        joint: Which joint of it.

    Raises:
        InputError: No such joint; or `path` is in a folder that does not exist, or is `into` or the file of `rig`.
    """
    read = [file for file in (into, None if isinstance(rig, Rig) else rig) if file is not None]
    return _mapped(_bowden.export_mujoco(as_rig(rig)._native, path, into, joint, read))


def _imported(kind: str, path: _Path, joint: str, base: RigLike) -> Imported:
    rig, zero_rad, mapped = _bowden.rig_of_model(kind, path, joint, as_rig(base)._native)
    return Imported(Rig._of(rig), zero_rad, _mapped(mapped))


def _mapped(all_: list[tuple[int | None, str, str, bool]]) -> tuple[Mapped, ...]:
    return tuple(Mapped(line, says, what if done else None, None if done else what) for line, says, what, done in all_)
