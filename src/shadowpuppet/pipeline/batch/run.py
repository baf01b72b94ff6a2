"""A batch from beginning to end: what is missing is done, what fails is tried again, and all that came of it is told."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shadowpuppet.errors import SettingsError, ShadowPuppetError, reason, shown
from shadowpuppet.io.files.plain import for_toml
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.run import versions
from shadowpuppet.pipeline.batch.grid import PLAIN, Case, Grid
from shadowpuppet.pipeline.batch.summary import BatchRun, check_table, done_run, found_runs, write_summary
from shadowpuppet.pipeline.batch.task import PART, PLAN, RUNS
from shadowpuppet.pipeline.batch.tasks import Task, Track, make_tasks
from shadowpuppet.pipeline.batch.workers import Alone, BatchListener, Crew, Outcome, Processes
from shadowpuppet.threads import usable_cores

LOCK, FAILURES = ".lock", "failed"
"""The file that is held while a batch is at work; the folder that gets what programmers want to know of runs that failed of a bug."""


@dataclass(frozen=True, eq=False)
class Batch:
    """A batch that came to its end."""

    folder: Path
    runs: tuple[BatchRun, ...]
    """In the order of recordings, cases and seeds."""

    @property
    def failed(self) -> list[BatchRun]:
        """Those that failed."""
        return [run for run in self.runs if run.status != "done"]

    def of(self, recording: str | None = None, case: str | None = None, **varied: Any) -> list[BatchRun]:
        """The runs that are done of a recording's name, a case, and values of settings (`particles=200`: by the end of their name)."""
        return [run for run in self.runs if run.status == "done" and recording in (None, run.task.name) and case in (None, run.task.case)
                and varied.items() <= {name.rpartition(".")[2]: value for name, value in run.task.varied.items()}.items()]


def run_batch(recordings: Sequence[str | Path], out: str | Path, grid: Grid | None = None, seeds: Sequence[int] | None = None, *,
              workers: int | None = None, retries: int = 1, threads: int = 1, scheduler: str | None = None, reuse: bool = True,
              table: str = "csv", listener: BatchListener | None = None, track: Track | None = None) -> Batch:
    """Track recordings with all settings of a grid (`make_grid`, `read_grid`) and all seeds; a run folder each in `out`/runs.

    `seeds` holds over those of the grid; with neither there is one, 0. `workers`: processes, if left out one a core; 0 for none but
    this. `threads`: that each may use. `retries`: how often a run is tried again that failed of its machine: a worker that was killed, a
    full disk; what cannot be used is not. `scheduler`: address of a Dask cluster, whose workers do it. `reuse`: runs of the same film
    take the survey and silhouettes of the one before, with the same result; leave it out to measure speed. `table`: csv or parquet.
    `track`: what makes a run folder, in place of `track_recording` and called as that is: a function of a module that the workers have too.

    Runs that `out` has already are not done again: those of the same recording, settings and seed. A run that fails does not stop the
    others. Raises a `ShadowPuppetError` where nothing can be begun; `KeyboardInterrupt` goes on after the summary was written.
    """
    listener, out = listener or BatchListener(), Path(out).resolve()
    check_table(table)
    for name, number, least in (("workers", workers, 0), ("retries", retries, 0), ("threads", threads, 1)):
        if number is not None and not least <= number <= 1000:
            raise SettingsError(f"{name}: found {shown(number)}, expected {least} to 1000")
    grid = grid or Grid((Case(PLAIN, {}, {}),))
    chosen = tuple(seeds) if seeds is not None else grid.seeds or (0,)
    tasks = make_tasks(recordings, grid.cases, chosen, track)
    with _claimed(out):
        count = workers if workers is not None else usable_cores()
        work = _Work(out, tasks, listener, retries)
        _forget_failures(out)
        _write_plan(out, tasks, chosen)
        try:
            if work.todo:
                with _crew(out, scheduler, min(count, len(work.todo)), threads, reuse, listener) as crew:
                    work.all(crew)
        except KeyboardInterrupt:
            done = sum(run.status == "done" for run in _told(work, table).runs)
            raise KeyboardInterrupt(f"{done} of {len(tasks)} runs are done and in {out}; the same command does the rest") from None
        except BaseException:
            _told(work, table)
            raise
        return _told(work, table)


def _told(work: _Work, table: str) -> Batch:
    """What there is now, with its summary."""
    _clean(work.out)
    batch = Batch(work.out, work.runs())
    write_summary(batch.runs, work.out / f"summary.{table}")
    return batch


