"""People as upright figures on the floor: the fewest that explain the silhouettes of all cameras.

Figures are chosen one at a time: always the one that covers most silhouette that no chosen figure covers, less what it covers of pixels
that are no silhouette. A ghost (a place that all cameras see as silhouette by coincidence) is left out, as it covers nothing that is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.models import average_body
from shadowpuppet.body.sizes import HEIGHTS as PEOPLE
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, Seen, half_size, may_be_person
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.keypoints.choice import APART, People, people_between
from shadowpuppet.tracking.keypoints.definitions import Landmarks, landmarks_of
from shadowpuppet.tracking.keypoints.stature import height_between
from shadowpuppet.tracking.people.floor import ASIDE, HEIGHTS, LEGS, TRUNK, Floor, Ground, figure_points, floor_under, pixel_index

NEEDED = 0.65
"""Least evidence for a person, in views: the share of the figure that is silhouette and not another person's, less `EMPTY` times the share
that is no silhouette."""
EMPTY = 2.0
"""Weight of a part of a figure that is no silhouette, over one that is."""
MIN_VIEWS = 2
"""Least number of cameras that have half of the figure's trunk in the picture."""
USUAL, UNUSUAL = 1.7, 0.3
"""Height (m) of people, and what another costs, in views for a metre: so that one whom a single camera shows has a place."""
WIDE, HEAD = 0.22, 0.11
"""Half the width of what a figure explains, at trunk and legs and at the head, metres."""
ROWS = np.array([len(TRUNK), len(LEGS), len(ASIDE)])
NONE, NEW, KNOWN, SHADE = range(4)
"""What a pixel is: no silhouette, silhouette that no body explains, silhouette that may be another's, and what was taken for shadow, which
may be a dark limb."""


TRIED_REACH, TRIED_NEAR = 0.3, 0.5
"""Distance (m) beyond the surface points to which floors reach that are only tried, and greatest distance of their places from a point."""
COARSE, FINE = np.array([-10, 0, 10]), np.arange(-15, 20, 5)
"""Levels (cm) of the floor that are tried about the best so far, one after the other."""
ALIKE, ALIKE_AT_ZERO = 0.95, 0.9
"""Share of the greatest evidence from which a level counts as alike; the same for the world's floor, which by convention is at 0."""


class Figure(NamedTuple):
    """A person's place and size."""

    place: Array
    """On the floor, world, of shape (2,), metres."""
    height: float
    """Metres, from the floor."""
    evidence: float = 0.0
    """In views, see `NEEDED`."""
    people: People = ()
    """Index of the person in each camera's keypoints; empty: found in silhouettes."""


def find_people(floor: Floor, seen: Seen, explained: Sequence[Mask | None] = ()) -> list[Figure]:
    """The people in one frame set, the most certain first.

    What was taken for shadow may be dark legs, and is no evidence, neither for people nor against them; nor is silhouette in pixels
    (H / 2, W / 2), by camera, that people who are known already explain, `explained`. Without silhouettes people are found in keypoints.
    """
    if all(mask is None for mask in seen.masks):
        return _find_by_keypoints(floor.cameras, seen.keypoints)
    state, used = _states(seen, explained)
    scores = np.full((len(floor.places), len(HEIGHTS)), -np.inf)
    unusual = UNUSUAL * np.abs(np.array(HEIGHTS) - USUAL)
    left, found = np.arange(len(scores)), list[Figure]()
    while used.size >= MIN_VIEWS and left.size:
        _score(floor.pixels, left, state, used, ROWS, EMPTY, MIN_VIEWS, scores)
        best = (scores - unusual).max(1)
        left = left[best[left] >= NEEDED]  # evidence only falls when more is explained
        if not left.size:
            break
        cell = int(left[best[left].argmax()])
        place = _middle(floor, best, cell)
        figure = Figure(place, _height(floor, place, HEIGHTS[int((scores[cell] - unusual).argmax())], state), float(best[cell]))
        found.append(figure)
        for n, mask in enumerate(drawn(floor, figure)):
            flat = state[n, : mask.size]
            flat[mask.ravel() & (flat == NEW)] = KNOWN
        left = left[np.linalg.norm(floor.places[left] - place, axis=1) >= APART]
    return _without_ghosts(floor, seen, explained, found)


