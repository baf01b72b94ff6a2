"""People as columns of the coarse hull: connected over the floor plan, of a person's height and volume, and needed to explain the views."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.people.carving import Room, carve

THICK = 0.3
"""Least height of what stands over a square of the floor plan, metres: lower is noise."""
MIN_VOLUME, MIN_EXTENT = 0.02, 0.7
"""Least volume (m^3; a child of 15 kg has 0.015, and the hull is larger) and greatest extent (m) of a person."""
CORE, APART, SADDLE = 0.2, 0.5, 0.6
"""Radius (m) of the disc that takes in a trunk; least distance (m) of two people; and the share of the lesser one's volume in the disc to
which it falls between them."""
BELONGS = 0.45
"""Distance (m) from a person's axis up to which voxels of a group count as that person's alone."""
NEEDED = 0.12
"""Least share of a column's pixels, in all views, that no other column explains."""
GAP = 3
"""Pixels by which the projections of neighbouring voxels, and the edge of a silhouette, may miss each other, at 1/`SCALE` of the size."""
SCALE = 4


class Column(NamedTuple):
    """A person's place in the coarse hull."""

    place: Array
    """Of the axis on the floor plan, world, of shape (2,), metres."""
    height: float
    """Extent from the lowest to the highest voxel, metres."""
    volume: float
    """Cubic metres."""
    voxels: NDArray[np.int64]
    """Indices of its voxels, of shape (N, 3)."""


def find_people(room: Room, masks: Sequence[Mask | None], explained: Sequence[Mask | None] = ()) -> list[Column]:
    """The people in one frame's masks (H, W), one per camera, the most certain first. `explained`: pixels (H / 4, W / 4), by camera, that
    people who are known already explain; columns there are not needed, but may be theirs."""
    whole = [None if mask is None else solid(mask) for mask in masks]
    columns = [part for group in _groups(room, carve(room, whole)) for part in _divided(room, group)]
    return _needed(room, columns, masks, explained)


