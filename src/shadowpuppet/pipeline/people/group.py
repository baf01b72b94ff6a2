"""The people of a recording while it is tracked: who is there, who comes, who has left."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import TrackingError
from shadowpuppet.pipeline.person_rig import HullObservation, MultiviewSubject
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.people.carving import Room
from shadowpuppet.tracking.people.columns import Column, find_people
from shadowpuppet.tracking.people.evidence import Drawn, draw_person, predicted
from shadowpuppet.tracking.people.presence import Followed, follow
from shadowpuppet.tracking.people.tracker import Person, Share, explained, place_of, start, step

LOOK_SECONDS = 0.2
"""Seconds from one look at the coarse hull to the next."""
NEW_SECONDS, NEW_LOOKS = 0.5, 3
"""Seconds and number of looks through which a column that no tracked body explains must last to count as a new person."""
FORGET_SECONDS = 0.5
"""Time after which such a column is forgotten."""
GONE_SECONDS = 1.0
"""Time for which a person is lost until they count as gone."""
SAME_PLACE = 0.6
"""Distance (m) from a person within which a column is theirs."""
SAME_HEIGHT = 0.1
"""Greatest difference (m) between the height of a person who enters and that of one who has left, if they may be the same."""

Sighting = tuple[Column, Sequence[Column], Sequence[Mask | None]]
"""A person in a frame set: their column, the others', and the masks (H, W) by camera."""
Fit = Callable[[np.random.Generator, Sequence[Sighting]], MultiviewSubject]
"""Measures a person where they are seen, and makes the tracker."""


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
    """Extent of the coarse hull when the person stood tallest, metres."""
    lost_since: float | None = None
    before: Any = None
    """What the doubt about the next frame needs."""
    share: Share | None = None
    """The evidence of the last frame."""

    @property
    def observation(self) -> HullObservation:
        """This person's part of the last frame."""
        assert self.share is not None
        seen = sum(mask is not None and bool(mask.any()) for mask in self.share.masks)
        return HullObservation(self.share.points, self.share.masks, seen)


