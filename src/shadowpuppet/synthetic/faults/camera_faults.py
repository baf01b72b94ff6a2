"""All faults of one camera, applied in the order of a real one: tripod, shutter, lens and light, sensor, timing, compression."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.faults.fault import Fault
from shadowpuppet.synthetic.faults.kinds import KINDS, LightMoment
from shadowpuppet.synthetic.viewpoint import sees_everywhere

MARGIN_STEP = 16
"""Margins are multiples of this, so that grids that divide the picture fall on the same pixels."""
Along = TypeVar("Along")


class DrawnFault(NamedTuple):
    """A fault with its random numbers for one camera."""

    fault: Fault
    chance: Array
    """Of shape (4,), 0 to 1."""
    number: int
    """Its place in the spec's list."""


class CameraFaults:
    """The faults of one camera's film."""

    def __init__(self, faults: Sequence[Fault], camera: Camera, count: int, rate: float, rng: np.random.Generator, hz: float = 1.7) -> None:
        """count: frames of the world, at `rate` frames per second; hz: frequency of flicker.

        Each fault has random numbers of its own: another fault before it does not change them. Raises `SettingsError` if a fault begins
        after the film, if no frame is left of it, or if a displaced picture reaches beyond the lens.
        """
        self.camera, self.rate, self.count, self.hz = camera, rate, count, hz
        self.last = (count - 1) / rate
        own = [(n, fault, one) for n, (fault, one) in enumerate(zip(faults, rng.spawn(len(faults)))) if fault.is_of(camera.name)]
        for n, fault, _ in own:
            if fault.begin > self.last + 1e-9:
                raise SettingsError(f"faults.{n}: begin: found {fault.begin:g} s, after the film's last frame at {self.last:g} s")
        self._placed = [DrawnFault(fault, one.random(4), n) for n, fault, one in own]
        self.moves = self._moves(own)
        self.margin = self._margin()
        self._check_lens(own)
        self.sources = self._sources(own)
        """Number of the world's frame that each frame of the film shows."""

    def _shares(self, fault: Fault) -> Array:
        return np.array([fault.share(n / self.rate, self.last) for n in range(self.count)])

    def _moves(self, own: Sequence[tuple[int, Fault, np.random.Generator]]) -> Array:
        """Displacement of the picture's content by frame, of shape (T, 3): to the right and down in pixels, clockwise in radians."""
        moves = np.zeros((self.count, 3))
        for _, fault, rng in own:
            if (move := KINDS[fault.kind].displacement) is not None:
                toward, turn = move(self.count, self.rate, rng)
                c, s = np.cos(np.radians(fault.direction_deg)), np.sin(np.radians(fault.direction_deg))
                shifted = fault.strength * toward @ np.array([[c, s], [-s, c]])
                moves += self._shares(fault)[:, None] * np.column_stack([shifted, np.radians(fault.roll_deg) * turn])
        return moves

    def _margin(self) -> int:
        """Pixels beyond the picture on all sides that displaced pictures show; 0 if there are none."""
        farthest = float((np.hypot(*self.moves[:, :2].T) + np.abs(self.moves[:, 2]) * np.hypot(*self.camera.size) / 2).max())
        return 0 if farthest == 0 else MARGIN_STEP * int(np.ceil((farthest + 3) / MARGIN_STEP))

    def _check_lens(self, own: Sequence[tuple[int, Fault, np.random.Generator]]) -> None:
        bent = bool(self.camera.distortion.any()) or self.camera.fisheye
        if self.margin and bent and not sees_everywhere(self.wide_camera()):
            n, fault = next((n, fault) for n, fault, _ in own if KINDS[fault.kind].displacement is not None)
            raise SettingsError(f"faults.{n}: amount: found {fault.strength:g} pixels of {fault.kind}, expected fewer: the lens of "
                                f"{self.camera.name!r} does not show {self.margin} pixels beyond its picture")

    def _sources(self, own: Sequence[tuple[int, Fault, np.random.Generator]]) -> list[int]:
        sources = list(range(self.count))
        for _, fault, rng in own:
            if (change := KINDS[fault.kind].timing) is not None:
                here = [n for n in range(len(sources)) if fault.share(n / self.rate, self.last)]
                if here:
                    sources = change(sources, here[0], here[-1] + 1, fault.strength, rng)
        if not sources:
            raise SettingsError("faults: dropped: all frames of the film are missing, expected one to be left")
        return sources

    def wide_camera(self) -> Camera:
        """The camera with the margin on all sides of its picture."""
        if not self.margin:
            return self.camera
        matrix = self.camera.matrix.copy()
        matrix[:2, 2] += self.margin
        width, height = self.camera.size
        return replace(self.camera, size=(width + 2 * self.margin, height + 2 * self.margin), matrix=matrix)

    def cropped(self, picture: np.ndarray) -> np.ndarray:
        """A picture (H, W, ...) of the wide camera without its margin: the view before the camera was moved."""
        return picture[self.margin : len(picture) - self.margin, self.margin : picture.shape[1] - self.margin]

    def displaced(self, picture: np.ndarray, index: int) -> np.ndarray:
        """The moved camera's part, in frame `index`, of a wide picture (H, W, 3) of light or a mask (H, W)."""
        import cv2

        if not self.margin:
            return picture
        x, y, turn = self.moves[index]
        if not (x or y or turn):
            return self.cropped(picture)
        c, s = np.cos(turn), np.sin(turn)
        back = np.array([[c, s], [-s, c]])
        centre = (np.array(self.camera.size) - 1) / 2
        start = centre + self.margin - back @ (centre + np.array([x, y]))
        how = cv2.INTER_NEAREST if picture.ndim == 2 else cv2.INTER_CUBIC
        return np.asarray(cv2.warpAffine(picture, np.column_stack([back, start]), self.camera.size, flags=how | cv2.WARP_INVERSE_MAP,
                                         borderMode=cv2.BORDER_REPLICATE))

    def blurred(self, pictures: Iterator[tuple[Array, Along]]) -> Iterator[tuple[Array, Along]]:
        """Pictures (H, W, 3) of the whole film with motion blur, and what came with each."""
        blurs = [fault for fault, *_ in self._of("motion_blur")]
        spans = np.max([1 + self._shares(fault) * (fault.strength - 1) for fault in blurs] or [[1]], axis=0)
        return averaged(pictures, [round(span) for span in spans]) if blurs else pictures

    def timed(self, frames: Iterator[Along]) -> Iterator[Along]:
        """The world's frames in the film's order: some missing, repeated or late."""
        return frames if self.sources == list(range(self.count)) else rearranged(frames, self.sources)

    def lit(self, light: Array, index: int | None, seconds: float) -> Array:
        """Light (H, W, 3) as the lens and the changed lamps give it to the sensor; index None: in the film of the empty scene."""
        for fault, chance, _ in self._placed:
            change, share = KINDS[fault.kind].light, self._share_at(fault, index)
            if change is not None and share:
                light = change(light, fault.strength, LightMoment(share, seconds, self.hz, chance))
        return light

    def noise(self, own: float, index: int | None) -> float:
        """Standard deviation of the sensor's noise, grey levels, in place of the scene's `own`."""
        further = [fault.strength * self._share_at(fault, index) for fault, *_ in self._of("noise")]
        return float(np.sqrt(own**2 + np.sum(np.square(further)))) if any(further) else own

    def is_black(self, index: int) -> bool:
        """Whether nothing can be seen in a frame."""
        return any(self._share_at(fault, index) for fault, *_ in self._of("black"))

    def absent(self) -> np.ndarray:
        """Whether the person is away, by frame of the world, of shape (T,), true or false."""
        return np.any([np.zeros(self.count), *(self._shares(fault) for fault, *_ in self._of("absent"))], axis=0)

    def crf(self, own: int, empty: bool) -> int:
        """Constant rate factor of the film, or of the empty scene's, in place of the scene's `own`."""
        given = [round(fault.strength) for fault, *_ in self._of("crf") if fault.empty or not empty]
        return given[-1] if given else own

    def _share_at(self, fault: Fault, index: int | None) -> float:
        return float(fault.empty) if index is None else fault.share(index / self.rate, self.last)

    def _of(self, kind: str) -> list[DrawnFault]:
        return [one for one in self._placed if one.fault.kind == kind]


