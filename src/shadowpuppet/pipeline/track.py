"""A whole run, with one camera or several: a recording in, a run folder out. Prints nothing: it notifies a `Listener`."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np

from shadowpuppet.errors import TrackingError, warn
from shadowpuppet.io.people import person_folder
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import OWN_KEYS, RunWriter, write_metrics
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.people.run import PeopleRun, check_people
from shadowpuppet.pipeline.prepare import (
    MONOCULAR,
    MULTIVIEW,
    Kind,
    Prepared,
    as_before,
    body_names,
    check_options,
    fit_survey,
    for_film,
    for_person,
    is_for_rig,
    look_around,
    run_writer,
)
from shadowpuppet.pipeline.progress import Listener, StageTimer, Summary, generators, json_text, judge, set_aside, summary, timings, tracked
from shadowpuppet.pipeline.rig import FrameSet, Rig, open_rig
from shadowpuppet.pipeline.silhouette_cache import MaskStore, SilhouetteCache
from shadowpuppet.pipeline.stages.show import drawings, show_run
from shadowpuppet.pipeline.stages.smooth import backward, check_smoothing, smooth_run
from shadowpuppet.pipeline.stages.write import Written
from shadowpuppet.pipeline.subject import Before, Observation, State, motion_frame
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch

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
    if is_for_rig(rig, options):
        return run(rig, MULTIVIEW, folder, options, listener, cache, resume)
    return run(rig, MONOCULAR, folder, options, listener, cache, resume)


def run(rig: Rig, kind: Kind[State, Observation, Before], folder: str | Path, options: Options, listener: Listener,
        cache: SilhouetteCache | None = None, resume: bool = False) -> Summary:
    """Survey, fit, track, smooth, show and judge; see `track_recording`."""
    for_look, for_track = generators(options)
    options = for_person(rig, options)
    check_options(options, rig)
    options = as_before(folder, options) if resume else options
    with run_writer(rig, kind, folder, options, resume) as writer:
        start = time.perf_counter()
        survey = look_around(rig, options, kind, cache, listener)
        options = for_film(survey, options)
        writer.track_as(*body_names(kind, options), plain_options(options))
        if survey.several and (survey.look.refusal is None or options.anyway):
            return _run_people(writer, survey.settled(), options, listener, (for_look, for_track))
        prepared = fit_survey(for_look, survey, options, kind, cache, listener)
        writer.metrics |= {"kept_silhouettes": True} if cache is not None and cache.is_complete else {}
        writer.metrics["look_s"] = round(time.perf_counter() - start, 3)
        listener.look(prepared.look)
        check_smoothing(options, prepared.look.rate)
        subject = prepared.check()
        leans, state, store = _track(writer, prepared, kind, options, listener, for_track, cache)
        motion = writer.motion
        if subject.both_ways and options.smoothing[0] != "off":
            motion = backward(writer, subject.turned_back(state), options, listener, store)
        smooth_run(writer, [(0, subject)], options, listener, motion, leans)
        show_run(writer, prepared.survey, options, listener, store, drawings(subject, writer.motion))
        found = judge(writer, rig, prepared.look, subject.person, options)
    return summary(folder, found, prepared.look)


def _run_people(writer: RunWriter, survey: Survey, options: Options, listener: Listener,
                rngs: tuple[np.random.Generator, np.random.Generator]) -> Summary:
    """Track several people, each into a folder of their own."""
    assert survey.census is not None
    check_people(options)
    listener.look(survey.look)
    check_smoothing(options, survey.look.rate)
    entries = {key: value for key, value in writer.info.items() if key not in (*OWN_KEYS, "people", "truth")}
    people = PeopleRun(writer, survey, survey.census, options, entries, listener)
    found = people.track(*rngs, smooth_run)
    if not found:
        raise TrackingError(f"{survey.look.recording}: none of {survey.census.number} people is found")
    if len(found) < min(survey.census.number, options.people or survey.census.number):
        warn(f"{survey.look.recording}: {survey.census.number} people were counted, {len(found)} could be followed: a person whom few "
             f"cameras show whole, or who is seen for less than a second, is not; if there are no more, give --people {len(found)}")
    first = read_run(person_folder(writer.folder, min(found)))
    if len(found) == 1:
        ((number, metrics),) = found.items()
        writer.adopt(people.writers[number])
        write_metrics(writer.folder, metrics := people.metrics | metrics)
        return Summary(writer.folder, first.motion, metrics, survey.look)
    writer.info["people"] = len(found)
    return Summary(writer.folder, first.motion, people.metrics | {"people": found}, survey.look)


def _track(writer: RunWriter, prepared: Prepared[State, Observation, Before], kind: Kind[State, Observation, Before], options: Options,
           listener: Listener, rng: np.random.Generator,
           cache: SilhouetteCache | None) -> tuple[Sequence[float], State | None, MaskStore]:
    """Decode, segment, observe, track, doubt and write each frame set. Returns the `lean` of each, the last state, and the silhouettes if
    they are to be tracked backward or drawn, too."""
    subject, survey, timer, store = prepared.check(), prepared.survey, StageTimer(), MaskStore()
    kept = store if options.overlay or (subject.both_ways and options.smoothing[0] != "off") else None
    rows, watch = Written(writer, prepared, rng), RigWatch(len(survey.rig.footage), survey.rig.short)
    state, before = rows.carried.state, rows.carried.before
    listener.begin("tracking", tracked(prepared.look.frames, options.every))
    began = time.perf_counter()
    try:
        with ExitStack() as stack:
            frames = _segmented(stack, survey, options, watch, cache, kept)
            for found in rows.repeated(frames):
                watch.tracked(subject.drawn(found))
            began = time.perf_counter()
            observed = stack.enter_context(closing(subject.observations(frames)))
            for now, observation, seconds in timer.each("wait", observed):
                timer.add(decode=now.decoding, segment=now.segmenting, hull=seconds)
                with timer.time("track"):
                    state = subject.next_state(rng, state, observation)
                    watch.tracked(subject.drawn(state))
                with timer.time("doubt"):
                    found, before = motion_frame(subject, now.time, state, observation, before)
                with timer.time("write"):
                    rows.write(now, found, state, before)
                listener.advance(rows.count)
    finally:
        writer.metrics |= timings(timer, kind.stages, rows.count - len(rows.earlier), time.perf_counter() - began)
        writer.metrics |= rows.left_out | set_aside(watch.intervals, survey.rig.names)
    return rows.leans, state, store


def _segmented(stack: ExitStack, survey: Survey, options: Options, watch: RigWatch, cache: SilhouetteCache | None,
               store: MaskStore | None) -> Iterator[FrameSet]:
    """The decoded and segmented frame sets, without the masks of cameras that are set aside; kept ones, if the cache has them."""
    task = Task(survey.rig, survey.silhouettes, options.masks, options.every, images=False, corrected=False, codes=True)
    frames = stack.enter_context(closing(frames_beside(task)))
    if cache is not None:
        frames = stack.enter_context(closing(cache.frames(frames)))
    seen = (now._replace(seen=watch(now.time, now.seen)) for now in frames)
    return seen if store is None else stack.enter_context(closing(store.stored(seen)))
