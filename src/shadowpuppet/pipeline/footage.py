"""One camera's film, scaled to the working size, and a sample of its frames."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.errors import RecordingError, SettingsError, SilhouetteError, choices, warn
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.masks.ready_masks import MaskKind, mask_kind, open_masks
from shadowpuppet.io.person import read_person
from shadowpuppet.io.picture_sizes import differ_by_padding
from shadowpuppet.io.recording import Recording, View, read_recording
from shadowpuppet.names import composed
from shadowpuppet.pipeline.options import Options
from shadowpuppet.video import FrameSource, Image, camera_number, fitted, open_frames, open_untimed
from shadowpuppet.video.frames import ASSUMED_RATE, ROUNDING, Wanted
from shadowpuppet.video.moments import span_of
from shadowpuppet.video.seeking import Seeker

LOOKED_AT = 1500
"""Number of frames, from the film's beginning, that a sample is taken from: examining a film must not take as long as tracking it."""
RUNS, RUN = 10, 4
"""Number of a sample's runs, spread over these frames, and of consecutive frames in each."""
RUNS_OF_SEVERAL, RUN_OF_SEVERAL = 8, 3
"""The same of each of several cameras, which show the same person. Their empty scenes are learnt from as many frames: with more, masks are
the same."""
FIRST_SECONDS, FIRST = 8.0, 16
"""Length of the film's beginning (s), and number of its frames that a sample keeps."""
OTHER_HEIGHT = 0.03
"""Difference (m) of a given height and that of given sizes from which on they are not one person's."""
SPREAD = 60
"""Number of frames, spread over the whole film, from which an empty scene is recovered."""


class CameraFrame(NamedTuple):
    """One frame of one camera."""

    time: float
    """Seconds of the recording."""
    image: Image
    ready: Image | None
    """The frame of the recording's ready silhouettes; None without these."""
    keypoints: Keypoints | None = None
    """What a detector found in it, in pixels of the image; None without a detector."""


