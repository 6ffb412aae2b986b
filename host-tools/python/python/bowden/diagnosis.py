"""Diagnoses: which physics a simulation lacks."""

from __future__ import annotations

import json
import os
import pathlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bowden import _bowden
from bowden.errors import InputError
from bowden.results import (
    ChannelFit,
    Effect,
    Law,
    Mismatch,
    Recalibrated,
    ResidualMap,
    StageLoss,
    TriedHypothesis,
    Unexplained,
    read,
)
from bowden.rig import Rig

__all__ = ["Diagnosis", "Trace"]


@dataclass(frozen=True)
class Trace:
    """One channel of the first recording over time; arrays of shape `(samples,)`, in the channel's unit."""

    channel: str
    unit: str
    t_s: NDArray[np.float64]
    measured: NDArray[np.float64]
    before: NDArray[np.float64]
    """Simulated with the rig as it was."""
    after: NDArray[np.float64]
    """Simulated with the diagnosed rig."""
    held_out: NDArray[np.bool_]
    """Whether a sample was held out of the fit."""


class Diagnosis:
    """What the simulation of a rig lacks, and the proof on data that the fit has not seen."""

    def __init__(self, native: _bowden.NativeDiagnosis) -> None:
        self._native = native
        self._data: dict[str, Any] = json.loads(native.json)

    @property
    def verdict(self) -> str:
        """`consistent`, `recalibrate` (parameters were wrong), `missing_physics` (named effects) or `unexplained`."""
        return str(self._data["verdict"])

    @property
    def summary(self) -> str:
        """The result in a sentence or two."""
        return str(self._data["summary"])

    @property
    def complete(self) -> bool:
        """Whether every effect was tried; false after Ctrl-C."""
        return bool(self._data["complete"])

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """Effects that the diagnosis reports, most certain first."""
        return read(tuple[Effect, ...], self._data["effects"])

    @cached_property
    def laws(self) -> tuple[Law, ...]:
        """Laws that describe a part of what has no name; the diagnosed rig simulates them."""
        return read(tuple[Law, ...], self._data["laws"])

    @cached_property
    def hypotheses(self) -> tuple[TriedHypothesis, ...]:
        """Every hypothesis by itself, in the order in which they were stated."""
        return read(tuple[TriedHypothesis, ...], self._data.get("hypotheses", []))

    @cached_property
    def recalibrated(self) -> tuple[Recalibrated, ...]:
        """Every nominal parameter that was fitted."""
        return read(tuple[Recalibrated, ...], self._data["recalibrated"])

    @property
    def differing(self) -> tuple[str, ...]:
        """Parameters in which the benches of a study differ although it says that they share them."""
        return tuple(self._data.get("differing", ()))

    @cached_property
    def mismatch(self) -> tuple[Mismatch, ...]:
        """Where the recalibrated simulation differs, largest share first."""
        return read(tuple[Mismatch, ...], self._data["mismatch"])

    @cached_property
    def residual_map(self) -> ResidualMap:
        """Differences over position, speed, tension and time."""
        return read(ResidualMap, self._data["residual_map"])

    @cached_property
    def unexplained(self) -> Unexplained | None:
        """Structure that no named effect explains."""
        left = self._data["unexplained"]
        return None if left is None else read(Unexplained, left)

    @cached_property
    def channels(self) -> dict[str, ChannelFit]:
        """Held-out differences of every compared channel."""
        return read(dict[str, ChannelFit], self._data["fit"]["channels"])

    @cached_property
    def heldout_loss(self) -> StageLoss:
        """Loss over all channels on held-out data, which took part in no choice."""
        return read(StageLoss, self._data["heldout_loss"])

    @cached_property
    def training_loss(self) -> StageLoss:
        """The same over the data that were fitted, by which physics was chosen."""
        return read(StageLoss, self._data["training_loss"])

    @cached_property
    def rigs(self) -> dict[str, Rig]:
        """Diagnosed rig of every bench: what `rig.diagnosed.toml` holds."""
        return {name: Rig._of(native) for name, native in self._native.rigs()}

    @property
    def rig(self) -> Rig:
        """The diagnosed rig.

        Raises:
            InputError: The study has several benches; take one of `rigs`.
        """
        if len(self.rigs) != 1:
            message = f"{len(self.rigs)} benches have a rig each; take one of rigs: {', '.join(self.rigs)}"
            raise InputError(message, hint="take one of rigs")
        return next(iter(self.rigs.values()))

    @cached_property
    def traces(self) -> dict[str, Trace]:
        """Measured and simulated over time, by channel, for the first recording."""
        return {trace[0]: Trace(*trace) for trace in self._native.traces()}

    def to_dict(self) -> dict[str, Any]:
        """The content of `diagnosis.json` (`bowden-diagnosis/1`)."""
        copied: dict[str, Any] = json.loads(self.to_json())
        return copied

    def to_json(self) -> str:
        """The text of `diagnosis.json`, equal to what `bowden diagnose` writes."""
        return self._native.json

    def report(self, path: str | os.PathLike[str]) -> pathlib.Path:
        """Writes the report, one self-contained HTML file; it appears under its name only when it is complete.

        Raises:
            InputError: The folder of `path` does not exist.
        """
        self._native.report(path)
        return pathlib.Path(path)

    def save(self, folder: str | os.PathLike[str]) -> pathlib.Path:
        """Writes `diagnosis.json`, `report.html`, the diagnosed rigs and references of experiments worth doing; returns the report."""
        return pathlib.Path(self._native.save(folder))

    def __str__(self) -> str:
        return self.summary

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict!r}, effects={[effect.id for effect in self.effects]})"

    def _repr_markdown_(self) -> str:
        lines = [f"**{self.verdict}**: {self.summary}"]
        if self.effects:
            lines += ["", "| effect | part | probability | parameters | reduction of held-out loss |", "|---|---|---|---|---|"]
        for effect in self.effects:
            parameters = ", ".join(f"{name} {estimate}" for name, estimate in effect.parameters.items())
            share = f"{effect.heldout_improvement:.0%}"
            name = f"{effect.id} ({effect.bench})" if effect.bench else effect.id
            lines.append(f"| {name} | {effect.component} | {effect.probability:.2f} | {parameters} | {share} |")
        for law in self.laws:
            values = ", ".join(f"{name} = {estimate}" for name, estimate in law.coefficients.items())
            lines += ["", f"`{law.port} = {law.formula}` with {values}"]
        for tried in self.hypotheses:
            values = ", ".join(f"{name} = {estimate}" for name, estimate in tried.coefficients.items())
            lines += ["", f"{tried.sentence} With {values}."]
        return "\n".join(lines)
