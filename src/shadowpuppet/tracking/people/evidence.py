"""Whose pixel: what a frame shows of one person among others.

A silhouette does not tell which of two people who overlap is in front: it says "one of them". So pixels that the other people's bodies
explain are no evidence about this person, neither for nor against them, in whichever order they stand. Surface points belong to the body
that is nearest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.camera.bits import Bits, count, grown_bits, is_set, unpack
from shadowpuppet.camera.keypoints import Keypoints, cameras_with_persons
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.tracking.keypoints.choice import People, people_of
from shadowpuppet.tracking.multiview.observation import Halves, MultiviewObservation
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.unexplained import margin_of

FAR = 0.6
"""Distance (m) from a body beyond which surface points are not that person's."""
OWN_REACH = 0.5
"""Distance beside the drawn body beyond which silhouettes are not that person's, over the square root of its area (some 40 cm)."""
SHOWN = 0.2
"""Least share of the drawn body that a view must show apart from other people to count in the overlap."""


class Drawn(NamedTuple):
    """A person in a pose, among the others."""

    bits: tuple[Bits, ...]
    """The body in each camera's picture of half the size."""
    widths: tuple[int, ...]
    """Of these pictures, pixels."""
    centres: Array
    """Centres of spheres along the limbs, world, of shape (K, 3), metres."""
    radii: Array
    """Radii of these spheres, of shape (K,), metres."""
    landmarks: Array = np.zeros((0, 3))
    """Places of the landmarks that a detector finds, world, of shape (L, 3), metres."""

    def distances(self, points: Array) -> Array:
        """Distances (P,), metres, of points (P, 3) from the body: negative inside, infinite where it is far."""
        out, radii = np.empty(len(points)), self.radii[:, None]
        box = np.concatenate([(self.centres - radii).min(0) - FAR, (self.centres + radii).max(0) + FAR])
        _distances(np.ascontiguousarray(points, float), self.centres, self.radii, box, out)
        return out

    def near(self) -> tuple[Bits, ...]:
        """Pixels of the body, and beside it, in each camera's picture."""
        return tuple(grown_bits(bits, margin_of(count(bits)), width) if bits.any() else bits for bits, width in zip(self.bits, self.widths))

    def masks_near(self) -> list[Mask]:
        """The same as masks (H / 2, W / 2)."""
        return list(map(unpack, self.near(), self.widths))


class PersonObservation(MultiviewObservation):
    """What a frame shows of one person among others; views that hardly show them do not count in the overlap."""

    def overlap(self, pose: Array) -> float:
        """Intersection over union of a drawn pose (D,) and the silhouettes, mean of the views that show the person apart from others."""
        overlaps = list[float]()
        for picture, observation in self.silhouettes:
            drawn = picture.draw(pose)
            if count(drawn & ~observation.ignore) >= SHOWN * max(count(drawn), 1):
                overlaps.append(observation.cost_and_overlap(drawn)[1])
        return float(np.mean(overlaps)) if overlaps else np.nan


def draw_person(tracker: MultiviewTracker, pose: Array) -> Drawn:
    """A person in a pose (D,)."""
    spheres, marks = tracker.refiner.spheres, tracker.refiner.landmarks
    centres, places = (tracker.body.skeleton.points(pose[None], each.joints, each.places)[0] for each in (spheres, marks))
    pictures = tracker.views.pictures
    return Drawn(tuple(picture.draw(pose) for picture in pictures), tuple(picture.camera.size[0] for picture in pictures), centres,
                 spheres.radii, places)  # fmt: skip


def own_keypoints(tracker: MultiviewTracker, drawn: Mapping[int, Drawn],
                  keypoints: Sequence[Keypoints | None]) -> dict[int, tuple[Keypoints | None, ...]]:
    """The keypoints, one per camera, of each of the people who are `drawn`, by number: one person, or none, of those found in a camera;
    empty without keypoints. `tracker`: of any body."""
    return {n: chosen_of(keypoints, own) for n, own in _chosen(tracker, drawn, keypoints).items()}


def chosen_of(keypoints: Sequence[Keypoints | None], people: People) -> tuple[Keypoints | None, ...]:
    """The keypoints, one per camera, of the person of an index in each."""
    return tuple(None if each is None else each.only(person) for each, person in zip(keypoints, people))


def other_keypoints(tracker: MultiviewTracker, drawn: Mapping[int, Drawn],
                    keypoints: Sequence[Keypoints | None]) -> tuple[Keypoints | None, ...]:
    """The keypoints, one per camera, in which nothing is known of the people who are `drawn`; else as `own_keypoints`."""
    chosen = _chosen(tracker, drawn, keypoints)
    taken = zip(*chosen.values()) if chosen else [()] * len(keypoints)
    return tuple(None if each is None else each.without(person for person in people if person is not None)
                 for each, people in zip(keypoints, taken))


def _chosen(tracker: MultiviewTracker, drawn: Mapping[int, Drawn], keypoints: Sequence[Keypoints | None]) -> dict[int, People]:
    if not drawn or not cameras_with_persons(keypoints):
        return {}
    return dict(zip(drawn, people_of([body.landmarks for body in drawn.values()], tracker.cameras, keypoints, tracker.refiner.landmarks)))


def predicted(body: Body, state: MultiviewState) -> Array:
    """The pose (D,) expected in the next frame: the last one, moved on as the body moved."""
    place = body.skeleton.dof_indices(GLOBAL_DOFS[:2])
    pose = state.pose.copy()
    pose[place] += state.velocity[place]
    return pose