@dataclass(eq=False)
class Group:
    """All people of a recording, those who have left too."""

    room: Room
    hull: VisualHull
    fit: Fit
    rng: np.random.Generator
    members: list[Member] = field(default_factory=list)
    coming: list[Followed] = field(default_factory=list)
    seen: dict[int, tuple[list[Column], Sequence[Mask | None]]] = field(default_factory=dict)
    """Columns and masks of the looks that `coming` refers to, by number."""
    looks: int = 0
    due: float = -np.inf

    def add(self, subject: MultiviewSubject, height: float) -> Member:
        """A new person, not yet seen."""
        self.members.append(Member(len(self.members) + 1, subject, self.rng.spawn(1)[0], None, height))
        return self.members[-1]

    @property
    def present(self) -> list[Member]:
        """The people who are there."""
        return [member for member in self.members if member.state is not None]

    def next(self, time: float, points: SurfacePoints, masks: Sequence[Mask | None]) -> None:
        """Update everybody by a frame's surface points and masks (H, W), one per camera."""
        people = {member.number: Person(member.subject.tracker, member.rng, member.state)
                  for member in self.present if member.state is not None}  # fmt: skip
        for number, share in step(people, points, masks).items():
            member = self.members[number - 1]
            member.state, member.share = share.state, share
            lost = share.state.status == "lost"
            member.lost_since = (time if member.lost_since is None else member.lost_since) if lost else None
        if time >= self.due:
            self.due = time + LOOK_SECONDS
            self._look(time, points, masks)
        for member in self.present:
            if member.lost_since is not None and time - member.lost_since >= GONE_SECONDS:
                member.state = member.share = member.lost_since = member.before = None

    def _look(self, time: float, points: SurfacePoints, masks: Sequence[Mask | None]) -> None:
        """Find those who come, or come back, or were lost, in the coarse hull."""
        drawn = {member.number: member.share.drawn for member in self.present if member.share is not None and member.lost_since is None}
        columns = find_people(self.room, masks, explained(drawn, len(masks)))
        places = [place_of(member.subject.body, member.state) for member in self.present
                  if member.state is not None and member.lost_since is None]  # fmt: skip
        free = [column for column in columns if all(np.linalg.norm(place - column.place) > SAME_PLACE for place in places)]
        self.looks += 1
        self.seen[self.looks] = (columns, masks)
        self.coming = follow([each for each in self.coming if time - each.times[-1] <= FORGET_SECONDS], self.looks, time, free)
        for each in list(self.coming):
            if len(each.sets) >= NEW_LOOKS and each.times[-1] == time and time - each.times[0] >= NEW_SECONDS - 1e-6:
                self._enter(each, drawn, points, masks)
                self.coming.remove(each)
        oldest = min((each.sets[0] for each in self.coming), default=self.looks)
        self.seen = {n: seen for n, seen in self.seen.items() if n >= oldest}

    def _enter(self, found: Followed, drawn: dict[int, Drawn], points: SurfacePoints, masks: Sequence[Mask | None]) -> None:
        """Begin to track a person: one who was lost there, one who has left and is as tall, or a new one."""
        column = found.columns[-1]
        member = self._known(column, found.height)
        if member is None:
            try:
                member = self.add(self.fit(self.rng, seen_in(found, self.seen)), found.height)
            except TrackingError:
                return
        self.begin(member, column, drawn, points, masks)

    def begin(self, member: Member, column: Column, drawn: dict[int, Drawn], points: SurfacePoints,
              masks: Sequence[Mask | None]) -> None:
        """Find a person's pose in a column of the coarse hull, beside those who are `drawn`."""
        others = {number: body for number, body in drawn.items() if number != member.number}
        state = start(member.subject.tracker, member.rng, column, others, points, masks)
        if state is not None and state.status != "lost":
            member.state, member.lost_since, member.before = state, None, None

    def _known(self, column: Column, height: float) -> Member | None:
        """Who of those lost or gone may have come back; None for nobody."""
        away = [member for member in self.members if member.state is None or member.lost_since is not None]
        alike = [member for member in away if abs(member.height - height) <= SAME_HEIGHT]

        def distance(member: Member) -> float:
            if member.state is None:
                return 10.0 + abs(member.height - height)
            return float(np.linalg.norm(place_of(member.subject.body, member.state) - column.place))

        return min(alike, key=distance, default=None)

    def drawn(self) -> dict[int, Drawn]:
        """The bodies of those who are there, as they are expected in the next frame."""
        return {member.number: draw_person(member.subject.tracker, predicted(member.subject.body, member.state))
                for member in self.present if member.state is not None}  # fmt: skip


def seen_in(found: Followed, looks: Mapping[int, tuple[Sequence[Column], Sequence[Mask | None]]]) -> list[Sighting]:
    """Where a person is seen among others; `looks`: all columns and the masks (H, W) of each frame set, by number."""
    return [(column, [other for other in looks[n][0] if other is not column], looks[n][1]) for n, column in zip(found.sets, found.columns)]


def first_people(room: Room, times: Sequence[float], sets: Sequence[Sequence[Mask | None]]) -> tuple[list[Followed], list[list[Column]]]:
    """The people in the first seconds' masks (H, W), by time and camera: those seen in half of the sets or more, the longest seen first;
    and all columns of each set."""
    people, every = list[Followed](), list[list[Column]]()
    for n, (time, masks) in enumerate(zip(times, sets, strict=True)):
        every.append(find_people(room, masks))
        people = follow(people, n, time, every[-1])
    lasting = [each for each in people if 2 * len(each.sets) >= len(sets)]
    return sorted(lasting, key=lambda each: (-len(each.sets), float(each.columns[0].place[0]))), every

