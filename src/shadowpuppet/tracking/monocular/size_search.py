"""Search of a person's sizes, place and poses in several pictures, as one vector drawn around the best (inner loop of Algorithm 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import SizePrior
from shadowpuppet.body.models import MODELS, Make, make_body
from shadowpuppet.body.sizes import CardboxSizes, Sizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import InitializationSettings, pixel_scale
from shadowpuppet.tracking.silhouette_cost import Observation

SIZE_NAMES = CardboxSizes.names()
CROTCH_GAP = 1 / 80
"""Smallest height of a gap between the legs, as a share of the picture's; smaller ones may be noise."""


class Ground(NamedTuple):
    """The floor before a camera."""

    up: Array
    """The vertical (3,) in the camera's frame."""
    eye: float
    """Height of the camera over it, metres."""


@dataclass(frozen=True, eq=False)
class PersonEstimate:
    """Estimate of a person's sizes and place."""

    sizes: Sizes
    """Of an upper body, or of a whole one."""
    height: float
    """Stature, metres, shoes on."""
    distance: float
    """Horizontally from the camera to the middle of the body, metres."""
    elevation: float
    """Of the torso's lower edge, or of a whole body's pelvis, above the camera, metres."""
    ground: Ground | None = None
    """The floor on which a whole person stands; None if it is not known."""

    def picture(self, camera: Camera, body: str | Make = "rounded") -> Picture:
        """The camera's view of this person, as a body by name or made by a function of the sizes."""
        up, floor = (None, None) if self.ground is None else (self.ground.up, -self.ground.eye - self.elevation)
        return Picture(make_body(body, self.sizes), camera, place(camera, self.distance, self.elevation, up), floor)


class SearchVector(NamedTuple):
    """The components of search vectors; or their indices in one."""

    sizes: NDArray[Any]
    """Of shape (N, 18), metres."""
    shift: NDArray[Any]
    """Movement of the body from its initial place toward the camera and up, of shape (N, 2), metres."""
    poses: NDArray[Any]
    """In each picture, of shape (N, K, D)."""

    @classmethod
    def of(cls, vectors: NDArray[Any], dofs: int) -> SearchVector:
        """Vectors (N, 20 + K D) split into views: writing into these writes into the vectors."""
        sizes, shift, poses = np.split(vectors, [len(SIZE_NAMES), len(SIZE_NAMES) + 2], axis=1)
        return cls(sizes, shift, poses.reshape(len(vectors), -1, dofs))


class LinearBodies:
    """Bodies of many people at once: joints and shapes are linear in the sizes, so no body is built per hypothesis."""

    def __init__(self, body: str | Make) -> None:
        """`body`: an upper body's name, or a function of the 18 sizes. Raises `ShadowPuppetError` if it is not linear in them."""
        some, step = np.full(len(SIZE_NAMES), 0.1), 0.01
        self.make = MODELS[body].make if isinstance(body, str) else body
        self.body = self.make(CardboxSizes.from_array(some))
        self.slopes: list[Array] = []
        moved = [self._measures(some + step * unit) for unit in np.eye(len(some))]
        for i, array in enumerate(self._measures(some)):
            self.slopes.append(np.array([measures[i] - array for measures in moved]) / step)
            if not np.allclose(np.tensordot(some, self.slopes[i], 1), array, rtol=0, atol=1e-6):
                raise ShadowPuppetError(f"body {self.body.name!r}: its offsets and shapes must be sums of multiples of the sizes, without "
                                        "constants, powers or bounds: all people's are worked out at once")

    def _measures(self, sizes: Array) -> tuple[Array, ...]:
        body = self.make(CardboxSizes.from_array(sizes))
        return np.array([joint.offset for joint in body.skeleton.joints]), *body.shapes.arrays

    def costs(self, camera: Camera, T_camera_base: Array, observation: Observation, poses: Array, sizes: Array, shift: Array) -> Array:
        """Eq. 2 (N,), pixels, of poses (N, D) with sizes (N, 18), moved by `shift` (N, 2) along X and Z of the body's frame."""
        picture = Picture(self.body, camera, T_camera_base)
        offsets, *arrays = (np.ascontiguousarray(np.tensordot(sizes, slope, 1), float) for slope in self.slopes)
        offsets[:, 0, [0, 2]] += shift
        added = picture.added(poses, picture.every, observation.silhouette, observation.ignore, measures=(offsets, *arrays))
        return observation.area + added.astype(float)


