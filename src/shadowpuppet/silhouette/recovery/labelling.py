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
"""Cost of a label that a pixel cannot have."""


def label_pixels(colour: Floats, share: Floats, cost: Floats, undecided: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The labels (H, W) of least cost: the number of the mode that is the scene, or K for pixels that are always covered.

    colour, share: modes (H, W, K, 3) and their shares (H, W, K). cost: that of each label (H, W, K + 1); `NEVER` where it is impossible.
    undecided: pixels (H, W) with more than one possible label.
    """
    from shadowpuppet.silhouette.recovery._kernels import send

    messages = np.zeros((4, *cost.shape), np.float32)
    work = np.empty((2, cost.shape[2]), np.float32)
    for _ in range(SWEEPS):
        for direction in range(4):
            send(direction, COSTS, colour, share, cost, undecided, messages, work)
    return (cost + messages.sum(axis=0)).argmin(axis=2)
