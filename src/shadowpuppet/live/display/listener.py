"""What a live session says beside its pictures. Apart from the run, which loads the trackers: the terminal of every command is one."""

from __future__ import annotations

from shadowpuppet.pipeline.progress import Listener


class LiveListener(Listener):
    """Receives messages of a session. Every method does nothing: override those of interest."""

    def note(self, message: str) -> None:
        """A message for the person before the camera or at the terminal."""

    def trouble(self, message: str) -> None:
        """A problem: no usable pictures come, or the motion cannot be sent to other programs."""
