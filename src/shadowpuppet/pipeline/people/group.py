"""The people of a recording, frame set by frame set: silhouettes are divided among them, each is tracked, and their fronts are weighed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.keypoints import cameras_with_persons
from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.people.later_sizes import measured_later
from shadowpuppet.pipeline.people.state import Measured, PeopleState, PersonState
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.subject import motion_frame
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.tracking.people.appearance import Colours, apart_from, colours_of_body, colours_of_figure, dressed_parts
from shadowpuppet.tracking.people.evidence import Drawn, draw_person, other_keypoints, predicted
from shadowpuppet.tracking.people.figures import Figure, drawn, find_people
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.front import face
from shadowpuppet.tracking.people.identity import CLEAR, DIFFERENT, Identity
from shadowpuppet.tracking.people.presence import Followed, Sighting, follow, sightings
from shadowpuppet.tracking.people.tracker import SAME_PLACE, Person, Share, explained, follow_turned, place_of, start, step

LOOK_SECONDS = 0.2
"""Seconds from one look for people to the next."""
NEW_SECONDS, NEW_LOOKS = 0.5, 3
"""Seconds and number of looks through which a figure that no tracked body explains must last to count as a new person; after the seconds
such a figure is forgotten."""
GONE_SECONDS = 1.0
"""Time for which a person is lost until they count as gone."""
SAME_HEIGHT = 0.1
"""Greatest difference (m) between the height of a person who enters and that of one who has left, if they may be the same."""
WITHIN = 0.2
"""Distance (m) of two people who may have been exchanged, below which motion does not tell whether they were."""


class Frames(NamedTuple):
    """What one frame set shows."""

    time: float
    """Seconds."""
    points: SurfacePoints
    """Surface points of the visual hull of all people."""
    seen: Seen
    images: Sequence[NDArray[np.uint8] | None] = ()
    """A picture (H, W, 3) or (H, W) that fits the silhouettes, per camera; empty: clothes are not looked at."""

    @property
    def by_keypoints(self) -> bool:
        """Whether keypoints alone show people, to two cameras or more."""
        return all(mask is None for mask in self.seen.masks) and cameras_with_persons(self.seen.keypoints) > 1


@dataclass(frozen=True, eq=False)
class Group:
    """Steps from the people of one frame set to those of the next. The same state and frame set give the same."""

    floor: Floor
    hull: VisualHull
    fit: Callable[[np.random.Generator, Sequence[Sighting]], Measured]
    """Measures a person where they are seen."""
    subject: Callable[[Measured], MultiviewSubject]
    """The person of sizes, and the tracker."""
    seed: int = 0
    most: int | None = None
    """Greatest number of people; None: any."""

    def next(self, people: PeopleState, frames: Frames) -> PeopleState:
        """The people after one more frame set."""
        if not people.is_begun and (len(frames.points.points) or frames.by_keypoints):
            people = self.start(people, frames)._replace(is_begun=True)
        after = self._tracked(people, frames)
        if frames.time >= people.due:
            after = self._looked(after._replace(due=frames.time + LOOK_SECONDS), frames)
        gone = [person._replace(state=None, share=None, lost_since=None, before=None) for person in after.present
                if person.lost_since is not None and frames.time - person.lost_since >= GONE_SECONDS]  # fmt: skip
        after = after.having(*gone)
        return after.having(*(self._framed(after, person, frames.time) for person in after.people))._replace(sets=people.sets + 1)

    def start(self, people: PeopleState, frames: Frames) -> PeopleState:
        """The measured people, each begun at the nearest figure of the first frame set."""
        figures = find_people(self.floor, frames.seen)
        pairs = sorted((float(np.linalg.norm(figure.place - person.place)), person.number, n)
                       for person in people.people for n, figure in enumerate(figures))  # fmt: skip
        of = dict[int, Figure]()
        for _, number, n in pairs:
            if number not in of and all(figures[n] is not figure for figure in of.values()):
                of[number] = figures[n]
        for attempt in range(2):  # the second time for people who were hidden by others that were not known yet
            for number, figure in of.items():
                person = people.people[number - 1]
                if person.state is None or person.state.status != "tracked":
                    people = people.having(self.begun(person, figure, self.drawn(people), frames, self.rng(attempt, number, people)))
        return people

    def rng(self, *which: int | PeopleState) -> np.random.Generator:
        """The random numbers of some purpose, person and frame set."""
        return np.random.default_rng([self.seed, *(each.sets if isinstance(each, PeopleState) else each for each in which)])

    def tracker_of(self, person: PersonState, rng: np.random.Generator) -> Person:
        """How a person who is there is tracked, and where they are."""
        assert person.state is not None
        return Person(self.subject(person.measured).tracker, rng, person.state)

    def drawn(self, people: PeopleState) -> dict[int, Drawn]:
        """The bodies of the people present, as predicted for the next frame."""
        bodies = ((person.number, self.subject(person.measured).tracker, person.state) for person in people.present)
        return {number: draw_person(tracker, predicted(tracker.body, state)) for number, tracker, state in bodies if state is not None}

    def _tracked(self, people: PeopleState, frames: Frames) -> PeopleState:
        """Everybody present, tracked on their part of the silhouettes, with the odds of their front."""
        rngs = {person.number: self.rng(2, person.number, people) for person in people.present}
        shares = step({person.number: self.tracker_of(person, rngs[person.number]) for person in people.present}, frames.points,
                      frames.seen.masks, keypoints=frames.seen.keypoints)

        def faced(person: PersonState) -> PersonState:
            return self._faced(person, shares[person.number], frames.time, rngs[person.number])

        with ThreadPoolExecutor(max(min(len(shares), usable_cores()), 1), "people") as pool:
            return people.having(*pool.map(faced, people.present))

    def _faced(self, person: PersonState, share: Share, time: float, rng: np.random.Generator) -> PersonState:
        """A person with a share of a frame set, and the odds of the front."""
        if share.state.status == "lost":
            since = time if person.lost_since is None else person.lost_since
            return person._replace(state=share.state, share=share, lost_since=since, front=person.front.lost(), shown=())
        measured = person.measured
        front, state = face(person.front, self.subject(measured).tracker, rng, share, time, measured.is_measured)
        shown = person.shown if state is share.state else ()
        return person._replace(state=state, share=share._replace(state=state), lost_since=None, front=front, shown=shown)

    def _framed(self, people: PeopleState, person: PersonState, time: float) -> PersonState:
        """A person with the motion of the frame set; while the front is unknown, with what it is if the body is turned round."""
        if person.state is None or person.share is None:
            return person._replace(frame=MotionFrame(time, "absent"), before=None)
        subject = self.subject(person.measured)
        frame, before = motion_frame(subject, time, person.state, person.observation, person.before)
        frame = would_be = doubted(frame) if people.identity.is_doubted(person.number) else frame
        front = person.front
        if not front.is_known and front.other is not None:
            other = motion_frame(subject, time, front.other, person.observation)[0]
            front = front.with_frame(plain(would_be), plain(other))
        return person._replace(frame=frame if person.is_front_sure else doubted(frame), before=before, front=front)

    def _looked(self, people: PeopleState, frames: Frames) -> PeopleState:
        """See who is who, and find new, returning and lost people among the figures that no tracked body explains."""
        bodies = {person.number: person.share.drawn for person in people.present
                  if person.share is not None and person.lost_since is None}  # fmt: skip
        seen = frames.seen
        if frames.by_keypoints and people.present:
            tracker = self.subject(people.present[0].measured).tracker
            seen = seen._replace(keypoints=other_keypoints(tracker, bodies, seen.keypoints))
        figures = find_people(self.floor, seen, explained(bodies))
        places = [self.place(person) for person in people.present if person.lost_since is None]
        found = [each for each in sightings(frames.time, figures, frames.seen.masks)
                 if all(np.linalg.norm(place - each.figure.place) > SAME_PLACE for place in places)]  # fmt: skip
        if any(image is not None for image in frames.images):
            identity, worn = self.colours(people, bodies, [each.figure for each in found], frames)
            people = people._replace(identity=identity)
            found = [each._replace(worn=colours) for each, colours in zip(found, worn)]
        people = self._told_apart(people, frames.time)
        people = people.having(*(measured_later(each, self.subject(each.measured), self.rng(3, each.number, people), frames.time)
                                 for each in people.present))  # fmt: skip
        coming = follow([each for each in people.coming if frames.time - each.last.time <= NEW_SECONDS], found)
        for each in list(coming):
            first = each.sightings[0].time
            if len(each.sightings) >= NEW_LOOKS and each.last.time == frames.time and frames.time - first >= NEW_SECONDS - 1e-6:
                people = self._entered(people, each, bodies, frames)
                coming.remove(each)
        return people._replace(coming=tuple(coming))

    def colours(self, people: PeopleState, bodies: Mapping[int, Drawn], free: Sequence[Figure],
                frames: Frames) -> tuple[Identity, list[Colours]]:
        """The identity with the clothes of tracked people, where no other person overlaps them; and the colours of the free figures."""
        cameras, masks, identity = self.floor.cameras, frames.seen.masks, people.identity
        beside = {number: body.masks_near() for number, body in bodies.items()}
        figures = [drawn(self.floor, figure) for figure in free]
        for number, body in bodies.items():
            person = people.people[number - 1]
            if person.state is not None and person.state.status == "tracked":
                apart = apart_from(masks, [*figures, *(other for n, other in beside.items() if n != number)])
                limbs = self.subject(person.measured).body.limbs
                assert limbs is not None
                worn = colours_of_body(cameras, body.centres, body.radii, dressed_parts(limbs), apart, frames.images)
                identity = identity.see(number, frames.time, worn)
        return identity, [
            colours_of_figure(cameras, figure.place, figure.height, self.floor.level,
                              apart_from(masks, [*beside.values(), *(other for other in figures if other is not own)]), frames.images)
            for figure, own in zip(free, figures)]

    def _told_apart(self, people: PeopleState, time: float) -> PeopleState:
        """Note who may have been exchanged because they are close, and put right who was."""
        identity, present = people.identity, [(person, self.place(person)) for person in people.present]
        for n, (one, place) in enumerate(present):
            for other, there in present[n + 1 :]:
                if (away := float(np.linalg.norm(place - there))) < SAME_PLACE:
                    is_lost = one.lost_since is not None or other.lost_since is not None
                    identity = identity.meet(one.number, other.number, time, is_open=is_lost or away < WITHIN)
        identity, exchange = identity.decided(time, [person.number for person, _ in present if person.lost_since is None])
        people = people._replace(identity=identity)
        if exchange is None:
            return people
        one, other = (people.people[number - 1] for number in (exchange.one, exchange.other))
        swapped = self._in_place_of(one, other, people), self._in_place_of(other, one, people)
        return people.having(*swapped)._replace(exchanges=(*people.exchanges, exchange))

    def _in_place_of(self, person: PersonState, other: PersonState, people: PeopleState) -> PersonState:
        """A person where another one was."""
        person = person._replace(state=other.state, share=other.share, lost_since=other.lost_since, before=None,
                                 front=person.front.begun(other.front.is_known))  # fmt: skip
        if other.state is None or other.share is None:
            return person
        tracker = self.subject(person.measured).tracker
        state = follow_turned(tracker, self.rng(4, person.number, people), other.state, other.share)
        return person._replace(state=state, share=other.share._replace(state=state))

    def _entered(self, people: PeopleState, found: Followed, bodies: Mapping[int, Drawn], frames: Frames) -> PeopleState:
        """The people with that of a figure: a lost one near it, one of that height and those colours who has left, or a new one."""
        alike, number = self._known(people, found), len(people.people) + 1
        if not alike and self.most is not None and number > self.most:
            return people
        try:
            person = alike[0] if alike else self.new(people, found)
        except TrackingError:
            return people
        person = self.begun(person, found.last.figure, bodies, frames, self.rng(5, person.number, people))
        people = people.having(person)
        for other in alike[1:] if person.state is not None and person.lost_since is None else ():
            people = people._replace(identity=people.identity.meet(person.number, other.number, frames.time, is_open=True))
        return people

    def new(self, people: PeopleState, found: Followed) -> PersonState:
        """A new person, measured where they are seen, and not yet tracked. Raises `TrackingError`."""
        number = len(people.people) + 1
        return PersonState(number, self.fit(self.rng(6, number, people), found.sightings), found.height, found.last.figure.place)

    def begun(self, person: PersonState, figure: Figure, bodies: Mapping[int, Drawn], frames: Frames,
              rng: np.random.Generator) -> PersonState:
        """A person found at the place of a figure, beside the bodies of others; as they were if they are not found."""
        others = {number: body for number, body in bodies.items() if number != person.number}
        found = start(self.subject(person.measured).tracker, rng, figure, others, frames.points, frames.seen.masks,
                      frames.seen.keypoints)
        if found is None or found.state.status == "lost":
            return person
        front = person.front.begun(found.is_shown or (found.is_sided and person.measured.is_measured))
        return person._replace(state=found.state, lost_since=None, before=None, front=front)

    def _known(self, people: PeopleState, found: Followed) -> list[PersonState]:
        """The lost or absent people who a figure may be, the most likely first; none: a new person."""
        seen = [each.worn for each in found.sightings if each.worn is not None]
        worn = np.add.reduce(seen) if seen else None
        away = [person for person in people.people if person.state is None or person.lost_since is not None]
        unlike = {person.number: people.identity.unlike(person.number, worn) for person in away}
        alike = [person for person in away if abs(person.height - found.height) <= SAME_HEIGHT
                 and (person.state is not None or not unlike[person.number] > DIFFERENT)]  # fmt: skip
        best = min((each for person in alike if np.isfinite(each := unlike[person.number])), default=np.inf)

        def distance(person: PersonState) -> float:
            if person.state is None:
                return 10.0 + abs(person.height - found.height)
            return float(np.linalg.norm(self.place(person) - found.last.figure.place))

        return sorted((person for person in alike if not unlike[person.number] > best + CLEAR), key=distance)

    def place(self, person: PersonState) -> Array:
        """Where a person who is there stands on the floor plan, of shape (2,), metres."""
        assert person.state is not None
        return place_of(self.subject(person.measured).body, person.state)


def doubted(frame: MotionFrame) -> MotionFrame:
    """The frame of a person who may face the other way, or be another one: nothing of it is `tracked`."""
    limbs = None if frame.limb_status is None else tuple("uncertain" if each == "tracked" else each for each in frame.limb_status)
    return frame._replace(status="uncertain" if frame.status == "tracked" else frame.status, limb_status=limbs)


def plain(frame: MotionFrame) -> MotionFrame:
    """A frame as a checkpoint can keep it, without its modes."""
    return frame._replace(limb_status=None if frame.limb_status is None else tuple(frame.limb_status), modes=())


def first_people(floor: Floor, times: Sequence[float], sets: Sequence[Seen], most: int | None = None) -> list[Followed]:
    """The people in the frame sets of the first seconds: those seen in half of the sets or more, the longest seen first; at most the
    `most` with the greatest evidence."""
    people = list[Followed]()
    for time, seen in zip(times, sets, strict=True):
        people = follow(people, sightings(time, find_people(floor, seen), seen.masks))
    lasting = [each for each in people if 2 * len(each.sightings) >= len(sets)]
    lasting.sort(key=lambda each: -sum(one.figure.evidence for one in each.sightings))
    return sorted(lasting[:most], key=lambda each: (-len(each.sightings), float(each.sightings[0].figure.place[0])))
