"""Places of cameras from the outlines of a moving person alone: epipolar tangency of every two cameras in every set, at once.

The outermost planes through two camera centres that touch the person are the same for both cameras (Wong and Cipolla 2001; Sinha and
Pollefeys 2010). Their distances in the pictures are minimised over all cameras' places and directions, robustly, beginning at a rough
calibration, which is also a weak prior: it decides what outlines do not show, the world's frame and scale.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.epipolar_tangency import MAX_ANGULAR_EXTENT
from shadowpuppet.calibration.silhouettes import Row
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, rigid, rotation_from_vector, unit
from shadowpuppet.threads import one_blas_thread

ROUGH_ANGLE, ROUGH_PLACE = np.radians(10.0), 0.5
"""Standard deviations of a rough calibration's directions (rad) and places (m) along each axis."""
ROUGH_FOCAL = 0.05
"""Standard deviation of the logarithm of a focal length that follows from a field of view as stated by a maker."""
LOSS_SCALES = (16.0, 4.0, 1.5)
"""Scales (pixels of a picture 1000 wide) of the soft L1 loss, one after another: first all tangents count, then those of a limb that a
silhouette lacks less and less."""
FAR_PIXELS = 5.0
"""Distance of tangents, pixels of a picture 1000 wide, that is not an outline's noise."""
LEAST_TANGENTS = 30
"""Least number of tangents per camera."""
STEPS, LEAST_GAIN = 40, 1e-6
"""Greatest number of steps with each loss, and the relative decrease that ends them."""
NUDGE = 1e-5
"""Difference of the numeric derivatives, rad, m and share of the focal length."""
TURN, MOVE, FOCAL = slice(0, 3), slice(3, 6), 6
PARAMETERS = FOCAL + 1
"""A camera's increments: a rotation vector and a displacement along its axes, rad and m, and the logarithm of its focal length's factor."""
OUTLINE_ERROR, OUTLINE_SHIFT = 0.5, 10.0
"""Error of an outline that does not change while the person stands still, and the movement of its middle that makes another outline of it,
pixels of a picture 1000 wide."""
BLOCKS = 20
"""Number of parts of the film whose disagreement tells the standard deviations."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TangencyFit:
    """Cameras that were placed by outlines."""

    cameras: tuple[Camera, ...]
    before: Array
    """Median distance of each camera's tangents from the others', of shape (C,), pixels, as calibrated; NaN without any."""
    after: Array
    """The same as placed now."""
    place_sd: Array
    """Standard deviations of the cameras' centres within the rig, of shape (C,), metres: root of the trace."""
    angle_sd: Array
    """The same of their directions, of shape (C,), radians."""
    turn_sd: Array
    """The same about each camera's axes, of shape (C, 3), radians."""
    focal_sd: Array
    """The same of their focal lengths, relative, of shape (C,); 0 where they were given."""
    tangents: int
    """Number of pairs of tangents compared."""
    far: float
    """Share of these that are over `FAR_PIXELS` apart."""


class Hulls(NamedTuple):
    """The convex hull of every silhouette as its camera sees it; the last corner is repeated."""

    rays: Array
    """Unit directions in the camera's frame, of shape (F, K, 3)."""
    firm: NDArray[np.bool_]
    """Whether each lies far from the picture's border, of shape (F, K); none of a silhouette that is missing."""
    focal: float
    """Pixels per radian near the middle, of the lens that `rays` belong to."""


class HullPair(NamedTuple):
    """Two cameras that have silhouettes in the same sets."""

    first: int
    second: int
    sets: NDArray[np.int64]
    """Those in which both have a silhouette, of shape (P,)."""


@one_blas_thread()
def place_by_outlines(cameras: Sequence[Camera], rows: Sequence[Row], free: Sequence[int] | None = None, *,
                      rough: tuple[float, float] = (ROUGH_ANGLE, ROUGH_PLACE), rough_focal: float = 0.0) -> TangencyFit:
    """The cameras whose tangents agree best in sets of silhouettes.

    free: indices of the cameras that may move, by default all. rough: standard deviations of the given directions (rad) and places (m).
    rough_focal: that of the logarithm of the focal lengths; 0: lenses stay as they are. Raises `CalibrationError` if a free camera has too
    few tangents in common with others.
    """
    free = range(len(cameras)) if free is None else free
    hulls = [hulls_of(camera, [row[n] for row in rows]) for n, camera in enumerate(cameras)]
    pairs = pairs_of(hulls)
    found = [signed_distances(cameras, hulls, pair) for pair in pairs]
    _check(cameras, pairs, found, free)
    size = max(max(camera.size) for camera in cameras) / 1000
    value, deviations = np.zeros((len(cameras), PARAMETERS)), np.r_[np.repeat(rough, 3), rough_focal]
    for scale in LOSS_SCALES:
        value = _minimised(cameras, hulls, pairs, value, free, scale * size, deviations)
    now = _moved(cameras, value)
    last = [signed_distances(now, hulls, pair) for pair in pairs]
    sd = _deviations(now, hulls, pairs, last, free, LOSS_SCALES[-1] * size, deviations)
    values = np.concatenate([each[np.isfinite(each)] for each in last])
    return TangencyFit(cameras=tuple(now), before=_medians(len(cameras), pairs, found), after=_medians(len(cameras), pairs, last),
                       place_sd=np.linalg.norm(sd[:, MOVE], axis=1), angle_sd=np.linalg.norm(sd[:, TURN], axis=1), turn_sd=sd[:, TURN],
                       focal_sd=sd[:, FOCAL], tangents=len(values),
                       far=float((np.abs(values) > FAR_PIXELS * size).mean()))


