"""Contact of heels and toes with the floor, by their height and speed.

A point stands with a probability that falls with its height over the floor and with its speed, two logistic curves. Whether it is in
contact has hysteresis: contact begins at a higher probability than it ends, and lasts for a least time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled, true_runs
from shadowpuppet.motion.motion import JointTable

SLOW = 0.3
"""Speed (m/s) below which a point of a sole may stand."""
LOWEST, BAND = 10, 0.03
"""Percentile of the heights of slow points that is near the floor, and the distance (m) from it of those that stand on it."""
LOWEST_SHARE = 2
"""Percentile of the heights of the lowest foot over a film that counts as the lowest: single frames are wrong."""
FEWEST = 5
"""Number of slow points from which on a floor is found."""


def floor_height(heights: Array, speeds: Array) -> float:
    """Height (m) of the floor under points of soles, from their heights (T, P), metres, and speeds (T, P), m/s: the median of those that
    stand lowest. One level floor, without steps; NaN if nothing stands."""
    slow = heights[(speeds < SLOW) & np.isfinite(heights)]
    if len(slow) < FEWEST:
        return np.nan
    lowest = slow[np.abs(slow - np.percentile(slow, LOWEST)).argmin()]
    return float(np.median(slow[np.abs(slow - lowest) < BAND]))


def under_feet(names: Sequence[str], positions: Array, legs: float) -> float:
    """Height (m) of the floor under a person before a camera whose height is unknown: that of the lowest foot over the film, of joints
    (T, J, 3), metres; of a body without feet it is `legs` (m) below the pelvis. NaN if nothing is known."""
    feet = [n for ending in ("_heel", "_toe", "_ankle") for n, name in enumerate(names) if name.endswith(ending)]
    heights = positions[:, feet, 2] if feet else positions[:, [names.index("pelvis")], 2] - legs
    heights = np.where(np.isfinite(heights), heights, np.inf).min(axis=1)
    known = heights[np.isfinite(heights)]
    return float(np.percentile(known, LOWEST_SHARE)) if len(known) else np.nan


SOLES = tuple(f"{side}_{point}" for side in SIDES for point in ("heel", "toe"))
"""Points of the soles."""
HEIGHT, HEIGHT_SCALE = 0.035, 0.008
"""Height (m) over the floor at which the probability is a half, and by which its odds change by the factor e."""
SPEED, SPEED_SCALE = 0.5, 0.1
"""The same for the speed (m/s)."""
BEGINS, ENDS = 0.6, 0.4
"""Probabilities at which contact begins and ends."""
SHORTEST = 0.05
"""Time (s) that a contact, or a gap between two, lasts at least."""
WINDOW = 0.03
"""Standard deviation (s) of the window in which speeds are averaged."""


class Contacts(NamedTuple):
    """Points of the soles and the floor in T frames."""

    names: tuple[str, ...]
    """P of `SOLES`."""
    floor: float
    """Height of the floor in the world, metres."""
    probability: Array
    """That a point stands on the floor, of shape (T, P); NaN where the point is unknown."""
    touching: NDArray[np.bool_]
    """Whether it is taken to be in contact, of shape (T, P)."""


class FootEvent(NamedTuple):
    """A foot meets the floor or leaves it."""

    time: float
    """Seconds: of the first frame in contact, or the first without."""
    side: str
    strike: bool
    """Whether the foot meets the floor."""


def find_contacts(times: Array, names: Sequence[str], positions: Array, floor: float | None = None) -> Contacts | None:
    """Contacts of the soles among points (T, J, 3), world, metres, at `times` (T,), seconds. `floor`: its height, if it is known, metres.
    None for points without soles, or if nothing ever stands."""
    soles = [name for name in names if name in SOLES]
    points = positions[:, [names.index(name) for name in soles]]
    known = np.asarray(np.isfinite(points).all(2))
    if not soles or known.any(axis=1).sum() < 2:
        return None
    speed = speeds(times, points)
    found = floor_height(points[..., 2], speed) if floor is None else floor
    if not np.isfinite(found):
        return None
    probability = _falling(points[..., 2] - found, HEIGHT, HEIGHT_SCALE) * _falling(speed, SPEED, SPEED_SCALE)
    probability = np.where(known, probability, np.nan)
    return Contacts(tuple(soles), found, probability, np.stack([_held(times, column) for column in probability.T], axis=1))


def contacts_of(table: JointTable) -> Contacts | None:
    """Contacts of the soles of a motion, as `find_contacts`."""
    return find_contacts(table.times, table.names, table.positions)


def foot_events(times: Array, contacts: Contacts) -> list[FootEvent]:
    """Strikes and offs of both feet in order of time, at `times` (T,), seconds: when the first point of a sole meets the floor, and the
    last one leaves it. Contacts that begin in the first frame or end in the last have no event there."""
    found = list[FootEvent]()
    for side in SIDES:
        own = [n for n, name in enumerate(contacts.names) if name.startswith(side)]
        change = np.diff(contacts.touching[:, own].any(1).astype(int))
        found += [FootEvent(float(times[n + 1]), side, bool(change[n] > 0)) for n in np.flatnonzero(change)]
    return sorted(found)


def speeds(times: Array, points: Array) -> Array:
    """Speeds (T, P), m/s, of points (T, P, 3), metres, averaged within `WINDOW`; NaN where a point is unknown."""
    known: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(2))
    if known.any(axis=1).sum() < 2:
        return np.full(points.shape[:2], np.nan)
    step = float(np.median(np.diff(times)))
    from scipy.ndimage import gaussian_filter1d  # takes a third of a second to import

    smooth = gaussian_filter1d(filled(times, points), WINDOW / step, axis=0, mode="nearest")
    return np.where(known, np.linalg.norm(np.gradient(smooth, times, axis=0), axis=2), np.nan)


def _falling(values: Array, half: float, scale: float) -> Array:
    """A logistic curve that falls with the values and is a half at `half`."""
    return 1 / (1 + np.exp(np.clip((values - half) / scale, -50, 50)))


def _held(times: Array, probability: Array) -> NDArray[np.bool_]:
    """Whether a point is in contact (T,), from probabilities (T,), with hysteresis and without contacts and gaps that are too short."""
    out, now = np.zeros(len(times), bool), False
    for t, p in enumerate(probability):
        now = bool(p >= (ENDS if now else BEGINS))
        out[t] = now
    for wrong in (False, True):  # first gaps, then contacts
        for begin, end in true_runs(out == wrong):
            inside = begin > 0 and end < len(out)
            if inside and times[end] - times[begin] < SHORTEST and np.isfinite(probability[begin:end]).all():
                out[begin:end] = not wrong
    return out
