"""The page of a live session, and the HTTP server for it; the page loads nothing from other servers."""

from __future__ import annotations

import json
import threading
import time
from http import HTTPStatus
from importlib.resources import files
from typing import Any, Self
from urllib.parse import urlsplit

from shadowpuppet.live.display.drawing import drawn, jpeg
from shadowpuppet.live.display.view import COMMANDS, Display, SessionState
from shadowpuppet.network import open_browser, open_page, page_headers, shown_host
from shadowpuppet.page_server import PageHandler, PageServer

PORT = 8600
"""Default port; another free one if it is taken."""
MAX_RATE = 20.0
"""Pictures and figures sent to a browser per second; more would take the tracker's time and show nothing new."""
PAGE = {"/": ("page.html", "text/html"), "/page.css": ("page.css", "text/css"), "/page.js": ("page.js", "text/javascript"),
        "/icon.svg": ("icon.svg", "image/svg+xml")}
BOUNDARY = "shadowpuppet"
HEADERS = page_headers("default-src 'none'; img-src 'self'; connect-src 'self'; script-src 'self'; style-src 'self'; base-uri 'none'; "
                       "form-action 'none'")
COMMAND_HEADER = "X-Shadowpuppet"
"""Required of commands: pages of other sites cannot send it."""


class WebDisplay(Display):
    """Serves the page within its `with` block."""

    def __init__(self, listen: str = "127.0.0.1", port: int | None = None, footer: str = "", opening: bool = False) -> None:
        """Listen at an address and port (None: `PORT`, or any that is free).

        `footer`: the page's last line; `opening`: open the page in this machine's browser. Raises `SettingsError` if the address
        or port is not available.
        """
        self.footer, self.opening = footer, opening
        self.closed = False
        self._view = SessionState(phase="learning", message="getting ready")
        self._number, self._command = 0, ""
        self._drawn: tuple[int, bytes] = (-1, b"")
        self._changed, self._drawing = threading.Condition(), threading.Lock()
        self.server = open_page(lambda tried: _DisplayServer(self, listen, tried), listen, port, PORT)
        self.address = f"http://{shown_host(listen)}:{self.server.server_port}/"
        self.where = f"at {self.address}"

    def __enter__(self) -> Self:
        """Start the server's thread."""
        threading.Thread(target=self.server.serve_forever, name="page", daemon=True).start()
        if self.opening:
            open_browser(self.address)
        return self

    def __exit__(self, *_: object) -> None:
        """Send open pages the end of the session, and close."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()
        self.server.shutdown()
        self.server.server_close()

    def show(self, view: SessionState) -> None:
        """Set the newest view; pages skip views that they did not fetch in time."""
        with self._changed:
            if view.image is None and view.chip == self._view.chip:  # nothing new: pages keep the last picture
                return
            self._view, self._number = view, self._number + 1
            self._changed.notify_all()

    def command(self) -> str:
        """The last button or key pressed, once."""
        command, self._command = self._command, ""
        return command

    def press(self, command: str) -> None:
        """Store the command of a button or key."""
        self._command = command

    def next(self, after: int, timeout: float = 1.0) -> tuple[int, SessionState]:
        """The newest view and its number; waits up to `timeout` seconds for one newer than number `after`."""
        with self._changed:
            if self._number <= after and not self.closed:
                self._changed.wait(timeout)
            return self._number, self._view

    def figures(self, view: SessionState) -> dict[str, Any]:
        """A view's figures for the page, as JSON."""
        return view.figures() | {"footer": self.footer}

    def part(self, path: str) -> tuple[bytes, str] | None:
        """Content of a further path and its type, for subclasses; None if there is nothing."""
        return None

    def picture(self, number: int, view: SessionState) -> bytes:
        """A view's picture as JPEG, drawn once for all connections; empty without a picture."""
        with self._drawing:
            if self._drawn[0] != number:
                image = drawn(view)
                self._drawn = (number, b"" if image is None else jpeg(image))
            return self._drawn[1]


class _DisplayServer(PageServer):
    def __init__(self, display: WebDisplay, listen: str, port: int) -> None:
        self.display = display
        super().__init__(_DisplayHandler, listen, port)


class _DisplayHandler(PageHandler):
    server: _DisplayServer  # pyright: ignore[reportIncompatibleVariableOverride]
    page_headers = HEADERS

    def do_GET(self) -> None:
        """Answer with a file of the page, a picture, or a stream of pictures or figures."""
        path = urlsplit(self.path).path
        if not self.is_accepted():
            return
        if path in PAGE:
            name, kind = PAGE[path]
            self.answer(files("shadowpuppet.live.display").joinpath(name).read_bytes(), f"{kind}; charset=utf-8")
        elif path == "/picture.jpg":
            self.answer(self.server.display.picture(*self.server.display.next(0, 0.0)), "image/jpeg")
        elif path == "/picture.mjpeg":
            self.begin(f"multipart/x-mixed-replace; boundary={BOUNDARY}")
            self.send(f"--{BOUNDARY}\r\n".encode())
            self._follow(self._picture)
        elif path == "/events":
            self.begin("text/event-stream")
            self._follow(self._figures)
        elif (found := self.server.display.part(path)) is not None:
            self.answer(*found)
        else:
            self.refuse(HTTPStatus.NOT_FOUND, "no such page")

    def do_POST(self) -> None:
        """Store the command of a button or key of the page."""
        command = urlsplit(self.path).path.removeprefix("/command/")
        if not self.is_accepted():
            return
        if COMMAND_HEADER not in self.headers:
            self.refuse(HTTPStatus.FORBIDDEN, "only the page itself may ask this")
        elif command not in COMMANDS:
            self.refuse(HTTPStatus.NOT_FOUND, "no such command")
        else:
            self.server.display.press(command)
            self.answer(b"", "text/plain")

    def _follow(self, part: Any) -> None:
        """Stream a part per view, at most `MAX_RATE` a second, until the client disconnects; repeats the last one when idle."""
        display, number = self.server.display, 0
        while not display.closed:
            began = time.monotonic()
            new, view = display.next(number)
            if data := part(new, view):
                self.send(data)
            number = new
            time.sleep(max(1 / MAX_RATE - (time.monotonic() - began), 0))
        if part == self._figures:
            self.send(b'data: {"over": true}\n\n')

    def _picture(self, number: int, view: SessionState) -> bytes:
        """One part and the boundary after it, at which browsers show the picture."""
        data = self.server.display.picture(number, view)
        head = f"Content-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
        return head.encode() + data + f"\r\n--{BOUNDARY}\r\n".encode() if data else b""

    def _figures(self, number: int, view: SessionState) -> bytes:
        return f"data: {json.dumps(self.server.display.figures(view), allow_nan=False)}\n\n".encode()
