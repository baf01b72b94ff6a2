"""Keypoints in Gauss-Newton: landmarks are pulled to the rays on which a detector sees them (not in Ni 2008)."""

from __future__ import annotations

from shadowpuppet.jit import kernel
from shadowpuppet.tracking.keypoints.likelihood import attraction, sides, sum_surprises
from shadowpuppet.tracking.multiview.refinement.free_space import add_equation, placed


@kernel
def pull_to_rays(T, landmarks, sights, weight, origin, sums, places, logs, adding):  # pragma: no cover
    """The surprise of the keypoints times `weight`, under transforms T (J, 3, 4); if `adding`, also add to the joints' sums of the normal
    equations two rows a keypoint and side, across its ray. The weights are the derivatives of the surprise by squared distances, times
    the probability of the side, so that the gradient is the surprise's own. Work arrays: places (K, 3), logs (C, 2, 2)."""
    joints, offsets, mirrored, limbs = landmarks
    total = 0.0
    if sights.landmarks.size == 0:
        return total
    for k in range(joints.size):
        places[k, 0], places[k, 1], places[k, 2] = placed(T[joints[k]], offsets[k])
    sum_surprises(places, mirrored, limbs, sights, logs)
    for c in range(logs.shape[0]):
        surprise, arms, legs = sides(logs[c])
        total += weight * surprise
        logs[c, 0, 0], logs[c, 1, 0] = arms, legs
    if not adding:
        return total
    for m in range(sights.landmarks.size):
        said = sights.landmarks[m]
        exchanged, at = logs[sights.cameras[m], limbs[said], 0], sights.origins[m]
        for side in range(2):
            k = mirrored[said] if side == 1 else said
            share = exchanged if side == 1 else 1 - exchanged
            x, own = places[k], sums[joints[k]]
            pull = weight * share * attraction(x, m, sights)
            for i in range(2):
                n = sights.across[m, i]
                away = n[0] * (at[0] - x[0]) + n[1] * (at[1] - x[1]) + n[2] * (at[2] - x[2])
                add_equation(n[0], n[1], n[2], x[0] - origin[0], x[1] - origin[1], x[2] - origin[2], pull, away, own)
    return total
