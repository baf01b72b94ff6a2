"""A batch as a terminal shows it: who is at what while it goes on, and what came of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic

import numpy as np
from rich.console import Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from shadowpuppet.cli.tables import pairs, plain_table
from shadowpuppet.cli.terminal import Terminal, terminal
from shadowpuppet.pipeline.batch.plot import MEASURES, measured, rows_of
from shadowpuppet.pipeline.batch.run import Batch
from shadowpuppet.pipeline.batch.summary import BatchRun
from shadowpuppet.pipeline.batch.tasks import Task
from shadowpuppet.pipeline.batch.workers import BatchListener, Outcome

LINES = 16
"""Workers that are shown."""
BAR = 30
"""Width of the bar, where there is room for it."""
PAUSE = 30.0
"""Seconds between two lines where there is no screen to show a table on."""


class BatchTerminal(BatchListener):
    """Shows a table on a terminal, a line now and then elsewhere; failures and notes as warnings."""

    def __init__(self, shown: Terminal) -> None:
        """`shown`: whose console and warnings are used."""
        self.total = self.done = self.failed = self.before = 0
        self._shown, self._at = shown, dict[int, tuple[str, str]]()
        self._began = self._last = monotonic()
        self._live = Live(console=shown.console, get_renderable=self._table, refresh_per_second=4, transient=True)

    def begin(self, total: int, before: int) -> None:
        """Show the table."""
        self.total, self.before, self._began = total, before, monotonic()
        if not self._shown.quiet and self._shown.console.is_terminal:
            self._live.start()
        if before and not self._shown.quiet:
            self._shown.console.print(f"{before} of {total} runs are done already", markup=False)

    def working(self, worker: int, task: Task, doing: str, frames: int, total: int | None) -> None:
        """Show where a worker is."""
        self._at[worker] = task.label, f"{doing} {frames}{f'/{total}' if total else ''}" if frames else doing

    def resting(self, worker: int) -> None:
        """Show it no more."""
        self._at.pop(worker, None)

    def ended(self, task: Task, outcome: Outcome, again: bool) -> None:
        """Count; say a failure that was not said before."""
        if outcome["status"] == "done":
            self.done += 1
        elif not again:
            self.failed += 1
            self._shown.warn(f"{task.name}: failed: {outcome['message']}")
        else:
            self._shown.warn(f"{task.label}: {outcome['message']}; it is tried again")
        if not self._live.is_started and not self._shown.quiet and monotonic() - self._last > PAUSE:
            self._last = monotonic()
            self._shown.console.print(self._counts(), markup=False)

    def note(self, message: str) -> None:
        """Say it."""
        self._shown.warn(message)

    def stop(self) -> None:
        """Take the table away."""
        self._live.stop()

    def failures(self, batch: Batch) -> None:
        """Name what failed, and why: a line for each reason."""
        reasons: dict[str, list[BatchRun]] = {}
        for run in batch.failed:
            reasons.setdefault(run.message, []).append(run)
        self.stop()
        for why, runs in reasons.items():
            more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
            self._shown.console.print(f"failed: {runs[0].task.label}{more}: {why}", markup=False, soft_wrap=True)
        if reasons:
            text = f"{len(batch.failed)} of {len(batch.runs)} runs failed; the same command tries them again"
            self._shown.console.print(text, markup=False)

    def _counts(self) -> str:
        left = self.total - self.before - self.done - self.failed
        pace = (self.done + self.failed) / max(monotonic() - self._began, 1e-9)
        failed = f", {self.failed} failed" if self.failed else ""
        until = f"  {_pace(pace)}, {_clock(left / pace)} left" if pace else ""
        return f"{self.before + self.done} of {self.total} runs done{failed}{until}"

    def _table(self) -> RenderableType:
        bar, workers = Table.grid(padding=(0, 2)), Table.grid(padding=(0, 2))
        counts = Text(self._counts(), no_wrap=True, overflow="ellipsis")
        room = self._shown.console.width - counts.cell_len - 2
        bar.add_row(ProgressBar(self.total, self.before + self.done + self.failed, width=min(max(room, 1), BAR)), counts)
        at = sorted(self._at.items())
        for number, (label, doing) in at[:LINES]:
            workers.add_row(Text(f"{number + 1:3}", style="dim"), Text(label, overflow="ellipsis", no_wrap=True), Text(doing, no_wrap=True))
        if len(at) > LINES:
            workers.add_row("", Text(f"and {len(at) - LINES} more"), "")
        if not (at or self.done or self.failed):
            workers.add_row("", Text("workers are starting"), "")
        return Group(workers, bar)


@contextmanager
def batch_terminal(quiet: bool) -> Iterator[BatchTerminal]:
    """A terminal to be told of a batch."""
    with terminal(quiet) as shown:
        told = BatchTerminal(shown)
        try:
            yield told
        finally:
            told.stop()


def batch_table(batch: Batch, table: str) -> Sequence[RenderableType]:
    """What came of it, a row a recording and choice of settings: over the seeds, mean and standard deviation."""
    names = ("error, mm", "overlap")
    found = plain_table("", ("recording", "settings", "runs", *names, "s"), right=(2, 3, 4, 5))
    for column in found.columns[:2]:  # where there is little room, names get more lines, and figures stay whole
        column.no_wrap, column.overflow = False, "fold"
    for (name, choice), runs in rows_of(batch.runs).items():
        done = [run for run in runs if run.status == "done"]
        count = str(len(done)) if len(done) == len(runs) else f"{len(done)} of {len(runs)}"
        figures = [_spread([measured(run, place) for run in done], digits) for (place, _), digits in zip(MEASURES, (1, 3))]
        seconds = [run.seconds for run in done if run.seconds is not None]
        found.add_row(Text(name), Text(choice), count, *figures, f"{np.median(seconds):.1f}" if seconds else "")
    files = [batch.folder / name for name in (f"summary.{table}", "summary.png") if (batch.folder / name).exists()]
    return [found, pairs([("made", "\n".join(map(str, files)))])]


def _spread(values: Sequence[float], digits: int) -> str:
    known = np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return ""
    return f"{known.mean():.{digits}f}" + (f" ± {known.std(ddof=1):.{digits}f}" if len(known) > 1 else "")


def _pace(pace: float) -> str:
    """Runs a second; a minute or an hour where they take long."""
    unit, times = next(((unit, times) for unit, times in (("s", 1), ("min", 60)) if pace * times >= 0.5), ("h", 3600))
    return f"{pace * times:.2g} runs/{unit}"


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 3600}:{int(seconds) // 60 % 60:02}:{int(seconds) % 60:02}"
