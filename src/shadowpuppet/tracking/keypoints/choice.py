"""Which of the persons that a detector found in each picture is the one that is tracked; never the most confident for being so."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.candidates import triangulated_landmarks
from shadowpuppet.tracking.keypoints.definitions import Landmarks
from shadowpuppet.tracking.keypoints.sights import NEAR, Sights, is_inside, sights_of

People = tuple[int | None, ...]
"""Index of the person in each camera's keypoints; None for none."""
APART = 0.45
"""Least distance (m) of two people: a person in a picture who is farther from a body is another one."""


def people_in(masks: Sequence[Mask | None], cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None]) -> People:
    """In each camera the person of whose keypoints' confidence most lies in its mask (H, W), less what lies outside; none if all have more
    outside."""
    found = list[int | None]()
    for mask, camera, each in zip(masks, cameras, keypoints):
        if mask is None or each is None or not len(each.person):
            found.append(None)
            continue
        inside = is_inside(camera, each.xy)
        x, y = np.where(inside[..., None], each.xy, 0).round().astype(int).T
        scores = np.where(inside, np.where(mask[y, x].T, each.confidence, -each.confidence), 0).sum(1)
        found.append(int(scores.argmax()) if scores.max() > 0 else None)
    return tuple(found)


def people_at(points: Array, cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None], landmarks: Landmarks) -> People:
    """In each camera the person whose keypoints lie nearest to a body's landmarks (K, 3), on whichever side."""
    middle, number = points.mean(0), max((len(each.person) for each in keypoints if each is not None), default=0)
    if number == 1:
        return tuple(0 if each is not None and len(each.person) else None for each in keypoints)
    scores = np.zeros((number, len(cameras)))
    for person in range(number):
        chosen = [person if each is not None and person < len(each.person) else None for each in keypoints]
        sights = sights_of(cameras, keypoints, chosen, landmarks, middle)
        np.add.at(scores[person], sights.cameras, 1 / (1 + sights.squares_from(points, landmarks) / NEAR**2))
    return tuple(int(each.argmax()) if each.any() else None for each in scores.T) if number else (None,) * len(cameras)


def people_of(bodies: Sequence[Array], cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None],
              landmarks: Landmarks) -> list[People]:
    """For each of N bodies, of landmarks (K, 3), the person in each camera; none if none is near. No two bodies have the same one: in each
    picture the sum of the distances is least."""
    from scipy.optimize import linear_sum_assignment

    found = [[None for _ in cameras] for _ in bodies]
    for n, (camera, each) in enumerate(zip(cameras, keypoints)):
        apart = _distances(bodies, camera, each, landmarks)
        for body, person in zip(*map(np.ndarray.tolist, linear_sum_assignment(apart))):
            if apart[body, person] < APART:
                found[body][n] = person
    return list(map(tuple, found))


def _distances(bodies: Sequence[Array], camera: Camera, keypoints: Keypoints | None, landmarks: Landmarks) -> Array:
    """Distances (N, P), metres, at most `APART`, of P persons in a camera from N bodies, of landmarks (K, 3): the median of the keypoints,
    on whichever side."""
    number = 0 if keypoints is None else len(keypoints.person)
    sights = [sights_of([camera], [keypoints], [person], landmarks, bodies[0].mean(0)) for person in range(number)]
    squares = [np.median([*each.squares_from(points, landmarks), APART**2]) for points in bodies for each in sights]
    return np.sqrt(squares).clip(max=APART).reshape(len(bodies), number)


