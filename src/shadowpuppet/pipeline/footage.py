"""One camera's film at the size it is worked on, its silhouettes, and a sample of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, SettingsError, SilhouetteError, choices
from shadowpuppet.io.recording import Recording, View, read_recording
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette import Segmenter, SilhouetteSettings, background_from_film, learn_background, ready_mask
from shadowpuppet.video import FrameSource, Image, camera_number, open_frames

Mask = NDArray[np.bool_]
LOOKED_AT = 1500
"""Frames of the film that a sample is taken from: a look must not take as long as the work."""
RUNS, RUN = 10, 4
"""A sample's parts, spread over these frames, and the frames of each, which follow one another."""
ROUNDING = 1e-6
"""Seconds by which a time may be off for its last digits."""
FIRST_SECONDS, FIRST = 8.0, 16
"""The film's first seconds, and how many of their frames are in a sample too."""


class Shot(NamedTuple):
    """A frame, and what is known of its silhouette."""

    time: float
    """Seconds."""
    image: Image
    ready: Image | None
    """The ready silhouette's picture, where there is one."""


@dataclass(frozen=True, eq=False)
class Footage:
    """One view of a recording; every picture that it gives has the size of `camera`."""

    recording: Recording
    view: View
    """As it lies on the disk."""
    camera: Camera
    """For frames of the size that is worked on."""
    region: tuple[slice, slice] | None = None
    """Rows and columns where the person may be; None for all."""

    def film(self) -> FrameSource:
        """The film's frames."""
        return open_frames(self.view.video, size=self.camera.size, rate=self.recording.rate)

    def shots(self, ready: bool, strict: bool = True) -> Iterator[Shot]:
        """The film's frames from the recording's time 0 on, with the ready silhouettes where asked for.

        Raises `SilhouetteError` where these end before it, or, if not `strict`, goes on without.
        """
        masks = iter(open_frames(self.view.masks, size=self.camera.size)) if ready and self.view.masks else None
        start, end = self.view.start, self.recording.duration
        for n, frame in enumerate(self.film()):
            mask, time = None if masks is None else next(masks, None), frame.time - start
            if masks is not None and mask is None and strict:
                raise SilhouetteError(f"{self.view.masks}: found {n} silhouettes, expected one for each frame of {self.view.video}")
            if end is not None and time > end - ROUNDING:
                return
            if time > -ROUNDING:
                yield Shot(max(time, 0.0), frame.image, None if mask is None else mask.image)

    def tracked(self, ready: bool, every: int) -> Iterator[Shot]:
        """Of so many of the film's `shots` one, the first on."""
        return islice(self.shots(ready), 0, None, every)

    @property
    def count(self) -> int | None:
        """How many shots there are, by what the film says of itself; None where it does not."""
        film = self.film()
        if film.count is None or not np.isfinite(film.rate):
            return film.count
        first = int(np.ceil((self.view.start - ROUNDING) * film.rate))
        last = film.count if self.recording.duration is None else int(np.ceil((self.view.start + self.recording.duration) * film.rate))
        return max(min(last, film.count) - first, 0)

    def pictures(self, source: Path, what: str) -> Iterator[Image]:
        """Pictures of the same camera from another file. Raises `RecordingError` where they are not of its size."""
        frames, (width, height) = open_frames(source), self.view.camera.size
        if frames.size != (width, height):
            raise RecordingError(f"{source}: found {what} of {frames.size[0]} x {frames.size[1]} pixels, expected {width} x {height} "
                                 "as the film: it must come from the same camera at the same setting")
        return (frame.image for frame in open_frames(source, size=self.camera.size))


def open_footage(path: str | Path, options: Options) -> Footage:
    """The film that is to be tracked. Raises `RecordingError`, `CalibrationError`, `VideoError` or `SettingsError`."""
    recording = opened(path, options)
    return footage_of(recording, _chosen(recording, options.camera), options)


def opened(path: str | Path, options: Options) -> Recording:
    """The recording, with what the options say of the person. Raises `RecordingError`, `CalibrationError` or `VideoError`."""
    fov = None if options.fov is None else float(np.radians(options.fov))
    recording = read_recording(path, fov=fov, calibration=options.calibration)
    subject = recording.subject
    return replace(recording, subject=replace(subject, height=options.height or subject.height,
                                              distance=options.distance or subject.distance))


