"""Who does the tasks on this machine: worker processes, each begun afresh, which stay for the next task; or this process itself."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections import deque
from pathlib import Path
from typing import Any, Protocol, Self

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.batch.tasks import Task
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.threads import POOLS

Outcome = dict[str, Any]
"""What came of a task, as `batch.task.do` tells it."""
GRACE = 2.0
"""Seconds that a worker which is told to end is waited for."""


class BatchListener:
    """Is told how a batch goes, and does nothing: derive from it."""

    def begin(self, total: int, before: int) -> None:
        """Of `total` runs `before` were done when it began."""

    def working(self, worker: int, task: Task, doing: str, frames: int, total: int | None) -> None:
        """A worker is at a task: `looking` or `tracking`, so many of its frames."""

    def resting(self, worker: int) -> None:
        """A worker has nothing to do any more."""

    def ended(self, task: Task, outcome: Outcome, again: bool) -> None:
        """A task is done, or failed; `again`: it is tried once more."""

    def note(self, message: str) -> None:
        """Something that is to be known."""


class Crew(Protocol):
    """Does tasks: `with crew: crew.put(task); task, outcome = crew.next()`."""

    def __enter__(self) -> Self:
        """Be ready. Raises a `ShadowPuppetError` where that cannot be."""
        ...

    def __exit__(self, *_: object) -> None:
        """Stop at once, whatever is being done."""
        ...

    def put(self, task: Task) -> None:
        """One more to be done."""
        ...

    def next(self) -> tuple[Task, Outcome]:
        """Wait for the next that is done or failed."""
        ...


class Alone:
    """Does tasks one after another in this process."""

    def __init__(self, out: Path, reuse: bool, listener: BatchListener) -> None:
        """`out`: the batch's folder; `reuse`: keep silhouettes for the next task."""
        self._out, self._repeats, self._listener = out, SilhouetteCache() if reuse else None, listener
        self._waiting: deque[Task] = deque()

    def __enter__(self) -> Self:
        """Nothing is to be done."""
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is to be done."""

    def put(self, task: Task) -> None:
        """One more."""
        self._waiting.append(task)

    def next(self) -> tuple[Task, Outcome]:
        """Do one."""
        from shadowpuppet.pipeline.batch.task import do

        task = self._waiting.popleft()
        return task, do(task.wire(), self._out, self._repeats, _Told(self._listener, task))


class _Told(Listener):
    """Tells a batch's listener what the run's is told."""

    def __init__(self, listener: BatchListener, task: Task) -> None:
        self._tell, self._task, self._total = listener.working, task, None

    def begin(self, what: str, total: int | None = None) -> None:
        self._total = total
        self._tell(0, self._task, what, 0, total)

    def advance(self, frames: int) -> None:
        self._tell(0, self._task, "tracking", frames, self._total)


class _Worker:
    """A process, and what it is at."""

    def __init__(self, number: int, out: Path, threads: int, said: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]]) -> None:
        self.number, self.task, self.film = number, None, ""
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `stop`
        path = os.pathsep.join([str(Path(__file__).parents[3]), *(entry or os.getcwd() for entry in sys.path)])
        environment = os.environ | dict.fromkeys(POOLS, str(threads)) | {"PYTHONPATH": path, "PYTHONUTF8": "1"}
        self.process = subprocess.Popen([sys.executable, "-P", "-m", "shadowpuppet.pipeline.batch.worker", str(out)], env=environment,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, text=True, encoding="utf-8")
        threading.Thread(target=self._listen, args=(said,), daemon=True).start()

    task: Task | None
    film: str
    """The last task's, whose silhouettes it keeps."""

    def give(self, task: Task, reuse: bool) -> None:
        """A task to be done; where the process is gone, its end is told as that of any."""
        self.task, self.film = task, task.film
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(json.dumps(task.wire() | {"reuse": reuse}) + "\n")
            self.process.stdin.flush()

    def end(self) -> str:
        """Why it ended, in words."""
        code = self.process.wait()
        if code < 0:
            with contextlib.suppress(ValueError):
                name = signal.Signals(-code).name
                guess = ", as by a machine that ran out of memory" if name == "SIGKILL" else ""
                return f"its worker was killed ({name}{guess})"
        self.errors.seek(0)
        lines = self.errors.read()[-2000:].decode("utf-8", "replace").strip().splitlines()
        return f"its worker ended with code {code}" + (f": {lines[-1].strip()}" if lines else "")

    def stop(self) -> None:
        """Close what is open; the process has ended, or is about to."""
        for stream in (self.process.stdin, self.errors):
            with contextlib.suppress(OSError, ValueError):
                stream.close()  # pyright: ignore[reportOptionalMemberAccess]
        try:
            self.process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _listen(self, said: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]]) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            for line in lines:
                with contextlib.suppress(ValueError):  # half a line of one that was killed
                    said.put((self, json.loads(line)))
        said.put((self, None))


class Processes:
    """Worker processes on this machine. A task goes to a worker that has its film's silhouettes, where one does."""

    def __init__(self, out: Path, workers: int, threads: int, reuse: bool, listener: BatchListener) -> None:
        """`threads`: that each may use; the others as in `Alone`."""
        self._count = workers
        self._out, self._threads, self._reuse, self._listener = out, threads, reuse, listener
        self._said: queue.SimpleQueue[tuple[_Worker, dict[str, Any] | None]] = queue.SimpleQueue()
        self._workers: list[_Worker] = []
        self._waiting: dict[str, deque[Task]] = {}
        self._begun = False

    def __enter__(self) -> Self:
        """Nobody is hired before there is a task."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.stop()

    def put(self, task: Task) -> None:
        """One more, after those of its film."""
        self._waiting.setdefault(task.film, deque()).append(task)

    def next(self) -> tuple[Task, Outcome]:
        """Wait for one."""
        while True:
            self._hand_out()
            try:
                worker, said = self._said.get(timeout=1.0)  # a wait without end cannot be interrupted everywhere
            except queue.Empty:
                continue
            task = worker.task
            if said is None:
                self._workers.remove(worker)
                why = worker.end()
                worker.stop()
                if not self._begun:
                    raise ShadowPuppetError(f"batch: no worker can be started: {why}")
                if task is not None:
                    return task, {"status": "failed", "message": why, "again": True, "seconds": None}
            elif "ready" in said:
                self._begun = True
            elif task is not None and "outcome" in said:
                worker.task = None
                self._listener.resting(worker.number)
                return task, said["outcome"]
            elif task is not None:
                self._listener.working(worker.number, task, said["doing"], said["frames"], said["total"])

    def _hand_out(self) -> None:
        """Give every idle worker a task, and hire where there are more tasks than workers."""
        for worker in self._workers:
            if worker.task is None and any(self._waiting.values()):
                worker.give(self._choose(worker.film), self._reuse)
        while len(self._workers) < self._count and any(self._waiting.values()):
            numbers = {worker.number for worker in self._workers}
            worker = _Worker(min(n for n in range(self._count) if n not in numbers), self._out, self._threads, self._said)
            self._workers.append(worker)
            worker.give(self._choose(""), self._reuse)

    def _choose(self, film: str) -> Task:
        """The next of a worker's film; else of one that no worker has; else of that with most left."""
        self._waiting = {name: tasks for name, tasks in self._waiting.items() if tasks}
        taken = {worker.film for worker in self._workers if worker.task is not None}
        free = [name for name in self._waiting if name not in taken]
        most = max(self._waiting, key=lambda name: len(self._waiting[name]))
        return self._waiting[film if film in self._waiting else free[0] if free else most].popleft()
