"""One of several people while a recording is tracked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.person_rig import HullObservation, MultiviewSubject
from shadowpuppet.tracking.doubt.multiview import Before
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.people.appearance import Colours
from shadowpuppet.tracking.people.facing import Facing, Trial
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.tracker import Share
from shadowpuppet.tracking.people.walking import ALONG, Walk


class Look(NamedTuple):
    """A moment at which people were looked for."""

    figures: Sequence[Figure]
    masks: Sequence[Mask | None]
    worn: Sequence[Colours | None]
    """Colours of each figure; None for people who are tracked, and without pictures."""


Sighting = tuple[Figure, Sequence[Figure], Sequence[Mask | None]]
"""A person in a frame set: their figure, the others', and the masks (H, W) by camera."""
Fit = Callable[[np.random.Generator, Sequence[Sighting]], MultiviewSubject]
"""Measures a person where they are seen, and makes the tracker."""


class Shown(NamedTuple):
    """A frame that shows a person of average sizes well enough to be measured."""

    time: float
    """Seconds."""
    share: Share
    pose: Array
    """Of the body as it is tracked, (D,)."""
    turned: Array | None
    """Of the body turned round (D,); None: the front is known."""


@dataclass(eq=False)
class Member:
    """One person of a recording."""

    number: int
    """Counted from 1, in the order in which they came."""
    subject: MultiviewSubject
    rng: np.random.Generator
    state: MultiviewState | None
    """None: gone."""
    height: float
    """Of the figure, metres."""
    place: Array
    """Where the figure was first seen, of shape (2,), metres."""
    lost_since: float | None = None
    before: Before | None = None
    """What the doubt about the next frame needs."""
    share: Share | None = None
    """The evidence of the last frame."""
    walk: Walk = field(default_factory=Walk)
    trial: Trial | None = None
    """The person facing the other way, while it is not known which way is right."""
    facing: Facing = field(default_factory=Facing)
    """Whether it is known which way the person faces: from the silhouettes at the beginning, or because they walked."""

    shown: list[Shown] = field(default_factory=list)
    """Frames in which the person, of average sizes so far, may be measured."""
    attempts: int = 0
    """How often that was tried."""
    earlier: MultiviewSubject | None = None
    """The person of average sizes, before they were measured while they were tracked."""
    measured_at: float = -np.inf
    """When that was, seconds."""

    @property
    def is_front_sure(self) -> bool:
        """Whether the frame may be vouched for: the front is known and, of a person of average sizes, who is taken for turned round more
        easily, they walk forwards now."""
        return self.facing.is_known and (self.subject.is_measured or self.walk.forward > ALONG)

    def subject_at(self, time: float) -> MultiviewSubject:
        """The person as the frame of a time (s) was tracked."""
        return self.earlier if self.earlier is not None and time < self.measured_at else self.subject

    @property
    def observation(self) -> HullObservation:
        """This person's part of the last frame."""
        assert self.share is not None
        cameras = sum(mask is not None and bool(mask.any()) for mask in self.share.masks)
        return HullObservation(self.share.points, Seen(tuple(self.share.masks)), cameras)
