"""Examines a recording before a run: silhouettes of each camera's film, their quality, and doubts about the run."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.calibration.agreement import agreement
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Caution, ShadowPuppetWarning
from shadowpuppet.motion.metrics import overlap
from shadowpuppet.pipeline.footage import FIRST, LOOKED_AT, CameraFrame, Footage, Sample, take_sample
from shadowpuppet.pipeline.look import CameraLook, FirstSeconds, Look, RigLook, Survey
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.census import count_in_picture, sampled_sets, take_census
from shadowpuppet.pipeline.rig import Rig, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_silhouettes, learn_silhouettes
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.silhouette.added import AddedParts, SceneHint, always_alike, find_added, find_nobody
from shadowpuppet.silhouette.correction.condition import FilmCondition, film_condition
from shadowpuppet.silhouette.quality import MaskQuality, mask_quality
from shadowpuppet.threads import usable_cores

SHORT = 1.0
"""Length of a film, seconds, under which it is said to be short."""
UNEVEN = 0.1
"""Jitter over the frame interval above which the film's rate counts as variable."""
GOOD = 0.9
"""Overlap with ready silhouettes below which the segmentation is in doubt."""
OPENING, OPENED = 2.0, 40
"""With several cameras: duration (s) of the beginning in which the person is measured, and the greatest number of frame sets kept of it."""
BRIEFLY = 240
"""With several cameras: greatest number of frames read of each film if its background is not made from the film."""
MIN_PERSON = 0.2
"""Least area of the silhouettes without what was added to the scene, over that with it: otherwise it was the person."""
RATES, LENGTHS = 0.02, 0.1
"""Relative difference of rates, and difference of lengths (s), above which films are reported to differ."""


class FilmSurvey(NamedTuple):
    """Result of examining one camera's film: its sample, silhouettes and findings."""

    sample: Sample
    silhouettes: Silhouettes
    masks: list[Mask]
    """Silhouettes of the sample's frames."""
    exact: list[Mask]
    """The recording's ready silhouettes of the same frames; empty if there are none, or if `silhouettes` are these."""
    values: dict[str, Any]
    """The fields that `Look` and `CameraLook` have in common."""


def survey_film(footage: Footage, options: Options, longest: int = LOOKED_AT, hint: SceneHint | None = None) -> FilmSurvey:
    """Examine one camera's first `longest` frames. `hint`: what is known of its scene from a first look and fit. Raises a
    `ShadowPuppetError` if something cannot be used."""
    sample = take_sample(footage, options.masks, longest)
    silhouettes, runs = _made(footage, sample, options, None if hint is None else hint.added)
    silhouettes, runs = _with_added(footage, sample, silhouettes, runs, options, hint)
    silhouettes = silhouettes.without_clutter([mask for run in runs for mask in run])
    if silhouettes.clutter is not None:
        runs = [[silhouettes.clutter.removed(mask) for mask in run] for run in runs]
    masks = [mask for run in runs for mask in run]
    exact = [ready_mask(frame.ready) for frame in sample.frames if frame.ready is not None and silhouettes.segmenter is not None]
    camera = footage.camera
    return FilmSurvey(sample, silhouettes, masks, exact, {
        "size": footage.view.camera.size, "worked_size": camera.size, "background": silhouettes.source,
        "fov": float(np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0]))),
        "key": "none" if silhouettes.segmenter is None else silhouettes.segmenter.reason,
        "exact_overlap": mean_overlap(masks, exact), "quality": quality_of(runs, sample.starts),
        "left_out": _left_out(silhouettes, footage),
        "condition": condition_of(silhouettes, sample, runs),
    })  # fmt: skip


def _made(footage: Footage, sample: Sample, options: Options, added: AddedParts | None) -> tuple[Silhouettes, list[list[Mask]]]:
    """Silhouettes, given what was added to the empty scene, and their masks of the sample's runs."""
    silhouettes = learn_silhouettes(footage, sample, options, added=added)
    return silhouettes, [[silhouettes(frame) for frame in run] for run in sample.runs]


