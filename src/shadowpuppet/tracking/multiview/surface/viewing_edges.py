"""Viewing edges: the intervals of viewing rays that lie inside the silhouettes of the other cameras.

Interval arithmetic along each ray (Matusik et al. 2000, "Image-based visual hulls"). Silhouettes are polygons on the plane z = 1 of their
camera, where another camera's ray is a straight line. Runs of a polygon's sides that the line cannot cross are skipped by bounding circles.
A view denies a place on a ray if the place is in the empty area of its picture.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.projection import NEAR_PLANE, bend_within
from shadowpuppet.geometry import Array
from shadowpuppet.jit import compiled, kernel
from shadowpuppet.tracking.multiview.surface.contours import TANGENT_ARM

Indices = NDArray[np.int64]

FAR = 100.0
"""Length of a ray (m)."""
MIN_LENGTH = 1e-6
"""Shorter intervals of a ray (m) are rounding errors and left out."""
MIN_BASELINE = 1e-3
"""Cameras nearer to each other than this (m) do not carve each other's rays."""
CONFIRMING_VIEWS = 3
"""A place that one view denies is kept if at least this many others see the person there."""
RUN_LENGTH = 8
"""Sides of a contour per run."""


@compiled(nogil=True)
def straighten(points, starts, person, grid, width, height):  # pragma: no cover
    """Contours with the lens undone, closed; outward normals of the viewing planes, 0 where unknown; the end of each polygon."""
    polygons = starts.size - 1
    lines, outward = np.empty((points.shape[0] + polygons, 2)), np.zeros((points.shape[0] + polygons, 3))
    across, down = (grid.shape[1] - 1) / width, (grid.shape[0] - 1) / height
    n = 0
    for m in range(polygons):
        first, size = n, starts[m + 1] - starts[m]
        for k in range(size + 1):
            at = starts[m] + (k if k < size else 0)
            x, y = (points[at, 0] + 0.5) * across, (points[at, 1] + 0.5) * down
            c, r = min(int(x), grid.shape[1] - 2), min(int(y), grid.shape[0] - 2)
            x, y = x - c, y - r
            for axis in range(2):
                top = grid[r, c, axis] + x * (grid[r, c + 1, axis] - grid[r, c, axis])
                low = grid[r + 1, c, axis] + x * (grid[r + 1, c + 1, axis] - grid[r + 1, c, axis])
                lines[n, axis] = top + y * (low - top)
            n += 1
        for k in range(size if size > 3 * TANGENT_ARM else 0):
            if person[starts[m] + k]:
                before, after = first + (k - TANGENT_ARM) % size, first + (k + TANGENT_ARM) % size
                dx, dy = lines[after, 0] - lines[before, 0], lines[after, 1] - lines[before, 1]
                x, y = lines[first + k, 0], lines[first + k, 1]
                dz = dx * y - dy * x
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                if length > 0:
                    outward[first + k, 0], outward[first + k, 1], outward[first + k, 2] = dy / length, -dx / length, dz / length
    return lines, outward, starts + np.arange(polygons + 1)


@compiled(nogil=True)
def bounding_circles(lines, ends):  # pragma: no cover
    """Bounding circles (3, C) of runs of sides of closed polygons, and first side and end (C, 2) of each run."""
    count = 0
    for m in range(ends.size - 1):
        count += (ends[m + 1] - ends[m] - 1 + RUN_LENGTH - 1) // RUN_LENGTH
    circles, spans = np.empty((3, count)), np.empty((count, 2), np.int64)
    n = 0
    for m in range(ends.size - 1):
        for a in range(ends[m], ends[m + 1] - 1, RUN_LENGTH):
            b = min(a + RUN_LENGTH, ends[m + 1] - 1)
            x, y = (lines[a, 0] + lines[b, 0]) / 2, (lines[a, 1] + lines[b, 1]) / 2
            farthest = 0.0
            for k in range(a, b + 1):
                farthest = max(farthest, (lines[k, 0] - x) ** 2 + (lines[k, 1] - y) ** 2)
            circles[0, n], circles[1, n], circles[2, n] = x, y, np.sqrt(farthest) + 1e-9
            spans[n, 0], spans[n, 1] = a, b
            n += 1
    return circles, spans


@compiled(nogil=True)
def contour_length(lines, outward):  # pragma: no cover
    """Total length of the contours where rays may start."""
    total = 0.0
    for k in range(lines.shape[0] - 1):
        if outward[k].any():
            total += np.hypot(lines[k + 1, 0] - lines[k, 0], lines[k + 1, 1] - lines[k, 1])
    return total


@compiled(nogil=True)
def spaced_vertices(lines, outward, step):  # pragma: no cover
    """Indices of vertices about `step` apart along the contours."""
    out, n, passed = np.empty(lines.shape[0], np.int64), 0, step / 2
    for k in range(lines.shape[0] - 1):
        if outward[k].any():
            passed += np.hypot(lines[k + 1, 0] - lines[k, 0], lines[k + 1, 1] - lines[k, 1])
            if passed >= step:
                out[n] = k
                n += 1
                passed = min(passed - step, step)
    return out[:n]


