"""A whole run: a recording in, a run folder out. Prints nothing: it tells a `Listener`."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar
from warnings import warn

import numpy as np

from shadowpuppet.anthropometry import AVERAGE_HEIGHT, sizes_from_height
from shadowpuppet.body import BODIES, Body
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.fitting import Found
from shadowpuppet.io._files import write_whole
from shadowpuppet.io._plain import for_json, plain
from shadowpuppet.io.calibration import write_calibration
from shadowpuppet.io.joints import read_joints
from shadowpuppet.io.person import write_person
from shadowpuppet.io.run import RunWriter, read_run, write_metrics
from shadowpuppet.look import Look, Prepared, check, prepare
from shadowpuppet.metrics import evaluate
from shadowpuppet.motion import BLANK, Motion, MotionFrame
from shadowpuppet.options import Options, plain_options
from shadowpuppet.overlay import OverlayWriter
from shadowpuppet.rasterize import Picture
from shadowpuppet.tracking import MonocularTracker, State

Item = TypeVar("Item")
STAGES = ("decode", "segment", "track", "write")
"""What a frame's time is spent on."""
FALLBACK_RATE = 25.0
"""Frames/s of an overlay whose film does not tell its own."""
MANY_LOST = 0.1
"""Share of frames from which on a run that lost the person is said to be in doubt."""


class Listener:
    """Is told how a run goes, and does nothing: derive from it."""

    def begin(self, what: str, total: int | None = None) -> None:
        """Something begins: `looking` or `tracking`; `total`: frames, where that is known."""

    def advance(self, frames: int) -> None:
        """So many frames are tracked."""

    def look(self, look: Look) -> None:
        """What was found, before the tracking begins."""


@dataclass(frozen=True, eq=False)
class Summary:
    """A run that came to its end."""

    folder: Path
    motion: Motion
    metrics: dict[str, Any]
    """What is in metrics.json."""
    look: Look