def _with_added(footage: Footage, sample: Sample, silhouettes: Silhouettes, runs: list[list[Mask]], options: Options,
                hint: SceneHint | None) -> tuple[Silhouettes, list[list[Mask]]]:
    """Silhouettes and masks with what more was added to the scene taken for background; as they are if nothing was."""
    masks, beside = [mask for run in runs for mask in run], None if hint is None else hint.beside
    if beside is None and not always_alike(masks):
        return silhouettes, runs
    parts = silhouettes.still_parts(sample.frames, masks)
    if parts is None:
        return silhouettes, runs
    added = find_nobody(parts, masks) if beside is None else find_added(parts, beside)
    if added is None:
        return silhouettes, runs
    changed, found = _made(footage, sample, options, added.joined(silhouettes.added))
    area, was = (float(np.median([np.count_nonzero(mask) for run in each for mask in run])) for each in (found, runs))
    return (changed, found) if area >= MIN_PERSON * was else (silhouettes, runs)


def _left_out(silhouettes: Silhouettes, footage: Footage) -> tuple[str, ...]:
    """What is left out of the silhouettes, in words and the film's pixels."""
    parts = silhouettes.clutter.parts if silhouettes.clutter is not None else ()
    parts = parts if silhouettes.added is None else (*parts, silhouettes.added)
    (width, height), full = footage.camera.size, footage.view.camera.size
    return tuple(part.described((full[0] / width, full[1] / height)) for part in parts)


def _clutter_warnings(left_out: Sequence[str]) -> list[Caution]:
    if not left_out:
        return []
    return [Caution(f"{'; '.join(left_out)}: taken for clutter, not for the person, and left out of the silhouettes",
                    "clutter beside the person was left out: see the overlay", NOTED)]


def brief_length(footage: Footage, options: Options) -> int:
    """Number of frames to read of one of several cameras: more if the background is made from its film."""
    return LOOKED_AT if footage.view.background is None and not options.masks else BRIEFLY


# One camera


def survey_camera(rig: Rig, options: Options, hints: Sequence[SceneHint] = (SceneHint(),)) -> Survey:
    """Examine a recording of one camera; `hints` as in `survey_film`. Raises a `ShadowPuppetError` if something cannot be used."""
    footage = rig.footage[0]
    film = survey_film(footage, options, hint=hints[0])
    look = _look(footage, film)
    if look.refusal and not options.anyway:
        return Survey(rig, (film.silhouettes,), (film.silhouettes,), FirstSeconds([], []), look)
    clean = clean_silhouettes(footage, film.sample, film.silhouettes, options)
    return Survey(rig, (film.silhouettes,), (clean,), _first_people(film.sample, clean), look)


def _first_people(sample: Sample, clean: Silhouettes) -> FirstSeconds:
    """The first `FIRST` silhouettes that may be a person's: of the first seconds, then of the frames sampled from the whole film; and those
    of the later runs of the sample, the first of each."""
    def seen(frame: CameraFrame) -> tuple[float, Mask]:
        return frame.time, clean(frame)

    people = list(islice((each for each in map(seen, chain(sample.first, sample.frames)) if may_be_person(each[1])), FIRST))
    last = people[-1][0] if people else 0.0
    later = [each for each in (seen(run[0]) for run in sample.runs if run[0].time > last) if may_be_person(each[1])]
    return FirstSeconds([time for time, _ in people], [(mask,) for _, mask in people], tuple((mask,) for _, mask in later))


def _look(footage: Footage, film: FilmSurvey) -> Look:
    sample, camera = film.sample, footage.camera
    plain = [mask for frame in sample.frames if (mask := film.silhouettes.plain(frame)) is not None]
    look = Look(
        recording=str(footage.recording.path), camera=camera.name, calibrated=camera.oriented, frames=footage.count,
        looked_at=len(sample.times), rate=1 / sample.pace, jitter=sample.jitter, scale=known_scale(footage), area=_share(film.masks),
        plain_area=_share(plain) if plain else None, exact_overlap_plain=mean_overlap(plain, film.exact),
        refusal=_doubted(film.silhouettes) or film.values["quality"].refusal(), **film.values,
    )  # fmt: skip
    if look.refusal:
        return look
    doubts = (*_several_people(film), *_doubts(look, footage),
              *_recovery_doubts([camera.name], [film.silhouettes]), *_clutter_warnings(look.left_out))
    return replace(look, doubts=(*doubts, *look.quality.warnings()))


