"""What was added to a scene after it was filmed empty: parts of the film that never change, and that no body explains.

A chair below a person who sits never leaves the silhouette. Its pixels keep their values throughout the film; so do those of legs that hold
still, but these the fitted body explains. `find_added` grows what the body leaves unexplained over all that is still and has the same
colours; `AddedParts.into` puts it into the pictures of the empty scene, so that a person before it is segmented as before any other scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask, bounding_window
from shadowpuppet.silhouette.background import Floats, Image, to_planes
from shadowpuppet.silhouette.recovery.colours import colour_model, log_ratio

STILL_SHARE = 0.85
"""Least share of the frames in which a still pixel keeps its value, and is silhouette."""
NOISE_FACTOR, NOISE_QUANTILE = 1.5, 0.95
"""A still pixel deviates from its median by at most this factor times the deviation that this share of the scene's pixels has."""
MIN_COUNT = 0.5
"""Least number of unexplained pixels of a colour, over that of the body's pixels of this colour: clothes are mostly the body's."""
MIN_RATIO = 2.0
"""Least likelihood of a pixel's colour as an unexplained one, over that as the body's."""
MAX_EXPLAINED = 0.5
"""Greatest share of what was added that the body covers: otherwise it is a part of the person that the body's pose misses."""
MIN_SEED, MIN_ADDED = 0.01, 0.03
"""Least areas, over the person's, of what is unexplained and still, and of what was added."""
SAME = 0.95
"""Least share of the usual silhouette that is the same, and still, if no person is in it."""
MIN_FRAMES = 8
"""Least number of frames in which still pixels are looked for."""


class BesideBody(NamedTuple):
    """What a fitted body leaves unexplained in one camera's silhouettes."""

    unexplained: Mask
    """Pixels (H, W) that are silhouette in most frames, and not the body's."""
    body: Mask
    """Pixels (H, W) of the body."""


class StillParts(NamedTuple):
    """What never changes in a film."""

    picture: Image
    """The median frame, of shape (H, W, 3) or (H, W)."""
    calm: Mask
    """Pixels (H, W) that keep their value."""
    still: Mask
    """Those of them (H, W) that are silhouette in most frames."""


class AddedParts(NamedTuple):
    """What was added to the empty scene."""

    picture: Image
    """What it looks like, of shape (H, W, 3) or (H, W), in the light of the empty scene."""
    mask: Mask
    """Its pixels (H, W)."""

    def into(self, scene: Iterable[Image]) -> Iterator[Image]:
        """Pictures of the empty scene, each with what was added."""
        for picture in scene:
            out = picture.copy()
            out[self.mask] = self.picture[self.mask]
            yield out

    def joined(self, other: AddedParts | None) -> AddedParts:
        """What was added by this and by another, earlier finding."""
        if other is None:
            return self
        picture = self.picture.copy()
        picture[other.mask] = other.picture[other.mask]
        return AddedParts(picture, self.mask | other.mask)

    def described(self, scale: tuple[float, float]) -> str:
        """Where it is, in words; `scale`: the film's pixels over the mask's, across and down."""
        rows, columns = bounding_window(self.mask.view(np.uint8), 0)
        x, y = ((round(each.start * factor), round(each.stop * factor)) for each, factor in zip((columns, rows), scale))
        return f"something that never moves within x {x[0]} to {x[1]}, y {y[0]} to {y[1]}, and is not in the empty scene"


def always_alike(masks: Sequence[Mask]) -> bool:
    """Whether masks (H, W) hardly differ, so that perhaps no person is in them."""
    shown = [mask for mask in masks if mask.any()]
    if len(shown) < MIN_FRAMES:
        return False
    usual = np.mean(shown, axis=0) >= 0.5
    return bool(np.median([np.count_nonzero(mask ^ usual) for mask in shown]) <= (1 - SAME) * np.count_nonzero(usual))


def find_still(images: Sequence[Image], masks: Sequence[Mask]) -> StillParts | None:
    """Still pixels of frames that are spread over a film, in the light of the empty scene, and their masks (H, W); None for few frames."""
    if len(images) < MIN_FRAMES:
        return None
    stack = np.stack(images)
    picture = np.median(stack, axis=0)
    away = np.abs(stack - picture)
    deviation = np.quantile(away if away.ndim == 3 else away.max(-1), STILL_SHARE, axis=0)
    share = np.mean(masks, axis=0)
    scene = deviation[share == 0]
    if not scene.size:
        return None
    calm = deviation <= NOISE_FACTOR * max(float(np.quantile(scene, NOISE_QUANTILE)), 1.0)
    return StillParts(np.rint(picture).astype(np.uint8), calm, calm & (share >= STILL_SHARE))


def find_added(parts: StillParts, beside: BesideBody) -> AddedParts | None:
    """What of the still parts no body explains, with all that is connected to it and has its colours; None if it is too small."""
    import cv2

    colours = to_planes(parts.picture).astype(np.float32)
    seed, own = parts.still & beside.unexplained, beside.body & ~beside.unexplained
    seed &= _ratio(colours, seed, own) >= MIN_COUNT * np.count_nonzero(own) / max(np.count_nonzero(seed), 1)
    if np.count_nonzero(seed) < max(MIN_SEED * np.count_nonzero(beside.body), 1):
        return None
    alike = parts.still & (_ratio(colours, seed, own) >= MIN_RATIO)
    grown, pair = cv2.morphologyEx(alike.view(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.ones((2, 2), np.uint8)
    grown = cv2.dilate(cv2.erode(grown, pair, anchor=(0, 0)), pair, anchor=(1, 1))  # without bridges of one pixel
    labels = np.asarray(cv2.connectedComponents(np.asarray(grown, np.uint8), connectivity=8)[1], np.intp)
    covered = np.bincount(labels.ravel(), beside.body.ravel()) / np.maximum(np.bincount(labels.ravel()), 1)
    found = np.unique(labels[seed])
    found = found[(found > 0) & (covered[found] <= MAX_EXPLAINED)]
    whole = np.isin(labels, found)
    return _added(parts, whole) if np.count_nonzero(whole) >= MIN_ADDED * np.count_nonzero(beside.body) else None


def _ratio(colours: Floats, thing: Mask, body: Mask) -> NDArray[np.float64]:
    """Likelihood (H, W) of colours (H, W, 3) as those of a thing's pixels (H, W), over that as the body's (H, W)."""
    models = (colour_model(colours[where], np.ones(np.count_nonzero(where))) for where in (thing, body))
    return np.exp(log_ratio(colours, *models))


def find_nobody(parts: StillParts, masks: Sequence[Mask]) -> AddedParts | None:
    """All of the silhouettes (H, W) if nothing in them ever moves, and so no person is in them; None if something does."""
    shown = [mask for mask in masks if mask.any()]
    if len(shown) < MIN_FRAMES or np.median([np.mean(parts.calm[mask]) for mask in shown]) < SAME:
        return None
    return _added(parts, np.mean(shown, axis=0) >= STILL_SHARE)


def _added(parts: StillParts, mask: Mask) -> AddedParts | None:
    """The parts in a mask (H, W), with their rims, but for what else is still: it is the person's."""
    import cv2

    wide = np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)), np.uint8) > 0
    return AddedParts(parts.picture, mask | (wide & parts.calm & ~parts.still)) if mask.any() else None
