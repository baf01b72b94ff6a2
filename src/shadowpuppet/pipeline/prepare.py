"""What comes before tracking, with one camera or several: the recording is surveyed, and the person measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Generic, NamedTuple

import numpy as np

from shadowpuppet.body.models import WHOLE, average_body, kind_of
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.errors import TrackingError
from shadowpuppet.io.inputs.inputs import Resuming
from shadowpuppet.io.person import read_person, write_person
from shadowpuppet.io.prior import read_prior
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.pipeline.findings.camera import survey_camera
from shadowpuppet.pipeline.findings.film import films_again
from shadowpuppet.pipeline.findings.keypoints import look_at_keypoints
from shadowpuppet.pipeline.findings.look import Look, RigLook, Survey
from shadowpuppet.pipeline.findings.rig import survey_rig
from shadowpuppet.pipeline.options import Options, check_used, plain_options, read_options
from shadowpuppet.pipeline.person import fit_monocular
from shadowpuppet.pipeline.person_rig import fit_multiview
from shadowpuppet.pipeline.progress import STAGES, Listener, generators
from shadowpuppet.pipeline.rig import Rig, open_rig
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.pipeline.subject import Before, FittedPerson, Observation, State, TrackedSubject, joint_names
from shadowpuppet.threads import one_blas_thread

LOOKS_AGAIN = 3
"""Greatest number of times that a recording is surveyed again because of what the fitted body leaves unexplained."""


class Kind(NamedTuple, Generic[State, Observation, Before]):
    """How a recording is surveyed, fitted and tracked: with one camera or with several."""

    method: str
    """Source of the method; {} stands for the number of cameras."""
    settings: str
    """Name of the field of `Options` with the tracker's settings."""
    survey: Callable[..., Survey]
    """Examines a rig with options, for a listener, and after a first fit with films that were examined again."""
    fit: Callable[[np.random.Generator, Survey, Options], TrackedSubject[State, Observation, Before]]
    """Measures the person and makes the tracker."""
    stages: tuple[str, ...]
    """Stages whose times are written to metrics.json."""

    def name(self, preset: str, cameras: int) -> str:
        """The method's name: the paper's own only with the paper's settings."""
        return f"{'after ' if preset == 'default' else ''}{self.method.format(cameras)}"


MONOCULAR = Kind("Liu 2011, one camera", "tracker", survey_camera, fit_monocular, ("decode", "segment", "track", "doubt", "write"))
MULTIVIEW = Kind("Ni 2008, {} cameras", "multiview", survey_rig, fit_multiview, STAGES)


def is_for_rig(rig: Rig, options: Options) -> bool:
    """Whether the tracker for several cameras tracks: it does with one, too, where keypoints alone are evidence."""
    return rig.is_multiview or not options.uses_silhouettes


class Prepared(NamedTuple, Generic[State, Observation, Before]):
    """The surveyed recording and the fitted person, before tracking."""

    survey: Survey
    subject: TrackedSubject[State, Observation, Before] | None
    """The fitted person; None if tracking is hopeless."""
    look: Look | RigLook

    def check(self) -> TrackedSubject[State, Observation, Before]:
        """The fitted person. Raises `TrackingError` if tracking is hopeless."""
        if self.subject is None:
            raise TrackingError(f"{self.look.recording}: {self.look.refusal}; --anyway tries it")
        return self.subject


@one_blas_thread()
def look_at(recording: str | Path, options: Options | None = None, listener: Listener | None = None) -> Look | RigLook:
    """Examine a recording as `track_recording` does before tracking; with one camera the person is measured, too, which takes long with
    several. Raises a `ShadowPuppetError` if something cannot be used."""
    options = options or Options()
    rig = open_rig(recording, options)
    options = for_person(rig, options)
    look = (survey_rig(rig, options, listener=listener).look if is_for_rig(rig, options)
            else prepare(generators(options)[0], rig, options, MONOCULAR, listener=listener).look)
    return look if look.keypoints is not None else replace(look, keypoints=look_at_keypoints(rig.footage))


@one_blas_thread()
def fit_person(recording: str | Path, file: str | Path, options: Options | None = None,
               listener: Listener | None = None) -> tuple[FittedPerson, Look | RigLook]:
    """Measure the person and save the sizes. Raises a `ShadowPuppetError` if no person is found or the file cannot be written."""
    options = options or Options()
    rig, (rng, _) = open_rig(recording, options), generators(options)
    options = for_person(rig, options)
    if is_for_rig(rig, options):
        prepared = prepare(rng, rig, options, MULTIVIEW, listener=listener)
    else:
        prepared = prepare(rng, rig, options, MONOCULAR, listener=listener)
    subject = prepared.check()
    write_person(file, subject.person)
    return subject, prepared.look