@dataclass(frozen=True, eq=False)
class Footage:
    """One camera's view in a recording; all its images have the working size, that of `camera`."""

    recording: Recording
    view: View
    """The view as stored, at full size."""
    camera: Camera
    """The camera for images of the working size."""
    region: tuple[slice, slice] | None = None
    """Rows and columns where the person may be; None for all."""
    label: int | None = None
    """The person's label in ready silhouettes that are label images; None for the only one."""

    @cached_property
    def film(self) -> FrameSource:
        """The film; iterating over it gives its frames."""
        return open_frames(self.view.video, size=self.camera.size, rate=self.recording.rate)

    @cached_property
    def mask_kind(self) -> MaskKind:
        """How the ready silhouettes are written. Raises `SilhouetteError` or `VideoError`."""
        return MaskKind() if self.view.masks is None else mask_kind(self.view.masks, self.label)

    @cached_property
    def keypoints(self) -> FilmKeypoints | None:
        """What a detector found in the film, in pixels of full size; None without it. Raises `FormatError`."""
        return None if self.view.keypoints is None else self.view.keypoints.read(self.view.camera.size)

    def keypoints_at(self, time: float) -> Keypoints:
        """What the detector found in the frame at a time of the recording (s), in pixels of the working size."""
        assert self.keypoints is not None
        rate = self.film.rate if np.isfinite(self.film.rate) else ASSUMED_RATE
        return self.keypoints.at(round((time + self.view.start) * rate)).scaled(self.view.camera.size, self.camera.size)

    def __getstate__(self) -> dict[str, object]:
        """What another process needs, which opens the film itself."""
        return {name: value for name, value in self.__dict__.items() if name != "film"}

    def frames(self, ready: bool, strict: bool = True, wanted: Wanted = lambda _: True) -> Iterator[CameraFrame]:
        """The film's frames from the recording's begin on; with `ready`, the ready silhouettes too. `wanted`: whether a frame is, asked
        once for each, in order, with its time (s); pictures of others are not made.

        Raises `SilhouetteError` if the silhouettes end before the film does; if not `strict`, later frames have None instead.
        """
        start, begin, end = self.view.start, self.recording.begin, self.recording.duration
        read, passed = 0, 0  # masks have no times: they are counted with the frames

        def of_film(time: float) -> bool:
            nonlocal read
            read, time = read + 1, time - start
            return time > begin - ROUNDING and ((end is not None and time > end - ROUNDING) or wanted(max(time, 0.0)))

        def of_masks(_: float) -> bool:
            nonlocal passed
            passed += 1
            return passed == read

        found = self.keypoints
        ready_ones = open_masks(self.view.masks, self.mask_kind) if ready and self.view.masks is not None else None
        masks = None if ready_ones is None else fitted(ready_ones, self.camera.size, self.view.camera.size).read(of_masks)
        for frame in self.film.read(of_film):
            if end is not None and frame.time - start > end - ROUNDING:
                return
            mask = None if masks is None else next(masks, None)
            if masks is not None and mask is None and strict:
                raise SilhouetteError(f"{self.view.masks}: found {passed} silhouettes, expected one for each frame of {self.view.video}")
            keypoints = None if found is None else found.at(read - 1).scaled(self.view.camera.size, self.camera.size)
            yield CameraFrame(max(frame.time - start, 0.0), frame.image, None if mask is None else mask.image, keypoints)

    @property
    def count(self) -> int | None:
        """Number of `frames`, from the film's header; None if that does not state it."""
        film = self.film
        if film.count is None or not np.isfinite(film.rate):
            return film.count
        first = int(np.ceil((self.view.start + self.recording.begin - ROUNDING) * film.rate))
        last = film.count if self.recording.duration is None else int(np.ceil((self.view.start + self.recording.duration) * film.rate))
        return max(min(last, film.count) - first, 0)

    def empty_scene(self) -> Iterator[Image]:
        """Images of the empty scene: with several cameras a few, in runs spread over its film. Raises `RecordingError` as `pictures`
        does."""
        assert self.view.background is not None
        return self.pictures(self.view.background, "the empty scene", len(self.recording.views) > 1)

    def pictures(self, source: Path, what: str, sampled: bool = False, masks: bool = False) -> Iterator[Image]:
        """Images of the same camera, or `masks` of it, from another file, at the working size; `what` names them in messages. `sampled`:
        only those that a sample of several cameras would have.

        Raises `RecordingError` if their size is not the film's, with or without the padding of H.264.
        """
        width, height = self.view.camera.size
        frames = open_masks(source, mask_kind(source, self.label)) if masks else open_untimed(source)
        if frames.size != (width, height) and not differ_by_padding(frames.size, (width, height)):
            raise RecordingError(f"{source}: found {what} of {frames.size[0]} x {frames.size[1]} pixels, expected {width} x {height} "
                                 "as the film: it must come from the same camera at the same setting")
        frames = fitted(frames, self.camera.size, self.view.camera.size)
        if not sampled or frames.count is None:
            return (frame.image for frame in frames)
        number, wanted = itertools.count(), _spread(frames.count, RUNS_OF_SEVERAL, RUN_OF_SEVERAL)
        return (frame.image for frame in frames.read(lambda _: next(number) in wanted))


def open_footage(path: str | Path, options: Options) -> Footage:
    """The footage of a recording's only camera, or of `options.camera`.

    Raises `RecordingError`, `CalibrationError`, `VideoError` or `SettingsError`.
    """
    recording = open_recording(path, options)
    views = chosen_views(recording, options.camera)
    view, *others = views
    if others:
        raise RecordingError(f"{recording.path}: found {len(views)} cameras, expected one to be chosen with --camera: "
                             f"{choices(view.camera.name for view in views)}")
    return camera_footage(recording, view, options)


def open_recording(path: str | Path, options: Options) -> Recording:
    """Read a recording; height, distance and span in the options override its own.

    Raises `RecordingError`, `CalibrationError`, `VideoError` or `SettingsError`.
    """
    fov = None if options.fov is None else float(np.radians(options.fov))
    asked = None if options.camera is None else names_in(options.camera)
    recording = read_recording(path, fov=fov, calibration=options.calibration, asked=asked)
    subject, measured = recording.subject, None if options.person is None else read_person(options.person).height
    if options.height and measured and abs(options.height - measured) > OTHER_HEIGHT:
        raise SettingsError(f"height: found {options.height:g} m, but {options.person} has the sizes of a person of {measured:g} m: leave "
                            "one of them out")
    return cut(replace(recording, subject=replace(subject, height=options.height or measured or subject.height,
                                                  distance=options.distance or subject.distance)), options)


