"""An HTTP server for a page on this machine: few connections, slow clients dropped, other host names and pages of other origins refused."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from shadowpuppet.network import (
    REQUEST_SECONDS,
    SEND_SECONDS,
    Connections,
    address_family,
    is_loopback,
    is_own_host,
    is_same_origin,
)

PIECE = 65536
"""Bytes of an answer that are sent at a time, and kept for a client that does not read them."""


class PageServer(ThreadingHTTPServer):
    """Answers each connection in a thread of its own, within the limits of `network.Connections`."""

    daemon_threads = True
    allow_reuse_address = False

    def __init__(self, handler: type[PageHandler], listen: str, port: int) -> None:
        """Listen at an address and port (0: any). Raises `OSError` if these are not available."""
        self._connections = Connections()
        self.loopback, self.address_family = is_loopback(listen), address_family(listen)
        super().__init__((listen, port), handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread of its own, or close the connection if there are too many already."""
        if not self._connections.enter(client_address[0]):
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except RuntimeError:  # there is no thread for it
            self._connections.leave(client_address[0])
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer, in the thread."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.leave(client_address[0])

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore connections that a browser closed."""


class PageHandler(BaseHTTPRequestHandler):
    """Answers requests; subclasses have `do_GET` and `page_headers`."""

    server: PageServer  # pyright: ignore[reportIncompatibleVariableOverride]
    server_version, sys_version = "shadowpuppet", ""
    page_headers: Mapping[str, str] = {}
    """Headers of every answer."""

    def setup(self) -> None:
        """Give the client `SEND_SECONDS` for each piece that it is sent."""
        super().setup()
        self.connection.settimeout(SEND_SECONDS)
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, PIECE)

    def handle_one_request(self) -> None:
        """Answer one request; the connection is closed if it has not come within `REQUEST_SECONDS`, however slowly it comes."""
        self._ending = threading.Timer(REQUEST_SECONDS, self._end)
        self._ending.daemon = True
        self._ending.start()
        try:
            super().handle_one_request()
        finally:
            self._ending.cancel()

    def parse_request(self) -> bool:
        """Read the request's headers."""
        try:
            return super().parse_request()
        finally:
            self._ending.cancel()

    def _end(self) -> None:
        with contextlib.suppress(OSError):
            self.connection.shutdown(socket.SHUT_RDWR)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""

    def is_accepted(self) -> bool:
        """Whether the request names this machine as its host and comes from no page of another origin; else it is refused."""
        if not is_own_host(self.headers, self.server.loopback):
            self.refuse(HTTPStatus.MISDIRECTED_REQUEST, "this page is served under the machine's own address only")
        elif not is_same_origin(self.headers):
            self.refuse(HTTPStatus.FORBIDDEN, "this page is served to itself only")
        else:
            return True
        return False

    def answer(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        """Send a whole answer of a content type."""
        self.begin(kind, status, len(body))
        self.send(body)

    def send(self, data: bytes) -> None:
        """Send bytes. Raises `OSError` if the client does not read a piece of them within `SEND_SECONDS`."""
        for start in range(0, len(data), PIECE):
            self.wfile.write(data[start : start + PIECE])

    def refuse(self, status: HTTPStatus, why: str) -> None:
        """Send a status and a line that says why."""
        self.answer(f"{why}\n".encode(), "text/plain; charset=utf-8", status)

    def begin(self, kind: str, status: HTTPStatus = HTTPStatus.OK, length: int | None = None) -> None:
        """Send the status and headers."""
        self.send_response(status)
        sizes = {} if length is None else {"Content-Length": str(length)}
        for name, value in {"Content-Type": kind, **self.page_headers, **sizes}.items():
            self.send_header(name, value)
        self.end_headers()