def _check(cameras: Sequence[Camera], pairs: Sequence[HullPair], found: Sequence[Array], free: Sequence[int]) -> None:
    for n in free:
        count = sum(int(np.isfinite(each).sum()) for pair, each in zip(pairs, found) if n in pair[:2])
        if count < LEAST_TANGENTS:
            raise CalibrationError(f"camera {cameras[n].name!r}: found {count} tangents that other cameras see, too, expected at least "
                                   f"{LEAST_TANGENTS}: the person must be whole in the picture more often")


def hulls_of(camera: Camera, silhouettes: Row) -> Hulls:
    """The hulls of one camera's silhouettes."""
    import cv2

    corners = list[tuple[Array, NDArray[np.bool_]]]()
    for each in silhouettes:
        if each is None:
            corners.append((np.array([[0.0, 0.0, 1.0]]), np.zeros(1, bool)))
            continue
        pixels, firm = each.contour
        rays = camera.rays(pixels)
        hull = np.asarray(cv2.convexHull(rays[:, :2].astype(np.float32), returnPoints=False), np.int64).ravel()
        corners.append((rays[hull] / np.linalg.norm(rays[hull], axis=1, keepdims=True), firm[hull]))
    most = max((len(rays) for rays, _ in corners), default=1)
    pad = [(np.concatenate([rays, np.repeat(rays[-1:], most - len(rays), 0)]), np.r_[firm, np.repeat(firm[-1:], most - len(firm))])
           for rays, firm in corners]
    return Hulls(np.array([rays for rays, _ in pad]), np.array([firm for _, firm in pad]), _focal(camera))


def pairs_of(hulls: Sequence[Hulls]) -> list[HullPair]:
    """Every two cameras that have silhouettes in the same sets."""
    return [HullPair(i, j, both) for i, j in combinations(range(len(hulls)), 2)
            if len(both := np.flatnonzero(hulls[i].firm.any(1) & hulls[j].firm.any(1)))]


def _focal(camera: Camera) -> float:
    return float(np.diag(camera.matrix)[:2].mean())


def _rays(camera: Camera, hulls: Hulls, sets: NDArray[np.int64]) -> Array:
    """Directions (P, K, 3) of some sets' hulls in the world, for the camera's own focal length."""
    rays, factor = hulls.rays[sets], hulls.focal / _focal(camera)
    if abs(factor - 1) > 1e-12:
        rays = unit(rays * (factor, factor, 1))
    return rays @ camera.T_camera_world[:3, :3]


def signed_distances(cameras: Sequence[Camera], hulls: Sequence[Hulls], pair: HullPair) -> Array:
    """Signed distances (P, 2) of both pairs of outermost tangents, pixels; NaN at a picture's border, or where a baseline runs through or
    along the person."""
    out = np.full((len(pair.sets), 2), np.nan)
    one, other = (cameras[n] for n in pair[:2])
    line = other.centre - one.centre
    length = float(np.linalg.norm(line))
    if length < 1e-9:
        return out
    line = line / length
    aside = [rays - (rays @ line)[..., None] * line for rays in (_rays(cameras[n], hulls[n], pair.sets) for n in pair[:2])]
    ahead = sum(unit(each.sum(1)) for each in aside)
    ahead = unit(np.where(np.linalg.norm(ahead, axis=1, keepdims=True) > 1e-6, ahead, aside[0].sum(1)))
    up, sets = np.cross(line, ahead), np.arange(len(out))
    angles = [np.arctan2((each * up[:, None]).sum(2), (each * ahead[:, None]).sum(2)) for each in aside]
    usable = np.maximum(*(np.ptp(each, axis=1) for each in angles)) <= MAX_ANGULAR_EXTENT
    for n, pick in enumerate((np.argmin, np.argmax)):
        at = [pick(each, axis=1) for each in angles]
        firm = usable & hulls[pair.first].firm[pair.sets, at[0]] & hulls[pair.second].firm[pair.sets, at[1]]
        lever = sum(hulls[k].focal * np.linalg.norm(each[sets, where], axis=1) for k, each, where in zip(pair[:2], aside, at)) / 2
        out[:, n] = np.where(firm, (angles[0][sets, at[0]] - angles[1][sets, at[1]]) * lever, np.nan)
    return out


