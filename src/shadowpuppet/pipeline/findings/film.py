"""Examines one camera's film: its sample, silhouettes, their quality and the film's condition."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.motion.metrics import overlap
from shadowpuppet.pipeline.footage import LOOKED_AT, Footage, Opening, Sample, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Steps
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.silhouette.added import AddedParts, SceneHint, always_alike, find_added, find_nobody
from shadowpuppet.silhouette.correction.condition import FilmCondition, film_condition
from shadowpuppet.silhouette.quality import MaskQuality, mask_quality

BRIEFLY = 240
"""With several cameras: greatest number of frames read of each film if its background is not made from the film."""
MIN_PERSON = 0.2
"""Least area of the silhouettes without what was added to the scene, over that with it: otherwise it was the person."""


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


def survey_film(footage: Footage, options: Options, longest: int = LOOKED_AT, hint: SceneHint | None = None,
                steps: Steps | None = None, opening: Opening | None = None) -> FilmSurvey:
    """Examine one camera's first `longest` frames. `hint`: what is known of its scene from a first look and fit; `opening` as in
    `take_sample`. Raises a `ShadowPuppetError` if something cannot be used."""
    steps = steps or Steps(None, [footage.camera.name])
    steps("reading the film", footage.camera.name)
    sample = take_sample(footage, options.masks, longest, opening)
    empty = "learning" if footage.view.background is not None else "recovering"
    steps(f"{empty} the scene" if not options.masks else "reading silhouettes", footage.camera.name)
    silhouettes, runs = _made(footage, sample, options, None if hint is None else hint.added)
    steps("judging masks", footage.camera.name)
    silhouettes, runs = _with_added(footage, sample, silhouettes, runs, options, hint)
    silhouettes = silhouettes.without_clutter([mask for run in runs for mask in run])
    if silhouettes.clutter is not None:
        runs = [[silhouettes.clutter.removed(mask) for mask in run] for run in runs]
    masks = [mask for run in runs for mask in run]
    exact = [ready_mask(frame.ready) for frame in sample.frames if frame.ready is not None and silhouettes.segmenter is not None]
    camera = footage.camera
    found = FilmSurvey(sample, silhouettes, masks, exact, {
        "size": footage.view.camera.size, "worked_size": camera.size, "background": silhouettes.source,
        "fov": float(np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0]))),
        "key": "none" if silhouettes.segmenter is None else silhouettes.segmenter.reason,
        "exact_overlap": mean_overlap(masks, exact), "quality": quality_of(runs, sample.starts, silhouettes.segmenter is None),
        "left_out": _left_out(silhouettes, footage),
        "condition": condition_of(silhouettes, sample, runs),
    })  # fmt: skip
    steps("", footage.camera.name)
    return found


def of_several(film: FilmSurvey) -> FilmSurvey:
    """The survey of a film that shows several people: silhouettes of all of them, and what these say of the film."""
    silhouettes = film.silhouettes.of_several()
    runs = [[silhouettes(frame) for frame in run] for run in film.sample.runs]
    masks = [mask for run in runs for mask in run]
    values = film.values | {"exact_overlap": mean_overlap(masks, film.exact), "condition": condition_of(silhouettes, film.sample, runs)}
    return film._replace(silhouettes=silhouettes, masks=masks, values=values)


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
        first_empty=first("first_empty"), first_full=first("first_full"), ready=ready,
    )  # fmt: skip
