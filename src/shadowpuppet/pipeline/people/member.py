"""One of several people while a recording is tracked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.person_rig import HullObservation, MultiviewSubject
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.appearance import Colours
from shadowpuppet.tracking.people.facing import Facing, Trial
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.tracker import Person, Share, is_shown
from shadowpuppet.tracking.people.walking import Walk

SETTLED = 16
"""Number of particles for a person of whom nothing is in doubt, and who is apart from others: as with six cameras or more."""


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
    before: Any = None
    """What the doubt about the next frame needs."""
    share: Share | None = None
    """The evidence of the last frame."""
    walk: Walk = field(default_factory=Walk)
    trial: Trial | None = None
    """The person facing the other way, while it is not known which way is right."""
    facing: Facing = field(default_factory=Facing)
    """Whether it is known which way the person faces: from the silhouettes at the beginning, or because they walked."""

    is_settled: bool = False
    """Whether fewer particles suffice: nothing is in doubt."""
    shown: list[Shown] = field(default_factory=list)
    """Frames in which the person, of average sizes so far, may be measured."""
    earlier: MultiviewSubject | None = None
    """The person of average sizes, before they were measured while they were tracked."""
    measured_at: float = -np.inf
    """When that was, seconds."""
    _settled: MultiviewTracker | None = None

    def settle(self, apart: bool) -> None:
        """See whether fewer particles suffice in the next frame; `apart`: no other person is near."""
        tracked = self.state is not None and self.state.status == "tracked" and self.subject.is_measured and self.facing.is_known
        self.is_settled = apart and tracked and self.share is not None and is_shown(self.share)

    @property
    def person(self) -> Person:
        """What a frame's step needs."""
        assert self.state is not None
        return Person(self.settled_tracker if self.is_settled else self.subject.tracker, self.rng, self.state)

    @property
    def settled_tracker(self) -> MultiviewTracker:
        """The tracker with fewer particles."""
        if self._settled is None or self._settled.body is not self.subject.body:
            number = min(self.subject.tracker.number, SETTLED)
            tracker = self.subject.tracker
            self._settled = replace(tracker, settings=replace(tracker.settings, particles=number))
        return self._settled

    def subject_at(self, time: float) -> MultiviewSubject:
        """The person as the frame of a time (s) was tracked."""
        return self.earlier if self.earlier is not None and time < self.measured_at else self.subject

    @property
    def observation(self) -> HullObservation:
        """This person's part of the last frame."""
        assert self.share is not None
        seen = sum(mask is not None and bool(mask.any()) for mask in self.share.masks)
        return HullObservation(self.share.points, self.share.masks, seen)