def _minimised(cameras: Sequence[Camera], hulls: Sequence[Hulls], pairs: Sequence[HullPair], start: Array, free: Sequence[int],
               scale: float, deviations: Array) -> Array:
    """Increments (C, PARAMETERS) of the cameras, of least loss, by Levenberg's and Marquardt's method with reweighting. deviations:
    (PARAMETERS,) of the prior; what has none stays."""
    value, damping, places = start, 1e-3, _places(free, deviations)
    prior = np.tile(1 / np.square(deviations[deviations > 0]), len(free))
    found = [signed_distances(_moved(cameras, value), hulls, pair) for pair in pairs]
    cost = _loss(found, scale) + float((prior * value.ravel()[places] ** 2).sum()) / 2
    for _ in range(STEPS):
        H, g = _normal(_linearised(cameras, hulls, pairs, value, found, free, deviations), value.size, scale)
        H, g = H[np.ix_(places, places)] + np.diag(prior), g[places] + prior * value.ravel()[places]
        gain = 0.0
        for _ in range(8):
            step = np.linalg.solve(H + damping * np.diag(np.diag(H)), -g)
            tried = value.copy()
            tried.ravel()[places] += step
            new = [signed_distances(_moved(cameras, tried), hulls, pair) for pair in pairs]
            least = _loss(new, scale) + float((prior * tried.ravel()[places] ** 2).sum()) / 2
            if least < cost:
                gain = (cost - least) / cost
                value, found, cost, damping = tried, new, least, max(damping / 10, 1e-9)
                break
            damping *= 10
        if gain < LEAST_GAIN:
            break
    return value


def _places(free: Sequence[int], deviations: Array) -> list[int]:
    """Which of all cameras' increments are solved for."""
    return [PARAMETERS * n + k for n in free for k in np.flatnonzero(deviations).tolist()]


def _loss(found: Sequence[Array], scale: float) -> float:
    """Soft L1 loss of distances, in units of one pixel's square. What cannot be compared costs as much as `scale`: else cameras would be
    placed where little can be."""
    values = np.concatenate([each.ravel() for each in found])
    known = np.nan_to_num(values, nan=scale)
    return float((scale**2 * (np.sqrt(1 + (known / scale) ** 2) - 1)).sum())


class _Linear(NamedTuple):
    """A pair's distances to first order."""

    columns: NDArray[np.int64]
    """Of both cameras' increments, of shape (2 PARAMETERS,)."""
    slopes: Array
    """Of shape (2 PARAMETERS, K), for K known distances."""
    values: Array
    """Of shape (K,), pixels."""
    sets: NDArray[np.int64]
    """Of shape (K,)."""


def _linearised(cameras: Sequence[Camera], hulls: Sequence[Hulls], pairs: Sequence[HullPair], value: Array, found: Sequence[Array],
                free: Sequence[int], deviations: Array) -> Iterator[_Linear]:
    """The distances `found` at increments (C, PARAMETERS) of pairs with a `free` camera and, by differences, their derivatives; 0 by the
    increments of the others, and by those without a deviation in the prior, which stay."""
    now = _moved(cameras, value)
    steps = {k: NUDGE * np.eye(PARAMETERS)[k] for k in np.flatnonzero(deviations).tolist()}
    nudged = {n: {k: _moved_one(cameras[n], value[n] + step) for k, step in steps.items()} for n in free}
    for pair, base in zip(pairs, found):
        moving = [(side, n) for side, n in enumerate(pair[:2]) if n in nudged]
        if not moving:
            continue
        known = np.isfinite(base)
        slopes = np.zeros((2 * PARAMETERS, known.sum()))
        for side, n in moving:
            for k, camera in nudged[n].items():
                there = [*now[:n], camera, *now[n + 1 :]]
                slopes[PARAMETERS * side + k] = np.nan_to_num((signed_distances(there, hulls, pair)[known] - base[known]) / NUDGE)
        columns = np.concatenate([PARAMETERS * n + np.arange(PARAMETERS) for n in pair[:2]])
        yield _Linear(columns, slopes, base[known], np.repeat(pair.sets[:, None], 2, 1)[known])


def _weights(values: Array, scale: float) -> Array:
    """Weights (K,) of squared distances (K,) with which their slope is the soft L1 loss's."""
    return 1 / np.sqrt(1 + (values / scale) ** 2)


