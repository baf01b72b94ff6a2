"""Which of its temporal modes shows the scene, for every pixel at once: a Markov random field on the picture, by belief propagation.

Labels of a pixel: one of its modes is the scene, or the person covers it in all frames (label `COUNT`). Neighbouring pixels of the scene
have similar colours; a person's outline lies at an edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.jit import compiled
from shadowpuppet.silhouette.background import Floats

TOLERANCE = 20.0
"""Difference of neighbouring colours, grey levels, at which half or a third of their likeness is lost."""
STEP = 2.0
"""Cost of two neighbours of the scene whose colours differ."""
OUTLINE, UNSEEN_OUTLINE = 1.0, 2.5
"""Cost of an outline between a pixel of the scene and one that is always covered: at an edge, and between like colours."""
SWEEPS = 10
"""Rounds of messages to the right, left, down and up."""
NEVER = 1e9
"""Cost of a label that a pixel cannot have."""


def label_pixels(colour: Floats, share: Floats, cost: Floats, undecided: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The labels (H, W) of least cost: the number of the mode that is the scene, or K for pixels that are always covered.

    colour, share: modes (H, W, K, 3) and their shares (H, W, K). cost: that of each label (H, W, K + 1); `NEVER` where it is impossible.
    undecided: pixels (H, W) with more than one possible label.
    """
    messages = np.zeros((4, *cost.shape), np.float32)
    work = np.empty((2, cost.shape[2]), np.float32)
    for _ in range(SWEEPS):
        for direction in range(4):
            _send(direction, colour, share, cost, undecided, messages, work)
    return (cost + messages.sum(axis=0)).argmin(axis=2)


@compiled(nogil=True)
def _send(direction, colour, share, cost, undecided, messages, work):
    """Send messages from pixel to pixel in one direction: 0 right, 1 left, 2 down, 3 up. messages (4, H, W, L): by direction."""
    height, width = undecided.shape
    across, along = (height, width) if direction < 2 else (width, height)
    against, forward = direction ^ 1, 1 - 2 * (direction % 2)
    total, sent = work[0], work[1]
    labels, never = len(total), np.float32(0.5 * NEVER)
    for a in range(across):
        for b in range(along - 1):
            at = b if forward == 1 else along - 1 - b
            y, x, v, u = (a, at, a, at + forward) if direction < 2 else (at, a, at + forward, a)
            if not (undecided[y, x] or undecided[v, u]):
                continue
            for k in range(labels):
                total[k] = cost[y, x, k]
                for m in range(4):
                    if m != against:
                        total[k] += messages[m, y, x, k]
            least = never
            for k in range(labels):
                sent[k] = never
                if cost[v, u, k] < never:
                    for j in range(labels):
                        if cost[y, x, j] < never and total[j] < sent[k]:
                            sent[k] = min(sent[k], total[j] + _between(colour[y, x], share[y, x], j, colour[v, u], share[v, u], k))
                    least = min(least, sent[k])
            for k in range(labels):
                messages[direction, v, u, k] = sent[k] - least if cost[v, u, k] < never else np.float32(0)


@compiled(nogil=True)
def _between(colour, share, label, other_colour, other_share, other_label):
    """Cost of two neighbours' labels."""
    covered = len(share)
    if label == covered and other_label == covered:
        return np.float32(0)
    if label < covered and other_label < covered:
        return np.float32(STEP) * (1 - _likeness(colour[label], other_colour[other_label]))
    if label == covered:
        return _outline(other_colour[other_label], colour, share)
    return _outline(colour[label], other_colour, other_share)


@compiled(nogil=True)
def _outline(scene, colour, share):
    """Cost of an outline between the colour of the scene and a pixel that is always covered, with its modes."""
    alike = np.float32(0)
    for k in range(len(share)):
        if share[k] > 0:
            alike += share[k] * _likeness(scene, colour[k])
    return np.float32(OUTLINE) + np.float32(UNSEEN_OUTLINE - OUTLINE) * min(alike, np.float32(1))


@compiled(nogil=True)
def _likeness(one, other):
    """Likeness of two colours: 1 if they are equal, 2/3 at a difference of `TOLERANCE`."""
    squared = (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2
    return np.float32(1) / (1 + np.float32(0.5 / TOLERANCE**2) * squared)
