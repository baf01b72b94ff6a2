"""How many threads work: one for linear algebra, and no more in all than a process is told."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

LIMIT = "SHADOWPUPPET_THREADS"
"""Environment variable: cores that a process may use, where several share a machine."""
POOLS = (LIMIT, "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables that libraries read when they are loaded."""


def child_environment(variables: Mapping[str, str]) -> dict[str, str]:
    """Environment of a Python process that imports from where this one does, with `variables` set. Start the process with `-P`, or else
    modules of the current folder come first."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    return {**os.environ, "PYTHONPATH": path, "PYTHONUTF8": "1", **variables}


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Inside, matrices are worked on by one thread.

    Ours are small: more threads gain nothing, and on busy cores they wait for one another, which took seven times the whole.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield


def thread_limit() -> int | None:
    """Threads that this process is told to keep to; None where it is not told."""
    told = os.environ.get(LIMIT, "")
    return int(told) if told.isdecimal() and int(told) else None


def usable_cores() -> int:
    """Processor cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, thread_limit() or cores)


def limit_threads() -> None:
    """Hold OpenCV, which reads no variable, to the limit; the others had it when they were loaded."""
    if (limit := thread_limit()) is not None:
        import cv2

        cv2.setNumThreads(limit)
