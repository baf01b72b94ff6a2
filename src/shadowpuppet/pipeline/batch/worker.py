"""A worker process: `python -m shadowpuppet.pipeline.batch.worker OUT`. Tasks come as lines of JSON, and what comes of them goes so."""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TextIO

PACE = 0.25
"""Seconds between two messages about frames."""


def main() -> None:
    """Work until the standard input ends, as it does when whoever started this is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C goes to all; who started this ends it
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever else prints is not to be taken for a message
    tasks: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin, tasks), daemon=True).start()
    _work(sys.argv[1], tasks.get, lambda **said: _say(out, said))


def _listen(lines: TextIO, tasks: queue.SimpleQueue[dict[str, Any]]) -> None:
    for line in lines:
        tasks.put(json.loads(line))
    os._exit(0)  # at once, in the middle of a task


def _say(out: TextIO, said: dict[str, Any]) -> None:
    try:
        out.write(json.dumps(said) + "\n")
        out.flush()
    except OSError:
        os._exit(0)


def _work(folder: str, get: Callable[[], dict[str, Any]], say: Callable[..., None]) -> None:
    from shadowpuppet.pipeline.batch.task import do
    from shadowpuppet.pipeline.progress import Listener
    from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
    from shadowpuppet.threads import limit_threads

    class Tell(Listener):
        """Sends what a run says, now and then."""

        total, last = None, 0.0

        def begin(self, what: str, total: int | None = None) -> None:
            self.total = total
            say(doing=what, frames=0, total=total)

        def advance(self, frames: int) -> None:
            if (now := time.monotonic()) - self.last > PACE:
                self.last = now
                say(doing="tracking", frames=frames, total=self.total)

    limit_threads()
    repeats = SilhouetteCache()
    say(ready=os.getpid())
    while True:
        task = get()
        say(outcome=do(task, folder, repeats if task["reuse"] else None, Tell()))


if __name__ == "__main__":
    main()
