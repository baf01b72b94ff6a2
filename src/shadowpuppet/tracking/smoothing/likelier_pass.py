"""A film of one camera or two tracked forward and backward: in each frame the pass that is likelier, with the doubt that leaves.

Few silhouettes allow several poses: a front and a back, nearly the same seen from the left and the right, an arm before the trunk. A pass
that has taken a wrong one stays with it, and the other pass comes from the other side. Which of them is right is a hidden state with two
values; its odds in a frame are those of all frames, before and after (Rabiner 1989, forward-backward procedure).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array, wrapped
from shadowpuppet.motion.motion import SCALARS, Motion
from shadowpuppet.tracking.doubt.limbs import beyond
from shadowpuppet.tracking.smoothing.projection import Points


def likelier(forward: Motion, backward: Motion, evidence: Array, points: Points, *, averaged: bool,
             limits: Mapping[str, float] | None = None, alone: NDArray[np.bool_] | None = None) -> tuple[Motion, Array]:
    """Two motions of the same frames as one, and the weight (T,), 0 or 1, of the backward one, which is 1 where it is the likelier.

    Args:
        evidence: log odds (T,), per second, of each frame alone that the backward pass is right.
        points: from poses (N, D) to the motion's joints (N, J, 3), metres, world.
        averaged: whether poses are means by weight; else those of the likelier pass, as what is between two fronts is neither.
        limits: a limb that is `tracked` in the likelier pass is `uncertain` where the other place of it takes it `beyond` these; None:
            statuses are those of the likelier pass.
        alone: frames (T,) in which the forward pass alone counts, if it has a pose.

    Deviations are those of a mixture.
    """
    odds = backward_odds(forward, backward, evidence, np.zeros(len(forward), bool) if alone is None else alone)
    back, share = odds > 0, np.exp(-np.logaddexp(0.0, -odds))  # whether, and how probably, the backward pass is right
    chosen = {name: np.where(back.reshape(-1, *(1,) * (getattr(forward, name).ndim - 1)), getattr(backward, name), getattr(forward, name))
              for name in ("poses", "joints", *SCALARS, "status", "limb_status")}
    both = np.isfinite(odds)
    if averaged:
        aside = wrapped(np.where(back[:, None], forward.poses, backward.poses) - chosen["poses"])
        chosen["poses"][both] += (np.where(back, 1 - share, share)[:, None] * aside)[both]
        chosen["joints"][both] = points(chosen["poses"][both])
    ahead, behind = (wrapped(motion.poses - chosen["poses"]) for motion in (forward, backward))
    pose_sd = _deviations(share, (ahead, behind), (forward.pose_sd, backward.pose_sd))
    ahead, behind = (motion.joints - chosen["joints"] for motion in (forward, backward))
    joint_sd = _deviations(share, (ahead, behind), (forward.joint_sd, backward.joint_sd))
    if limits is not None:
        over = both[:, None] & beyond(limits, forward.joint_names, joint_sd)
        chosen["limb_status"][over & (chosen["limb_status"] == "tracked")] = "uncertain"
    return replace(forward, pose_sd=pose_sd, joint_sd=joint_sd, **chosen), back.astype(float)


def backward_odds(forward: Motion, backward: Motion, evidence: Array, alone: NDArray[np.bool_]) -> Array:
    """Log odds (T,) that the backward pass is right, given the `evidence` (T,) of all frames; infinite where only one pass has a pose, or
    the forward pass counts `alone` (T,). A switch between the passes is less probable the larger the distance of their joints is relative
    to the stated deviations."""
    ahead, behind = forward.known, backward.known
    both = ahead & behind & ~alone
    step = float(np.median(np.diff(forward.times))) if len(forward) > 1 else 0.0
    own = np.where(both, step * evidence, 0.0)
    squares = (backward.joints - forward.joints) ** 2 / (forward.joint_sd**2 + backward.joint_sd**2)
    switch = -np.where(both, squares.sum(2).mean(1) / 2, 0.0)
    before, after = _carried(own, switch), _carried(own[::-1], switch[::-1])[::-1]
    return np.where(both, before + own + after, np.where(behind & ~ahead, np.inf, -np.inf))


def _carried(own: Array, switch: Array) -> Array:
    """Log odds (T,) of each frame given the frames before it (forward recursion), from the log odds of each frame alone, `own` (T,), and
    the log odds of a switch there, `switch` (T,)."""
    out = np.zeros(len(own))
    for t in range(1, len(own)):
        odds, rare = out[t - 1] + own[t - 1], (switch[t - 1] + switch[t]) / 2
        out[t] = np.logaddexp(odds, rare) - np.logaddexp(0.0, odds + rare)
    return out


def _deviations(share: Array, aside: tuple[Array, Array], sds: tuple[Array, Array]) -> Array:
    """Deviations (T, ...) of a mixture of two values that are `aside` of the mean (T, ...), with their own; `share` (T,) of the second.
    Where one has all of the weight the other may be unknown."""
    share = share.reshape(-1, *(1,) * (sds[0].ndim - 1))
    first, second = (sd**2 + value**2 for sd, value in zip(sds, aside))
    return np.sqrt(np.where(share == 0, first, np.where(share == 1, second, (1 - share) * first + share * second)))
