"""Which way a person faces, as log odds of the body as it is tracked against the same body turned round.

Beside others one frame hardly distinguishes front and back. While the odds decide nothing the person is followed both ways. A body that
fits better, seen from the side, adds to the odds, and so does the way that a person walks, as people walk forwards. Keypoints may tell at
once: then no other body is followed. Evidence is forgotten within a second, as neighbouring frames are not independent. Once the front is
known it is so for the undecided frames before, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.tracker import Share, follow_turned, shown_of, shows_side, turn_round
from shadowpuppet.tracking.status import PER_OVERLAP

KNOWN, MOST = 3.0, 6.0
"""Log odds from which on the front is known, 20 to 1; greatest log odds, so that evidence against them counts soon."""
MEMORY = 1.0
"""Time (s) in which the odds fall to 1/e."""
PER_METRE = 7.0
"""Log odds of a metre walked forwards."""
PER_FRAME = 1.0
"""Greatest log odds that the overlaps of one frame add: it may be a bad one."""
SETTLING = 0.4
"""Time (s) that a body turned round takes to settle: its overlap does not count before."""
QUICK, TURN = 0.7, np.radians(110)
"""Time (s) and angle (rad) of a turn quicker than people turn: the body has changed over to the other way."""
LONGEST = 150
"""Number of undecided frames that are kept."""


class Step(NamedTuple):
    """Where a person was and faced."""

    time: float
    """Seconds."""
    place: Array
    """On the floor plan, of shape (2,), metres."""
    facing: Array
    """Direction of the trunk on the floor plan, of shape (2,)."""


class Undecided(NamedTuple):
    """A frame of unknown front."""

    frame: MotionFrame
    """Of the body as it is tracked, if it faces the right way."""
    other: MotionFrame
    """Of the body turned round, if that does."""


class Front(NamedTuple):
    """What is known of the front of one person."""

    odds: float = KNOWN
    is_known: bool = True
    steps: tuple[Step, ...] = ()
    """The last `QUICK` seconds."""
    other: MultiviewState | None = None
    """The body turned round, while the front is unknown."""
    since: float = np.nan
    """Time (s) from which on that is followed."""
    undecided: tuple[Undecided, ...] = ()
    decided: tuple[MotionFrame, ...] = ()
    """Earlier frames as they are now that their front is known."""

    def begun(self, is_known: bool) -> Front:
        """The front of a person who is found again, so that the body may face another way than before."""
        return Front(KNOWN if is_known else 0.0, is_known, decided=self.decided)

    def lost(self) -> Front:
        """The front while the person is lost: found again, the body may be turned round."""
        return self._replace(steps=self.steps[-1:], other=None)

    def moved(self, step: Step) -> tuple[Front, bool]:
        """The front after one more step, and whether the body turned more quickly than people turn."""
        steps = tuple(each for each in self.steps if step.time - each.time <= QUICK + 1e-6)
        way = (step.place - steps[-1].place) @ step.facing if steps else 0.0
        odds = self._faded(step) + PER_METRE * float(way)
        if any(each.facing @ step.facing < np.cos(TURN) for each in steps):
            turned = tuple(Undecided(each.other, each.frame) for each in self.undecided)
            return self._replace(odds=-KNOWN if self.is_known else -odds, steps=(step,), other=None, undecided=turned), True
        return self._replace(odds=float(np.clip(odds, -MOST, MOST)), steps=(*steps, step)), False

    def told(self, odds: float) -> Front:
        """The front with log odds added that keypoints give for the heading of the body."""
        return self._replace(odds=float(np.clip(self.odds + odds, -MOST, MOST)))

    def _faded(self, step: Step) -> float:
        return self.odds * float(np.exp((self.steps[-1].time - step.time) / MEMORY)) if self.steps else self.odds

    def found(self, wrong: bool) -> Front:
        """The front once it is known; `wrong`: the body as it was tracked is turned round."""
        frames = (each.other if wrong else each.frame for each in self.undecided)
        steps = () if wrong else self.steps
        return Front(max(KNOWN, -self.odds if wrong else self.odds), steps=steps, decided=(*self.decided, *frames))

    def with_frame(self, frame: MotionFrame, other: MotionFrame) -> Front:
        """The front with one more undecided frame."""
        return self._replace(undecided=(*self.undecided, Undecided(frame, other))[-LONGEST:])


def face(front: Front, tracker: MultiviewTracker, rng: np.random.Generator, share: Share, time: float,
         fit_tells: bool = True) -> tuple[Front, MultiviewState]:
    """The front after a person's share of a frame, and the state: of the body that was followed turned round, once that is right.
    `fit_tells`: whether overlaps count, which with average sizes are too alike."""
    seconds = time - front.steps[-1].time if front.steps else 0.0
    front, is_quick = front.moved(step_of(tracker.body, share.state.pose, time))
    seen = shown_of(tracker, share)
    told = 0.0 if seen is None else seen.toward(share.state.pose) * 2 / tracker.rate
    front = front.told(told) if told else front
    if front.is_known and front.odds > -KNOWN:
        return front, share.state
    if told > 0 and front.odds >= KNOWN:
        return front.found(wrong=False), share.state
    is_wrong = told < 0 and front.odds <= -KNOWN
    if front.other is None:
        other = turn_round(tracker, rng, share)
        doubt = PER_OVERLAP * MEMORY * lead(share.state, other) if front.is_known or is_quick else 0.0
        odds = float(np.clip(front.odds + doubt, -MOST, MOST))
        if (front.is_known or is_wrong) and odds < 0 and other.status != "lost":
            return front.found(wrong=True), other
        front = front._replace(odds=odds, is_known=False, other=other, since=time)
    else:
        other = follow_turned(tracker, rng, front.other, share)
        front = front._replace(other=other)
        if fit_tells and time - front.since >= SETTLING and shows_side(tracker, share):
            told = float(np.clip(PER_OVERLAP * seconds * lead(share.state, other), -PER_FRAME, PER_FRAME))
            front = front._replace(odds=front.odds + told)
    if abs(front.odds) < KNOWN or time - front.since < SETTLING:
        return front, share.state
    return front.found(front.odds < 0), other if front.odds < 0 else share.state


def lead(state: MultiviewState, other: MultiviewState) -> float:
    """By how much the body of a state fits better than another (overlap)."""
    return float(np.nan_to_num(state.overlap) - np.nan_to_num(other.overlap))


def step_of(body: Body, pose: Array, time: float) -> Step:
    """Where a pose (D,) is and faces."""
    x, y, _, heading = pose[body.skeleton.dof_indices(GLOBAL_DOFS)].tolist()
    return Step(time, np.array([x, y]), np.array([np.cos(heading), np.sin(heading)]))
