"""Which colour of a pixel is the scene's, and which pixels a person covers in all frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats
from shadowpuppet.silhouette.recovery.colours import UNKNOWN, colour_model, known, log_ratio
from shadowpuppet.silhouette.recovery.head import missing_head
from shadowpuppet.silhouette.recovery.labelling import NEVER, label_pixels, pair_costs
from shadowpuppet.silhouette.recovery.legs import still_legs, waist
from shadowpuppet.silhouette.recovery.modes import COUNT, Modes, radius_of, ranked, temporal_modes
from shadowpuppet.silhouette.recovery.movement import Mask, Movement

LEAST_SEEN = 2
"""Least number of frames that show the scene at a pixel."""
ROUNDS = 3
"""Times that pixels are labelled, each but the first with colour models from the labels before."""
RARE_COST, MOVED_COST, STEADY_COST, ENCLOSED_GAIN, BELOW_COST = 0.3, 0.4, 1.5, 0.3, 0.3
"""Costs of labels: of a scene that is seen rarely, over the logarithm of its share of the frames; of a covered pixel that something moved
over, and of one whose colour stays the same nevertheless, over the share of frames that have it. Gain of a covered pixel that is
enclosed, and cost of one below the trunk."""
COLOUR_WEIGHT = 1.5
"""Weight of a colour's log likelihood ratio."""
CALM_WEIGHT = 0.02
"""Weight in the person's colours of an enclosed pixel that is covered, against one that is passed over in all frames."""
VARIANT = 1.75
"""Distance of a mode from the scene's at the pixel, over a mode's radius, up to which it is the scene in another light, not the person."""
PART_SHARE, PART_COLOUR = 0.02, 0.5
"""Least area of a covered part over that of the largest one, and least log ratio of its colours over the largest one's."""
CONNECTED = 0.8
"""Least share of the frames in which another covered part is connected with the largest."""


def separate(planes: Floats, movement: Movement) -> tuple[Floats, Mask, bool]:
    """The scene's Y, Cr, Cb (h, w, 3), the pixels (h, w) that are always covered, at the reduced size, and whether a head never moves."""
    radius = radius_of(movement.noise)
    found = _rounds(planes, movement)
    legs = still_legs(found.field.still, movement, found.covered)
    if legs is not None:
        movement = movement._replace(region=movement.region | legs, enclosed=movement.enclosed | legs)
        found = _rounds(planes, movement)
    field, region = found.field, movement.region
    passing = (np.abs(planes - _scene(field, found.labels)) > radius).any(axis=3) & region
    covered = _persons_parts(found.covered, passing, region, found.ratio[:, 0])
    head = missing_head(covered, passing)
    covered = covered if head is None else covered | head
    cost = _costs(field, found.ratio, found.below)
    cost[..., COUNT] = np.where(covered, 0, NEVER)
    cost[covered, :COUNT] = NEVER
    return _scene(field, label_pixels(found.between, cost, region)[region]), covered, head is not None


class _Field(NamedTuple):
    """What the labels are chosen from; M pixels of the picture are in the region."""

    modes: Modes
    """Modes of the region's pixels."""
    movement: Movement
    still: Floats
    """Median Y, Cr, Cb, of shape (H, W, 3), which is the scene's outside the region."""
    frames: int
    radius: Floats
    """Of a mode in Y, Cr, Cb, of shape (3,), grey levels."""


class _Found(NamedTuple):
    """Labels of the region's pixels, and what they were chosen from."""

    field: _Field
    labels: NDArray[np.intp]
    """Of shape (M,)."""
    ratio: NDArray[np.float64]
    """As `_colour_ratio` finds it (M, K)."""
    below: NDArray[np.bool_]
    """As `_below` finds it (M,)."""
    covered: Mask
    """Pixels (H, W) that are labelled as always covered."""
    between: Floats
    """Costs of neighbours' labels, of `pair_costs`."""


def _rounds(planes: Floats, movement: Movement) -> _Found:
    """The labels after `ROUNDS` rounds on frames' planes (N, H, W, 3)."""
    radius = radius_of(movement.noise)
    field = _Field(temporal_modes(planes[:, movement.region], radius), movement, _middle(planes), len(planes), radius)
    between = pair_costs(*_on_picture(field), movement.region)
    labels, ratio, below = None, np.zeros(0), np.zeros(0, bool)
    for _ in range(ROUNDS):
        below = _below(field, labels)
        ratio = _colour_ratio(field, labels, below)
        labels = label_pixels(between, _costs(field, ratio, below), movement.region)[movement.region]
    assert labels is not None
    covered = np.zeros(movement.region.shape, bool)
    covered[movement.region] = labels == COUNT
    return _Found(field, labels, ratio, below, covered, between)


