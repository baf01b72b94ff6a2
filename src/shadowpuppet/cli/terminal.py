"""A terminal while a command runs: progress, warnings, and the look before the run."""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TextIO

from rich.progress import BarColumn, Progress, Task, TaskID, TextColumn, TimeRemainingColumn
from rich.text import Text

from shadowpuppet.cli.look_tables import look_table
from shadowpuppet.cli.tables import PlainConsole, show, verdict_table
from shadowpuppet.errors import ShadowPuppetWarning, printable
from shadowpuppet.live.display.view import LiveListener
from shadowpuppet.pipeline.findings.look import Look, RigLook
from shadowpuppet.pipeline.findings.verdict import verdict_of_look
from shadowpuppet.video.film import NOT_LATER

LOG_EVERY = 2.0
"""Seconds between lines of progress where there is no terminal."""
PROGRESS = "..."
"""Beginning of such a line."""
REPEAT_AFTER = 10.0
"""Seconds after which the same note is printed again."""


class LogLines:
    """Progress as lines, for output that is no terminal: a thread prints what `line` gives, each time `pause` seconds later."""

    def __init__(self, console: PlainConsole, line: Callable[[], str], pause: Callable[[], float]) -> None:
        """Nothing is printed before `start`."""
        self.console, self._line, self._pause = console, line, pause
        self._end: threading.Event | None = None
        self._compiled = False
        self._printer: threading.Thread | None = None

    def start(self) -> None:
        """Start printing, unless that was done."""
        if self._end is None:
            self._end = threading.Event()
            self._printer = threading.Thread(target=self._run, args=(self._end,), name="progress", daemon=True)
            self._printer.start()

    def stop(self) -> None:
        """Print no more, until the next start. A line that is being printed is finished first, so that it does not fall into the next."""
        if self._end is not None and self._printer is not None:
            self._end.set()
            self._printer.join()
            self._end = self._printer = None

    def _run(self, end: threading.Event) -> None:
        while not end.wait(self._pause()):
            compiling = "" if self._compiled else _compiling()  # said once a phase
            self._compiled = self._compiled or bool(compiling)
            self.console.print(printable(f"{PROGRESS} {self._line()}{compiling}"), soft_wrap=True)


class _Log(LogLines):
    """The current work, every `LOG_EVERY` seconds."""

    def __init__(self, console: PlainConsole) -> None:
        super().__init__(console, self._text, lambda: LOG_EVERY)
        self.what, self.total, self.done, self.before, self.began = "", None, 0, 0, 0.0

    def begin(self, what: str, total: int | None) -> None:
        """A phase begins; the thread that prints starts with the first."""
        self.what, self.total, self.done, self.before, self.began = what, total, 0, 0, monotonic()
        self._compiled = False
        self.start()

    def advance(self, frames: int) -> None:
        """Number of frames done; those before the first call are an earlier run's, which is resumed."""
        self.done, self.before = frames, self.before if self.done else frames - 1

    def _text(self) -> str:
        seconds = monotonic() - self.began
        speed = f"{(self.done - self.before) / seconds:.1f} a second"
        count = f" {self.done}{f'/{self.total}' if self.total else ''}, {speed}" if self.done else ""
        return f"{self.what}{count}, {seconds:.0f} s"


def _compiling() -> str:
    """That code is being compiled, in words; empty if none is."""
    is_compiling = getattr(sys.modules.get("shadowpuppet.jit"), "is_compiling", None)  # not imported for this, or not yet to its end
    return ", compiling, once (a minute or two)" if is_compiling is not None and is_compiling() else ""


class _What(TextColumn):
    """The current work, and that code is being compiled for it."""

    def render(self, task: Task) -> Text:
        """The text at each refresh."""
        return Text(task.description + _compiling())


