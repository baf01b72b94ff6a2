"""Runs a batch: runs missing tasks, repeats failed ones, and writes a summary of all runs."""

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
from shadowpuppet.io.files.lock import LOCK, locked
from shadowpuppet.io.files.plain import for_toml
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.run_writer import versions
from shadowpuppet.pipeline.batch.grid import DEFAULT_CASE, Case, Grid
from shadowpuppet.pipeline.batch.summary import BatchRun, check_table, done_run, found_runs, write_summary
from shadowpuppet.pipeline.batch.task import PART, PLAN, RUNS
from shadowpuppet.pipeline.batch.tasks import Task, Track, make_tasks
from shadowpuppet.pipeline.batch.workers import BatchListener, InProcess, LocalProcesses, Outcome, WorkerPool
from shadowpuppet.threads import usable_cores

FAILURES = "failed"
"""Folder of tracebacks of runs that failed because of a bug."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Result of a batch."""

    folder: Path
    runs: tuple[BatchRun, ...]
    """All runs, in the order of recordings, cases and seeds."""

    @property
    def failed(self) -> list[BatchRun]:
        """Runs that failed or are missing."""
        return [run for run in self.runs if run.status != "done"]

    def of(self, recording: str | None = None, case: str | None = None, **varied: Any) -> list[BatchRun]:
        """Finished runs of a recording's name, a case, and values of settings by the last part of their names (`particles=200`)."""
        return [run for run in self.runs if run.status == "done" and recording in (None, run.task.name) and case in (None, run.task.case)
                and varied.items() <= {name.rpartition(".")[2]: value for name, value in run.task.varied.items()}.items()]


def run_batch(recordings: Sequence[str | Path], out: str | Path, grid: Grid | None = None, seeds: Sequence[int] | None = None, *,
              workers: int | None = None, retries: int = 1, threads: int = 1, scheduler: str | None = None, reuse: bool = True,
              table: str = "csv", listener: BatchListener | None = None, track: Track | None = None) -> Batch:
    """Track recordings with all settings of a grid (`make_grid`, `read_grid`) and all seeds; writes run folders in `out`/runs.

    Args:
        seeds: override the grid's seeds; without either, the seed is 0.
        workers: number of processes, by default one per core; 0 runs all tasks in this process.
        threads: number of threads of each process.
        retries: further tries of a run that failed because of its machine (a killed worker, a full disk).
        scheduler: address of a Dask cluster; its workers then run the tasks.
        reuse: keep a film's survey and silhouettes for its next run; the result is the same. Off to measure speed.
        table: csv or parquet.
        track: replaces `track_recording`; takes the same arguments, and is in a module that the workers can import.

    Complete runs in `out` with the same recording, settings and seed are kept. A run that fails does not stop the others. Raises
    `ShadowPuppetError` if the batch cannot begin, and `KeyboardInterrupt` on Ctrl-C after the summary is written.
    """
    listener, out = listener or BatchListener(), Path(out).resolve()
    check_table(table)
    for name, number, least in (("workers", workers, 0), ("retries", retries, 0), ("threads", threads, 1)):
        if number is not None and not least <= number <= 1000:
            raise SettingsError(f"{name}: found {shown(number)}, expected {least} to 1000")
    grid = grid or Grid((Case(DEFAULT_CASE, {}, {}),))
    chosen = tuple(seeds) if seeds is not None else grid.seeds or (0,)
    tasks = make_tasks(recordings, grid.cases, chosen, track)
    with _claimed(out):
        count = workers if workers is not None else usable_cores()
        work = _Work(out, tasks, listener, retries)
        _forget_failures(out)
        _write_plan(out, tasks, chosen)
        try:
            if work.todo:
                with _pool(out, scheduler, min(count, len(work.todo)), threads, reuse, listener) as pool:
                    work.all(pool)
        except KeyboardInterrupt:
            done = sum(run.status == "done" for run in _summarised(work, table).runs)
            raise KeyboardInterrupt(f"{done} of {len(tasks)} runs are done and in {out}; the same command does the rest") from None
        except BaseException:
            _summarised(work, table)
            raise
        return _summarised(work, table)


def _summarised(work: _Work, table: str) -> Batch:
    """The batch's present state; writes the summary."""
    _clean(work.out)
    batch = Batch(work.out, work.runs())
    write_summary(batch.runs, work.out / f"summary.{table}")
    return batch


