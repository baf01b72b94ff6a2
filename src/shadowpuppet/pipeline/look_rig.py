"""The look before the run with several cameras: each one's silhouettes, and which camera disagrees with the others."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.calibration.agreement import Agreement, agreement
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import may_be_person
from shadowpuppet.errors import ShadowPuppetWarning, TrackingError
from shadowpuppet.pipeline.footage import LOOKED_AT, Footage, Mask, Silhouettes, silhouettes, take_sample
from shadowpuppet.pipeline.footage_rig import Rig, follow
from shadowpuppet.pipeline.look import GOOD, mean_overlap, quality_of
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.silhouette.quality import MaskQuality
from shadowpuppet.threads import usable_cores

OPENING, OPENED = 2.0, 40
"""The first seconds in which the person is measured, and at most how many sets of silhouettes of them are kept."""
BRIEFLY = 240
"""Frames of each film that are looked at where its background need not be made from it."""
RATES, LENGTHS = 0.02, 0.1
"""Relative difference of rates, and of lengths (s), from which on films are said to differ."""


@dataclass(frozen=True, kw_only=True)
class CameraLook:
    """What was found of one camera; plain values."""

    name: str
    size: tuple[int, int]
    """Width and height of the film, pixels."""
    worked_size: tuple[int, int]
    """Width and height that frames are scaled to."""
    fov: float
    """Horizontal field of view, degrees."""
    place: tuple[float, float, float]
    """Where it stands in the world, metres."""
    frames: int | None
    """Of the film from the recording's time 0 on, where it says so."""
    rate: float
    """Frames/s."""
    start: float
    """Seconds of the film's own clock that are the recording's time 0."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """What is compared, and why."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes, where there are any."""
    quality: MaskQuality
    """Of the silhouettes in the frames looked at."""


@dataclass(frozen=True, kw_only=True)
class RigLook:
    """What was found before a run with several cameras; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    cameras: tuple[CameraLook, ...]
    rate: float
    """Sets of pictures/s."""
    frames: int | None
    """How many sets there are, where the films say so."""
    agreement: Agreement
    """Of the cameras with each other, by the first seconds' silhouettes."""
    person: dict[str, Any] | None = None
    """Sizes and how they were found; None where the person was not measured."""
    doubts: tuple[str, ...] = ()
    """What may harm the run, and the remedy, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None where it is not."""


class Opening(NamedTuple):
    """The first seconds' silhouettes, spread over them."""

    times: list[float]
    """Seconds, F of them."""
    masks: list[tuple[Mask | None, ...]]
    """One a camera (H, W), None where it has no picture."""


@dataclass(frozen=True, eq=False)
class PreparedRig:
    """All that a run needs."""

    rig: Rig
    silhouettes: tuple[Silhouettes, ...]
    """One a camera."""
    opening: Opening
    look: RigLook


def look_at_rig(rig: Rig, options: Options) -> PreparedRig:
    """Look at every camera's film, and at the first seconds of all together. Raises a `ShadowPuppetError` where that cannot be done."""
    with ThreadPoolExecutor(usable_cores(), "look") as pool:
        found = list(pool.map(lambda footage: _look_at_camera(footage, options), rig.footage))
    seen, cameras = tuple(s for s, _ in found), tuple(look for _, look in found)
    opening = open_with(rig, seen, options.masks)
    step = float(np.median(np.diff(opening.times))) if len(opening.times) > 1 else np.nan
    look = RigLook(recording=str(rig.recording.path), cameras=cameras, rate=rig.rate, frames=rig.count,
                   agreement=agreement(rig.cameras, opening.masks, step))
    refusal = _refusal(look, opening)
    return PreparedRig(rig, seen, opening, replace(look, refusal=refusal, doubts=() if refusal else tuple(_doubts(look))))


