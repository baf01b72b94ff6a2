"""Chosen frames of a film: all packets are read, but only those decoded that a chosen frame needs.

Packets state the times of their frames, so that a frame can be chosen before it is decoded. Decoding then begins at the last key frame
before it, and leaves out frames that no other refers to.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from fractions import Fraction

    from av import Packet, VideoFrame
    from av.container import InputContainer
    from av.video.stream import VideoStream

ONE_BY_ONE = ("h264", "hevc", "ffv1", "mjpeg")
"""Codecs in which each packet holds exactly one displayed frame."""
HELD = 600
"""Greatest number of packets kept undecoded while no frame is chosen: a film may have a single key frame."""
MOST_REORDERED = 16
"""Greatest number of frames that H.264 and H.265 hold back to show them in order."""


class Irregular(Exception):
    """The packets do not tell which frames come when, or one cannot be decoded: the film is to be decoded from its start."""


class Stamp(NamedTuple):
    """Times of a frame, as `VideoFrame` has them."""

    pts: int
    dts: int | None
    time_base: Fraction | None


Stamped: TypeAlias = "Stamp | VideoFrame"
Select: TypeAlias = "Callable[[InputContainer, VideoStream, Callable[[Stamped], bool]], Iterator[VideoFrame]]"
"""From an open film and whether a frame is wanted, asked once for each in order, to the frames that are."""


def chosen(container: InputContainer, stream: VideoStream, wanted: Callable[[Stamped], bool]) -> Iterator[VideoFrame]:
    """The frames that are `wanted`, asked once for each frame of a film, in order of presentation. Raises `Irregular`."""
    import av.error

    if stream.codec_context.name not in ONE_BY_ONE:
        raise Irregular
    reader = _Reader(container, stream)
    try:
        for pts in reader.times():
            if wanted(Stamp(pts, None, stream.time_base)):
                yield reader.frame(pts)
    except (OSError, av.error.FFmpegError) as error:
        raise Irregular from error


class _Reader:
    """Packets in order of decoding, and the frames of those that were decoded."""

    def __init__(self, container: InputContainer, stream: VideoStream) -> None:
        self.codec, self.packets = stream.codec_context, container.demux(stream)
        self.held: deque[Packet] = deque()
        self.keys: deque[Packet] = deque()
        """Packets not yet decoded, and the key frames among them."""
        self.coming = list[int]()
        """Heap of the times (pts) of packets whose frames were not yet presented."""
        self.frames: deque[VideoFrame] = deque()
        self.last_dts: int | None = None
        self.ended = self.drained = False

    def times(self) -> Iterator[int]:
        """Times (pts) of all frames, in order: one is certain once a packet is decoded later than it is shown."""
        self._read()
        last = _time(self.held[0]) - 1 if self.held else 0  # a first frame that is no key frame, and cannot be decoded, comes before it
        while True:
            while not self.ended and not (self.coming and self.last_dts is not None and self.coming[0] <= self.last_dts):
                self._read()
            if not self.coming:
                return
            pts = heapq.heappop(self.coming)
            if pts <= last:
                raise Irregular
            self._leave_out(pts)
            yield pts
            last = pts

    def frame(self, pts: int) -> VideoFrame:
        """The frame of a time that is not before the last request's."""
        while not self.frames:
            if not self.held and not self.ended:
                self._read()
            if self.held:
                self._decode(pts)
            elif self.drained:
                raise Irregular
            elif self.ended:
                self.drained = True
                self._keep(self.codec.decode(None), pts)
        if self.frames[0].pts != pts:
            raise Irregular
        return self.frames.popleft()

    def _read(self) -> None:
        """Read one packet."""
        packet = next(self.packets, None)
        if packet is None or (packet.dts is None and not packet.size):
            self.ended = True
            return
        if packet.pts is None or not packet.size or packet.is_corrupt or packet.is_discard or not self._follows(packet):
            raise Irregular
        self.last_dts = packet.dts
        self.held.append(packet)
        if packet.is_keyframe:
            self.keys.append(packet)
        heapq.heappush(self.coming, packet.pts)

    def _follows(self, packet: Packet) -> bool:
        """Whether a packet is the first, of a key frame, or is decoded later than the last; Matroska leaves out the first such times."""
        if packet.dts is None or self.last_dts is None:
            return self.last_dts is None and (bool(self.held) or packet.is_keyframe) and len(self.held) <= MOST_REORDERED
        return packet.dts > self.last_dts

    def _leave_out(self, pts: int) -> None:
        """Leave out what no frame from `pts` on needs: frames before it, and packets before its key frame."""
        key = None
        while self.keys and _time(self.keys[0]) <= pts:
            key = self.keys.popleft()
        if key is not None and key is not self.held[0]:
            self.codec.flush_buffers()
            self.frames.clear()
            while self.held[0] is not key:
                self.held.popleft()
        while self.frames and _time(self.frames[0]) < pts:
            self.frames.popleft()
        while len(self.held) > HELD:
            self._decode(pts)

    def _decode(self, pts: int) -> None:
        """Decode one packet; not its frame if that comes before `pts` and no other refers to it."""
        packet = self.held.popleft()
        if self.keys and self.keys[0] is packet:
            self.keys.popleft()
        self.codec.skip_frame = "NONREF" if _time(packet) < pts else "DEFAULT"
        self._keep(packet.decode(), pts)

    def _keep(self, frames: list[VideoFrame], pts: int) -> None:
        """Keep decoded frames that are not before `pts`."""
        if any(frame.is_corrupt for frame in frames):
            raise Irregular
        self.frames.extend(frame for frame in frames if _time(frame) >= pts)


def _time(shown: Packet | VideoFrame) -> int:
    """The time (pts) of a packet's frame, or of a frame. Raises `Irregular` if it has none."""
    if shown.pts is None:
        raise Irregular
    return shown.pts