class _Work:
    """The tasks of a batch, and their outcomes."""

    def __init__(self, out: Path, tasks: Sequence[Task], listener: BatchListener, retries: int) -> None:
        self.out, self.tasks, self.listener, self.retries = out, tasks, listener, retries
        self.tries, self.failed = Counter[str](), dict[str, Outcome]()
        found = found_runs(out)
        self.todo = [task for task in tasks if task.id not in found]
        self._note_others(found)

    def _note_others(self, found: Mapping[str, tuple[Path, Mapping[str, Any]]]) -> None:
        """Note runs of other tasks, or of another version, in the folder."""
        others, ours = found.keys() - {task.id for task in self.tasks}, [found[t.id][1] for t in self.tasks if t.id in found]
        if others:
            self.listener.note(f"{self.out}: {len(others)} of its runs are of other recordings, settings or seeds than now: they stay, and "
                               "are not in the summary")
        old = {str(mark.get("version")) for mark in ours} - {versions().get("shadowpuppet")}
        if old:
            self.listener.note(f"{self.out}: some of its runs were made by shadowpuppet {', '.join(sorted(old))}, not by this one; take a "
                               "new folder to make them again")

    def all(self, pool: WorkerPool) -> None:
        """Run all tasks that are to be done."""
        self.listener.begin(len(self.tasks), len(self.tasks) - len(self.todo))
        for task in self.todo:
            pool.put(task)
        left = len(self.todo)
        while left:
            task, outcome = pool.next()
            self.tries[task.id] += 1
            again = outcome["status"] != "done" and outcome["again"] and self.tries[task.id] <= self.retries
            self.listener.ended(task, outcome, again)
            if again:
                pool.put(task)
                continue
            left -= 1
            if outcome["status"] != "done":
                self._fail(task, outcome)

    def _fail(self, task: Task, outcome: Outcome) -> None:
        self.failed[task.id] = outcome
        if outcome.get("trace"):
            with contextlib.suppress(ShadowPuppetError, OSError):  # a full disk does not stop the batch
                (self.out / FAILURES).mkdir(exist_ok=True)
                write_whole(self.out / FAILURES / f"{task.folder}.txt", outcome["trace"])

    def runs(self) -> tuple[BatchRun, ...]:
        """The run of each task; its status is `missing` if there is none."""
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


def _pool(out: Path, scheduler: str | None, workers: int, threads: int, reuse: bool, listener: BatchListener) -> WorkerPool:
    if scheduler is not None:
        from shadowpuppet.pipeline.batch.cluster import Cluster

        return Cluster(scheduler, out, f"{time.time():.6f}", reuse, listener)
    return LocalProcesses(out, workers, threads, reuse, listener) if workers else InProcess(out, reuse, listener)


@contextlib.contextmanager
def _claimed(out: Path) -> Iterator[None]:
    """Lock the folder for this batch. Raises `ShadowPuppetError` if it contains other files, or another batch works there."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        names = sorted({path.name for path in out.iterdir()} - {RUNS, LOCK})
        if names and PLAN not in names:
            raise ShadowPuppetError(f"{out}: found {shorten(names, 60)} in it but no {PLAN}, expected a new or empty folder, or that of an "
                                    "earlier batch, which goes on")
        (out / RUNS).mkdir(exist_ok=True)
    except OSError as error:
        raise ShadowPuppetError(f"{out}: cannot be written ({reason(error)})") from None
    with locked(out, "batch"):
        _clean(out)
        yield


def _clean(out: Path) -> None:
    """Remove unfinished run folders."""
    for path in (out / RUNS).glob(f".*{PART}"):
        shutil.rmtree(path, ignore_errors=True)


def _forget_failures(out: Path) -> None:
    """Remove an earlier start's tracebacks."""
    with contextlib.suppress(OSError):
        for path in (out / FAILURES).glob("*.txt"):
            path.unlink()
        (out / FAILURES).rmdir()


def _write_plan(out: Path, tasks: Sequence[Task], seeds: Sequence[int]) -> None:
    """Write the batch's recordings, settings and seeds to the file `PLAN`, for people to read."""
    import tomli_w

    cases = {(task.case, str(task.varied)): {"case": task.case, "settings": for_toml(task.varied)} for task in tasks}
    said = {"batch": 1, "started": time.strftime("%Y-%m-%d %H:%M:%S"), "runs": len(tasks),
            "recordings": list(dict.fromkeys(task.recording for task in tasks)), "seeds": list(seeds), "versions": versions(),
            "choices": list(cases.values())}  # fmt: skip
    write_whole(out / PLAN, tomli_w.dumps(said))
