"""Surveys on a Ray cluster: one recording a task, results kept as they come."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bowden import _bowden
from bowden.errors import Error, InputError

__all__: list[str] = []

_RETRIES = 3
"""Times that a recording is begun anew when its worker dies; one that takes its worker along every time has failed."""

_AHEAD = 4
"""Tasks that are handed to Ray for every processor of the cluster: enough that none waits, few beside 100 000."""

_Task = tuple[str, Path, str, Path | None]
"""Recording, its file, bench, rig file."""

_Watcher = Callable[[str, int, int], object]


def _one(recording: str, path: str, bench: str, rig: str | None) -> tuple[str | None, str | None]:
    """Result, or why there is none; runs on a worker."""
    try:
        return _bowden.survey_one(recording, path, bench, rig), None
    except Error as error:
        return None, error.message


def _left(pending: list[_Task], done: set[str], failed: list[tuple[str, str]]) -> set[str]:
    """Recordings of which nothing is known yet."""
    return {recording for recording, *_ in pending} - done - {recording for recording, _ in failed}


def survey_on_ray(
    plan: _bowden.NativePlan, watcher: _Watcher | None
) -> tuple[int, int, int, list[tuple[str, str]]]:
    """Diagnoses what is not done; numbers of diagnosed, kept and left recordings, and the failures."""
    try:
        import ray
    except ImportError as error:
        message = 'engine "ray" needs Ray; pip install ray'
        raise InputError(message, hint="pip install ray") from error
    if not ray.is_initialized():
        ray.init(include_dashboard=False, log_to_driver=False)
    pending = plan.pending()
    remote: Any = ray.remote(num_cpus=1, max_retries=_RETRIES)(_one)
    failed: list[tuple[str, str]] = []
    done: set[str] = set()
    running: dict[Any, str] = {}
    waiting = iter(pending)
    # Ray has types, but none for this.
    cluster: Any = ray
    most = max(1, int(_AHEAD * cluster.cluster_resources().get("CPU", 1)))
    try:
        while True:
            while len(running) < most and (task := next(waiting, None)) is not None:
                recording, path, bench, rig = task
                # Whole paths: a worker's own folder is another one.
                where = os.path.abspath(path), bench, None if rig is None else os.path.abspath(rig)
                running[remote.remote(recording, *where)] = recording
            if not running:
                break
            ended, _ = ray.wait(list(running), num_returns=1)
            for reference in ended:
                recording = running.pop(reference)
                try:
                    result, reason = ray.get(reference)
                except ray.exceptions.RayError as error:
                    result, reason = None, f"its worker was lost {_RETRIES + 1} times: {type(error).__name__}"
                if result is None:
                    failed.append((recording, reason))
                else:
                    plan.keep(result)
                    done.add(recording)
            if plan.is_due(len(plan) - len(pending) + len(done) + len(failed), len(failed)):
                plan.summarise(failed, _left(pending, done, failed))
            if watcher is not None:
                watcher("diagnosing recordings", len(done) + len(failed), len(pending))
    except KeyboardInterrupt:
        for reference in running:
            ray.cancel(reference, force=True)
    left = _left(pending, done, failed)
    plan.summarise(failed, left)
    return len(done), len(plan) - len(pending), len(left), failed
