"""People who walk, with heels and toes, of known cadence, stride and width."""

from __future__ import annotations

import numpy as np

from shadowpuppet.motion.motion import JointTable
from shadowpuppet.synthetic import Mannequin
from shadowpuppet.synthetic.movement.gait import PathWalk
from shadowpuppet.synthetic.movement.sequence import SOFT_LIMIT
from shadowpuppet.synthetic.person.kinematics import pose_over
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.truth import SOLES, sole_points

RATE = 60.0


def walking(path: str = "line", size: float = 300.0, seconds: float = 12.0, jogging: bool = False,
            speed: float | None = None) -> tuple[PathWalk, JointTable]:  # fmt: skip
    """A walk far from its start and end, and its joints and soles; `path` and `size` as `synthetic.movement.paths.Path` has them."""
    body = Mannequin()
    walk = PathWalk(body, seconds + 6, np.random.default_rng(5), jogging, speed, path, size)  # pyright: ignore[reportArgumentType]
    times = np.arange(3.0, seconds + 3, 1 / RATE)
    figure = pose_over(body, *walk.at(times), SOFT_LIMIT)
    return walk, JointTable(times - times[0], (*JOINTS, *SOLES), np.concatenate([figure.joints, sole_points(body, figure)], 1))
