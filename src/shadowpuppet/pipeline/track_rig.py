"""A run with several cameras: silhouettes in step, surface points, poses, files."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.io.run import RunWriter, read_run, write_metrics
from shadowpuppet.motion.motion import BLANK, JointTable, MotionFrame
from shadowpuppet.pipeline.footage_rig import FrameSet, Rig, follow, open_rig
from shadowpuppet.pipeline.look_rig import Opening, PreparedRig, RigLook, check_rig, look_at_rig
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.overlay_video import RigOverlayWriter
from shadowpuppet.pipeline.progress import (
    RIG_STAGES,
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
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull


class RigState(Protocol):
    """What is asked of a tracker's state after a frame."""

    @property
    def pose(self) -> Array:
        """The estimate, of shape (D,)."""
        ...

    @property
    def status(self) -> str:
        """One of `motion.STATUSES`."""
        ...

    @property
    def cost(self) -> float:
        """How far the body lies from what was seen, as the tracker weighs it."""
        ...

    @property
    def overlap(self) -> float:
        """Mean intersection over union of the drawn estimate and the silhouettes; not a number where it was not taken."""
        ...


class RigTracker(Protocol):
    """What is asked of a tracker: `masks` are one a camera, None where it has no picture."""

    def start(self, rng: np.random.Generator, points: SurfacePoints, masks: Sequence[Mask | None]) -> Any:
        """A state from one set of silhouettes."""
        ...

    def step(self, rng: np.random.Generator, state: Any, points: SurfacePoints, masks: Sequence[Mask | None]) -> Any:
        """The state after the next set."""
        ...


@dataclass(frozen=True, eq=False)
class Puppet:
    """Somebody who was measured, and what follows them."""

    body: Body
    tracker: RigTracker
    hull: VisualHull
    """Makes the points that the tracker is given."""
    told: dict[str, Any]
    """What was found, plain values, for the look."""
    doubts: tuple[str, ...] = ()
    """What may harm the run, a sentence each."""
    person: Person | None = None
    """What can be used again: person.toml of the run's folder."""


Prepare = Callable[[np.random.Generator, Rig, Opening, Options, JointTable | None], Puppet]
"""From the first seconds' silhouettes, the options and training motion, where there is some, to a puppet; or a `ShadowPuppetError`."""


def track_rig(recording: str | Path, folder: str | Path, options: Options, listener: Listener, prepare: Prepare) -> Summary:
    """Track a recording of several cameras into a run folder, as `pipeline.track_recording` does one of a single camera.

    The run folder gets calibration.toml (of the cameras) and look.json, too. An interrupted run keeps what it has. Raises a
    `ShadowPuppetError` where something cannot be used; the same options, films and machine give the same joints.
    """
    for_look, for_track = generators(options)
    listener.begin("looking")
    start = time.perf_counter()
    rig = open_rig(recording, options)
    prepared = look_at_rig(rig, options)
    check_rig(prepared)
    puppet = prepare(for_look, rig, prepared.opening, options, training_of(rig))
    look = replace(prepared.look, person=puppet.told, doubts=(*prepared.look.doubts, *puppet.doubts))
    spent = round(time.perf_counter() - start, 3)
    listener.look(look)
    info = {"recording": rig.recording.path.resolve(), "method": f"Ni 2008, {len(rig.cameras)} cameras", "cameras": list(rig.names),
            "truth": rig.recording.truth and rig.recording.truth.resolve(), "settings": plain_options(options)}
    with RunWriter(folder, puppet.body.name, puppet.body.skeleton.dof_names, puppet.body.landmark_names, info) as run:
        run.metrics["look_s"] = spent
        write_whole(run.folder / "look.json", json_text(look) + "\n")
        write_calibration(run.folder / "calibration.toml", [footage.view.camera for footage in rig.footage])
        if puppet.person is not None:
            write_person(run.folder / "person.toml", puppet.person)
        _follow(run, prepared, puppet, options, listener, for_track)
    return _summary(Path(folder), rig, look)


