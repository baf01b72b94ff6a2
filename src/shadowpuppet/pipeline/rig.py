"""A recording's cameras, one or several: their films synchronized, decoded and segmented in parallel."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import colour_codes
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Seen, half_size
from shadowpuppet.errors import SettingsError, SilhouetteError, VideoError, warn
from shadowpuppet.io.inputs.inputs import NO_INPUTS, Inputs, inputs_of
from shadowpuppet.io.recording import Recording
from shadowpuppet.pipeline.footage import CameraFrame, Footage, camera_footage, chosen_views, open_recording
from shadowpuppet.pipeline.options import PATHS, Options
from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.threads import usable_cores
from shadowpuppet.video import Image
from shadowpuppet.video.frames import ASSUMED_RATE

if TYPE_CHECKING:
    from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints

NEAR = 0.55
"""Largest offset of a frame from the time of its set, over the sets' interval: half, and a little for jittering clocks."""
LATE = 5
"""Number of sets without a frame of a camera after which the end of its film is reported: films rarely end with the same frame."""

Segment = Callable[[CameraFrame], Segmented | None]
"""Makes the silhouette of a camera's frame, as `Silhouettes.segmented` does; None where silhouettes are no evidence."""


def unsegmented(frame: CameraFrame) -> None:
    """No silhouette: of films whose keypoints alone are evidence, or whose pictures alone are wanted."""


def shown_in(found: Sequence[Segmented | None], keypoints: tuple[Keypoints | None, ...] = ()) -> Seen:
    """What the silhouettes of a set's cameras show, and the keypoints found in its frames."""
    masks = tuple(None if each is None else each.mask for each in found)
    shadows = tuple(None if each is None or each.shadow is None else half_size(each.shadow) for each in found)
    return Seen(masks, shadows, keypoints=keypoints if any(each is not None for each in keypoints) else ())


class FrameSet(NamedTuple):
    """Frames of all cameras at one time, in the rig's order; None for a camera without a frame."""

    time: float
    """Seconds of the recording."""
    images: tuple[Image | None, ...]
    seen: Seen
    """What they show. Colours of several cameras only where they are wanted."""
    decoding: float = 0.0
    """Seconds of reading, summed over the cameras."""
    segmenting: float = 0.0
    """Seconds of making silhouettes, likewise."""
    corrected: tuple[Image | None, ...] = ()
    """Images that fit the masks, in the light of the empty scene (`Segmented.image`), at half size in those of `frame_process`; empty: not
    known."""
    points: SurfacePoints | None = None
    """Surface points of the visual hull of the silhouettes; None: not computed."""
    carving: float = 0.0
    """Seconds of computing them."""


