"""Progress of long work, and how many threads do it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bowden.errors import InputError

__all__ = ["ProgressLike"]

ProgressLike = bool | Callable[[str, int, int], object]
"""True: a bar of tqdm. False: nothing. A function: called with the stage's name, the steps done and all steps (0: not known)."""


def threads(jobs: int | None) -> int | None:
    """Checks a number of threads."""
    if jobs is not None and not 1 <= jobs <= 1024:
        message = f"jobs: got {jobs}, allowed 1 to 1024; change it"
        raise InputError(message, hint="change it")
    return jobs


@contextmanager
def watching(progress: ProgressLike) -> Iterator[Callable[[str, int, int], object] | None]:
    """What is to be called with stage, steps done and all steps, while the work runs."""
    if not isinstance(progress, bool):
        yield progress
        return
    if not progress:
        yield None
        return
    from tqdm.auto import tqdm

    # No bar for what is done at once, none left behind when the work is over.
    with tqdm(delay=0.5, leave=False, file=sys.stderr, dynamic_ncols=True) as bar:
        shown = ""

        def watcher(stage: str, done: int, steps: int) -> None:
            nonlocal shown
            if stage != shown:
                shown = stage
                bar.reset(total=steps or None)
                bar.set_description(stage, refresh=False)
            bar.total = steps or None
            bar.n = done
            bar.refresh()

        yield watcher