def cut_rays(camera: Indices, rays: Array, relative: Array, lines: Array, spans: Indices, circles: Array, bounds: Indices, lenses: Array,
        tolerated: int = 0, longest: float = np.inf) -> tuple[Indices, Array]:
    """Viewing edges of rays (R, 3), z = 1, from views `camera` (R,): the index (E,) of each edge's ray, and its depths (E, 2).

    Args:
        relative: transforms (V, V, 4, 4) from view to view.
        lines: vertices (2, N) of all polygons.
        spans, circles: runs (C, 2) and their circles (3, C); view j's are those from `bounds[j]` to `bounds[j + 1]`.
        tolerated: number of views that may deny a place, on rays that have no viewing edge of at most `longest` (m) otherwise.
    """
    apart = np.linalg.norm(relative[:, :, :3, 3], axis=2) > MIN_BASELINE  # no view carves its own rays
    most = lines.shape[1] + 2  # each side is crossed at most once
    scratch = np.empty(most, np.int64), np.empty(most), np.empty((most, 2)), np.empty((2, most, 3))
    polygons = lines[0], lines[1], spans, circles, bounds
    room = 2 * len(rays) + most
    while True:
        ray, depths = np.empty(room, np.int64), np.empty((room, 2))
        count, done = _cut(camera, rays, relative, apart, polygons, lenses, tolerated, longest, scratch, ray, depths)
        if done:
            return ray[:count], depths[:count]
        room *= 4


@kernel
def _cut(camera, rays, relative, apart, polygons, lenses, tolerated, longest, scratch, ray, depths):  # pragma: no cover
    """Fill `ray` and `depths`; returns the number of edges, and whether the arrays had room for all."""
    count, pieces = 0, scratch[-1]
    for r in range(rays.shape[0]):
        i, u, v, level, before, short = camera[r], rays[r, 0], rays[r, 1], 0, count, False
        most = longest / np.sqrt(u * u + v * v + 1)
        if count + pieces.shape[1] > ray.size:
            return count, False
        while level <= tolerated and not short:
            count = before  # the next level has the same edges, and longer ones
            at, n = _leave(relative, i, apart, u, v, polygons, level, scratch)
            k, needed = 0, max(min(1, apart[i].sum()), (1 + CONFIRMING_VIEWS) * level)
            while k < n:
                lo, hi, k = _whole(pieces, at, n, k)
                found = lo > NEAR_PLANE and hi < FAR and hi - lo > MIN_LENGTH
                if found and _witnessed(relative, i, apart, u, v, (lo + hi) / 2, lenses, needed):
                    ray[count], depths[count, 0], depths[count, 1] = r, lo, hi
                    count += 1
                    short |= hi - lo <= most
            level += 1
    return count, True


@kernel
def _leave(relative, i, apart, u, v, polygons, level, scratch):  # pragma: no cover
    """Find the pieces of a ray (u, v, 1) of view i that at most `level` other views deny: pieces[at, :n]. Returns at and n."""
    bounds, denied, pieces = polygons[-1], scratch[2], scratch[3]
    at, n = 0, 1
    pieces[0, 0, 0], pieces[0, 0, 1], pieces[0, 0, 2] = NEAR_PLANE, FAR, 0
    for j in range(bounds.size - 1):
        if n > 0 and apart[i, j]:
            lo, hi = pieces[at, 0, 0], pieces[at, n - 1, 1]
            m = _deny(relative, i, j, u, v, lo, hi, polygons, scratch)
            n = _carve(pieces, at, n, denied, m, level)
            at = 1 - at
    return at, n


@kernel
def _whole(pieces, at, n, k):  # pragma: no cover
    """Start and end of piece k joined with adjacent pieces, and the index of the next."""
    lo, hi = pieces[at, k, 0], pieces[at, k, 1]
    k += 1
    while k < n and pieces[at, k, 0] == hi:
        hi = pieces[at, k, 1]
        k += 1
    return lo, hi, k


