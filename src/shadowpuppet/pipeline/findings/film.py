"""Examines one camera's film: its sample, silhouettes, their quality and the film's condition."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import held_warnings, warn
from shadowpuppet.motion.metrics import overlap
from shadowpuppet.pipeline.findings.look import FilmLook, FilmSurvey, Survey
from shadowpuppet.pipeline.findings.opening import opening_of
from shadowpuppet.pipeline.footage import LOOKED_AT, Footage, Opening, Sample, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener, Steps
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.silhouette.added import AddedParts, BesideBody, always_alike, find_added, find_nobody
from shadowpuppet.silhouette.correction.condition import FilmCondition, film_condition
from shadowpuppet.silhouette.quality import MaskQuality, mask_quality
from shadowpuppet.threads import one_opencv_thread, usable_cores

BRIEFLY = 240
"""With several cameras: greatest number of frames read of each film if its background is not made from the film."""
MIN_PERSON = 0.2
"""Least area of the silhouettes without what was added to the scene, over that with it: otherwise it was the person."""


def survey_film(footage: Footage, options: Options, longest: int = LOOKED_AT, added: AddedParts | None = None,
                steps: Steps | None = None, opening: Opening | None = None) -> FilmSurvey:
    """Examine one camera's first `longest` frames. `added`: what is known to have been added to its scene; `opening` as in `take_sample`.
    Raises a `ShadowPuppetError` if something cannot be used."""
    steps = steps or Steps(None, [footage.camera.name])
    steps("reading the film", footage.camera.name)
    sample = take_sample(footage, options.masks, longest, opening)
    empty = "learning" if footage.view.background is not None else "recovering"
    steps(f"{empty} the scene" if not options.masks else "reading silhouettes", footage.camera.name)
    made = _made(sample, learn_silhouettes(footage, sample, options, added=added))
    steps("judging masks", footage.camera.name)
    found = _judged(footage, sample, *(_with_added(footage, sample, *made, options) or made))
    steps("", footage.camera.name)
    return found


def look_again(footage: Footage, film: FilmSurvey, options: Options, beside: BesideBody | None, steps: Steps) -> FilmSurvey:
    """The survey of a film in which what never moves, and a fitted body leaves `beside` it, belongs to the scene; the same one if there is
    nothing. The film is not read again."""
    steps("judging masks", footage.camera.name)
    made = _with_added(footage, film.sample, film.silhouettes, film.runs, options, beside)
    steps("", footage.camera.name)
    return film if made is None else _judged(footage, film.sample, *made)


def survey_films(rig: Rig, options: Options, steps: Steps, added: Sequence[AddedParts | None] = ()) -> tuple[FilmSurvey, ...]:
    """Examine each camera's film; `added`: for each camera, as in `survey_film`. Raises its errors."""
    opening = opening_of(rig) if rig.is_multiview else None

    def surveyed(footage: Footage, added: AddedParts | None) -> FilmSurvey:
        return survey_film(footage, options, brief_length(footage, options) if rig.is_multiview else LOOKED_AT, added, steps, opening)

    return _each(rig, surveyed, added or [None] * len(rig.footage))


def films_again(survey: Survey, options: Options, beside: Sequence[BesideBody | None], listener: Listener) -> tuple[FilmSurvey, ...] | None:
    """The surveys of films in which what a fitted body leaves `beside` it in each, and never moves, belongs to the scene; None if there is
    nothing."""
    rig, steps = survey.rig, Steps(listener, survey.rig.names, again=True)
    films = survey.films or survey_films(rig, options, steps, [each.added for each in survey.silhouettes])
    found = _each(rig, lambda footage, film, left: look_again(footage, film, options, left, steps), films, beside)
    return None if all(new is old for new, old in zip(found, films, strict=True)) else found


def _each(rig: Rig, work: Callable[..., FilmSurvey], *every: Sequence[object]) -> tuple[FilmSurvey, ...]:
    """The work on each camera's footage, with one item of each sequence: on several cores if there are several cameras, and with warnings
    in the order of the cameras."""
    if not rig.is_multiview:
        return tuple(map(work, rig.footage, *every))

    def held(*items: object) -> tuple[FilmSurvey, list[str]]:
        with held_warnings() as warnings:
            return work(*items), warnings

    with one_opencv_thread(), ThreadPoolExecutor(usable_cores(), "look") as pool:
        found = list[FilmSurvey]()
        for survey, warnings in pool.map(held, rig.footage, *every):
            found.append(survey)
            for message in warnings:
                warn(message)
    return tuple(found)


def of_several(film: FilmSurvey) -> FilmSurvey:
    """The survey of a film that shows several people: silhouettes of all of them, and what these say of the film."""
    silhouettes, runs = _made(film.sample, film.silhouettes.of_several())
    found = film._replace(silhouettes=silhouettes, runs=runs)
    look = replace(film.look, exact_overlap=mean_overlap(found.masks, film.exact), condition=condition_of(silhouettes, film.sample, runs))
    return found._replace(look=look)


