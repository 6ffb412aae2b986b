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


def _one(recording: str, path: str, bench: str, rig: str | None, program: str) -> tuple[str | None, str | None]:
    """Result, or why there is none; runs on a worker. The caller would take a result of another `bowden` than its own for undone."""
    if _bowden.survey_program() != program:
        return None, f"{path}: `bowden` on the worker is another version than that of the caller; install the same package on all machines"
    try:
        return _bowden.survey_one(recording, path, bench, rig), None
    except Error as error:
        return None, error.message
    except (KeyboardInterrupt, SystemExit):
        # How Ray ends a task.
        raise
    except BaseException as error:  # A panic of the native part is no Exception, and its class cannot be sent.
        return None, f"{path}: {_line(error)}, a fault of bowden and not of the recording; report it with the recording and the rig file"


def _line(error: BaseException) -> str:
    """Class and message in one line; of a message that holds a traceback, as Ray's of a missing package does, what was raised there."""
    text = f"{type(error).__name__}: {error}".strip()
    if "Traceback (most recent call last)" in text:
        text = text.splitlines()[-1]
    return " ".join(text.split())


def _why_none(error: Any, path: str, kinds: Any) -> str:
    """Why Ray has no result: what a task raised, crashes of its workers, or what hinders Ray; `kinds` is `ray.exceptions`."""
    if isinstance(error, kinds.RayTaskError):
        # `str` of Ray's own error is the traceback on the worker.
        return f"{path}: its task failed on the worker ({_line(getattr(error, 'cause', None) or error)}); correct what is installed there"
    # These come only after all attempts.
    if isinstance(error, (kinds.WorkerCrashedError, kinds.NodeDiedError)):
        lost = f"its worker was lost {_RETRIES + 1} times ({type(error).__name__})"
        return f"{path}: {lost}; diagnose it alone, and see the memory and the log of the workers"
    return f"{path}: Ray could not run its task ({_line(error)}); see the log of the cluster"


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
    program = _bowden.survey_program()
    remote: Any = ray.remote(num_cpus=1, max_retries=_RETRIES)(_one)
    failed: list[tuple[str, str]] = []
    done: set[str] = set()
    running: dict[Any, tuple[str, str]] = {}
    waiting = iter(pending)
    # Ray has types, but none for this.
    cluster: Any = ray
    most = max(1, int(_AHEAD * cluster.cluster_resources().get("CPU", 1)))
    try:
        while True:
            while len(running) < most and (task := next(waiting, None)) is not None:
                recording, path, bench, rig = task
                # Whole paths: a worker's own folder is another one.
                whole, of = os.path.abspath(path), None if rig is None else os.path.abspath(rig)
                running[remote.remote(recording, whole, bench, of, program)] = recording, str(path)
            if not running:
                break
            ended, _ = ray.wait(list(running), num_returns=1)
            for reference in ended:
                recording, file = running.pop(reference)
                try:
                    result, reason = ray.get(reference)
                except ray.exceptions.RayError as error:
                    result, reason = None, _why_none(error, file, ray.exceptions)
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
    # Tasks end in any order; the failures are those of a single process, which has them in the order of the recordings.
    places = {recording: place for place, (recording, *_) in enumerate(pending)}
    failed.sort(key=lambda one: places[one[0]])
    left = _left(pending, done, failed)
    plan.summarise(failed, left)
    return len(done), len(plan) - len(pending), len(left), failed
