"""Ctrl-C as the normal end of a session, which finishes its current step first."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Self


class Stop:
    """Within its `with` block, Ctrl-C sets `wished`; a second Ctrl-C, or one while `hasty` is set, raises `KeyboardInterrupt`."""

    def __init__(self) -> None:
        """Neither flag is set."""
        self.wished = self.hasty = False
        self._before = None

    def __enter__(self) -> Self:
        """Replace the handler of SIGINT, if the signal is not ignored and this is the main thread."""
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self._before = signal.signal(signal.SIGINT, self._heard)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the former handler."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _heard(self, number: int, frame: FrameType | None) -> None:
        if self.wished or self.hasty:
            raise KeyboardInterrupt
        self.wished = True
