"""A whole run, with one camera or several: a recording in, a run folder out. Prints nothing: it notifies a `Listener`."""

from __future__ import annotations

import time
from array import array
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Any, Generic, NamedTuple

import numpy as np

from shadowpuppet.errors import SettingsError, ShadowPuppetError, TrackingError, warn
from shadowpuppet.io.inputs.inputs import Resuming
from shadowpuppet.io.people import person_folder
from shadowpuppet.io.person import read_person
from shadowpuppet.io.prior import read_prior
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import OWN_KEYS, RunWriter, write_metrics
from shadowpuppet.motion.motion import BLANK, Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.look import Survey
from shadowpuppet.pipeline.options import Options, check_used, plain_options
from shadowpuppet.pipeline.people.run import PeopleRun, check_people
from shadowpuppet.pipeline.prepare import MONOCULAR, MULTIVIEW, Kind, Prepared, fit_survey, look_around
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
    Checkpoints,
    LeftOut,
    Listener,
    StageTimer,
    Summary,
    add_left_out,
    evaluated,
    generators,
    is_same_look,
    json_text,
    left_out_metrics,
    set_aside,
    timings,
    tracked,
    warn_of_left_out,
    warn_of_losses,
    warn_of_set_aside,
    write_beside,
)
from shadowpuppet.pipeline.rig import FrameSet, Rig, open_rig
from shadowpuppet.pipeline.silhouette_cache import MaskStore, SilhouetteCache
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.subject import (
    Before,
    FittedPerson,
    Observation,
    State,
    TrackedSubject,
    average_body,
    floor_entry,
    joint_names,
    motion_frame,
)
from shadowpuppet.pipeline.verdict.of_run import verdict_of_run
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch
from shadowpuppet.tracking.smoothing.butterworth import check_cutoff
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother, smoothed_parts
from shadowpuppet.video import write_frames

__all__ = ["Listener", "Summary", "json_text", "track_recording"]


@one_blas_thread()
def track_recording(recording: str | Path, folder: str | Path, options: Options | None = None,
                    listener: Listener | None = None, cache: SilhouetteCache | None = None, *, resume: bool = False) -> Summary:
    """Track a recording (a folder, or a film with `Options.fov`) of one camera or several into a run folder.

    `cache` keeps silhouettes for the next run of the same recording; a run that used them has `kept_silhouettes` in metrics.json.
    `resume`: an earlier run in the folder, of the same recording, settings and versions, goes on from its last checkpoint, which is made
    about every second; the look and the silhouettes before are made again, and the result is that of a run that was never broken off. A
    folder without a checkpoint is tracked from the first frame; a complete run raises `io.run_writer.CompleteRun`.

    In addition to the files that `io.run` describes, the folder gets look.json, person.toml (the sizes), calibration.toml (the cameras)
    and, if asked for, overlay.mp4. An interrupted run keeps the frames tracked so far. The same options, films and machine give the same
    joints. Raises a `ShadowPuppetError` if something cannot be used.
    """
    options = options or Options()
    rig = open_rig(recording, options)
    listener = listener or Listener()
    if rig.is_multiview:
        return run(rig, MULTIVIEW, folder, options, listener, cache, resume)
    return run(rig, MONOCULAR, folder, options, listener, cache, resume)


