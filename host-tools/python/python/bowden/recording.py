"""Recordings: a table with one row a sample."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bowden import _bowden
from bowden.errors import InputError
from bowden.rig import RigLike, as_rig

if TYPE_CHECKING:
    import pandas
    import polars

__all__ = ["UNITS", "Frame", "Recording", "RecordingLike"]

UNITS: dict[str, str] = dict(_bowden.channels())
"""Unit of every channel that a recording may hold."""


@runtime_checkable
class Frame(Protocol):
    """A table with named columns: `pandas.DataFrame`, `polars.DataFrame`, and what behaves like them."""

    @property
    def columns(self) -> Any:
        """Names of the columns."""

    def __getitem__(self, name: Any, /) -> Any: ...


class Recording:
    """Time `t_s`, s, strictly increasing, and channels, one value a sample, SI. A recording never changes.

    Its arrays are views of its memory: `recording["theta_out_rad"]` copies nothing and cannot be written to.
    """

    __slots__ = ("_native",)
    _native: _bowden.NativeRecording

    def __init__(self) -> None:
        raise TypeError("a recording is made by Recording.load, Recording.from_arrays or Recording.from_frame")

    @classmethod
    def _of(cls, native: _bowden.NativeRecording) -> Recording:
        recording = cls.__new__(cls)
        recording._native = native
        return recording

    @classmethod
    def load(cls, path: str | os.PathLike[str], rig: RigLike | None = None) -> Recording:
        """Reads CSV, gzipped CSV, MCAP or Parquet; the content decides which.

        Args:
            path: The file.
            rig: Says which column of the file has which role, where names or units are others than those of bowden.

        Raises:
            InputError: With file, line and what to do: no `t_s`, time that runs backwards, a cell that is no finite number ...
        """
        native_rig = None if rig is None else as_rig(rig)._native
        return cls._of(_bowden.NativeRecording.load(path, native_rig))

    @classmethod
    def from_arrays(cls, columns: Mapping[str, ArrayLike], rig: RigLike | None = None, source: str = "arrays") -> Recording:
        """A recording of arrays of equal length, shape `(samples,)`; `t_s` in s is among them.

        Integers and other floats become float64. What is kept is a copy, so that later changes of the arrays reach no work that runs.

        Args:
            columns: Arrays by name. Names without a role are passed over.
            rig: Maps names and units, as for a file.
            source: Name in messages.

        Raises:
            InputError: Shapes that differ, NaN, time that runs backwards (the message names the sample), a role without numbers.
        """
        believed = None if rig is None else as_rig(rig)
        wanted = {"t_s", *UNITS} | (set(believed.columns.values()) if believed else set())
        given = [(str(name), _floats(name, values, source) if name in wanted else None) for name, values in columns.items()]
        return cls._of(_bowden.NativeRecording.from_columns(source, given, believed._native if believed else None))

    @classmethod
    def from_frame(cls, frame: Frame, rig: RigLike | None = None, source: str = "frame") -> Recording:
        """A recording of a data frame, of pandas or polars; see `from_arrays`."""
        return cls.from_arrays({str(name): frame[name] for name in frame.columns}, rig, source)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `.csv`, `.csv.gz`, `.mcap` or `.parquet`; numbers read back bit for bit."""
        self._native.save(path)

    @property
    def source(self) -> str:
        """File name, or what made the recording."""
        return self._native.source

    @property
    def t_s(self) -> NDArray[np.float64]:
        """Time, s, shape `(samples,)`; a view that cannot be written to."""
        return self._native.t_s

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that were recorded."""
        return tuple(self._native.channels)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def notes(self) -> tuple[str, ...]:
        """What was lost or repaired when it was read, one line each."""
        return tuple(self._native.notes)

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """Values of a channel, shape `(samples,)`, in the unit that its name ends in; a view that cannot be written to."""
        values = self.t_s if channel == "t_s" else self._native.channel(channel)
        if values is None:
            raise KeyError(f"{channel}; {self.source} has {', '.join(self.channels)}")
        return values

    def __contains__(self, channel: object) -> bool:
        return channel in self.channels

    def __len__(self) -> int:
        return len(self._native)

    def to_arrays(self) -> dict[str, NDArray[np.float64]]:
        """`t_s` and all channels as views, by name."""
        return {name: self[name] for name in ("t_s", *self.channels)}

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas frame of `t_s` and all channels."""
        import pandas

        return pandas.DataFrame(self.to_arrays())

    def to_polars(self) -> polars.DataFrame:
        """A polars frame of `t_s` and all channels."""
        import polars

        return polars.DataFrame(self.to_arrays())

    def __repr__(self) -> str:
        return f"Recording({self.source!r}, {len(self)} samples, {self.duration_s:g} s, {', '.join(self.channels)})"

    def __reduce__(self) -> tuple[object, tuple[dict[str, NDArray[np.float64]], str]]:
        return _unpickled, (self.to_arrays(), self.source)


def _unpickled(columns: dict[str, NDArray[np.float64]], source: str) -> Recording:
    return Recording.from_arrays(columns, source=source)


RecordingLike = Recording | Frame | Mapping[str, ArrayLike] | str | os.PathLike[str]
"""A recording, a data frame, arrays by name, or the path of a file."""


def as_recording(recording: RecordingLike, rig: RigLike, source: str = "recording") -> Recording:
    """The recording, read or made where it is something else."""
    if isinstance(recording, Recording):
        return recording
    if isinstance(recording, str | os.PathLike):
        return Recording.load(recording, rig)
    if isinstance(recording, Mapping):
        return Recording.from_arrays(recording, rig, source)
    if isinstance(recording, Frame):
        return Recording.from_frame(recording, rig, source)
    got = type(recording).__name__
    message = f"{source}: got {got}, expected a Recording, a path, a data frame or arrays by name; convert it"
    raise InputError(message, source, hint="convert it")


def is_one(recordings: RecordingLike | Iterable[RecordingLike]) -> TypeGuard[RecordingLike]:
    """Whether this is one recording and not several."""
    return isinstance(recordings, Recording | str | os.PathLike | Mapping | Frame)


def _floats(name: str, values: ArrayLike, source: str) -> NDArray[np.float64] | None:
    """Values as a contiguous array of float64; `None` for what holds no numbers."""
    array = np.asarray(values)
    if array.ndim != 1:
        message = f"{source}: column `{name}`: got shape {array.shape}, expected one value a sample; pass one column"
        raise InputError(message, source, hint="pass one column")
    if array.dtype.kind not in "fiub":
        message = f"{source}: column `{name}`: got dtype {array.dtype}, expected numbers in SI units; convert it"
        raise InputError(message, source, hint="convert it")
    return np.ascontiguousarray(array, dtype=np.float64)
