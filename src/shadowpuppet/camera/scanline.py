"""Scanline rasterisation of convex polygons into bit masks: edges, row spans, setting and counting of bits. Kernels.

Masks are cut into strips of `ROWS` rows, bits `[word column][strip][row]`, 64 pixels of a row in a 64-bit word: one instruction works on
the eight words of a strip. Polygons come `BLOCK` at a time, the same corner of all side by side.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import config, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from shadowpuppet.jit import device, inline_kernel, kernel

ROWS = 8
"""Rows of a strip."""
Page = tuple[NDArray[np.uint64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int32]]
"""Bits (C, rows), rows rounded up to strips; range of dirty rows and words (first, end, first, end), outside which it is empty; and work
arrays for a polygon: its lines on the left and right (2, corners + 6, 2), and each row's first pixel and end (2, rows)."""
SNAP = 1e-9
"""An edge this near (pixels) to a pixel's centre passes through it, so that rounding does not decide which neighbour owns the pixel."""


@intrinsic
def _ctpop(typingctx, word):  # pragma: no cover
    """Population count of a 64-bit word: LLVM's ctpop, which vectorises."""

    def codegen(context, builder, signature, args):
        return builder.ctpop(args[0])

    return types.uint64(types.uint64), codegen


_popcount: Any = np.bitwise_count if config.DISABLE_JIT else _ctpop  # pyright: ignore[reportAttributeAccessIssue]


@kernel
def find_edges(X, Y, counts, width, height, boxes, lines):  # pragma: no cover
    """Boxes (S, 6, B) and edge lines (S, K, 3, B) of polygons with corners X, Y (S, K, B), `counts` (S, B) of them. A box: first row,
    end of rows, least and greatest x; no rows if nothing is visible. A line: x in the first row of the box's first strip, x increment
    per row, and its side: negative bounds the polygon on the left, positive on the right, 0 not at all."""
    size = X.shape[2]
    for s in range(X.shape[0]):
        x, y, box, count = X[s], Y[s], boxes[s], 0
        area, base = box[4], box[5]
        for n in range(size):
            count = max(count, counts[s, n])
        _enclose(x, y, count, box, area)
        for n in range(size):
            top, bottom, a = np.ceil(max(box[0, n], 0.0)), np.ceil(min(box[1, n], height)), abs(area[n])
            seen = (a >= 1e-9) & (a < 1e30) & (box[2, n] < width) & (box[3, n] >= 0)  # not edge-on, no number, or outside
            box[0, n], box[1, n] = (top, bottom) if seen & (counts[s, n] > 0) else (0.0, 0.0)
            base[n] = ROWS * np.floor(box[0, n] / ROWS)
        for v in range(X.shape[1]):
            w, line = v + 1 if v + 1 < count else 0, lines[s, v]
            if v < count:
                _follow(x[v], y[v], x[w], y[w], base, area, line[0], line[1], line[2])
            else:
                for n in range(size):
                    line[2, n] = 0.0


@device
def _follow(x, y, to_x, to_y, base, area, start, slope, side):  # pragma: no cover
    """Lines (B,) of the edges from one corner to the next: x in row `base`, x increment per row, side."""
    for n in range(x.size):
        dy = to_y[n] - y[n]
        slope[n] = (to_x[n] - x[n]) / (dy if dy != 0 else 1.0)
        side[n] = dy * area[n]
        start[n] = x[n] + (base[n] - y[n]) * slope[n] - SNAP


@device
def _enclose(x, y, count, box, area):  # pragma: no cover
    """Least and greatest y and x of the first `count` corners x, y (K, B) into box (4, B), and twice the signed area (B,)."""
    top, bottom, west, east = box[0], box[1], box[2], box[3]
    for n in range(area.size):
        area[n], top[n], bottom[n], west[n], east[n] = 0.0, y[0, n], y[0, n], x[0, n], x[0, n]
    for v in range(count):
        w = v + 1 if v + 1 < count else 0
        a, b, c, d = x[v], y[v], x[w], y[w]
        for n in range(area.size):
            area[n] += a[n] * d[n] - c[n] * b[n]
            top[n], bottom[n] = min(top[n], b[n]), max(bottom[n], b[n])
            west[n], east[n] = min(west[n], a[n]), max(east[n], a[n])


