"""Steps and strides of a walk, from the stances of its feet.

A step is from a strike to the other foot's, a stride from a strike to the same foot's next. The direction of progression of a step is that
of the pelvis from one step time before to one after the moment in which it passes between both footprints: so its sway cancels, and lengths
and widths hold on a bend, too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.contact.contact import Contacts
from shadowpuppet.motion.contact.stances import Stance, find_stances

LONGEST_STEP = 1.5
"""Seconds; whoever takes longer has paused."""
LEAST_WAY = 0.1
"""Way of the pelvis (m) from a step before a strike to a step after, below which a step is on the spot and has no direction."""
MOST_TURN = np.radians(45)
"""Turn of the pelvis' way from one step to the next (rad) above which it is a turn, not a bend."""
MOST_DOUBT = 0.2
"""Share of a step's frames up to which its legs need not be vouched for: as legs pass each other, they hide one another for a moment."""
SEEN = 0.2
"""Seconds before and after a step in which no frame may be without a pose: a strike at the end of a gap is none."""
REASONS = ("doubtful", "paused", "on the spot", "turning", "at an end")
"""Why a step is left out: its legs are not vouched for; the rest as above; the film begins or ends within a step of it."""


class Step(NamedTuple):
    """From a strike to the other foot's."""

    side: str
    """Of the second strike."""
    begin: float
    end: float
    """Seconds."""
    length: float
    width: float
    """Along and across the direction of progression, metres; the width is negative if the feet cross. NaN without a direction."""
    length_sd: float
    width_sd: float
    """Stated deviations, metres; NaN if unknown."""
    turn: float
    """Of the way at the second strike, rad, positive to the left."""
    left_out: str
    """One of `REASONS`; empty if the step counts."""


class Stride(NamedTuple):
    """From a strike to the same foot's next, made of two steps that count."""

    side: str
    begin: float
    off: float
    end: float
    """Seconds."""
    length: float
    """Of both steps together, metres."""
    length_sd: float
    """Stated deviation, metres."""

    @property
    def seconds(self) -> float:
        """Its time."""
        return self.end - self.begin

    @property
    def stance(self) -> float:
        """Share of the time in which the foot is on the floor."""
        return (self.off - self.begin) / self.seconds


class Gait(NamedTuple):
    """All steps of a motion, and the strides whose steps all count."""

    strikes: dict[str, int]
    """Number of strikes by side."""
    steps: tuple[Step, ...]
    """Those that count, and those that are left out."""
    strides: tuple[Stride, ...]

    @property
    def counted(self) -> list[Step]:
        """Steps that count."""
        return [step for step in self.steps if not step.left_out]

    @property
    def left_out(self) -> dict[str, int]:
        """Number of steps left out, by reason."""
        found = Counter(step.left_out for step in self.steps)
        return {reason: found[reason] for reason in REASONS if found[reason]}


def find_gait(times: Array, contacts: Contacts, names: Sequence[str], positions: Array, sd: Array | None = None,
              sure: NDArray[np.bool_] | None = None) -> Gait:
    """Steps and strides of joints (T, J, 3), world, metres, with heels and the pelvis, at `times` (T,), seconds. `sd`: stated deviations
    (T, J, 3). `sure`: whether both legs are vouched for, of shape (T,)."""
    sd = np.full_like(positions, np.nan) if sd is None else sd
    pelvis = positions[:, list(names).index("pelvis")]
    legs = np.ones(len(times), bool) if sure is None else sure
    stances = find_stances(times, contacts, names, positions, sd)
    pairs = [(a, b) for a, b in pairwise(stances) if a.side != b.side]
    steps = tuple(_step(a, b, times, pelvis, legs) for a, b in pairs)
    own = {side: [each for each in stances if each.side == side] for side in SIDES}
    strides = [stride for side in SIDES for a, b in pairwise(own[side])
               if (stride := _stride(a, b, steps, times, pelvis))]
    strikes = {side: len(own[side]) for side in SIDES}
    return Gait(strikes, steps, tuple(sorted(strides, key=lambda stride: stride.begin)))


def _step(before: Stance, stance: Stance, times: Array, pelvis: Array, sure: NDArray[np.bool_]) -> Step:
    """The step that ends with a stance, from the other foot's stance before it."""
    seconds = stance.strike - before.strike
    middle = _between(before, stance, times, pelvis)
    a, b, c = (_at(times, pelvis, when)[:2] for when in (middle - seconds, middle, middle + seconds))
    ways = c - a, b - a, c - b
    way = float(np.hypot(*ways[0]))
    within = (times >= before.strike) & (times <= stance.strike)
    turn = float(np.angle(complex(*ways[2]) / complex(*ways[1]))) if min(np.hypot(*ways[1]), np.hypot(*ways[2])) > 0 else 0.0
    near = (times >= before.strike - SEEN) & (times <= stance.strike + SEEN)
    known = np.isfinite([*stance.place, *before.place]).all() and np.isfinite(pelvis[near]).all()
    reasons = (not known or sure[within].mean() < 1 - MOST_DOUBT, seconds > LONGEST_STEP, way < LEAST_WAY, abs(turn) > MOST_TURN,
               middle - seconds < times[0] or middle + seconds > times[-1])
    left_out = next((reason for reason, is_so in zip(REASONS, reasons) if is_so), "")
    along = ways[0] / way if way >= LEAST_WAY else np.full(2, np.nan)
    across = np.array([-along[1], along[0]]) * (1 if stance.side == "left" else -1)
    apart, variance = (stance.place - before.place)[:2], (stance.sd**2 + before.sd**2)[:2]
    return Step(stance.side, before.strike, stance.strike, float(apart @ along), float(apart @ across),
                float(np.sqrt(along**2 @ variance)), float(np.sqrt(across**2 @ variance)), turn, left_out)


def _between(before: Stance, stance: Stance, times: Array, pelvis: Array) -> float:
    """The time at which the pelvis passes between two footprints: when it is nearest to their middle."""
    near = np.flatnonzero((times >= before.strike) & (times <= 2 * stance.strike - before.strike))
    middle = (before.place + stance.place)[:2] / 2
    return float(times[near[np.nan_to_num(np.linalg.norm(pelvis[near, :2] - middle, axis=1), nan=np.inf).argmin()]])


def _stride(a: Stance, b: Stance, steps: Sequence[Step], times: Array, pelvis: Array) -> Stride | None:
    """The stride between two stances of a foot, if it is made of two steps that count."""
    own = [step for step in steps if step.begin >= a.strike and step.end <= b.strike and not step.left_out]
    if len(own) != 2 or not np.isfinite(a.off):
        return None
    way = (_at(times, pelvis, b.strike) - _at(times, pelvis, a.strike))[:2]
    along = way / np.hypot(*way)
    length_sd = float(np.sqrt(along**2 @ (a.sd**2 + b.sd**2)[:2]))
    return Stride(a.side, a.strike, a.off, b.strike, own[0].length + own[1].length, length_sd)


def _at(times: Array, points: Array, when: float) -> Array:
    """A point (3,) of (T, 3) at a time, interpolated; the first or last one beyond the ends."""
    return np.array([np.interp(when, times, column) for column in points.T])
