"""A whole run, with one camera or several: a recording in, a run folder out. Prints nothing: it notifies a `Listener`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.person import write_person
from shadowpuppet.io.run import RunWriter, read_run, write_metrics
from shadowpuppet.pipeline.look import Look, RigLook, Survey
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.person import fit_monocular
from shadowpuppet.pipeline.person_rig import fit_multiview
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
    STAGES,
    LeftOut,
    Listener,
    StageTimer,
    Summary,
    evaluated,
    generators,
    json_text,
    set_aside,
    timings,
    tracked,
    warn_of_left_out,
    warn_of_losses,
    warn_of_set_aside,
)
from shadowpuppet.pipeline.rig import FrameSet, Rig, open_rig, read_frames
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.subject import TrackedSubject, average_body, joint_names, motion_frame
from shadowpuppet.pipeline.survey import survey_camera, survey_rig
from shadowpuppet.silhouette.added import SceneHint
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.rig_watch import RigWatch
from shadowpuppet.video import write_frames

__all__ = ["Listener", "Summary", "fit_person", "json_text", "look_at", "track_recording"]


LOOKS_AGAIN = 3
"""Greatest number of times that a recording is surveyed again because of what the fitted body leaves unexplained."""


class Kind(NamedTuple):
    """How a recording is surveyed, fitted and tracked: with one camera or with several."""

    method: str
    """Name of the method; {} stands for the number of cameras."""
    settings: str
    """Name of the field of `Options` with the tracker's settings."""
    survey: Callable[..., Survey]
    """Examines a rig with options and, after a first fit, with a `SceneHint` for each camera."""
    fit: Callable[[np.random.Generator, Survey, Options], TrackedSubject]
    """Measures the person and makes the tracker."""
    look_fits: bool
    """Whether `look_at` also measures the person; not with several cameras, which takes long."""
    stages: tuple[str, ...]
    """Stages whose times are written to metrics.json."""


MONOCULAR = Kind("Liu 2011, one camera", "tracker", survey_camera, fit_monocular, True, ("decode", "segment", "track", "doubt", "write"))
MULTIVIEW = Kind("Ni 2008, {} cameras", "multiview", survey_rig, fit_multiview, False, STAGES)


class Prepared(NamedTuple):
    """The surveyed recording and the fitted person, before tracking."""

    survey: Survey
    subject: TrackedSubject | None
    """The fitted person; None if tracking is hopeless."""
    look: Look | RigLook

    def check(self) -> TrackedSubject:
        """The fitted person. Raises `TrackingError` if tracking is hopeless."""
        self.survey.check()
        assert self.subject is not None
        return self.subject


@one_blas_thread()
def look_at(recording: str | Path, options: Options | None = None) -> Look | RigLook:
    """Examine a recording as `track_recording` does before tracking. Raises a `ShadowPuppetError` if something cannot be used."""
    options = options or Options()
    rig = open_rig(recording, options)
    kind = kind_of(rig)
    return prepare(generators(options)[0], rig, options, kind).look if kind.look_fits else kind.survey(rig, options).look


@one_blas_thread()
def fit_person(recording: str | Path, file: str | Path, options: Options | None = None) -> tuple[TrackedSubject, Look | RigLook]:
    """Measure the person and save the sizes. Raises a `ShadowPuppetError` if no person is found or the file cannot be written."""
    options = options or Options()
    rig = open_rig(recording, options)
    prepared = prepare(generators(options)[0], rig, options, kind_of(rig))
    subject = prepared.check()
    write_person(file, subject.person)
    return subject, prepared.look


@one_blas_thread()
def track_recording(recording: str | Path, folder: str | Path, options: Options | None = None,
                    listener: Listener | None = None, cache: SilhouetteCache | None = None) -> Summary:
    """Track a recording (a folder, or a film with `Options.fov`) of one camera or several into a run folder.

    `cache` keeps silhouettes for the next run of the same recording; a run that used them has `kept_silhouettes` in metrics.json.

    In addition to the files that `io.run` describes, the folder gets look.json, person.toml (the sizes), calibration.toml (the cameras)
    and, if asked for, overlay.mp4. An interrupted run keeps the frames tracked so far. The same options, films and machine give the same
    joints. Raises a `ShadowPuppetError` if something cannot be used.
    """
    options = options or Options()
    rig = open_rig(recording, options)
    return run(rig, kind_of(rig), folder, options, listener or Listener(), cache)


def kind_of(rig: Rig) -> Kind:
    """`MONOCULAR` or `MULTIVIEW`, by the number of cameras."""
    return MULTIVIEW if rig.is_multiview else MONOCULAR


def prepare(rng: np.random.Generator, rig: Rig, options: Options, kind: Kind, cache: SilhouetteCache | None = None) -> Prepared:
    """Survey a recording, and fit the person unless tracking is hopeless. Raises a `ShadowPuppetError` if something cannot be used."""
    survey = kind.survey(rig, options) if cache is None else cache.survey(rig, options, kind.survey)
    if survey.look.refusal is not None:
        return Prepared(survey, None, survey.look)
    subject = kind.fit(rng, survey, options)
    for _ in range(LOOKS_AGAIN):
        again = _looked_again(survey, subject, options, kind)
        if again is None:
            break
        survey, subject = again, kind.fit(rng, again, options)
        if cache is not None:
            cache.keep(survey)
    return Prepared(survey, subject, survey.look_with(subject.summary, subject.doubts))