@dataclass(frozen=True, eq=False)
class Rig:
    """The cameras of a recording, one or more."""

    recording: Recording
    footage: tuple[Footage, ...]
    """One for each camera."""
    inputs: Inputs = NO_INPUTS
    """The files that are read, as they were when the rig was opened."""

    @property
    def is_multiview(self) -> bool:
        """Whether there are two cameras or more."""
        return len(self.footage) > 1

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras for images of the working size."""
        return tuple(footage.camera for footage in self.footage)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cameras."""
        return tuple(camera.name for camera in self.cameras)

    @cached_property
    def rates(self) -> tuple[float, ...]:
        """Frames/s of the films; an assumed rate for those that do not state it."""
        stated = (footage.film.rate for footage in self.footage)
        return tuple(rate if math.isfinite(rate) else ASSUMED_RATE for rate in stated)

    @property
    def rate(self) -> float:
        """Sets/s."""
        return self.rates[self.leaders[0]]

    @property
    def count(self) -> int | None:
        """Number of sets; None if the films do not state their lengths."""
        counts = [footage.count for footage, rate in zip(self.footage, self.rates) if rate == self.rate]
        return max((count for count in counts if count is not None), default=None)

    @property
    def short(self) -> tuple[bool, ...]:
        """Whether each camera's film has at least two frames less than another: it may have lost some."""
        seconds = [math.nan if footage.count is None else footage.count / rate for footage, rate in zip(self.footage, self.rates)]
        longest = max((each for each in seconds if math.isfinite(each)), default=0.0)
        return tuple(longest - each > 1.5 / rate for each, rate in zip(seconds, self.rates))

    @cached_property
    def leaders(self) -> tuple[int, ...]:
        """Indices of the cameras, in order of preference for setting the times of the sets; the first that still has frames does. Cameras
        of the median rate come first.

        With a faster camera, slower ones would be missing from many sets; with a slower one, frames would be wasted.
        """
        middle = sorted(self.rates)[(len(self.rates) - 1) // 2]
        return tuple(sorted(range(len(self.rates)), key=lambda n: round(abs(self.rates[n] / middle - 1), 1)))


def open_rig(path: str | Path, options: Options) -> Rig:
    """Open the cameras of a recording: all, or those that `options.camera` names.

    Raises `RecordingError`, `CalibrationError`, `VideoError` or `SettingsError` if something cannot be used.
    """
    inputs = inputs_of(path, {name: getattr(options, name) for name in PATHS})
    recording = open_recording(path, options)
    views = chosen_views(recording, options.camera)
    others = [source for view in recording.views if not any(view is each for each in views)
              for source in (view.video, view.background, view.masks, view.keypoints and view.keypoints.path)]
    if options.background is not None and len(views) > 1:
        raise SettingsError(f"background: found one for {len(views)} cameras, expected one each, background/<camera>.* in the recording")
    if (options.people or 1) > 1 and len(views) == 1:
        raise SettingsError(f"people: found {options.people} for one camera, expected 1: two calibrated cameras or more track several")
    if options.region is not None and len(views) > 1:
        raise SettingsError(f"region: found a region for {len(views)} cameras, expected it with one camera only (--camera)")
    return Rig(recording, tuple(camera_footage(recording, view, options) for view in views), inputs.without(others))


def read_frames(rig: Rig, segment: Sequence[Segment], *, ready: bool = False, every: int = 1) -> Generator[FrameSet]:
    """Every `every`-th frame set with its silhouettes; frames of several cameras are aligned by `synchronized_frames`."""
    if rig.is_multiview:
        return synchronized_frames(rig, segment, ready=ready, every=every)
    return _single_frames(rig, segment[0], ready, every)


def _single_frames(rig: Rig, segment: Segment, ready: bool, every: int) -> Generator[FrameSet]:
    """One camera's frames. Raises the film's errors, as no other camera remains."""
    frames = islice(rig.footage[0].frames(ready), 0, None, every)
    while True:
        start = time.perf_counter()
        if (frame := next(frames, None)) is None:
            return
        decoded = time.perf_counter()
        found = segment(frame)
        seen = shown_in([found], keypoints=(frame.keypoints,))
        seen = seen if found is None else seen._replace(codes=(colour_codes(found.image),))
        yield FrameSet(frame.time, (frame.image,), seen, decoded - start, time.perf_counter() - decoded)


def synchronized_frames(rig: Rig, segment: Sequence[Segment], *, ready: bool = False, every: int = 1,
                        threads: int | None = None) -> Generator[FrameSet]:
    """Synchronized frame sets of all cameras with their silhouettes.

    Each set contains each camera's frame nearest to its time, within about half the sets' interval (`NEAR`). A camera is missing from the
    sets after its film breaks off or ends, which is reported once.

    Args:
        segment: makes the silhouettes, one function for each camera.
        ready: also read the recording's ready silhouettes.
        every: segment and return only every `every`-th set.
        threads: number of threads that make the next set while the last one is used; by default one less than the processor's cores. The
            sets do not depend on it.
    """
    readers = [CameraReader(footage, one, ready) for footage, one in zip(rig.footage, segment)]
    leaders, step = rig.leaders, 1 / rig.rate
    with contextlib.ExitStack() as stack:
        pool = ThreadPoolExecutor(threads or max(1, usable_cores() - 1), "camera")
        stack.callback(pool.shutdown, cancel_futures=True)
        for future in [pool.submit(reader.advance) for reader in readers]:
            future.result()
        work, n = _begin(pool, readers, leaders, step), 0
        while work is not None:
            moment, futures = work
            parts, n = [future.result() for future in futures], n + 1
            _warn_of_ends(readers, moment, step)
            work = _begin(pool, readers, leaders, step, moment, wanted=n % every == 0)
            if n % every != 1 % every:
                continue
            found = [part.segmented for part in parts]
            seen = shown_in(found, tuple(part.keypoints for part in parts))
            yield FrameSet(moment, tuple(part.image for part in parts), seen,
                           sum(part.decoding for part in parts), sum(part.segmenting for part in parts),
                           tuple(None if each is None else each.image for each in found))


class _Part(NamedTuple):
    """One camera's part of a frame set."""

    image: Image | None
    segmented: Segmented | None
    decoding: float
    segmenting: float
    keypoints: Keypoints | None


class CameraReader:
    """Reads one camera's film; `next` is the frame read last, not yet part of a set. Used by one thread at a time."""

    def __init__(self, footage: Footage, segment: Segment, ready: bool) -> None:
        """Nothing is read yet."""
        self.footage, self.segment = footage, segment
        self.next: CameraFrame | None = None
        self.last, self.trouble, self.warned = -math.inf, "", False
        self._frames = footage.frames(ready)

    def advance(self) -> None:
        """Read the next frame."""
        self.last = self.last if self.next is None else self.next.time
        try:
            self.next = next(self._frames, None)
        except (VideoError, SilhouetteError) as error:
            self.next, self.trouble = None, str(error)

    def take(self, moment: float, reach: float, leads: bool, wanted: bool) -> _Part:
        """The frame nearest to time `moment` (s), at most `reach` (s) away, or the next if this camera `leads`, and its silhouette if
        `wanted`."""
        start = time.perf_counter()
        best = self._pop() if leads else self._nearest(moment, reach)
        decoded = time.perf_counter()
        try:
            found = None if best is None or not wanted else self.segment(best)
        except SilhouetteError as error:
            best = found = None
            self.next, self.trouble = None, str(error)
        return _Part(None if best is None else best.image, found, decoded - start, time.perf_counter() - decoded,
                     None if best is None else best.keypoints)

    def _pop(self) -> CameraFrame | None:
        frame = self.next
        self.advance()
        return frame

    def _nearest(self, moment: float, reach: float) -> CameraFrame | None:
        while self.next is not None and self.next.time < moment - reach:
            self.advance()
        if self.next is None or self.next.time > moment + reach:
            return None
        best = self._pop()
        while best is not None and self.next is not None and abs(self.next.time - moment) < abs(best.time - moment):
            best = self._pop()  # the frame farther away is kept: it may belong to the next set
        return best


def _begin(pool: ThreadPoolExecutor, readers: Sequence[CameraReader], leaders: Sequence[int], step: float, last: float = -math.inf,
           wanted: bool = True):
    """Start the set after the one at `last` (s); returns its time and the futures of its parts, or None if no camera has a frame left."""
    for leader in leaders:
        reader = readers[leader]
        while leader != leaders[0] and reader.next is not None and reader.next.time <= last + NEAR * step:
            reader.advance()  # frames between two sets of the previous leader
        if reader.next is not None:
            moment = reader.next.time
            return moment, [pool.submit(reader.take, moment, NEAR * step, n == leader, wanted) for n, reader in enumerate(readers)]
    return None


def _warn_of_ends(readers: Sequence[CameraReader], moment: float, step: float) -> None:
    """Warn, once for each camera, that it has no more frames while others have."""
    for reader in readers:
        if reader.next is None and not reader.warned and (reader.trouble or moment > reader.last + LATE * step):
            reader.warned = True
            ends = reader.trouble or f"{reader.footage.view.video}: ends at {max(reader.last, 0.0):.2f} s"
            warn(f"{ends}; from there on the run goes on without camera {reader.footage.camera.name!r}")