def _middle(planes: Floats) -> Floats:
    """The median (H, W, 3) of frames' planes (N, H, W, 3), which are whole numbers."""
    whole = planes.astype(np.uint8)
    lower, upper = (ranked(whole, rank).astype(np.float32) for rank in ((len(planes) - 1) // 2, len(planes) // 2))
    return np.float32(0.5) * (lower + upper)


def _scene(field: _Field, labels: NDArray[np.intp]) -> Floats:
    """The scene's Y, Cr, Cb (H, W, 3) by labels (M,); the most frequent colour where it is covered."""
    out = field.still.copy()
    out[field.movement.region] = field.modes.colour[np.arange(len(labels)), np.where(labels == COUNT, 0, labels)]
    return out


def _on_picture(field: _Field) -> tuple[Floats, Floats]:
    """Modes (H, W, K, 3) and shares (H, W, K) of all pixels; outside the region there is one."""
    region = field.movement.region
    colour, share = np.zeros((*region.shape, COUNT, 3), np.float32), np.zeros((*region.shape, COUNT), np.float32)
    colour[..., 0, :], share[..., 0] = field.still, 1
    colour[region], share[region] = field.modes.colour, field.modes.share
    return colour, share


def _costs(field: _Field, ratio: NDArray[np.float64], below: NDArray[np.bool_]) -> Floats:
    """The cost (H, W, K + 1) of each label. below: pixels (M,) as `_below` finds them, in which the person costs less."""
    region, share = field.movement.region, field.modes.share
    out = np.full((*region.shape, COUNT + 1), NEVER, np.float32)
    out[..., 0] = 0
    scene = COLOUR_WEIGHT * ratio - RARE_COST * np.log(np.maximum(share, 1e-3))
    moved = MOVED_COST + STEADY_COST * share[:, 0]
    covered = np.where(field.movement.enclosed[region], -ENCLOSED_GAIN, np.where(below, BELOW_COST, moved))
    seldom = share < (LEAST_SEEN - 0.5) / field.frames
    out[region] = np.column_stack([np.where(seldom, NEVER, scene), covered])
    return out


def _below(field: _Field, labels: NDArray[np.intp] | None) -> NDArray[np.bool_]:
    """Of the region's pixels (M,) those below the trunk, which is the middle of the largest covered part by the labels (M,) so far."""
    import cv2

    region = field.movement.region
    if labels is None:
        return np.zeros(int(region.sum()), bool)
    covered = np.zeros(region.shape, np.uint8)
    covered[region] = labels == COUNT
    _, parts, stats, _ = cv2.connectedComponentsWithStats(covered, connectivity=4)
    if len(stats) < 2:
        return np.zeros(int(region.sum()), bool)
    largest = np.asarray(parts) == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    middle, across = waist(largest)
    below = np.zeros(region.shape, bool)
    below[middle:] = across
    return below[region]


def _colour_ratio(field: _Field, labels: NDArray[np.intp] | None, below: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Log likelihood ratio (M, K), person to scene, of the modes' colours, by the labels (M,) so far; None: by the still pixels alone.

    Uncovered pixels `below` (M,) are no examples of the scene: they may be the legs.
    """
    modes = field.modes
    still = field.still[~field.movement.region]
    if labels is None:
        share = known(modes.colour, colour_model(still, np.ones(len(still))))
        return np.where(share > UNKNOWN, -0.5 * np.log(np.maximum(share, UNKNOWN) / UNKNOWN), 0.5)
    uncovered = np.flatnonzero(labels < COUNT)
    sure = np.flatnonzero((labels < COUNT) & ~below)
    scene = np.concatenate([still, modes.colour[sure, labels[sure]]])
    passing = modes.share[uncovered]
    own = modes.colour[uncovered, labels[uncovered]]
    passing[(np.abs(modes.colour[uncovered] - own[:, None]) <= VARIANT * field.radius).all(2)] = 0
    calm = (labels == COUNT) & field.movement.enclosed[field.movement.region]
    weights = np.concatenate([passing.reshape(-1), np.full(np.count_nonzero(calm), CALM_WEIGHT)])
    person = colour_model(np.concatenate([modes.colour[uncovered].reshape(-1, 3), modes.colour[calm, 0]]), weights)
    return log_ratio(modes.colour, person, colour_model(scene, np.ones(len(scene))))


def _persons_parts(covered: Mask, passing: Mask, region: Mask, ratio: NDArray[np.float64]) -> Mask:
    """The largest covered part (H, W), and others that belong to it; no thin lines.

    Others belong to it if their colours are a person's by their log `ratio` (M,), and if in most frames what passes over the scene,
    `passing` (N, H, W), connects them with it.
    """
    import cv2

    opened = cv2.morphologyEx(covered.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    number, parts, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    if number < 2:
        return np.zeros_like(covered)
    areas = stats[:, cv2.CC_STAT_AREA].astype(float)
    evidence = np.bincount(np.asarray(parts)[region], ratio, number) / areas
    areas[0] = 0
    largest = int(areas.argmax())
    kept = (areas >= PART_SHARE * areas[largest]) & (evidence > PART_COLOUR * evidence[largest])
    kept &= _connected(np.asarray(parts, np.int32), number, largest, passing) >= CONNECTED
    kept[largest], kept[0] = True, False
    return kept[np.asarray(parts, np.intp)]


def _connected(parts: NDArray[np.int32], number: int, largest: int, passing: Mask) -> NDArray[np.float64]:
    """Share of the frames in which each of `number` parts (H, W) is connected with the largest by what passes over the scene."""
    import cv2

    firsts = np.unique(parts, return_index=True)[1]
    together = np.zeros(number)
    for frame in passing:
        near = cv2.dilate((frame | (parts > 0)).astype(np.uint8), np.ones((3, 3), np.uint8))
        joined = np.asarray(cv2.connectedComponents(near)[1]).reshape(-1)[firsts]
        together += joined == joined[largest]
    return together / len(passing)
