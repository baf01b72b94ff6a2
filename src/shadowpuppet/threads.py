"""Numbers of threads: one for linear algebra, and at most the process's limit in all."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Generic, TypeVar, overload

T = TypeVar("T")
THREADS_VARIABLE = "SHADOWPUPPET_THREADS"
"""Environment variable: cores that a process may use, where several share a machine."""
THREAD_VARIABLES = (THREADS_VARIABLE, *(f"{library}_NUM_THREADS" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")),
                    "VECLIB_MAXIMUM_THREADS")
"""Environment variables that libraries read when they are loaded."""


def child_environment(variables: Mapping[str, str]) -> dict[str, str]:
    """Environment of a Python process that imports from the same folders as this one, with `variables` set. Start the process with `-P`,
    or else modules of the current folder come first."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    return {**os.environ, "PYTHONPATH": path, "PYTHONUTF8": "1", **variables}


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context in which BLAS uses one thread. Our matrices are small: more threads gain nothing, and on busy cores their waiting for one
    another made the program seven times slower."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield


@contextmanager
def one_opencv_thread() -> Iterator[None]:
    """Context in which OpenCV uses one thread. Where each core has a film of its own, sharing out every picture among them costs a sixth of
    the time."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def thread_limit() -> int | None:
    """The number of threads that this process is limited to; None without a limit."""
    value = os.environ.get(THREADS_VARIABLE, "")
    return int(value) if value.isdecimal() and int(value) else None


def usable_cores() -> int:
    """Processor cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, thread_limit() or cores)


def limit_threads() -> None:
    """Apply the limit to OpenCV, which reads no variable; other libraries read it when they were loaded."""
    if (limit := thread_limit()) is not None:
        import cv2

        cv2.setNumThreads(limit)


def shared_out(work: Callable[[T], object], items: Iterable[T]) -> None:
    """Call `work` with each item, on the calling thread and on as many others as there are cores. It is worth it where `work` takes a
    tenth of a millisecond or more without the GIL."""
    items = list(items)
    if (cores := usable_cores()) < 2 or len(items) < 2:
        for item in items:
            work(item)
        return
    begun = [(_pool(cores - 1).submit(work, item), item) for item in items]
    for future, item in reversed(begun):  # the last ones are taken back while others do the first
        if future.cancel():
            work(item)
        else:
            future.result()


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "shared")


PARTS = 4
"""Most parts of `in_parts`, and least number of items in one of several."""


def in_parts(number: int) -> list[slice]:
    """A number of items in parts for `shared_out`; the same on every machine, so that results that depend on them are, too."""
    parts = max(1, min(PARTS, number // PARTS))
    return [slice(number * n // parts, number * (n + 1) // parts) for n in range(parts)]


class MadeOnDemand(Sequence[T], Generic[T]):
    """A sequence whose items are made at the first request by number. Iterating makes them all, on several cores."""

    def __init__(self, make: Callable[[int], T], count: int) -> None:
        """Of `count` items; `make` gives the one of a number."""
        self._make: Callable[[int], T] | None = make
        self._count, self._items = count, dict[int, T]()

    def __len__(self) -> int:
        """The number of items, made or not."""
        return self._count

    @overload
    def __getitem__(self, n: int) -> T: ...
    @overload
    def __getitem__(self, n: slice) -> Sequence[T]: ...
    def __getitem__(self, n: int | slice) -> T | Sequence[T]:
        """Item `n`, made if need be; of a slice, all of its items."""
        if isinstance(n, slice):
            return self.several(range(self._count)[n])
        n = range(self._count)[n]
        if n not in self._items and (make := self._make) is not None:
            self._items[n] = make(n)
            if len(self._items) == self._count:
                self._make = None  # and with it their sources
        return self._items[n]

    def __iter__(self) -> Iterator[T]:
        """All items, in order."""
        return iter(self.several(range(self._count)))

    def several(self, which: Iterable[int]) -> list[T]:
        """The items of some numbers, made on several cores."""
        with ThreadPoolExecutor(usable_cores(), "made") as pool:
            return list(pool.map(self.__getitem__, which))
