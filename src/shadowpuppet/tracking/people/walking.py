"""Which way people walk: forwards, so that a body that is carried backwards faces the wrong way."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.geometry import Array

SECONDS, LEAST_WAY = 1.0, 0.6
"""Time looked back on, and the way (m) that a person must have gone in it."""
ALONG = 0.7
"""Mean cosine between the way gone and where the body faces from which on a person walks forwards; below its negative the body is carried
backwards."""


TURN_SECONDS, TURN = 0.7, np.radians(110)
"""Time and angle (rad) of a turn that is quicker than people turn: a body may be taken for one that faces the other way."""


class Step(NamedTuple):
    """Where a person was and faced."""

    time: float
    """Seconds."""
    place: Array
    """On the floor plan, of shape (2,), metres."""
    facing: Array
    """Direction of the trunk on the floor plan, of shape (2,)."""


def step_of(body: Body, pose: Array, time: float) -> Step:
    """Where a pose (D,) is and faces."""
    x, y, _, heading = pose[body.skeleton.dof_indices(GLOBAL_DOFS)].tolist()
    return Step(time, np.array([x, y]), np.array([np.cos(heading), np.sin(heading)]))


class Walk:
    """The last second of a person's way."""

    def __init__(self) -> None:
        """Nothing is known."""
        self.steps = deque[Step]()

    def add(self, step: Step) -> None:
        """One more frame; earlier than `SECONDS` is forgotten."""
        self.steps.append(step)
        while step.time - self.steps[0].time > SECONDS + 1e-6:
            self.steps.popleft()

    def forget(self) -> None:
        """Begin again, as after the body was turned round."""
        self.steps.clear()

    def lose(self) -> None:
        """Begin again after the last step, as where the body is lost: found again, it may be turned round."""
        while len(self.steps) > 1:
            self.steps.popleft()

    @property
    def jerked(self) -> float | None:
        """When (s) the body began to turn more quickly than people turn; None if it did not within `TURN_SECONDS`."""
        now = self.steps[-1]
        far = [step.time for step in self.steps if now.time - step.time <= TURN_SECONDS and step.facing @ now.facing < np.cos(TURN)]
        return max(far, default=None)

    @property
    def forward(self) -> float:
        """Mean cosine, over `SECONDS`, between the way gone and where the body faces; 0 if it went less than `LEAST_WAY`."""
        if len(self.steps) < 3 or self.steps[-1].time - self.steps[0].time < 0.8 * SECONDS:
            return 0.0
        way = self.steps[-1].place - self.steps[0].place
        length = float(np.linalg.norm(way))
        facing = np.mean([step.facing for step in self.steps], axis=0)
        return float(facing @ way) / length if length >= LEAST_WAY else 0.0