def _find_by_keypoints(cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None]) -> list[Figure]:
    """The people whose keypoints' rays meet, of a person's height, each in a place of their own."""
    found, landmarks = list[Figure](), _landmarks()
    for people, places in people_between(cameras, keypoints, landmarks) if keypoints else ():
        height, place = height_between([places], landmarks), np.nanmean(places[:, :2], axis=0)
        alone = all(np.linalg.norm(place - other.place) >= APART for other in found)
        if alone and height is not None and PEOPLE[0] < height < PEOPLE[1]:
            found.append(Figure(place, height, float(sum(person is not None for person in people)), people))
    return found


@cache
def _landmarks() -> Landmarks:
    return landmarks_of(average_body("anatomical"))


def _without_ghosts(floor: Floor, seen: Seen, explained: Sequence[Mask | None], found: list[Figure]) -> list[Figure]:
    """The figures that explain something which all of the others, also those found later, leave; the least certain go first."""
    kept = list(found)
    for figure in reversed(found) if len(found) > 2 else ():
        state, used = _states(seen, explained)
        for other in kept:
            for n, mask in enumerate(drawn(floor, other) if other is not figure else ()):
                flat = state[n, : mask.size]
                flat[mask.ravel() & (flat == NEW)] = KNOWN
        near = np.flatnonzero(np.linalg.norm(floor.places - figure.place, axis=1) < 1.5 * floor.pitch)
        scores = np.full((len(floor.places), len(HEIGHTS)), -np.inf)
        _score(floor.pixels, near, state, used, ROWS, EMPTY, MIN_VIEWS, scores)
        if scores.max() < NEEDED / 2:
            kept = [other for other in kept if other is not figure]
    return kept


def find_floor(cameras: Sequence[Camera], points: Array, sets: Sequence[Seen]) -> Floor:
    """The floor on which figures explain most of what some frame sets show. `points`: surface points (P, 3), world, metres, of all people.
    Where few cameras see a person the hull reaches below the floor, so that the lowest points alone do not say where it is."""
    ground, tried = Ground.under(cameras, points, TRIED_REACH, TRIED_NEAR), dict[int, float]()

    def evidence(level: int) -> float:
        floor = ground.at(level / 100)
        return sum(figure.evidence for seen in sets for figure in find_people(floor, seen))

    def evidences(levels: NDArray[np.int64]) -> Array:
        new = [level for level in dict.fromkeys(levels.tolist()) if level not in tried]
        tried.update(zip(new, pool.map(evidence, new)))
        return np.array([tried[level] for level in levels.tolist()])

    with ThreadPoolExecutor(usable_cores(), "floor") as pool:
        levels = np.rint(100 * np.array([0.0, *np.percentile(points[:, 2], (0.5, 2, 5, 10))])).astype(np.int64)
        levels = levels[np.argmax(evidences(levels))] + COARSE
        levels = levels[np.argmax(evidences(levels))] + FINE
        found, (at_zero,) = evidences(levels), evidences(np.zeros(1, np.int64))
    if at_zero >= ALIKE_AT_ZERO * found.max():
        return floor_under(cameras, points, 0.0)  # where silhouettes lack feet figures fit many levels alike
    # evidence changes little within some centimetres, so that the greatest is chance: the middle of the levels with nearly as much
    return floor_under(cameras, points, float(np.average(levels, weights=np.maximum(found - ALIKE * found.max(), 1e-9))) / 100)


def telling(masks: Sequence[Mask | None]) -> list[Mask | None]:
    """The masks (H, W) without those that are nearly all of their picture, as of a camera that turned black: these show a person
    everywhere."""
    return [mask if mask is None or may_be_person(mask) or not mask.any() else None for mask in masks]


