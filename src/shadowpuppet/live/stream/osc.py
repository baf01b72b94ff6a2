"""Open Sound Control 1.0 (Wright 2002): messages and bundles as bytes, and sending them by UDP."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from shadowpuppet.errors import SettingsError
from shadowpuppet.network import is_loopback

NOW = struct.pack(">Q", 1)
"""The time tag of what counts at once."""
LARGEST = 1400
"""Bytes of a datagram that no Ethernet splits."""
FORMS = {int: ("i", ">i"), float: ("f", ">f")}
Argument = int | float | str


class Message(NamedTuple):
    """An address and what is said there."""

    address: str
    arguments: tuple[Argument, ...]


def encoded(message: Message) -> bytes:
    """A message as bytes: 32-bit whole numbers and floats, and text."""
    tags, data = ",", b""
    for value in message.arguments:
        if isinstance(value, str):
            tags, data = tags + "s", data + _text(value)
        else:
            tag, form = FORMS[type(value)]
            tags, data = tags + tag, data + struct.pack(form, value)
    return _text(message.address) + _text(tags) + data


def bundles(messages: Iterable[Message], largest: int = LARGEST) -> Iterator[bytes]:
    """Messages in their order in as few bundles of at most `largest` bytes as there must be."""
    held = b""
    for message in messages:
        data = encoded(message)
        part = struct.pack(">i", len(data)) + data
        if held and 16 + len(held) + len(part) > largest:
            yield b"#bundle\0" + NOW + held
            held = b""
        held += part
    if held:
        yield b"#bundle\0" + NOW + held


def _text(text: str) -> bytes:
    """Text with zeros up to a multiple of four bytes, one at least."""
    data = text.encode("ascii", "replace")
    return data + b"\0" * (4 - len(data) % 4)


class Sender:
    """Sends datagrams to one address; never waits, and never fails: what could not be sent is counted, and its reason kept."""

    def __init__(self, host: str, port: int, field: str) -> None:
        """Raises `SettingsError`, naming the field, for a host that is not known or a port that is none."""
        try:
            found = socket.getaddrinfo(host, port or None, type=socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            why = (getattr(error, "strerror", None) or str(error)).lower()
            raise SettingsError(f"{field}: found the host {host!r}, which is not known ({why})") from None
        if not port:
            raise SettingsError(f"{field}: found port 0, expected 1 to 65535")
        self.family, _, _, _, self.address = found[0]
        self.loopback = is_loopback(str(self.address[0]))
        self.sent, self.failed, self.why = 0, 0, ""
        self._socket = socket.socket(self.family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send a datagram, or count it as not sent."""
        try:
            self._socket.sendto(data, self.address)
            self.sent += 1
        except OSError as error:
            self.failed, self.why = self.failed + 1, (error.strerror or str(error)).lower()

    def close(self) -> None:
        """Send no more."""
        self._socket.close()
