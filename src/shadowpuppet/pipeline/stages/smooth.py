"""The smooth stage: a film of one camera tracked backward, too, and the motion smoothed when the film is over."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from shadowpuppet.errors import SettingsError, warn
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.pipeline.subject import Before, FittedPerson, Observation, State, TrackedSubject, motion_frame
from shadowpuppet.tracking.smoothing.butterworth import check_cutoff
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother, smoothed_parts


def check_smoothing(options: Options, rate: float) -> None:
    """Raise `SettingsError` before tracking if the frame rate does not allow the filter's cut-off."""
    if options.smoothing[0] == "butterworth" and np.isfinite(rate):
        check_cutoff(options.cutoff, rate / options.every)


def smooth_run(writer: RunWriter, subjects: Sequence[tuple[int, FittedPerson]], options: Options, listener: Listener,
               motion: Motion, leans: Sequence[float] | None = None) -> None:
    """Replace the tracked motion of a run by `motion` smoothed: of each of `subjects` from its first frame to the next one's. If that is
    impossible, the motion stays as it is, with a warning. `leans`: of the head in each frame (`TrackedSubject.lean`), if they are known."""
    method, gaps = options.smoothing
    if method == "off" and gaps == 0:
        writer.info["smoothing"] = {"method": "off"}
        return
    listener.begin("smoothing")
    start, away = time.perf_counter(), options.facing == "away"
    parts = [(begin, MotionSmoother(subject.body.skeleton, subject.joints, method, options.cutoff, gaps, away,
                                    subject.limits))
             for begin, subject in subjects]
    try:
        found = smoothed_parts(motion, parts, np.full(len(motion), np.nan) if leans is None else np.array(leans))
    except (SettingsError, np.linalg.LinAlgError) as error:
        warn(f"the motion is not smoothed: {error}")
        writer.info["smoothing"] = {"method": "off"}
        return
    turned = found.motion.times[1:][np.diff(found.mirrored.astype(int)) != 0]
    if len(turned):
        first, other = ("looked away", "camera") if away else ("faced the camera", "away")
        warn(f"the person seems to have turned round at {', '.join(f'{time:.1f}' for time in turned)} s: left and right are exchanged from "
             f"there on, which one camera cannot see, nor that they {first} at first, as was assumed (--facing {other} if not); --smooth "
             "off leaves them as tracked")
    writer.revise(found.motion)
    counts = {"bridged_frames": found.bridged, "turned_frames": found.mirrored, "reversed_frames": found.reversed}
    writer.info["smoothing"] = {**parts[0][1].summary, **{name: int(frames.sum()) for name, frames in counts.items()}}
    writer.metrics["smooth_s"] = round(time.perf_counter() - start, 3)


def backward(writer: RunWriter, subject: TrackedSubject[State, Observation, Before], options: Options, listener: Listener,
              store: MaskStore) -> Motion:
    """The run's motion blended with that of the same silhouettes tracked backward; as it is if they were too many to be kept."""
    motion, frames = writer.motion, list[MotionFrame]()
    if len(store.sets) != len(motion):
        return motion
    listener.begin("tracking backward", len(motion))
    start, rng = time.perf_counter(), np.random.default_rng(options.seed).spawn(3)[2]  # not that of the look or of the forward pass
    state = before = None
    for now in reversed(store):
        observation = subject.observe(now.seen)
        state = subject.next_state(rng, state, observation)
        found, before = motion_frame(subject, -now.time, state, observation, before)
        frames.append(found._replace(time=now.time))
        listener.advance(len(frames))
    builder = MotionBuilder(motion.body_name, motion.dof_names, motion.joint_names)
    for found in reversed(frames):
        builder.append(found)
    both, share = subject.blended(motion, builder.build())
    writer.replace_modes({found.time: found.modes for found, weight in zip(reversed(frames), share) if weight > 0.5})
    writer.metrics["backward_s"] = round(time.perf_counter() - start, 3)
    return both