class _Work:
    """Tasks, and what came of them."""

    def __init__(self, out: Path, tasks: Sequence[Task], listener: BatchListener, retries: int) -> None:
        self.out, self.tasks, self.listener, self.retries = out, tasks, listener, retries
        self.tries, self.failed = Counter[str](), dict[str, Outcome]()
        found = found_runs(out)
        self.todo = [task for task in tasks if task.id not in found]
        self._tell_of(found)

    def _tell_of(self, found: Mapping[str, tuple[Path, Mapping[str, Any]]]) -> None:
        """Say what of an earlier start is in the way of being misread."""
        others, ours = found.keys() - {task.id for task in self.tasks}, [found[t.id][1] for t in self.tasks if t.id in found]
        if others:
            self.listener.note(f"{self.out}: {len(others)} of its runs are of other recordings, settings or seeds than now: they stay, and "
                               "are not in the summary")
        old = {str(mark.get("version")) for mark in ours} - {versions().get("shadowpuppet")}
        if old:
            self.listener.note(f"{self.out}: some of its runs were made by shadowpuppet {', '.join(sorted(old))}, not by this one; take a "
                               "new folder to make them again")

    def all(self, crew: Crew) -> None:
        """Do what is to be done."""
        self.listener.begin(len(self.tasks), len(self.tasks) - len(self.todo))
        for task in self.todo:
            crew.put(task)
        left = len(self.todo)
        while left:
            task, outcome = crew.next()
            self.tries[task.id] += 1
            again = outcome["status"] != "done" and outcome["again"] and self.tries[task.id] <= self.retries
            self.listener.ended(task, outcome, again)
            if again:
                crew.put(task)
                continue
            left -= 1
            if outcome["status"] != "done":
                self._fail(task, outcome)

    def _fail(self, task: Task, outcome: Outcome) -> None:
        self.failed[task.id] = outcome
        if outcome.get("trace"):
            with contextlib.suppress(ShadowPuppetError, OSError):  # a full disk is no reason to stop
                (self.out / FAILURES).mkdir(exist_ok=True)
                write_whole(self.out / FAILURES / f"{task.folder}.txt", outcome["trace"])

    def runs(self) -> tuple[BatchRun, ...]:
        """What there is of each task."""
        found = found_runs(self.out)
        return tuple(self._run(task, found) for task in self.tasks)

    def _run(self, task: Task, found: Mapping[str, tuple[Path, Mapping[str, Any]]]) -> BatchRun:
        tries = self.tries[task.id] or None
        if task.id in found:
            return done_run(task, *found[task.id], tries)
        if task.id not in self.failed:
            return BatchRun(task, "missing", tries=tries)
        outcome = self.failed[task.id]
        return BatchRun(task, "failed", None, outcome["seconds"], tries, outcome["message"])


def _crew(out: Path, scheduler: str | None, workers: int, threads: int, reuse: bool, listener: BatchListener) -> Crew:
    if scheduler is not None:
        from shadowpuppet.pipeline.batch.cluster import Cluster

        return Cluster(scheduler, out, f"{time.time():.6f}", reuse, listener)
    return Processes(out, workers, threads, reuse, listener) if workers else Alone(out, reuse, listener)


@contextlib.contextmanager
def _claimed(out: Path) -> Iterator[None]:
    """A folder for this batch alone. Raises `ShadowPuppetError` for one that has other files in it, or another batch at work."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        names = sorted({path.name for path in out.iterdir()} - {RUNS, LOCK})
        if names and PLAN not in names:
            raise ShadowPuppetError(f"{out}: found {shorten(names, 60)} in it but no {PLAN}, expected a new or empty folder, or that of an "
                                    "earlier batch, which goes on")
        (out / RUNS).mkdir(exist_ok=True)
        lock = (out / LOCK).open("w")
    except OSError as error:
        raise ShadowPuppetError(f"{out}: cannot be written ({reason(error)})") from None
    with lock:
        _lock(lock.fileno(), out)
        _clean(out)
        yield


def _lock(file: int, out: Path) -> None:
    """Hold a file as long as it is open, where the system knows how."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ShadowPuppetError(f"{out}: found another batch at work in it, expected a folder for each; wait, or choose another") from None
    except OSError:
        return  # a file system without locks


def _clean(out: Path) -> None:
    """Remove what is left of runs that were broken off."""
    for path in (out / RUNS).glob(f".*{PART}"):
        shutil.rmtree(path, ignore_errors=True)


def _forget_failures(out: Path) -> None:
    """Remove what an earlier start told of failures: they are begun anew."""
    with contextlib.suppress(OSError):
        for path in (out / FAILURES).glob("*.txt"):
            path.unlink()
        (out / FAILURES).rmdir()


def _write_plan(out: Path, tasks: Sequence[Task], seeds: Sequence[int]) -> None:
    """What was asked for at the last start, for people."""
    import tomli_w

    cases = {(task.case, str(task.varied)): {"case": task.case, "settings": for_toml(task.varied)} for task in tasks}
    said = {"batch": 1, "started": time.strftime("%Y-%m-%d %H:%M:%S"), "runs": len(tasks),
            "recordings": list(dict.fromkeys(task.recording for task in tasks)), "seeds": list(seeds), "versions": versions(),
            "choices": list(cases.values())}  # fmt: skip
    write_whole(out / PLAN, tomli_w.dumps(said))