def training_of(rig: Rig) -> JointTable | None:
    """The recording's training motion, where it has some. Raises `FormatError`."""
    return None if rig.recording.training is None else read_motion(rig.recording.training)


def _summary(folder: Path, rig: Rig, look: RigLook) -> Summary:
    written = read_run(folder)
    metrics = written.metrics | evaluated(rig.recording, written.motion, cameras=len(rig.cameras))
    warn_of_losses(written.motion)
    write_metrics(folder, metrics)
    return Summary(folder, written.motion, metrics, look)


def _follow(run: RunWriter, prepared: PreparedRig, puppet: Puppet, options: Options, listener: Listener, rng: np.random.Generator) -> None:
    """Set by set: silhouettes, surface points, pose, files."""
    rig, state, watch, frames = prepared.rig, None, Watch.of(RIG_STAGES), 0
    listener.begin("tracking", tracked(prepared.look.frames, options.every))
    began = time.perf_counter()
    try:
        with (_overlay(run.folder, rig, puppet.body, options) as overlay,
              contextlib.closing(follow(rig, prepared.silhouettes, ready=options.masks, every=options.every)) as sets,
              contextlib.closing(_ahead(sets, puppet.hull)) as hulls):  # fmt: skip
            for seen, points, carving in watch.each("wait", hulls):
                watch.add("decode", seen.decoding)
                watch.add("segment", seen.segmenting)
                watch.add("hull", carving)
                with watch.time("track"):
                    state = next_state(puppet.tracker, rng, state, points, seen.masks)
                with watch.time("write"):
                    frame = rig_frame(seen, state, puppet.body)
                    run.write(frame)
                    if overlay is not None:
                        overlay.write(seen, frame)
                frames += 1
                listener.advance(frames)
    finally:
        run.metrics |= timings(watch, frames, time.perf_counter() - began)


def _ahead(sets: Iterable[FrameSet], hull: VisualHull) -> Generator[tuple[FrameSet, SurfacePoints, float]]:
    """Each set with its surface points and the seconds these took: the next is made by another thread while one is tracked."""
    source = iter(sets)

    def carved() -> tuple[FrameSet, SurfacePoints, float] | None:
        seen = next(source, None)
        start = time.perf_counter()
        return None if seen is None else (seen, hull.points(seen.masks), time.perf_counter() - start)

    with ThreadPoolExecutor(1, "hull") as thread:
        coming = thread.submit(carved)
        while (found := coming.result()) is not None:
            coming = thread.submit(carved)
            yield found


def next_state(tracker: RigTracker, rng: np.random.Generator, state: Any, points: SurfacePoints, masks: Sequence[Mask | None]) -> Any:
    """The state after a set of silhouettes; None while nobody is in them, after which the person is searched for afresh."""
    people = sum(mask is not None and may_be_person(mask) for mask in masks)
    if people == 0 or (state is None and people < 2):
        return None
    return tracker.start(rng, points, masks) if state is None else tracker.step(rng, state, points, masks)


def rig_frame(seen: FrameSet, state: RigState | None, body: Body) -> MotionFrame:
    """A state as a run keeps it. Nobody is `absent`; somebody of whom one camera alone is left to tell is `lost`."""
    if state is None:
        anybody = any(mask is not None and may_be_person(mask) for mask in seen.masks)
        return MotionFrame(seen.time, "lost" if anybody else "absent")
    if state.status in BLANK:
        return MotionFrame(seen.time, state.status, cost=state.cost, overlap=state.overlap)
    return MotionFrame(seen.time, state.status, state.pose, body.points(state.pose[None])[0], cost=state.cost, overlap=state.overlap)


@contextlib.contextmanager
def _overlay(folder: Path, rig: Rig, body: Body, options: Options) -> Iterator[RigOverlayWriter | None]:
    if not options.overlay:
        yield None
        return
    pictures = [Picture(body, camera, camera.T_camera_world) for camera in rig.cameras]
    with RigOverlayWriter(folder / "overlay.mp4", rig.rate / options.every, pictures) as film:
        yield film
