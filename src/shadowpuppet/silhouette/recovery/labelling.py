"""Which of its temporal modes shows the scene, for every pixel at once: a Markov random field on the picture, by belief propagation.

Labels of a pixel: one of its modes is the scene, or the person covers it in all frames (label `COUNT`). Neighbouring pixels of the scene
have similar colours; a person's outline lies at an edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats

TOLERANCE = 20.0
"""Difference of neighbouring colours, grey levels, at which a third of their likeness is lost."""
STEP = 2.0
"""Cost of two neighbours of the scene whose colours differ."""
OUTLINE, UNSEEN_OUTLINE = 1.0, 2.5
"""Cost of an outline between a pixel of the scene and one that is always covered: at an edge, and between like colours."""
COSTS = np.array([STEP, OUTLINE, UNSEEN_OUTLINE, 0.5 / TOLERANCE**2], np.float32)
SWEEPS = 10
"""Rounds of messages to the right, left, down and up."""
NEVER = 1e9
"""Cost of a label that a pixel cannot have; from half of it on, a sum of costs is taken for that."""


def pair_costs(colour: Floats, share: Floats, undecided: NDArray[np.bool_]) -> Floats:
    """The cost of the labels of a pixel and its neighbour, (2, H, W, K + 1, K + 1): the one to the right, and the one below.

    colour, share: modes (H, W, K, 3) and their shares (H, W, K). undecided: pixels (H, W) with more than one possible label.
    """
    from shadowpuppet.silhouette.recovery import _kernels

    between = np.zeros((2, *undecided.shape, share.shape[2] + 1, share.shape[2] + 1), np.float32)
    _kernels.pair_costs(COSTS, colour, share, undecided, between)
    return between


def label_pixels(between: Floats, cost: Floats, undecided: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The labels (H, W) of least cost: the number of the mode that is the scene, or K for pixels that are always covered.

    between: the costs of neighbours, of `pair_costs`. cost: that of each label (H, W, K + 1); `NEVER` where it is impossible.
    undecided: pixels (H, W) with more than one possible label.
    """
    from shadowpuppet.silhouette.recovery._kernels import send

    messages = np.zeros((4, *cost.shape), np.float32)
    work = np.empty((2, cost.shape[2]), np.float32)
    for _ in range(SWEEPS):
        for direction in range(4):
            send(direction, between, cost, undecided, messages, work)
    return (cost + messages.sum(axis=0)).argmin(axis=2)