def solid(mask: Mask) -> Mask:
    """A mask (H, W) with all of its holes filled: clothes like the background make holes in a person."""
    import cv2

    contours, _ = cv2.findContours(np.ascontiguousarray(mask).view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(mask.shape, np.uint8)
    cv2.drawContours(filled, contours, -1, 1, cv2.FILLED)
    return filled.view(np.bool_)


def drawn(floor: Floor, figure: Figure, wide: float = WIDE) -> list[Mask]:
    """The pixels (H / 2, W / 2) of each camera's picture that a figure may explain, `wide` to each side, metres."""
    import cv2

    z = floor.level + np.array([-0.05, 0.88 * figure.height, figure.height + 0.06])
    found = list[Mask]()
    for camera in floor.cameras:
        up, across = np.concatenate([z, z]), np.array([wide, wide, HEAD, -wide, -wide, -HEAD])
        corners = camera.project(figure_points(camera, figure.place[None], up, across)[0]) / 2
        picture = np.zeros(((camera.size[1] + 1) // 2, (camera.size[0] + 1) // 2), np.uint8)
        if np.isfinite(corners).all():
            hull = cv2.convexHull(np.rint(corners.clip(-1e4, 1e4)).astype(np.int32))
            cv2.fillConvexPoly(picture, hull, 1)
        found.append(picture.view(np.bool_))
    return found


def _states(seen: Seen, explained: Sequence[Mask | None]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """What each pixel is, (C, pixels), and the cameras that say something; arguments as for `find_people`."""
    halves = [None if mask is None else solid(half_size(mask)) for mask in telling(seen.masks)]
    state = np.zeros((len(halves), max((half.size for half in halves if half is not None), default=0)), np.uint8)
    for n, half in enumerate(halves):
        if half is not None:
            state[n, : half.size] = half.ravel()
            own, known, shade = state[n, : half.size], *(each[n] if n < len(each) else None for each in (explained, seen.shadows))
            if known is not None:
                own[(half & known).ravel()] = KNOWN
            if shade is not None:
                own[(shade & ~half).ravel()] = SHADE
    return state, np.array([n for n, half in enumerate(halves) if half is not None], np.int64)


def _middle(floor: Floor, best: Array, cell: int) -> Array:
    """The middle of the places about a cell with nearly as much evidence."""
    near = np.flatnonzero(np.linalg.norm(floor.places - floor.places[cell], axis=1) <= 1.5 * floor.pitch)
    weight = np.maximum(best[near] - 0.8 * best[cell], 0)
    return np.asarray(weight @ floor.places[near] / weight.sum())


def _height(floor: Floor, place: Array, about: float, state: NDArray[np.uint8]) -> float:
    """Height of a figure of `about` that height: where its silhouettes end, in the views where no other figure is behind the head."""
    z, tops = np.arange(0.6 * about, max(HEIGHTS) + 0.35, 0.03), list[float]()
    across = np.array([-0.06, 0.0, 0.06])
    for n, camera in enumerate(floor.cameras):
        at = pixel_index(camera, figure_points(camera, place[None], floor.level + z.repeat(3), np.tile(across, len(z)))[0])
        rows = np.where(at >= 0, state[n, np.maximum(at, 0) % max(state.shape[1], 1)], KNOWN).reshape(-1, 3)
        seen = np.where((rows == KNOWN).any(1), KNOWN, np.where((rows == NEW).any(1), NEW, NONE))
        end = int(np.argmax(seen != NEW))
        if seen[end] == NONE and end and z[end] > about - 0.3:
            tops.append(float(z[end]))
    return float(np.median(tops)) if tops else about


@kernel
def _score(pixels, which, state, used, rows, empty, least, scores):  # pragma: no cover
    """Evidence (N, heights), in views, for the figures at the places `which`; rows: of the trunk, of the legs, and points of each of
    these."""
    trunk, legs, aside = rows[0], rows[1], rows[2]
    for i in range(which.size):
        n = which[i]
        for h in range(pixels.shape[1]):
            total, views = 0.0, 0
            for k in range(used.size):
                c = used[k]
                value, inside = 0.0, 0
                for p in range(3 * trunk):
                    at = pixels[n, h, c, p]
                    if at >= 0:
                        inside += 1
                        if state[c, at] == 1:
                            value += 1.0 / 3.0
                        elif state[c, at] == 0:
                            value -= empty / 3.0
                p = 3 * trunk
                for _ in range(legs):
                    new = known = seen = 0
                    for _ in range(aside):
                        at = pixels[n, h, c, p]
                        p += 1
                        if at >= 0:
                            seen += 1
                            new += state[c, at] == 1
                            known += state[c, at] >= 2
                    if new:
                        value += 1.0
                    elif seen == aside and not known:
                        value -= empty
                new = 0
                for _ in range(3):
                    at = pixels[n, h, c, p]
                    p += 1
                    if at >= 0 and state[c, at] == 1:
                        new += 1
                value -= empty * new / 3.0
                new = 0
                for _ in range(aside):
                    at = pixels[n, h, c, p]
                    p += 1
                    if at >= 0 and state[c, at] == 1:
                        new += 1
                if new:
                    value -= empty
                if 2 * inside >= 3 * trunk:
                    views += 1
                total += value / (trunk + legs)
            scores[n, h] = total if views >= least else -np.inf
