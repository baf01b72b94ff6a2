"""Frames as JSON over WebSocket (RFC 6455); needs the extra `live`."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import TYPE_CHECKING, Self

from shadowpuppet.errors import SettingsError, extra_command, reason
from shadowpuppet.live.stream.json_messages import beginning, framed
from shadowpuppet.live.stream.outlet import Outlet, StreamFrame, StreamSubject
from shadowpuppet.network import (
    REQUEST_SECONDS,
    SEND_SECONDS,
    Connections,
    address_family,
    are_origins_allowed,
    is_loopback,
    is_own_host,
    shown_host,
    silent_logger,
)

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.datastructures import Headers
    from websockets.http11 import Request, Response

SEND_BUFFER = 16384
"""Bytes buffered for a slow client, a few frames; after those it gets the newest frame."""
CLOSE_SECONDS = 1.0
"""Limit for closing all connections."""


class WebSocketOutlet(Outlet):
    """Serves frames within its `with` block, in its own thread, so that slow clients delay nothing."""

    name = "websocket"

    def __init__(self, host: str, port: int, origins: Sequence[str] = ()) -> None:
        """`origins`: origins of web pages that may connect (https://example.org), * for all; programs that are no page always may.

        Raises `SettingsError` if the address or port is not available, or the library is missing.
        """
        try:
            import websockets.asyncio.server  # noqa: F401
        except ImportError:
            raise SettingsError(f"websocket: needs the library websockets: {extra_command('live')}") from None
        self.origins, self.loopback, self._socket = frozenset(origins), is_loopback(host), _listening(host, port)
        self.port = self._socket.getsockname()[1]
        self.where = f"WebSocket at ws://{shown_host(host)}:{self.port}/"
        self._first_message, self._subject_number = "", 0
        self._frame: StreamFrame | None = None
        self._frame_text, self._frame_number = "", 0
        self._clients, self.served, self.refused = Connections(), 0, 0
        self._changed, self._over = asyncio.Event(), asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._run, name="websocket", daemon=True)

    def __enter__(self) -> Self:
        """Start the server's thread."""
        self._loop = asyncio.new_event_loop()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Close all connections and the socket."""
        self._call(self._over.set)
        if self._loop is not None:
            self._thread.join(2 * CLOSE_SECONDS)
        self._socket.close()

    def begin(self, subject: StreamSubject) -> None:
        """Send the first message to all clients, present and future."""
        text = beginning(subject)
        self._call(lambda: self._put(text, None))

    def send(self, frame: StreamFrame) -> None:
        """Set the newest frame; a slow client skips those before it."""
        self._call(lambda: self._put("", frame))

    def counts(self) -> dict[str, int]:
        """Number of connections served and refused."""
        return {"served": self.served, "refused": self.refused}

    def _call(self, function: Callable[[], None]) -> None:
        """Call a function in the server's thread."""
        if self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(function)

    # In the server's thread

    def _put(self, first_message: str, frame: StreamFrame | None) -> None:
        if first_message:
            self._first_message, self._subject_number, self._frame = first_message, self._subject_number + 1, None
        else:
            self._frame, self._frame_text = frame, ""
        self._frame_number += 1
        self._changed.set()
        self._changed = asyncio.Event()

    def _run(self) -> None:
        assert self._loop is not None
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        quiet = {"compression": None, "server_header": None, "logger": silent_logger("shadowpuppet.websocket")}
        server = await serve(self._follow, sock=self._socket, process_request=self._check, max_size=1024, max_queue=1,
                             write_limit=SEND_BUFFER, open_timeout=REQUEST_SECONDS, close_timeout=CLOSE_SECONDS / 2, **quiet)
        await self._over.wait()
        self._changed.set()
        closing = asyncio.ensure_future(self._closed(server))
        await asyncio.wait([closing], timeout=CLOSE_SECONDS)
        for connection in list(server.connections):  # connections of clients that do not answer
            connection.transport.abort()
        await closing

    async def _closed(self, server: Server) -> None:
        server.close(close_connections=False)
        await server.wait_closed()

    async def _follow(self, connection: ServerConnection) -> None:
        """Serve one client until it disconnects, reads nothing for `SEND_SECONDS`, or the session ends."""
        from websockets.exceptions import ConnectionClosed

        address = _address(connection)
        if not self._clients.enter(address):  # others were faster
            connection.transport.abort()
            return
        self.served += 1
        connected = asyncio.ensure_future(self._read(connection))
        try:
            await self._send_newest(connection, connected)
            if self._over.is_set():
                await connection.close(1001, "the session is over")
        except ConnectionClosed:  # in the middle of a frame
            pass
        except TimeoutError:
            connection.transport.abort()
        finally:
            connected.cancel()
            self._clients.leave(address)

    async def _send_newest(self, connection: ServerConnection, connected: asyncio.Future[None]) -> None:
        frame_number, subject_number = 0, 0
        while not connected.done() and not self._over.is_set():
            changed = self._changed
            if self._first_message and subject_number != self._subject_number:
                subject_number = self._subject_number
                await _send(connection, self._first_message)
            elif self._frame is not None and frame_number != self._frame_number:
                frame_number = self._frame_number
                self._frame_text = self._frame_text or framed(self._frame)
                await _send(connection, self._frame_text)
            else:
                waiting = asyncio.ensure_future(changed.wait())
                await asyncio.wait([waiting, connected], return_when=asyncio.FIRST_COMPLETED)
                waiting.cancel()

    async def _read(self, connection: ServerConnection) -> None:
        """Read and ignore what a client sends; returns when it disconnects."""
        async for _ in connection:
            pass

    def _check(self, connection: ServerConnection, request: Request) -> Response | None:
        """None for a request that is accepted; else the response that refuses it."""
        why = self._refusal(request.headers, _address(connection))
        if why:
            self.refused += 1
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        return None

    def _refusal(self, headers: Headers, address: str) -> str:
        if not is_own_host(headers, self.loopback):
            return "this is served under the machine's own address only"
        if not are_origins_allowed(headers, self.origins):
            return "pages may not listen unless their origin is given: --origin"
        return "" if self._clients.has_room(address) else "too many listen already"


async def _send(connection: ServerConnection, text: str) -> None:
    """Send a message. Raises `TimeoutError` if the client does not make room for the next one within `SEND_SECONDS`."""
    async with asyncio.timeout(SEND_SECONDS):
        await connection.send(text)


def _address(connection: ServerConnection) -> str:
    """The address of a connection's client."""
    return (connection.remote_address or ("",))[0]


def _listening(host: str, port: int) -> socket.socket:
    try:
        found = socket.create_server((host, port), family=address_family(host))
    except (OSError, UnicodeError, OverflowError) as error:
        raise SettingsError(f"websocket: {host}:{port}: cannot be listened at ({reason(error)}); it takes an address of this machine and a "
                            "free port") from None
    found.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # inherited by connections
    return found
