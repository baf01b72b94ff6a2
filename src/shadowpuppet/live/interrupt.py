"""Ctrl-C as the normal end of a session: what is being done is finished first."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Self


class Stop:
    """In its `with` block Ctrl-C sets `wished`; a second one, or one while `hasty`, is a `KeyboardInterrupt` as ever."""

    def __init__(self) -> None:
        """Nothing is wished."""
        self.wished = self.hasty = False
        self._before = None

    def __enter__(self) -> Self:
        """Take over the signal, where it is not ignored, and this is the thread that gets it."""
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self._before = signal.signal(signal.SIGINT, self._heard)
        return self

    def __exit__(self, *_: object) -> None:
        """Give it back."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _heard(self, number: int, frame: FrameType | None) -> None:
        if self.wished or self.hasty:
            raise KeyboardInterrupt
        self.wished = True
