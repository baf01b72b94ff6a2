"""A whole run: a recording in, a run folder out. Prints nothing: it tells a `Listener`."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.person import write_person
from shadowpuppet.io.run import RunWriter, read_run, write_metrics
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.footage import opened
from shadowpuppet.pipeline.footage_rig import chosen_views, open_rig
from shadowpuppet.pipeline.look import Look, Prepared, check, prepare
from shadowpuppet.pipeline.look_rig import RigLook, check_rig, look_at_rig
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.overlay_video import OverlayWriter
from shadowpuppet.pipeline.person import Found
from shadowpuppet.pipeline.person_rig import prepare_puppet
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
    Listener,
    Summary,
    Watch,
    evaluated,
    generators,
    json_text,
    timings,
    tracked,
    warn_of_losses,
)
from shadowpuppet.pipeline.silhouette_cache import Repeats
from shadowpuppet.pipeline.track_rig import Puppet, track_rig, training_of
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State

__all__ = ["Listener", "Summary", "Watch", "fit_person", "json_text", "look_at", "motion_frame", "named_body", "next_state",
           "track_recording"]


@one_blas_thread()
def look_at(recording: str | Path, options: Options | None = None) -> Look | RigLook:
    """What `track_recording` would begin with. Raises a `ShadowPuppetError` where something cannot be used."""
    options = options or Options()
    if several(recording, options):
        return look_at_rig(open_rig(recording, options), options).look
    return prepare(str(recording), options, generators(options)[0]).look


@one_blas_thread()
def track_recording(recording: str | Path, folder: str | Path, options: Options | None = None,
                    listener: Listener | None = None, repeats: Repeats | None = None) -> Summary:
    """Track a recording (folder, or film with `Options.fov`) into a run folder; one of several cameras as `rig_run` does.

    `repeats` keeps what the next run of the same film can use; metrics.json tells `kept_silhouettes` of one that did.

    Beside what `io.run` describes, the folder gets look.json, person.toml (the sizes), calibration.toml (the camera) and, when
    asked for, overlay.mp4. An interrupted run keeps what it has. Raises a `ShadowPuppetError` where something cannot be used;
    the same options, film and machine give the same joints.
    """
    options, listener = options or Options(), listener or Listener()
    if several(recording, options):
        return track_rig(recording, folder, options, listener, prepare_puppet)
    with_names, joints = named_body(options.tracker.body)
    info = {"recording": Path(recording).resolve(), "method": "Liu 2011, one camera", "settings": plain_options(options)}
    with RunWriter(folder, options.tracker.body, with_names.skeleton.dof_names, joints, info) as run:
        for_look, for_track = generators(options)
        listener.begin("looking")
        start = time.perf_counter()
        prepared = prepare(str(recording), options, for_look) if repeats is None else repeats.prepare(recording, options, for_look)
        run.metrics |= {"kept_silhouettes": True} if repeats is not None and repeats.reused else {}
        run.metrics["look_s"] = round(time.perf_counter() - start, 3)
        listener.look(prepared.look)
        run.info |= {"truth": str(truth.resolve())} if (truth := prepared.footage.recording.truth) else {}
        _write_beside(run.folder, prepared)
        _follow(run, prepared, options, listener, for_track, joints)
    written = read_run(folder)
    motion, metrics = written.motion, written.metrics | evaluated(prepared.footage.recording, written.motion, prepared.footage.camera)
    warn_of_losses(motion)
    write_metrics(folder, metrics)
    return Summary(Path(folder), motion, metrics, prepared.look)


def several(recording: str | Path, options: Options) -> bool:
    """Whether a recording is one of several cameras, of which not one alone is asked for. Raises a `ShadowPuppetError` as they are read."""
    return len(chosen_views(opened(recording, options), options.camera)) > 1


@one_blas_thread()
def fit_person(recording: str | Path, file: str | Path, options: Options | None = None) -> tuple[Found | Puppet, Look | RigLook]:
    """Find a person's sizes and save them. Raises a `ShadowPuppetError` where nobody is found or the file cannot be written."""
    options = options or Options()
    if several(recording, options):
        puppet, look = measured(recording, options)
        assert puppet.person is not None
        write_person(file, puppet.person)
        return puppet, look
    prepared = prepare(str(recording), options, generators(options)[0])
    found = check(prepared)
    write_person(file, found.person)
    return found, prepared.look


