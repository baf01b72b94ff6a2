"""Network addresses, and functions shared by the HTTP and WebSocket servers: ports, checks of requests, response headers, the browser."""

from __future__ import annotations

import contextlib
import ipaddress
import os
import socket
import sys
import threading
from collections import Counter
from collections.abc import Callable
from typing import Any, TypeVar
from urllib.parse import urlsplit

from shadowpuppet.errors import SettingsError, reason

MAX_CONNECTIONS, MAX_OF_ADDRESS = 32, 16
"""Connections that each server keeps open at a time: in all, and with one address."""
REQUEST_SECONDS, SEND_SECONDS = 5.0, 5.0
"""Time within which a client must have sent its request, and within which it must have read a piece of the answer."""
LOCAL = "127.0.0.1"
"""The loopback address."""
Server = TypeVar("Server")


def host_and_port(text: str, field: str) -> tuple[str, int]:
    """Host and port of `[HOST:]PORT`; the host is `LOCAL` if left out, and an IPv6 address stands in brackets.

    Raises `SettingsError` naming the field.
    """
    host, _, port = text.rpartition(":")
    bracketed = host.startswith("[") and host.endswith("]")
    host = host[1:-1] if bracketed else host
    if not (port.isascii() and port.isdecimal()) or int(port) > 65535 or (":" in host) != bracketed or text.startswith(":"):
        raise SettingsError(f"{field}: found {text!r}, expected a port, or host:port, such as 39539 or 192.168.1.20:39539 or [::1]:39539")
    return host or LOCAL, int(port)


def is_loopback(listen: str) -> bool:
    """Whether only this machine can reach an address."""
    address = address_of(listen)
    return listen == "localhost" or (address is not None and address.is_loopback)


def address_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The IP address in a text; None if the text is not an address, such as a host name."""
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None


def shown_host(listen: str) -> str:
    """The host for URLs of a server that listens at an address; an IPv6 address is put in brackets."""
    address = address_of(listen)
    if address is not None and address.is_unspecified:
        return socket.gethostname()
    return f"[{listen}]" if ":" in listen else listen


def address_family(listen: str) -> socket.AddressFamily:
    """AF_INET6 for an address with a colon, else AF_INET."""
    return socket.AF_INET6 if ":" in listen else socket.AF_INET


# Ports


def open_page(open_at: Callable[[int], Server], listen: str, port: int | None, usual: int) -> Server:
    """Open a server with `open_at` at `port`; if that is None, at port `usual` or else any free one. Returns the result of `open_at`.

    Raises `SettingsError` if `open_at` raises `OSError` or `OverflowError` for all of these ports.
    """
    why = ""
    for tried in (usual, 0) if port is None else (port,):
        try:
            return open_at(tried)
        except (OSError, OverflowError) as error:
            why = reason(error)
    of = f"listen: {listen}" if port is None else f"listen: {listen}, port: {port}"
    raise SettingsError(f"{of}: the page cannot be served there ({why}); --listen takes an address of this machine, --port a free port")


def open_browser(address: str) -> None:
    """Open a page in this machine's browser; does nothing without a screen."""
    if has_screen():
        import webbrowser

        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(address)


def has_screen() -> bool:
    """Whether there is probably a screen: on Windows and macOS unless logged in by SSH, elsewhere if a display is set."""
    if sys.platform in ("win32", "darwin"):
        return "SSH_CONNECTION" not in os.environ
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


# Requests. `headers` are a request's: an `email.message.Message`, or the `Headers` of websockets.


def is_own_host(headers: Any, loopback: bool) -> bool:
    """Whether a request has exactly one Host header, and it names this machine (`known_host`)."""
    hosts = headers.get_all("Host") or []
    return len(hosts) == 1 and known_host(hosts[0], loopback)


def known_host(header: str, loopback: bool) -> bool:
    """Whether a Host header is an IP address or this machine's name; for a server on the loopback, whether it is a loopback address.

    Protects from DNS rebinding: another site can let its own name resolve to this machine, but cannot make the header an address.
    """
    name = host_of(f"//{header}")
    if name == "localhost":
        return True
    address = address_of(name)
    if address is None:
        return not loopback and name == socket.gethostname().lower()
    return address.is_loopback or not loopback


def is_same_origin(headers: Any) -> bool:
    """Whether a request comes from a page of the same server, or from a program that is no web page."""
    host = (headers.get_all("Host") or [""])[0].lower()
    return all(origin.lower().partition("://")[2] == host for origin in headers.get_all("Origin") or [])


def are_origins_allowed(headers: Any, allowed: frozenset[str]) -> bool:
    """Whether a request comes from a page of an origin in `allowed` (* for any), or not from a page. Pages of this machine are no
    exception: they may be any program's."""
    return all(origin in allowed or "*" in allowed for origin in headers.get_all("Origin") or [])


def host_of(url: str) -> str:
    """The host in a URL; empty if it has none."""
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""


def page_headers(policy: str) -> dict[str, str]:
    """Headers of every answer, so that pages of other sites can neither embed nor read it; `policy`: Content-Security-Policy."""
    return {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Security-Policy": f"{policy}; frame-ancestors 'none'"}


class Connections:
    """Counts a server's connections, of each address and in all. Thread-safe."""

    def __init__(self, most: int | None = None, most_of_address: int | None = None) -> None:
        """The greatest numbers; by default `MAX_CONNECTIONS` and `MAX_OF_ADDRESS`."""
        self.most = MAX_CONNECTIONS if most is None else most
        self.most_of_address = MAX_OF_ADDRESS if most_of_address is None else most_of_address
        self._of = Counter[str]()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Number of connections that are counted."""
        return self._of.total()

    def has_room(self, address: str) -> bool:
        """Whether one more connection with an address may be kept."""
        return len(self) < self.most and self._of[address] < self.most_of_address

    def enter(self, address: str) -> bool:
        """Count a connection with an address; False, and nothing is counted, if there are too many already."""
        with self._lock:
            if not self.has_room(address):
                return False
            self._of[address] += 1
            return True

    def leave(self, address: str) -> None:
        """Count a connection no more, which was counted."""
        with self._lock:
            self._of[address] -= 1
            self._of += Counter()  # forgets addresses without any


def silent_logger(name: str) -> Any:
    """A logger without output: clients that break off or send no valid request are no problem of a session."""
    import logging

    logger = logging.getLogger(name)
    logger.addHandler(logging.NullHandler())
    logger.propagate = False
    return logger
