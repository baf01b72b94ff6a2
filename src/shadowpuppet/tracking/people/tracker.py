"""Several people tracked together: each by a tracker of their own, on evidence that is divided among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.body.whole_body import GLOBAL_DOFS, heading_column
from shadowpuppet.camera.bits import Bits, count
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.keypoints.front import CERTAIN
from shadowpuppet.tracking.multiview.keypoint_evidence import KeypointEvidence
from shadowpuppet.tracking.multiview.observation import Halves
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import gathered
from shadowpuppet.tracking.people.evidence import (
    Division,
    Drawn,
    PersonObservation,
    chosen_of,
    draw_person,
    ignored_pixels,
    other_keypoints,
    own_keypoints,
    predicted,
)
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.recovery import settle

TOUCHING = 0.25
"""Distance of two people's bodies below which they are estimated twice in a frame: the second time on evidence divided by the first."""
SIDED = 0.2
"""Least difference in overlap, in one frame, between a body and the same turned round that tells the front from the back, over what the
better one lacks of an overlap of 1: silhouettes that no body fits well tell little."""
VIEWS = 3
"""Number of views that must show most of a person apart from others for sizes to be measured."""
SHOWN, SIDE = 0.6, np.radians(45)
"""Least share of the drawn body that a view shows apart from other people; least angle (rad) from the front or the back of a view from the
side."""
SAME_PLACE = 0.6
"""Distance (m) on the floor up to which a figure, or surface points about it, may be a person's."""


class Person(NamedTuple):
    """One of several people: how they are tracked, and where they are."""

    tracker: MultiviewTracker
    rng: np.random.Generator
    state: MultiviewState


class Begun(NamedTuple):
    """The first state of a person."""

    state: MultiviewState
    is_sided: bool
    """Whether the silhouettes tell the front from the back."""
    is_shown: bool = False
    """Whether keypoints do."""


class Share(NamedTuple):
    """A person's share of a frame: the new state and the evidence for it."""

    state: MultiviewState
    points: SurfacePoints
    """Surface points that are nearest to this person."""
    masks: list[Mask | None]
    """This person's silhouettes (H, W), one per camera."""
    drawn: Drawn
    """The body in its new pose."""
    ignored: Sequence[Bits | None] = ()
    """Pixels of each camera's picture of half the size that say nothing of this person."""
    keypoints: Sequence[Keypoints | None] = ()
    """This person's keypoints, one per camera; empty without any."""


def step(people: Mapping[int, Person], points: SurfacePoints, masks: Sequence[Mask | None],
         beside: Mapping[int, Drawn] = MappingProxyType({}), keypoints: Sequence[Keypoints | None] = ()) -> dict[int, Share]:
    """The people's states after a frame's surface points, masks (H, W) and `keypoints`, one per camera, of all of them together.

    Each on the evidence that the others' bodies, in their predicted poses, do not explain; people who touch once more, with all bodies as
    found. A lost person's body explains nothing, and has keypoints that nobody else has. Cores share the people: none of them depends on
    another's result. `beside`: other people, whose poses in this frame are known.
    """
    drawn = {n: draw_person(person.tracker, predicted(person.tracker.body, person.state)) for n, person in people.items()}
    lost, halves = {n for n, person in people.items() if person.state.status == "lost"}, Halves.of(masks)
    evidence = Division({**drawn, **beside}, lost, points, masks, halves)

    def of_all(evidence: Division) -> dict[int, tuple[Keypoints | None, ...]]:
        there, away = ({n: body for n, body in evidence.drawn.items() if (n in lost) == is_lost} for is_lost in (False, True))
        any_body = next((person.tracker for person in people.values()), None)
        if any_body is None:
            return {}
        rest = other_keypoints(any_body, there, keypoints) if away else ()
        return own_keypoints(any_body, there, keypoints) | own_keypoints(any_body, away, rest)

    def follow(n: int, evidence: Division) -> tuple[MultiviewState, Drawn]:
        tracker, rng, state = people[n]
        own, ignored = evidence.of(n)
        observation = PersonObservation(tracker.views, own, masks, None, ignored, halves)
        observation.keypoints = tracker.shown(own, masks, theirs.get(n, ()), state.pose)
        state = _judged(tracker.follow(rng, state, observation))
        return state, draw_person(tracker, state.pose)

    theirs = of_all(evidence)
    with ThreadPoolExecutor(max(min(len(people), usable_cores()), 1), "people") as pool:
        found = dict(zip(people, pool.map(lambda n: follow(n, evidence), people)))
        evidence = evidence.with_bodies({n: body for n, (_, body) in found.items()})
        if close := [n for n in touching(evidence.drawn) if n in people]:
            theirs = of_all(evidence)
            found |= dict(zip(close, pool.map(lambda n: follow(n, evidence), close)))
            evidence = evidence.with_bodies({n: found[n][1] for n in close})
        own = dict(zip(people, pool.map(evidence.share, people)))
    shares = dict[int, Share]()
    for n, (state, body) in found.items():
        own_points, own_silhouettes, ignored = own[n]
        shares[n] = Share(state, own_points, own_silhouettes, body, ignored, theirs.get(n, ()))
    return shares


