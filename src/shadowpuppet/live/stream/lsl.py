"""Frames as a stream of the lab streaming layer (LSL); needs the extra `lsl`."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import SettingsError, extra_command
from shadowpuppet.live.stream.outlet import Outlet, StreamFrame, StreamSubject

CONFIG = "[multicast]\nResolveScope = {scope}\n{listen}[log]\nlevel = -3\n"
"""Configuration of liblsl: scope of the stream's announcement; no log."""
KINDS = (*(f"Position{axis}" for axis in "XYZ"), *(f"Orientation{axis}" for axis in "XYZW"))
"""Channels of a joint, named as in XDF's meta-data for motion capture."""


class LslOutlet(Outlet):
    """A stream of type MoCap: seven channels a joint, position (metres) and quaternion, NaN if unknown.

    A sample's time stamp is when its picture was captured.
    """

    name = "lsl"

    def __init__(self, stream: str, scope: str = "machine") -> None:
        """`stream`: its name; `scope`: how far it is announced (machine, link or site).

        Raises `SettingsError` if pylsl or liblsl is missing.
        """
        try:
            import pylsl  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise SettingsError(f"lsl: needs the library pylsl: {extra_command('lsl')}") from None
        except (OSError, RuntimeError) as error:  # pylsl found no liblsl that this machine can load
            raise SettingsError(f"lsl: the library liblsl cannot be loaded ({' '.join(str(error).split())})") from None
        if not stream.strip():
            raise SettingsError(f"lsl: found {stream!r}, expected the name of the stream")
        self._pylsl, self.stream, self.sent = pylsl, stream, 0
        with contextlib.suppress(RuntimeError, AttributeError):  # liblsl before 1.17 is configured by its own file only
            pylsl.set_config_content(CONFIG.format(scope=scope, listen="ListenAddress = 127.0.0.1\n" if scope == "machine" else ""))
        self.where = f"LSL as {stream!r}"
        self._outlet: Any = None
        self._channels = 0

    def __exit__(self, *_: object) -> None:
        """End the stream."""
        self._outlet = None

    def begin(self, subject: StreamSubject) -> None:
        """Announce the stream; again only if the joints differ."""
        if self._outlet is not None and self._channels == len(subject.names) * len(KINDS):
            return
        self._channels = len(subject.names) * len(KINDS)
        info = self._pylsl.StreamInfo(self.stream, "MoCap", self._channels, self._pylsl.IRREGULAR_RATE, "float32",
                                      f"shadowpuppet-{self.stream}")
        channels = info.desc().append_child("channels")
        for joint in subject.names:
            for kind in KINDS:
                channel = channels.append_child("channel")
                for key, value in (("label", f"{joint}_{kind}"), ("marker", joint), ("object", "person"), ("type", kind),
                                   ("unit", "meters" if kind.startswith("P") else "quaternion")):
                    channel.append_child_value(key, value)
        self._outlet = self._pylsl.StreamOutlet(info, max_buffered=1)  # hundreds of samples, for a slow receiver

    def send(self, frame: StreamFrame) -> None:
        """Send a frame as a sample."""
        if self._outlet is None:
            return
        sample = np.full((self._channels // len(KINDS), len(KINDS)), np.nan)
        if frame.positions is not None and frame.rotations is not None:
            sample[:, :3], sample[:, 3:] = frame.positions, Rotation.from_matrix(frame.rotations).as_quat(canonical=True)
        late = frame.age if np.isfinite(frame.age) else 0.0
        self._outlet.push_sample(sample.ravel().tolist(), self._pylsl.local_clock() - late)
        self.sent += 1

    def counts(self) -> dict[str, int]:
        """Number of samples sent."""
        return {"sent": self.sent}
