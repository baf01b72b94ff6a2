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
from shadowpuppet.camera.mask import Mask, grown
from shadowpuppet.camera.rasterize import count
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.tracking.multiview.observation import BodyInViews, MultiviewObservation, half_size
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, free_space
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.unexplained import near

FAR = 0.6
"""Distance (m) from a body beyond which surface points are not that person's."""
OWN_REACH = 0.5
"""Distance beside the drawn body beyond which silhouettes are not that person's, over the square root of its area (some 40 cm)."""
SHOWN = 0.2
"""Least share of the drawn body that a view must show apart from other people to count in the overlap."""


class Drawn(NamedTuple):
    """A person in a pose, among the others."""

    masks: tuple[Mask, ...]
    """The body in each camera's picture of half the size, (H, W) each."""
    centres: Array
    """Centres of spheres along the limbs, world, of shape (K, 3), metres."""
    radii: Array
    """Radii of these spheres, of shape (K,), metres."""

    def distances(self, points: Array) -> Array:
        """Distances (P,), metres, of points (P, 3) from the body; negative inside."""
        out = np.empty(len(points))
        _distances(np.ascontiguousarray(points, float), self.centres, self.radii, out)
        return out


class PersonObservation(MultiviewObservation):
    """What a frame shows of one person among others; views that hardly show them do not count in the overlap."""

    def __init__(self, views: BodyInViews, surface: SurfacePoints, masks: Sequence[Mask | None], left_out: Sequence[Mask | None] = (),
                 drawn: Drawn | None = None) -> None:
        """As `MultiviewObservation`. `drawn`: the person as expected in this frame; free space is computed near them alone."""
        super().__init__(views, surface, masks, None, left_out)
        self.drawn = drawn

    @cached_property
    def space(self) -> FreeSpace:
        """Distances to the silhouettes' outlines, for the silhouette constraint."""
        around = None if self.drawn is None else [self.drawn.masks[n] for n in self.seen]
        return free_space([(picture.camera, mask) for picture, mask in self.people], around)

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
    spheres = tracker.refiner.spheres
    centres = tracker.body.skeleton.points(pose[None], spheres.joints, spheres.places)[0]
    return Drawn(tuple(picture.mask(pose) for picture in tracker.views.pictures), centres, spheres.radii)


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
    known: Mapping[int, Array] = field(default_factory=dict)
    """Distances (P,), metres, of the surface points from some of the bodies."""

    @cached_property
    def distances(self) -> dict[int, Array]:
        """Distances (P,), metres, of the surface points from each body."""
        return {n: self.known[n] if n in self.known else one.distances(self.points.points) for n, one in self.drawn.items()}

    @cached_property
    def near(self) -> dict[int, tuple[Mask, ...]]:
        """Pixels (H / 2, W / 2) of each body, and beside it, in each camera."""
        return {n: pixels_near(one) for n, one in self.drawn.items()} if len(self.drawn) > 1 else {}

    @cached_property
    def small(self) -> list[Mask | None]:
        """The silhouettes at half size."""
        return [None if mask is None else half_size(mask) for mask in self.masks]

    def others(self, n: int) -> list[int]:
        """Numbers of the other people whose bodies explain something."""
        return [m for m in self.drawn if m != n and m not in self.lost]

    def points_of(self, n: int) -> SurfacePoints:
        """The surface points nearest to a person."""
        return picked(self.points, _nearest(self.distances[n], [self.distances[m] for m in self.others(n)]))

    def of(self, n: int) -> tuple[SurfacePoints, list[Mask | None]]:
        """A person's surface points, and the pixels (H / 2, W / 2) of each camera that say nothing of them."""
        others = [(self.drawn[m].masks, self.near[m]) for m in self.others(n)]
        return self.points_of(n), _ignored(self.drawn[n].masks, others, self.small)

    def share(self, n: int) -> tuple[SurfacePoints, list[Mask | None], list[Mask | None]]:
        """A person's surface points, silhouettes (H, W), one per camera, and the pixels (H / 2, W / 2) of each that say nothing of them."""
        points, ignored = self.of(n)
        return points, own_masks(self.drawn[n], self.masks, ignored), ignored

    def with_bodies(self, drawn: Mapping[int, Drawn]) -> Division:
        """The same evidence, divided among other bodies where there are some in `drawn`."""
        known = {n: away for n, away in self.distances.items() if n not in drawn}
        return Division({**self.drawn, **drawn}, self.lost, self.points, self.masks, known)


def picked(surface: SurfacePoints, which: NDArray[np.bool_]) -> SurfacePoints:
    """Some of the surface points, (P,) true or false."""
    points, normals, weights, cameras = surface
    return SurfacePoints(points[which], normals[which], weights[which], cameras[which])


def pixels_near(drawn: Drawn) -> tuple[Mask, ...]:
    """Pixels (H, W) of a body in pictures of half the size, and beside it, one mask per camera; of those that do not show it, none."""
    return tuple(near(mask) if mask.any() else mask for mask in drawn.masks)


def ignored_pixels(drawn: Drawn, others: Sequence[Drawn], masks: Sequence[Mask | None]) -> list[Mask | None]:
    """For each camera the pixels (H / 2, W / 2) that say nothing of a person: where other people are drawn, or what is silhouette far from
    this one. `masks`: silhouettes (H, W)."""
    small = [None if mask is None else half_size(mask) for mask in masks]
    return _ignored(drawn.masks, [(other.masks, pixels_near(other)) for other in others], small)


def _ignored(drawn: Sequence[Mask], others: Sequence[tuple[Sequence[Mask], Sequence[Mask]]],
             small: Sequence[Mask | None]) -> list[Mask | None]:
    """`ignored_pixels` of masks at half size: the body, other bodies with the pixels near them, and the silhouettes."""
    ignored = list[Mask | None]()
    for n, silhouette in enumerate(small):
        if silhouette is None:
            ignored.append(None)
            continue
        out = silhouette & ~_around(drawn[n])
        for body, beside in others:
            out |= beside[n] & (silhouette | body[n])
        ignored.append(out)
    return ignored


def _around(drawn: Mask) -> Mask:
    """Pixels (H, W) about a drawn body in which the person may be in the next frame."""
    if not drawn.any():
        return np.ones_like(drawn)
    return grown(drawn, max(2, round(OWN_REACH * np.count_nonzero(drawn) ** 0.5)))


def own_masks(drawn: Drawn, masks: Sequence[Mask | None], ignored: Sequence[Mask | None]) -> list[Mask | None]:
    """For each camera the silhouette (H, W) of one person: without pixels (H / 2, W / 2) that say nothing of them, unless they are drawn
    there."""
    found = list[Mask | None]()
    for mask, out, body in zip(masks, ignored, drawn.masks):
        if mask is None or out is None:
            found.append(None)
            continue
        own = np.empty_like(mask)
        _own_pixels(mask, out & ~body, own)
        found.append(own)
    return found


@kernel
def _own_pixels(mask, out, own):  # pragma: no cover
    """Fill `own` (H, W) with a mask (H, W) without pixels (H / 2, W / 2)."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            own[y, x] = mask[y, x] and not out[y // 2, x // 2]


@kernel
def _distances(points, centres, radii, out):  # pragma: no cover
    """Fill `out` (P,) with the least distances of points (P, 3) from spheres."""
    for p in range(points.shape[0]):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        least = np.inf
        for k in range(radii.size):
            dx, dy, dz = x - centres[k, 0], y - centres[k, 1], z - centres[k, 2]
            least = min(least, np.sqrt(dx * dx + dy * dy + dz * dz) - radii[k])
        out[p] = least
