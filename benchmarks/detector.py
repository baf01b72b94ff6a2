"""A detector of keypoints by numbers alone: definitions that lie beside the joints, errors that last, misses, sides exchanged for a while,
confident points outside the picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import other_side
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.geometry import Array, unit
from shadowpuppet.tracking.keypoints.sights import is_inside


class Detector(NamedTuple):
    """Numbers of MediaPipe on made films, or rounder ones."""

    scale: float = 0.009
    """Scale (m) of its Student-t errors with four degrees of freedom, across the view."""
    memory: float = 0.4
    """Seconds in which errors fall to 1/e."""
    offset: float = 0.015
    """Standard deviation (m) of the places of its joints beside the true ones, along the trunk's axes."""
    misses: float = 0.1
    """Share of the time in which a joint is missing, for 0.3 s each."""
    exchanges: float = 0.1
    """Share of the time in which a camera exchanges left and right, for 0.2 to 2 s each."""
    outside: float = 0.11
    """Error (m) of joints outside the picture, which are confident all the same."""


USUAL = Detector()
HIDES = 0.12
"""Distance (m) from a line of sight within which another person's joint hides what is behind."""
EXACT = Detector(0.0, 0.4, 0.0, 0.0, 0.0, 0.0)
DETECTORS = {"made": USUAL, "poor": Detector(scale=0.015, misses=0.3, exchanges=0.2, offset=0.02)}
"""Usual errors, and those of small or blurred people."""


def detected(rng: np.random.Generator, cameras: Sequence[Camera], times: Array, names: Sequence[str], joints: Array,
             by: Detector = USUAL) -> list[list[Keypoints]]:
    """Keypoints by frame and camera of a person's joints (T, K, 3), world; `names`: with sides, the left before the right of each pair."""
    T, K = joints.shape[:2]
    beside = joints + (by.offset * _mirrored(rng.standard_normal((K, 3)), names) @ _trunk(names, joints))
    seen, nobody = [_in_one(rng, camera, times, names, beside, by) for camera in cameras], np.array([-1])
    return [[Keypoints(tuple(names), xy[t][None], sure[t][None], nobody, "made") for xy, sure in seen] for t in range(T)]


def detected_together(rng: np.random.Generator, cameras: Sequence[Camera], times: Array, names: Sequence[str], people: Sequence[Array],
                      by: Detector = USUAL) -> list[list[Keypoints]]:
    """As `detected`, of several people's joints, each (T, K, 3), in an order that changes from frame to frame. Joints that another person
    hides are missing; and persons, as often as single joints."""
    alone = [detected(rng, cameras, times, names, joints, by) for joints in people]
    found = [list[Keypoints]() for _ in times]
    for c, camera in enumerate(cameras):
        away = np.array([hidden(camera, own, [each for each in people if each is not own]) for own in people])
        for n in range(len(people)):
            for begin, end in _runs(rng, times, by.misses, 0.3, 0.3):
                away[n, begin:end] = True
        for t, frame in enumerate(found):
            order = rng.permutation(len(people))
            xy, sure = (np.concatenate([getattr(alone[n][t][c], what) for n in order]) for what in ("xy", "confidence"))
            sure = np.where(away[order, t], 0.0, sure)
            shown = sure.any(1)
            frame.append(Keypoints(tuple(names), xy[shown], sure[shown], np.full(shown.sum(), -1), "made"))
    return found


def hidden(camera: Camera, own: Array, others: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether another person's joint, (T, J, 3) each, is before each of a person's joints (T, J, 3), in a camera."""
    away, found = np.linalg.norm(own - camera.centre, axis=-1, keepdims=True), np.zeros(own.shape[:2], bool)
    for other in others:
        ray, to = (own - camera.centre) / away, other - camera.centre
        along = np.einsum("tjk,tik->tji", ray, to)
        beside = np.sqrt(np.maximum((to**2).sum(-1)[:, None] - along**2, 0))
        found |= ((beside < HIDES) & (along < away - 0.3) & (along > 0)).any(-1)
    return found


def _in_one(rng: np.random.Generator, camera: Camera, times: Array, names: Sequence[str], joints: Array,
            by: Detector) -> tuple[Array, Array]:
    """Pixels (T, K, 2) and confidences (T, K) of one camera."""
    T, K = joints.shape[:2]
    keep = np.exp(-np.median(np.diff(times)) / by.memory) if T > 1 else 0.0
    normal = rng.standard_normal((T, K, 2))
    for t in range(1, T):
        normal[t] = keep * normal[t - 1] + np.sqrt(1 - keep**2) * normal[t]
    thick = np.sqrt(4 / rng.chisquare(4, (T, K, 1)))  # Student-t is normal over the root of chi squared
    xy = camera.project(joints)
    pixel = camera.matrix[0, 0] / np.linalg.norm(joints - camera.centre, axis=2)[..., None]
    xy = xy + pixel * (by.scale * normal * thick + np.where(is_inside(camera, xy)[..., None], 0, by.outside * normal))
    for begin, end in _runs(rng, times, by.exchanges, 0.2, 2.0):
        xy[begin:end] = xy[begin:end, other_side(names)]
    confidence = np.clip(1 - 0.15 * np.abs(rng.standard_normal((T, K))), 0.05, 1)
    for k in range(K):
        for begin, end in _runs(rng, times, by.misses, 0.3, 0.3):
            xy[begin:end, k], confidence[begin:end, k] = np.nan, 0.0
    return xy, confidence


def _runs(rng: np.random.Generator, times: Array, share: float, shortest: float, longest: float) -> list[tuple[int, int]]:
    """First frames and ends of runs that take a share of the time together."""
    found, at, between = list[tuple[int, int]](), times[0], 0.5 * (shortest + longest) * (1 - share) / max(share, 1e-9)
    while (at := at + rng.exponential(between)) < times[-1]:
        end = at + rng.uniform(shortest, longest)
        found.append((int(np.searchsorted(times, at)), int(np.searchsorted(times, end))))
        at = end
    return found


def _mirrored(offsets: Array, names: Sequence[str]) -> Array:
    """Offsets (K, 3), forward, left, up, with each right landmark's as the mirror image of the left one's."""
    out = offsets.copy()
    for n, name in enumerate(names):
        if name.startswith("right_"):
            out[n] = out[n - 1] * (1, -1, 1)
    return out


def _trunk(names: Sequence[str], joints: Array) -> Array:
    """Rows (T, 3, 3): forward, left and up of the trunk."""
    at = {name: joints[:, names.index(name)] for name in ("left_hip", "right_hip", "left_shoulder", "right_shoulder")}
    left, up = unit(at["left_hip"] - at["right_hip"]), at["left_shoulder"] + at["right_shoulder"] - at["left_hip"] - at["right_hip"]
    ahead = unit(np.cross(left, up))
    return np.stack([ahead, left, np.cross(ahead, left)], 1)
