"""Programs that listen to a session, for tests: OSC as its specification has it, and an avatar put together as Unity would."""

from __future__ import annotations

import socket
import struct

import numpy as np


def osc_messages(datagrams) -> list[tuple[str, list]]:
    """Addresses and arguments in datagrams, read independently of the library that writes them (OSC 1.0: Wright 2002)."""
    out = []
    for data in datagrams:
        assert len(data) <= 1472
        assert data[:16] == b"#bundle\0" + struct.pack(">Q", 1)  # 1: at once
        at = 16
        while at < len(data):
            (size,) = struct.unpack_from(">i", data, at)
            out.append(_message(data[at + 4 : at + 4 + size]))
            at += 4 + size
        assert at == len(data)
    return out


def _message(data: bytes) -> tuple[str, list]:
    def word(at: int) -> tuple[str, int]:
        end = data.index(b"\0", at)
        after = at + 4 * ((end - at) // 4 + 1)
        assert not any(data[end:after])
        return data[at:end].decode("ascii"), after

    address, at = word(0)
    tags, at = word(at)
    values = []
    for tag in tags.removeprefix(","):
        if tag == "s":
            value, at = word(at)
        else:
            (value,) = struct.unpack_from({"i": ">i", "f": ">f"}[tag], data, at)
            at += 4
        values.append(value)
    assert at == len(data)
    return address, values


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