def run(rig: Rig, kind: Kind[State, Observation, Before], folder: str | Path, options: Options, listener: Listener,
        cache: SilhouetteCache | None = None, resume: bool = False) -> Summary:
    """Survey, fit, track and evaluate; see `track_recording`."""
    for_look, for_track = generators(options)
    check_used(options, rig.is_multiview)
    _check_files(options, rig)
    body, recording = average_body(getattr(options, kind.settings).body), rig.recording
    info = {"recording": recording.path.resolve(), "method": kind.name(options.preset, len(rig.cameras)),
            "cameras": list(rig.names) if rig.is_multiview else None, "settings": plain_options(options),
            "truth": recording.truth and recording.truth.resolve(), "begin": recording.begin or None, "end": recording.duration}
    with RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), info, Resuming(resume, rig.inputs)) as writer:
        start = time.perf_counter()
        survey = look_around(rig, options, kind, cache, listener)
        if survey.several and (survey.look.refusal is None or options.anyway):
            return _run_people(writer, survey, options, listener, (for_look, for_track))
        prepared = fit_survey(for_look, survey, options, kind, cache, listener)
        writer.metrics |= {"kept_silhouettes": True} if cache is not None and cache.is_complete(options) else {}
        writer.metrics["look_s"] = round(time.perf_counter() - start, 3)
        listener.look(prepared.look)
        _check_cutoff(options, prepared.look.rate)
        subject, store = prepared.check(), MaskStore()
        store = store if subject.both_ways and options.smoothing[0] != "off" else None
        leans, state = _track(writer, prepared, kind, options, listener, for_track, cache, store)
        motion = writer.motion if store is None else _backward(writer, subject.turned_back(state), options, listener, store)
        smooth_run(writer, [(0, subject)], options, listener, motion, leans)
        writer.info |= floor_entry(writer.motion, rig.cameras, prepared.check().person)
        writer.check()
        found = evaluated(rig, writer.motion)
        frames = len(writer.motion), tracked(prepared.look.frames, options.every)
        verdict = verdict_of_run(prepared.look, writer.motion, writer.metrics.get("set_aside", ()), frames)
        writer.metrics |= found | {"verdict": verdict.plain()}
    written = read_run(folder)
    metrics = written.metrics | found
    warn_of_losses(written.motion)
    warn_of_left_out(metrics.get("left_out", []))
    warn_of_set_aside(metrics.get("set_aside", []))
    return Summary(Path(folder), written.motion, metrics, prepared.look)


def _check_files(options: Options, rig: Rig) -> None:
    """Raise `FormatError` for a person or a prior that cannot be read, before the recording is examined."""
    if options.person is not None:
        read_person(options.person, (options.multiview if rig.is_multiview else options.tracker).body)
    if options.prior is not None and rig.is_multiview:
        read_prior(options.prior)


def _run_people(writer: RunWriter, survey: Survey, options: Options, listener: Listener,
                rngs: tuple[np.random.Generator, np.random.Generator]) -> Summary:
    """Track several people, each into a folder of their own."""
    assert survey.census is not None
    check_people(options)
    listener.look(survey.look)
    _check_cutoff(options, survey.look.rate)
    entries = {key: value for key, value in writer.info.items() if key not in (*OWN_KEYS, "people", "truth")}
    people = PeopleRun(writer, survey, survey.census, options, entries, listener)
    found = people.track(*rngs, smooth_run)
    if not found:
        raise TrackingError(f"{survey.look.recording}: nobody is found in the silhouettes of {survey.census.number} people")
    if len(found) < min(survey.census.number, options.people or survey.census.number):
        warn(f"{survey.look.recording}: {survey.census.number} people were counted, {len(found)} could be followed: a person whom few "
             "cameras show whole, or who is seen for less than a second, is not")
    first = read_run(person_folder(writer.folder, min(found)))
    if len(found) == 1:
        ((number, metrics),) = found.items()
        writer.adopt(people.writers[number])
        write_metrics(writer.folder, metrics := people.metrics | metrics)
        return Summary(writer.folder, first.motion, metrics, survey.look)
    writer.info["people"] = len(found)
    return Summary(writer.folder, first.motion, people.metrics | {"people": found}, survey.look)


