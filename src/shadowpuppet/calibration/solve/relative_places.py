"""Where cameras stand to each other, from a board that two of them see at the same time: pairs by vote, all by a spanning tree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.solve.board_pose import Pose, board_poses
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, evenly_spread, inverse

MAX_ANGLE, MAX_SHIFT = np.radians(5.0), 0.06
"""Two estimates of one pair agree within this angle and this share of the cameras' distance from the board."""
MOST_MOMENTS = 60
"""Number of moments, evenly spread, in which a pair is compared."""
MIN_MOMENTS, MIN_SHARE = 3, 0.3
"""Least number and share of moments in which two cameras see the board and agree where they stand, for a pair that counts."""
FLIPS = (np.diag([-1.0, 1.0, -1.0, 1.0]), np.diag([1.0, -1.0, -1.0, 1.0]))
"""The other side of a board, turned over its vertical edge or over its horizontal one."""

Moment = Mapping[int, View]
"""The views of one moment, by the camera's index."""


class Pair(NamedTuple):
    """What two cameras' views of the board say of each other."""

    first: int
    second: int
    seen: int
    """Moments in which both see the board."""
    agreed: int
    """Moments whose poses agree with `T`."""
    T: Array
    """First camera to second, of shape (4, 4), metres."""
    two_sided: bool
    """Whether they agree if each is taken to see another side of the board."""

    @property
    def good(self) -> bool:
        """Whether the pair counts."""
        return self.agreed >= min(MIN_MOMENTS, self.seen) and self.agreed >= MIN_SHARE * self.seen and self.seen > 0


def poses_of(cameras: Sequence[Camera], board: Board, moments: Sequence[Moment]) -> list[dict[int, list[Pose]]]:
    """Poses of the board by moment and camera; views without a pose are left out."""
    return [{c: found for c, view in moment.items() if (found := board_poses(cameras[c], board, view))} for moment in moments]


def pairs_of(count: int, poses: Sequence[Mapping[int, Sequence[Pose]]]) -> list[Pair]:
    """The pairs of `count` cameras that see the board at the same moment at least once."""
    out = []
    for i, j in combinations(range(count), 2):
        both = [(each[i], each[j]) for each in poses if i in each and j in each]
        if both:
            both = [both[k] for k in evenly_spread(len(both), MOST_MOMENTS)]
            out.append(_compared(i, j, both))
    return out


def _compared(i: int, j: int, both: Sequence[tuple[Sequence[Pose], Sequence[Pose]]]) -> Pair:
    agreed, T = _voted(both, np.eye(4))
    flipped = max(_voted(both, flip)[0] for flip in FLIPS) if agreed < 0.6 * len(both) and len(both) >= MIN_MOMENTS else 0
    return Pair(i, j, len(both), agreed, T, flipped >= max(MIN_MOMENTS, 0.5 * len(both), 1.5 * agreed))


def _voted(both: Sequence[tuple[Sequence[Pose], Sequence[Pose]]], flip: Array) -> tuple[int, Array]:
    """The estimate (4, 4) that most moments agree with, and their number."""
    candidates, owner, far = [], [], []
    for n, (first, second) in enumerate(both):
        for a in first:
            for b in second:
                candidates.append(b.T @ flip @ inverse(a.T))
                owner.append(n)
                far.append(max(a.T[2, 3], b.T[2, 3]))
    T, moments = np.array(candidates), np.array(owner)
    limit = MAX_SHIFT * np.array(far)
    trace = np.einsum("aij,bij->ab", T[:, :3, :3], T[:, :3, :3])
    close = (np.arccos(np.clip((trace - 1) / 2, -1, 1)) < MAX_ANGLE)
    gaps = np.linalg.norm(T[:, None, :3, 3] - T[None, :, :3, 3], axis=2)
    close &= gaps < np.maximum(limit[:, None], limit[None])
    votes = np.array([len(np.unique(moments[row])) for row in close])
    best = int(np.argmax(votes - 1e-3 * np.where(close, gaps, 0).sum(1) / np.maximum(close.sum(1), 1) / max(float(limit.mean()), 1e-9)))
    return int(votes[best]), T[best]


def linked(count: int, pairs: Sequence[Pair]) -> tuple[list[Array | None], list[list[int]]]:
    """World to camera (4, 4) of each camera by the pairs with most moments, the world being the best linked camera's; None for cameras
    that no pair links with it. And the groups of linked cameras, the largest first."""
    good = sorted((pair for pair in pairs if pair.good), key=lambda pair: -pair.agreed)
    groups = [[n] for n in range(count)]
    tree = []
    for pair in good:
        a, b = (next(g for g in groups if n in g) for n in (pair.first, pair.second))
        if a is not b:
            groups.remove(b)
            a.extend(b)
            tree.append(pair)
    groups.sort(key=lambda group: (-len(group), min(group)))
    places: list[Array | None] = [None] * count
    links = {n: sum(pair.agreed for pair in good if n in (pair.first, pair.second)) for n in groups[0]}
    places[max(groups[0], key=lambda n: (links[n], -n))] = np.eye(4)
    for _ in tree:
        for pair in tree:
            first, second = places[pair.first], places[pair.second]
            if first is not None and second is None:
                places[pair.second] = pair.T @ first
            elif second is not None and first is None:
                places[pair.first] = inverse(pair.T) @ second
    return places, [sorted(group) for group in groups]
