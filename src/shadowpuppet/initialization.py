"""A person's sizes and place: by published body proportions, and from silhouettes in known postures (Liu 2011, Algorithm 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.anthropometry import AVERAGE_HEIGHT, SizePrior, sizes_from_height
from shadowpuppet.body import BODIES
from shadowpuppet.camera import Camera
from shadowpuppet.errors import TrackingError, choices
from shadowpuppet.first_pose import search
from shadowpuppet.geometry import Array
from shadowpuppet.likelihood import Observation
from shadowpuppet.rasterize import Picture, count, place
from shadowpuppet.settings import InitializationSettings
from shadowpuppet.sizes import SUBSETS, CardboxSizes

Mask = NDArray[np.bool_]

POSTURES: Mapping[str, Mapping[str, float]] = {
    "front_t_pose": {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2},
    "side_arms_hanging": {"torso_twist": np.pi / 2},
    "front_arms_t_pose": {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2},
}
"""The known postures d_ref of the reference pictures, for O1, O2 and O3 in this order."""


@dataclass(frozen=True, eq=False)
class Guess:
    """A person's sizes and place, as far as they are known."""

    sizes: CardboxSizes
    height: float
    """Of the person, metres, shoes on."""
    distance: float
    """From the camera to the middle of the body, horizontally, metres."""
    elevation: float
    """Of the torso's lower edge over the camera, metres."""

    def picture(self, camera: Camera, body: str = "rounded") -> Picture:
        """How the camera sees this person."""
        return Picture(BODIES[body](self.sizes), camera, place(camera, self.distance, self.elevation))


@dataclass(frozen=True, eq=False)
class Fit:
    """A guess after it was fitted to pictures."""

    guess: Guess
    curves: Mapping[str, tuple[float, ...]]
    """For each subset of sizes, the least cost (pixels) after every round."""
    overlaps: Mapping[str, float]
    """For each picture, intersection over union of the drawn body and the silhouette, legs left out."""
    poses: Array
    """Poses (K, D) of the pictures."""


class _Bodies:
    """Many people at once: joints and shapes of a body are linear in the sizes, so that none need be built for each hypothesis."""

    def __init__(self, name: str) -> None:
        base = np.full(len(CardboxSizes.names()), 0.1)
        self.make = BODIES[name]
        self.body = self.make(CardboxSizes.from_array(base))
        self.slopes: list[Array] = []
        still, step = self._measures(base), 0.01
        moved = [self._measures(base + step * unit) for unit in np.eye(len(base))]
        for i, array in enumerate(still):
            self.slopes.append(np.array([measures[i] - array for measures in moved]) / step)

    def _measures(self, sizes: Array) -> tuple[Array, ...]:
        body = self.make(CardboxSizes.from_array(sizes))
        return np.array([joint.offset for joint in body.skeleton.joints]), *body.shapes.arrays

    def costs(self, camera: Camera, root: Array, observation: Observation, poses: Array, sizes: Array, shift: Array) -> Array:
        """Eq. 2 (N,), pixels, of poses (N, D) with sizes (N, 18), the base moved by `shift` (N, 2) along X and Z."""
        picture, skeleton = Picture(self.body, camera, root), self.body.skeleton
        offsets, *arrays = (np.ascontiguousarray(np.tensordot(sizes, slope, 1), float) for slope in self.slopes)
        offsets[:, 0, [0, 2]] += shift
        transforms = np.empty((len(poses), len(skeleton.joints), 3, 4))
        skeleton.forward_some(np.ascontiguousarray(poses), np.arange(len(skeleton.joints)), transforms, root, offsets)
        added = picture.added(transforms, np.arange(len(self.body.parts)), observation.silhouette, observation.ignore, tuple(arrays))
        return observation.area + added[:, 0] - 2.0 * added[:, 1]


