"""How people are dressed: the colours of trunk, arms and legs, by which they are told apart. The head is left out.

Colours are histograms of three channels, for each camera and part: two of chromaticity, which shading hardly changes, and lightness. Each
camera is compared with itself only, so that cameras may see colours differently.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Limbs
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, half_size
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.refinement.free_space import spheres_in
from shadowpuppet.tracking.people.floor import figure_points

PARTS = ("trunk", "arms", "legs")
NAMES = ({"chest", "shoulder", "torso"}, {"upper_arm", "forearm", "lower_arm"}, {"thigh", "shank", "upper_leg", "lower_leg"})
"""Limbs of each part, without their side. Pelvis, hands and feet are left out: they may be on either side of a hem."""
BINS = 48
LOWEST, HIGHEST = np.array([-1.2, -1.2, 2.5]), np.array([1.2, 1.2, 5.7])
"""Range of each channel: red to green, yellow to blue, and the logarithm of lightness."""
USUAL = np.array([0.03, 0.03, 0.3])
"""By how much each channel may differ for one person in other frames: the unit in which people are compared."""
DARK = 20.0
"""Lightness, grey levels, that is added, so that noise in the dark has no colour."""
AROUND = 0.5
"""Distance of the places at which a sphere of the body is looked at from its centre, over its radius."""
HIDES = 0.1
"""Distance (m) by which another limb must be nearer to a camera to hide one."""
ENOUGH = 12.0
"""Least number of places at which a part is seen by a camera, in both of two people's colours, that are compared."""
TRUNK, LEGS, ASIDE = (0.58, 0.65, 0.72, 0.78), (0.12, 0.2, 0.28, 0.36), (-0.08, 0.0, 0.08)
"""Heights, over the height of an upright figure, at which clothes are looked at, and places across the view, metres."""

Colours = NDArray[np.float32]
"""Numbers of places seen: of shape (C, parts, 3, `BINS`) for C cameras."""


def dressed_parts(limbs: Limbs) -> NDArray[np.int64]:
    """Index of the part of each sphere of a body (K,), as `spheres_in` has them; -1: none."""
    return np.array([_part(name) for name in limbs.parts])[spheres_in(limbs).limbs]


def _part(name: str) -> int:
    return next((n for n, names in enumerate(NAMES) if name.removeprefix("left_").removeprefix("right_") in names), -1)


def colours_of_body(cameras: Sequence[Camera], centres: Array, radii: Array, parts: NDArray[np.int64], free: Sequence[Mask | None],
                    images: Sequence[NDArray[np.uint8] | None]) -> Colours:
    """Colours of a body of spheres, centres (K, 3) and radii (K,), in metres, and their parts (K,), in one frame's images (H / 2, W / 2, 3)
    or (H / 2, W / 2), every second pixel; `free`: pixels (H / 2, W / 2) that only this body explains. None for a camera without one."""
    around = AROUND * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    found = nothing(len(cameras))
    for n, (camera, mask, image) in enumerate(zip(cameras, free, images)):
        if mask is None or image is None:
            continue
        shown = np.flatnonzero((parts >= 0) & ~_hidden(camera, centres, radii, parts))
        points = (centres[shown, None] + radii[shown, None, None] * around).reshape(-1, 3)
        _add(found[n], camera, points, parts[shown].repeat(len(around)), mask, image)
    return found


def colours_of_figure(cameras: Sequence[Camera], place: Array, height: float, level: float, free: Sequence[Mask | None],
                      images: Sequence[NDArray[np.uint8] | None]) -> Colours:
    """Colours of an upright figure of a height at a place (2,) on a floor at a level, metres; else as `colours_of_body`. Arms are not
    seen."""
    z, across = np.array([*TRUNK, *LEGS]).repeat(len(ASIDE)) * height, np.tile(ASIDE, len(TRUNK) + len(LEGS))
    parts = np.array([0] * len(TRUNK) + [2] * len(LEGS)).repeat(len(ASIDE))
    found = nothing(len(cameras))
    for n, (camera, mask, image) in enumerate(zip(cameras, free, images)):
        if mask is not None and image is not None:
            _add(found[n], camera, figure_points(camera, place[None], level + z, across)[0], parts, mask, image)
    return found


