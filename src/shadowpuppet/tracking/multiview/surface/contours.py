"""Contours of a mask as closed polygons between its pixels, and which of their vertices are a person's outline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask
from shadowpuppet.jit import compiled

Array = NDArray[np.float64]

SMOOTHING_ROUNDS = 2
"""Rounds of smoothing with weights 1 4 6 4 1, which removes the pixels' stairs; a circle of 10 pixels' radius shrinks by less than 0.1."""
VERTEX_STRIDE = 2
"""Every `VERTEX_STRIDE`-th smoothed vertex is kept."""
TANGENT_ARM = 2
"""A tangent spans this many kept vertices on either side."""
SAFE_DISTANCE = 2 * SMOOTHING_ROUNDS + VERTEX_STRIDE * TANGENT_ARM
"""Vertices nearer than this to unknown pixels are neither smoothed nor counted as a person's outline."""
BORDER_STRIDE = 16
"""Along the picture's border every `BORDER_STRIDE`-th vertex is kept, and every corner."""
INSIDE, UNKNOWN, VISITED = (1 << bit for bit in range(3))
"""Bits of a pixel while contours are followed."""


class Contours(NamedTuple):
    """The boundary of a picture's empty area. To the right of its direction lies the person, or an unknown area."""

    points: Array
    """Vertices, of shape (N, 2), pixels, smoothed, about a pixel and a half apart; each polygon is closed."""
    starts: NDArray[np.int64]
    """Where each polygon's vertices start, and N at the end, of shape (M + 1,)."""
    person: NDArray[np.bool_]
    """Whether a vertex is on a person's outline, of shape (N,): not along or near the picture's border."""


def trace_contours(mask: Mask, seen: Mask | None = None) -> Contours:
    """Contours of a mask (H, W), including the picture's border where it is empty. Pixels that touch at a corner are connected.

    `seen`, of the same shape: the known pixels; default: all.
    """
    return Contours(*_smooth(*_follow(_cells(mask, seen))))


def _cells(mask: Mask, seen: Mask | None) -> NDArray[np.uint8]:
    """The mask's bits with a rim of unknown pixels, in rows of whole 64-bit words."""
    height, width = mask.shape
    cells = np.full((height + 2, -(-(width + 2) // 8) * 8), INSIDE | UNKNOWN, np.uint8)
    cells[1:-1, 1 : width + 1] = mask if seen is None else np.where(seen, mask, INSIDE | UNKNOWN)
    return cells


@compiled(nogil=True)
def _follow(cells):  # pragma: no cover
    """All boundaries between pixels inside and outside: centres of the pixels' sides, starts, and whether the inner pixel is a person's."""
    first = _left_sides(cells)
    total = 2 * first.size + _changes_down(cells)
    points, person = np.empty((total, 2)), np.empty(total, np.bool_)
    starts, m = np.zeros(first.size + 1, np.int64), 0
    flat = cells.reshape(-1)
    for at in first:
        if not flat[at] & VISITED:
            starts[m + 1] = _follow_one(flat, cells.shape[1], at, points, person, starts[m])
            m += 1
    return points, starts[: m + 1].copy(), person


@compiled(nogil=True)
def _left_sides(cells):  # pragma: no cover
    """Flat indices, row by row, of inside pixels with an outside pixel to the left; eight equal pixels are skipped at once."""
    words, whole = cells.view(np.uint64), np.uint64(0x0101010101010101)
    out, n = np.empty(cells.size // 2, np.int64), 0
    for row in range(1, cells.shape[0] - 1):
        before = whole
        for word in range(words.shape[1]):
            bits = words[row, word] & whole
            if bits != before or (bits != whole and bits != 0):
                for column in range(max(8 * word, 1), 8 * word + 8):
                    if cells[row, column] & INSIDE and not cells[row, column - 1] & INSIDE:
                        out[n] = row * cells.shape[1] + column
                        n += 1
            before = whole if cells[row, 8 * word + 7] & INSIDE else np.uint64(0)
    return out[:n].copy()


@compiled(nogil=True)
def _changes_down(cells):  # pragma: no cover
    """Number of pixels that differ from the one above."""
    total = 0
    for row in range(1, cells.shape[0]):
        for column in range(cells.shape[1]):
            total += int((cells[row, column] ^ cells[row - 1, column]) & INSIDE)
    return total


@compiled(nogil=True)
def _follow_one(flat, stride, at, points, person, n):  # pragma: no cover
    """Follow one boundary, from the left side of pixel `at` upward, with the inside to the right; (dx, dy) is the step. Returns the end."""
    x, y, dx, dy = at % stride, at // stride + 1, 0, -1
    while True:
        if dy < 0:
            if flat[at] & VISITED:
                return n
            flat[at] |= VISITED
        points[n, 0], points[n, 1] = x + 0.5 * dx - 1.5, y + 0.5 * dy - 1.5
        person[n] = flat[at] & UNKNOWN == 0
        n += 1
        x, y, ahead = x + dx, y + dy, at + dy * stride + dx
        left = ahead - dx * stride + dy
        if flat[left] & INSIDE:
            at, dx, dy = left, dy, -dx
        elif flat[ahead] & INSIDE:
            at = ahead
        else:
            dx, dy = -dy, dx


@compiled(nogil=True)
def _smooth(points, starts, person):  # pragma: no cover
    """Smooth the outlines and thin the vertices; along the picture's border only thin."""
    kept_points, kept_starts, kept_person, n = np.empty_like(points), np.zeros_like(starts), np.empty_like(person), 0
    for m in range(starts.size - 1):
        own = person[starts[m] : starts[m + 1]]
        firm, size = _far_from_others(own), own.size
        path = np.empty((size + 4, 2))  # two more at each end, so that it closes
        path[2:-2] = points[starts[m] : starts[m + 1]]
        for _ in range(SMOOTHING_ROUNDS if own.any() else 0):
            _close(path)
            last = path.copy()
            for k in range(2, size + 2):
                if firm[k - 2]:
                    for axis in range(2):
                        near, far = last[k - 1, axis] + last[k + 1, axis], last[k - 2, axis] + last[k + 2, axis]
                        path[k, axis] = (far + 4 * near + 6 * last[k, axis]) / 16
        _close(path)
        for k in range(size):
            straight = path[k + 1, 0] == path[k + 3, 0] or path[k + 1, 1] == path[k + 3, 1]
            if k % (VERTEX_STRIDE if own[k] else BORDER_STRIDE) == 0 or not (own[k] or straight):
                kept_points[n, 0], kept_points[n, 1], kept_person[n] = path[k + 2, 0], path[k + 2, 1], firm[k]
                n += 1
        kept_starts[m + 1] = n
    return kept_points[:n].copy(), kept_starts, kept_person[:n].copy()


@compiled(nogil=True)
def _close(path):  # pragma: no cover
    """Pad a closed path: its last two vertices before the first, its first two after the last (there may be only four)."""
    size = path.shape[0] - 4
    path[0], path[1] = path[size], path[size + 1]
    path[size + 2], path[size + 3] = path[2], path[3]


@compiled(nogil=True)
def _far_from_others(person):  # pragma: no cover
    """Which of a closed contour's vertices have only outline vertices within `SAFE_DISTANCE`."""
    size = person.size
    out = np.ones(size, np.bool_)
    if person.all() or not person.any():
        return person.copy()
    for step in (1, -1):
        since = SAFE_DISTANCE + 1
        for k in range(2 * size):  # around twice: what is before the start counts
            at = k % size if step > 0 else size - 1 - k % size
            since = since + 1 if person[at] else 0
            out[at] &= since > SAFE_DISTANCE
    return out