def person_between(cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None], landmarks: Landmarks) -> tuple[People, Array]:
    """The person whose rays meet best: an index for each camera, and the middle (3,) of the landmarks, world. The two pictures with the
    most rays to common points begin, and the other cameras' persons nearest to these points follow. If one picture alone shows persons,
    the largest in it."""
    number, middle = len(cameras), np.mean([camera.centre for camera in cameras], axis=0)
    seen = [(n, person) for n, each in enumerate(keypoints) if each is not None for person in range(len(each.person))]

    def met(*chosen: tuple[int, int]) -> tuple[float, Array]:
        """How many rays of persons, by camera and index, meet, and where (K, 3)."""
        people = tuple(dict(chosen).get(n) for n in range(number))
        sights = sights_of(cameras, keypoints, people, landmarks, middle)
        places = triangulated_landmarks(sights, landmarks)
        known = np.asarray(np.isfinite(places).all(1))
        away = np.where(known[sights.landmarks], sights.squares_from(np.nan_to_num(places), landmarks), np.inf)
        return float((1 / (1 + away / NEAR**2)).sum()), places

    pairs = [pair for pair in combinations(seen, 2) if pair[0][0] != pair[1][0]]
    if not pairs:
        return tuple(_largest(each) for each in keypoints), middle
    tried = {pair: met(*pair) for pair in pairs}
    first = max(tried, key=lambda pair: tried[pair][0])
    places = tried[first][1]
    if not np.isfinite(places).all(1).any():
        return (None,) * number, middle
    middle = np.nanmean(places, axis=0)
    others = people_at(np.where(np.isfinite(places), places, middle), cameras, keypoints, landmarks)
    return tuple(dict(first).get(n, other) for n, other in enumerate(others)), middle


def people_between(cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None], landmarks: Landmarks) -> list[tuple[People, Array]]:
    """The people whom two cameras or more show, those whose rays meet best first: an index for each camera, and the places (K, 3) of the
    landmarks, world, not a number where unknown. Most rays of each of a person's cameras lead to these places."""
    number, middle = len(cameras), np.mean([camera.centre for camera in cameras], axis=0)
    each = {(n, person): sights_of(cameras, keypoints, [person if m == n else None for m in range(number)], landmarks, middle)
            for n, found in enumerate(keypoints) if found is not None for person in range(len(found.person))}  # fmt: skip

    def placed(chosen: Iterable[tuple[int, int]]) -> Array:
        sights = Sights(*map(np.concatenate, zip(*(each[one] for one in chosen), strict=True)))
        return triangulated_landmarks(sights._replace(cameras=np.unique(sights.cameras, return_inverse=True)[1]), landmarks)

    def near(sights: Sights, places: Array) -> float:
        known = np.asarray(np.isfinite(places).all(1))
        away = np.where(known[sights.landmarks], sights.squares_from(np.nan_to_num(places), landmarks), np.inf)
        return float((1 / (1 + away / NEAR**2)).mean()) if len(away) else 0.0

    pairs = {pair: placed(pair) for pair in combinations(each, 2) if pair[0][0] != pair[1][0]}
    shares = {pair: {one: share for one, sights in each.items() if (share := near(sights, places)) > 0.5} for pair, places in pairs.items()}
    found = list[tuple[People, Array]]()
    while shares := {pair: share for pair, share in shares.items() if share.keys() >= set(pair)}:
        groups = {pair: {n: max((one for one in share if one[0] == n), key=share.__getitem__) for n, _ in share}
                  for pair, share in shares.items()}  # fmt: skip
        best = max(groups, key=lambda pair: sum(shares[pair][one] for one in groups[pair].values()))
        group = set(groups[best].values())
        people = dict(group)
        found.append((tuple(people.get(n) for n in range(number)), placed(sorted(group))))
        shares = {pair: {one: value for one, value in share.items() if one not in group} for pair, share in shares.items()}
    return found


def _largest(keypoints: Keypoints | None) -> int | None:
    """Index of the person whose landmarks are spread widest in a picture; None without persons."""
    if keypoints is None or not len(keypoints.person):
        return None
    known = [xy[np.isfinite(xy[:, 0])] for xy in keypoints.xy]
    return int(np.argmax([np.ptp(xy, axis=0).max() if len(xy) else 0.0 for xy in known]))
