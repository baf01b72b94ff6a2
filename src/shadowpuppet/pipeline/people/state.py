"""The people of a recording while it is tracked, as plain values that never change: what the next frame set needs of those before."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.camera.keypoints import cameras_with_persons
from shadowpuppet.camera.mask import Seen
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.person_rig import HullObservation, MultiviewSubject
from shadowpuppet.tracking.doubt.multiview import Before
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.people.evidence import Drawn
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.front import KNOWN, Front, Step, Undecided
from shadowpuppet.tracking.people.identity import Clothes, Exchange, Identity, Question
from shadowpuppet.tracking.people.presence import Followed, Sighting
from shadowpuppet.tracking.people.tracker import Share


class Measured(NamedTuple):
    """A person's sizes, from which the tracker is made."""

    sizes: Array
    """As `Sizes.to_array` gives them."""
    height: float | None
    """Metres."""
    source: str
    """How the sizes were found."""
    summary: Mapping[str, Any]
    is_measured: bool
    """Whether they are the person's own, not average ones."""

    @classmethod
    def of(cls, subject: MultiviewSubject) -> Measured:
        """The sizes of a fitted person."""
        person = subject.person
        return cls(person.sizes.to_array(), person.height, person.source, subject.summary, subject.is_measured)


class Shown(NamedTuple):
    """A frame that shows a person of average sizes well enough to be measured."""

    time: float
    """Seconds."""
    share: Share
    turned: Array | None
    """Pose (D,) of the body turned round; None: the front is known."""


class PersonState(NamedTuple):
    """One person after a frame set."""

    number: int
    """Counted from 1, in the order in which people came."""
    measured: Measured
    height: float
    """Of the figure, metres."""
    place: Array
    """Where the figure was first seen, of shape (2,), metres."""
    state: MultiviewState | None = None
    """The tracker's; None: not there."""
    lost_since: float | None = None
    """Seconds."""
    before: Before | None = None
    """What the doubt about the next frame needs."""
    front: Front = Front()
    shown: tuple[Shown, ...] = ()
    attempts: int = 0
    """How often the person was measured on `shown`."""
    earlier: Measured | None = None
    """The average sizes, before the person was measured while they were tracked."""
    measured_at: float = -np.inf
    """When that was, seconds."""
    share: Share | None = None
    """The evidence of the last frame set, which the next one does not need."""
    frame: MotionFrame | None = None
    """The motion of the last frame set; the next one does not need it either."""

    @property
    def is_front_sure(self) -> bool:
        """Whether the frame may be vouched for: the front is known and, with average sizes, with which it is easily mistaken, the person
        walks forwards."""
        return self.front.is_known and (self.measured.is_measured or self.front.odds > KNOWN)

    @property
    def observation(self) -> HullObservation:
        """This person's part of the last frame set."""
        assert self.share is not None
        cameras = sum(mask is not None and bool(mask.any()) for mask in self.share.masks)
        cameras = cameras or cameras_with_persons(self.share.keypoints)
        seen = Seen(tuple(self.share.masks), keypoints=tuple(self.share.keypoints))
        return HullObservation(self.share.points, seen, cameras)

    def sizes_at(self, time: float) -> Measured:
        """The sizes with which the frame of a time (s) was tracked."""
        return self.earlier if self.earlier is not None and time < self.measured_at else self.measured


class PeopleState(NamedTuple):
    """All people after a frame set, also those who have left."""

    people: tuple[PersonState, ...] = ()
    """By number, from 1 on."""
    coming: tuple[Followed, ...] = ()
    """Figures that no body explains."""
    sets: int = 0
    """Number of frame sets so far."""
    is_begun: bool = False
    """Whether the first people have been looked for, in a frame set that shows any."""
    due: float = -np.inf
    """When people are looked for again, seconds."""
    identity: Identity = Identity()
    exchanges: tuple[Exchange, ...] = ()
    """Exchanges of two people that the colours of their clothes showed later."""

    @property
    def present(self) -> list[PersonState]:
        """The people who are there."""
        return [person for person in self.people if person.state is not None]

    @property
    def is_clear(self) -> bool:
        """Whether all people are tracked and no other seems to come: else what bodies leave unexplained says nothing about cameras."""
        return not self.coming and all(person.state is not None and person.state.status == "tracked" for person in self.present)

    def having(self, *people: PersonState) -> PeopleState:
        """The same with other states of some people, or with new ones."""
        changed = {person.number: person for person in (*self.people, *people)}
        return self._replace(people=tuple(changed.values()))

    def kept(self) -> PeopleState:
        """What the next frame set needs."""
        return self._replace(people=tuple(person._replace(share=None, frame=None) for person in self.people))


TYPES = (*MultiviewSubject.state_types, PeopleState, PersonState, Measured, Shown, Share, Drawn, SurfacePoints, Front, Step, Undecided,
         MotionFrame, Identity, Clothes, Question, Exchange, Followed, Sighting, Figure)  # fmt: skip
"""The named tuples in a `PeopleState`."""