def _check_cutoff(options: Options, rate: float) -> None:
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
    parts = [(begin, MotionSmoother(subject.body.skeleton, subject.joints, method, options.cutoff, gaps, away))
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


def _backward(writer: RunWriter, subject: TrackedSubject[State, Observation, Before], options: Options, listener: Listener,
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


def _steadied(now: FrameSet, silhouettes: Sequence[Silhouettes]) -> FrameSet:
    """A frame set with the images of cameras that stand still."""
    images = (None if image is None else each.steadied(image) for each, image in zip(silhouettes, now.images))
    return now._replace(images=tuple(images))


class Carried(NamedTuple, Generic[State, Before]):
    """What a frame needs of those before it: what a checkpoint keeps. Silhouettes, and cameras set aside, follow from the film."""

    look: str
    """The text of look.json."""
    generator: Mapping[str, Any]
    """State of the random generator."""
    state: State | None
    """The tracker's; None while there is no person."""
    before: Before | None
    """What the doubt about the next frame needs."""
    left_out: tuple[LeftOut | None, ...]


def _resumed(writer: RunWriter, prepared: Prepared[State, Observation, Before],
             rng: np.random.Generator) -> tuple[Carried[State, Before], list[MotionFrame]]:
    """Where a run begins: at the start, or after the frames of its checkpoint. Raises `ShadowPuppetError` if the look is another one."""
    subject, look = prepared.check(), json_text(prepared.look)
    carried, frames = writer.resumed((*subject.state_types, Carried, LeftOut)) or (Carried(look, {}, None, None, ()), [])
    if not is_same_look(carried.look, look):
        raise ShadowPuppetError(f"{writer.folder}: the run there cannot go on: its look.json differs from what the recording gives now")
    if carried.generator:
        rng.bit_generator.state = carried.generator
    return carried._replace(look=look), frames


def _track(writer: RunWriter, prepared: Prepared[State, Observation, Before], kind: Kind[State, Observation, Before], options: Options,
           listener: Listener, rng: np.random.Generator, cache: SilhouetteCache | None,
           store: MaskStore | None) -> tuple[Sequence[float], State | None]:
    """For each frame set: make silhouettes and observation, update the tracker's state, write the result. Returns the `lean` of each, and
    the last state. `store`: is filled with the silhouettes."""
    subject, survey, timer = prepared.check(), prepared.survey, StageTimer()
    (look, _, state, before, left_out), earlier = _resumed(writer, prepared, rng)
    writer.begin()
    write_beside(writer.folder, prepared.look, survey.rig, prepared.check().person)
    watch, count, checkpoints = RigWatch(len(survey.rig.footage), survey.rig.short), len(earlier), Checkpoints()
    leans, last = array("d"), None
    rate = prepared.look.rate if np.isfinite(prepared.look.rate) else FALLBACK_RATE
    listener.begin("tracking", tracked(prepared.look.frames, options.every))
    began = time.perf_counter()
    try:
        with ExitStack() as stack:
            overlay = stack.enter_context(write_frames(writer.folder / "overlay.mp4", rate / options.every)) if options.overlay else None
            task = Task(survey.rig, survey.silhouettes, options.masks, options.every, images=options.overlay, corrected=False, codes=True)
            frames = stack.enter_context(closing(frames_beside(task)))
            if cache is not None:
                frames = stack.enter_context(closing(cache.frames(frames, options)))
            frames = (now._replace(seen=watch(now.time, now.seen)) for now in frames)
            if store is not None:
                frames = stack.enter_context(closing(store.stored(frames)))
            for found, now in zip(earlier, frames):
                watch.tracked(subject.drawn(found))
                leans.append(subject.lean(found, now.seen.masks))
                last = last if found.status in BLANK else found
                if overlay is not None:
                    overlay.write(subject.draw(_steadied(now, survey.silhouettes), found, last))
            observed = stack.enter_context(closing(subject.observations(frames)))
            for now, observation, seconds in timer.each("wait", observed):
                timer.add(decode=now.decoding, segment=now.segmenting, hull=seconds)
                with timer.time("track"):
                    state = subject.next_state(rng, state, observation)
                    watch.tracked(subject.drawn(state))
                left_out = add_left_out(left_out, now.time, subject.left_out(state))
                with timer.time("doubt"):
                    found, before = motion_frame(subject, now.time, state, observation, before)
                leans.append(subject.lean(found, now.seen.masks))
                last = last if found.status in BLANK else found
                with timer.time("write"):
                    writer.write(found)
                    if overlay is not None:
                        overlay.write(subject.draw(_steadied(now, survey.silhouettes), found, last))
                    carried = Carried(look, rng.bit_generator.state, subject.kept(state), before, left_out)
                    checkpoints.keep(partial(writer.checkpoint, carried))
                count += 1
                listener.advance(count)
            writer.check()  # before the overlay gets its name
    finally:
        writer.metrics |= timings(timer, kind.stages, count - len(earlier), time.perf_counter() - began)
        writer.metrics |= left_out_metrics(left_out, [footage.view.camera for footage in survey.rig.footage])
        writer.metrics |= set_aside(watch.intervals, survey.rig.names)
    return leans, state
