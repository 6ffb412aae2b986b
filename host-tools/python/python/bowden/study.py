"""Studies: recordings of one or several benches that are explained together."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bowden import _bowden
from bowden.errors import InputError
from bowden.recording import Recording, RecordingLike, as_recording, is_one
from bowden.rig import Rig, RigLike, as_rig

__all__ = ["Study", "StudyRecording"]


@dataclass(frozen=True)
class StudyRecording:
    """A recording of a study."""

    recording: Recording
    """The samples."""
    bench: str
    """Name of its bench."""
    heldout: bool
    """Whether it is held out: it evaluates the result and takes no part in fit and search."""


class Study:
    """Benches, and what was recorded of each.

    ```python
    study = bowden.Study("two tools")
    study.add_bench("left", "left.toml", own=["tendon.pretension_n"])
    study.add_recording("left-1.csv", bench="left")
    study.add_recording("left-2.csv", bench="left", heldout=True, set={"load.mass_kg": 2.0})
    ```
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._benches: list[tuple[str, Rig, list[str]]] = []
        self._recordings: list[tuple[Recording, str, bool, list[tuple[str, float]]]] = []
        self._loaded: _bowden.NativeStudy | None = None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """Reads a study file (`bowden-study/1`) with its rigs and recordings.

        Raises:
            InputError: With file, line, column and what to do.
        """
        native = _bowden.NativeStudy.load(path)
        study = cls(native.name)
        study._loaded = native
        return study

    @property
    def name(self) -> str:
        """Name in reports."""
        return self._name

    @property
    def benches(self) -> dict[str, Rig]:
        """Rig of every bench."""
        if self._loaded is not None:
            names = self._loaded.benches
            return {name: Rig._of(self._loaded.rig(index)) for index, name in enumerate(names)}
        return {name: rig for name, rig, _ in self._benches}

    @property
    def recordings(self) -> tuple[StudyRecording, ...]:
        """Recordings to learn from, then those that are held out."""
        if self._loaded is not None:
            return tuple(StudyRecording(Recording._of(of), bench, held) for of, bench, held in self._loaded.recordings)
        listed = sorted(self._recordings, key=lambda recording: recording[2])
        return tuple(StudyRecording(recording, bench, held) for recording, bench, held, _ in listed)

    def add_bench(self, name: str, rig: RigLike, own: Iterable[str] = ()) -> None:
        """Adds a bench; `own` are parameters with a value of their own on it, all others are shared between benches."""
        self._refuse_if_loaded()
        self._benches.append((name, as_rig(rig), list(own)))

    def add_recording(
        self,
        recording: RecordingLike,
        *,
        bench: str | None = None,
        heldout: bool = False,
        set: Mapping[str, float] | None = None,
    ) -> None:
        """Adds a recording.

        Args:
            recording: A recording, a path, a data frame or arrays by name.
            bench: Which bench it is of; may be left out where there is one.
            heldout: It evaluates the result and takes no part in fit and search.
            set: What was different in it: `{"load.mass_kg": 2.0}`.
        """
        self._refuse_if_loaded()
        if bench is None:
            if len(self._benches) != 1:
                message = f"study `{self._name}`: {len(self._benches)} benches; say with bench= which one was recorded"
                raise InputError(message, hint="say with bench= which one was recorded")
            bench = self._benches[0][0]
        rigs = [rig for name, rig, _ in self._benches if name == bench]
        if not rigs:
            message = f"study `{self._name}`: no bench `{bench}`; add it first"
            raise InputError(message, hint="add it first")
        source = f"recording {len(self._recordings)}"
        given = [(path, float(value)) for path, value in (set or {}).items()]
        self._recordings.append((as_recording(recording, rigs[0], source), bench, heldout, given))

    def _refuse_if_loaded(self) -> None:
        if self._loaded is not None:
            message = f"study `{self._name}`: it was read from a file, which lists its recordings; add it there"
            raise InputError(message, hint="add it there")

    def _native(self) -> _bowden.NativeStudy:
        if self._loaded is not None:
            return self._loaded
        benches = [(name, rig._native, own) for name, rig, own in self._benches]
        recordings = [(recording._native, bench, held, given) for recording, bench, held, given in self._recordings]
        return _bowden.NativeStudy(self._name, benches, recordings)

    def __repr__(self) -> str:
        held = sum(recording.heldout for recording in self.recordings)
        return f"Study({self._name!r}, {len(self.benches)} benches, {len(self.recordings)} recordings, {held} held out)"


def as_study(
    recordings: Study | RecordingLike | Iterable[RecordingLike],
    rig: RigLike | None,
    heldout: RecordingLike | Iterable[RecordingLike],
) -> Study:
    """The study that the arguments of `diagnose` and `fit` describe."""
    held_out = [heldout] if is_one(heldout) else list(heldout)  # type: ignore[arg-type]
    if isinstance(recordings, str | os.PathLike) and os.fspath(recordings).lower().endswith(".toml"):
        recordings = Study.load(recordings)
    if isinstance(recordings, Study):
        if rig is not None or held_out:
            message = "a study names its rigs and recordings itself; leave out rig and heldout"
            raise InputError(message, hint="leave out rig and heldout")
        return recordings
    if rig is None:
        raise InputError("no rig; name it with rig=, or give a study", hint="name it with rig=, or give a study")
    believed = as_rig(rig)
    training = [recordings] if is_one(recordings) else list(recordings)  # type: ignore[arg-type]
    for one in held_out:
        if isinstance(one, str | os.PathLike):
            others = [other for other in training if isinstance(other, str | os.PathLike)]
            same = any(os.path.realpath(one) == os.path.realpath(other) for other in others)
        else:
            same = any(one is other for other in training)
        if same:
            what = os.fspath(one) if isinstance(one, str | os.PathLike) else "a recording"
            message = f"{what}: given as training and as held out; a held-out recording must not be a training recording"
            raise InputError(message, what, hint="a held-out recording must not be a training recording")
    study = Study(believed.name)
    study.add_bench("bench", believed)
    for recording in training:
        study.add_recording(recording)
    for recording in held_out:
        study.add_recording(recording, heldout=True)
    return study
