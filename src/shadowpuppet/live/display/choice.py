"""Opens the display selected by `--show`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shadowpuppet.errors import SettingsError, warn
from shadowpuppet.live.display.view import Display

if TYPE_CHECKING:
    from shadowpuppet.live.display.web import WebDisplay

FOOTERS = {
    False: "Pictures stay in this machine's memory; joints and angles alone are saved.",
    True: "The pictures are recorded (--record).",
}
GONE = {
    "window": "--show browser shows the same on a page, with the same keys",
    "viewer": "--show browser shows the body in space too, beside the picture",
}
"""Displays that are gone, and what replaces them."""


def open_display(show: str, listen: str = "127.0.0.1", port: int | None = None, record: bool = False,
                 page: type[WebDisplay] | None = None) -> Display:
    """The display for `auto`, `browser` or `none`; `auto` also opens the page in a browser if there is a screen.

    `page`: the kind of page; None: the plain one. Raises `SettingsError` if it cannot be served.
    """
    if show == "none":
        return Display()
    if show in GONE:
        raise SettingsError(f"show: found {show!r}, which is gone: {GONE[show]}")
    from shadowpuppet.live.display.web import WebDisplay
    from shadowpuppet.network import is_loopback

    display = (page or WebDisplay)(listen, port, FOOTERS[record], opening=show == "auto")
    if not is_loopback(listen):
        warn(f"the page is served at {listen}: everybody who reaches this machine can see the person there, and press the buttons")
    return display