class _Hypotheses:
    """Sizes, place and poses of one person in several pictures as one vector, some of which are drawn at a time."""

    def __init__(self, camera: Camera, masks: Sequence[Mask], poses: Array, guess: Guess, prior: SizePrior,
                 settings: InitializationSettings, body: str) -> None:
        self.camera, self.masks, self.guess, self.prior = camera, masks, guess, prior
        scale = camera.size[0] * camera.size[1] / (320 * 240)  # settings in pixels are for 320 x 240
        self.weight, self.strain = settings.prior_weight * scale, settings.posture_weight * scale
        self.bodies, self.body = _Bodies(body), body
        self.root = place(camera, guess.distance, guess.elevation)
        self.n, (self.k, self.d) = len(CardboxSizes.names()), poses.shape
        self.vector = np.concatenate([guess.sizes.to_array(), np.zeros(2), poses.ravel()])
        self.low, self.high = self.bodies.body.skeleton.limits

    def columns(self, sizes: Sequence[str], *, distance: bool = False) -> NDArray[np.int64]:
        """Places in the vector of some sizes and of the body's place."""
        names = CardboxSizes.names()
        return np.array([*(names.index(name) for name in sizes), *([self.n] if distance else []), self.n + 1])

    def pose_columns(self, picture: int, dofs: NDArray[np.int64]) -> NDArray[np.int64]:
        """Places in the vector of some DOF of a picture's pose."""
        return self.n + 2 + picture * self.d + dofs

    def observe(self) -> list[Observation]:
        """The pictures, less the legs under the present guess; but where the crotch is seen, it counts."""
        picture, out = self.current().picture(self.camera, self.body), []
        for mask, pose in zip(self.masks, self.poses(), strict=True):
            legs = picture.legs(pose)
            between = picture.legs(pose, spread=0.0) & _middle(legs)
            parted = (between.any(1) & ~(mask & between).any(1)).any()
            out.append(Observation.of(mask, mask & (legs & ~between if parted else legs)))
        return out

    def poses(self) -> Array:
        """Poses (K, D) as they stand."""
        return self.vector[self.n + 2 :].reshape(self.k, self.d)

    def current(self) -> Guess:
        """Sizes and place as they stand."""
        dx, dz = self.vector[self.n : self.n + 2]
        return replace(self.guess, sizes=CardboxSizes.from_array(self.vector[: self.n]), distance=self.guess.distance - dx,
                       elevation=self.guess.elevation + dz)

    def costs(self, vectors: Array, pictures: Sequence[int], observations: Sequence[Observation]) -> Array:
        """Cost (N,) of vectors (N, ...) in some pictures, and the prior's pull."""
        sizes, shift = vectors[:, : self.n], vectors[:, self.n : self.n + 2]
        poses = vectors[:, self.n + 2 :].reshape(len(vectors), self.k, self.d)
        total = self.weight * self.prior.penalty(sizes)
        for k in pictures:
            total += self.strain * self.bodies.body.skeleton.strain(poses[:, k])
            total += self.bodies.costs(self.camera, self.root, observations[k], poses[:, k], sizes, shift)
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
                self._scale(vectors, best)
            self._bound(vectors)
            costs = self.costs(vectors, pictures, observations)
            best, least = vectors[np.argmin(costs)], min(float(costs.min()), least)
            curve.append(least)
            sigma *= settings.shrink
            if len(curve) > settings.patience and least > (1 - settings.tolerance) * curve[-1 - settings.patience]:
                break
        self.vector = best
        return curve

    def _scale(self, vectors: Array, of: Array) -> None:
        """Who stands farther away is taller: sizes and place grow with the distance, so that the picture stays as it is.

        The picture tells the distance only through the prior; without this, a search would have to change all sizes at once.
        """
        factor = (self.guess.distance - vectors[:, self.n]) / (self.guess.distance - of[self.n])
        vectors[:, : self.n] *= factor[:, None]
        vectors[:, self.n + 1] = factor * (self.guess.elevation + vectors[:, self.n + 1]) - self.guess.elevation
        sideways = self.bodies.body.skeleton.dof_indices(["torso_y"])
        vectors[:, [self.pose_columns(k, sideways)[0] for k in range(self.k)]] *= factor[:, None]

    def _bound(self, vectors: Array) -> None:
        """Sizes stay positive (only the gap and the inset may not be), poses within their limits."""
        names = CardboxSizes.names()
        free = [names.index("neck_gap"), names.index("shoulder_inset")]
        least = np.full(self.n, 0.01)
        least[free] = -0.15
        np.clip(vectors[:, : self.n], least, 1.5, out=vectors[:, : self.n])
        poses = vectors[:, self.n + 2 :].reshape(len(vectors), self.k, self.d)
        np.clip(poses, self.low, self.high, out=poses)

    def overlaps(self) -> list[float]:
        """Intersection over union in every picture."""
        picture, out = self.current().picture(self.camera, self.body), []
        for observation, pose in zip(self.observe(), self.poses(), strict=True):
            drawn = picture.draw(pose) & ~observation.ignore
            seen = observation.silhouette & ~observation.ignore
            out.append(count(drawn & seen) / max(count(drawn | seen), 1))
        return out


