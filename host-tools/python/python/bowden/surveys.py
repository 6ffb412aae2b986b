"""Surveys: every recording of a folder is diagnosed by itself, and the benches are put side by side."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bowden import _bowden
from bowden.errors import InputError, RepairedWarning, StoppedEarlyWarning
from bowden.progress import ProgressLike, threads, watching

__all__ = ["Survey", "survey"]


@dataclass(frozen=True)
class Survey:
    """What became of a survey, and where its tables are."""

    folder: Path
    page: Path
    """One self-contained HTML page: which bench drifts, which effect is where, since when."""
    diagnosed: int
    """Recordings that were diagnosed now."""
    kept: int
    """Recordings whose result was there already."""
    left: int
    """Recordings that are still to be done, after Ctrl-C; the same call goes on with them."""
    failed: dict[str, str]
    """Recordings that could not be diagnosed, and why."""

    @property
    def tables(self) -> dict[str, Path]:
        """Parquet files by what a row is: `recordings`, `effects`, `parameters`, `drifts`."""
        return {name: self.folder / f"{name}.parquet" for name in ("recordings", "effects", "parameters", "drifts")}


def survey(
    folder: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    rig: str | os.PathLike[str] | Mapping[str, str | os.PathLike[str]] | None = None,
    engine: Literal["local", "ray"] = "local",
    progress: ProgressLike = True,
    jobs: int | None = None,
) -> Survey:
    """Diagnoses every recording of a folder (`.csv`, `.csv.gz`, `.mcap`, `.parquet`) that is not done yet; each folder below is a bench of its own.

    A recording that cannot be diagnosed stops no other one: it stands in `failed`, and a `RepairedWarning` says why. Results are kept one
    file a recording, so that the same call goes on after it was ended.

    Args:
        folder: The recordings.
        out: Folder for results, tables and page.
        rig: Rig file for all recordings, or rig files by folder below; without it the nearest `rig.toml` beside or above a recording.
        engine: `"local"`: the processors of this machine. `"ray"`: one recording a task on the Ray cluster that this process is connected
            to, or on a local one; the folders have to be seen by all its machines under the same path. Results are equal bit for bit.
        progress: Shows a bar on stderr; or a function, see `ProgressLike`.
        jobs: Recordings at a time on this machine; by default as many as there are processors that this process may
            use. Ray decides itself.

    Raises:
        InputError: No folder, no recording, or none of them could be diagnosed.
    """
    if engine not in ("local", "ray"):
        message = f"engine: got {engine!r}, expected 'local' or 'ray'; take one of them"
        raise InputError(message, hint="take one of them")
    rules: list[tuple[str, str | os.PathLike[str]]]
    if rig is None:
        rules = []
    elif isinstance(rig, Mapping):
        rules = list(rig.items())
    else:
        rules = [("", rig)]
    plan = _bowden.NativePlan(folder, rules, out)
    at_once = threads(jobs)
    with watching(progress) as watcher:
        if engine == "ray":
            from bowden.on_ray import survey_on_ray

            diagnosed, kept, left, failed = survey_on_ray(plan, watcher)
        else:
            diagnosed, kept, left, failed = plan.survey(watcher, at_once)
    for recording, message in failed:
        warnings.warn(f"{recording} failed: {message}", RepairedWarning, stacklevel=2)
    if left:
        reason = f"stopped early: {left} recordings are left; the same call goes on with them"
        warnings.warn(reason, StoppedEarlyWarning, stacklevel=2)
    return Survey(Path(out), Path(_bowden.survey_page(out)), diagnosed, kept, left, dict(failed))