def start(person: MultiviewTracker, rng: np.random.Generator, figure: Figure, drawn: Mapping[int, Drawn], points: SurfacePoints,
          masks: Sequence[Mask | None], keypoints: Sequence[Keypoints | None] = ()) -> Begun | None:
    """The first state of a person at the place of a figure, beside those who are `drawn`; None if there are too few points. Points,
    masks (H, W) and `keypoints` as in `step`."""
    if figure.people:
        return _start_by_keypoints(person, rng, points, masks, chosen_of(keypoints, figure.people))
    mine = np.linalg.norm(points.points[:, :2] - figure.place, axis=1) < SAME_PLACE
    for other in drawn.values():
        mine &= other.distances(points.points) > 0.05
    own = points.picked(mine)
    if not person.is_present(PersonObservation(person.views, own, masks)):
        return None
    rough = person.search(rng, PersonObservation(person.views, own, [None] * len(masks)))  # the points alone: where the person is
    body = draw_person(person, rough.pose)
    observation = PersonObservation(person.views, own, masks, left_out=ignored_pixels(body, list(drawn.values()), masks))
    observation.keypoints = person.shown(own, masks, own_keypoints(person, {**drawn, 0: body}, keypoints).get(0, ()))
    found = person.search(rng, observation)
    if observation.keypoints is not None and observation.keypoints.toward(found.pose) > CERTAIN:
        return Begun(_judged(found), is_sided=False, is_shown=True)
    # beside others front and back hardly differ: both are tried
    other = _facing_the_other_way(person, rng, found, observation)
    best = max(found, other, key=lambda state: np.nan_to_num(state.overlap))
    share = Share(best, own, list(masks), draw_person(person, best.pose), observation.left_out)
    return Begun(_judged(best), tells_front(found.overlap, other.overlap) and shows_side(person, share))


def _start_by_keypoints(person: MultiviewTracker, rng: np.random.Generator, points: SurfacePoints, masks: Sequence[Mask | None],
                        keypoints: Sequence[Keypoints | None]) -> Begun | None:
    """The first state of a person by `keypoints` of theirs alone; None if too few cameras show them."""
    observation = PersonObservation(person.views, points, masks)
    observation.keypoints = person.shown(points, masks, keypoints)
    if not person.is_present(observation) or observation.keypoints is None:
        return None
    found = person.search(rng, observation)
    return Begun(_judged(found), is_sided=False, is_shown=observation.keypoints.toward(found.pose) > CERTAIN)


def tells_front(overlap: float, other: float) -> bool:
    """Whether the overlaps of a body and of the same facing the other way tell the front from the back."""
    return bool(abs(overlap - other) >= SIDED * (1 - max(overlap, other)))


def turn_round(person: MultiviewTracker, rng: np.random.Generator, share: Share) -> MultiviewState:
    """The person of a share facing the other way, fitted to the same evidence."""
    return _judged(_facing_the_other_way(person, rng, share.state, observed(person, share)))


def follow_turned(person: MultiviewTracker, rng: np.random.Generator, state: MultiviewState, share: Share) -> MultiviewState:
    """The state after one of the body turned round, from the evidence of a share."""
    return _judged(person.cycle(rng, state, observed(person, share._replace(state=state))))


