"""Opens the display selected by `--show`."""

from __future__ import annotations

from shadowpuppet.errors import SettingsError, warn
from shadowpuppet.live.display.view import Display

FOOTERS = {
    False: "Pictures stay in this machine's memory; joints and angles alone are saved.",
    True: "The pictures are recorded (--record).",
}


def open_display(show: str, listen: str = "127.0.0.1", port: int | None = None, record: bool = False) -> Display:
    """The display for `auto`, `browser` or `none`; `auto` also opens the page in a browser if there is a screen.

    Raises `SettingsError` if it cannot be served.
    """
    if show == "none":
        return Display()
    if show == "window":
        raise SettingsError("show: found 'window', which is gone: --show browser shows the same on a page, with the same keys")
    from shadowpuppet.live.display.web import WebDisplay
    from shadowpuppet.network import is_loopback

    display = WebDisplay(listen, port, FOOTERS[record], opening=show == "auto")
    if not is_loopback(listen):
        warn(f"the page is served at {listen}: everybody who reaches this machine can see the person there, and press the buttons")
    return display
