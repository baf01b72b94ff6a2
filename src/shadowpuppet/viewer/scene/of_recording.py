"""The scene of a recording: its cameras and films, points on the visual hull, and the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.recording import Recording
from shadowpuppet.pipeline.footage import Footage, camera_footage, chosen_views, open_recording
from shadowpuppet.pipeline.options import Options
from shadowpuppet.video.frames import ASSUMED_RATE
from shadowpuppet.viewer.scene.figures import joint_figure
from shadowpuppet.viewer.scene.film_images import FilmImages, hull_function
from shadowpuppet.viewer.scene.scene import SceneCamera, SceneFigure, Stage


def recording_scene(path: str | Path, options: Options) -> Stage:
    """The scene of a recording folder, or of a film with a field of view. Raises a `ShadowPuppetError`."""
    recording = open_recording(path, options)
    cameras, footage, ready = cameras_of(recording, options)
    figures, problems = _truth(recording)
    made = "ready, from masks/" if ready else "made as `track` makes them"
    facts = {"recording": str(recording.path), "cameras": ", ".join(each.camera.name for each in cameras), "silhouettes": made}
    return Stage(title=recording.name, times=frame_times(footage), figures=figures, cameras=cameras, hull=hull_function(cameras, options),
                 facts=facts, problems=problems)


def cameras_of(recording: Recording, options: Options, ready: bool | None = None) -> tuple[tuple[SceneCamera, ...], list[Footage], bool]:
    """The cameras; their footage; and whether ready silhouettes are shown: `ready`, by default whether every camera has some."""
    views = chosen_views(recording, options.camera)
    ready = all(view.masks is not None for view in views) if ready is None else ready
    options = replace(options, masks=ready)
    footage = [camera_footage(recording, view, options) for view in views]
    shown = [(each.camera, FilmImages(each, options), None if each.keypoints is None else each.keypoints_at) for each in footage]
    return tuple(SceneCamera(*each) for each in shown), footage, ready


def frame_times(footage: Sequence[Footage]) -> Array:
    """Times of the frames of the film with the median rate, seconds."""
    rates = [film.rate if np.isfinite(film.rate) else ASSUMED_RATE for film in (each.film for each in footage)]
    n = int(np.argsort(rates)[(len(rates) - 1) // 2])
    count = footage[n].count
    if count is None:  # unknown length: read the whole film once
        return np.array([shot.time for shot in footage[n].frames(ready=False)])
    return footage[n].recording.begin + np.arange(max(count, 1)) / rates[n]


def _truth(recording: Recording) -> tuple[tuple[SceneFigure, ...], tuple[str, ...]]:
    if recording.truth is None:
        return (), ()
    try:
        return (joint_figure("truth", read_truth(recording.truth), "truth"),), ()
    except ShadowPuppetError as error:
        return (), (f"the truth is not shown: {error}",)
