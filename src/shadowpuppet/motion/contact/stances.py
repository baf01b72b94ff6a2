"""Stances of both feet: when each is on the floor, and where.

Contact with the floor gives the stances. Their beginnings and ends are more regular, in a walk, where the ankle is farthest ahead of the
pelvis and farthest behind it (Zeni, Richards and Higginson 2008): feet of motion capture and of tracked people still slide as they land.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.contact.contact import Contacts, FootEvent, foot_events
from shadowpuppet.motion.interpolation import filled

SAME_PLACE, SAME_TIME = 0.1, 0.3
"""Two contacts of a foot that lie nearer than that (m) and less than that apart (s) are one stance."""
WALKS = 0.45
"""Share of a foot's time on the floor above which people walk; running feet stand less, and their ankles do not show it."""
NEAR = 0.2
"""Greatest time (s) between an end of contact and that which the ankle tells."""
MOVES = 0.2
"""Speed of the pelvis (m/s) from which it has a direction."""


class Stance(NamedTuple):
    """A foot on the floor."""

    side: str
    strike: float
    """Seconds."""
    off: float
    """Seconds; NaN if the film ends before."""
    place: Array
    """Mean of the heel while it is in contact (of the whole stance, if it never is), of shape (3,), metres."""
    sd: Array
    """Its stated deviation, of shape (3,), metres: as of one frame, since errors of neighbouring frames are alike."""


def find_stances(times: Array, contacts: Contacts, names: Sequence[str], positions: Array, sd: Array) -> list[Stance]:
    """Stances of both feet in order of time, of joints (T, J, 3), world, metres, with deviations `sd` (T, J, 3), at `times` (T,), seconds.
    A stance that has begun before the first frame is left out."""
    found = [stance for side in SIDES if {f"{side}_heel", f"{side}_ankle"} <= {*names}
             for stance in _touched(times, contacts, side, list(names), positions, sd)]
    cycles = [(a.off - a.strike, b.strike - a.strike) for a, b in pairwise(found) if a.side == b.side]
    if cycles and np.median([stands / lasts for stands, lasts in cycles]) > WALKS:
        found = _by_ankles(found, times, list(names), positions, float(np.median([lasts for _, lasts in cycles])))
    return sorted(found, key=lambda stance: stance.strike)


def stance_events(stances: Sequence[Stance]) -> list[FootEvent]:
    """Strikes and offs of stances in order of time, but for an off after the last frame."""
    strikes = [FootEvent(each.strike, each.side, True) for each in stances]
    return sorted([*strikes, *(FootEvent(each.off, each.side, False) for each in stances if np.isfinite(each.off))])


def _touched(times: Array, contacts: Contacts, side: str, names: list[str], positions: Array, sd: Array) -> list[Stance]:
    """Stances of a foot by contact alone."""
    events = [event for event in foot_events(times, contacts) if event.side == side]
    heel, touches = names.index(f"{side}_heel"), contacts.touching[:, contacts.names.index(f"{side}_heel")]
    found = list[Stance]()
    for n, event in enumerate(events):
        if not event.strike:
            continue
        off = events[n + 1].time if n + 1 < len(events) else np.nan
        span = (times >= event.time) & ~(times >= off)
        span = span & touches if (span & touches).any() else span
        stance = Stance(side, event.time, off, positions[span, heel].mean(0), sd[span, heel].mean(0))
        if found and event.time - found[-1].off < SAME_TIME and np.hypot(*(stance.place - found[-1].place)[:2]) < SAME_PLACE:
            found[-1] = found[-1]._replace(off=off)
        else:
            found.append(stance)
    return found


def _by_ankles(stances: list[Stance], times: Array, names: list[str], positions: Array, cycle: float) -> list[Stance]:
    """Stances whose strikes and offs are where the ankles are farthest ahead of the pelvis and behind it. `cycle`: seconds of a stride."""
    from scipy.ndimage import uniform_filter1d  # takes a third of a second to import

    chosen = [names.index(name) for name in ("pelvis", *(f"{side}_ankle" for side in SIDES))]
    pelvis, *ankles = filled(times, positions[:, chosen]).swapaxes(0, 1)
    frames = max(round(cycle / float(np.median(np.diff(times)))), 1)
    velocity = np.gradient(uniform_filter1d(pelvis[:, :2], frames, axis=0, mode="nearest"), times, axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    moves = np.where(speed > MOVES, 1.0, np.nan) / np.maximum(speed, MOVES)
    ahead = {side: ((ankle - pelvis)[:, :2] * velocity).sum(1) * moves for side, ankle in zip(SIDES, ankles)}
    return [each._replace(strike=_farthest(times, ahead[each.side], each.strike), off=_farthest(times, -ahead[each.side], each.off))
            for each in stances]


def _farthest(times: Array, ahead: Array, near: float) -> float:
    """The time near another at which a distance (T,) is greatest, if that lies within the film; else that other time."""
    around = np.flatnonzero(np.abs(times - near) < NEAR)
    if not len(around) or not np.isfinite(ahead[around]).all() or around[-1] == len(times) - 1 or around[0] == 0:
        return near
    return float(times[around[ahead[around].argmax()]])