def _nearest(own: Array, others: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether each surface point (P,) is near a person, and nearer to them than to the others; distances (P,), metres, from each."""
    mine = own < FAR
    for other in others:
        mine &= own <= other
    return mine


@dataclass(frozen=True, eq=False)
class Division:
    """A frame's evidence, divided among the bodies drawn in it."""

    drawn: Mapping[int, Drawn]
    """The people's bodies, by number."""
    lost: Set[int]
    """Numbers of the people whose bodies explain nothing."""
    points: SurfacePoints
    """Surface points of all people together."""
    masks: Sequence[Mask | None]
    """Silhouettes (H, W) of all people together, one per camera."""
    halves: Halves
    """The same at half size."""
    known: Mapping[int, Array] = field(default_factory=dict)
    """Distances (P,), metres, of the surface points from some of the bodies."""

    @cached_property
    def distances(self) -> dict[int, Array]:
        """Distances (P,), metres, of the surface points from each body."""
        return {n: self.known[n] if n in self.known else one.distances(self.points.points) for n, one in self.drawn.items()}

    @cached_property
    def near(self) -> dict[int, tuple[Bits, ...]]:
        """Pixels of each body that explains something, and beside it, in each camera's picture."""
        return {n: one.near() for n, one in self.drawn.items() if n not in self.lost} if len(self.drawn) > 1 else {}

    def others(self, n: int) -> list[int]:
        """Numbers of the other people whose bodies explain something."""
        return [m for m in self.drawn if m != n and m not in self.lost]

    def points_of(self, n: int) -> SurfacePoints:
        """The surface points nearest to a person."""
        return self.points.picked(_nearest(self.distances[n], [self.distances[m] for m in self.others(n)]))

    def of(self, n: int) -> tuple[SurfacePoints, list[Bits | None]]:
        """A person's surface points, and the pixels of each camera's picture that say nothing of them."""
        others = [(self.drawn[m].bits, self.near[m]) for m in self.others(n)]
        return self.points_of(n), _ignored(self.drawn[n], others, self.halves)

    def share(self, n: int) -> tuple[SurfacePoints, list[Mask | None], list[Bits | None]]:
        """A person's surface points, silhouettes (H, W), one per camera, and the pixels of each that say nothing of them."""
        points, ignored = self.of(n)
        return points, own_masks(self.drawn[n], self.masks, ignored), ignored

    def with_bodies(self, drawn: Mapping[int, Drawn]) -> Division:
        """The same evidence, divided among other bodies where there are some in `drawn`."""
        known = {n: away for n, away in self.distances.items() if n not in drawn}
        return Division({**self.drawn, **drawn}, self.lost, self.points, self.masks, self.halves, known)


def ignored_pixels(drawn: Drawn, others: Sequence[Drawn], masks: Sequence[Mask | None]) -> list[Bits | None]:
    """For each camera the pixels of its picture of half the size that say nothing of a person: where other people are drawn, or what is
    silhouette far from this one. `masks`: silhouettes (H, W)."""
    return _ignored(drawn, [(other.bits, other.near()) for other in others], Halves.of(masks))


def _ignored(drawn: Drawn, others: Sequence[tuple[Sequence[Bits], Sequence[Bits]]], halves: Halves) -> list[Bits | None]:
    """`ignored_pixels` of other bodies with the pixels near them."""
    ignored = list[Bits | None]()
    for n, silhouette in enumerate(halves.bits):
        if silhouette is None:
            ignored.append(None)
            continue
        out = np.zeros_like(silhouette)
        if area := count(drawn.bits[n]):  # where the person may be in the next frame
            out = silhouette & ~grown_bits(drawn.bits[n], max(2, round(OWN_REACH * area**0.5)), drawn.widths[n])
        for body, beside in others:
            out |= beside[n] & (silhouette | body[n])
        ignored.append(out)
    return ignored


def own_masks(drawn: Drawn, masks: Sequence[Mask | None], ignored: Sequence[Bits | None]) -> list[Mask | None]:
    """For each camera the silhouette (H, W) of one person: without pixels of the picture of half the size that say nothing of them, unless
    they are drawn there."""
    found = list[Mask | None]()
    for mask, out, body in zip(masks, ignored, drawn.bits):
        if mask is None or out is None:
            found.append(None)
            continue
        own = np.empty_like(mask)
        _own_pixels(mask, out & ~body, own)
        found.append(own)
    return found


@kernel
def _own_pixels(mask, out, own):  # pragma: no cover
    """Fill `own` (H, W) with a mask (H, W) without pixels of half the size."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            own[y, x] = mask[y, x] and not is_set(out, x >> 1, y >> 1)


@kernel
def _distances(points, centres, radii, box, out):  # pragma: no cover
    """Fill `out` (P,) with the least distances of points (P, 3) from spheres; infinite outside a `box` (6,), its lower and upper corner."""
    for p in range(points.shape[0]):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        least, inside = np.inf, box[0] < x < box[3] and box[1] < y < box[4] and box[2] < z < box[5]
        for k in range(radii.size if inside else 0):
            dx, dy, dz = x - centres[k, 0], y - centres[k, 1], z - centres[k, 2]
            least = min(least, np.sqrt(dx * dx + dy * dy + dz * dz) - radii[k])
        out[p] = least
