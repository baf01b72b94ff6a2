"""Kernels of the recovery of a scene: temporal modes, and messages of belief propagation."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import compiled
from shadowpuppet.silhouette.recovery.labelling import NEVER


@compiled(nogil=True)
def find_modes(samples, counts, colour, share):
    """Modes of samples (P, N, 3) in units of the radius; `counts` (N,) is work space: neighbours among the remaining, or -1 if taken."""
    n = samples.shape[1]
    for p in range(samples.shape[0]):
        own = samples[p]
        for i in range(n):
            counts[i] = 0
        for i in range(n):
            for j in range(i + 1):
                if _near(own, i, own[j, 0], own[j, 1], own[j, 2]):
                    counts[i] += 1
                    if i != j:
                        counts[j] += 1
        for k in range(share.shape[1]):
            best = counts.argmax()
            if counts[best] < 0:
                break
            a, b, c, size = own[best, 0], own[best, 1], own[best, 2], 1
            for _ in range(2):
                a, b, c, size = _mean_near(own, counts, a, b, c)
            colour[p, k, 0], colour[p, k, 1], colour[p, k, 2], share[p, k] = a, b, c, max(size, 1) / n
            _take(own, counts, best, a, b, c)


@compiled(nogil=True)
def _near(own, i, a, b, c):
    """Whether sample i lies within the radius of a colour."""
    return (own[i, 0] - a) ** 2 + (own[i, 1] - b) ** 2 + (own[i, 2] - c) ** 2 < 1


@compiled(nogil=True)
def _mean_near(own, counts, a, b, c):
    """Mean and number of the remaining samples near a colour; the colour itself if there is none."""
    x, y, z, size = np.float32(0), np.float32(0), np.float32(0), 0
    for j in range(len(counts)):
        if counts[j] >= 0 and _near(own, j, a, b, c):
            x, y, z, size = x + own[j, 0], y + own[j, 1], z + own[j, 2], size + 1
    if size == 0:
        return a, b, c, size
    return x / np.float32(size), y / np.float32(size), z / np.float32(size), size


@compiled(nogil=True)
def _take(own, counts, best, a, b, c):
    """Take the samples near a colour, and sample `best`, out of the remaining ones, and count their neighbours off."""
    n = len(counts)
    for j in range(n):
        if counts[j] >= 0 and (j == best or _near(own, j, a, b, c)):
            counts[j] = -1
            for i in range(n):
                if counts[i] >= 0 and _near(own, i, own[j, 0], own[j, 1], own[j, 2]):
                    counts[i] -= 1


@compiled(nogil=True)
def pair_costs(costs, colour, share, undecided, between):
    """Costs of the labels of neighbours, between (2, H, W, L, L): of each pixel and the one to its right, and the one below it.

    costs (4,): of a step in the scene, of an outline at an edge, and between like colours; 0.5 over the squared tolerance of colours.
    """
    height, width = undecided.shape
    labels = between.shape[3]
    for way in range(2):
        for y in range(height - way):
            for x in range(width - 1 + way):
                v, u = y + way, x + 1 - way
                if undecided[y, x] or undecided[v, u]:
                    for j in range(labels):
                        for k in range(labels):
                            between[way, y, x, j, k] = _between(costs, colour[y, x], share[y, x], j, colour[v, u], share[v, u], k)


@compiled(nogil=True)
def send(direction, between, cost, undecided, messages, work):
    """Send messages from pixel to pixel in one direction: 0 right, 1 left, 2 down, 3 up. messages (4, H, W, L): by direction; `between` as
    `pair_costs` finds it."""
    height, width = undecided.shape
    across, along = (height, width) if direction < 2 else (width, height)
    against, forward = direction ^ 1, 1 - 2 * (direction % 2)
    total, sent = work[0], work[1]
    labels, never = len(total), np.float32(NEVER / 2)
    for a in range(across):
        for b in range(along - 1):
            at = b if forward == 1 else along - 1 - b
            y, x, v, u = (a, at, a, at + forward) if direction < 2 else (at, a, at + forward, a)
            if not (undecided[y, x] or undecided[v, u]):
                continue
            pair = between[direction // 2, min(y, v), min(x, u)]
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
                        if cost[y, x, j] < never:
                            sent[k] = min(sent[k], total[j] + (pair[j, k] if forward == 1 else pair[k, j]))
                    least = min(least, sent[k])
            for k in range(labels):
                messages[direction, v, u, k] = sent[k] - least if cost[v, u, k] < never else np.float32(0)


@compiled(nogil=True)
def _between(costs, colour, share, label, other_colour, other_share, other_label):
    """Cost of two neighbours' labels."""
    covered = len(share)
    if label == covered and other_label == covered:
        return np.float32(0)
    if label < covered and other_label < covered:
        return costs[0] * (1 - _likeness(costs[3], colour[label], other_colour[other_label]))
    if label == covered:
        return _outline(costs, other_colour[other_label], colour, share)
    return _outline(costs, colour[label], other_colour, other_share)


@compiled(nogil=True)
def _outline(costs, scene, colour, share):
    """Cost of an outline between the colour of the scene and a pixel that is always covered, with its modes."""
    alike = np.float32(0)
    for k in range(len(share)):
        if share[k] > 0:
            alike += share[k] * _likeness(costs[3], scene, colour[k])
    return costs[1] + (costs[2] - costs[1]) * min(alike, np.float32(1))


@compiled(nogil=True)
def _likeness(scale, one, other):
    """Likeness of two colours: 1 if they are equal, `scale` is 0.5 over the squared tolerance."""
    squared = (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2
    return np.float32(1) / (1 + scale * squared)