def solid(mask: Mask) -> Mask:
    """A mask (H, W) with all of its holes filled: clothes like the background would carve a person in two."""
    import cv2

    contours, _ = cv2.findContours(mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(mask.shape, np.uint8)
    cv2.drawContours(filled, contours, -1, 1, cv2.FILLED)
    return filled.view(np.bool_)


def _groups(room: Room, occupied: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Voxels (N, 3) of each connected part of the floor plan that may be a person or several."""
    import cv2

    tall = (occupied.sum(2) >= THICK / room.pitch).astype(np.uint8)
    number, labels = cv2.connectedComponents(tall, connectivity=8)
    voxels = np.argwhere(occupied)
    of = np.asarray(labels)[voxels[:, 0], voxels[:, 1]]
    groups = [voxels[of == n] for n in range(1, number)]
    return [group for group in groups if _is_person(room, group)]


def _is_person(room: Room, voxels: NDArray[np.int64]) -> bool:
    return len(voxels) * room.pitch**3 >= MIN_VOLUME and float(np.ptp(voxels, axis=0).max(initial=0)) * room.pitch >= MIN_EXTENT


def _divided(room: Room, voxels: NDArray[np.int64]) -> list[Column]:
    """The people in a connected part: one for each thick place between which it is thinner."""
    low = voxels.min(0)
    plan = np.zeros(voxels.max(0)[:2] - low[:2] + 1)
    np.add.at(plan, (voxels[:, 0] - low[0], voxels[:, 1] - low[1]), 1.0)
    dense = _in_disc(plan, CORE / room.pitch)
    cores = _cores(dense, APART / room.pitch)
    if len(cores) < 2:
        return [_column(room, voxels, cores[0] + low[:2])]
    away = np.linalg.norm(voxels[:, None, :2] - (cores + low[:2])[None], axis=2)
    nearest = away.argmin(1)
    own = [voxels[(nearest == n) & (away[:, n] <= 2 * BELONGS / room.pitch)] for n in range(len(cores))]
    return [_column(room, part, core + low[:2]) for part, core in zip(own, cores) if _is_person(room, part)]


def _in_disc(plan: Array, radius: float) -> Array:
    """Sums of a plan (X, Y) within a radius (cells) of each cell."""
    import cv2

    side = max(1, int(radius))
    x, y = np.mgrid[-side : side + 1, -side : side + 1]
    return np.asarray(cv2.filter2D(plan, -1, (np.hypot(x, y) <= radius).astype(float), borderType=cv2.BORDER_CONSTANT), float)


def _cores(dense: Array, apart: float) -> NDArray[np.int64]:
    """Cells (K, 2) of the greatest values, the greatest first: at least `apart` cells from each other, with a saddle between."""
    import cv2

    side = max(1, int(apart / 2))
    highest = np.asarray(cv2.dilate(dense, np.ones((2 * side + 1,) * 2)))
    peaks = np.argwhere((dense >= highest) & (dense > 0.25 * dense.max()))
    peaks = peaks[np.argsort(-dense[tuple(peaks.T)], kind="stable")]
    chosen = list[NDArray[np.int64]]()
    for peak in peaks:
        if all(np.linalg.norm(peak - other) >= apart and _between(dense, peak, other) < SADDLE * dense[tuple(peak)] for other in chosen):
            chosen.append(peak)
    return np.array(chosen)


def _between(dense: Array, one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """Least value on the line between two cells (2,)."""
    steps = np.linspace(0, 1, 2 + int(np.abs(one - other).max()))[:, None]
    x, y = np.rint(one + steps * (other - one)).astype(int).T
    return float(dense[x, y].min())


def _column(room: Room, voxels: NDArray[np.int64], core: NDArray[np.int64]) -> Column:
    place = room.corner[:2] + room.pitch * (core + 0.5)
    return Column(place, float(np.ptp(voxels[:, 2]) + 1) * room.pitch, len(voxels) * room.pitch**3, voxels)


def _needed(room: Room, columns: list[Column], masks: Sequence[Mask | None], explained: Sequence[Mask | None]) -> list[Column]:
    """The columns without ghosts: greedily the one that explains most pixels that none before explains, until little is left."""
    views = [projections(room, column, masks) for column in columns]
    known = [None if mask is None else np.zeros(quarter(mask).shape, bool) for mask in masks]
    known = [zero if zero is None or n >= len(explained) or explained[n] is None else np.asarray(explained[n], bool)
             for n, zero in enumerate(known)]
    chosen, left = list[Column](), list(range(len(columns)))
    while left:
        news = [sum(int((seen & ~before).sum()) for seen, before in zip(views[n], known) if seen is not None and before is not None)
                for n in left]  # fmt: skip
        best = int(np.argmax(news))
        n = left.pop(best)
        area = sum(int(seen.sum()) for seen in views[n] if seen is not None)
        if news[best] < NEEDED * max(area, 1):
            if not explained:
                break
            continue
        chosen.append(columns[n])
        known = [before if seen is None or before is None else before | seen for seen, before in zip(views[n], known)]
    return chosen


def projections(room: Room, column: Column, masks: Sequence[Mask | None]) -> list[Mask | None]:
    """The pixels (H / 4, W / 4) of each camera's mask (H, W) on which a column projects; None for a camera without a mask."""
    import cv2

    found = list[Mask | None]()
    square = np.ones((2 * GAP + 1,) * 2, np.uint8)
    for pixels, mask in zip(room.pixels, masks):
        if mask is None:
            found.append(None)
            continue
        at = pixels[tuple(column.voxels.T)]
        y, x = np.divmod(at[at >= 0], mask.shape[1])
        small = quarter(mask)
        drawn = np.zeros(small.shape, np.uint8)
        drawn[y // SCALE, x // SCALE] = 1
        found.append(np.asarray(cv2.dilate(drawn, square)).view(bool) & small)
    return found


def quarter(mask: Mask) -> Mask:
    """Every fourth pixel of every fourth row of a mask (H, W), and the last ones' remainder."""
    return mask[::SCALE, ::SCALE]
