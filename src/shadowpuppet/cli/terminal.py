"""What happens in a terminal while something runs: progress, warnings, and the look before the run."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from shadowpuppet.cli.look_tables import rig_look_table
from shadowpuppet.cli.printing import show
from shadowpuppet.cli.tables import look_table
from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.live.run import LiveListener
from shadowpuppet.pipeline.look import Look, RigLook

__all__ = ["Terminal", "show", "show_json", "terminal"]

REPEATED = 10.0
"""Seconds after which what was said is said again."""


class Terminal(LiveListener):
    """Shows the look on standard output; progress and warnings on standard error, a line each."""

    def __init__(self, quiet: bool = False) -> None:
        """`quiet`: nothing but warnings."""
        self.quiet, self.frames = quiet, 0
        self.console = Console(stderr=True, highlight=False)
        self._progress = Progress(TextColumn("{task.description}"), BarColumn(30), TextColumn("{task.fields[done]}"),
                                  TimeRemainingColumn(), console=self.console, transient=True,
                                  disable=quiet or not self.console.is_terminal)
        self._task: TaskID | None = None
        self._said: set[str] = set()
        self._noted: dict[str, float] = {}

    def begin(self, what: str, total: int | None = None) -> None:
        """Show what begins."""
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._task = self._progress.add_task(what, total=total, done="")
        if not self._progress.disable:
            self._progress.start()

    def advance(self, frames: int) -> None:
        """Show how many frames are done, and how fast."""
        self.frames = frames
        if self._task is not None and not self._progress.disable:
            task = self._progress.tasks[-1]
            total = f"/{task.total:.0f}" if task.total else ""
            speed = f"  {task.speed:.0f} frames/s" if task.speed else ""
            self._progress.update(self._task, completed=frames, done=f"{frames}{total}{speed}")

    def look(self, look: Look | RigLook) -> None:
        """Show what was found, and what is in doubt."""
        if not self.quiet:
            self.stop()
            show(rig_look_table(look) if isinstance(look, RigLook) else look_table(look))
        self.doubt(look)

    def doubt(self, look: Look | RigLook) -> None:
        """Say what may harm a run."""
        for doubt in look.doubts:
            self.warn(doubt)

    def warn(self, message: str) -> None:
        """Say a warning, once, in one line."""
        line = f"warning: {' '.join(message.split())}"
        if line not in self._said:
            self._said.add(line)
            self.console.print(line, markup=False, soft_wrap=True)

    def note(self, message: str) -> None:
        """Show what is to be known now; as a line where it was not said just before."""
        now, text = monotonic(), message.rpartition(": ")[0] or message
        if not self.quiet:
            self.begin(message)
            if text not in self._noted or now - self._noted[text] > REPEATED:
                self.console.print(message, markup=False, soft_wrap=True)
            self._noted[text] = now

    def trouble(self, message: str) -> None:
        """Say that no pictures come."""
        self.console.print(f"warning: {' '.join(message.split())}", markup=False, soft_wrap=True)

    def stop(self) -> None:
        """Take the bar away."""
        if not self._progress.disable:  # rich 14.0 ends with an empty line even then
            self._progress.stop()

    def _show_warning(self, message: Warning | str, category: type[Warning], filename: str, lineno: int, file: TextIO | None = None,
                      line: str | None = None) -> None:
        where = "" if issubclass(category, ShadowPuppetWarning) else f"{category.__name__} in {Path(filename).name}:{lineno}: "
        self.warn(where + str(message))


@contextmanager
def terminal(quiet: bool = False, folder: Path | None = None, nothing: str = "nothing was written") -> Iterator[Terminal]:
    """A terminal to be told things; `folder` is where an interrupted run can be found, `nothing` what is said before its first frame."""
    shown = Terminal(quiet)
    with warnings.catch_warnings():
        warnings.simplefilter("always", ShadowPuppetWarning)
        warnings.showwarning = shown._show_warning
        try:
            yield shown
        except KeyboardInterrupt as interrupt:
            if interrupt.args:
                raise  # it tells by itself what was kept
            kept = f"the {shown.frames} frames so far are in {folder}" if shown.frames and folder else nothing
            raise KeyboardInterrupt(kept) from None
        finally:
            shown.stop()


def show_json(value: Any) -> None:
    """Print a value as JSON."""
    from shadowpuppet.pipeline.track import json_text

    print(json_text(value))
