"""Doubt about a frame's estimate: standard deviations of joints and degrees of freedom, and a status for every limb."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import Mode
from shadowpuppet.tracking.doubt.limbs import beyond
from shadowpuppet.tracking.doubt.variance import Components, turned, variance_model

STEP = 1e-4
"""Step (rad or m) of the derivatives of joints by degrees of freedom."""
UNBOUNDED = 1.0
"""Standard deviation (m or rad) of a degree of freedom without limits that moves no joint."""
UNSEEN = 0.7
"""Share of a limb that no silhouette shows from which on a doubtful limb is `predicted`."""
Points = Callable[[Array], Array]
"""From poses (N, D) to landmarks (N, L, 3), metres."""


class Evidence(NamedTuple):
    """What a frame shows about the accuracy of its estimate."""

    components: Components
    """Lengths (L, 3), metres, by name."""
    unseen: Mapping[str, float]
    """Share of each limb that no silhouette shows: hidden before or behind the body, or outside the picture."""
    frozen: bool = False
    """Whether the picture has not changed for longer than repeated frames explain."""
    modes: tuple[Mode, ...] = ()
    """Other places of limbs, of all landmarks."""


class Doubt(NamedTuple):
    """How far a frame's estimate may be off."""

    joint_sd: Array
    """Standard deviations of the landmarks along the world's axes, of shape (L, 3), metres."""
    pose_sd: Array
    """Standard deviations of the degrees of freedom, of shape (D,), rad or m."""
    limb_status: tuple[str, ...]
    """Of `motion.STATUSES`, for each of the limbs that the landmarks belong to."""
    modes: tuple[Mode, ...] = ()
    """Other places of limbs that the pictures allow."""


def state_doubt(kind: str, evidence: Evidence, names: Sequence[str], skeleton: Skeleton, points: Points, pose: Array, status: str,
                R: Array) -> Doubt:
    """Doubt about a pose (D,).

    `kind`: of the calibrated model, `monocular` or `multiview`; `names`: of the landmarks; `points`: from poses to landmarks along the axes
    of the evidence's components; `status`: the frame's; `R` (3, 3) takes vectors from those axes to the world's.
    """
    model = variance_model(kind)
    sd = model.sd(names, evidence.components)
    statuses = limb_statuses(model.limits, names, sd, evidence, status)
    pose_sd = pose_deviations(skeleton, points, pose, sd, model.dof_factors(skeleton.dof_names))
    return Doubt(turned(sd, R), pose_sd, statuses, evidence.modes)


def pose_deviations(skeleton: Skeleton, points: Points, pose: Array, sd: Array, factors: Array | float = 1.0) -> Array:
    """Standard deviations (D,) of a pose's degrees of freedom, from those of its landmarks, `sd` (L, 3), metres.

    To first order the landmarks tell J' diag(1/sd^2) J, to which is added what the joints' limits tell (uniform between them): a degree
    of freedom that moves no landmark, such as the roll of a straight arm, may be anywhere between its limits. Landmarks err together,
    though, for which the deviations are multiplied by calibrated `factors` (D,); they stay below those of the limits.
    """
    number = len(pose)
    moved = points(np.concatenate([pose[None], pose + STEP * np.eye(number)]))
    jacobian = ((moved[1:] - moved[0]) / STEP / sd).reshape(number, -1)
    width = limit_deviations(skeleton.limits)
    return np.minimum(factors * np.sqrt(np.diag(np.linalg.inv(jacobian @ jacobian.T + np.diag(1 / width**2)))), width)


def limit_deviations(limits: tuple[Array, Array]) -> Array:
    """Standard deviations (D,) of degrees of freedom that may be anywhere between their limits, lowest and highest (D,)."""
    low, high = limits
    return np.maximum(np.where(np.isfinite(high - low), (high - low) / np.sqrt(12), UNBOUNDED), STEP)


def limb_statuses(limits: Mapping[str, float], names: Sequence[str], sd: Array, evidence: Evidence, status: str) -> tuple[str, ...]:
    """Status of each limb from the deviations (L, 3), metres, of its joints, named `names`.

    `tracked`, but `uncertain` if the frame's `status` is, or a joint's deviation, all axes together, is over the limit (m) for limbs of its
    kind; or `predicted` if moreover most of the limb is unseen. All are `predicted` if the picture is frozen.
    """
    if evidence.frozen:
        return ("predicted",) * len(limbs_of(names))
    doubted = ["predicted" if evidence.unseen.get(limb, 0.0) > UNSEEN else "uncertain" for limb in limbs_of(names)]
    sure = [status == "tracked" and not off for off in beyond(limits, names, sd)]
    return tuple("tracked" if each else other for each, other in zip(sure, doubted))