class Terminal(LiveListener):
    """Shows the look on standard output, progress and warnings on standard error."""

    def __init__(self, quiet: bool = False, verbose: bool = False) -> None:
        """`quiet`: show only warnings; `verbose`: also all that a look found."""
        self.quiet, self.verbose, self.frames = quiet, verbose, 0
        self.console = PlainConsole(error=True)
        self._progress = Progress(_What(""), BarColumn(30), TextColumn("{task.fields[done]}"),
                                  TimeRemainingColumn(), console=self.console, transient=True,
                                  disable=quiet or not self.console.is_terminal)
        self._log = None if quiet or self.console.is_terminal else _Log(self.console)
        self._task: TaskID | None = None
        self._said: set[str] = set()
        self._noted: dict[str, float] = {}

    def begin(self, what: str, total: int | None = None) -> None:
        """Start the progress bar of a phase; without a terminal, lines of progress."""
        what = printable(what)
        if self._log is not None:
            self._log.begin(what, total)
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._task = self._progress.add_task(what, total=total, done="")
        if not self._progress.disable:
            self._progress.start()

    def advance(self, frames: int) -> None:
        """Show the number of frames done and the speed."""
        self.frames = frames
        if self._log is not None:
            self._log.advance(frames)
        if self._task is not None and not self._progress.disable:
            task = self._progress.tasks[-1]
            total = f"/{task.total:.0f}" if task.total else ""
            speed = f"  {task.speed:.0f} frames/s" if task.speed else ""
            self._progress.update(self._task, completed=frames, done=f"{frames}{total}{speed}")

    def look(self, look: Look | RigLook) -> None:
        """Show the verdict on a recording and its reasons, and what it holds; if `verbose`, all that was found."""
        if not self.quiet:
            self.stop()
            of = f"verdict on the {'films' if isinstance(look, RigLook) else 'film'}"
            show(verdict_table(verdict_of_look(look), of), look_table(look, self.verbose))
        if self.quiet or self.verbose:
            self.doubt(look)

    def doubt(self, look: Look | RigLook) -> None:
        """Warn of everything that may harm a run."""
        for doubt in look.doubts:
            self.warn(doubt)

    def warn(self, message: str) -> None:
        """Print a warning on one line, once; frames that are not later than those before, once for all films."""
        line = printable(f"warning: {' '.join(message.split())}")
        said = NOT_LATER if NOT_LATER in line else line
        if said not in self._said:
            self._said.add(said)
            self.console.print(line, soft_wrap=True)

    def note(self, message: str) -> None:
        """Show a message as the current phase; and on a line of its own unless that was just printed."""
        message = printable(message)
        now, text = monotonic(), message.rpartition(": ")[0] or message
        if not self.quiet:
            self.begin(message)
            if text not in self._noted or now - self._noted[text] > REPEAT_AFTER:
                self.console.print(message, soft_wrap=True)
            self._noted[text] = now

    def trouble(self, message: str) -> None:
        """Print that no pictures come."""
        self.console.print(printable(f"warning: {' '.join(message.split())}"), soft_wrap=True)

    def stop(self) -> None:
        """Remove the progress bar, or end the lines of progress."""
        if self._log is not None:
            self._log.stop()
        if not self._progress.disable:  # rich 14.0 ends with an empty line even then
            self._progress.stop()

    def _show_warning(self, message: Warning | str, category: type[Warning], filename: str, lineno: int, file: TextIO | None = None,
                      line: str | None = None) -> None:
        if issubclass(category, ShadowPuppetWarning):
            self.warn(str(message))
        elif self.verbose:  # about the program's own code, not about anything that the user can change
            self.warn(f"{category.__name__} in {Path(filename).name}:{lineno}: {message}")


@contextmanager
def terminal(quiet: bool = False, folder: Path | None = None, nothing: str = "nothing was written",
             verbose: bool = False, resume: str = "") -> Iterator[Terminal]:
    """A listener that shows progress and warnings: from the start that the program gets ready, until another phase begins.

    After Ctrl-C it names `folder`, which has the frames so far, and how to `resume`, or says `nothing` before the first frame.
    """
    listener, before = Terminal(quiet, verbose), _is_broken_off(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("always", ShadowPuppetWarning)
        warnings.showwarning = listener._show_warning
        try:
            listener.begin("getting ready")
            yield listener
        except KeyboardInterrupt as interrupt:
            if interrupt.args:
                raise  # its message already says what was kept
            number = 0
            if listener.frames or not before:
                number = _rows(folder) or listener.frames
            kept = f"the {number} frames so far are in {folder}{resume}" if number and folder is not None else nothing
            raise KeyboardInterrupt(kept) from None
        finally:
            listener.stop()


def _is_broken_off(folder: Path | None) -> bool:
    """Whether a folder holds a run that did not come to its end."""
    run = None if folder is None else folder / "run.toml"
    return run is not None and run.exists() and "complete = false" in run.read_text(encoding="utf-8", errors="replace")


def _rows(folder: Path | None) -> int:
    """Number of frames in the tables of a run that did not come to its end; 0 if there are none."""
    joints = None if folder is None or not _is_broken_off(folder) else folder / "joints.csv"
    return 0 if joints is None or not joints.exists() else max(joints.read_text(encoding="utf-8", errors="replace").count("\n") - 1, 0)