@kernel
def _deny(T, i, j, u, v, lo, hi, polygons, scratch):  # pragma: no cover
    """Depth intervals, between `lo` and `hi`, of a ray of view i that lie in empty area of view j: scratch[2][:M]. Returns M.

    s is the position along the ray's line in view j. A place is empty if an odd number of contour crossings come before it.
    """
    crossings, denied = scratch[1], scratch[2]
    ax, bx = T[i, j, 0, 3], T[i, j, 0, 0] * u + T[i, j, 0, 1] * v + T[i, j, 0, 2]
    ay, by = T[i, j, 1, 3], T[i, j, 1, 0] * u + T[i, j, 1, 1] * v + T[i, j, 1, 2]
    az, bz = T[i, j, 2, 3], T[i, j, 2, 0] * u + T[i, j, 2, 1] * v + T[i, j, 2, 2]
    nx, ny, c = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    norm = np.sqrt(nx * nx + ny * ny)
    if bz > 0:
        lo = max(lo, (NEAR_PLANE - az) / bz)
    elif bz < 0:
        hi = min(hi, (NEAR_PLANE - az) / bz)
    if lo >= hi or norm < 1e-12 or (bz == 0 and az < NEAR_PLANE):  # behind the view, or straight through its centre
        return 0
    nx, ny, c = nx / norm, ny / norm, c / norm
    au, bu = nx * ay - ny * ax, nx * by - ny * bx
    s, t = (au + lo * bu) / (az + lo * bz), (au + hi * bu) / (az + hi * bz)
    n = _cross(nx, ny, c, min(s, t), max(s, t), polygons, j, scratch)
    for k in range(n):
        at = crossings[k]  # rounding must not leave a sliver at an end
        crossings[k] = lo if at == s else hi if at == t else min(max((at * az - au) / (bu - at * bz), lo), hi)
    for k in range(0, n, 2):
        h = k if s < t else n - 2 - k
        denied[k // 2, 0], denied[k // 2, 1] = min(crossings[h], crossings[h + 1]), max(crossings[h], crossings[h + 1])
    return n // 2


@kernel
def _cross(nx, ny, c, low, high, polygons, j, scratch):  # pragma: no cover
    """Crossings of a line, nx x + ny y + c = 0, with the polygons between s = low and high, s = nx y - ny x; returns their number.

    For runs of sides wholly before `low` only the parity of the crossings counts: odd if a run's ends lie on different sides of the line.
    """
    x, y, spans, circles, bounds = polygons
    near, crossings = scratch[0], scratch[1]
    count = 0
    for q in range(bounds[j], bounds[j + 1]):
        u, v, radius = circles[0, q], circles[1, q], circles[2, q]
        near[count] = q
        count += (abs(nx * u + ny * v + c) <= radius) & (nx * v - ny * u - radius <= high)
    n, odd = 0, False
    for h in range(count):
        q = near[h]
        a, b = spans[q, 0], spans[q, 1]
        side = nx * x[a] + ny * y[a] + c
        if nx * circles[1, q] - ny * circles[0, q] + circles[2, q] < low:
            odd ^= (side >= 0) != (nx * x[b] + ny * y[b] + c >= 0)
            continue
        for k in range(a + 1, b + 1):
            before, side = side, nx * x[k] + ny * y[k] + c
            if (before >= 0) != (side >= 0):
                t = side / (side - before)
                s = nx * (y[k] + t * (y[k - 1] - y[k])) - ny * (x[k] + t * (x[k - 1] - x[k]))
                if s < low:
                    odd = not odd
                elif s < high:
                    crossings[n] = s
                    n += 1
    if odd:
        crossings[n] = low
        n += 1
    _sort(crossings, n)
    if n & 1:
        crossings[n] = high
        n += 1
    return n


@kernel
def _sort(values, n):  # pragma: no cover
    """Insertion sort of the first n values, usually few."""
    for k in range(1, n):
        value, h = values[k], k
        while h > 0 and values[h - 1] > value:
            values[h] = values[h - 1]
            h -= 1
        values[h] = value


@kernel
def _carve(pieces, at, n, denied, m, level):  # pragma: no cover
    """Split the pieces (start, end, number of views that deny it) in pieces[at, :n] by one more view, into pieces[1 - at]; those that
    more than `level` views deny are dropped. Returns their number."""
    count, h, to = 0, 0, 1 - at
    for k in range(n):
        z, end, times = pieces[at, k, 0], pieces[at, k, 1], pieces[at, k, 2]
        while z < end:
            while h < m and denied[h, 1] <= z:
                h += 1
            inside = h < m and denied[h, 0] <= z
            stop = min(end, denied[h, 1] if inside else denied[h, 0]) if h < m else end
            if times + inside <= level:
                pieces[to, count, 0], pieces[to, count, 1], pieces[to, count, 2] = z, stop, times + inside
                count += 1
            z = stop
    return count


@kernel
def _witnessed(T, i, apart, u, v, z, lenses, needed):  # pragma: no cover
    """Whether the place at depth z on a ray of view i is inside the pictures of at least `needed` other views."""
    for j in range(lenses.shape[0]):
        w = (T[i, j, 2, 0] * u + T[i, j, 2, 1] * v + T[i, j, 2, 2]) * z + T[i, j, 2, 3]
        if apart[i, j] and w >= NEAR_PLANE:
            x = ((T[i, j, 0, 0] * u + T[i, j, 0, 1] * v + T[i, j, 0, 2]) * z + T[i, j, 0, 3]) / w
            y = ((T[i, j, 1, 0] * u + T[i, j, 1, 1] * v + T[i, j, 1, 2]) * z + T[i, j, 1, 3]) / w
            if x * x + y * y < lenses[j, 7] ** 2:
                x, y = bend_within(x, y, lenses[j, 8:], lenses[j, 6] > 0, lenses[j, 7])
                x, y = lenses[j, 0] * x + lenses[j, 2], lenses[j, 1] * y + lenses[j, 3]
                needed -= -0.5 <= x < lenses[j, 4] - 0.5 and -0.5 <= y < lenses[j, 5] - 0.5
                if needed == 0:
                    return True
    return False