def _looked_again(survey: Survey, subject: TrackedSubject, options: Options, kind: Kind) -> Survey | None:
    """The survey in which what never moves, and the fitted body leaves unexplained, belongs to the scene; None if there is nothing."""
    if all(each is None for each in subject.beside):
        return None
    hints = tuple(SceneHint(beside, each.added) for beside, each in zip(subject.beside, survey.silhouettes, strict=True))
    again = kind.survey(survey.rig, options, hints)
    more = any(new.added is not old.added for new, old in zip(again.silhouettes, survey.silhouettes))
    return again if more and again.look.refusal is None else None


def run(rig: Rig, kind: Kind, folder: str | Path, options: Options, listener: Listener, cache: SilhouetteCache | None = None) -> Summary:
    """Survey, fit, track and evaluate; see `track_recording`."""
    for_look, for_track = generators(options)
    body, recording = average_body(getattr(options, kind.settings).body), rig.recording
    info = {"recording": recording.path.resolve(), "method": kind.method.format(len(rig.cameras)),
            "cameras": list(rig.names) if rig.is_multiview else None, "settings": plain_options(options),
            "truth": recording.truth and recording.truth.resolve()}
    with RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), info) as writer:
        listener.begin("looking")
        start = time.perf_counter()
        prepared = prepare(for_look, rig, options, kind, cache)
        writer.metrics |= {"kept_silhouettes": True} if cache is not None and cache.is_complete(options) else {}
        writer.metrics["look_s"] = round(time.perf_counter() - start, 3)
        listener.look(prepared.look)
        _write_beside(writer.folder, prepared)
        _track(writer, prepared, kind, options, listener, for_track, cache)
    written = read_run(folder)
    metrics = written.metrics | evaluated(rig, written.motion)
    warn_of_losses(written.motion)
    warn_of_left_out(metrics.get("left_out", []))
    warn_of_set_aside(metrics.get("set_aside", []))
    write_metrics(folder, metrics)
    return Summary(Path(folder), written.motion, metrics, prepared.look)


def _write_beside(folder: Path, prepared: Prepared) -> None:
    subject = prepared.check()
    write_whole(folder / "look.json", json_text(prepared.look) + "\n")
    write_person(folder / "person.toml", subject.person)
    write_calibration(folder / "calibration.toml", [footage.view.camera for footage in prepared.survey.rig.footage])


def _steadied(seen: FrameSet, silhouettes: Sequence[Silhouettes]) -> FrameSet:
    """A frame set with the images of cameras that stand still."""
    images = (None if image is None else each.steadied(image) for each, image in zip(silhouettes, seen.images))
    return seen._replace(images=tuple(images))


def _track(writer: RunWriter, prepared: Prepared, kind: Kind, options: Options, listener: Listener, rng: np.random.Generator,
           cache: SilhouetteCache | None) -> None:
    """For each frame set: make silhouettes and observation, update the tracker's state, write the result."""
    subject, survey, timer, state, before, count = prepared.check(), prepared.survey, StageTimer(), None, None, 0
    watch = RigWatch(len(survey.rig.footage))
    left_out = LeftOut([footage.view.camera for footage in survey.rig.footage])
    rate = prepared.look.rate if np.isfinite(prepared.look.rate) else FALLBACK_RATE
    listener.begin("tracking", tracked(prepared.look.frames, options.every))
    began = time.perf_counter()
    try:
        with ExitStack() as stack:
            overlay = stack.enter_context(write_frames(writer.folder / "overlay.mp4", rate / options.every)) if options.overlay else None
            segment = [silhouettes.following() for silhouettes in survey.silhouettes]
            frames = stack.enter_context(closing(read_frames(survey.rig, segment, ready=options.masks, every=options.every)))
            if cache is not None:
                frames = stack.enter_context(closing(cache.frames(frames, options)))
            if survey.rig.is_multiview:
                frames = (seen._replace(masks=watch(seen.time, seen.masks)) for seen in frames)
            observed = stack.enter_context(closing(subject.observations(frames)))
            for seen, observation, seconds in timer.each("wait", observed):
                timer.add(decode=seen.decoding, segment=seen.segmenting, hull=seconds)
                with timer.time("track"):
                    state = subject.next_state(rng, state, observation)
                    watch.tracked(subject.drawn(state))
                left_out.add(seen.time, subject.left_out(state))
                with timer.time("doubt"):
                    found, before = motion_frame(subject, seen.time, state, observation, before)
                with timer.time("write"):
                    writer.write(found)
                    if overlay is not None:
                        overlay.write(subject.draw(_steadied(seen, survey.silhouettes), found))
                count += 1
                listener.advance(count)
    finally:
        writer.metrics |= timings(timer, kind.stages, count, time.perf_counter() - began)
        writer.metrics |= left_out.metrics() | set_aside(watch.intervals, survey.rig.names)