def footage_of(recording: Recording, view: View, options: Options) -> Footage:
    """One view of a recording, as the options want it. Raises `RecordingError` or `SettingsError` where it cannot be had."""
    if camera_number(view.video) is not None:
        raise RecordingError(f"{recording.path}: found a live camera, expected a film or a folder of pictures")
    if options.background is not None:
        view = replace(view, background=options.background)
    if options.masks and view.masks is None:
        raise RecordingError(f"{recording.path}: no ready silhouettes in it, expected masks/{view.camera.name}.mkv or a folder of pictures "
                             f"masks/{view.camera.name}/; leave --masks out to make them")
    camera = view.camera.resized(worked_size(view.camera.size, options.max_size))
    return Footage(recording, view, camera, region_of(options.region, view.camera, camera))


def _chosen(recording: Recording, name: str | None) -> View:
    views = {view.camera.name: view for view in recording.views}
    if name is None and len(views) > 1:
        raise RecordingError(f"{recording.path}: found {len(views)} cameras, expected one to be chosen with --camera: {choices(views)}")
    if name is not None and name not in views:
        raise RecordingError(f"{recording.path}: camera: found {name!r}, expected one of {choices(views)}")
    return views[name] if name is not None else recording.views[0]


def worked_size(size: tuple[int, int], longest: int) -> tuple[int, int]:
    """The size that pictures of a size are scaled to, so that their longer side has at most so many pixels."""
    scale = min(1.0, longest / max(size))
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def region_of(region: tuple[int, int, int, int] | None, full: Camera, camera: Camera) -> tuple[slice, slice] | None:
    """Rows and columns of a region of interest x0,y0,x1,y1 of the `full` camera's pictures in those of the scaled one.

    Raises `SettingsError` where it is none.
    """
    if region is None:
        return None
    x0, y0, x1, y1 = region
    width, height = full.size
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise SettingsError(f"region: found {x0},{y0},{x1},{y1}, expected x0,y0,x1,y1 with 0 <= x0 < x1 <= {width} and "
                            f"0 <= y0 < y1 <= {height}, the film's size")
    sx, sy = camera.size[0] / width, camera.size[1] / height
    return slice(round(y0 * sy), max(round(y1 * sy), round(y0 * sy) + 1)), slice(round(x0 * sx), max(round(x1 * sx), round(x0 * sx) + 1))


# Samples


@dataclass(frozen=True, eq=False)
class Sample:
    """Some of a film's frames, few enough to be kept."""

    runs: list[list[Shot]]
    """Spread over the film; within each, frames follow one another."""
    starts: list[int]
    """The number of each run's first frame."""
    first: list[Shot]
    """Of the first seconds."""
    times: NDArray[np.float64]
    """Of all frames gone through, seconds."""

    @property
    def shots(self) -> list[Shot]:
        """Those of all runs, in order."""
        return [shot for run in self.runs for shot in run]

    @property
    def pace(self) -> float:
        """Median seconds from frame to frame; not a number for a single frame."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.nan

    @property
    def jitter(self) -> float:
        """Standard deviation of the seconds from frame to frame; not a number for a single frame."""
        return float(np.std(np.diff(self.times))) if len(self.times) > 1 else np.nan


def take_sample(footage: Footage, need_masks: bool = False, longest: int = LOOKED_AT) -> Sample:
    """Go once through the film's first `longest` frames. Raises `SilhouetteError` where ready masks that are needed end before."""
    film = footage.film()
    length = footage.count or (film.duration * film.rate if np.isfinite(film.duration * film.rate) else LOOKED_AT)
    wanted = _spread(min(int(length), longest))
    runs: dict[int, list[Shot]] = {}
    first, times, next_first = list[Shot](), list[float](), 0.0
    for n, shot in zip(range(longest), footage.shots(ready=True, strict=need_masks)):
        times.append(shot.time)
        if n in wanted:
            runs.setdefault(wanted[n], []).append(shot)
        if next_first <= shot.time <= FIRST_SECONDS:
            first.append(shot)
            next_first = shot.time + 0.99 * FIRST_SECONDS / FIRST
    return Sample(list(runs.values()), list(runs), first, np.array(times))