def _several_people(film: FilmSurvey) -> list[Caution]:
    number = count_in_picture(film.sample, film.silhouettes)
    if number < 2:
        return []
    return [Caution(f"{number} people are in the picture: one camera tracks one, the nearest, who is the largest in the picture; two "
                    "calibrated cameras or more track all", f"{number} people; the nearer one is tracked", HARMFUL)]


def _doubted(silhouettes: Silhouettes) -> str | None:
    """Why the scene cannot be recovered from the film; None if it can be, or need not."""
    return None if silhouettes.recovered is None else silhouettes.recovered.doubt


def _recovery_doubts(names: Sequence[str], silhouettes: Sequence[Silhouettes]) -> list[Caution]:
    """What to know of scenes that were recovered from the films of the cameras `names`."""
    found = {name: each.recovered for name, each in zip(names, silhouettes) if each.recovered is not None}
    said = [Caution(f"camera {name!r}: {scene.doubt}", f"camera {name!r}: empty scene not recovered; film it", RUINOUS)
            for name, scene in found.items() if scene.doubt]
    hidden = {name: float(scene.covered.mean()) for name, scene in found.items() if not scene.doubt}
    if not hidden:
        return said
    of = f" of {', '.join(hidden)}" if len(names) > 1 else ""
    never = (f"up to {100 * max(hidden.values()):.1f} % of the picture was never seen without the person, and counts as person in every "
             "frame; ") if any(hidden.values()) else ""  # fmt: skip
    return [*said, Caution(f"no picture of the empty scene{of}: it was recovered from the film; {never}what touches the person and has "
                           "like colours may be taken for it; look at the silhouettes, or give background/<camera>.mp4 or --background",
                           "no picture of the empty scene: film one, give --background", NOTED)]


def known_scale(footage: Footage) -> str:
    """Known lengths that fix the scale, in words."""
    subject = footage.recording.subject
    known = [f"{name} {value:.2f} m" for name, value in (("height", subject.height), ("distance", subject.distance)) if value]
    return " and ".join(known) or f"average height of {AVERAGE_HEIGHT:.2f} m, assumed"


def _doubts(look: Look, footage: Footage) -> list[Caution]:
    doubts, subject = list[Caution](), footage.recording.subject
    if not look.calibrated:
        doubts.append(Caution(f"no calibration: the camera is taken for level, with a field of view of {look.fov:.0f} degrees and no "
                              "distortion; depths and the world's axes are as good as that; give a calibration.toml",
                              "camera not calibrated: depths are rough; give --calibration", NOTED))
    if subject.height is None and subject.distance is None:
        doubts.append(Caution(f"neither height nor distance is known: the {look.scale}, and all lengths are as wrong as that is; give "
                              "--height", "height not known, so no length is: give --height", HARMFUL))
    elif subject.distance is None and not footage.recording.references:
        doubts.append(Caution("the distance is not known: it is found from the silhouette, often a tenth too near, and all places are as "
                              "wrong as that; measure it and give --distance, or take references",
                              "distance not known: measure it, give --distance", NOTED))
    if look.frames is not None and look.frames < SHORT * look.rate:
        seconds = f"{look.frames / look.rate:.1f} s"
        doubts.append(Caution(f"the film has only {look.frames} frames ({seconds}): too few to measure the person well and to smooth the "
                              "motion; film some seconds", f"film of {seconds} is very short: film some seconds", HARMFUL))
    if look.jitter * look.rate > UNEVEN:
        doubts.append(Caution(f"the time from frame to frame varies by {100 * look.jitter * look.rate:.0f} %: the film's own times are "
                              "kept", "frames come unevenly: their own times are kept", NOTED))
    if look.exact_overlap is not None and look.exact_overlap < GOOD:
        doubts.append(_unlike_ready(look.exact_overlap))
    return [*doubts, *_poor(look.condition)]


