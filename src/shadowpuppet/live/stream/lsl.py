"""Frames as a stream of the lab streaming layer (LSL), with the extra `lsl`."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import SettingsError
from shadowpuppet.live.stream.outlet import Outlet, Subject, Told

CONFIG = "[multicast]\nResolveScope = {scope}\n{listen}[log]\nlevel = -3\n"
"""Of liblsl: how far the stream is announced; and that it logs nothing."""
TURN = "XYZW"
KINDS = tuple(f"Position{axis}" for axis in "XYZ") + tuple(f"Orientation{axis}" for axis in TURN)
"""Channels of a joint, named as XDF's meta-data for motion capture has them."""
SECONDS = 1
"""How much liblsl keeps for who is slow, in hundreds of samples, for streams without a rate."""


class LslOutlet(Outlet):
    """A stream of type MoCap: seven channels a joint, place (metres) and quaternion, not numbers where nothing is known.

    Samples are stamped with the time at which the picture was captured.
    """

    name = "lsl"

    def __init__(self, stream: str, scope: str = "machine") -> None:
        """The stream's name, and how far it is announced: machine, link or site.

        Raises `SettingsError` where pylsl or liblsl is missing.
        """
        try:
            import pylsl  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise SettingsError("lsl: needs the library pylsl: pip install 'shadowpuppet[lsl]'") from None
        except (OSError, RuntimeError) as error:  # pylsl has found no liblsl that this machine can load
            raise SettingsError(f"lsl: the library liblsl cannot be loaded ({' '.join(str(error).split())})") from None
        if not stream.strip():
            raise SettingsError(f"lsl: found {stream!r}, expected the name of the stream")
        self._pylsl, self.stream, self.sent = pylsl, stream, 0
        with contextlib.suppress(RuntimeError, AttributeError):  # of a liblsl before 1.17, which reads its own file alone
            pylsl.set_config_content(CONFIG.format(scope=scope, listen="ListenAddress = 127.0.0.1\n" if scope == "machine" else ""))
        self.where = f"LSL as {stream!r}"
        self._outlet: Any = None
        self._channels = 0

    def __exit__(self, *_: object) -> None:
        """End the stream."""
        self._outlet = None

    def begin(self, subject: Subject) -> None:
        """Announce the stream; anew only where there are other joints."""
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
        self._outlet = self._pylsl.StreamOutlet(info, max_buffered=SECONDS)

    def send(self, frame: Told) -> None:
        """A sample."""
        if self._outlet is None:
            return
        sample = np.full((self._channels // len(KINDS), len(KINDS)), np.nan)
        if frame.places is not None and frame.turns is not None:
            sample[:, :3], sample[:, 3:] = frame.places, Rotation.from_matrix(frame.turns).as_quat(canonical=True)
        late = frame.age if np.isfinite(frame.age) else 0.0
        self._outlet.push_sample(sample.ravel().tolist(), self._pylsl.local_clock() - late)
        self.sent += 1

    def counts(self) -> dict[str, Any]:
        """Samples."""
        return {"sent": self.sent}
