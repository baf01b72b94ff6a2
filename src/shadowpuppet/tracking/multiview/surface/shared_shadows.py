"""Dark limbs before a dark floor: one camera takes them for shadow, the others see that the person is there.

A pixel taken for shadow is the person's where its viewing ray passes through the silhouettes of all other cameras. A shadow on the floor is
no silhouette in any of them, so that its rays do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.silhouette.boundary import disc
from shadowpuppet.silhouette.cleanup import chosen_parts, connected
from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull

LEAST_CAMERAS = 3
"""Cameras that see the person from which on this is tried: one other leaves long parts of every ray."""
PITCH, THINNEST = 0.06, 0.02
"""Distance (pixels) of the rays tried in a picture, and the radius below which what they find is no limb, over the square root of the
silhouette's area: about a forearm's width, and a sixth of it on each side."""
LEAST_LENGTH, LIMB_LENGTH = 0.03, 0.08
"""Least length (m) of a ray's part within all other silhouettes, and the length that one ray of a limb has: an ankle's thickness. A shadow
beside a foot has shorter parts only."""


class SharedShadows:
    """Makes the masks of one moment's silhouettes; for any number of cameras."""

    def __init__(self, cameras: Sequence[Camera]) -> None:
        """`cameras`: those of the silhouettes, in order."""
        self.hull = VisualHull(cameras)

    def __call__(self, found: Sequence[Segmented | None]) -> tuple[Mask | None, ...]:
        """The masks (H, W), None where there is no silhouette, with limbs that one camera takes for shadow and all others see."""
        masks = [None if each is None else each.mask for each in found]
        limbs = shaded_limbs(self.hull, masks, [None if each is None else each.shadow for each in found])
        for n, each in enumerate(found):
            if n in limbs and each is not None and each.with_limbs is not None:
                masks[n] = each.with_limbs(limbs[n])
        return tuple(masks)


def shaded_limbs(hull: VisualHull, masks: Sequence[Mask | None], shadows: Sequence[Mask | None]) -> dict[int, Mask]:
    """Pixels (H, W) taken for shadow that are the person's, by the camera's index; only of cameras that have some.

    masks, shadows: silhouettes (H, W) and pixels taken for shadow (H, W), one per camera of the hull; None where there is none.
    """
    people = hull.people(masks)
    if len(people) < LEAST_CAMERAS:
        return {}
    pitch = {n: max(2, round(PITCH * np.count_nonzero(mask) ** 0.5)) for n, mask in people.items()}
    known = {n: shadow for n in people if (shadow := shadows[n]) is not None}
    tried = [_grid(shadow, pitch[n]) for n, shadow in known.items()]
    if not sum(map(len, tried)):
        return {}
    camera, pixels = np.repeat(np.array(list(known)), [*map(len, tried)]), np.concatenate(tried)
    length = hull.lengths_inside(people, camera, pixels.astype(float))
    found = length >= LEAST_LENGTH
    limbs = {n: _limbs(pixels[of_one := found & (camera == n)], length[of_one], known[n], pitch[n])
             for n in np.unique(camera[length >= LIMB_LENGTH]).tolist()}
    return {n: each for n, each in limbs.items() if each.any()}


def _grid(shadow: Mask, pitch: int) -> NDArray[np.int64]:
    """Pixels (P, 2), x and y, of a mask (H, W), `pitch` pixels apart."""
    y, x = np.nonzero(shadow[::pitch, ::pitch])
    return pitch * np.stack([x, y], 1)


def _limbs(pixels: NDArray[np.int64], lengths: Array, shadow: Mask, pitch: int) -> Mask:
    """The parts of `shadow` (H, W) around found pixels (P, 2) of the grid that are not thin and have a ray of at least a limb's length.

    lengths: of the parts of the pixels' rays (P,) within all other silhouettes, metres.
    """
    import cv2

    reach, out = pitch, np.zeros_like(shadow)  # more than the dilation below has
    window = tuple(slice(max(low - reach, 0), high + reach + 1) for low, high in zip(pixels.min(0)[::-1], pixels.max(0)[::-1]))
    x, y = (pixels - [window[1].start, window[0].start]).T
    near = np.ascontiguousarray(shadow[window]).view(np.uint8)
    found = np.zeros_like(near)
    found[y, x] = 1
    around = np.asarray(cv2.dilate(found, np.ones((pitch + 1, pitch + 1), np.uint8)), np.uint8) & near
    firm = cv2.morphologyEx(around, cv2.MORPH_OPEN, disc(round(THINNEST / PITCH * pitch)))
    (number, parts), long = connected(np.asarray(firm, np.uint8), 4), lengths >= LIMB_LENGTH
    limb = np.zeros(number, bool)
    limb[parts[y[long], x[long]]] = True
    limb[0] = False
    out[window] = chosen_parts(parts, limb).view(np.bool_)
    return out
