"""Parallel runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from multiprocessing import get_context
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from shadowpuppet.errors import ShadowPuppetError

Job = TypeVar("Job")
Result = TypeVar("Result")


def run_all(what: str, task: Callable[[Job], Result], jobs: Sequence[Job], workers: int = 1) -> list[Result]:
    """Results of `task` for every job, in order; `what` labels the progress bar.

    With several workers, in spawned processes of one thread each: `task` must be a function of a module, jobs and results must be
    picklable and small. Raises what a task raises, and `ShadowPuppetError` where a process is killed.
    """
    with shown_progress() as progress:
        bar = progress.add_task(what, total=len(jobs))
        if workers <= 1 or len(jobs) <= 1:
            return [_counted(progress, bar, task(job)) for job in jobs]
        waiting: list[Future[Result]] = []
        try:  # a process may be killed before the last job is handed over
            for job in jobs:
                waiting.append(_pool(workers).submit(task, job))
            for done in as_completed(waiting):
                _counted(progress, bar, done.result())
            return [done.result() for done in waiting]
        except BrokenProcessPool:  # the pool itself ends the jobs that are left: one that is cancelled meanwhile is an error in its thread
            _pool.cache_clear()
            raise ShadowPuppetError(f"{what}: a process was killed (is there enough memory?); try again with fewer --workers") from None
        except BaseException:
            for left in waiting:
                left.cancel()
            raise


@lru_cache(maxsize=1)
def _pool(workers: int) -> ProcessPoolExecutor:
    """Processes, kept for the next call: each takes seconds to start."""
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_one_thread)


def _one_thread() -> None:
    """Limit a process to one thread."""
    import cv2
    from threadpoolctl import threadpool_limits

    cv2.setNumThreads(1)
    threadpool_limits(1)


def shown_progress() -> Progress:
    """A progress bar, shown on a terminal only."""
    console = Console(stderr=True)
    return Progress(TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(), TimeRemainingColumn(), console=console,
                    transient=True, disable=not console.is_terminal)


def _counted(progress: Progress, bar: TaskID, result: Result) -> Result:
    progress.advance(bar)
    return result
