"""Several cameras around one person: their films in step, decoded and turned into silhouettes side by side."""

from __future__ import annotations

import contextlib
import math
import time
import warnings
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, SettingsError, ShadowPuppetWarning, SilhouetteError, VideoError, choices
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.pipeline.footage import Footage, Mask, Shot, footage_of, opened
from shadowpuppet.pipeline.options import Options
from shadowpuppet.threads import usable_cores
from shadowpuppet.video import Image
from shadowpuppet.video.frames import ASSUMED_RATE

NEAR = 0.55
"""How far a frame may be from the time of its set, over the time from set to set: half, and a little for clocks that tremble."""
LATE = 5
"""Sets without a picture of a camera whose film is over, after which that is said: films rarely end with the same frame."""


class FrameSet(NamedTuple):
    """What the cameras saw at one time, in their order; None for one that has no picture of it."""

    time: float
    """Seconds of the recording."""
    images: tuple[Image | None, ...]
    masks: tuple[Mask | None, ...]
    """The person's (H, W)."""
    decoding: float
    """Seconds that reading took, of all cameras together."""
    segmenting: float
    """Seconds that making silhouettes took."""


@dataclass(frozen=True, eq=False)
class Rig:
    """The cameras of a recording."""

    recording: Recording
    footage: tuple[Footage, ...]
    """One a camera, two or more."""

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """At the size that is worked on."""
        return tuple(footage.camera for footage in self.footage)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the cameras."""
        return tuple(camera.name for camera in self.cameras)

    @cached_property
    def rates(self) -> tuple[float, ...]:
        """Frames/s that the films tell of themselves, or what is assumed of those that do not."""
        told = (footage.film().rate for footage in self.footage)
        return tuple(rate if math.isfinite(rate) else ASSUMED_RATE for rate in told)

    @property
    def rate(self) -> float:
        """Sets/s."""
        return self.rates[self.leaders[0]]

    @property
    def count(self) -> int | None:
        """How many sets there are, as far as the films say."""
        counts = [footage.count for footage, rate in zip(self.footage, self.rates) if rate == self.rate]
        return max((count for count in counts if count is not None), default=None)

    @cached_property
    def leaders(self) -> tuple[int, ...]:
        """Cameras by whose clock sets are made, the first of them that still has pictures: of the middle rate, others after them.

        At a faster one's clock the slower cameras would be missing from every second set; a slower one's would waste pictures.
        """
        middle = sorted(self.rates)[(len(self.rates) - 1) // 2]
        return tuple(sorted(range(len(self.rates)), key=lambda n: round(abs(self.rates[n] / middle - 1), 1)))


def open_rig(path: str | Path, options: Options) -> Rig:
    """Two or more cameras of a recording: all, or those that `options.camera` names.

    Raises `RecordingError`, `CalibrationError`, `VideoError` or `SettingsError` where something cannot be used.
    """
    recording = opened(path, options)
    views = chosen_views(recording, options.camera)
    if len(views) < 2:
        raise RecordingError(f"{recording.path}: found one camera, expected two or more")
    if options.background is not None:
        raise SettingsError(f"background: found one for {len(views)} cameras, expected one each, background/<camera>.* in the recording")
    if options.region is not None:
        raise SettingsError(f"region: found one for {len(views)} cameras, expected none: it serves a single camera")
    return Rig(recording, tuple(footage_of(recording, view, options) for view in views))


def chosen_views(recording: Recording, names: str | None) -> tuple[View, ...]:
    """The views of cameras named with commas between; all, if none are. Raises `RecordingError` for names that are not there."""
    views = {view.camera.name: view for view in recording.views}
    asked = [name.strip() for name in names.split(",")] if names is not None else list(views)
    for name in asked:
        if name not in views or asked.count(name) > 1:
            raise RecordingError(f"{recording.path}: camera: found {names!r}, expected one of {choices(views)}; or some, each once, "
                                 "with commas between")
    return tuple(views[name] for name in views if name in asked)


def follow(rig: Rig, seen: Sequence[Callable[[Shot], Mask]], *, ready: bool = False, every: int = 1,
           threads: int | None = None) -> Generator[FrameSet]:
    """All that the cameras saw, set by set, with the silhouettes that `seen` (one a camera) makes of it.

    Pictures belong to one set that are nearest to its time, within half the time from set to set. A camera whose film breaks off or
    ends is missing from there on, which is said once. `ready`: the recording's ready silhouettes are read too. `every`: of so many sets
    one is given, and only in its pictures silhouettes are made. The cameras of a set are worked on side by side, while the one before is
    used, by `threads`: if left out, as many as the processor has cores, less one that tracks. The sets are the same for any number. A set
    is held at a time, and the next.
    """
    reels = [_Reel(footage, see, ready) for footage, see in zip(rig.footage, seen)]
    leaders, step = rig.leaders, 1 / rig.rate
    with contextlib.ExitStack() as stack:
        pool = ThreadPoolExecutor(threads or max(1, usable_cores() - 1), "camera")
        stack.callback(pool.shutdown, cancel_futures=True)
        for future in [pool.submit(reel.advance) for reel in reels]:
            future.result()
        work, n = _begin(pool, reels, leaders, step), 0
        while work is not None:
            moment, futures = work
            taken, n = [future.result() for future in futures], n + 1
            _tell(reels, moment, step)
            work = _begin(pool, reels, leaders, step, moment, wanted=n % every == 0)
            if n % every != 1 % every:
                continue
            yield FrameSet(moment, tuple(t.image for t in taken), tuple(t.mask for t in taken), sum(t.decoding for t in taken),
                           sum(t.segmenting for t in taken))


class _Taken(NamedTuple):
    """What one camera gives to a set."""

    image: Image | None
    mask: Mask | None
    decoding: float
    segmenting: float


class _Reel:
    """One camera's film as it is read; `next` is the shot that waits. Used by one thread at a time."""

    def __init__(self, footage: Footage, see: Callable[[Shot], Mask], ready: bool) -> None:
        self.footage, self.see = footage, see
        self.next: Shot | None = None
        self.last, self.trouble, self.told = -math.inf, "", False
        self._shots = footage.shots(ready)

    def advance(self) -> None:
        """Read on."""
        self.last = self.last if self.next is None else self.next.time
        try:
            self.next = next(self._shots, None)
        except (VideoError, SilhouetteError) as error:
            self.next, self.trouble = None, str(error)

    def take(self, moment: float, reach: float, leads: bool, wanted: bool) -> _Taken:
        """The silhouette of the shot that is nearest to a moment (s), within reach (s); the leading camera's own is the next.

        None is made where it is not wanted.
        """
        start = time.perf_counter()
        best = self._pop() if leads else self._nearest(moment, reach)
        read = time.perf_counter()
        try:
            mask = None if best is None or not wanted else self.see(best)
        except SilhouetteError as error:
            best = mask = None
            self.next, self.trouble = None, str(error)
        seen = time.perf_counter()
        return _Taken(None if best is None else best.image, mask, read - start, seen - read)

    def _pop(self) -> Shot | None:
        shot = self.next
        self.advance()
        return shot

    def _nearest(self, moment: float, reach: float) -> Shot | None:
        while self.next is not None and self.next.time < moment - reach:
            self.advance()
        if self.next is None or self.next.time > moment + reach:
            return None
        best = self._pop()
        while best is not None and self.next is not None and abs(self.next.time - moment) < abs(best.time - moment):
            best = self._pop()  # what is farther waits: it may belong to the next set
        return best


def _begin(pool: ThreadPoolExecutor, reels: Sequence[_Reel], leaders: Sequence[int], step: float, last: float = -math.inf,
           wanted: bool = True):
    """The set after the one at `last` (s): its time and the work on it under way; None where no camera has a picture left."""
    for leader in leaders:
        reel = reels[leader]
        while leader != leaders[0] and reel.next is not None and reel.next.time <= last + NEAR * step:
            reel.advance()  # between two sets of the leader before it
        if reel.next is not None:
            moment = reel.next.time
            return moment, [pool.submit(reel.take, moment, NEAR * step, n == leader, wanted) for n, reel in enumerate(reels)]
    return None


def _tell(reels: Sequence[_Reel], moment: float, step: float) -> None:
    """Say of each camera, once, that it has no more pictures where others have."""
    for reel in reels:
        if reel.next is None and not reel.told and (reel.trouble or moment > reel.last + LATE * step):
            reel.told = True
            ends = reel.trouble or f"{reel.footage.view.video}: ends at {max(reel.last, 0.0):.2f} s"
            warnings.warn(f"{ends}; from there on the run goes on without camera {reel.footage.camera.name!r}", ShadowPuppetWarning,
                          stacklevel=3)
