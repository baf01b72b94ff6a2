"""Examines a recording of one camera before a run: silhouettes, first seconds, and doubts about the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, islice

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import WHOLE
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.errors import HARMFUL, NOTED, Finding
from shadowpuppet.pipeline.findings.body import body_for, walking_cautions, whole_person
from shadowpuppet.pipeline.findings.cautions import (
    added_cautions,
    condition_cautions,
    feet_cautions,
    film_cautions,
    recovery_cautions,
    recovery_doubt,
    sitting_cautions,
    unlike_ready,
)
from shadowpuppet.pipeline.findings.film import mean_overlap, survey_films
from shadowpuppet.pipeline.findings.look import FilmSurvey, FirstSeconds, Look, Survey
from shadowpuppet.pipeline.footage import FIRST, CameraFrame, Footage, Sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.census import count_in_picture
from shadowpuppet.pipeline.progress import Listener, Steps
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_silhouettes

SHORT = 1.0
"""Length of a film, seconds, under which it is said to be short."""
UPRIGHT, WIDE = 40.0, 55.0
"""Horizontal field of view, degrees, of a phone held upright; and from which on an upright film's is doubted: it would be that of a phone
held across."""
UNEVEN = 0.1
"""Jitter over the frame interval above which the film's rate counts as variable."""


def survey_camera(rig: Rig, options: Options, listener: Listener | None = None, films: tuple[FilmSurvey, ...] = ()) -> Survey:
    """Examine a recording of one camera; `films`: its film, if that was examined again. Raises a `ShadowPuppetError` if something cannot be
    used."""
    footage, steps = rig.footage[0], Steps(listener, rig.names, again=bool(films))
    films = films or survey_films(rig, options, steps)
    (film,) = films
    steps("silhouettes of the first seconds")
    look = _look(footage, film, options)
    hopeless = look.refusal is not None and not options.anyway
    clean = film.silhouettes if hopeless else clean_silhouettes(footage, film.sample, film.silhouettes, options)
    first = FirstSeconds([], []) if hopeless else _first_people(film.sample, clean)
    film.silhouettes.classified.clear()
    return Survey(rig, (film.silhouettes,), (clean,), first, look, films=films)


def _first_people(sample: Sample, clean: Silhouettes) -> FirstSeconds:
    """The first `FIRST` silhouettes that may be a person's: of the first seconds, then of the frames sampled from the whole film; and
    silhouettes spread over the whole film, of the first frame of each of the sample's runs but the first."""
    def seen(frame: CameraFrame) -> tuple[float, Mask]:
        return frame.time, clean(frame)

    people = list(islice((each for each in map(seen, chain(sample.first, sample.frames)) if may_be_person(each[1])), FIRST))
    spread = [each for each in (seen(run[0]) for run in sample.runs[1:]) if may_be_person(each[1])]
    return FirstSeconds([time for time, _ in people], [(mask,) for _, mask in people], tuple((mask,) for _, mask in spread))


def _look(footage: Footage, film: FilmSurvey, options: Options) -> Look:
    """The findings about a film."""
    sample, camera = film.sample, footage.camera
    plain = [mask for frame in sample.frames if (mask := film.silhouettes.plain(frame)) is not None]
    look = Look(
        **vars(film.look), recording=str(footage.recording.path), camera=camera.name, calibrated=camera.oriented,
        lens_calibrated=camera.lens_measured,
        looked_at=len(sample.times), jitter=sample.jitter, scale=known_scale(footage), area=_share(film.masks),
        plain_area=_share(plain) if plain else None, exact_overlap_plain=mean_overlap(plain, film.exact),
        refusal=recovery_doubt(film.silhouettes) or film.look.quality.refusal(),
    )  # fmt: skip
    if look.refusal:
        return look
    sits = sitting_cautions(film.masks, [frame.time for frame in sample.frames])
    look = replace(look, body=body_for(film.masks))
    whole = options.tracker.body if options.body_is_known else look.body
    posture = feet_cautions({camera.name: look.quality.border["bottom"]}) if whole in WHOLE else sits or walking_cautions(film.masks)
    posture += [whole_person()] if whole != options.tracker.body else []
    several = _several_people(film, HARMFUL if options.people is None else NOTED)
    doubts = (*several, *posture, *_doubts(look, footage, whole in WHOLE), *film_cautions(footage),
              *recovery_cautions([camera.name], [film.silhouettes]), *added_cautions(look.added))
    return replace(look, findings=(*doubts, *look.quality.warnings()))


