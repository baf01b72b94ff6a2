"""A viser server that this machine serves to itself: no other site's page can look at what it shows."""

from __future__ import annotations

import atexit
import contextlib
import io
import socket
import threading
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from shadowpuppet.errors import SettingsError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.network import is_loopback, known_host

if TYPE_CHECKING:
    import viser

PORT = 8610
"""Tried first where none is asked for."""
POLICY = ("default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; worker-src blob: data:; "
          "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' data: blob:; "
          "base-uri 'none'; form-action 'none'")  # fmt: skip
"""What a browser may fetch for the page: what is in it, and from where it came."""
HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
           "Cross-Origin-Resource-Policy": "same-origin", "Content-Security-Policy": f"{POLICY}; frame-ancestors 'none'"}  # fmt: skip
_starting = threading.Lock()
_leaving: dict[viser.ViserServer, Callable[[], None]] = {}
"""What stops each open server where the program ends before somebody else did."""


def check_viser() -> None:
    """Raise `ShadowPuppetError` where viser is not installed."""
    import importlib.util

    if importlib.util.find_spec("viser") is None:
        raise ShadowPuppetError("the viewer needs viser: pip install 'shadowpuppet[view]'")


def open_server(listen: str = "127.0.0.1", port: int | None = None) -> viser.ViserServer:
    """A server at an address and port: that asked for, else `PORT` or any that is free. To be stopped by `close_server`.

    Raises `SettingsError` where it cannot be had there, `ShadowPuppetError` without viser. Warns where others can reach it.
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
    server.request_share_url = lambda verbose=True: None  # nothing is shared over the network, whoever asks
    if not is_loopback(listen):
        warnings.warn(f"the page is served at {listen}: everybody who reaches this machine can see what it shows", ShadowPuppetWarning,
                      stacklevel=2)
    return server


def close_server(server: viser.ViserServer) -> None:
    """Stop a server; nothing where it was stopped before."""
    leave = _leaving.pop(server, None)
    if leave is not None:
        atexit.unregister(leave)
        with _silent():
            server.stop()


def address_of(server: viser.ViserServer) -> str:
    """Where a browser finds it."""
    host = server.get_host()
    shown = socket.gethostname() if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{server.get_port()}/"


@contextlib.contextmanager
def guarded(loopback: bool) -> Iterator[Callable[[], bool]]:
    """Within it, servers that begin ask each request whence it comes: a page of another site, or a name that leads here by another's doing,
    is refused. Gives a function that says whether one did begin so.

    viser has no setting for that, and a WebSocket is open to pages of all sites: so the function that opens it is wrapped.
    """
    import websockets.asyncio.server as library

    plain, seen = library.serve, list[bool]()

    def serve(handler: Any, *args: Any, process_request: Any = None, **more: Any) -> Any:
        seen.append(True)
        return plain(handler, *args, process_request=_asking(process_request, loopback), **more)

    library.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield lambda: bool(seen)
    finally:
        library.serve = plain


def is_ours(headers: Any, loopback: bool) -> bool:
    """Whether a request is for this machine by its own name, and from no page of another site."""
    host, origin = headers.get("Host") or "", headers.get("Origin")
    return known_host(host, loopback) and (origin is None or urlsplit(origin).netloc.lower() == host.lower())


def _asking(answer: Any, loopback: bool) -> Any:
    """A function that answers a request, for ours alone."""
    from http import HTTPStatus

    def asking(connection: Any, request: Any) -> Any:
        if not is_ours(request.headers, loopback):
            return connection.respond(HTTPStatus.FORBIDDEN, "this page is served under the machine's own address, and to itself only\n")
        response = None if answer is None else answer(connection, request)
        if response is not None:
            for name, value in HEADERS.items():
                response.headers[name] = value
        return response

    return asking


def _free_port(listen: str, port: int | None) -> int:
    """The port to be served at; 0: any. Raises `SettingsError` where it cannot be had."""
    family, why = socket.AF_INET6 if ":" in listen else socket.AF_INET, ""
    for tried in (PORT, 0) if port is None else (port,):
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            try:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((listen, tried))
                return probe.getsockname()[1]
            except (OSError, OverflowError) as error:
                why = (getattr(error, "strerror", None) or str(error)).lower()
    of = f"listen: {listen}" if port is None else f"listen: {listen}, port: {port}"
    raise SettingsError(f"{of}: the page cannot be served there ({why}); --listen takes an address of this machine, --port a free port")


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """viser prints of itself."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