def views_apart(share: Share) -> list[int]:
    """Indices of the cameras that show most of a person's body where no other person's is."""
    return [n for n, (body, ignored) in enumerate(zip(share.drawn.bits, share.ignored))
            if ignored is not None and body.any() and count(body & ~ignored) >= SHOWN * count(body)]  # fmt: skip


def is_shown(share: Share) -> bool:
    """Whether enough views show most of a person apart from others: three, or all of fewer cameras."""
    return len(views_apart(share)) >= min(VIEWS, len(share.drawn.bits))


def shows_side(person: MultiviewTracker, share: Share) -> bool:
    """Whether a camera shows a person from the side, apart from others: outlines of people seen from before and behind do not differ."""
    x, y, _, heading = share.state.pose[person.body.skeleton.dof_indices(GLOBAL_DOFS)].tolist()
    ways = [person.cameras[n].centre[:2] - (x, y) for n in views_apart(share)]
    return any(abs(way @ (np.cos(heading), np.sin(heading))) < np.cos(SIDE) * np.linalg.norm(way) for way in ways)


def observed(person: MultiviewTracker, share: Share) -> PersonObservation:
    """What a share shows of a person, as it was followed."""
    observation = PersonObservation(person.views, share.points, share.masks, left_out=share.ignored)
    observation.keypoints = shown_of(person, share)
    return observation


def shown_of(person: MultiviewTracker, share: Share) -> KeypointEvidence | None:
    """What a share's keypoints say of a person; None without any."""
    return person.shown(share.points, share.masks, share.keypoints, share.state.pose) if share.keypoints else None


def _facing_the_other_way(person: MultiviewTracker, rng: np.random.Generator, state: MultiviewState,
                          observation: PersonObservation) -> MultiviewState:
    """The state of the body facing the other way: of the same pose turned round, or searched for, whichever fits better; lost if both come
    round again."""
    heading, seed = heading_column(person.body.skeleton), int(rng.integers(2**63))  # one generator for each thread
    with ThreadPoolExecutor(min(2, usable_cores()), "other way") as pool:
        search = pool.submit(person.search, np.random.default_rng(seed), observation, float(state.pose[heading]) + np.pi)
        turned = settle(_turned_round(person, state), lambda other: person.cycle(rng, other, observation))
        found = search.result()
    other = [each for each in (turned, found) if np.cos(each.pose[heading] - state.pose[heading]) < 0]
    return max(other, key=lambda each: np.nan_to_num(each.overlap)) if other else turned._replace(status="lost", overlap=0.0)


def _turned_round(person: MultiviewTracker, state: MultiviewState) -> MultiviewState:
    """A state with the body turned to face the other way; the arms and legs of one side are those of the other."""
    skeleton = person.body.skeleton
    pose = state.pose[other_side(skeleton.dof_names)]
    pose[heading_column(skeleton)] += np.pi
    return at_pose(person, state, pose)


def at_pose(tracker: MultiviewTracker, state: MultiviewState, pose: Array) -> MultiviewState:
    """A state at rest in a pose (D,)."""
    return state._replace(pose=pose, velocity=np.zeros_like(pose), particles=gathered(pose, tracker.number))


def touching(drawn: Mapping[int, Drawn]) -> list[int]:
    """Numbers of the people whose bodies are nearly in touch with another's."""
    close = set[int]()
    for n, one in drawn.items():
        for m, other in drawn.items():
            if m > n and float((one.distances(other.centres) - other.radii).min()) < TOUCHING:
                close |= {n, m}
    return sorted(close)


def explained(drawn: Mapping[int, Drawn]) -> list[Mask]:
    """Pixels (H / 2, W / 2) of each camera that people's bodies explain; empty without people."""
    return [np.logical_or.reduce(masks) for masks in zip(*(one.masks_near() for one in drawn.values()))]


def _judged(state: MultiviewState) -> MultiviewState:
    """A state with the status of a person among others: hidden by them is uncertain, and without evidence lost, not absent."""
    if state.status == "absent":
        return state._replace(status="lost", overlap=0.0)
    return state._replace(status="uncertain", overlap=0.0) if np.isnan(state.agreement) else state


def place_of(body: Body, state: MultiviewState) -> Array:
    """Where a person is on the floor plan, of shape (2,), metres: the root of the body."""
    return np.asarray(state.pose[body.skeleton.dof_indices(GLOBAL_DOFS[:2])], float)
