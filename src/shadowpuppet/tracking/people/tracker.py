"""Several people tracked together: each by a tracker of their own, on evidence that is divided among them."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import Particles
from shadowpuppet.tracking.people.evidence import (
    Drawn,
    PersonObservation,
    draw_person,
    ignored_pixels,
    nearest_to,
    own_masks,
    picked,
    predicted,
)
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.recovery import settle
from shadowpuppet.tracking.unexplained import near

TOUCHING = 0.25
"""Distance of two people's bodies below which they are estimated twice in a frame: the second time on evidence divided by the first."""
SIDED = 0.01
"""Least difference in overlap between a body and the same turned round that tells the front from the back."""
ROUND_FIGURE = 0.6
"""Distance (m) from a figure up to which surface points are searched for its person."""


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


class Share(NamedTuple):
    """A person's share of a frame: the new state and the evidence for it."""

    state: MultiviewState
    points: SurfacePoints
    """Surface points that are nearest to this person."""
    masks: list[Mask | None]
    """This person's silhouettes (H, W), one per camera."""
    drawn: Drawn
    """The body in its new pose."""


def step(people: Mapping[int, Person], points: SurfacePoints, masks: Sequence[Mask | None]) -> dict[int, Share]:
    """The people's states after a frame's surface points and masks (H, W), one per camera, of all of them together.

    One person after another, each on the evidence that the others' bodies do not explain: bodies updated before in their new poses, the
    rest in their predicted ones. A lost person's body explains nothing.
    """
    drawn = {n: draw_person(person.tracker, predicted(person.tracker.body, person.state)) for n, person in people.items()}
    states, lost = dict[int, MultiviewState](), {n for n, person in people.items() if person.state.status == "lost"}
    for n, person in people.items():
        states[n] = _followed(person, drawn[n], _others(drawn, n, lost), points, masks)
        drawn[n] = draw_person(person.tracker, states[n].pose)
    for n in touching(drawn):
        states[n] = _followed(people[n], drawn[n], _others(drawn, n, lost), points, masks)
        drawn[n] = draw_person(people[n].tracker, states[n].pose)
    shares = dict[int, Share]()
    for n in people:
        others = _others(drawn, n, lost)
        own = picked(points, nearest_to(drawn[n], others, points))
        shares[n] = Share(states[n], own, own_masks(drawn[n], others, masks), drawn[n])
    return shares


def start(person: MultiviewTracker, rng: np.random.Generator, figure: Figure, drawn: Mapping[int, Drawn], points: SurfacePoints,
          masks: Sequence[Mask | None]) -> Begun | None:
    """The first state of a person at the place of a figure, beside those who are `drawn`; None if there are too few points. Points
    and masks (H, W) as in `step`."""
    mine = np.linalg.norm(points.points[:, :2] - figure.place, axis=1) < ROUND_FIGURE
    for other in drawn.values():
        mine &= other.distances(points.points) > 0.05
    own = picked(points, mine)
    rough = PersonObservation(person.views, own, masks)
    if not person.is_present(rough):
        return None
    found = person.search(rng, PersonObservation(person.views, own, [None] * len(masks)))  # the points alone: where the person is
    body = draw_person(person, found.pose)
    observation = PersonObservation(person.views, own, masks, None, ignored_pixels(body, list(drawn.values()), masks))
    found = person.search(rng, observation)  # beside others front and back hardly differ: both are tried
    other = _facing_the_other_way(person, rng, found, observation)
    best = max(found, other, key=lambda state: np.nan_to_num(state.overlap))
    return Begun(_judged(best), bool(abs(found.overlap - other.overlap) >= SIDED))


def turn_round(person: MultiviewTracker, rng: np.random.Generator, share: Share) -> MultiviewState:
    """The person of a share facing the other way, fitted to the same evidence."""
    return _judged(_facing_the_other_way(person, rng, share.state, _observation(person, share)))


def follow_turned(person: MultiviewTracker, rng: np.random.Generator, state: MultiviewState, share: Share) -> MultiviewState:
    """The state after one of the body turned round, from the evidence of a share."""
    return _judged(person.cycle(rng, state, _observation(person, share)))


def _observation(person: MultiviewTracker, share: Share) -> PersonObservation:
    return PersonObservation(person.views, share.points, share.masks)


def _facing_the_other_way(person: MultiviewTracker, rng: np.random.Generator, state: MultiviewState,
                          observation: PersonObservation) -> MultiviewState:
    return settle(_turned_round(person, state), lambda other: person.cycle(rng, other, observation))


def _turned_round(person: MultiviewTracker, state: MultiviewState) -> MultiviewState:
    """A state with the body turned to face the other way; the arms and legs of one side are those of the other."""
    skeleton = person.body.skeleton
    pose = state.pose[other_side(skeleton.dof_names)]
    pose[skeleton.dof_indices(GLOBAL_DOFS[3:])[0]] += np.pi
    still = np.zeros_like(pose)
    particles = Particles(np.repeat(pose[None], person.number, 0), *np.zeros((2, person.number)))
    return state._replace(pose=pose, velocity=still, particles=particles)


def touching(drawn: Mapping[int, Drawn]) -> list[int]:
    """Numbers of the people whose bodies are nearly in touch with another's."""
    close = set[int]()
    for n, one in drawn.items():
        for m, other in drawn.items():
            if m > n and float((one.distances(other.centres) - other.radii).min()) < TOUCHING:
                close |= {n, m}
    return sorted(close)


def explained(drawn: Mapping[int, Drawn], number: int) -> list[Mask]:
    """Pixels (H / 2, W / 2) of each of a `number` of cameras that people's bodies explain; empty without people."""
    if not drawn:
        return []
    return [np.logical_or.reduce([near(one.masks[n]) for one in drawn.values()]) for n in range(number)]


def _others(drawn: Mapping[int, Drawn], n: int, lost: Container[int]) -> list[Drawn]:
    return [other for m, other in drawn.items() if m != n and m not in lost]


def _followed(person: Person, drawn: Drawn, others: Sequence[Drawn], points: SurfacePoints, masks: Sequence[Mask | None]) -> MultiviewState:
    """A person's state after a frame, given how this person and the others are drawn."""
    tracker, state = person.tracker, person.state
    own = picked(points, nearest_to(drawn, others, points))
    observation = PersonObservation(tracker.views, own, masks, None, ignored_pixels(drawn, others, masks))
    return _judged(tracker.follow(person.rng, state, observation))


def _judged(state: MultiviewState) -> MultiviewState:
    """A state with the status of a person among others: hidden by them is uncertain, and without evidence lost, not absent."""
    if state.status == "absent":
        return state._replace(status="lost", overlap=0.0)
    return state._replace(status="uncertain", overlap=0.0) if np.isnan(state.overlap) else state


def place_of(body: Body, state: MultiviewState) -> Array:
    """Where a person is on the floor plan, of shape (2,), metres: the root of the body."""
    return np.asarray(state.pose[body.skeleton.dof_indices(GLOBAL_DOFS[:2])], float)
