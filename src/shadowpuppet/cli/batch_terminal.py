"""A terminal while a batch runs: what each worker does, counts, failures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from shadowpuppet.cli.terminal import LOG_EVERY, LogLines, Terminal, terminal
from shadowpuppet.errors import printable
from shadowpuppet.pipeline.batch.run import Batch
from shadowpuppet.pipeline.batch.summary import BatchRun
from shadowpuppet.pipeline.batch.tasks import Task
from shadowpuppet.pipeline.batch.workers import BatchListener, Outcome

LINES = 16
"""Greatest number of workers shown."""
BAR = 30
"""Greatest width of the progress bar, characters."""
PAUSE = 30.0
"""Greatest number of seconds between two lines if standard error is not a screen; a tenth of the time so far before that."""
TOLD = 2
"""Greatest number of workers in such a line."""


class BatchTerminal(BatchListener):
    """Shows a table on a screen, or else lines, often at first and in the end every `PAUSE` seconds; failures and notes as warnings."""

    def __init__(self, terminal: Terminal) -> None:
        """`terminal`: its console and warnings are used."""
        self.total = self.done = self.failed = self.before = 0
        self._terminal, self._at = terminal, dict[int, tuple[str, str]]()
        self._began = monotonic()
        self._log = LogLines(terminal.console, self._line, lambda: min(max((monotonic() - self._began) / 10, LOG_EVERY), PAUSE))
        self._live = Live(console=terminal.console, get_renderable=self._table, refresh_per_second=4, transient=True)

    def begin(self, total: int, before: int) -> None:
        """Show the table, in place of the terminal's own progress."""
        self._terminal.stop()
        self.total, self.before, self._began = total, before, monotonic()
        if not self._terminal.quiet:
            (self._live if self._terminal.console.is_terminal else self._log).start()
        if before and not self._terminal.quiet:
            self._terminal.console.print(f"{before} of {total} runs are done already")

    def working(self, worker: int, task: Task, doing: str, frames: int, total: int | None) -> None:
        """Show what a worker does."""
        self._at[worker] = task.label, f"{doing} {frames}{f'/{total}' if total else ''}" if frames else doing

    def resting(self, worker: int) -> None:
        """Remove a worker from the table."""
        self._at.pop(worker, None)

    def ended(self, task: Task, outcome: Outcome, again: bool) -> None:
        """Count a run; print a new failure."""
        if outcome["status"] == "done":
            self.done += 1
        elif not again:
            self.failed += 1
            self._terminal.warn(f"{task.name}: failed: {outcome['message']}")
        else:
            self._terminal.warn(f"{task.label}: {outcome['message']}; it is tried again")

    def note(self, message: str) -> None:
        """Print a warning."""
        self._terminal.warn(message)

    def stop(self) -> None:
        """Remove the table, or end the lines."""
        self._live.stop()
        self._log.stop()

    def failures(self, batch: Batch) -> None:
        """Print the failed runs, a line for each reason."""
        reasons: dict[str, list[BatchRun]] = {}
        for run in batch.failed:
            reasons.setdefault(run.message, []).append(run)
        self.stop()
        for why, runs in reasons.items():
            more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
            self._terminal.console.print(printable(f"failed: {runs[0].task.label}{more}: {why}"), soft_wrap=True)
        if reasons:
            text = f"{len(batch.failed)} of {len(batch.runs)} runs failed; the same command tries them again"
            self._terminal.console.print(text)

    def _counts(self) -> str:
        left = self.total - self.before - self.done - self.failed
        pace = (self.done + self.failed) / max(monotonic() - self._began, 1e-9)
        failed = f", {self.failed} failed" if self.failed else ""
        until = f"  {_pace(pace)}, {_clock(left / pace)} left" if pace else ""
        return f"{self.before + self.done} of {self.total} runs done{failed}{until}"

    def _line(self) -> str:
        at = [f"{label}: {doing}" for _, (label, doing) in sorted(self._at.copy().items())]
        more = [f"{len(at) - TOLD} more"] if len(at) > TOLD else []
        return "; ".join([self._counts(), *at[:TOLD], *more])

    def _table(self) -> RenderableType:
        bar, workers = Table.grid(padding=(0, 2)), Table.grid(padding=(0, 2))
        counts = Text(self._counts(), no_wrap=True, overflow="ellipsis")
        room = self._terminal.console.width - counts.cell_len - 2
        bar.add_row(ProgressBar(self.total, self.before + self.done + self.failed, width=min(max(room, 1), BAR)), counts)
        at = sorted(self._at.items())
        for number, (label, doing) in at[:LINES]:
            name, does = Text(printable(label), overflow="ellipsis", no_wrap=True), Text(printable(doing), no_wrap=True)
            workers.add_row(Text(f"{number + 1:3}", style="dim"), name, does)
        if len(at) > LINES:
            workers.add_row("", Text(f"and {len(at) - LINES} more"), "")
        if not (at or self.done or self.failed):
            workers.add_row("", Text("workers are starting"), "")
        return Group(workers, bar)


@contextmanager
def batch_terminal(quiet: bool) -> Iterator[BatchTerminal]:
    """A listener that shows a batch."""
    with terminal(quiet) as outer:
        listener = BatchTerminal(outer)
        try:
            yield listener
        finally:
            listener.stop()


def _pace(pace: float) -> str:
    """Runs a second, a minute or an hour, whichever is readable."""
    unit, times = next(((unit, times) for unit, times in (("s", 1), ("min", 60)) if pace * times >= 0.5), ("h", 3600))
    return f"{pace * times:.2g} runs/{unit}"


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 3600}:{int(seconds) // 60 % 60:02}:{int(seconds) % 60:02}"
