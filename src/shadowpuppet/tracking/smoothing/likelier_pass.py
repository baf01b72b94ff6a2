"""A film of two cameras tracked forward and backward: in each frame the pass that is likelier, with the doubt that leaves.

The silhouettes of two cameras allow a front and a back, and nearly the same seen from the left and the right. A pass that has taken a wrong
one stays with it, and the other pass comes from the other side. Which of them is right is a hidden state with two values; its odds in a
frame are those of all frames, before and after (Rabiner 1989, forward-backward procedure). Poses are not mixed: what is between two fronts
is neither.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import joints_of_limbs
from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.smoothing.both_ways import mixed_deviations


def likelier(forward: Motion, backward: Motion, per_cost: float, limits: Mapping[str, float]) -> tuple[Motion, Array]:
    """Two motions of the same frames as one, and the weight (T,), 0 or 1, of the backward one. `per_cost` as in `backward_odds`.

    Deviations are those of a mixture about the likelier pass. A limb that is `tracked` in it is `uncertain` where the other place of it
    takes a joint's deviation over the limit (m) for limbs of its kind (`limb_statuses`).
    """
    odds = backward_odds(forward, backward, per_cost)
    back, share = odds > 0, np.exp(-np.logaddexp(0.0, -odds))  # whether, and how probably, the backward pass is right
    chosen = {name: np.where(back.reshape(-1, *(1,) * (getattr(forward, name).ndim - 1)), getattr(backward, name), getattr(forward, name))
              for name in ("poses", "joints", "cost", "overlap", "status", "limb_status")}
    ahead, behind = ((motion.poses - chosen["poses"] + np.pi) % (2 * np.pi) - np.pi for motion in (forward, backward))
    pose_sd = mixed_deviations(share, (ahead, behind), (forward.pose_sd, backward.pose_sd), np.zeros_like(ahead))
    joint_sd = mixed_deviations(share, (forward.joints, backward.joints), (forward.joint_sd, backward.joint_sd), chosen["joints"])
    radius = np.sqrt((joint_sd**2).sum(2))
    for n, (limb, own) in enumerate(joints_of_limbs(forward.joint_names).items()):
        over = np.isfinite(odds) & (radius[:, own].max(1) > limits[limb.rpartition("_")[2]])
        chosen["limb_status"][over & (chosen["limb_status"][:, n] == "tracked"), n] = "uncertain"
    return replace(forward, pose_sd=pose_sd, joint_sd=joint_sd, **chosen), back.astype(float)


def backward_odds(forward: Motion, backward: Motion, per_cost: float) -> Array:
    """Log odds (T,) that the backward pass is right, by the costs of all frames; infinite where only one pass has a pose.

    `per_cost`: log odds of a pass whose body costs less by 1 m^2 for a second. A change from one pass to the other is the rarer the further
    their joints are apart in units of their stated deviations.
    """
    ahead, behind = forward.known, backward.known
    both = ahead & behind
    step = float(np.median(np.diff(forward.times))) if len(forward) > 1 else 0.0
    told = np.where(both, per_cost * step * (forward.cost - backward.cost), 0.0)
    apart = (backward.joints - forward.joints) ** 2 / (forward.joint_sd**2 + backward.joint_sd**2)
    change = -np.where(both, apart.sum(2).mean(1) / 2, 0.0)
    before, after = _carried(told, change), _carried(told[::-1], change[::-1])[::-1]
    return np.where(both, before + told + after, np.where(behind & ~ahead, np.inf, -np.inf))


def _carried(told: Array, change: Array) -> Array:
    """Log odds (T,) of each frame given all earlier frames, from every frame's evidence `told` (T,) and the log odds `change` (T,) that the
    right pass changes there."""
    out = np.zeros(len(told))
    for t in range(1, len(told)):
        odds, rare = out[t - 1] + told[t - 1], (change[t - 1] + change[t]) / 2
        out[t] = np.logaddexp(odds, rare) - np.logaddexp(0.0, odds + rare)
    return out
