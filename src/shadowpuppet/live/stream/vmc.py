"""Frames as OSC messages of the Virtual Motion Capture protocol (https://protocol.vmc.info), which animates avatars in other programs."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterable, Iterator

import numpy as np
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import build_msg
from pythonosc.udp_client import UDPClient

from shadowpuppet.errors import SettingsError, reason
from shadowpuppet.live.stream.avatar import Avatar
from shadowpuppet.live.stream.outlet import Outlet, StreamFrame, StreamSubject
from shadowpuppet.network import is_loopback, shown_host

READY = (1, 3, 0)
"""First arguments of /VMC/Ext/OK: a model is loaded, calibrated, in the normal mode; the last argument is 1 while the person is tracked."""
ROOT = ("root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""The avatar's root stays at the origin; its hips move."""
DATAGRAM_BYTES = 1400
"""Largest datagram that Ethernet does not split."""
BUNDLE_HEAD, LENGTH_FIELD = OscBundleBuilder(IMMEDIATELY).build().size, struct.calcsize(">i")
"""Bytes of a bundle's head, and of the length before each of its messages."""


def messages(avatar: Avatar, frame: StreamFrame) -> list[OscMessage]:
    """The protocol's messages of a frame: root and bones if there is a pose; the age, which is our own; then OK and T, which
    end every frame."""
    bones = avatar.bones(frame)
    made = [build_msg("/VMC/Ext/Root/Pos", ROOT)] if bones else []
    made += [build_msg("/VMC/Ext/Bone/Pos", (bone.name, *bone.position, *bone.rotation)) for bone in bones]
    made += [build_msg("/shadowpuppet/age", (float(frame.age),))] if np.isfinite(frame.age) else []
    return [*made, build_msg("/VMC/Ext/OK", (*READY, int(bool(bones)))), build_msg("/VMC/Ext/T", (float(frame.time),))]


def bundles(messages: Iterable[OscMessage], largest: int = DATAGRAM_BYTES) -> Iterator[OscBundle]:
    """The messages in order, in as few bundles of at most `largest` bytes as possible."""
    builder, size = OscBundleBuilder(IMMEDIATELY), BUNDLE_HEAD
    for message in messages:
        if size > BUNDLE_HEAD and size + LENGTH_FIELD + message.size > largest:
            yield builder.build()
            builder, size = OscBundleBuilder(IMMEDIATELY), BUNDLE_HEAD
        builder.add_content(message)
        size += LENGTH_FIELD + message.size
    if size > BUNDLE_HEAD:
        yield builder.build()


class VmcOutlet(Outlet):
    """Sends each frame in bundles by UDP to one address. Never waits: failed datagrams are counted, and the reason is reported
    once."""

    name = "osc"

    def __init__(self, host: str, port: int) -> None:
        """Raises `SettingsError` for an unknown host, or port 0."""
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port or None, type=socket.SOCK_DGRAM)[0]
            self.address = socket.getnameinfo(address, socket.NI_NUMERICHOST | socket.NI_NUMERICSERV)[0]
        except (OSError, UnicodeError) as error:
            raise SettingsError(f"osc: found the host {host!r}, which is not known ({reason(error)})") from None
        if not port:
            raise SettingsError("osc: found port 0, expected 1 to 65535")
        self.loopback = is_loopback(self.address)
        self.where = f"OSC (VMC) to {shown_host(host)}:{port}"
        self.sent, self.failed = 0, 0
        self._client = UDPClient(self.address, port, family=family)  # by the numeric address: no look-up of names while sending
        self._avatar: Avatar | None = None
        self._problem, self._reported = "", False

    def __exit__(self, *_: object) -> None:
        """Close the socket."""
        self._client.close()

    def begin(self, subject: StreamSubject) -> None:
        """Build an avatar of the person's own sizes."""
        self._avatar = Avatar(subject)

    def send(self, frame: StreamFrame) -> None:
        """Send a frame, in a datagram or two."""
        if self._avatar is not None:
            for bundle in bundles(messages(self._avatar, frame)):
                self._send(bundle)

    def trouble(self) -> str:
        """A sentence that datagrams cannot be sent, once; else empty."""
        if self._reported or not self.failed:
            return ""
        self._reported = True
        return f"{self.where}: cannot be sent ({self._problem}); it is tried with every frame, and the session goes on"

    def counts(self) -> dict[str, int]:
        """Number of datagrams sent and failed."""
        return {"sent": self.sent, "failed": self.failed}

    def _send(self, bundle: OscBundle) -> None:
        try:
            self._client.send(bundle)
            self.sent += 1
        except OSError as error:
            self.failed, self._problem = self.failed + 1, reason(error)
