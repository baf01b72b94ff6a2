"""Hypotheses of who is in pictures: sizes, place and poses as vectors, drawn around the best (the inner loop of Algorithm 1)."""

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
MAY_BE_NEGATIVE = ("neck_gap", "shoulder_inset")
CROTCH_GAP = 1 / 80
"""Rows, as a share of the picture's, in which a gap between the legs must be seen: one may be noise."""


@dataclass(frozen=True, eq=False)
class PersonEstimate:
    """A person's sizes and place, as far as they are known."""

    sizes: Sizes
    """Of an upper body, or of a whole one."""
    height: float
    """Of the person, metres, shoes on."""
    distance: float
    """From the camera to the middle of the body, horizontally, metres."""
    elevation: float
    """Of the torso's lower edge, or of a whole body's pelvis, over the camera, metres."""

    def picture(self, camera: Camera, body: str | Make = "rounded") -> Picture:
        """How the camera sees this person: a body by name, or made by a function of the sizes."""
        return Picture(make_body(body, self.sizes), camera, place(camera, self.distance, self.elevation))


class Unknowns(NamedTuple):
    """What a vector holds; or, of a vector of places, where in it that is."""

    sizes: NDArray[Any]
    """Of shape (N, 18), metres."""
    shift: NDArray[Any]
    """How far the body is from where it was guessed, toward the camera and up, of shape (N, 2), metres."""
    poses: NDArray[Any]
    """In each picture, of shape (N, K, D)."""

    @classmethod
    def of(cls, vectors: NDArray[Any], dofs: int) -> Unknowns:
        """Vectors (N, 20 + K D) taken apart: views, so that what is written into these is written into the vectors."""
        sizes, shift, poses = np.split(vectors, [len(SIZE_NAMES), len(SIZE_NAMES) + 2], axis=1)
        return cls(sizes, shift, poses.reshape(len(vectors), -1, dofs))


class LinearBodies:
    """Many people at once: joints and shapes of a body are linear in the sizes, so that none need be built for each hypothesis."""

    def __init__(self, body: str | Make) -> None:
        """`body`: the name of an upper body, or a function of the 18 sizes. Raises `ShadowPuppetError` for one that is not linear in them."""
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
        """Eq. 2 (N,), pixels, of poses (N, D) with sizes (N, 18), moved by `shift` (N, 2) along the X and Z of the body's frame."""
        picture = Picture(self.body, camera, T_camera_base)
        offsets, *arrays = (np.ascontiguousarray(np.tensordot(sizes, slope, 1), float) for slope in self.slopes)
        offsets[:, 0, [0, 2]] += shift
        every = np.arange(len(self.body.parts))
        added = picture.added(poses, every, observation.silhouette, observation.ignore, measures=(offsets, *arrays))
        return observation.area + added.astype(float)