class SizeSearch:
    """Sizes, place and poses of one person in several pictures as one vector; a search draws some of its components."""

    def __init__(self, camera: Camera, masks: Sequence[Mask], poses: Array, initial: PersonEstimate, prior: SizePrior,
                 settings: InitializationSettings, body: str | Make) -> None:
        """Masks (H, W) of K pictures, and the initial estimate and poses (K, D)."""
        self.camera, self.masks, self.initial, self.prior = camera, masks, initial, prior
        scale = pixel_scale(camera.size)
        self.prior_weight, self.posture_weight = settings.prior_weight * scale, settings.posture_weight * scale
        self.bodies, self.body = LinearBodies(body), body
        self.T_camera_base = place(camera, initial.distance, initial.elevation)
        self.dofs = poses.shape[1]
        self.vector = np.concatenate([initial.sizes.to_array(), np.zeros(2), poses.ravel()])
        self.index = SearchVector.of(np.arange(len(self.vector))[None], self.dofs)
        self.limits = self.bodies.body.skeleton.limits

    def columns(self, sizes: Sequence[str], *, distance: bool = False, height: bool = True) -> NDArray[np.int64]:
        """Indices in the vector of some sizes and of the body's place."""
        toward, up = self.index.shift[0]
        place = [column for column, free in ((toward, distance), (up, height)) if free]
        return np.array([*(self.index.sizes[0, SIZE_NAMES.index(name)] for name in sizes), *place])

    def pose_columns(self, picture: int, dofs: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices in the vector of some DOF of a picture's pose."""
        return self.index.poses[0, picture, dofs]

    @property
    def best(self) -> SearchVector:
        """The current vector; N is 1."""
        return SearchVector.of(self.vector[None], self.dofs)

    def poses(self) -> Array:
        """Current poses (K, D)."""
        return self.best.poses[0]

    def estimate(self) -> PersonEstimate:
        """Current sizes and place."""
        sizes, (toward, up) = self.best.sizes[0], self.best.shift[0].tolist()
        return replace(self.initial, sizes=CardboxSizes.from_array(sizes), distance=self.initial.distance - toward,
                       elevation=self.initial.elevation + up)

    def observe(self) -> list[Observation]:
        """One observation per picture without the legs' region under the current estimate, except what `_above_crotch` returns."""
        picture, out = self.estimate().picture(self.camera, self.body), []
        for mask, pose in zip(self.masks, self.poses(), strict=True):
            legs = picture.legs(pose)
            out.append(Observation.of(mask, mask & legs & ~_above_crotch(mask, legs, picture.legs(pose, spread=0.0))))
        return out

    def costs(self, vectors: Array, pictures: Sequence[int], observations: Sequence[Observation]) -> Array:
        """Cost (N,) of vectors (N, ...) in some pictures, with the penalties of sizes and postures."""
        sizes, shift, poses = SearchVector.of(vectors, self.dofs)
        total = self.prior_weight * self.prior.penalty(sizes)
        for k in pictures:
            total += self.posture_weight * self.bodies.body.skeleton.posture_penalty(poses[:, k])
            total += self.bodies.costs(self.camera, self.T_camera_base, observations[k], poses[:, k], sizes, shift)
        return total

    def search(self, rng: np.random.Generator, columns: NDArray[np.int64], pictures: Sequence[int], settings: InitializationSettings,
               sigma: float, scale: bool = True) -> list[float]:
        """The inner loop of Algorithm 1: draw `columns` around the best vector (eq. 4) until its cost settles; returns the cost by
        round."""
        observations, kept = self.observe(), int(settings.memory)
        best, least, curve = self.vector, np.inf, []
        for _ in range(settings.rounds):
            vectors = np.repeat(best[None], settings.hypotheses, axis=0)
            noise = rng.standard_normal((settings.hypotheses - kept, len(columns))) * sigma
            vectors[kept:, columns] += noise * (rng.random(noise.shape) < settings.share)
            if scale:
                self.scale_with_distance(vectors, best)
            self.bound(vectors)
            costs = self.costs(vectors, pictures, observations)
            best, least = vectors[np.argmin(costs)], min(float(costs.min()), least)
            curve.append(least)
            if costs.min() < settings.accuracy * sum(observations[k].area for k in pictures):
                break
            sigma *= settings.shrink
            if len(curve) > settings.patience and least > (1 - settings.tolerance) * curve[-1 - settings.patience]:
                break
        self.vector = best
        return curve

    def scale_with_distance(self, vectors: Array, best: Array) -> None:
        """Scale sizes and height with the distance, relative to the vector `best`, so that the projected silhouette does not change.
        Only the prior then determines the distance; without this, a search would have to change all sizes at once."""
        sizes, shift, poses = SearchVector.of(vectors, self.dofs)
        factor = (self.initial.distance - shift[:, 0]) / (self.initial.distance - SearchVector.of(best[None], self.dofs).shift[0, 0])
        sizes *= factor[:, None]
        shift[:, 1] = factor * (self.initial.elevation + shift[:, 1]) - self.initial.elevation
        poses[:, :, self.bodies.body.skeleton.dof_indices(["torso_y"])] *= factor[:, None, None]

    def bound(self, vectors: Array) -> None:
        """Clip sizes to positive values (gap and inset may be negative) and poses to their limits, in place."""
        sizes, _, poses = SearchVector.of(vectors, self.dofs)
        np.clip(sizes, [-0.15 if name in CardboxSizes.offsets() else 0.01 for name in SIZE_NAMES], 1.5, out=sizes)
        np.clip(poses, *self.limits, out=poses)

    def overlaps(self) -> list[float]:
        """Intersection over union in every picture."""
        picture = self.estimate().picture(self.camera, self.body)
        return [observation.cost_and_overlap(picture.draw(pose))[1] for observation, pose in zip(self.observe(), self.poses(), strict=True)]


def _above_crotch(mask: Mask, legs: Mask, under: Mask) -> Mask:
    """Pixels (H, W) that count although legs may be there: below the hem, in the middle, down to the crotch; none if no crotch is visible.
    A crotch is visible if some rows have a leg to the left, a leg to the right and nothing between. `legs` and `under`: the regions (H, W)
    where legs may be, and straight below the hem."""
    out = np.zeros_like(mask)
    rows = np.flatnonzero(legs.any(1))
    if not len(rows):
        return out
    hem = np.flatnonzero(legs[rows[0]])
    centre, half = (hem[0] + hem[-1]) / 2, max((hem[-1] - hem[0]) / 10, 1)
    left, right = max(int(centre - half), 0), int(centre + half) + 1
    out[:, left:right] = under[:, left:right]
    limbs = mask & legs
    gap = np.all([out.any(1), ~(mask & out).any(1), limbs[:, :left].any(1), limbs[:, right:].any(1)], axis=0)
    length = max(round(CROTCH_GAP * len(mask)), 2)
    runs = np.convolve(gap, np.ones(length), "valid") if length <= len(gap) else np.zeros(0)
    starts = np.flatnonzero(runs == length)
    out[starts[0] if len(starts) else 0 :] = False
    return out
