"""Labels of pixels by belief propagation, and what it rests on: costs of neighbours, modes, ranks."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from shadowpuppet.silhouette.recovery.labelling import COSTS, NEVER, label_pixels, pair_costs
from shadowpuppet.silhouette.recovery.modes import ranked

STEP, OUTLINE, UNSEEN, SCALE = COSTS.tolist()


@pytest.mark.parametrize("count", [3, 60, 256])
def test_a_rank_is_that_of_the_sorted_values(rng, count):
    images = rng.integers(0, 256, (count, 11, 5, 3)).astype(np.uint8)
    images[:, 0] = images[0, 0]
    for rank in (0, count // 2, count - 1):
        np.testing.assert_array_equal(ranked(list(images), rank), np.sort(images, axis=0)[rank])


def likeness(one, other) -> float:
    return 1 / (1 + SCALE * float(((one - other) ** 2).sum()))


def between(colours, shares, one, other) -> float:
    """Cost of labels of two neighbours with modes of `colours` (2, K, 3) and `shares` (2, K)."""
    covered = shares.shape[1]
    if one == other == covered:
        return 0.0
    if one < covered and other < covered:
        return STEP * (1 - likeness(colours[0, one], colours[1, other]))
    side, label = (1, other) if one == covered else (0, one)
    alike = sum(share * likeness(colours[side, label], colour) for share, colour in zip(shares[1 - side], colours[1 - side]))
    return OUTLINE + (UNSEEN - OUTLINE) * min(alike, 1.0)


@pytest.mark.kernels
def test_costs_of_neighbours_and_labels_are_those_of_plain_loops(rng):
    """In a row of pixels belief propagation is exact: the labels are the best of all."""
    width, modes = 5, 2
    colour = rng.uniform(0, 60, (1, width, modes, 3)).astype(np.float32)
    share = np.broadcast_to(np.array([0.7, 0.3], np.float32), (1, width, modes)).copy()
    cost = rng.uniform(0, 2, (1, width, modes + 1)).astype(np.float32)
    cost[0, 2, 1] = NEVER
    undecided = np.ones((1, width), bool)
    pairs = pair_costs(colour, share, undecided)
    for x, j, k in itertools.product(range(width - 1), range(modes + 1), range(modes + 1)):
        assert pairs[0, 0, x, j, k] == pytest.approx(between(colour[0, x : x + 2], share[0, x : x + 2], j, k), rel=1e-4)
    assert not pairs[1].any()
    total = {labels: sum(cost[0, x, label] for x, label in enumerate(labels))
             + sum(between(colour[0, x : x + 2], share[0, x : x + 2], *labels[x : x + 2]) for x in range(width - 1))
             for labels in itertools.product(range(modes + 1), repeat=width)}
    for turned in (False, True):
        arrays = [each.swapaxes(0, 1).copy() if turned else each for each in (colour, share, undecided, cost)]
        labels = label_pixels(pair_costs(*arrays[:3]), arrays[3], arrays[2])
        assert tuple(labels.ravel().tolist()) == min(total, key=lambda each: total[each])