def _spread(length: int) -> dict[int, int]:
    """Numbers of the frames that are wanted, each with that of its run's first."""
    if length <= RUNS * RUN:
        return dict.fromkeys(range(max(length, 1)), 0)
    starts = np.linspace(0, length - RUN, RUNS).astype(int).tolist()
    return {start + i: start for start in reversed(starts) for i in range(RUN)}


# Silhouettes


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """Turns shots into masks: by segmentation, or by taking those that are there."""

    source: str
    """What they come from, in words."""
    segmenter: Segmenter | None
    """None where ready masks are taken."""
    region: tuple[slice, slice] | None = None
    blank: Image | None = None
    """A picture of the empty scene, which stands in for what is outside the region."""

    def __call__(self, shot: Shot) -> Mask:
        """The person's mask (H, W)."""
        if self.segmenter is None:
            return self._within(ready_mask(shot.ready if shot.ready is not None else shot.image))
        return self._within(self.segmenter(self.visible(shot.image)))

    def plain(self, shot: Shot) -> Mask | None:
        """The mask by eq. 1 alone; None where there is no standard deviation."""
        if self.segmenter is None or self.segmenter.background.frames < 2:
            return None
        return self._within(self.segmenter.raw(shot.image))

    def visible(self, image: Image) -> Image:
        """A picture with the empty scene outside the region, so that nothing there is taken for the person."""
        if self.region is None or self.blank is None:
            return image
        seen = self.blank.copy()
        seen[self.region] = image[self.region]
        return seen

    def _within(self, mask: Mask) -> Mask:
        if self.region is None:
            return mask
        out = np.zeros_like(mask)
        out[self.region] = mask[self.region]
        return out


def silhouettes(footage: Footage, sample: Sample, options: Options) -> Silhouettes:
    """Learn the background, or take ready masks. Raises `SilhouetteError` or `SettingsError`."""
    if options.masks:
        return Silhouettes(f"{_told(footage.view.masks)}, ready silhouettes", None, footage.region)
    images = [shot.image for shot in sample.shots]
    if footage.view.background is None:
        scene, source = [background_from_film(images)], "the film itself (median)"
    else:
        scene, source = footage.pictures(footage.view.background, "the empty scene"), _told(footage.view.background)
    first, scene = _peeked(iter(scene))
    seen = Silhouettes(source, None, footage.region, None if footage.region is None else first)
    segmenter = learn_background(scene, options.silhouette, film=[seen.visible(image) for image in images])
    return replace(seen, segmenter=segmenter)


def read_masks(footage: Footage, options: Options) -> Iterator[Mask]:
    """Masks (H, W) of the film's frames, one after another, as `track_recording` has them. Raises as `silhouettes`."""
    return map(silhouettes(footage, take_sample(footage, options.masks), options), footage.shots(ready=options.masks))


def clear_silhouettes(footage: Footage, sample: Sample, seen: Silhouettes, options: Options) -> Silhouettes:
    """Silhouettes that a person can be measured in: those that are tracked in, `seen`, where these are clean; otherwise clean ones.

    A filter finds a body among specks and holes once its sizes are known; sizes and postures cannot be told from them.
    """
    clean = clear_settings(options.silhouette)
    if seen.segmenter is None or clean == options.silhouette:
        return seen
    return silhouettes(footage, sample, replace(options, silhouette=clean))


def clear_settings(asked: SilhouetteSettings) -> SilhouetteSettings:
    """Settings of silhouettes that a person can be measured in: those asked for, where these make clean ones."""
    if asked.method == "averaging":
        return SilhouetteSettings()
    return asked if asked.cleaned else replace(asked, clean=None)


def _peeked(images: Iterator[Image]) -> tuple[Image | None, Iterator[Image]]:
    """The first of some pictures, and all of them."""
    first = next(images, None)
    return first, chain([] if first is None else [first], images)


def _told(path: Path | None) -> str:
    return f"{path.parent.name}/{path.name}" if path is not None else ""