def measured(recording: str | Path, options: Options) -> tuple[Puppet, RigLook]:
    """Who is before several cameras, measured in the first seconds. Raises a `ShadowPuppetError` where nobody is found."""
    rig = open_rig(recording, options)
    prepared = look_at_rig(rig, options)
    check_rig(prepared)
    puppet = prepare_puppet(generators(options)[0], rig, prepared.opening, options, training_of(rig))
    return puppet, replace(prepared.look, person=puppet.told, doubts=(*prepared.look.doubts, *puppet.doubts))


def named_body(name: str) -> tuple[Body, list[str]]:
    """A body of average sizes, for its names, and the names of the joints that a run keeps."""
    body = make_body(name, average_sizes(name, AVERAGE_HEIGHT))
    return body, [landmark for landmark in body.landmark_names if not landmark.endswith("_fist")]


def _write_beside(folder: Path, prepared: Prepared) -> None:
    found = check(prepared)
    write_whole(folder / "look.json", json_text(prepared.look) + "\n")
    write_person(folder / "person.toml", found.person)
    write_calibration(folder / "calibration.toml", [prepared.footage.view.camera])


def _follow(run: RunWriter, prepared: Prepared, options: Options, listener: Listener, rng: np.random.Generator,
            joints: list[str]) -> None:
    """Frame by frame: silhouette, pose, files."""
    picture = check(prepared).fit.guess.picture(prepared.footage.camera, options.tracker.body)
    columns = [picture.body.landmark_names.index(name) for name in joints]
    tracker, state, watch, frames = MonocularTracker(picture, options.tracker), None, Watch(), 0
    listener.begin("tracking", tracked(prepared.look.frames, options.every))
    began = time.perf_counter()
    try:
        with _overlay(run.folder, prepared, picture, options) as overlay:
            for shot in watch.each("decode", prepared.footage.tracked(options.masks, options.every)):
                with watch.time("segment"):
                    mask = prepared.silhouettes(shot)
                with watch.time("track"):
                    state = next_state(tracker, rng, state, mask)
                with watch.time("write"):
                    run.write(motion_frame(shot.time, state, picture, columns))
                    if overlay is not None:
                        _draw(overlay, shot.time, shot.image, mask, state, picture, options.tracker.ignore_legs)
                frames += 1
                listener.advance(frames)
    finally:
        run.metrics |= timings(watch, frames, time.perf_counter() - began)


def next_state(tracker: MonocularTracker, rng: np.random.Generator, state: State | None, mask: np.ndarray) -> State | None:
    """The state after a mask; none before the first that is not empty."""
    if state is None:
        return tracker.start(rng, mask) if mask.any() else None
    return tracker.step(rng, state, mask)


def motion_frame(seconds: float, state: State | None, picture: Picture, columns: list[int]) -> MotionFrame:
    """A state as a run keeps it; `columns`: the landmarks that are its joints."""
    if state is None:
        return MotionFrame(seconds, "absent")
    points = picture.points_world(state.pose[None])[0][columns]
    return MotionFrame(seconds, state.status, state.pose, points, cost=state.cost, overlap=state.overlap)


@contextlib.contextmanager
def _overlay(folder: Path, prepared: Prepared, picture: Picture, options: Options) -> Iterator[OverlayWriter | None]:
    if not options.overlay:
        yield None
        return
    rate = prepared.look.rate if np.isfinite(prepared.look.rate) else FALLBACK_RATE
    with OverlayWriter(folder / "overlay.mp4", rate / options.every, picture) as film:
        yield film


def _draw(film: OverlayWriter, seconds: float, image: np.ndarray, mask: np.ndarray, state: State | None, picture: Picture,
          without_legs: bool) -> None:
    known = state is not None and state.status not in BLANK
    pose = state.pose if state is not None and known else np.full(len(picture.body.skeleton.dofs), np.nan)
    film.write(image, mask, pose, status=state.status if state else "absent", time=seconds, overlap=state.overlap if state else np.nan,
               ignore=mask & picture.legs(pose) if known and without_legs else None)


