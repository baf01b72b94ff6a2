"""The empty scene from frames of a film in which a person is always there, and where it was never seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette.background import Floats, Image, check_alike, check_image, smoothed, to_planes
from shadowpuppet.silhouette.correction.light import Light
from shadowpuppet.silhouette.recovery.modes import radius_of, ranked
from shadowpuppet.silhouette.recovery.movement import Mask, Movement, find_movement, unsteady
from shadowpuppet.silhouette.recovery.separation import separate

WORKED_WIDTH, WORKED_AREA = 320, 320 * 240
"""Greatest width and area, pixels, of the pictures in which scene and person are separated; the scene's own has the frames' size."""
LEAST_FRAMES = 3
"""Least number of frames: with fewer, moving and still pixels cannot be distinguished."""
MEMBER = 1.2
"""Distance, over a mode's radius, within which a sample at full size shows it."""

REMEDY = "film the empty scene for a second (background/<camera>.mp4 or --background), or give ready silhouettes (masks/ and --masks)"


@dataclass(frozen=True, eq=False)
class RecoveredScene:
    """An empty scene recovered from a film."""

    picture: Image
    """The empty scene, of shape (H, W, 3) or (H, W); where it was never seen it is filled from around."""
    covered: Mask
    """Pixels that the person covers in all frames, of shape (H, W)."""
    frames: int
    """Number of frames that it was recovered from."""
    doubt: str | None = None
    """Why it is no empty scene, and the remedy; None if nothing speaks against it."""
    head_still: bool = False
    """Whether the head never moves, so that the pixels where it must be count as covered."""


def recover_scene(frames: Sequence[Image]) -> RecoveredScene:
    """The empty scene of frames (H, W, 3) or (H, W) spread over a film, some 60; the person may stand there in all of them.

    1. Changes of the light are taken off, with the frames' median as reference (`light.Light`).
    2. `movement.find_movement`: pixels that something moved over, and those enclosed by them. All others show the scene.
    3. `modes.temporal_modes`: the colours that each of these pixels shows, with their shares.
    4. `labelling.label_pixels`: which mode is the scene's, or whether the person covers the pixel always. The first time the colours of
       the person are unknown; then `colours.log_ratio` compares what passed over the scene with the scene. If `legs.still_legs` finds
       legs that kept still below a trunk, they are added to the pixels of step 2, and all are labelled again. Where
       `head.missing_head` finds that a trunk has no head, the person covers the place of one. (`separation` has steps 3 and 4.)
    5. The scene's picture at full size: the mean of the frames that show the mode. Covered pixels are filled from around.

    Raises `SilhouetteError` for fewer than 3 frames, and frames that do not fit together.
    """
    check_frames(frames)
    frames = _in_one_light(frames)
    planes = np.stack([smoothed(to_planes(_reduced(frame))).astype(np.float32) for frame in frames])
    movement = find_movement(planes)
    if doubt := _doubt(movement):
        return RecoveredScene(_median(frames), np.zeros(frames[0].shape[:2], bool), len(frames), doubt)
    scene, covered, head_still = separate(planes, movement)
    return replace(_at_full_size(frames, scene, covered, movement), head_still=head_still)


def check_frames(frames: Sequence[Image]) -> None:
    """Raise `SilhouetteError` for too few frames, and frames that are no pictures of one size."""
    if len(frames) < LEAST_FRAMES:
        raise SilhouetteError(f"background: found a film of {len(frames)} frames, expected at least {LEAST_FRAMES} to tell a person who "
                              "moves from the scene; give a picture or film of the empty scene")
    for n, image in enumerate(frames):
        check_image(image, f"film frame {n}")
        check_alike(image, frames[0].shape, f"film frame {n}")


def _doubt(movement: Movement) -> str | None:
    if unsteady(movement):
        return f"nearly all of the picture changes in the film, as if the camera or the light had moved: {REMEDY}"
    if not movement.region.any():
        return f"nothing moves in the film, so the person cannot be told from the scene: {REMEDY}"
    return None


