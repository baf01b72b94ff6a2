"""Frames as JSON to whoever connects by WebSocket (RFC 6455), with the extra `live`."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any, Self

from shadowpuppet.errors import SettingsError
from shadowpuppet.live.stream.json_messages import beginning, framed
from shadowpuppet.live.stream.outlet import Outlet, Subject, Told
from shadowpuppet.network import host_of, is_loopback, known_host, shown_host

KEPT = 16384
"""Bytes that may wait in this machine for who is slow, about as the system takes it: a few frames. They get the newest frame after that."""
MOST = 32
"""Connections at a time."""
HASTE = 1.0
"""Seconds that the end may take."""


class WebSocketOutlet(Outlet):
    """Serves from its `with` block's beginning to its end, in a thread of its own: who is slow or hangs holds nobody up."""

    name = "websocket"

    def __init__(self, host: str, port: int, origins: Sequence[str] = ()) -> None:
        """`origins`: of pages that may listen, too, such as https://example.org; * for all. Programs and this machine's pages always may.

        Raises `SettingsError` where the address or port cannot be had, or the library is missing.
        """
        try:
            import websockets.asyncio.server  # noqa: F401
        except ImportError:
            raise SettingsError("websocket: needs the library websockets: pip install 'shadowpuppet[live]'") from None
        self.origins, self.loopback, self._socket = frozenset(origins), is_loopback(host), _listening(host, port)
        self.port = self._socket.getsockname()[1]
        self.where = f"WebSocket at ws://{shown_host(host)}:{self.port}/"
        self._begin = ""
        self._frame: Told | None = None
        self._text, self._number, self._begun = "", 0, 0
        self._clients, self.served, self.refused = 0, 0, 0
        self._news, self._over = asyncio.Event(), asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._run, name="websocket", daemon=True)

    def __enter__(self) -> Self:
        """Begin to serve."""
        self._loop = asyncio.new_event_loop()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Say goodbye to whoever listens, and close."""
        self._soon(self._over.set)
        if self._loop is not None:
            self._thread.join(2 * HASTE)
        self._socket.close()

    def begin(self, subject: Subject) -> None:
        """The first message, for those who are there and those who come."""
        text = beginning(subject)
        self._soon(lambda: self._put(text, None))

    def send(self, frame: Told) -> None:
        """The newest frame; what was not sent before is left out."""
        self._soon(lambda: self._put("", frame))

    def counts(self) -> dict[str, Any]:
        """Connections that were served, and that were refused."""
        return {"served": self.served, "refused": self.refused}

    # In the thread

    def _soon(self, what: Any) -> None:
        if self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(what)

    def _put(self, begin: str, frame: Told | None) -> None:
        if begin:
            self._begin, self._begun, self._frame = begin, self._begun + 1, None
        else:
            self._frame, self._text = frame, ""
        self._number += 1
        self._news.set()
        self._news = asyncio.Event()

    def _run(self) -> None:
        assert self._loop is not None
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        quiet = {"compression": None, "server_header": None, "logger": _silent()}
        server = await serve(self._follow, sock=self._socket, process_request=self._admitted, max_size=1024, max_queue=1, write_limit=KEPT,
                             open_timeout=5, close_timeout=HASTE / 2, **quiet)  # fmt: skip
        await self._over.wait()
        self._news.set()
        closing = asyncio.ensure_future(self._closed(server))
        await asyncio.wait([closing], timeout=HASTE)
        for connection in list(server.connections):  # of those who do not even say goodbye
            connection.transport.abort()
        await closing

    async def _closed(self, server: Any) -> None:
        server.close(close_connections=False)
        await server.wait_closed()

    async def _follow(self, connection: Any) -> None:
        """Send frames as they come, to one who connected, until somebody has enough."""
        from websockets.exceptions import ConnectionClosed

        self._clients, self.served = self._clients + 1, self.served + 1
        listening = asyncio.ensure_future(self._ignored(connection))
        try:
            await self._send_newest(connection, listening)
            if self._over.is_set():
                await connection.close(1001, "the session is over")
        except ConnectionClosed:  # in the middle of a frame
            pass
        finally:
            listening.cancel()
            self._clients -= 1

    async def _send_newest(self, connection: Any, listening: asyncio.Future[None]) -> None:
        number, begun = 0, 0
        while not listening.done() and not self._over.is_set():
            news = self._news
            if self._begin and begun != self._begun:
                begun = self._begun
                await connection.send(self._begin)
            elif self._frame is not None and number != self._number:
                number = self._number
                self._text = self._text or framed(self._frame)
                await connection.send(self._text)
            else:
                waiting = asyncio.ensure_future(news.wait())
                await asyncio.wait([waiting, listening], return_when=asyncio.FIRST_COMPLETED)
                waiting.cancel()

    async def _ignored(self, connection: Any) -> None:
        """What is said to us; ends with the connection."""
        async for _ in connection:
            pass

    def _admitted(self, connection: Any, request: Any) -> Any:
        """None for who may listen; else the refusal."""
        why = self._unfit(request.headers)
        if why:
            self.refused += 1
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        return None

    def _unfit(self, headers: Any) -> str:
        origins, hosts = headers.get_all("Origin"), headers.get_all("Host")
        if len(hosts) != 1 or not known_host(hosts[0], self.loopback):
            return "this is served under the machine's own address only"
        if not all(self._knows(origin) for origin in origins):
            return "pages of other sites may not listen; --origin lets one"
        return "too many listen already" if self._clients >= MOST else ""

    def _knows(self, origin: str) -> bool:
        """Whether pages of an origin may listen: of this machine, or asked for."""
        return is_loopback(host_of(origin)) or origin in self.origins or "*" in self.origins


def _listening(host: str, port: int) -> socket.socket:
    try:
        found = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except (OSError, UnicodeError, OverflowError) as error:
        why = (getattr(error, "strerror", None) or str(error)).lower()
        raise SettingsError(f"websocket: {host}:{port}: cannot be listened at ({why}); it takes an address of this machine and a free "
                            "port") from None  # fmt: skip
    found.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KEPT)  # those that connect inherit it
    return found


def _silent() -> Any:
    """A logger that says nothing: who comes, and goes without a word, is no trouble of the person's before the camera."""
    import logging

    logger = logging.getLogger("shadowpuppet.websocket")
    logger.addHandler(logging.NullHandler())
    logger.propagate = False
    return logger
