"""A recording to be shown: its cameras, what they saw, points on the visual hull, and the truth where it has one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.truth import read_truth
from shadowpuppet.io.recording import Recording
from shadowpuppet.pipeline.footage import Footage, camera_footage, chosen_views, open_recording
from shadowpuppet.pipeline.options import Options
from shadowpuppet.video.frames import ASSUMED_RATE
from shadowpuppet.viewer.scene.figures import of_table
from shadowpuppet.viewer.scene.footage import FilmSeen, hull_of
from shadowpuppet.viewer.scene.show import Eye, Figure, Show


def show_recording(path: str | Path, options: Options) -> Show:
    """A recording folder, or a film with a field of view. Raises a `ShadowPuppetError` where something cannot be used."""
    recording = open_recording(path, options)
    eyes, footage, ready = eyes_of(recording, options)
    figures, lacks = _truth(recording)
    made = "ready, from masks/" if ready else "made as `track` makes them"
    facts = {"recording": str(recording.path), "cameras": ", ".join(eye.camera.name for eye in eyes), "silhouettes": made}
    return Show(title=recording.name, times=times_of(footage), figures=figures, eyes=eyes, hull=hull_of(eyes, options), facts=facts,
                lacks=lacks)


def eyes_of(recording: Recording, options: Options, ready: bool | None = None) -> tuple[tuple[Eye, ...], list[Footage], bool]:
    """The cameras with their films; and whether ready silhouettes are shown: if `ready` is left out, where every camera has some."""
    views = chosen_views(recording, options.camera)
    ready = all(view.masks is not None for view in views) if ready is None else ready
    options = replace(options, masks=ready)
    footage = [camera_footage(recording, view, options) for view in views]
    return tuple(Eye(each.camera, FilmSeen(each, options)) for each in footage), footage, ready


def times_of(footage: Sequence[Footage]) -> Array:
    """Times of the frames of the film of the middle rate, as it tells its rate and length; seconds."""
    rates = [film.rate if np.isfinite(film.rate) else ASSUMED_RATE for film in (each.film() for each in footage)]
    n = int(np.argsort(rates)[(len(rates) - 1) // 2])
    count = footage[n].count
    if count is None:  # films that do not tell it are gone through once
        return np.array([shot.time for shot in footage[n].frames(ready=False)])
    return np.arange(max(count, 1)) / rates[n]


def _truth(recording: Recording) -> tuple[tuple[Figure, ...], tuple[str, ...]]:
    if recording.truth is None:
        return (), ()
    try:
        return (of_table("truth", read_truth(recording.truth), "truth"),), ()
    except ShadowPuppetError as error:
        return (), (f"the truth is not shown: {error}",)
