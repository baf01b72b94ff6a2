"""Frames as messages of the Virtual Motion Capture protocol (https://protocol.vmc.info), which moves avatars in other programs."""

from __future__ import annotations

from typing import Any

from shadowpuppet.live.stream.avatar import Avatar
from shadowpuppet.live.stream.osc import Message, Sender, bundles
from shadowpuppet.live.stream.outlet import Outlet, Subject, Told
from shadowpuppet.network import shown_host

LOADED, CALIBRATED, NORMAL = 1, 3, 0
"""What /VMC/Ext/OK tells: that there is a model, that it is calibrated, and in which mode; last whether the person is seen."""
ROOT = ("root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""The avatar's root stays; its hips move."""


def messages(avatar: Avatar, frame: Told) -> list[Message]:
    """All that the protocol has of a frame; the root and bones of one with a pose only. The last two tell that the frame is whole."""
    bones = avatar.bones(frame)
    told = [Message("/VMC/Ext/Root/Pos", ROOT)] if bones else []
    told += [Message("/VMC/Ext/Bone/Pos", (bone.name, *bone.place, *bone.turn)) for bone in bones]
    return [*told, Message("/VMC/Ext/OK", (LOADED, CALIBRATED, NORMAL, int(bool(bones)))), Message("/VMC/Ext/T", (float(frame.time),))]


class VmcOutlet(Outlet):
    """Sends a frame's messages in bundles by UDP, to one address."""

    name = "osc"

    def __init__(self, host: str, port: int) -> None:
        """Raises `SettingsError` for a host that is not known."""
        self.sender = Sender(host, port, "osc")
        self.where = f"OSC (VMC) to {shown_host(host)}:{port}"
        self._avatar: Avatar | None = None
        self._said = False

    def __exit__(self, *_: object) -> None:
        """Send no more."""
        self.sender.close()

    def begin(self, subject: Subject) -> None:
        """An avatar of the person's own sizes."""
        self._avatar = Avatar(subject)

    def send(self, frame: Told) -> None:
        """One frame, in a datagram or two."""
        if self._avatar is not None:
            for data in bundles(messages(self._avatar, frame)):
                self.sender.send(data)

    def trouble(self) -> str:
        """That datagrams cannot be sent, once."""
        if self._said or not self.sender.failed:
            return ""
        self._said = True
        return f"{self.where}: cannot be sent ({self.sender.why}); it is tried with every frame, and the session goes on"

    def counts(self) -> dict[str, Any]:
        """Datagrams."""
        return {"sent": self.sender.sent, "failed": self.sender.failed}
