"""Pools that run the tasks of a batch on this machine: worker processes, each for many tasks, or this process itself."""

from __future__ import annotations

import contextlib
import json
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from abc import ABC, abstractmethod
from collections import deque
from pathlib import Path
from typing import Any, Self

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.batch.tasks import Task
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.threads import THREAD_VARIABLES, child_environment

Outcome = dict[str, Any]
"""Result of `batch.task.do` for a task."""
GRACE = 2.0
"""Seconds after which a terminated worker that has not ended is killed."""


class BatchListener:
    """Progress of a batch. Every method does nothing: override those of interest."""

    def begin(self, total: int, before: int) -> None:
        """The batch begins: `before` of its `total` runs were done by an earlier start."""

    def working(self, worker: int, task: Task, doing: str, frames: int, total: int | None) -> None:
        """Worker number `worker` is `looking` or `tracking`: `frames` of `total`."""

    def resting(self, worker: int) -> None:
        """A worker has no task."""

    def ended(self, task: Task, outcome: Outcome, again: bool) -> None:
        """A task is done or failed; `again`: it will be tried again."""

    def note(self, message: str) -> None:
        """A message for the user."""


class WorkerPool(ABC):
    """Runs tasks: `with pool: pool.put(task); task, outcome = pool.next()`."""

    def __enter__(self) -> Self:
        """Prepare the pool. Raises `ShadowPuppetError` if that fails."""
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027 - there may be nothing to do
        """Stop at once, even during tasks."""

    @abstractmethod
    def put(self, task: Task) -> None:
        """Add a task."""

    @abstractmethod
    def next(self) -> tuple[Task, Outcome]:
        """Wait for the next task that is done or failed."""


class InProcess(WorkerPool):
    """Runs tasks one after another in this process."""

    def __init__(self, out: Path, reuse: bool, listener: BatchListener) -> None:
        """`out`: the batch's folder; `reuse`: keep a film's silhouettes for the next task."""
        self._out, self._cache, self._listener = out, SilhouetteCache() if reuse else None, listener
        self._waiting: deque[Task] = deque()

    def put(self, task: Task) -> None:
        """Add a task."""
        self._waiting.append(task)

    def next(self) -> tuple[Task, Outcome]:
        """Run the next task."""
        from shadowpuppet.pipeline.batch.task import do

        task = self._waiting.popleft()
        return task, do(task.wire(), self._out, self._cache, _TaskListener(self._listener, task))


class _TaskListener(Listener):
    """Passes a run's progress on to the batch's listener."""

    def __init__(self, listener: BatchListener, task: Task) -> None:
        self._working, self._task, self._total = listener.working, task, None

    def begin(self, what: str, total: int | None = None) -> None:
        self._total = total
        self._working(0, self._task, what, 0, total)

    def advance(self, frames: int) -> None:
        self._working(0, self._task, "tracking", frames, self._total)


class _Worker:
    """A worker process (`batch.worker`) and its current task. A thread puts its messages into the pool's queue, and None when it ends."""

    def __init__(self, number: int, out: Path, threads: int, messages: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]]) -> None:
        self.number, self.film = number, ""
        self.task: Task | None = None
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `stop`
        self.process = subprocess.Popen([sys.executable, "-P", "-m", "shadowpuppet.pipeline.batch.worker", str(out)], text=True,
                                        encoding="utf-8", env=child_environment(dict.fromkeys(THREAD_VARIABLES, str(threads))),
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors)
        threading.Thread(target=self._listen, args=(messages,), daemon=True).start()

    def give(self, task: Task, reuse: bool) -> None:
        """Send a task. If the process has ended, the queue gets None from it."""
        self.task, self.film = task, task.film
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(json.dumps(task.wire() | {"reuse": reuse}) + "\n")
            self.process.stdin.flush()

    def stop(self) -> str:
        """Wait for a process that was terminated or has ended, and close its files. Returns why it ended, in words."""
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        try:
            code = self.process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        with self.errors as file:
            file.seek(0)
            lines = file.read()[-2000:].decode("utf-8", "replace").strip().splitlines()
        with contextlib.suppress(ValueError):  # no known signal
            name = signal.Signals(-code).name
            return f"its worker was killed ({name}{', as by a machine that ran out of memory' if name == 'SIGKILL' else ''})"
        return f"its worker ended with code {code}" + (f": {lines[-1].strip()}" if lines else "")

    def _listen(self, messages: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]]) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            for line in lines:
                with contextlib.suppress(ValueError):  # an incomplete line of a killed process
                    messages.put((self, json.loads(line)))
        messages.put((self, None))


class LocalProcesses(WorkerPool):
    """Worker processes on this machine. A worker preferably gets tasks of the film for which it keeps silhouettes.

    No library's pool is used. That of loky, which needs no extra, starts helper processes that import modules from the user's current
    folder, loses the output of a process that failed to start, and ends all workers if one is killed, unless each worker is a pool.
    """

    def __init__(self, out: Path, workers: int, threads: int, reuse: bool, listener: BatchListener) -> None:
        """`workers`: greatest number of processes; `threads`: number of threads of each; the others as in `InProcess`."""
        self._count, self._out, self._threads, self._reuse, self._listener = workers, out, threads, reuse, listener
        self._messages: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]] = queue.SimpleQueue()
        self._workers: list[_Worker] = []
        self._waiting: dict[str, deque[Task]] = {}
        """Tasks not yet given to a worker, by film."""
        self._ready = False
        """Whether any worker has begun."""

    def __exit__(self, *_: object) -> None:
        """Stop all workers."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.stop()

    def put(self, task: Task) -> None:
        """Add a task, after those of its film."""
        self._waiting.setdefault(task.film, deque()).append(task)

    def next(self) -> tuple[Task, Outcome]:
        """Wait for a task's outcome, or for the end of its worker."""
        while True:
            self._hand_out()
            try:
                worker, message = self._messages.get(timeout=1.0)  # on some systems a wait without timeout cannot be interrupted
            except queue.Empty:
                continue
            task = worker.task
            if message is None:
                self._workers.remove(worker)
                why = worker.stop()
                if not self._ready:
                    raise ShadowPuppetError(f"batch: no worker can be started: {why}")
                if task is not None:
                    return task, {"status": "failed", "message": why, "again": True, "seconds": None}
            elif "ready" in message:
                self._ready = True
            elif task is not None and "outcome" in message:
                worker.task = None
                self._listener.resting(worker.number)
                return task, message["outcome"]
            elif task is not None:
                self._listener.working(worker.number, task, **message)

    def _hand_out(self) -> None:
        """Give each idle worker a task, and start workers while there are more tasks."""
        numbers = sorted(set(range(self._count)) - {worker.number for worker in self._workers})
        for worker in [one for one in self._workers if one.task is None] + numbers:
            if not any(self._waiting.values()):
                return
            if isinstance(worker, int):
                worker = _Worker(worker, self._out, self._threads, self._messages)
                self._workers.append(worker)
            worker.give(self._choose(worker.film), self._reuse)

    def _choose(self, film: str) -> Task:
        """The next task: of `film`, else of a film that no worker is working on, else of the film with the most tasks left."""
        self._waiting = {name: tasks for name, tasks in self._waiting.items() if tasks}
        taken = {worker.film for worker in self._workers if worker.task is not None}
        free = [name for name in self._waiting if name not in taken]
        most = max(self._waiting, key=lambda name: len(self._waiting[name]))
        return self._waiting[film if film in self._waiting else free[0] if free else most].popleft()
