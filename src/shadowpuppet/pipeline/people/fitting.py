"""The sizes of each of several people, measured in frames and views that show them apart from the others."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.person_rig import MultiviewSubject, average_person, fit_in_views
from shadowpuppet.tracking.people.figures import Figure, drawn
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.presence import UPRIGHT

OVERLAPPED = 0.03
"""Share of a person's figure in a view that may be another's too: otherwise the view does not show them apart."""
VIEWS, MIN_SETS, MOST_SETS = 3, 4, 16
"""Least number of views (of all, if there are fewer cameras) and of frame sets that show a person apart for sizes to be measured, and the
most sets that are used."""
TALL = 0.8, 2.3
"""Least and greatest height of a person, metres, that is expected of a figure; the sizes are refined from there."""

View = tuple[Mask | None, ...]


def views_of(floor: Floor, figure: Figure, others: Sequence[Figure], masks: Sequence[Mask | None]) -> View:
    """The silhouettes (H, W) of one person by camera: the connected parts of the mask on which their figure lies. None for a camera that
    does not show them, or where others' figures lie there too."""
    own, theirs = drawn(floor, figure), [drawn(floor, other) for other in others]
    found = list[Mask | None]()
    for n, mask in enumerate(masks):
        parts = None if mask is None else _parts_at(mask, own[n])
        if parts is not None:
            rest = np.logical_or.reduce([np.zeros_like(own[n]), *(each[n] for each in theirs)])
            shared = np.count_nonzero(parts & _full(rest, parts))
            parts = None if not parts.any() or shared > OVERLAPPED * np.count_nonzero(parts) else parts
        found.append(parts)
    return tuple(found)


def _parts_at(mask: Mask, small: Mask) -> Mask:
    """The connected parts of a mask (H, W) that touch pixels of half the size (H / 2, W / 2)."""
    import cv2

    number, found = cv2.connectedComponents(np.ascontiguousarray(mask).view(np.uint8), connectivity=8)
    labels = np.asarray(found, np.int64)
    chosen = np.zeros(number, bool)
    chosen[np.unique(labels[_full(small, mask)])] = True
    chosen[0] = False
    return chosen[labels]


def _full(small: Mask, mask: Mask) -> Mask:
    """Pixels of half the size (H / 2, W / 2) in the size of a mask (H, W)."""
    return small.repeat(2, 0).repeat(2, 1)[: mask.shape[0], : mask.shape[1]]


def fit_apart(rng: np.random.Generator, cameras: Sequence[Camera], floor: Floor, options: Options, rate: float,
              seen: Sequence[tuple[Figure, Sequence[Figure], Sequence[Mask | None]]]) -> MultiviewSubject:
    """Fit one person to frame sets: their figure, the others' and the masks (H, W) of each; and make the tracker for `rate` frames/s. Who
    is not seen apart in enough views has the average sizes for the figure's height."""
    tall = float(np.clip(np.percentile([figure.height for figure, *_ in seen], UPRIGHT), *TALL))
    views = [views_of(floor, *each) for each in seen]
    apart = [view for view in views if sum(mask is not None for mask in view) >= min(VIEWS, len(cameras))]
    subject = None
    if len(apart) >= min(MIN_SETS, len(seen)):
        chosen = [apart[n] for n in evenly_spread(len(apart), MOST_SETS)]
        with contextlib.suppress(TrackingError):
            subject = fit_in_views(rng, cameras, chosen, replace(options, height=None), rate, tall)
    return unsettled(subject or average_person(rng, cameras, options, rate, tall))


def unsettled(subject: MultiviewSubject) -> MultiviewSubject:
    """A person among others: what their body does not explain is not left out, as it may be somebody."""
    return replace(subject, tracker=replace(subject.tracker, looks=0))