@device
def _cut(lefts, rights, width, begin, stop, rows, again, first, end):  # pragma: no cover
    """First pixel and end of each row's span between three lines on the left and three on the right, (3, 2) each: x, x increment per
    row. Rows before `begin` and from `stop` on are empty. `again`: intersect with the spans that are there already."""
    x0, x1, x2 = lefts[0, 0], lefts[1, 0], lefts[2, 0]
    s0, s1, s2 = lefts[0, 1], lefts[1, 1], lefts[2, 1]
    y0, y1, y2 = rights[0, 0], rights[1, 0], rights[2, 0]
    t0, t1, t2 = rights[0, 1], rights[1, 1], rights[2, 1]
    for r in range(rows):
        k = np.float64(r)
        a = min(max(max(x0 + k * s0, x1 + k * s1), max(x2 + k * s2, 0.0)), width)
        b = max(min(min(y0 + k * t0, y1 + k * t1), min(y2 + k * t2, width)), 0.0)
        i, j = np.int32(np.ceil(a)), np.int32(np.ceil(b))
        j = j if (r >= begin) & (r < stop) else np.int32(0)
        first[r] = max(first[r], i) if again else i
        end[r] = min(end[r], j) if again else j


@device
def _sort_lines(lines, n, width, lefts, rights):  # pragma: no cover
    """Lines (K, 3, B) of polygon `n` sorted into left and right, (K + 3, 2) each; returns the larger number. Both sides are padded to
    three more than that number, with lines that bound nothing."""
    nl, nr = 0, 0
    for v in range(lines.shape[0]):
        x, slope, side = lines[v, 0, n], lines[v, 1, n], lines[v, 2, n]
        lefts[nl, 0], lefts[nl, 1], rights[nr, 0], rights[nr, 1] = x, slope, x, slope
        nl += side < 0
        nr += side > 0
    most = max(nl, nr)
    for v in range(nl, most + 3):
        lefts[v, 0], lefts[v, 1] = 0.0, 0.0
    for v in range(nr, most + 3):
        rights[v, 0], rights[v, 1] = width, 0.0
    return most


@inline_kernel
def draw_outline(s, n, boxes, lines, width, page):  # pragma: no cover
    """Set the bits of polygon `n` of shape `s` on a page, and extend the page's dirty range. A row's span is the intersection of all
    edges' half planes, so the edges' lines may be extended past their ends."""
    bits, dirty, lefts, rights, first, end = page[0], page[1], page[2][0], page[2][1], page[3][0], page[3][1]
    r0, r1 = np.int64(boxes[s, 0, n]), np.int64(boxes[s, 1, n])
    if r1 <= r0:
        return
    most = _sort_lines(lines[s], n, width, lefts, rights)
    start = r0 - r0 % ROWS
    rows = (r1 - start + ROWS - 1) // ROWS * ROWS
    _cut(lefts, rights, width, r0 - start, r1 - start, rows, False, first, end)
    for v in range(3, most, 3):
        _cut(lefts[v:], rights[v:], width, r0 - start, r1 - start, rows, True, first, end)
    c0, c1 = np.int64(max(boxes[s, 2, n], 0.0)) >> 6, (np.int64(min(np.ceil(boxes[s, 3, n]), width)) + 63) >> 6
    one, full = np.uint64(1), np.uint64(0xFFFFFFFFFFFFFFFF)
    for c in range(c0, c1):
        column = bits[c, start : start + rows]
        for r in range(rows):
            i, j = min(max(np.int64(first[r]) - 64 * c, 0), 64), min(max(np.int64(end[r]) - 64 * c, 0), 64)
            before = (one << np.uint64(i & 63)) - one if i < 64 else full
            until = (one << np.uint64(j & 63)) - one if j < 64 else full
            column[r] |= until & ~before
    dirty[0], dirty[1] = min(dirty[0], start), max(dirty[1], start + rows)
    dirty[2], dirty[3] = min(dirty[2], c0), max(dirty[3], c1)


@inline_kernel
def count_and_clear(outside, inside, page):  # pragma: no cover
    """Number of a page's bits set in `outside` less those set in `inside`, (C, rows) each; clears the page."""
    bits, dirty = page[0], page[1]
    total = np.int64(0)
    for c in range(dirty[2], dirty[3]):
        column, out, within = bits[c, dirty[0] : dirty[1]], outside[c, dirty[0] : dirty[1]], inside[c, dirty[0] : dirty[1]]
        for r in range(column.size):
            total += np.int64(_popcount(column[r] & out[r])) - np.int64(_popcount(column[r] & within[r]))
        for r in range(column.size):
            column[r] = 0
    clean(page)
    return total


@device
def clean(page):  # pragma: no cover
    """Mark a page as empty."""
    bits, dirty = page[0], page[1]
    dirty[0], dirty[1], dirty[2], dirty[3] = bits.shape[1], 0, bits.shape[0], 0


def make_page(words: int, height: int, corners: int) -> Page:
    """An empty page of `words` x 64 columns and `height` rows for polygons of up to `corners` corners."""
    rows = (height + ROWS - 1) // ROWS * ROWS
    return (np.zeros((words, rows), np.uint64), np.array([rows, 0, words, 0]), np.empty((2, corners + 6, 2)), np.empty((2, rows), np.int32))
