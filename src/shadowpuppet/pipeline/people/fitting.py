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
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.presence import UPRIGHT
from shadowpuppet.tracking.people.views import views_of

VIEWS, MIN_SETS, MOST_SETS = 3, 4, 16
"""Least number of views (of all, if there are fewer cameras) and of frame sets that show a person apart for sizes to be measured, and the
most sets that are used."""
TALL = 0.8, 2.3
"""Least and greatest height of a person, metres, that is expected of a figure; the sizes are refined from there."""


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
            # fronts are found while people are tracked
            subject = fit_in_views(rng, cameras, chosen, replace(options, height=None), rate, tall, both_fronts=False)
    return unsettled(subject or average_person(rng, cameras, options, rate, tall))


def unsettled(subject: MultiviewSubject) -> MultiviewSubject:
    """A person among others: what their body does not explain is not left out, as it may be somebody."""
    return replace(subject, tracker=replace(subject.tracker, looks=0))
