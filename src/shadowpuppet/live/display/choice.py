"""Where a session is shown: in a window where there is a screen, in a browser otherwise."""

from __future__ import annotations

import os
import sys
import warnings

from shadowpuppet.errors import SettingsError, ShadowPuppetWarning
from shadowpuppet.live.display.view import Display

FOOTERS = {
    False: "Pictures stay in this machine's memory; joints and angles alone are saved.",
    True: "The pictures are recorded (--record).",
}


def open_display(show: str, listen: str = "127.0.0.1", port: int | None = None, record: bool = False) -> Display:
    """The display for `auto`, `window`, `browser` or `none`. Raises `SettingsError` where it cannot be had."""
    if show == "none":
        return Display()
    if show in ("auto", "window"):
        from shadowpuppet.live.display.window import WindowDisplay, no_window

        why = no_window() if show == "window" or has_screen() else "no screen"
        if not why:
            return WindowDisplay(FOOTERS[record])
        if show == "window":
            raise SettingsError(f"show: no window can be opened ({why}); --show browser shows the same on a page")
    from shadowpuppet.live.display.web import WebDisplay
    from shadowpuppet.network import is_loopback

    display = WebDisplay(listen, port, FOOTERS[record])
    if not is_loopback(listen):
        warnings.warn(f"the page is served at {listen}: everybody who reaches this machine can see the person there, and press the buttons",
                      ShadowPuppetWarning, stacklevel=2)
    return display


def has_screen() -> bool:
    """Whether there is likely a screen: always on Windows and macOS, but for a connection from afar."""
    if sys.platform in ("win32", "darwin"):
        return "SSH_CONNECTION" not in os.environ
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
