"""A viser server that pages of other sites cannot read; by default only this machine can reach it."""

from __future__ import annotations

import atexit
import contextlib
import gc
import io
import socket
import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from shadowpuppet.errors import ShadowPuppetError, extra_command, warn
from shadowpuppet.network import (
    MAX_CONNECTIONS,
    REQUEST_SECONDS,
    address_family,
    is_loopback,
    is_own_host,
    is_same_origin,
    open_page,
    page_headers,
    shown_host,
    silent_logger,
)

if TYPE_CHECKING:
    import viser

PORT = 8610
"""Port tried first if none is given."""
POLICY = ("default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; worker-src blob: data:; "
          "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' data: blob:; "
          "base-uri 'none'; form-action 'none'")  # fmt: skip
"""Content security policy of the page: a browser fetches only what the page contains, or what comes from its own server."""
MAX_MESSAGE = 1_000_000
"""Greatest size of a message from a page, bytes."""
HEADERS = page_headers(POLICY)
_starting = threading.Lock()
_leaving: dict[viser.ViserServer, Callable[[], None]] = {}
"""Exit handlers of the servers that are still open."""


def check_viser() -> None:
    """Raise `ShadowPuppetError` if viser is not installed."""
    import importlib.util

    if importlib.util.find_spec("viser") is None:
        raise ShadowPuppetError(f"--show viewer needs viser: {extra_command('view')}")


def open_server(listen: str = "127.0.0.1", port: int | None = None) -> viser.ViserServer:
    """Start a server at an address and port, by default `PORT` or any that is free; stop it with `close_server`.

    Raises `SettingsError` if the address or port is not free, `ShadowPuppetError` without viser. Warns if other machines can reach it.
    """
    check_viser()
    import viser

    with _starting:
        free = _free_port(listen, port)
        with guarded(is_loopback(listen)) as installed, _silent():
            server = viser.ViserServer(host=listen, port=free, label="shadowpuppet", verbose=False)
        _leaving[server] = partial(close_server, server)
        atexit.register(_leaving[server])  # before viser's own, which prints
        if not installed() or (free and server.get_port() != free):
            close_server(server)
            raise ShadowPuppetError(f"the page cannot be served at port {free}: " + (
                "it was taken just now" if installed() else f"this version of viser, {viser.__version__}, cannot be kept from other sites"))
    server.request_share_url = lambda verbose=True: None  # disables viser's public share links
    if not is_loopback(listen):
        warn(f"the page is served at {listen}: everybody who reaches this machine can see what it shows")
    return server


def close_server(server: viser.ViserServer) -> None:
    """Stop a server; does nothing if it was stopped before."""
    leave = _leaving.pop(server, None)
    if leave is not None:
        atexit.unregister(leave)
        with _silent():
            server.stop()


def address_of(server: viser.ViserServer) -> str:
    """Address of a server for a browser."""
    return f"http://{shown_host(server.get_host())}:{server.get_port()}/"


@contextlib.contextmanager
def guarded(loopback: bool) -> Iterator[Callable[[], bool]]:
    """Context in which newly started servers check the origin of each request. They refuse pages of other sites, and other host names that
    were made to resolve to this machine (DNS rebinding). Yields a function that returns whether such a server was started.

    viser has no setting for this, and a WebSocket is open to pages of all sites: so the function that opens it is wrapped.
    """
    import websockets.asyncio.server as library

    plain, seen = library.serve, list[bool]()

    def serve(handler: Any, *args: Any, process_request: Any = None, **more: Any) -> Any:
        seen.append(True)
        clients = _Clients(handler)
        limits = {"max_size": MAX_MESSAGE, "open_timeout": REQUEST_SECONDS, "logger": silent_logger("shadowpuppet.viewer")}
        return plain(clients, *args, process_request=_asking(process_request, loopback, clients), **more | limits)

    library.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield lambda: bool(seen)
    finally:
        library.serve = plain


class _Clients:
    """A handler of WebSocket connections that counts them, and gives their memory back when they are gone."""

    def __init__(self, handler: Any) -> None:
        self.handler, self.number = handler, 0

    async def __call__(self, connection: Any) -> None:
        self.number += 1
        try:
            await self.handler(connection)
        except Exception:  # of a message that is none: the connection is closed, and nothing is printed
            with contextlib.suppress(Exception):
                await connection.close(1002)
        finally:
            self.number -= 1
            gc.collect()  # what viser keeps of a client refers to itself


def _asking(answer: Any, loopback: bool, clients: _Clients) -> Any:
    """A request handler that refuses foreign requests, passes the others to `answer`, and adds `HEADERS` to its responses."""
    from http import HTTPStatus

    def asking(connection: Any, request: Any) -> Any:
        if not (is_own_host(request.headers, loopback) and is_same_origin(request.headers)):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page is served under the machine's own address, and to itself only\n")
        if clients.number >= MAX_CONNECTIONS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many pages are open already\n")
        response = None if answer is None else answer(connection, request)
        if response is not None:
            for name, value in HEADERS.items():
                response.headers[name] = value
        return response

    return asking


def _free_port(listen: str, port: int | None) -> int:
    """A free port: `port`, or if it is None `PORT` or any. Raises `SettingsError` if there is none."""

    def probed(tried: int) -> int:
        with socket.socket(address_family(listen), socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((listen, tried))
            return probe.getsockname()[1]

    return open_page(probed, listen, port, PORT)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Context that suppresses what viser prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