@dataclass
class Watch:
    """Seconds by stage."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @contextlib.contextmanager
    def time(self, stage: str) -> Iterator[None]:
        """Count what is done in the `with` block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start

    def each(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """Count the making of the items."""
        source = iter(items)
        while True:
            with self.time(stage):
                item = next(source, None)
            if item is None:
                return
            yield item


def look_at(recording: str | Path, options: Options | None = None) -> Look:
    """What `track_recording` would begin with. Raises a `ShadowPuppetError` where something cannot be used."""
    options = options or Options()
    return prepare(str(recording), options, _generators(options)[0]).look


def track_recording(recording: str | Path, folder: str | Path, options: Options | None = None,
                    listener: Listener | None = None) -> Summary:
    """Track a recording (folder, or film with `Options.fov`) into a run folder.

    Beside what `io.run` describes, the folder gets look.json, person.toml (the sizes), calibration.toml (the camera) and, when
    asked for, overlay.mp4. An interrupted run keeps what it has. Raises a `ShadowPuppetError` where something cannot be used;
    the same options, film and machine give the same joints.
    """
    options, listener = options or Options(), listener or Listener()
    with_names, joints = named_body(options.tracker.body)
    info = {"recording": Path(recording).resolve(), "method": "Liu 2011, one camera", "settings": plain_options(options)}
    with RunWriter(folder, options.tracker.body, with_names.skeleton.dof_names, joints, info) as run:
        for_look, for_track = _generators(options)
        listener.begin("looking")
        start = time.perf_counter()
        prepared = prepare(str(recording), options, for_look)
        run.metrics["look_s"] = round(time.perf_counter() - start, 3)
        listener.look(prepared.look)
        run.info |= {"truth": str(truth.resolve())} if (truth := prepared.footage.recording.truth) else {}
        _write_beside(run.folder, prepared)
        _follow(run, prepared, options, listener, for_track, joints)
    written = read_run(folder)
    motion, metrics = written.motion, written.metrics | _evaluated(prepared, written.motion)
    _warn_of_losses(motion)
    write_metrics(folder, metrics)
    return Summary(Path(folder), motion, metrics, prepared.look)


def fit_person(recording: str | Path, file: str | Path, options: Options | None = None) -> tuple[Found, Look]:
    """Find a person's sizes and save them. Raises a `ShadowPuppetError` where nobody is found or the file cannot be written."""
    options = options or Options()
    prepared = prepare(str(recording), options, _generators(options)[0])
    found = check(prepared)
    write_person(file, found.person)
    return found, prepared.look


def named_body(name: str) -> tuple[Body, list[str]]:
    """A body of average sizes, for its names, and the names of the joints that a run keeps."""
    body = BODIES[name](sizes_from_height(AVERAGE_HEIGHT))
    return body, [landmark for landmark in body.landmark_names if not landmark.endswith("_fist")]


def json_text(value: Any) -> str:
    """Plain values, arrays and dataclasses as JSON; null for what is not finite."""
    return json.dumps(for_json(plain(value, "value")), indent=1, ensure_ascii=False, allow_nan=False)


def _generators(options: Options) -> list[np.random.Generator]:
    """One for the look, one for the tracking, so that neither's use of chance changes the other."""
    return np.random.default_rng(options.seed).spawn(2)


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
    listener.begin("tracking", prepared.look.frames)
    began = time.perf_counter()
    try:
        with _overlay(run.folder, prepared, picture, options.overlay) as overlay:
            for shot in watch.each("decode", prepared.footage.shots(options.masks)):
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
        run.metrics |= _timings(watch, frames, time.perf_counter() - began)


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
def _overlay(folder: Path, prepared: Prepared, picture: Picture, wanted: bool) -> Iterator[OverlayWriter | None]:
    if not wanted:
        yield None
        return
    rate = prepared.look.rate if np.isfinite(prepared.look.rate) else FALLBACK_RATE
    with OverlayWriter(folder / "overlay.mp4", rate, picture) as film:
        yield film


def _draw(film: OverlayWriter, seconds: float, image: np.ndarray, mask: np.ndarray, state: State | None, picture: Picture,
          without_legs: bool) -> None:
    known = state is not None and state.status not in BLANK
    pose = state.pose if state is not None and known else np.full(len(picture.body.skeleton.dofs), np.nan)
    film.write(image, mask, pose, status=state.status if state else "absent", time=seconds, overlap=state.overlap if state else np.nan,
               ignore=mask & picture.legs(pose) if known and without_legs else None)


def _timings(watch: Watch, frames: int, wall: float) -> dict[str, Any]:
    milliseconds = {stage: round(1000 * seconds / max(frames, 1), 3) for stage, seconds in watch.seconds.items()}
    return {"track_s": round(wall, 3), "frames_per_s": round(frames / max(wall, 1e-9), 2), "ms_per_frame": milliseconds}


def _warn_of_losses(motion: Motion) -> None:
    """Warn where much of the run is nothing."""
    lost = np.flatnonzero(motion.status == "lost")
    present = np.count_nonzero(motion.status != "absent")
    if len(lost) > MANY_LOST * present:
        warn(f"the person is lost in {100 * len(lost) / present:.0f} % of the frames, first at {motion.times[lost[0]]:.2f} s: do their "
             "silhouettes show them, and them alone? --overlay shows it; give a picture of the empty scene, a --region, or better light",
             ShadowPuppetWarning, stacklevel=3)


def _evaluated(prepared: Prepared, motion: Motion) -> dict[str, Any]:
    """Measures, against the truth where there is one that fits."""
    recording, camera = prepared.footage.recording, prepared.footage.camera
    try:
        truth = read_joints(recording.truth) if recording.truth is not None else None
        return evaluate(motion, truth, camera=camera)
    except ShadowPuppetError as error:  # the run is done: it is not to be lost over this
        warn(f"no errors are told: {error}", ShadowPuppetWarning, stacklevel=2)
        return evaluate(motion, camera=camera)