def _several_people(film: FilmSurvey, severity: int) -> list[Finding]:
    number = count_in_picture(film.sample, film.silhouettes)
    if number < 2:
        return []
    return [Finding.of("{people} people are in the picture: one camera tracks one, the nearest, who is the largest in the picture; two "
                       "calibrated cameras or more track all", "{people} people; the nearer one is tracked", severity, people=number)]


def known_scale(footage: Footage) -> str:
    """Known lengths that fix the scale, in words."""
    subject = footage.recording.subject
    known = [f"{name} {value:.2f} m" for name, value in (("height", subject.height), ("distance", subject.distance)) if value]
    return " and ".join(known) or f"average height of {AVERAGE_HEIGHT:.2f} m, assumed"


def _doubts(look: Look, footage: Footage, whole: bool) -> list[Finding]:
    """What is in doubt before anything is tracked; `whole`: whether a whole body is, whose soles show the distance."""
    doubts, subject = list[Finding](), footage.recording.subject
    if not look.calibrated:
        guessed = "" if look.lens_calibrated else ", with a field of view of {fov:.0f} degrees and no distortion"
        short = "camera's place not calibrated: depths are rough" if look.lens_calibrated else (
            "camera not calibrated: depths are rough; give --calibration")
        doubts.append(Finding.of(f"no calibration of the camera's place: it is taken for level{guessed}; depths and the world's axes are "
                                 "as good as that; give a calibration.toml", short, NOTED, fov=look.fov))
    if not look.calibrated and look.size[0] < look.size[1] and look.fov > WIDE:
        doubts.append(Finding.of("the film is upright: {fov:.0f} degrees are what a phone sees held across, held upright it sees about "
                                 "{upright:.0f} from left to right; with a wrong one all depths are wrong; give --fov {upright:.0f}",
                                 "upright film: --fov of a phone is then about {upright:.0f}", NOTED, fov=look.fov, upright=UPRIGHT))
    if subject.height is None and subject.distance is None:
        doubts.append(unknown_scale(look.scale))
    elif subject.distance is None and not footage.recording.references and not whole:
        doubts.append(Finding("the distance is not known: it is found from the silhouette, often a tenth too near, and all places are as "
                              "wrong as that; measure it and give --distance, or take references",
                              "distance not known: measure it, give --distance", NOTED if look.calibrated else HARMFUL))
    if look.frames is not None and look.frames < SHORT * look.rate:
        doubts.append(Finding.of("the film has only {frames} frames ({seconds:.1f} s): too few to measure the person well and to smooth "
                                 "the motion; film some seconds", "film of {seconds:.1f} s is very short: film some seconds", HARMFUL,
                                 frames=look.frames, seconds=look.frames / look.rate))
    if look.jitter * look.rate > UNEVEN:
        doubts.append(Finding.of("the time from frame to frame varies by {percent:.0f} %: the film's own times are kept",
                                 "frames come unevenly: their own times are kept", NOTED, percent=100 * look.jitter * look.rate))
    return [*doubts, *unlike_ready(look.exact_overlap), *condition_cautions(look.condition, footage.view.background is None)]


def unknown_scale(scale: str) -> Finding:
    """The doubt about one camera's film of a person of unknown height and distance; `scale`: as `known_scale`."""
    return Finding(f"neither height nor distance is known: the {scale}, and all lengths are as wrong as that is; give --height",
                   "height not known: all lengths are guesses; give --height", HARMFUL)


def _share(masks: Sequence[Mask]) -> float:
    return float(np.mean([mask.mean() for mask in masks]))