def nothing(cameras: int) -> Colours:
    """No colours, for a number of cameras."""
    return np.zeros((cameras, len(PARTS), 3, BINS), np.float32)


def apart_from(masks: Sequence[Mask | None], others: Sequence[Sequence[Mask]]) -> list[Mask | None]:
    """Silhouette (H / 2, W / 2), by camera, of masks (H, W) that no other explains; `others`: what each of them does, by camera."""
    return [None if mask is None else np.logical_and.reduce([half_size(mask), *(~other[n] for other in others)])
            for n, mask in enumerate(masks)]


def _hidden(camera: Camera, centres: Array, radii: Array, parts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a sphere of another part, or of none, is before each sphere's centre (K,)."""
    away = centres - camera.centre
    depths = np.linalg.norm(away, axis=1)
    rays = away / depths[:, None]
    aside = np.arccos(np.clip(rays @ rays.T, -1, 1)) * depths  # of each from the other's ray, at the other's depth
    before = (depths[:, None] - depths > HIDES) & (aside < radii) & (parts[:, None] != parts)
    return np.asarray(before.any(1))


def _add(found: Colours, camera: Camera, points: Array, parts: NDArray[np.int64], free: Mask, image: NDArray[np.uint8]) -> None:
    """Count the colours of points (P, 3) of parts (P,) in one camera's image at half size; `found`: (parts, 3, `BINS`)."""
    x, y = np.rint(np.nan_to_num(camera.project(points), nan=-9.0).clip(-9, 1e6)).astype(int).T // 2
    inside = (x >= 0) & (y >= 0) & (x < image.shape[1]) & (y < image.shape[0])
    x, y, parts = x[inside], y[inside], parts[inside]
    seen = free[y, x]
    channels = _channels(image[y[seen], x[seen]])
    at = np.clip((channels - LOWEST) / (HIGHEST - LOWEST), 0, 1) * (BINS - 1)
    low = np.minimum(at.astype(int), BINS - 2)
    share = at - low
    where = (3 * parts[seen, None] + np.arange(3)) * BINS + low
    for bins, shares in ((where, 1 - share), (where + 1, share)):  # shared by two bins, so that small changes count little
        found += np.bincount(bins.ravel(), shares.ravel(), found.size).reshape(found.shape).astype(np.float32)


def _channels(pixels: NDArray[np.uint8]) -> Array:
    """Chromaticity and log lightness (N, 3) of pixels (N, 3), blue green red, or (N,), grey."""
    blue, green, red = pixels.astype(float).T if pixels.ndim > 1 else (pixels.astype(float),) * 3
    light = (blue + green + red) / 3 + DARK
    return np.stack([(red - green) / light, ((red + green) / 2 - blue) / light, np.log(light)], 1)


def difference(one: Colours, other: Colours) -> float:
    """How differently two people are dressed, in units of what is usual for one person; NaN if no camera has seen the same part of both.

    The earth mover's distance of their histograms: mean over the cameras, by the number of places seen, then over channels and parts.
    """
    counts = one[:, :, 0].sum(-1), other[:, :, 0].sum(-1)
    weight = np.minimum(*counts)
    weight = np.where(weight >= ENOUGH, weight, 0.0)
    shares = [colours.cumsum(-1) / np.maximum(count, 1)[..., None, None] for colours, count in zip((one, other), counts)]
    moved = np.abs(shares[0] - shares[1]).sum(-1) * (HIGHEST - LOWEST) / (BINS - 1) / USUAL
    seen = weight.sum(0) > 0
    if not seen.any():
        return np.nan
    of_parts = (weight[..., None] * moved).sum(0)[seen] / weight.sum(0)[seen, None]
    return float(np.sqrt((of_parts**2).mean(1)).mean())
