"""A worker process: `python -P -m shadowpuppet.pipeline.batch.worker OUT`. Tasks, progress and outcomes are lines of JSON."""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import time
from typing import Any

from shadowpuppet.pipeline.batch.task import do
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.threads import limit_threads

PACE = 0.25
"""Seconds between two messages about frames."""


class _Pipe(Listener):
    """Writes messages, including the progress of runs, to the pool; ends this process if the pool no longer reads them."""

    def __init__(self) -> None:
        self.out, self.total, self.last = os.fdopen(os.dup(1), "w", encoding="utf-8"), None, 0.0
        os.dup2(2, 1)  # other output must not be taken for messages

    def send(self, **message: Any) -> None:
        try:
            self.out.write(json.dumps(message) + "\n")
            self.out.flush()
        except OSError:
            os._exit(0)

    def begin(self, what: str, total: int | None = None) -> None:
        self.total = total
        self.send(doing=what, frames=0, total=total)

    def advance(self, frames: int) -> None:
        if (now := time.monotonic()) - self.last > PACE:
            self.last = now
            self.send(doing="tracking", frames=frames, total=self.total)


def _read(tasks: queue.SimpleQueue[dict[str, Any]]) -> None:
    """Read tasks; when standard input ends, as it does with the pool's process, end at once, also in the middle of a task."""
    for line in sys.stdin:
        tasks.put(json.loads(line))
    os._exit(0)


def main() -> None:
    """Run tasks until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C reaches all processes; the pool ends this one
    pipe, tasks, cache = _Pipe(), queue.SimpleQueue[dict[str, Any]](), SilhouetteCache()
    threading.Thread(target=_read, args=(tasks,), daemon=True).start()
    limit_threads()
    pipe.send(ready=True)
    while True:
        task = tasks.get()
        pipe.send(outcome=do(task, sys.argv[1], cache if task["reuse"] else None, pipe))


if __name__ == "__main__":
    main()
