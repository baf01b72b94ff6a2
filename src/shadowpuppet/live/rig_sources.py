"""Opens the sources of a session with several cameras: films played together or live cameras, their calibration and empty scenes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, RecordingError, SettingsError, choices
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.live.base_session import Pictures
from shadowpuppet.live.phases import KEPT
from shadowpuppet.live.rig_capture import RigCapture, SnapshotSet
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.pipeline.footage import Footage, camera_footage, cut, names_in
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import Rig, open_rig, synchronized_frames
from shadowpuppet.silhouette.background import sample_frames
from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.video import FrameSource, Image, Size, open_frames
from shadowpuppet.video.capture import CameraCapture
from shadowpuppet.video.live_source import ADDRESS, Feed, corrected, film_feed, open_feed


class RigSources(NamedTuple):
    """Several opened cameras, with calibration, empty scenes and the person's height."""

    capture: RigCapture | CameraCapture
    cameras: tuple[Camera, ...]
    """The cameras for pictures of full size."""
    sizes: tuple[Size, ...]
    """Sizes of the pictures that `capture` gives."""
    rate: float
    """Sets of pictures/s."""
    live: bool
    """False for films."""
    scenes: list[list[Image]]
    """Pictures of each camera's empty scene, of the working size; empty if they must be learnt."""
    height: float | None
    """Height of the person, metres; None if the recording does not state it."""


def is_rig(source: str) -> bool:
    """Whether a source stands for several cameras: names separated by commas, or the folder of a recording."""
    path = Path(source)
    return (path / "video").is_dir() if path.exists() else len(names_in(source)) > 1


def sources_of(source: str) -> tuple[Path, ...]:
    """The films and folders that a source names, or the recording; none for cameras and streams."""
    path = Path(source)
    return (path,) if os.path.exists(path) else tuple(Path(part) for part in names_in(source) if os.path.exists(part))


def open_rig_sources(options: Options, settings: LiveSettings) -> RigSources:
    """Open several cameras, streams or films. Raises a `ShadowPuppetError` if something cannot be used."""
    if options.region is not None or options.background is not None:
        raise SettingsError(f"{'region' if options.region else 'background'}: found one for several cameras, expected none")
    if Path(settings.camera).is_dir():
        return _films(_recorded(settings.camera, options), options, settings)
    names = names_in(settings.camera)
    cameras = _calibrated(options, len(names))
    if any(name.isdecimal() or ADDRESS.match(name) for name in names):
        feeds = [open_feed(name, rate=settings.rate, speed=settings.speed, start=options.start, end=options.end) for name in names]
        return _feeds(corrected(feeds, settings.delay), cameras, settings.delay)
    recording = Recording(Path(settings.camera), "live", tuple(map(View, cameras, map(Path, names))), rate=settings.rate)
    for view in recording.views:
        _check_size(view.camera, open_frames(view.video).size)
    recording = cut(recording, options)
    return _films(Rig(recording, tuple(camera_footage(recording, view, options) for view in recording.views)), options, settings)


def _recorded(folder: str, options: Options) -> Rig:
    rig = open_rig(folder, options)
    if not rig.is_multiview:
        raise RecordingError(f"{folder}: found the recording of one camera, expected several; play its film")
    return rig


def _calibrated(options: Options, count: int) -> tuple[Camera, ...]:
    """The cameras of the calibration, in its order, which must be that of the sources. Raises `CalibrationError`."""
    if options.calibration is None:
        raise CalibrationError(f"found {count} cameras without a calibration, expected one that knows where they stand; give --calibration")
    cameras = tuple(read_calibration(options.calibration))
    if len(cameras) != count:
        raise CalibrationError(f"{options.calibration}: found the cameras {choices(camera.name for camera in cameras)}, expected {count}, "
                               "in the order of --camera")
    return cameras


def _check_size(camera: Camera, size: Size) -> None:
    if camera.size != size:
        raise CalibrationError(f"camera {camera.name!r}: size: found {camera.size[0]} x {camera.size[1]} pixels in the calibration, "
                               f"expected {size[0]} x {size[1]} as the camera gives them")


def _feeds(feeds: list[Feed], cameras: tuple[Camera, ...], delays: tuple[float, ...]) -> RigSources:
    for camera, feed in zip(cameras, feeds):
        _check_size(camera, feed.size)
    rates = [feed.rate for feed in feeds if np.isfinite(feed.rate)]
    rate = min(rates) if rates else 30.0
    return RigSources(RigCapture(feeds, delays), cameras, tuple(feed.size for feed in feeds), rate, True, [], None)


def _films(rig: Rig, options: Options, settings: LiveSettings) -> RigSources:
    if settings.delay:
        raise SettingsError(f"delay: found {settings.delay} for films, expected cameras or streams; [start] in recording.toml is for films")
    scenes = [_scene(footage) for footage in rig.footage]
    cameras = tuple(footage.view.camera for footage in rig.footage)
    sizes = tuple(camera.size for camera in rig.cameras)
    return RigSources(CameraCapture(film_set_feed(rig, settings.speed)), cameras, sizes, rig.rate * settings.speed, False,
                      scenes if all(scenes) else [], rig.recording.subject.height)


def _scene(footage: Footage) -> list[Image]:
    background = footage.view.background
    return [] if background is None else sample_frames(footage.pictures(background, "the empty scene"), KEPT)


@dataclass(frozen=True)
class _FilmSet:
    """Synchronized films as one film: yields times (s) and tuples of pictures, one for each camera (None if it has none then)."""

    rig: Rig
    name: str
    size: Size
    rate: float

    def __iter__(self) -> Iterator[tuple[float, Pictures]]:
        for each in synchronized_frames(self.rig, [lambda _: Segmented(np.zeros((0, 0), bool))] * len(self.rig.footage)):
            yield each.time, each.images




def film_set_feed(rig: Rig, speed: float = 1.0) -> Feed:
    """Synchronized films played as if live: each set of pictures comes when it is due."""
    film = _FilmSet(rig, rig.recording.name, rig.cameras[0].size, rig.rate)
    feed = film_feed(cast(FrameSource, film), speed)

    def read() -> Iterator[SnapshotSet]:
        for shot in feed.read():
            yield SnapshotSet(shot.captured, cast("Pictures", shot.image), shot.shown)

    return replace(feed, read=cast(Any, read))
