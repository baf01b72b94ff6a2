"""The blended surface of a synthetic person, in plain NumPy."""

from __future__ import annotations

import numpy as np

from shadowpuppet.synthetic.person.surface import GROUPS

LIGHTS = np.array([[0, -0.6, 0.8, 0.5], [0.6, -0.8, 0, 0.2], [0, 0, 0, 0.5]])


def naive_distance(points, surface, axes, origin, joints):
    """Distance to the blended surface in plain NumPy: all parts of a group, then the groups."""

    def smooth(a, b, k):
        return np.minimum(a, b) - np.maximum(k - np.abs(a - b), 0) ** 2 * 0.25 / k

    total = None
    for group in range(len(GROUPS)):
        limb = None
        for p in np.flatnonzero(surface.code[:, 0] == group):
            q = (points - origin[p]) @ axes[p]
            along = np.clip(q[:, 2] / surface.length[p], 0, 1) * (surface.table.shape[1] - 1)
            inverse = surface.table[p].copy()
            inverse[:, :2] = 1 / inverse[:, :2]
            a, b, x, y = (np.interp(along, np.arange(surface.table.shape[1]), inverse[:, k]) for k in range(4))
            beyond = q[:, 2] - np.clip(q[:, 2], 0, surface.length[p])
            c = np.where(q[:, 2] < 0, 1 / surface.caps[p, 0], 1 / surface.caps[p, 1])
            u = np.stack([(q[:, 0] - x) * a, (q[:, 1] - y) * b, beyond * c])
            d = ((u**2).sum(0) - np.sqrt((u**2).sum(0))) / np.sqrt(((u * [a, b, c]) ** 2).sum(0))
            limb = d if limb is None else smooth(limb, d, surface.blend[p])
        near = 0.06 * (1 - np.linalg.norm(points - joints[group, :3], axis=1) / joints[group, 3])
        if total is None:
            total = limb
        else:
            total = np.where(near > 1e-4, smooth(total, limb, np.maximum(near, 1e-4)), np.minimum(total, limb))
    return total
