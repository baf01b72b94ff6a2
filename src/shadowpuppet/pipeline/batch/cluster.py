"""Runs tasks on the workers of a Dask cluster, also on other machines; needs the extra `batch`."""

from __future__ import annotations

import gc
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from shadowpuppet.errors import ShadowPuppetError, extra_command
from shadowpuppet.pipeline.batch.tasks import Task
from shadowpuppet.pipeline.batch.workers import BatchListener, Outcome, WorkerPool

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE = 20
"""Seconds that a scheduler may take to answer."""
_kept = threading.local()
"""Silhouette cache that a worker's thread keeps between tasks, and the start of the batch that it belongs to."""


def do_there(task: dict[str, Any], out: str, start: str, reuse: bool) -> Outcome:
    """Run a task on a worker of the cluster. `start` identifies the batch: between two batches recordings may have changed."""
    from shadowpuppet.pipeline.batch.task import do
    from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
    from shadowpuppet.threads import limit_threads

    limit_threads()
    if getattr(_kept, "start", None) != start:
        _kept.start, _kept.cache = start, SilhouetteCache()
    return do(task, out, _kept.cache if reuse else None)


class Cluster(WorkerPool):
    """Runs tasks on the workers of a Dask cluster, which must have this package and see the same files at the same paths."""

    def __init__(self, address: str, out: Path, start: str, reuse: bool, listener: BatchListener) -> None:
        """`address`: the scheduler's address or a scheduler file; `out`: the batch's folder; `start` as in `do_there`."""
        self._address, self._out, self._start, self._reuse, self._listener = address, out, start, reuse, listener
        self._tasks: dict[Future, Task] = {}
        self._tries: dict[str, int] = {}

    def __enter__(self) -> Self:
        """Connect to the scheduler."""
        try:
            from distributed import Client, as_completed
        except ImportError:
            raise ShadowPuppetError(f"scheduler: Dask's `distributed` is not installed; {extra_command('batch')}") from None
        file: dict[str, Any] = {("scheduler_file" if Path(self._address).is_file() else "address"): self._address}
        said = None
        try:
            self._client: Client = Client(**file, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            said = " ".join(str(error).split())
        if said is not None:
            # A client that found no scheduler is closed by its __del__, which takes the lock under which any later client begins its
            # loop: collected while one does, it stops the program for good. So it is collected here, where nothing holds the lock.
            gc.collect()
            raise ShadowPuppetError(f"scheduler: found {self._address!r}, at which no Dask scheduler answers ({said}); expected an address "
                                    "as tcp://host:8786, or a scheduler file")
        self._ended = as_completed(loop=self._client.loop)
        threads: Any = self._client.nthreads()  # by worker
        if any(count > 1 for count in threads.values()):
            self._listener.note("the cluster's workers have several threads each, of which mostly one runs: start them with --nthreads 1")
        return self

    def __exit__(self, *_: object) -> None:
        """Cancel tasks that are not done. A run that a worker has begun continues to its end, and the next start finds it."""
        if self._client.status == "running":
            self._client.cancel(list(self._tasks), force=True)
        self._client.close()

    def put(self, task: Task) -> None:
        """Add a task, for any free worker."""
        tried = self._tries[task.id] = self._tries.get(task.id, 0) + 1
        future = self._client.submit(do_there, task.wire(), str(self._out), self._start, self._reuse, pure=False,
                                     key=f"shadowpuppet-{self._start}-{task.id}-{tried}")
        self._tasks[future] = task
        self._ended.add(future)

    def next(self) -> tuple[Task, Outcome]:
        """Wait for the next task that is done or failed."""
        future = next(self._ended)
        task = self._tasks.pop(future)
        if future.status == "finished":
            return task, future.result()
        if future.status in ("cancelled", "lost"):
            raise ShadowPuppetError(f"scheduler: the connection to {self._address} was lost")
        error = future.exception()
        said = "its workers were lost, one after another: killed, or out of memory" if type(error).__name__ == "KilledWorker" else \
            f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
        return task, {"status": "failed", "message": said, "again": True, "seconds": None}
