"""A live session on a page for a browser, served by this machine to itself: nothing is fetched from elsewhere."""

from __future__ import annotations

import json
import socket
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, Self
from urllib.parse import urlsplit

from shadowpuppet.errors import SettingsError
from shadowpuppet.live.display.drawing import drawn, jpeg
from shadowpuppet.live.display.view import WISHES, Display, View
from shadowpuppet.network import is_loopback, known_host, shown_host

PORT = 8600
"""Tried first where none is asked for."""
MOST_A_SECOND = 20.0
"""Pictures and figures that a browser gets in a second; more cost the tracker time and show nothing new."""
PAGE = {"/": ("page.html", "text/html"), "/page.css": ("page.css", "text/css"), "/page.js": ("page.js", "text/javascript"),
        "/icon.svg": ("icon.svg", "image/svg+xml")}
BOUNDARY = "shadowpuppet"
HEADERS = {
    "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; connect-src 'self'; script-src 'self'; style-src 'self'; "
                               "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
}  # fmt: skip
"""Of every answer: other sites' pages can neither show nor read what is here."""
WISH_HEADER = "X-Shadowpuppet"
"""A wish must have it: other sites' pages cannot send it."""


class WebDisplay(Display):
    """Serves a page from its `with` block's beginning to its end."""

    def __init__(self, listen: str = "127.0.0.1", port: int | None = None, footer: str = "") -> None:
        """`footer`: what the page says at its foot. Raises `SettingsError` where the address or port cannot be had."""
        self.footer = footer
        self.closed = False
        self._view = View(phase="learning", message="getting ready")
        self._number, self._wish = 0, ""
        self._drawn: tuple[int, bytes] = (-1, b"")
        self._changed, self._drawing = threading.Condition(), threading.Lock()
        self.server = _listening(listen, port, self)
        self.address = f"http://{shown_host(listen)}:{self.server.server_port}/"
        self.where = f"at {self.address}"

    def __enter__(self) -> Self:
        """Begin to serve."""
        threading.Thread(target=self.server.serve_forever, name="page", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        """Tell whoever looks that it is over, and close."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()
        self.server.shutdown()
        self.server.server_close()

    def show(self, view: View) -> None:
        """The next view; what was not fetched is left out."""
        with self._changed:
            if view.image is None and view.chip == self._view.chip:  # nothing new: what was seen last stays
                return
            self._view, self._number = view, self._number + 1
            self._changed.notify_all()

    def wish(self) -> str:
        """The last button that was pressed."""
        wish, self._wish = self._wish, ""
        return wish

    def ask(self, wish: str) -> None:
        """A button was pressed."""
        self._wish = wish

    def next(self, after: int, timeout: float = 1.0) -> tuple[int, View]:
        """The newest view and its number, waited for where it is not newer than one that is known."""
        with self._changed:
            if self._number <= after and not self.closed:
                self._changed.wait(timeout)
            return self._number, self._view

    def picture(self, number: int, view: View) -> bytes:
        """A view's picture as JPEG, drawn once for all who look; empty where there is none."""
        with self._drawing:
            if self._drawn[0] != number:
                image = drawn(view)
                self._drawn = (number, b"" if image is None else jpeg(image))
            return self._drawn[1]


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = False
    display: WebDisplay
    loopback = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Somebody closed the page: nobody need know."""


class _Server6(_Server):
    address_family = socket.AF_INET6


class _Handler(BaseHTTPRequestHandler):
    server: _Server  # pyright: ignore[reportIncompatibleVariableOverride]
    server_version, sys_version = "shadowpuppet", ""
    timeout = 30

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is logged."""

    def do_GET(self) -> None:
        """The page, its pictures, its figures."""
        path = urlsplit(self.path).path
        if not self._is_for_us():
            return
        if path in PAGE:
            name, kind = PAGE[path]
            self._answer(files("shadowpuppet.live.display").joinpath(name).read_bytes(), f"{kind}; charset=utf-8")
        elif path == "/picture.jpg":
            self._answer(self.server.display.picture(*self.server.display.next(0, 0.0)), "image/jpeg")
        elif path == "/picture.mjpeg":
            self._begin(f"multipart/x-mixed-replace; boundary={BOUNDARY}")
            self.wfile.write(f"--{BOUNDARY}\r\n".encode())
            self._follow(self._picture)
        elif path == "/events":
            self._begin("text/event-stream")
            self._follow(self._figures)
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "no such page")

    def do_POST(self) -> None:
        """A button of the page."""
        wish = urlsplit(self.path).path.removeprefix("/wish/")
        if not self._is_for_us():
            return
        if WISH_HEADER not in self.headers:
            self._refuse(HTTPStatus.FORBIDDEN, "only the page itself may ask this")
        elif wish not in WISHES:
            self._refuse(HTTPStatus.NOT_FOUND, "no such wish")
        else:
            self.server.display.ask(wish)
            self._answer(b"", "text/plain")

    def _is_for_us(self) -> bool:
        """Whether the browser means this machine: a name that another site had turned to this address is refused."""
        if known_host(self.headers.get("Host", ""), self.server.loopback):
            return True
        self._refuse(HTTPStatus.MISDIRECTED_REQUEST, "this page is served under the machine's own address only")
        return False

    def _answer(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._begin(kind, status, len(body))
        self.wfile.write(body)

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self._answer(f"{why}\n".encode(), "text/plain; charset=utf-8", status)

    def _begin(self, kind: str, status: HTTPStatus = HTTPStatus.OK, length: int | None = None) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, **HEADERS, **({} if length is None else {"Content-Length": str(length)})}.items():
            self.send_header(name, value)
        self.end_headers()

    def _follow(self, part: Any) -> None:
        """Send parts as views come, and again where none comes, until somebody has enough."""
        display, number = self.server.display, 0
        while not display.closed:
            began = time.monotonic()
            new, view = display.next(number)
            if data := part(new, view):
                self.wfile.write(data)
            number = new
            time.sleep(max(1 / MOST_A_SECOND - (time.monotonic() - began), 0))
        if part == self._figures:
            self.wfile.write(b'data: {"over": true}\n\n')

    def _picture(self, number: int, view: View) -> bytes:
        """A part, and the boundary after it: browsers show a picture once they see where it ends."""
        data = self.server.display.picture(number, view)
        head = f"Content-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
        return head.encode() + data + f"\r\n--{BOUNDARY}\r\n".encode() if data else b""

    def _figures(self, number: int, view: View) -> bytes:
        figures = view.figures() | {"footer": self.server.display.footer}
        return f"data: {json.dumps(figures, allow_nan=False)}\n\n".encode()


def _listening(listen: str, port: int | None, display: WebDisplay) -> _Server:
    kind, why = _Server6 if ":" in listen else _Server, ""
    for tried in (PORT, 0) if port is None else (port,):
        try:
            server = kind((listen, tried), _Handler)
        except (OSError, OverflowError) as error:
            why = (getattr(error, "strerror", None) or str(error)).lower()
            continue
        server.display, server.loopback = display, is_loopback(listen)
        return server
    of = f"listen: {listen}" if port is None else f"listen: {listen}, port: {port}"
    raise SettingsError(f"{of}: the page cannot be served there ({why}); --listen takes an address of this machine, --port a free port")
