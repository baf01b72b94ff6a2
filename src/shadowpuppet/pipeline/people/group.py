"""The people of a recording while it is tracked: those present, new ones, and those who have left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.people.fronts import face_the_way
from shadowpuppet.pipeline.people.later_sizes import measure_later
from shadowpuppet.pipeline.people.member import Fit, Look, Member, Sighting
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.tracking.people.appearance import Colours, apart_from, colours_of_body, colours_of_figure, dressed_parts
from shadowpuppet.tracking.people.evidence import Drawn, draw_person, predicted
from shadowpuppet.tracking.people.figures import Figure, drawn, find_people
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.identity import CLEAR, DIFFERENT, Exchange, Identity
from shadowpuppet.tracking.people.presence import Followed, follow
from shadowpuppet.tracking.people.tracker import Person, explained, follow_turned, place_of, start, step

LOOK_SECONDS = 0.2
"""Seconds from one look for people to the next."""
NEW_SECONDS, NEW_LOOKS = 0.5, 3
"""Seconds and number of looks through which a figure that no tracked body explains must last to count as a new person."""
FORGET_SECONDS = 0.5
"""Time after which such a figure is forgotten."""
GONE_SECONDS = 1.0
"""Time for which a person is lost until they count as gone."""
SAME_PLACE = 0.6
"""Distance (m) from a person within which a figure is theirs."""
SAME_HEIGHT = 0.1
"""Greatest difference (m) between the height of a person who enters and that of one who has left, if they may be the same."""
CLOSE, WITHIN = 0.6, 0.2
"""Distance (m) of two people below which they may be exchanged; below which motion does not tell whether they were."""

Images = Sequence[NDArray[np.uint8] | None]
"""A picture (H, W, 3) or (H, W) a camera; empty: clothes are not looked at."""


@dataclass(eq=False)
class Group:
    """All people of a recording, also those who have left."""

    floor: Floor
    hull: VisualHull
    fit: Fit
    rng: np.random.Generator
    members: list[Member] = field(default_factory=list)
    coming: list[Followed] = field(default_factory=list)
    seen: dict[int, Look] = field(default_factory=dict)
    """The looks that `coming` refers to, by number."""
    looks: int = 0
    due: float = -np.inf
    identity: Identity = field(default_factory=Identity)
    exchanges: list[Exchange] = field(default_factory=list)
    """People who were exchanged, as their colours told later."""

    def add(self, subject: MultiviewSubject, height: float, place: Array) -> Member:
        """A new person, not yet tracked, whose figure is first seen at a place (2,)."""
        self.members.append(Member(len(self.members) + 1, subject, self.rng.spawn(1)[0], None, height, place))
        return self.members[-1]

    def start(self, time: float, points: SurfacePoints, seen: Seen) -> None:
        """Start the measured people, each at the nearest figure of the first frame set; arguments as for `next`."""
        figures = find_people(self.floor, seen)
        pairs = sorted((float(np.linalg.norm(figure.place - member.place)), member.number, n)
                       for member in self.members for n, figure in enumerate(figures))  # fmt: skip
        of = dict[int, Figure]()
        for _, number, n in pairs:
            if number not in of and all(figures[n] is not figure for figure in of.values()):
                of[number] = figures[n]
        for _ in range(2):  # the second time for people who were hidden by others that were not known yet
            for number, figure in of.items():
                member = self.members[number - 1]
                if member.state is None or member.state.status != "tracked":
                    self.begin(member, time, figure, self.drawn(), points, seen.masks)

    @property
    def present(self) -> list[Member]:
        """The people who are there."""
        return [member for member in self.members if member.state is not None]

    @property
    def is_clear(self) -> bool:
        """Whether all people are tracked and no other seems to come: else what bodies leave unexplained says nothing about cameras."""
        return not self.coming and all(member.state is not None and member.state.status == "tracked" for member in self.present)

    def next(self, time: float, points: SurfacePoints, seen: Seen, images: Images = ()) -> None:
        """Update all people by a frame set's surface points and silhouettes, and the images that fit these, one per camera."""
        people = {member.number: Person(member.subject.tracker, member.rng, member.state)
                  for member in self.present if member.state is not None}  # fmt: skip
        for number, share in step(people, points, seen.masks).items():
            member = self.members[number - 1]
            member.state, member.share = share.state, share
            lost = share.state.status == "lost"
            member.lost_since = (time if member.lost_since is None else member.lost_since) if lost else None
        with ThreadPoolExecutor(max(min(len(people), usable_cores()), 1), "people") as pool:
            list(pool.map(lambda number: face_the_way(self.members[number - 1], time), people))  # raises what one of them raised
        if time >= self.due:
            self.due = time + LOOK_SECONDS
            self._look(time, points, seen, images)
        for member in self.present:
            if member.lost_since is not None and time - member.lost_since >= GONE_SECONDS:
                member.state = member.share = member.lost_since = member.before = None

    def _look(self, time: float, points: SurfacePoints, seen: Seen, images: Images) -> None:
        """See who is who, and find new, returning and lost people among the figures that no tracked body explains."""
        drawn = {member.number: member.share.drawn for member in self.present if member.share is not None and member.lost_since is None}
        masks = seen.masks
        figures = find_people(self.floor, seen, explained(drawn))
        places = [place_of(member.subject.body, member.state) for member in self.present
                  if member.state is not None and member.lost_since is None]  # fmt: skip
        free = [figure for figure in figures if all(np.linalg.norm(place - figure.place) > SAME_PLACE for place in places)]
        worn = self._gather(time, drawn, free, masks, images) if any(image is not None for image in images) else [None] * len(free)
        self._tell_apart(time)
        for member in self.present:
            measure_later(member, time)
        self.looks += 1
        of_free = {id(figure): colours for figure, colours in zip(free, worn)}
        self.seen[self.looks] = Look(figures, masks, [of_free.get(id(figure)) for figure in figures])
        self.coming = follow([each for each in self.coming if time - each.times[-1] <= FORGET_SECONDS], self.looks, time, free)
        for each in list(self.coming):
            if len(each.sets) >= NEW_LOOKS and each.times[-1] == time and time - each.times[0] >= NEW_SECONDS - 1e-6:
                self._enter(each, time, drawn, points, masks)
                self.coming.remove(each)
        oldest = min((each.sets[0] for each in self.coming), default=self.looks)
        self.seen = {n: seen for n, seen in self.seen.items() if n >= oldest}

    def _gather(self, time: float, bodies: Mapping[int, Drawn], free: Sequence[Figure], masks: Sequence[Mask | None],
                images: Images) -> list[Colours | None]:
        """See how people are dressed where only they are seen; returns the same of the free figures."""
        cameras = self.floor.cameras
        beside = {number: body.masks_near() for number, body in bodies.items()}
        figures = [drawn(self.floor, figure) for figure in free]
        for number, body in bodies.items():
            member = self.members[number - 1]
            if member.state is not None and member.state.status == "tracked":
                apart = apart_from(masks, [*figures, *(other for n, other in beside.items() if n != number)])
                limbs = member.subject.body.limbs
                assert limbs is not None
                self.identity.see(number, time, colours_of_body(cameras, body.centres, body.radii, dressed_parts(limbs), apart, images))
        return [colours_of_figure(cameras, figure.place, figure.height, self.floor.level,
                                  apart_from(masks, [*beside.values(), *(other for other in figures if other is not own)]), images)
                for figure, own in zip(free, figures)]  # fmt: skip

    def _tell_apart(self, time: float) -> None:
        """Note who may have been exchanged because they are close, and put right who was."""
        people = [(member, place_of(member.subject.body, member.state)) for member in self.present if member.state is not None]
        for n, (one, place) in enumerate(people):
            for other, there in people[n + 1 :]:
                if (away := float(np.linalg.norm(place - there))) < CLOSE:
                    lost = one.lost_since is not None or other.lost_since is not None
                    self.identity.meet(one.number, other.number, time, is_open=lost or away < WITHIN)
        exchange = self.identity.decide(time, [member.number for member, _ in people if member.lost_since is None])
        if exchange is not None:
            self._exchange(self.members[exchange.one - 1], self.members[exchange.other - 1], time)
            self.exchanges.append(exchange)

    @staticmethod
    def _exchange(one: Member, other: Member, time: float) -> None:
        """Each of two people is where the other was."""
        known = one.facing.is_known, other.facing.is_known
        for name in ("state", "share", "lost_since", "walk"):
            theirs = getattr(other, name)
            setattr(other, name, getattr(one, name))
            setattr(one, name, theirs)
        for member, is_known in ((one, known[1]), (other, known[0])):
            member.before = member.trial = None
            if member.state is not None and member.share is not None:
                member.state = follow_turned(member.subject.tracker, member.rng, member.state, member.share)
                member.share = member.share._replace(state=member.state)
                member.facing.begin(time, is_known)

    def _enter(self, found: Followed, time: float, drawn: dict[int, Drawn], points: SurfacePoints,
               masks: Sequence[Mask | None]) -> None:
        """Start tracking the person of a figure: a lost one near it, one of that height and those colours who has left, or a new one."""
        figure = found.figures[-1]
        alike = self._known(found)
        try:
            member = alike[0] if alike else self.add(self.fit(self.rng, seen_in(found, self.seen)), found.height, figure.place)
        except TrackingError:
            return
        self.begin(member, time, figure, drawn, points, masks)
        if member.state is not None and member.lost_since is None:
            for other in alike[1:]:
                self.identity.meet(member.number, other.number, time, is_open=True)

    def begin(self, member: Member, time: float, figure: Figure, drawn: dict[int, Drawn], points: SurfacePoints,
              masks: Sequence[Mask | None]) -> None:
        """Find a person's pose at the place of a figure, beside those who are `drawn`."""
        others = {number: body for number, body in drawn.items() if number != member.number}
        begun = start(member.subject.tracker, member.rng, figure, others, points, masks)
        if begun is not None and begun.state.status != "lost":
            member.state, member.lost_since, member.before = begun.state, None, None
            member.facing.begin(time, begun.is_sided and member.subject.is_measured)
            member.walk.forget()

    def _known(self, found: Followed) -> list[Member]:
        """The lost or absent people who a figure may be, the most likely first; none: a new person."""
        away = [member for member in self.members if member.state is None or member.lost_since is not None]
        alike = [member for member in away if abs(member.height - found.height) <= SAME_HEIGHT]
        unlike = {member.number: self.identity.unlike(member.number, self._worn(found)) for member in alike}
        alike = [member for member in alike if member.state is not None or not unlike[member.number] > DIFFERENT]
        best = min((each for member in alike if np.isfinite(each := unlike[member.number])), default=np.inf)

        def distance(member: Member) -> float:
            if member.state is None:
                return 10.0 + abs(member.height - found.height)
            return float(np.linalg.norm(place_of(member.subject.body, member.state) - found.place))

        return sorted((member for member in alike if not unlike[member.number] > best + CLEAR), key=distance)

    def _worn(self, found: Followed) -> Colours | None:
        """The colours of a figure that was followed."""
        looks = [(self.seen[n], figure) for n, figure in zip(found.sets, found.figures)]
        worn = [colours for look, figure in looks for other, colours in zip(look.figures, look.worn) if other is figure]
        seen = [colours for colours in worn if colours is not None]
        return np.add.reduce(seen) if seen else None

    def drawn(self) -> dict[int, Drawn]:
        """The bodies of the people present, as predicted for the next frame."""
        return {member.number: draw_person(member.subject.tracker, predicted(member.subject.body, member.state))
                for member in self.present if member.state is not None}  # fmt: skip


def seen_in(found: Followed, looks: Mapping[int, Look]) -> list[Sighting]:
    """Where a person is seen among others, in looks by number."""
    return [(figure, [other for other in looks[n].figures if other is not figure], looks[n].masks)
            for n, figure in zip(found.sets, found.figures)]  # fmt: skip


def first_people(floor: Floor, times: Sequence[float], sets: Sequence[Seen]) -> tuple[list[Followed], list[list[Figure]]]:
    """The people in the frame sets of the first seconds: those seen in half of the sets or more, the longest seen first; and all figures of
    each set."""
    people, every = list[Followed](), list[list[Figure]]()
    for n, (time, seen) in enumerate(zip(times, sets, strict=True)):
        every.append(find_people(floor, seen))
        people = follow(people, n, time, every[-1])
    lasting = [each for each in people if 2 * len(each.sets) >= len(sets)]
    return sorted(lasting, key=lambda each: (-len(each.sets), float(each.figures[0].place[0]))), every

