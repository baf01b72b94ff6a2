"""Mirrored poses."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Skeleton


def mirrored(skeleton: Skeleton, poses: np.ndarray) -> np.ndarray:
    """Poses (N, D) mirrored left to right."""
    names = skeleton.dof_names
    swap = {"left": "right", "right": "left"}
    order = [names.index("_".join([swap.get(first, first), *rest])) for first, *rest in (name.split("_") for name in names)]
    signs = np.where(np.isin(names, ["torso_y", "torso_twist", "torso_bend"]), -1.0, 1.0)
    return poses[:, order] * signs