def check_options(options: Options, rig: Rig) -> None:
    """Raise `SettingsError` for options that have no effect on a rig, `FormatError` for a person or a prior that cannot be read, before the
    recording is examined."""
    several = is_for_rig(rig, options)
    check_used(options, several)
    if options.person is not None:
        read_person(options.person, (options.multiview if several else options.tracker).body)
    if options.prior is not None and several:
        read_prior(options.prior)


def for_person(rig: Rig, options: Options) -> Options:
    """The options with one camera's body of given sizes, if nothing says another. Raises `FormatError` for a person that cannot be read."""
    if options.person is None or is_for_rig(rig, options) or replace(options, person=None).body_is_known:
        return options
    sizes = read_person(options.person).sizes
    return options if isinstance(sizes, CardboxSizes) else options.with_body(kind_of(sizes))


def for_film(survey: Survey, options: Options) -> Options:
    """The options with the body that one camera's film asks for, if nothing else determines it."""
    look, rig = survey.look, survey.rig
    if not isinstance(look, Look) or is_for_rig(rig, options) or options.body_is_known:
        return options
    return options.with_body(look.body)


def as_before(folder: str | Path, options: Options) -> Options:
    """The options with the body of a run in a folder that was broken off, where the film determined it."""
    path = Path(folder) / "run.toml"
    before = read_options(path).get("body") if path.exists() and not options.body_is_known else None
    return options.with_body(before) if before in WHOLE else options


def run_writer(rig: Rig, kind: Kind[State, Observation, Before], folder: str | Path, options: Options, resume: bool) -> RunWriter:
    """The writer of a run's folder; `resume`: an earlier run there goes on."""
    recording = rig.recording
    info = {"recording": recording.path.resolve(), "method": kind.name(options.preset, len(rig.cameras)),
            "cameras": list(rig.names) if is_for_rig(rig, options) else None, "settings": plain_options(options),
            "truth": recording.truth and recording.truth.resolve(), "begin": recording.begin or None, "end": recording.duration}
    return RunWriter(folder, *body_names(kind, options), info, Resuming(resume, rig.inputs))


def body_names(kind: Kind[State, Observation, Before], options: Options) -> tuple[str, tuple[str, ...], list[str]]:
    """The tracked body's name, and those of its DOF and joints."""
    body = average_body(getattr(options, kind.settings).body)
    return body.name, body.skeleton.dof_names, joint_names(body)


def look_around(rig: Rig, options: Options, kind: Kind[State, Observation, Before], cache: SilhouetteCache | None = None,
                listener: Listener | None = None) -> Survey:
    """Survey a recording. Raises a `ShadowPuppetError` if something cannot be used."""
    survey = partial(kind.survey, listener=listener)
    return survey(rig, options) if cache is None else cache.survey(rig, options, survey)


def prepare(rng: np.random.Generator, rig: Rig, options: Options, kind: Kind[State, Observation, Before],
            cache: SilhouetteCache | None = None, listener: Listener | None = None) -> Prepared[State, Observation, Before]:
    """Survey a recording, and fit the person unless tracking is hopeless. Raises a `ShadowPuppetError` if something cannot be used."""
    survey = look_around(rig, options, kind, cache, listener)
    return fit_survey(rng, survey, for_film(survey, options), kind, cache, listener or Listener())


def fit_survey(rng: np.random.Generator, survey: Survey, options: Options, kind: Kind[State, Observation, Before],
               cache: SilhouetteCache | None, listener: Listener) -> Prepared[State, Observation, Before]:
    """The surveyed recording and the person in it."""
    if survey.look.refusal is not None and not options.anyway:
        return Prepared(survey.settled(), None, survey.look)
    listener.begin("measuring the person")
    try:
        subject = kind.fit(rng, survey, options)
    except TrackingError:
        listener.look(survey.look)  # which may say why
        raise
    for _ in range(LOOKS_AGAIN):
        again = _looked_again(survey, subject, options, kind, listener)
        if again is None:
            break
        listener.begin("measuring the person again: what belongs to the scene is left out now")
        survey, subject = again, kind.fit(rng, again, options)
        if cache is not None:
            cache.keep(survey)
    return Prepared(survey.settled(), subject, survey.look_with(subject.summary, subject.doubts))


def _looked_again(survey: Survey, subject: FittedPerson, options: Options, kind: Kind[State, Observation, Before],
                  listener: Listener) -> Survey | None:
    """The survey in which what never moves, and the fitted body leaves unexplained, belongs to the scene; None if there is nothing."""
    if all(each is None for each in subject.beside):
        return None
    films = films_again(survey, options, subject.beside, listener)
    again = None if films is None else kind.survey(survey.rig, options, listener, films)
    return again if again is not None and again.look.refusal is None else None