def check_rig(prepared: PreparedRig) -> None:
    """Raise `TrackingError` where the look refused."""
    if prepared.look.refusal is not None:
        raise TrackingError(f"{prepared.look.recording}: {prepared.look.refusal}")


def open_with(rig: Rig, seen: Sequence[Silhouettes], ready: bool) -> Opening:
    """The first seconds' silhouettes."""
    every = max(1, round(OPENING * rig.rate / OPENED))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # what breaks off is said when the run comes to it
        sets = [(each.time, each.masks) for each in islice(follow(rig, seen, ready=ready, every=every, threads=usable_cores()), OPENED)]
    sets = [each for each in sets if each[0] <= OPENING] or sets[:1]
    return Opening([time for time, _ in sets], [masks for _, masks in sets])


def _look_at_camera(footage: Footage, options: Options) -> tuple[Silhouettes, CameraLook]:
    sample = take_sample(footage, options.masks, LOOKED_AT if footage.view.background is None and not options.masks else BRIEFLY)
    seen = silhouettes(footage, sample, options)
    masks = [[seen(shot) for shot in run] for run in sample.runs]
    exact = [ready_mask(shot.ready) for shot in sample.shots if shot.ready is not None and seen.segmenter is not None]
    full, camera = footage.view.camera, footage.camera
    x, y, z = full.centre.tolist()
    return seen, CameraLook(
        name=camera.name, size=full.size, worked_size=camera.size, fov=_fov(camera), place=(x, y, z), frames=footage.count,
        rate=1 / sample.pace if len(sample.times) > 1 else footage.film().rate, start=footage.view.start, background=seen.source,
        key="none" if seen.segmenter is None else seen.segmenter.reason,
        exact_overlap=mean_overlap([mask for run in masks for mask in run], exact), quality=quality_of(masks, sample.starts),
    )  # fmt: skip


def _fov(camera: Camera) -> float:
    return float(np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0])))


def _refusal(look: RigLook, opening: Opening) -> str | None:
    """Why tracking is hopeless, and the remedy, in a sentence."""
    bad = [(camera.name, why) for camera in look.cameras if (why := camera.quality.refusal())]
    if len(look.cameras) - len(bad) < 2:
        return "; ".join(f"camera {name!r}: {why}" for name, why in bad[:2])
    if not any(sum(mask is not None and may_be_person(mask) for mask in masks) > 1 for masks in opening.masks):
        return (f"no two cameras see a person at the same time within the first {OPENING:g} s: do the films belong together, and begin "
                "together? say in [start] of recording.toml when each began")
    return look.agreement.refusal()


def _doubts(look: RigLook) -> list[str]:
    said = list(look.agreement.doubts())
    rates = np.array([camera.rate for camera in look.cameras])
    ends = {camera.name: camera.frames / camera.rate for camera in look.cameras if camera.frames is not None}
    if np.ptp(rates) > RATES * rates.min():
        told = ", ".join(f"{camera.name} {camera.rate:.4g}" for camera in look.cameras)
        said.append(f"the films have different rates (frames/s: {told}): they are aligned by their times, {look.rate:.4g} sets a second, "
                    "and a camera without a picture of a moment is left out of it; film at one rate")
    elif ends and max(ends.values()) - min(ends.values()) > LENGTHS:
        told = ", ".join(f"{name} {end:.2f}" for name, end in ends.items())
        said.append(f"the films have different lengths (s: {told}): were they begun together? say in [start] of recording.toml when each "
                    "began")
    for camera in look.cameras:
        if camera.exact_overlap is not None and camera.exact_overlap < GOOD:
            said.append(f"camera {camera.name!r}: the silhouettes overlap the ready ones in masks/ by {camera.exact_overlap:.2f} only: try "
                        "another --silhouette.method, or --masks")
        said += [f"camera {camera.name!r}: {warning}" for warning in camera.quality.warnings()]
        said += [f"camera {camera.name!r}: {why}" for why in [camera.quality.refusal()] if why]
    return said