class SizeSearch:
    """Sizes, place and poses of one person in several pictures as one vector, some of which are drawn at a time."""

    def __init__(self, camera: Camera, masks: Sequence[Mask], poses: Array, guess: PersonEstimate, prior: SizePrior,
                 settings: InitializationSettings, body: str | Make) -> None:
        """Masks (H, W) of K pictures, and the guess and poses (K, D) to begin with."""
        self.camera, self.masks, self.guess, self.prior = camera, masks, guess, prior
        scale = pixel_scale(camera.size)
        self.weight, self.strain = settings.prior_weight * scale, settings.posture_weight * scale
        self.bodies, self.body = LinearBodies(body), body
        self.T_camera_base = place(camera, guess.distance, guess.elevation)
        self.dofs = poses.shape[1]
        self.vector = np.concatenate([guess.sizes.to_array(), np.zeros(2), poses.ravel()])
        self.places = Unknowns.of(np.arange(len(self.vector))[None], self.dofs)
        self.limits = self.bodies.body.skeleton.limits

    def columns(self, sizes: Sequence[str], *, distance: bool = False) -> NDArray[np.int64]:
        """Places in the vector of some sizes and of the body's place."""
        toward, up = self.places.shift[0]
        return np.array([*(self.places.sizes[0, SIZE_NAMES.index(name)] for name in sizes), *([toward] if distance else []), up])

    def pose_columns(self, picture: int, dofs: NDArray[np.int64]) -> NDArray[np.int64]:
        """Places in the vector of some DOF of a picture's pose."""
        return self.places.poses[0, picture, dofs]

    @property
    def best(self) -> Unknowns:
        """The vector as it stands, taken apart; N is 1."""
        return Unknowns.of(self.vector[None], self.dofs)

    def poses(self) -> Array:
        """Poses (K, D) as they stand."""
        return self.best.poses[0]

    def current(self) -> PersonEstimate:
        """Sizes and place as they stand."""
        sizes, (toward, up) = self.best.sizes[0], self.best.shift[0].tolist()
        return replace(self.guess, sizes=CardboxSizes.from_array(sizes), distance=self.guess.distance - toward,
                       elevation=self.guess.elevation + up)

    def observe(self) -> list[Observation]:
        """The pictures, less the legs under the present guess; but where the crotch is seen, it counts."""
        picture, out = self.current().picture(self.camera, self.body), []
        for mask, pose in zip(self.masks, self.poses(), strict=True):
            legs = picture.legs(pose)
            out.append(Observation.of(mask, mask & legs & ~_above_crotch(mask, legs, picture.legs(pose, spread=0.0))))
        return out

    def costs(self, vectors: Array, pictures: Sequence[int], observations: Sequence[Observation]) -> Array:
        """Cost (N,) of vectors (N, ...) in some pictures, and the prior's pull."""
        sizes, shift, poses = Unknowns.of(vectors, self.dofs)
        total = self.weight * self.prior.penalty(sizes)
        for k in pictures:
            total += self.strain * self.bodies.body.skeleton.posture_penalty(poses[:, k])
            total += self.bodies.costs(self.camera, self.T_camera_base, observations[k], poses[:, k], sizes, shift)
        return total

    def search(self, rng: np.random.Generator, columns: NDArray[np.int64], pictures: Sequence[int], settings: InitializationSettings,
               sigma: float, scale: bool = True) -> list[float]:
        """The inner loop of Algorithm 1: draw `columns` around the best so far until its cost settles; returns the cost by round."""
        observations = self.observe()
        best, least, curve = self.vector, np.inf, []
        for _ in range(settings.rounds):
            vectors = np.repeat(best[None], settings.hypotheses, axis=0)
            noise = rng.standard_normal((settings.hypotheses - 1, len(columns))) * sigma
            vectors[1:, columns] += noise * (rng.random(noise.shape) < settings.share)
            if scale:
                self.scale(vectors, best)
            self.bound(vectors)
            costs = self.costs(vectors, pictures, observations)
            best, least = vectors[np.argmin(costs)], min(float(costs.min()), least)
            curve.append(least)
            sigma *= settings.shrink
            if len(curve) > settings.patience and least > (1 - settings.tolerance) * curve[-1 - settings.patience]:
                break
        self.vector = best
        return curve

    def scale(self, vectors: Array, best: Array) -> None:
        """Who stands farther away than in the vector `best` is taller: sizes and place grow with the distance, the picture stays as it is.

        It tells the distance only through the prior; without this, a search would have to change all sizes at once.
        """
        sizes, shift, poses = Unknowns.of(vectors, self.dofs)
        factor = (self.guess.distance - shift[:, 0]) / (self.guess.distance - Unknowns.of(best[None], self.dofs).shift[0, 0])
        sizes *= factor[:, None]
        shift[:, 1] = factor * (self.guess.elevation + shift[:, 1]) - self.guess.elevation
        poses[:, :, self.bodies.body.skeleton.dof_indices(["torso_y"])] *= factor[:, None, None]

    def bound(self, vectors: Array) -> None:
        """Sizes of vectors (N, ...) stay positive (only the gap and the inset may not be), poses within their limits."""
        sizes, _, poses = Unknowns.of(vectors, self.dofs)
        np.clip(sizes, [-0.15 if name in MAY_BE_NEGATIVE else 0.01 for name in SIZE_NAMES], 1.5, out=sizes)
        np.clip(poses, *self.limits, out=poses)

    def overlaps(self) -> list[float]:
        """Intersection over union in every picture."""
        picture = self.current().picture(self.camera, self.body)
        return [seen.cost_and_overlap(picture.draw(pose))[1] for seen, pose in zip(self.observe(), self.poses(), strict=True)]


def _above_crotch(mask: Mask, legs: Mask, under: Mask) -> Mask:
    """What counts of a mask (H, W) though legs may be there: under the hem, in the middle, down to the crotch; nothing where none is seen.

    A crotch is seen where for some rows there is a leg to the left, a leg to the right and nothing between them. `legs` and `under`
    are where legs may be, and what is straight under the hem.
    """
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
