"""Examines a recording of several cameras before a run: each film, the first seconds of all together, do they agree, how many people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.calibration.agreement import SETS_COMPARED, Agreement, agreement
from shadowpuppet.camera.mask import Seen, may_be_person
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.pipeline.findings.cautions import (
    added_cautions,
    condition_cautions,
    feet_cautions,
    film_cautions,
    recovery_cautions,
    unlike_ready,
)
from shadowpuppet.pipeline.findings.delays import delay_cautions
from shadowpuppet.pipeline.findings.film import of_several, survey_films
from shadowpuppet.pipeline.findings.look import CameraLook, FilmSurvey, FirstSeconds, RigLook, Survey
from shadowpuppet.pipeline.findings.opening import OPENING, first_seconds, opening_of
from shadowpuppet.pipeline.findings.rig_by_keypoints import survey_keypoints
from shadowpuppet.pipeline.findings.scale import error_in, moments_of
from shadowpuppet.pipeline.findings.upright import up_caution
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.census import Census, are_apart, later_sets, people_finding, sampled_sets, take_census
from shadowpuppet.pipeline.progress import Listener, Steps
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.threads import one_opencv_thread
from shadowpuppet.tracking.people.views import View, views_of

SILHOUETTES_OR_CAMERAS = "silhouettes do not fit together: film the empty scene, or calibrate"
"""Ten words on an agreement that an empty scene recovered from the film may have spoiled."""
UNSEEN = ("the project states several people (multi_person = true in Config.toml), but fewer than two are found against an empty scene "
          "that is made of the films, into which people vanish who never leave: film the empty scene (background/<camera>.mp4), bring "
          "masks (--masks), or write multi_person = false for one person")
"""Why a project of several people is refused."""
COMPARED = 3
"""Number of views of a person in which each camera is compared with the others, where several people are seen."""
ENOUGH = 3
"""Number of cameras that show all of the person, with which it does no harm that others do not."""
RATES, LENGTHS = 0.02, 0.1
"""Relative difference of rates, and difference of lengths (s), above which films are reported to differ."""


@one_opencv_thread()
def survey_rig(rig: Rig, options: Options, listener: Listener | None = None, films: tuple[FilmSurvey, ...] = ()) -> Survey:
    """Examine each camera's film, and the first seconds of all together; `films`: the films, if they were examined again. Raises a
    `ShadowPuppetError` if something cannot be used."""
    if not options.uses_silhouettes:
        return survey_keypoints(rig, options, listener)
    steps = Steps(listener, rig.names, again=bool(films))
    apart = films = films or survey_films(rig, options, steps)
    silhouettes = tuple(film.silhouettes for film in films)
    census, spread, wide = None, list[Seen](), tuple(each.of_several() for each in silhouettes)
    if any(_shows_person(film) for film in films):
        steps("counting people in all films")
        seen = max((film.sample.times[-1] for film in films if len(film.sample.times)), default=0.0)
        sampled, later = sampled_sets([film.sample for film in films], wide), later_sets(rig, wide, float(seen))
        census, spread = take_census(rig.cameras, sampled, later), [*sampled, *later]
    counted = census.number if census is not None else 0
    if census is not None and options.people is not None and not (options.people == 1 < counted and are_apart(spread)):
        census = replace(census, number=options.people)
    several = census.number if census is not None and census.number > 1 else 0
    if several:
        films = tuple(map(of_several, films))
        silhouettes = tuple(film.silhouettes for film in films)
    steps("silhouettes of the first seconds in all films")
    first = first_seconds(rig, silhouettes, [film.sample for film in films], opening_of(rig), options.masks)
    steps("do the cameras agree")
    agree = _agreement_of_people(rig, census, first) if census is not None and several else _agreement_of_one(rig, first, spread)
    look = RigLook(recording=str(rig.recording.path), cameras=tuple(map(_camera_look, rig.footage, films)), rate=rig.rate, frames=rig.count,
                   agreement=agree)
    recovered = frozenset(camera.name for camera, each in zip(look.cameras, silhouettes, strict=True) if each.recovered is not None)
    refusal = _rig_refusal(look, first) or (UNSEEN if rig.recording.several and recovered and not several else None)
    late = [] if refusal or agree.remedy is not None else delay_cautions(rig, silhouettes, first, options.masks)
    doubts = [*(late or _disagreements(agree, recovered)), *_rig_doubts(look, several > 0, recovered),
              *recovery_cautions([camera.name for camera in look.cameras], silhouettes)]
    doubts += [each.about(f"camera {footage.camera.name!r}") for footage in rig.footage for each in film_cautions(footage)]
    if not refusal:
        # also of several people: a wrong scale makes two of one
        scale = error_in(rig, moments_of(rig.cameras, first.masks, options.multiview), options)
        walk = [] if several else moments_of(rig.cameras, [seen.masks for seen in spread], options.multiview)
        found = (None if scale is None else scale.caution(), up_caution(rig.cameras, walk, options.multiview))
        doubts = [each for each in found if each is not None] + doubts
    if several and options.people != 1:
        doubts.insert(0, people_finding(several))
    elif counted > 1:
        doubts.insert(0, Finding.of("{people} people were counted; one is tracked, others are ignored (--people 1)",
                                    "{people} people: one is tracked, others are ignored", NOTED, people=counted))
    look = replace(look, refusal=refusal, findings=() if refusal else tuple(doubts))
    for each in silhouettes:
        each.classified.clear()
    return Survey(rig, silhouettes, silhouettes, first, look, census, apart)


def _agreement_of_one(rig: Rig, first: FirstSeconds, spread: Sequence[Seen] = ()) -> Agreement:
    """Do the cameras agree about the person of the first seconds? A camera that disagrees there, but not in sets that are `spread` over the
    film, shows a part of the person then, and is not to blame."""
    step = float(np.median(np.diff(first.times))) if len(first.times) > 1 else np.nan
    found = agreement(rig.cameras, first.masks, step)
    if not found.wrong or found.hopeless or len(spread) < SETS_COMPARED:
        return found
    over_film = agreement(rig.cameras, [seen.masks for seen in spread])
    return found if over_film.wrong or None in over_film.apart else over_film


def _agreement_of_people(rig: Rig, census: Census, first: FirstSeconds) -> Agreement:
    """Do the cameras agree about each of several people, in the views that show them apart? One camera may see more
    people than another, so that whole silhouettes are compared only for a camera without such a view."""
    rows = list[View]()
    for n in evenly_spread(len(first.masks), SETS_COMPARED):
        figures = census.people(first.seen(n))
        each = (views_of(census.floor, one, [other for other in figures if other is not one], first.masks[n]) for one in figures)
        rows += [row for row in each if sum(mask is not None for mask in row) > 1]
    if 2 * len(rows) < SETS_COMPARED:  # one person in a calibration of the wrong unit may be taken for several
        return _agreement_of_one(rig, first)
    found = agreement(rig.cameras, _most_shown(rows))
    if None not in found.apart:
        return found
    together = _agreement_of_one(rig, first)
    return replace(found, apart=tuple(whole if one is None else one for one, whole in zip(found.apart, together.apart, strict=True)))


def _most_shown(rows: Sequence[View]) -> list[View]:
    """Views that show each camera's people in `COMPARED` of them, if there are as many, and in most cameras: a person whom two show tells
    whether these two agree, not which of them is wrong."""
    taken, number = list[View](), np.zeros(len(rows[0]), int)
    for row in sorted(rows, key=lambda row: -sum(mask is not None for mask in row)):
        shown = np.array([mask is not None for mask in row])
        if (number[shown] < COMPARED).any():
            taken.append(row)
            number += shown
    return taken


def _shows_person(film: FilmSurvey) -> bool:
    return any(may_be_person(mask) for mask in film.masks)


def _camera_look(footage: Footage, film: FilmSurvey) -> CameraLook:
    x, y, z = footage.view.camera.centre.tolist()
    look = film.look if len(film.sample.times) > 1 else replace(film.look, rate=footage.film.rate)
    return CameraLook(**vars(look), name=footage.camera.name, place=(x, y, z), start=footage.view.start)


def _rig_refusal(look: RigLook, first: FirstSeconds) -> str | None:
    """Why tracking is hopeless, and the remedy, in a sentence; None if it is not."""
    bad = [(camera.name, why) for camera in look.cameras if (why := camera.quality.refusal())]
    if len(look.cameras) - len(bad) < 2:
        return "; ".join(f"camera {name!r}: {why}" for name, why in bad[:2])
    sets = (first.masks[n] for n in range(len(first.masks)))  # one after another: the first will do, and the others need not be made
    if not any(sum(mask is not None and may_be_person(mask) for mask in masks) > 1 for masks in sets):
        if all(camera.quality.ready for camera in look.cameras):
            return (f"the masks of no two cameras show a person at the same time within the first {OPENING:g} s: is mask n of each camera "
                    "frame n of its film, and do the masks hold the person?")
        return (f"no two cameras see a person at the same time within the first {OPENING:g} s: do the films belong together, and begin "
                "together? say in [start] of recording.toml when each began")
    return look.agreement.refusal()


def _odd(rates: Array, look: RigLook) -> str:
    """The cameras whose rates are not the most usual one, in words."""
    like = (np.abs(rates[:, None] - rates) <= RATES * rates).sum(1)
    usual = rates[like.argmax()]
    odd = [camera.name for camera, rate in zip(look.cameras, rates) if abs(rate - usual) > RATES * usual]
    return f"camera {odd[0]!r} is" if len(odd) == 1 else f"cameras {', '.join(odd[:3])} are"


def _disagreements(found: Agreement, recovered: frozenset[str]) -> list[Finding]:
    """Doubts about the cameras' agreement. Silhouettes against an empty scene that was `recovered` from the films of these cameras may
    themselves be why the cameras do not fit together."""
    unclear = bool(recovered) and found.remedy is None
    return [replace(doubt, short=SILHOUETTES_OR_CAMERAS) if unclear and doubt.severity == RUINOUS else doubt for doubt in found.doubts()]


def _rig_doubts(look: RigLook, several: bool = False, recovered: frozenset[str] = frozenset()) -> list[Finding]:
    """Doubts about the films of a rig; of `several` people the quality of silhouettes, which supposes one, says nothing."""
    doubts, rates = list[Finding](), np.array([camera.rate for camera in look.cameras])
    ends = {camera.name: camera.frames / camera.rate for camera in look.cameras if camera.frames is not None}
    if np.ptp(rates) > RATES * rates.min():
        listed = ", ".join(f"{camera.name} {camera.rate:.4g}" for camera in look.cameras)
        doubts.append(Finding.of("the films have different rates (frames/s: {listed}): they are aligned by their times, {sets:.4g} sets a "
                                 "second, and a camera without a picture of a moment is left out of it; film at one rate",
                                 "{odd} of another frame rate: film at one", NOTED, listed=listed, sets=look.rate, odd=_odd(rates, look)))
    elif ends and max(ends.values()) - min(ends.values()) > LENGTHS and not any(camera.start for camera in look.cameras):
        listed = ", ".join(f"{name} {end:.2f}" for name, end in ends.items())
        doubts.append(Finding.of("the films have different lengths (s: {listed}): were they begun together? say in [start] of "
                                 "recording.toml when each began", "films differ in length: begun together? see [start]", NOTED,
                                 listed=listed))
    whole = sum(not camera.quality.cut_off and not camera.quality.refusal() for camera in look.cameras)
    if not several:
        doubts += feet_cautions({camera.name: camera.quality.border["bottom"] for camera in look.cameras if not camera.quality.refusal()})
    for camera in look.cameras:
        doubts += [unlike.about(f"camera {camera.name!r}") for unlike in unlike_ready(camera.exact_overlap)]
        quality = () if several else camera.quality.warnings(whole >= ENOUGH)
        warnings = (*condition_cautions(camera.condition, camera.name in recovered), *added_cautions(camera.added), *quality)
        doubts += [warning.about(f"camera {camera.name!r}").at_most(HARMFUL) for warning in warnings]
        doubts += [Finding(f"camera {camera.name!r}: {why}", f"camera {camera.name!r} shows no usable silhouette", HARMFUL)
                   for why in [camera.quality.refusal()] if why]
    return doubts