def _made(sample: Sample, silhouettes: Silhouettes) -> tuple[Silhouettes, list[list[Mask]]]:
    """Silhouettes, with the sample's frames classified, and their masks of its runs."""
    if silhouettes.segmenter is not None and not silhouettes.classified:
        images = (frame.image for frame in sample.frames)
        silhouettes.classified.update((id(image), (image, silhouettes.segmenter.labelled(image))) for image in images)
    return silhouettes, [[silhouettes(frame) for frame in run] for run in sample.runs]


def _with_added(footage: Footage, sample: Sample, silhouettes: Silhouettes, runs: list[list[Mask]], options: Options,
                beside: BesideBody | None = None) -> tuple[Silhouettes, list[list[Mask]]] | None:
    """Silhouettes and masks with what more was added to the scene taken for background; None if nothing was."""
    masks = [mask for run in runs for mask in run]
    if beside is None and not always_alike(masks):
        return None
    parts = silhouettes.still_parts(sample.frames, masks)
    added = None if parts is None else find_nobody(parts, masks) if beside is None else find_added(parts, beside)
    if added is None:
        return None
    before = silhouettes.before or silhouettes.segmenter
    changed = _made(sample, learn_silhouettes(footage, sample, options, added=added.joined(silhouettes.added), before=before))
    area, was = (float(np.median([np.count_nonzero(mask) for run in each for mask in run])) for each in (changed[1], runs))
    return changed if area >= MIN_PERSON * was else None


def _judged(footage: Footage, sample: Sample, silhouettes: Silhouettes, runs: list[list[Mask]]) -> FilmSurvey:
    """What silhouettes and their masks of the sample's runs say of a film."""
    masks = [mask for run in runs for mask in run]
    exact = [ready_mask(frame.ready) for frame in sample.frames if frame.ready is not None and silhouettes.segmenter is not None]
    camera = footage.camera
    look = FilmLook(
        size=footage.view.camera.size, worked_size=camera.size, background=silhouettes.source,
        fov=float(np.degrees(camera.fov)), frames=footage.count, rate=1 / sample.pace,
        key="none" if silhouettes.segmenter is None else silhouettes.segmenter.reason, exact_overlap=mean_overlap(masks, exact),
        quality=quality_of(runs, sample.starts, silhouettes.segmenter is None), added=_added(silhouettes, footage),
        condition=condition_of(silhouettes, sample, runs),
    )  # fmt: skip
    return FilmSurvey(sample, silhouettes, runs, exact, look)


def _added(silhouettes: Silhouettes, footage: Footage) -> str | None:
    """What was added to the empty scene, in words and the film's pixels; None for nothing."""
    (width, height), full = footage.camera.size, footage.view.camera.size
    return None if silhouettes.added is None else silhouettes.added.described((full[0] / width, full[1] / height))


def brief_length(footage: Footage, options: Options) -> int:
    """Number of frames to read of one of several cameras: more if the background is made from its film."""
    return LOOKED_AT if footage.view.background is None and not options.masks else BRIEFLY


def condition_of(silhouettes: Silhouettes, sample: Sample, masks: Sequence[Sequence[Mask]]) -> FilmCondition | None:
    """The condition of a film in its sampled frames, whose masks (H, W) are given by run; None for ready silhouettes and an empty film."""
    if silhouettes.segmenter is None or not sample.frames:
        return None
    return film_condition(silhouettes.segmenter, [[(frame.time, frame.image) for frame in run] for run in sample.runs],
                          masks)


def mean_overlap(masks: Sequence[Mask], exact: Sequence[Mask]) -> float | None:
    """Mean intersection over union of pairs of masks; None if it is not defined for any pair."""
    overlaps = np.array([overlap(mask, right) for mask, right in zip(masks, exact)])
    return float(np.nanmean(overlaps)) if np.isfinite(overlaps).any() else None


def quality_of(runs: Sequence[Sequence[Mask]], starts: Sequence[int], ready: bool = False) -> MaskQuality:
    """Quality of masks, `ready` or made, in several `runs` of consecutive frames, which begin at frames `starts`; frames are compared
    within a run only."""
    parts = [mask_quality(run) for run in runs]
    frames = np.array([part.frames for part in parts], float)

    def each(*names: str) -> dict[str, list[float]]:
        return {name: [getattr(part, name) for part in parts] for name in names}

    def first(name: str) -> int | None:
        return min((start + n for part, start in zip(parts, starts) if (n := getattr(part, name)) is not None), default=None)

    means = each("area_jumps", "specks", "speck_area", "holes", "hole_area") | {
        side: [part.border[side] for part in parts] for side in parts[0].border}  # fmt: skip
    mean = {name: float(np.average(values, weights=frames)) for name, values in means.items()}
    median = {name: float(np.median(values)) for name, values in each("area", "area_change", "flicker").items()}
    return MaskQuality(frames=int(frames.sum()), border={side: mean.pop(side) for side in parts[0].border}, ready=ready,
                       empty=sum(part.empty for part in parts), full=sum(part.full for part in parts),
                       first_empty=first("first_empty"), first_full=first("first_full"), **mean, **median)
