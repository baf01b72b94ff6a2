"""The sizes of each of several people, measured in frames and views that show them apart from the others."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.body.models import sizes_kind
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.state import Measured
from shadowpuppet.pipeline.person_rig import MultiviewSubject, average_person, fit_in_views, known_person
from shadowpuppet.tracking.multiview.size_estimation import MIN_FRAMES
from shadowpuppet.tracking.people.evidence import chosen_of
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.presence import Followed, Sighting
from shadowpuppet.tracking.people.tracker import VIEWS
from shadowpuppet.tracking.people.views import views_of

MOST_SETS = 16
"""Greatest number of frame sets in which sizes are measured: those in which `VIEWS` (all, if there are fewer cameras) show a person
apart."""
TALL = 0.8, 2.3
"""Least and greatest height of a person, metres, that is expected of a figure; the sizes are refined from there."""


def fit_apart(rng: np.random.Generator, floor: Floor, options: Options, rate: float, seen: Sequence[Sighting],
              shown: Mapping[float, Sequence[Keypoints | None]]) -> Measured:
    """The sizes of one person, fitted to frame sets; `rate`: frames/s; `shown`: keypoints, by camera, of some of their times. A person who
    is not seen apart in enough views has the average sizes for the figure's height."""
    cameras, tall = floor.cameras, float(np.clip(Followed(tuple(seen)).height, *TALL))
    keypoints = [shown.get(each.time, ()) for each in seen]
    if options.uses_silhouettes:
        shows = views = [views_of(floor, each.figure, each.others, each.masks) for each in seen]
        found = [tuple(None if mask is None else own for mask, own in zip(view, each)) for view, each in zip(views, keypoints)]
    else:
        views = [each.masks for each in seen]
        shows = found = [chosen_of(own, each.figure.people) for own, each in zip(keypoints, seen)]
    apart = [n for n, view in enumerate(shows) if sum(each is not None for each in view) >= min(VIEWS, len(cameras))]
    subject = None
    if len(apart) >= min(MIN_FRAMES, len(seen)):
        chosen = [apart[n] for n in evenly_spread(len(apart), MOST_SETS)]
        with contextlib.suppress(TrackingError):
            # fronts are found while people are tracked
            subject = fit_in_views(rng, cameras, [views[n] for n in chosen], replace(options, height=None), rate, tall, both_fronts=False,
                                   keypoints=[found[n] for n in chosen])
    return Measured.of(subject or average_person(rng, cameras, options, rate, tall))


def known_sizes(options: Options) -> Measured:
    """The sizes of a person that were saved. Raises `FormatError`."""
    assert options.person is not None
    person, source = read_person(options.person, options.multiview.body), str(options.person)
    sizes = person.sizes.to_array()
    return Measured(sizes, person.height, source, {"source": source, "sizes": dict(zip(person.sizes.names(), map(float, sizes)))}, True)


def one_of_several(rng: np.random.Generator, cameras: Sequence[Camera], options: Options, rate: float,
                   measured: Measured) -> MultiviewSubject:
    """A person of known sizes among others, and the tracker for `rate` frames/s: what the body does not explain is not left out, as it may
    be another person."""
    person = Person(sizes_kind(options.multiview.body).from_array(measured.sizes), measured.height, measured.source)
    subject = known_person(rng, cameras, options, rate, person, dict(measured.summary), measured.is_measured)
    return replace(subject, tracker=replace(subject.tracker, looks=0))
