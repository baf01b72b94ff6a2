"""Ctrl-C as the normal end of a session, which finishes its current step first; SIGTERM and SIGHUP likewise where they end the program."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any, Self


class Stop:
    """Within its `with` block, Ctrl-C sets `wished`; a second Ctrl-C, or one while `hasty` is set, raises `KeyboardInterrupt`."""

    def __init__(self) -> None:
        """Neither flag is set."""
        self.wished = self.hasty = False
        self._before = dict[int, Any]()

    def __enter__(self) -> Self:
        """Replace the handlers of the signals that have one, if this is the main thread."""
        if threading.current_thread() is threading.main_thread():
            for name in ("SIGINT", "SIGTERM", "SIGHUP"):
                number = getattr(signal, name, None)
                if number is not None and callable(signal.getsignal(number)):
                    self._before[number] = signal.signal(number, self._heard)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the former handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _heard(self, number: int, frame: FrameType | None) -> None:
        if self.wished or self.hasty:
            raise KeyboardInterrupt
        self.wished = True
