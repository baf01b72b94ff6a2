"""The look before the run: what was found, what it is worth, and whether tracking has a chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shadowpuppet.errors import TrackingError
from shadowpuppet.motion.metrics import overlap
from shadowpuppet.pipeline.footage import Footage, Mask, Sample, Silhouettes, clear_silhouettes, open_footage, silhouettes, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.person import Found, find, told_scale
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.silhouette.quality import MaskQuality, mask_quality

UNEVEN = 0.1
"""Jitter of the times over the time from frame to frame from which on the film's rate varies."""
GOOD = 0.9
"""Overlap with exact silhouettes under which segmentation is in doubt."""


@dataclass(frozen=True, kw_only=True)
class Look:
    """What was found before a run; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    camera: str
    """Its name."""
    size: tuple[int, int]
    """Width and height of the film, pixels."""
    worked_size: tuple[int, int]
    """Width and height that frames are scaled to."""
    fov: float
    """Horizontal field of view, degrees."""
    calibrated: bool
    """False where only the field of view is known."""
    frames: int | None
    """Of the film, where it says so."""
    looked_at: int
    """Frames gone through for this look."""
    rate: float
    """Frames/s."""
    jitter: float
    """Standard deviation of the seconds from frame to frame."""
    scale: str
    """What fixes the scale."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """What is compared, and why."""
    area: float
    """Share of the picture that is silhouette, mean."""
    plain_area: float | None
    """The same by the plain rule of eq. 1; None where it has no standard deviation."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes, where there are any."""
    exact_overlap_plain: float | None
    """The same of the plain rule."""
    quality: MaskQuality
    """Of the silhouettes in the frames looked at."""
    person: dict[str, Any] | None = None
    """Sizes (m), place (m) and overlaps of the fitted body, and which silhouettes it was fitted in where these are others than those
    that are tracked in; None where it was not fitted."""
    doubts: tuple[str, ...] = ()
    """What may harm the run, and the remedy, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None where it is not."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """All that a run needs."""

    footage: Footage
    sample: Sample
    silhouettes: Silhouettes
    """In which the person is tracked."""
    clear: Silhouettes
    """In which the person is found and measured; the same where these are clean."""
    found: Found | None
    """None where tracking is hopeless."""
    look: Look


def prepare(path: str, options: Options, rng: np.random.Generator) -> Prepared:
    """Look at a recording, and find the person. Raises a `ShadowPuppetError` where something cannot be used."""
    return with_person(survey(path, options), options, rng)


def survey(path: str, options: Options) -> Prepared:
    """Look at a recording, without the person: what takes no chance, and is the same for every seed. Raises as `prepare` does."""
    footage = open_footage(path, options)
    sample = take_sample(footage, options.masks)
    seen = silhouettes(footage, sample, options)
    look = _first_look(footage, sample, seen)
    clear = seen if look.refusal else clear_silhouettes(footage, sample, seen, options)
    return Prepared(footage, sample, seen, clear, None, look)


def with_person(prepared: Prepared, options: Options, rng: np.random.Generator) -> Prepared:
    """A survey with the person found, where the look does not refuse. Raises as `prepare` does."""
    if prepared.look.refusal is not None:
        return prepared
    clear, look = prepared.clear, prepared.look
    found = find(prepared.footage, prepared.sample, clear, options, rng)
    guess = found.fit.guess
    others = clear.segmenter.key if clear is not prepared.silhouettes and clear.segmenter is not None else None
    person = {"source": found.source, "silhouettes": others, "height": float(guess.height), "distance": float(guess.distance),
              "elevation": float(guess.elevation), "overlaps": dict(found.fit.overlaps), "start_overlap": found.start,
              "sizes": dict(zip(guess.sizes.names(), guess.sizes.to_array().tolist()))}
    return replace(prepared, found=found, look=replace(look, person=person, doubts=(*look.doubts, *found.doubts())))


def check(prepared: Prepared) -> Found:
    """The person found. Raises `TrackingError` where the look refused."""
    if prepared.found is None:
        raise TrackingError(f"{prepared.look.recording}: {prepared.look.refusal}")
    return prepared.found


def _first_look(footage: Footage, sample: Sample, seen: Silhouettes) -> Look:
    """The look, without the person."""
    masks = [[seen(shot) for shot in run] for run in sample.runs]
    plain = [mask for shot in sample.shots if (mask := seen.plain(shot)) is not None]
    flat = [mask for run in masks for mask in run]
    exact = [ready_mask(shot.ready) for shot in sample.shots if shot.ready is not None and seen.segmenter is not None]
    quality, camera = quality_of(masks, sample.starts), footage.camera
    look = Look(
        recording=str(footage.recording.path), camera=camera.name, size=footage.view.camera.size, worked_size=camera.size,
        fov=float(np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0]))), calibrated=camera.oriented,
        frames=footage.film().count, looked_at=len(sample.times), rate=1 / sample.pace, jitter=sample.jitter,
        scale=told_scale(footage), background=seen.source,
        key="none" if seen.segmenter is None else seen.segmenter.reason,
        area=_share(flat), plain_area=_share(plain) if plain else None, exact_overlap=mean_overlap(flat, exact),
        exact_overlap_plain=mean_overlap(plain, exact), quality=quality, refusal=quality.refusal(),
    )  # fmt: skip
    return look if look.refusal else replace(look, doubts=tuple(_doubts(look, footage)))


def _doubts(look: Look, footage: Footage) -> list[str]:
    said, subject = [], footage.recording.subject
    if not look.calibrated:
        said.append(f"no calibration: the camera is taken for level, with a field of view of {look.fov:.0f} degrees and no distortion; "
                    "depths and the world's axes are as good as that; give a calibration.toml")
    if subject.height is None and subject.distance is None:
        said.append(f"neither height nor distance is known: the {look.scale}, and all lengths are as wrong as that is; give --height")
    elif subject.distance is None and not footage.recording.references:
        said.append("the distance is not known: it is found from the silhouette, often a tenth too near, and all places are as wrong as "
                    "that; measure it and give --distance, or take references")
    if footage.view.background is None and look.key != "none":
        said.append("no picture of the empty scene: it is the median of the film, so whoever stands still becomes background; "
                    "give background/<camera>.mp4 or --background")
    if look.jitter * look.rate > UNEVEN:
        said.append(f"the time from frame to frame varies by {100 * look.jitter * look.rate:.0f} %: the film's own times are kept")
    if look.exact_overlap is not None and look.exact_overlap < GOOD:
        said.append(f"the silhouettes overlap the ready ones in masks/ by {look.exact_overlap:.2f} only: try another "
                    "--silhouette.method, or --masks")
    return [*said, *look.quality.warnings()]


def _share(masks: Sequence[Mask]) -> float:
    return float(np.mean([mask.mean() for mask in masks]))


def mean_overlap(masks: Sequence[Mask], exact: Sequence[Mask]) -> float | None:
    """Mean overlap, where there is anything."""
    overlaps = np.array([overlap(mask, right) for mask, right in zip(masks, exact)])
    return float(np.nanmean(overlaps)) if np.isfinite(overlaps).any() else None


def quality_of(runs: Sequence[Sequence[Mask]], starts: Sequence[int]) -> MaskQuality:
    """Quality of masks in several runs; what is compared with the frame before is so within a run only."""
    all_of = [mask_quality(run) for run in runs]
    frames = np.array([quality.frames for quality in all_of], float)

    def mean(name: str) -> float:
        return float(np.average([getattr(quality, name) for quality in all_of], weights=frames))

    def median(name: str) -> float:
        return float(np.median([getattr(quality, name) for quality in all_of]))

    def first(name: str) -> int | None:
        numbers = [start + n for quality, start in zip(all_of, starts) if (n := getattr(quality, name)) is not None]
        return min(numbers, default=None)

    sides = all_of[0].border
    border = {side: float(np.average([quality.border[side] for quality in all_of], weights=frames)) for side in sides}
    return MaskQuality(
        frames=int(frames.sum()), area=median("area"), area_change=median("area_change"), area_jumps=mean("area_jumps"),
        flicker=median("flicker"), border=border, specks=mean("specks"), speck_area=mean("speck_area"), holes=mean("holes"),
        hole_area=mean("hole_area"), empty=sum(quality.empty for quality in all_of), full=sum(quality.full for quality in all_of),
        first_empty=first("first_empty"), first_full=first("first_full"),
    )  # fmt: skip