def _unlike_ready(overlap: float) -> Caution:
    return Caution(f"the silhouettes overlap the ready ones in masks/ by {overlap:.2f} only: try another --silhouette.method, or --masks",
                   "silhouettes differ from those in masks/: use --masks", HARMFUL)


# Several cameras


def survey_rig(rig: Rig, options: Options, hints: Sequence[SceneHint] = ()) -> Survey:
    """Examine each camera's film, and the first seconds of all together; `hints` as in `survey_film`, by camera. Raises a
    `ShadowPuppetError` if something cannot be used."""
    def surveyed(footage: Footage, hint: SceneHint) -> FilmSurvey:
        return survey_film(footage, options, brief_length(footage, options), hint)

    with ThreadPoolExecutor(usable_cores(), "look") as pool:
        films = list(pool.map(surveyed, rig.footage, hints or [SceneHint()] * len(rig.footage)))
    silhouettes = tuple(film.silhouettes for film in films)
    census, wide = None, tuple(each.of_several() for each in silhouettes)
    if any(_shows_person(film) for film in films):
        census = take_census(rig.cameras, sampled_sets([film.sample for film in films], wide))
    several = census.number if census is not None and census.number > 1 else 0
    silhouettes = wide if several else silhouettes
    first = _first_sets(rig, silhouettes, options.masks)
    step = float(np.median(np.diff(first.times))) if len(first.times) > 1 else np.nan
    look = RigLook(recording=str(rig.recording.path), cameras=tuple(map(_camera_look, rig.footage, films)), rate=rig.rate, frames=rig.count,
                   agreement=agreement(rig.cameras, first.masks, step))
    refusal = _rig_refusal(look, first)
    doubts = [*_rig_doubts(look, several > 0), *_recovery_doubts([camera.name for camera in look.cameras], silhouettes)]
    if several:
        doubts.insert(0, Caution(f"{several} people are in the recording: each is tracked, into person-1, person-2, ... of the run",
                                 f"{several} people: each is tracked", NOTED))
    look = replace(look, refusal=refusal, doubts=() if refusal else tuple(doubts))
    return Survey(rig, silhouettes, silhouettes, first, look, census)


def _shows_person(film: FilmSurvey) -> bool:
    return any(may_be_person(mask) for mask in film.masks)


def _first_sets(rig: Rig, silhouettes: Sequence[Silhouettes], ready: bool) -> FirstSeconds:
    every = max(1, round(OPENING * rig.rate / OPENED))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # a film that breaks off is reported when the run comes to it
        frames = synchronized_frames(rig, silhouettes, ready=ready, every=every, threads=usable_cores())
        sets = [(each.time, each.masks) for each in islice(frames, OPENED)]
    sets = [each for each in sets if each[0] <= OPENING] or sets[:1]
    return FirstSeconds([time for time, _ in sets], [masks for _, masks in sets])


def _camera_look(footage: Footage, film: FilmSurvey) -> CameraLook:
    x, y, z = footage.view.camera.centre.tolist()
    rate = 1 / film.sample.pace if len(film.sample.times) > 1 else footage.film().rate
    return CameraLook(name=footage.camera.name, place=(x, y, z), frames=footage.count, rate=rate, start=footage.view.start, **film.values)


def _rig_refusal(look: RigLook, first: FirstSeconds) -> str | None:
    """Why tracking is hopeless, and the remedy, in a sentence; None if it is not."""
    bad = [(camera.name, why) for camera in look.cameras if (why := camera.quality.refusal())]
    if len(look.cameras) - len(bad) < 2:
        return "; ".join(f"camera {name!r}: {why}" for name, why in bad[:2])
    if not any(sum(mask is not None and may_be_person(mask) for mask in masks) > 1 for masks in first.masks):
        return (f"no two cameras see a person at the same time within the first {OPENING:g} s: do the films belong together, and begin "
                "together? say in [start] of recording.toml when each began")
    return look.agreement.refusal()


