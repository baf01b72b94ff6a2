"""Programs that listen to a session, for tests: OSC by python-osc, and an avatar put together as Unity would."""

from __future__ import annotations

import socket

import numpy as np
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage


def osc_messages(datagrams) -> list[tuple[str, list]]:
    """Addresses and arguments in datagrams, by a library that is not ours."""
    out = []
    for data in datagrams:
        bundle = OscBundle(data)
        assert len(data) <= 1472
        for part in bundle:
            assert isinstance(part, OscMessage)
            out.append((part.address, list(part.params)))
    return out


class OscEar:
    """A UDP port on the loopback."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def heard(self, timeout: float = 1.0) -> list[tuple[str, list]]:
        """All that came until now, or the first that comes."""
        datagrams = []
        self.socket.settimeout(timeout)
        try:
            while True:
                datagrams.append(self.socket.recv(65536))
                self.socket.settimeout(0.05)
        except TimeoutError:
            return osc_messages(datagrams)


def hamilton(p, q):
    """The product of quaternions x, y, z, w."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return np.array([pw * qx + px * qw + py * qz - pz * qy, pw * qy - px * qz + py * qw + pz * qx,
                     pw * qz + px * qy - py * qx + pz * qw, pw * qw - px * qx - py * qy - pz * qz])  # fmt: skip


def turned(q, v):
    """A vector turned by a quaternion: Unity's `Quaternion * Vector3`."""
    back = np.array([-q[0], -q[1], -q[2], q[3]])
    return hamilton(hamilton(q, np.array([*v, 0.0])), back)[:3]


ABOVE = {"Hips": None, "Spine": "Hips", "Neck": "Spine", "Head": "Neck"}
for _side in ("Left", "Right"):
    ABOVE |= {f"{_side}UpperArm": "Spine", f"{_side}LowerArm": f"{_side}UpperArm", f"{_side}Hand": f"{_side}LowerArm",
              f"{_side}UpperLeg": "Hips", f"{_side}LowerLeg": f"{_side}UpperLeg", f"{_side}Foot": f"{_side}LowerLeg"}  # fmt: skip
"""The nearest bone above each in Unity's humanoid, of those that we send."""


def composed(messages) -> dict[str, np.ndarray]:
    """Where the bones of the last frame are, put together from the root down."""
    told = {params[0]: (np.array(params[1:4]), np.array(params[4:8])) for address, params in messages if address.endswith("Bone/Pos")}
    root = next((np.array(p[1:4]), np.array(p[4:8])) for address, p in messages if address == "/VMC/Ext/Root/Pos")
    world = {}
    for name, (place, turn) in told.items():
        above = ABOVE[name]
        while above is not None and above not in told:
            above = ABOVE[above]
        start, whole = world[above] if above is not None else root
        world[name] = (start + turned(whole, place), hamilton(whole, turn))
    return {name: place for name, (place, _) in world.items()}