def _in_one_light(frames: Sequence[Image]) -> list[Image]:
    light = Light(_median(frames))
    return [light.normalised(frame)[0] for frame in frames]


def _median(frames: Sequence[Image]) -> Image:
    return ranked(frames, len(frames) // 2)


def _reduced(image: Image) -> Image:
    import cv2

    height, width = image.shape[:2]
    scale = min(WORKED_WIDTH / width, (WORKED_AREA / (width * height)) ** 0.5)
    if scale >= 1:
        return image
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _at_full_size(frames: Sequence[Image], scene: Floats, covered: Mask, movement: Movement) -> RecoveredScene:
    """The scene's picture at the frames' size, from what was found at the reduced size."""
    import cv2

    height, width = frames[0].shape[:2]
    hidden = cv2.resize(covered.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR) > 0.5
    moved = cv2.resize(movement.region.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    moved = cv2.dilate(moved, np.ones((5, 5), np.uint8))
    x, y, across, down = cv2.boundingRect(moved)
    window = slice(y, y + down), slice(x, x + across)
    target = np.ascontiguousarray(cv2.resize(scene, (width, height), interpolation=cv2.INTER_NEAREST)[window])
    sums, total, seen = _Sums(frames[0]), _Sums(frames[0][window]), np.zeros(target.shape[:2], np.int32)
    reach = MEMBER * radius_of(movement.noise)
    for frame in frames:
        sums.add(frame)
        shows = cv2.inRange(np.abs(smoothed(to_planes(frame[window])) - target) / reach, (0, 0, 0), (1, 1, 1))
        seen += shows > 0
        total.add(frame[window], np.asarray(shows, np.uint8))
    picture = sums.first / len(frames)
    counts = seen if picture.ndim == 2 else seen[..., None]
    picture[window] = np.where(moved[window].reshape(counts.shape) > 0, total.first / np.maximum(counts, 1), picture[window])
    unknown = hidden.copy()
    unknown[window] |= (moved[window] > 0) & (seen == 0)
    picture = filled(picture.astype(np.float32), ~unknown)
    return RecoveredScene(np.clip(np.rint(picture), 0, 255).astype(np.uint8), hidden, len(frames))


class _Sums:
    """Sum of pictures like one, each pixel where a mask is set."""

    def __init__(self, image: Image) -> None:
        self.first = np.zeros(image.shape, np.float32)

    def add(self, image: Image, mask: Image | None = None) -> None:
        import cv2

        cv2.accumulate(image, self.first, mask=mask)


SMALLEST = 2
"""Least side, pixels, of a level of the pyramid."""


def filled(picture: Floats, known: NDArray[np.bool_]) -> Floats:
    """The picture (H, W, C) or (H, W) with its unknown pixels filled by ever wider means of the known ones (push and pull in a pyramid).

    known: of shape (H, W); the known pixels stay as they are.
    """
    import cv2

    weight = known.astype(np.float32)
    if known.all() or not known.any():
        return picture
    levels = [(_weighted(picture, weight), weight)]
    while min(weight.shape) > SMALLEST and (weight < 1e-3).any():
        levels.append((np.asarray(cv2.pyrDown(levels[-1][0]), np.float32), np.asarray(cv2.pyrDown(weight), np.float32)))
        weight = levels[-1][1]
    values = _divided(*levels[-1])
    for sums, weight in reversed(levels[:-1]):
        coarse = np.asarray(cv2.pyrUp(values, dstsize=weight.shape[::-1]), np.float32)
        share = np.minimum(weight, 1)
        values = _weighted(_divided(sums, weight), share) + _weighted(coarse, 1 - share)
    return np.where(known if picture.ndim == 2 else known[..., None], picture, values)


def _weighted(picture: Floats, weight: Floats) -> Floats:
    return picture * (weight if picture.ndim == 2 else weight[..., None])


def _divided(sums: Floats, weight: Floats) -> Floats:
    weight = np.maximum(weight, 1e-6)
    return sums / (weight if sums.ndim == 2 else weight[..., None])