def _rig_doubts(look: RigLook, several: bool = False) -> list[Caution]:
    """Doubts about a rig; of `several` people the quality of silhouettes, which supposes one, says nothing."""
    doubts = list(look.agreement.doubts())
    rates = np.array([camera.rate for camera in look.cameras])
    ends = {camera.name: camera.frames / camera.rate for camera in look.cameras if camera.frames is not None}
    if np.ptp(rates) > RATES * rates.min():
        listed = ", ".join(f"{camera.name} {camera.rate:.4g}" for camera in look.cameras)
        doubts.append(Caution(f"the films have different rates (frames/s: {listed}): they are aligned by their times, {look.rate:.4g} sets "
                              "a second, and a camera without a picture of a moment is left out of it; film at one rate",
                              "films have different rates: film at one", NOTED))
    elif ends and max(ends.values()) - min(ends.values()) > LENGTHS:
        listed = ", ".join(f"{name} {end:.2f}" for name, end in ends.items())
        doubts.append(Caution(f"the films have different lengths (s: {listed}): were they begun together? say in [start] of recording.toml "
                              "when each began", "films differ in length: begun together? see [start]", NOTED))
    for camera in look.cameras:
        if camera.exact_overlap is not None and camera.exact_overlap < GOOD:
            doubts.append(_unlike_ready(camera.exact_overlap).about(f"camera {camera.name!r}"))
        quality = () if several else camera.quality.warnings()
        warnings = (*_poor(camera.condition), *_clutter_warnings(camera.left_out), *quality)
        doubts += [warning.about(f"camera {camera.name!r}").at_most(HARMFUL) for warning in warnings]
        doubts += [Caution(f"camera {camera.name!r}: {why}", f"camera {camera.name!r} shows no usable silhouette", HARMFUL)
                   for why in [camera.quality.refusal()] if why]
    return doubts


# Silhouettes


def _share(masks: Sequence[Mask]) -> float:
    return float(np.mean([mask.mean() for mask in masks]))


def condition_of(silhouettes: Silhouettes, sample: Sample, masks: Sequence[Sequence[Mask]]) -> FilmCondition | None:
    """The condition of a film in its sampled frames, whose masks (H, W) are given by run; None for ready silhouettes and an empty film."""
    if silhouettes.segmenter is None or not sample.frames:
        return None
    return film_condition(silhouettes.segmenter, [[(frame.time, frame.image) for frame in run] for run in sample.runs],
                          masks)


def _poor(condition: FilmCondition | None) -> tuple[Caution, ...]:
    return () if condition is None else condition.warnings()


def mean_overlap(masks: Sequence[Mask], exact: Sequence[Mask]) -> float | None:
    """Mean intersection over union of pairs of masks; None if it is not defined for any pair."""
    overlaps = np.array([overlap(mask, right) for mask, right in zip(masks, exact)])
    return float(np.nanmean(overlaps)) if np.isfinite(overlaps).any() else None


def quality_of(runs: Sequence[Sequence[Mask]], starts: Sequence[int]) -> MaskQuality:
    """Quality of masks in several `runs` of consecutive frames, which begin at frames `starts`; frames are compared within a run only."""
    parts = [mask_quality(run) for run in runs]
    frames = np.array([part.frames for part in parts], float)

    def mean(name: str) -> float:
        return float(np.average([getattr(part, name) for part in parts], weights=frames))

    def median(name: str) -> float:
        return float(np.median([getattr(part, name) for part in parts]))

    def first(name: str) -> int | None:
        return min((start + n for part, start in zip(parts, starts) if (n := getattr(part, name)) is not None), default=None)

    border = {side: float(np.average([part.border[side] for part in parts], weights=frames)) for side in parts[0].border}
    return MaskQuality(
        frames=int(frames.sum()), area=median("area"), area_change=median("area_change"), area_jumps=mean("area_jumps"),
        flicker=median("flicker"), border=border, specks=mean("specks"), speck_area=mean("speck_area"), holes=mean("holes"),
        hole_area=mean("hole_area"), empty=sum(part.empty for part in parts), full=sum(part.full for part in parts),
        first_empty=first("first_empty"), first_full=first("first_full"),
    )  # fmt: skip
