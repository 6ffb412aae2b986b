"""What is done with recordings and rigs."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from bowden import _bowden
from bowden.diagnosis import Diagnosis
from bowden.errors import InputError, RepairedWarning, StoppedEarlyWarning
from bowden.hypothesis import Hypothesis
from bowden.progress import ProgressLike, threads, watching
from bowden.recording import Recording, RecordingLike, as_recording
from bowden.results import ChannelError, FittedParameter, read
from bowden.rig import Rig, RigLike, as_rig
from bowden.study import Study, as_study

__all__ = ["Fit", "Motion", "diagnose", "fit", "replay", "simulate"]

Motion = Literal["lab", "sine", "triangle", "multisine", "staircase", "rest"]
"""A built-in motion of the reference."""


@dataclass(frozen=True)
class Fit:
    """Nominal parameters as they fit, and what the recordings leave open."""

    parameters: tuple[FittedParameter, ...]
    channels: tuple[ChannelError, ...]
    """Differences between recordings and replays, before and after."""
    groups: tuple[str, ...]
    """Products of parameters of which the recordings determine the product only."""
    unseen: tuple[str, ...]
    """Parameters on which the recordings say nothing."""
    rigs: dict[str, Rig]
    """Fitted rig of every bench."""

    @property
    def rig(self) -> Rig:
        """The fitted rig of the only bench.

        Raises:
            InputError: There are several; take one of `rigs`.
        """
        if len(self.rigs) != 1:
            message = f"{len(self.rigs)} benches have a rig each; take one of rigs: {', '.join(self.rigs)}"
            raise InputError(message, hint="take one of rigs")
        return next(iter(self.rigs.values()))


def diagnose(
    recordings: Study | RecordingLike | Iterable[RecordingLike],
    rig: RigLike | None = None,
    *,
    heldout: RecordingLike | Iterable[RecordingLike] = (),
    also: Iterable[str] = (),
    hypotheses: Iterable[Hypothesis] = (),
    progress: ProgressLike = True,
    jobs: int | None = None,
) -> Diagnosis:
    """Finds which physics a rig's simulation lacks, and proves it on data that the fit has not seen.

    ```python
    d = bowden.diagnose(["train.csv"], rig="rig.toml", heldout=["other.csv"])
    ```

    The interpreter stays free while it runs. Ctrl-C ends the search: the result then holds what was found (`complete` is false), and a
    `StoppedEarlyWarning` says so.

    Args:
        recordings: Recordings to learn from (paths, `Recording`s, data frames, arrays by name), a `Study`, or the path of a study file.
        rig: What is believed about the bench: a `Rig` or a path. A study names its own.
        heldout: Recordings that evaluate the diagnosis and take no part in fit and search; without them every third second of the others is
            held out.
        also: Effects to be tried that are tried on request only.
        hypotheses: Functions of your own, as further terms of the search; `Diagnosis.hypotheses` says what each does.
        progress: Shows a bar on stderr; or a function, see `ProgressLike`.
        jobs: Threads to work with; one a processor by default.

    Raises:
        InputError: Unusable input, with file, line and what to do; a hypothesis whose function raised an exception (its cause).
    """
    stated = [hypothesis._native for hypothesis in hypotheses]
    study = as_study(recordings, rig, heldout)._native()
    _warn(study.notes)
    with watching(progress) as watcher:
        diagnosis = Diagnosis(_bowden.diagnose(study, list(also), stated, watcher, threads(jobs)))
    if not diagnosis.complete:
        reason = "stopped early: not every effect was tried; run it again to the end before trusting it"
        warnings.warn(reason, StoppedEarlyWarning, stacklevel=2)
    return diagnosis


def fit(
    recordings: Study | RecordingLike | Iterable[RecordingLike],
    rig: RigLike | None = None,
    *,
    progress: ProgressLike = True,
    jobs: int | None = None,
) -> Fit:
    """Recalibrates the nominal parameters of a rig to recordings; adds no physics. Arguments as for `diagnose`."""
    study = as_study(recordings, rig, ())._native()
    _warn(study.notes)
    with watching(progress) as watcher:
        text, rigs = _bowden.fit(study, watcher, threads(jobs))
    said = json.loads(text)
    return Fit(
        parameters=read(tuple[FittedParameter, ...], said["parameters"]),
        channels=read(tuple[ChannelError, ...], said["channels"]),
        groups=tuple(said["groups"]),
        unseen=tuple(said["unseen"]),
        rigs={name: Rig._of(native) for name, native in zip(study.benches, rigs, strict=True)},
    )


def replay(recording: RecordingLike, rig: RigLike, *, set: Mapping[str, float] | None = None) -> Recording:
    """What the rig's simulation answers to a recording's inputs: every output channel, one value a recorded sample.

    Args:
        recording: Whose inputs drive the simulation; nothing else of it is used.
        rig: The rig.
        set: What is different in this recording: `{"load.mass_kg": 2.0}`.
    """
    believed = as_rig(rig)
    if set:
        believed = believed.with_values(set)
    predicted = Recording._of(_bowden.replay(believed._native, as_recording(recording, believed)._native))
    _warn(predicted.notes)
    return predicted


def simulate(
    rig: RigLike,
    *,
    motion: Motion = "lab",
    reference: Recording | tuple[ArrayLike, ArrayLike] | None = None,
    seconds: float | None = None,
    rate_hz: float = 1000.0,
    seed: int = 0,
) -> Recording:
    """A full forward run: reference, position loop, motor, joint, sensors. Equal arguments give equal recordings, bit for bit.

    Args:
        rig: A rig with a motor.
        motion: Built-in motion of the reference.
        reference: In place of it a recording with `theta_ref_rad`, or times, s, and angles, rad, of shape `(samples,)`.
        seconds: Length, s, 0.01 to 36 000; 40 by default, or as long as the reference.
        rate_hz: Samples a second, 1 to 100 000.
        seed: Seed of the motion and of the sensors' noise.
    """
    pair = None
    if reference is not None:
        t_s, theta_rad = (reference.t_s, reference["theta_ref_rad"]) if isinstance(reference, Recording) else reference
        made = Recording.from_arrays({"t_s": t_s, "theta_ref_rad": theta_rad}, source="reference")
        pair = (made.t_s, made["theta_ref_rad"])
        seconds = made.duration_s if seconds is None else seconds
    seconds = 40.0 if seconds is None else float(seconds)
    for name, value, lower, upper, unit in (
        ("seconds", seconds, 0.01, 36_000.0, "s"),
        ("rate_hz", rate_hz, 1.0, 100_000.0, "Hz"),
        ("seed", seed, 0, 2**64 - 1, ""),
    ):
        if not lower <= value <= upper:
            message = f"{name}: got {value}, allowed {lower} to {upper} {unit}".rstrip()
            raise InputError(f"{message}; change it", hint="change it")
    return Recording._of(_bowden.simulate(as_rig(rig)._native, motion, pair, seconds, float(rate_hz), int(seed)))


def _warn(notes: Iterable[str]) -> None:
    for note in notes:
        warnings.warn(note, RepairedWarning, stacklevel=3)