def _middle(legs: Mask) -> Mask:
    """The columns (H, W) in the middle of the legs, a tenth of their upper edge's width to each side."""
    rows = np.flatnonzero(legs.any(1))
    out = np.zeros_like(legs)
    if len(rows):
        columns = np.flatnonzero(legs[rows[0]])
        centre, half = (columns[0] + columns[-1]) / 2, max((columns[-1] - columns[0]) / 10, 1)
        out[:, max(int(centre - half), 0) : int(centre + half) + 1] = True
    return out


def fit_references(rng: np.random.Generator, camera: Camera, references: Mapping[str, Mask], *, height: float | None = None,
                   distance: float | None = None, body: str = "rounded", settings: InitializationSettings | None = None) -> Fit:
    """Algorithm 1: sizes from masks (H, W) of a person in the known postures `POSTURES`.

    Height (m, shoes on) or distance (m) fixes the scale; the average height is taken without either. The person may stand anywhere
    to the side and the torso's place is found with the sizes. Raises `TrackingError` where a posture is unknown or a mask empty.
    """
    settings = settings or InitializationSettings()
    unknown = set(references) - set(POSTURES)
    if unknown or not references:
        raise TrackingError(f"references: found {choices(references)}; the known postures are: {choices(POSTURES)}")
    for name, mask in references.items():
        if not mask.any():
            raise TrackingError(f"references: {name}: the silhouette is empty")
    names = [name for name in POSTURES if name in references]
    masks = [references[name] for name in names]
    guess = _first_guess(camera, names, masks, height, distance)
    skeleton = BODIES["cardbox"](guess.sizes).skeleton
    poses = np.array([skeleton.pose(**POSTURES[name]) for name in names])
    side = skeleton.dof_indices(["torso_y"])
    for k, mask in enumerate(masks):
        head = np.flatnonzero(mask[: np.flatnonzero(mask.any(1))[0] + max(mask.shape[0] // 20, 3)].any(0))
        poses[k, side] = (head.mean() - camera.matrix[0, 2]) / camera.matrix[0, 0] * guess.distance
    hypotheses = _Hypotheses(camera, masks, poses, guess, SizePrior(guess.height), settings, body)
    curves: dict[str, list[float]] = {subset: [] for subset in SUBSETS}
    view_of = dict(zip(SUBSETS, POSTURES, strict=True))
    for sweep in range(settings.sweeps):
        for subset, sizes in SUBSETS.items():
            view = view_of[subset] if view_of[subset] in names else None
            if view is None and subset == "O3" and "front_t_pose" in names:  # both show the same shape
                view = "front_t_pose"
            if view is None:
                continue
            k = names.index(view)
            free = [*sizes, *(SUBSETS["O3"] if subset == "O1" and sweep else ())]
            columns = np.concatenate([hypotheses.columns(free, distance=distance is None and subset != "O2"),
                                      hypotheses.pose_columns(k, side)])
            curves[subset] += hypotheses.search(rng, columns, [k], settings, settings.sigma / 2**sweep)
    overlaps = dict(zip(names, hypotheses.overlaps(), strict=True))
    return Fit(hypotheses.current(), {k: tuple(v) for k, v in curves.items() if v}, overlaps, hypotheses.poses().copy())


def find_person(rng: np.random.Generator, camera: Camera, masks: Sequence[Mask], *, height: float | None = None,
                distance: float | None = None, sizes: CardboxSizes | None = None, body: str = "rounded",
                settings: InitializationSettings | None = None) -> Fit:
    """Place and sizes without references, from masks (H, W) of the first seconds in any posture.

    The sizes are the average person's of the height (m, shoes on), or those given; places are tried with coarse poses in the first
    masks; then sizes, place and poses are fitted together, but for sizes that were given. Raises `TrackingError` where there is
    nobody in the masks.
    """
    settings = settings or InitializationSettings()
    seen = [np.asarray(mask, bool) for mask in masks if np.any(mask)]
    if not seen:
        raise TrackingError("nobody is found: the silhouettes of the first seconds are empty")
    guesses = [guess for k in sorted({0, len(seen) // 2}) for guess in _places(camera, seen[k], height, distance, sizes)]
    watched = [seen[k] for k in sorted({0, len(seen) // 2, len(seen) - 1})]
    costs = [sum(search(guess.picture(camera, body), mask).cost for mask in watched) for guess in guesses]
    guess = guesses[int(np.argmin(costs))]
    poses = np.array([search(guess.picture(camera, body), mask).pose for mask in seen])
    return refine(rng, camera, guess, seen, poses, free_sizes=sizes is None, free_distance=distance is None, body=body, settings=settings)


def refine(rng: np.random.Generator, camera: Camera, guess: Guess, masks: Sequence[Mask], poses: Array, *, free_sizes: bool = True,
           free_distance: bool = False, body: str = "rounded", settings: InitializationSettings | None = None) -> Fit:
    """Sizes, place and poses fitted to masks (H, W), in turn, with poses (K, D) to begin with.

    What straight arms do not tell apart (shoulder, upper arm, forearm), bent ones do.
    """
    settings = settings or InitializationSettings()
    hypotheses = _Hypotheses(camera, masks, np.array(poses, float), guess, SizePrior(guess.height), settings, body)
    every, dofs = range(len(masks)), np.arange(poses.shape[1])
    columns = hypotheses.columns(CardboxSizes.names() if free_sizes else (), distance=free_distance)
    curve: list[float] = []
    for sweep in range(settings.sweeps):
        for k in every:
            hypotheses.search(rng, hypotheses.pose_columns(k, dofs), [k], settings, 0.2 / 2**sweep)
        curve += hypotheses.search(rng, columns, every, settings, settings.sigma / 2**sweep, scale=free_sizes)
    overlaps = {str(k): overlap for k, overlap in enumerate(hypotheses.overlaps())}
    return Fit(hypotheses.current(), {"all": tuple(curve)}, overlaps, hypotheses.poses().copy())


def _places(camera: Camera, mask: Mask, height: float | None, distance: float | None, sizes: CardboxSizes | None) -> list[Guess]:
    """People of plausible sizes at plausible places, with the crown at the mask's upper edge or, for raised arms, under it."""
    top = np.flatnonzero(mask.any(1))[0]
    centre = np.flatnonzero(mask.any(0)).mean()
    known = height is not None or sizes is not None or distance is None
    heights: list[float] = [height or AVERAGE_HEIGHT] if known else np.arange(1.0, 2.1, 0.08).tolist()
    distances: list[float] = [distance] if distance is not None else (0.8 * 1.07 ** np.arange(36)).tolist()
    up, out = place(camera, 0.0, 0.0)[:3, 2], []
    ray = camera.rays(np.array([centre, top], float))
    for tall, far in product(heights, distances):
        of = sizes or sizes_from_height(tall)
        crown = of.torso_height + of.neck_gap + of.head_height
        for raised in (0.0, 0.1, 0.25, 0.4):
            out.append(Guess(of, tall, far, float(ray / ray[2] * far @ up) - crown - raised * tall))
    return out


def _first_guess(camera: Camera, names: Sequence[str], masks: Sequence[Mask], height: float | None, distance: float | None) -> Guess:
    """Sizes from the height, and the place where a body of these sizes has its crown where the first mask has."""
    mask, name = masks[0], names[0]
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    focal = camera.matrix[0, 0]
    tall = height or AVERAGE_HEIGHT
    sizes = sizes_from_height(tall)
    reach = sizes.shoulder_width / 2 - sizes.shoulder_inset + sizes.upper_arm_length + sizes.forearm_length
    extent, measure = (columns[-1] - columns[0], 2 * reach) if name != "side_arms_hanging" else (
        rows[-1] - rows[0], sizes.torso_height + sizes.head_height + sizes.neck_gap + sizes.waist_height)
    if distance is not None and height is None:
        tall *= distance * extent / focal / measure
        sizes = sizes_from_height(tall)
    far = distance if distance is not None else focal * measure / max(extent, 1)
    down = camera.rays(np.array([columns.mean(), rows[0]], float))
    up = place(camera, 0.0, 0.0)[:3, 2]
    crown = down / abs(down[2]) * far
    elevation = float(crown @ up) - (sizes.torso_height + sizes.neck_gap + sizes.head_height)
    return Guess(sizes, tall, far, elevation)
