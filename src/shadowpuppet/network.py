"""Addresses of machines: which are this one's own, which a browser may mean, and how they are written."""

from __future__ import annotations

import ipaddress
import socket
from urllib.parse import urlsplit

from shadowpuppet.errors import SettingsError

LOCAL = "127.0.0.1"
"""This machine, for itself alone."""


def host_and_port(text: str, field: str) -> tuple[str, int]:
    """Host and port of `[HOST:]PORT`, with this machine where no host is given; an IPv6 address stands in brackets.

    Raises `SettingsError` naming the field.
    """
    host, _, port = text.rpartition(":")
    bracketed = host.startswith("[") and host.endswith("]")
    host = host[1:-1] if bracketed else host
    if not (port.isascii() and port.isdecimal()) or int(port) > 65535 or (":" in host) != bracketed or text.startswith(":"):
        raise SettingsError(f"{field}: found {text!r}, expected a port, or host:port, such as 39539 or 192.168.1.20:39539 or [::1]:39539")
    return host or LOCAL, int(port)


def is_loopback(listen: str) -> bool:
    """Whether an address is reached from this machine alone."""
    address = address_of(listen)
    return listen == "localhost" or (address is not None and address.is_loopback)


def known_host(header: str, loopback: bool) -> bool:
    """Whether a request's Host is an address, or this machine's name; on the loopback, whether it is that.

    Other sites can have their names lead here, but not an address.
    """
    name = host_of(f"//{header}")
    if name == "localhost":
        return True
    address = address_of(name)
    if address is None:
        return not loopback and name == socket.gethostname().lower()
    return address.is_loopback or not loopback


def host_of(url: str) -> str:
    """The host that an address of the web names; empty where it names none."""
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""


def address_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """An address, where a text is one."""
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None


def shown_host(listen: str) -> str:
    """How a browser, or another program, is told to find what listens at an address."""
    address = address_of(listen)
    if address is not None and address.is_unspecified:
        return socket.gethostname()
    return f"[{listen}]" if ":" in listen else listen