def averaged(pictures: Iterable[tuple[Array, Along]], spans: Sequence[int]) -> Iterator[tuple[Array, Along]]:
    """Each picture (H, W, 3) averaged over `spans` consecutive ones, half of them before it, and what came with it.

    Spans reach no farther than the first and the last picture; only those still needed are kept.
    """
    kept, source, read = deque[tuple[Array, Along]](), iter(pictures), 0
    for index, span in enumerate(spans):
        first = max(index - span // 2, 0)
        after = min(index - span // 2 + span, len(spans))
        while read < after:
            kept.append(next(source))
            read += 1
        picture, along = kept[index - read]
        if span > 1:
            window = [kept[n - read][0] for n in range(first, after)]
            picture = np.sum(window, axis=0) / len(window)
        yield picture, along
        needed = min((n - each // 2 for n, each in enumerate(spans[index + 1 : index + 1 + max(spans)], index + 1)), default=read)
        while kept and read - len(kept) < needed:
            kept.popleft()


def rearranged(frames: Iterable[Along], sources: Sequence[int]) -> Iterator[Along]:
    """Frames in the order of `sources`, numbers of the given frames; only those still needed are kept."""
    last_use = {source: n for n, source in enumerate(sources)}
    kept, given = dict[int, Along](), enumerate(frames)
    for n, source in enumerate(sources):
        while source not in kept:
            number, frame = next(given)
            if number in last_use:
                kept[number] = frame
        yield kept[source]
        kept = {number: frame for number, frame in kept.items() if last_use[number] > n}
