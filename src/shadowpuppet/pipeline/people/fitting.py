"""The sizes of each of several people, measured in frames and views that show them apart from the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.person_rig import MultiviewSubject, fit_in_views
from shadowpuppet.tracking.people.carving import Room
from shadowpuppet.tracking.people.columns import SCALE, Column, projections, quarter

OVERLAPPED = 0.03
"""Share of a person's pixels in a view that may be another's too: otherwise the view does not show them apart."""
BESIDE = 6
"""Pixels beside a column's projection that are still that person's, at a quarter of the size: hands that the coarse hull lacks."""
MIN_SETS, MOST_SETS = 4, 16
"""Least number of frame sets that show a person apart in two views, or else views are used that do not; and the most that are used."""
TALL = 0.8, 2.3
"""Least and greatest height of a person, metres, that is expected of a column; the sizes are refined from there."""

View = tuple[Mask | None, ...]


def views_of(room: Room, column: Column, others: Sequence[Column], masks: Sequence[Mask | None], strict: bool = True) -> View:
    """The silhouettes (H, W) of one person by camera; None for a camera that shows them together with others, unless not `strict`: then
    the pixels that may be either's are kept."""
    import cv2

    own, theirs = projections(room, column, masks), [projections(room, other, masks) for other in others]
    found = list[Mask | None]()
    for n, mask in enumerate(masks):
        seen = own[n]
        if mask is None or seen is None:
            found.append(None)
            continue
        rest = np.zeros(seen.shape, bool)
        for each in theirs:
            rest |= np.asarray(each[n], bool)
        if strict and np.count_nonzero(seen & rest) > OVERLAPPED * max(np.count_nonzero(seen), 1):
            found.append(None)
            continue
        wide = np.asarray(cv2.dilate(seen.view(np.uint8), np.ones((2 * BESIDE + 1,) * 2, np.uint8))).view(bool)
        wide = wide & ~rest if strict else (wide & ~rest) | seen
        found.append(mask & wide.repeat(SCALE, 0).repeat(SCALE, 1)[: mask.shape[0], : mask.shape[1]])
        assert quarter(mask).shape == seen.shape
    return tuple(found)


def fit_apart(rng: np.random.Generator, cameras: Sequence[Camera], room: Room, options: Options, rate: float,
              seen: Sequence[tuple[Column, Sequence[Column], Sequence[Mask | None]]]) -> MultiviewSubject:
    """Fit one person to frame sets: their column, the others' and the masks (H, W) of each; and make the tracker for `rate` frames/s.
    Raises `TrackingError` if the person is not found."""
    apart = [views_of(room, *each) for each in seen]
    apart = [view for view in apart if sum(mask is not None and bool(mask.any()) for mask in view) >= 2]
    if len(apart) < min(MIN_SETS, len(seen)):
        apart = [views_of(room, *each, strict=False) for each in seen]
    chosen = [apart[n] for n in evenly_spread(len(apart), MOST_SETS)]
    # half a voxel less, as the lowest and the highest are filled in part
    tall = float(np.clip(np.median([column.height for column, *_ in seen]) - room.pitch / 2, *TALL))
    subject = fit_in_views(rng, cameras, chosen, replace(options, height=None), rate, tall)
    return replace(subject, tracker=replace(subject.tracker, looks=0))