def _normal(parts: Iterable[_Linear], size: int, scale: float) -> tuple[Array, Array]:
    """Normal equations (size, size) and gradient (size,) of the loss."""
    H, g = np.zeros((size, size)), np.zeros(size)
    for part in parts:
        weighted = part.slopes * _weights(part.values, scale)
        H[np.ix_(part.columns, part.columns)] += weighted @ part.slopes.T
        g[part.columns] += weighted @ part.values
    return H, g


def _deviations(cameras: Sequence[Camera], hulls: Sequence[Hulls], pairs: Sequence[HullPair], found: Sequence[Array],
                free: Sequence[int], scale: float, deviations: Array) -> Array:
    """Standard deviations (C, PARAMETERS) of the cameras' increments, rad, m and relative, from how much parts of the film
    would move them (a "sandwich" of gradients by blocks of sets: neighbouring silhouettes err together), and at least from an error
    `OUTLINE_ERROR` of every outline that differs from the others: a person who stands still shows few. If all cameras are free, within the
    rig: not of what a motion or a scale of the whole rig changes."""
    size = PARAMETERS * len(cameras)
    parts = list(_linearised(cameras, hulls, pairs, np.zeros((len(cameras), PARAMETERS)), found, free, deviations))
    H, _ = _normal(parts, size, scale)
    sets = max(int(pair.sets[-1]) for pair in pairs) + 1
    blocks = np.zeros((BLOCKS, size))
    for part in parts:
        pulls = part.slopes * _weights(part.values, scale) * part.values
        for k, column in enumerate(part.columns):
            blocks[:, column] += np.bincount(part.sets * BLOCKS // sets, pulls[k], BLOCKS)
    places = _places(free, deviations)
    basis = np.linalg.svd(_whole_rig(cameras)[places].T)[2][7:].T if len(free) == len(cameras) else np.eye(len(places))
    pixels = scale / LOSS_SCALES[-1]
    alike = sets / _distinct(hulls, OUTLINE_SHIFT * pixels) * (OUTLINE_ERROR * pixels) ** 2
    prior = np.diag(np.tile(1 / np.square(deviations[deviations > 0]), len(free)))

    def inverse(noise: float) -> Array:
        return np.asarray(basis @ np.linalg.inv(basis.T @ (H[np.ix_(places, places)] / noise + prior) @ basis) @ basis.T, float)

    within = ((inverse(1.0) @ blocks[:, places].T) ** 2).sum(1) * BLOCKS / (BLOCKS - 1)
    own = np.zeros(size)
    own[places] = np.maximum(within, np.diag(inverse(alike)))
    return np.sqrt(own.reshape(-1, PARAMETERS))


def _distinct(hulls: Sequence[Hulls], shift: float) -> int:
    """Number of sets that differ from all those counted before: in one camera at least the outline's middle is a `shift`, pixels, away."""
    middles = np.stack([each.focal * each.rays.mean(1)[:, :2] for each in hulls], 1)
    middles[~np.stack([each.firm.any(1) for each in hulls], 1)] = np.nan
    kept = list[Array]()
    for middle in middles:
        if all((np.linalg.norm(middle - other, axis=1) > shift).any() for other in kept):
            kept.append(middle)
    return max(len(kept), 1)


def _whole_rig(cameras: Sequence[Camera]) -> Array:
    """Increments (PARAMETERS C, 7) of all cameras by which the rig turns, moves and grows as a whole."""
    columns = []
    for axis in np.eye(3):
        along = [camera.T_camera_world[:3, :3] @ axis for camera in cameras]
        columns.append([np.r_[turn, -np.cross(turn, camera.T_camera_world[:3, 3]), 0] for turn, camera in zip(along, cameras)])
        columns.append([np.r_[np.zeros(3), move, 0] for move in along])
    columns.append([np.r_[np.zeros(3), camera.T_camera_world[:3, 3], 0] for camera in cameras])
    return np.array([np.concatenate(each) for each in columns]).T


def _moved(cameras: Sequence[Camera], value: Array) -> list[Camera]:
    return [_moved_one(camera, own) if own.any() else camera for camera, own in zip(cameras, value)]


def _moved_one(camera: Camera, increment: Array) -> Camera:
    """The camera turned about its centre and then moved, its focal length changed, by increments (PARAMETERS,)."""
    there = rigid(rotation_from_vector(increment[TURN]), increment[MOVE]) @ camera.T_camera_world
    factor = float(np.exp(increment[FOCAL]))
    return replace(camera, T_camera_world=there, matrix=camera.matrix * [factor, factor, 1] if factor != 1 else camera.matrix)


def _medians(count: int, pairs: Sequence[HullPair], found: Sequence[Array]) -> Array:
    own = [np.concatenate([np.abs(each[np.isfinite(each)]) for pair, each in zip(pairs, found) if n in pair[:2]] or [np.zeros(0)])
           for n in range(count)]
    return np.array([np.median(each) if len(each) else np.nan for each in own])