def cut(recording: Recording, options: Options) -> Recording:
    """The recording from `options.start` to `options.end`; frames are counted at the films' median rate.

    Raises `SettingsError` if that holds no moment of it, `VideoError` if a film cannot be opened.
    """
    if options.start is None and options.end is None:
        return recording
    views = chosen_views(recording, options.camera)
    films = [open_frames(view.video, rate=recording.rate) for view in views]
    rates = sorted(film.rate for film in films if np.isfinite(film.rate))
    rate = rates[(len(rates) - 1) // 2] if rates else np.nan
    lengths = [(film.count / film.rate if film.count else film.duration) - view.start for film, view in zip(films, views)]
    length = min(max((each for each in lengths if np.isfinite(each)), default=np.inf), recording.duration or np.inf)
    begin, end = span_of(options.start, options.end, rate, length)
    if np.isfinite(end) and end > length + 1 / (rate if np.isfinite(rate) else np.inf):
        warn(f"{recording.path}: end: found {options.end}, {end:g} s; the film ends at {length:.1f} s")
    end = min(end, recording.duration or np.inf)
    return replace(recording, begin=begin, duration=end if np.isfinite(end) else None, whole=recording)


def names_in(text: str) -> list[str]:
    """Names with commas between them."""
    return [name.strip() for name in text.split(",")]


def chosen_views(recording: Recording, names: str | None) -> tuple[View, ...]:
    """Views of the cameras `names` (separated by commas), or all. Raises `RecordingError` for unknown or repeated names."""
    views = {composed(view.camera.name): view for view in recording.views}
    asked = list(views) if names is None else [*map(composed, names_in(names))]
    for name in asked:
        if name not in views or asked.count(name) > 1:
            raise RecordingError(f"{recording.path}: camera: found {names!r}, expected one of {choices(views)}; or some, each once, "
                                 "with commas between")
    return tuple(views[name] for name in views if name in asked)


def camera_footage(recording: Recording, view: View, options: Options) -> Footage:
    """The footage of one view with the options applied. Raises `RecordingError` or `SettingsError` if that is impossible."""
    if camera_number(view.video) is not None:
        raise RecordingError(f"{recording.path}: found a live camera, expected a film or a folder of pictures")
    if options.background is not None:
        view = replace(view, background=options.background)
    if options.masks and view.masks is None:
        raise RecordingError(f"{recording.path}: no ready silhouettes in it, expected masks/{view.camera.name}.mkv or a folder of pictures "
                             f"masks/{view.camera.name}/; leave --masks out to make them")
    if options.evidence is not None and "keypoints" in options.evidence and view.keypoints is None:
        raise RecordingError(f"{recording.path}: no keypoints of camera {view.camera.name!r} in it, expected "
                             f"keypoints/{view.camera.name}.npz or another detector's file; leave --evidence out to do without")
    if not options.uses_keypoints:
        view = replace(view, keypoints=None)
    camera = view.camera.resized(worked_size(view.camera.size, options.max_size))
    return Footage(recording, view, camera, region_of(options.region, view.camera, camera), options.label)


def worked_size(size: tuple[int, int], longest: int) -> tuple[int, int]:
    """Width and height scaled down so that the longer one is at most `longest` pixels."""
    scale = min(1.0, longest / max(size))
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def region_of(region: tuple[int, int, int, int] | None, full: Camera, camera: Camera) -> tuple[slice, slice] | None:
    """Rows and columns, in images of the scaled `camera`, of a region x0,y0,x1,y1 in images of the `full` camera.

    Raises `SettingsError` if the region is not inside the image.
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
    """A sample of a film's frames, small enough to be kept in memory."""

    runs: list[list[CameraFrame]]
    """Runs of consecutive frames, spread over the film."""
    starts: list[int]
    """Frame number of each run's first frame."""
    first: list[CameraFrame]
    """Frames of the first seconds."""
    times: NDArray[np.float64]
    """Times of all frames that were read, seconds."""

    @property
    def frames(self) -> list[CameraFrame]:
        """The frames of all runs, in order."""
        return [frame for run in self.runs for frame in run]

    @property
    def pace(self) -> float:
        """Median interval of the frames (s); NaN for a single frame."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.nan

    @property
    def jitter(self) -> float:
        """Standard deviation of the frames' interval (s); NaN for a single frame."""
        return float(np.std(np.diff(self.times))) if len(self.times) > 1 else np.nan


class Opening(NamedTuple):
    """Which frames of a film's beginning a sample keeps."""

    seconds: float
    every: int
    """Every `every`-th frame is kept."""
    number: int
    """Greatest number that is kept."""

    def has(self, frame: int, seconds: float) -> bool:
        """Whether it has a frame, counted from 0, that comes some seconds after the first moment used; always the first frame."""
        return frame == 0 or (frame % self.every == 0 and frame < self.every * self.number and seconds <= self.seconds)


def take_sample(footage: Footage, need_masks: bool = False, longest: int = LOOKED_AT, opening: Opening | None = None) -> Sample:
    """Sample the film's first `longest` frames, reading them once. `opening`: frames to keep of the beginning of one of several cameras'
    films; None for `FIRST` frames, evenly spread over `FIRST_SECONDS`. With `need_masks`, raises `SilhouetteError` if ready silhouettes are
    missing."""
    film = footage.film
    length = footage.count or (film.duration * film.rate if np.isfinite(film.duration * film.rate) else LOOKED_AT)
    wanted = _spread(min(int(length), longest), *((RUNS, RUN) if opening is None else (RUNS_OF_SEVERAL, RUN_OF_SEVERAL)))
    runs: dict[int, list[CameraFrame]] = {}
    first, times, begin = list[CameraFrame](), list[float](), footage.recording.begin
    next_first = begin

    def is_first(time: float) -> bool:
        """Whether the frame read last, of that time (s), is kept as one of the beginning."""
        return (next_first <= time <= begin + FIRST_SECONDS) if opening is None else opening.has(len(times) - 1, time - begin)

    def kept(time: float) -> bool:
        times.append(time)
        return len(times) - 1 in wanted or is_first(time) or len(times) == longest

    for frame in footage.frames(ready=True, strict=need_masks, wanted=kept):
        if (n := len(times) - 1) in wanted:
            runs.setdefault(wanted[n], []).append(frame)
        if is_first(frame.time):
            first.append(frame if need_masks else frame._replace(ready=None))
            next_first = frame.time + 0.99 * FIRST_SECONDS / FIRST
        if len(times) == longest:
            break
    return Sample(list(runs.values()), list(runs), first, np.array(times))


def spread_frames(footage: Footage, number: int = SPREAD) -> list[Image]:
    """`number` images spread over the whole film, or all if there are fewer, found by seeking; none if the film does not state its
    length. If only a part of the recording is used, those of all of it: a person hardly moves in a few seconds."""
    footage = replace(footage, recording=footage.recording.whole or footage.recording)
    film, length = footage.film, footage.count
    if length is None or not np.isfinite(film.rate):
        return []
    wanted = np.unique(np.linspace(0, max(length - 1, 0), number).round())
    with Seeker(Path(str(footage.view.video)), footage.camera.size, footage.recording.rate) as seeker:
        found = (seeker.at(footage.view.start + footage.recording.begin + float(n) / film.rate) for n in wanted)
        return [image for image in found if image is not None]


def _spread(length: int, runs: int = RUNS, run: int = RUN) -> dict[int, int]:
    """Maps the number of each sampled frame to the number of its run's first frame."""
    if length <= runs * run:
        return dict.fromkeys(range(max(length, 1)), 0)
    starts = np.linspace(0, length - run, runs).astype(int).tolist()
    return {start + i: start for start in reversed(starts) for i in range(run)}
