"""Projection of points, and of quads and hulls of ellipsoids to convex polygons, for blocks of poses: kernels."""

from __future__ import annotations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.jit import device, kernel

DIRECTIONS = np.stack([np.cos(np.arange(10) * np.pi / 5), np.sin(np.arange(10) * np.pi / 5)], 1)
"""Directions in which a hull's outline is sampled: one corner of its polygon each."""
NEAR_PLANE = 0.05
"""Depth (m) at which shapes are clipped, so that nothing behind the camera is drawn."""
FARTHEST = 1e6
"""Pixels to which points far outside a picture are moved."""
Lens = tuple[Array, Array, bool, bool, float]
"""Matrix (3, 3); distortion (8,) or (4,); whether fisheye; whether there is any distortion; the radius on the plane z = 1 up to which it
is valid."""


def make_lens(camera: Camera) -> Lens:
    """A camera's parameters for kernels. Distortion polynomials are fitted inside the picture; beyond some radius they turn back, or
    mirror, and would map points far outside into the picture. There points are extrapolated in proportion."""
    bends = bool(camera.fisheye or camera.distortion.any())
    return camera.matrix, camera.distortion, camera.fisheye, bends, camera.reach


@device
def pixel_nearest(T, lens, x, y, z):  # pragma: no cover
    """Column and row of the pixel nearest to a world point, also outside the picture; `T`: world to camera (3, 4). Of a point at or behind
    the camera both are -1."""
    K, k, fisheye, bends, reach = lens
    ahead = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
    if ahead <= 1e-9:
        return -1, -1
    u = (T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]) / ahead
    v = (T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]) / ahead
    if bends:
        u, v = bend_within(u, v, k, fisheye, reach)
    u, v = min(max(K[0, 0] * u + K[0, 2], -FARTHEST), FARTHEST), min(max(K[1, 1] * v + K[1, 2], -FARTHEST), FARTHEST)
    return int(np.rint(u)), int(np.rint(v))


@kernel
def project_quads(T, begin, quads, joints, which, lens, X, Y, counts, work):  # pragma: no cover
    """Quads (1 or N, S, 4, 3) of a block of joints T (J, 3, 4, B), clipped at the near plane: corners X, Y (S, 5, B), `counts` (S, B).
    Unused corners repeat the last one. `quads` of N people: those from `begin` on. `work`: (12, B)."""
    size = X.shape[2]
    for i in range(which.size):
        q, behind = which[i], 0
        joint, along, down, count = T[joints[q, 0]], X[i], Y[i], counts[i]
        for v in range(4):
            x, y, z, u, w = work[3 * v], work[3 * v + 1], work[3 * v + 2], along[v], down[v]
            _move(joint, quads[:, q, v], begin, work[3 * v : 3 * v + 3])
            for n in range(size):
                behind += z[n] < NEAR_PLANE
                ahead = 1 / max(z[n], NEAR_PLANE)
                u[n], w[n] = x[n] * ahead, y[n] * ahead
        u, w, x, y = along[3], down[3], along[4], down[4]
        for n in range(size):
            count[n], x[n], y[n] = 4, u[n], w[n]
        if behind:
            for n in range(size):
                count[n] = _clip(work, n, along, down)
        _to_pixels(X[i], Y[i], lens)


@device
def _move(T, points, begin, place):  # pragma: no cover
    """One point (1, 3), or points of the people from `begin` on (N, 3), transformed by (3, 4, B) into `place` (3, B)."""
    for r in range(3):
        a, b, c, d, out = T[r, 0], T[r, 1], T[r, 2], T[r, 3], place[r]
        if points.shape[0] == 1:
            x, y, z = points[0, 0], points[0, 1], points[0, 2]
            for n in range(out.size):
                out[n] = a[n] * x + b[n] * y + c[n] * z + d[n]
        else:
            for n in range(out.size):
                m = min(begin + n, points.shape[0] - 1)
                out[n] = a[n] * points[m, 0] + b[n] * points[m, 1] + c[n] * points[m, 2] + d[n]


@kernel
def project_hulls(T, begin, centres, radii, numbers, joints, which, lens, X, Y, counts, work):  # pragma: no cover
    """Outlines of hulls of ellipsoids of a block of joints T (J, 3, 4, B): corners X, Y (S, K, B), `counts` (S, B), 0 if all is behind.

    In each direction the corner is the farthest point of the ellipsoids' projections. An ellipse of centre c and matrix M, the sum of s
    s' over its conjugate half axes s, reaches c + M n / h in direction n, h = sqrt(n' M n), and c - M n / h in the opposite one.
    `numbers` (S,): different ellipsoids of each shape. `work`: (5 E + 4, B).
    """
    half, room = DIRECTIONS.shape[0] // 2, work[work.shape[0] - 4 :]
    for i in range(which.size):
        q = which[i]
        for n in range(X.shape[2]):
            counts[i, n] = 0
        for e in range(numbers[q]):
            _look_like(T[joints[q, e]], begin, centres[:, q, e], radii[:, q, e], work[5 * e : 5 * e + 5], room, counts[i])
        for d in range(half):
            _reach_to(DIRECTIONS[d, 0], DIRECTIONS[d, 1], numbers[q], work, X[i, d], Y[i, d], X[i, d + half], Y[i, d + half])
        _to_pixels(X[i], Y[i], lens)


@device
def _look_like(T, begin, centres, radii, ellipse, room, counts):  # pragma: no cover
    """Fill `ellipse` (5, B), centre and matrix (xx, xy, yy): projections of ellipsoids, centres and radii (1 or N, 3). `room`: (4, B)."""
    x, y, z = room[0], room[1], room[2]
    _move(T, centres, begin, room[0:3])
    cx, cy, xx, xy, yy, near = ellipse[0], ellipse[1], ellipse[2], ellipse[3], ellipse[4], room[3]
    for n in range(x.size):
        counts[n] = DIRECTIONS.shape[0] if z[n] > NEAR_PLANE else counts[n]
        near[n] = 1 / max(z[n], NEAR_PLANE)
        cx[n], cy[n] = x[n] * near[n], y[n] * near[n]
        xx[n], xy[n], yy[n] = 0.0, 0.0, 0.0
    for a in range(3):
        right, down, ahead, r = T[0, a], T[1, a], T[2, a], x
        for n in range(x.size):
            r[n] = radii[0, a]
        if radii.shape[0] > 1:
            for n in range(x.size):
                r[n] = radii[min(begin + n, radii.shape[0] - 1), a]
        for n in range(x.size):
            u, v = r[n] * near[n] * (right[n] - cx[n] * ahead[n]), r[n] * near[n] * (down[n] - cy[n] * ahead[n])
            xx[n] += u * u
            xy[n] += u * v
            yy[n] += v * v


@device
def _reach_to(u, v, number, ellipses, x, y, other_x, other_y):  # pragma: no cover
    """The farthest points x, y (B,) of the first `number` ellipses in the direction (u, v) and in the opposite one."""
    for e in range(number):
        cx, cy, xx = ellipses[5 * e], ellipses[5 * e + 1], ellipses[5 * e + 2]
        xy, yy = ellipses[5 * e + 3], ellipses[5 * e + 4]
        for n in range(x.size):
            p, q = xx[n] * u + xy[n] * v, xy[n] * u + yy[n] * v
            scale = 1 / np.sqrt(max(u * p + v * q, 1e-300))
            p, q = p * scale, q * scale
            a, b, c, d = cx[n] + p, cy[n] + q, cx[n] - p, cy[n] - q
            if e > 0:
                a, b = (a, b) if (a - x[n]) * u + (b - y[n]) * v > 0 else (x[n], y[n])
                c, d = (c, d) if (c - other_x[n]) * u + (d - other_y[n]) * v < 0 else (other_x[n], other_y[n])
            x[n], y[n], other_x[n], other_y[n] = a, b, c, d


@device
def _clip(points, n, X, Y):  # pragma: no cover
    """Clip quad `n` of points (12, B) at the near plane: x / z and y / z of up to five corners into X, Y (5, B); returns their number."""
    m = 0
    for v in range(4):
        a, b = 3 * v, 3 * ((v + 1) & 3)
        z, after = points[a + 2, n], points[b + 2, n]
        if z >= NEAR_PLANE:
            X[m, n], Y[m, n] = points[a, n] / z, points[a + 1, n] / z
            m += 1
        if (z >= NEAR_PLANE) != (after >= NEAR_PLANE):
            s = (NEAR_PLANE - z) / (after - z)
            X[m, n] = (points[a, n] + s * (points[b, n] - points[a, n])) / NEAR_PLANE
            Y[m, n] = (points[a + 1, n] + s * (points[b + 1, n] - points[a + 1, n])) / NEAR_PLANE
            m += 1
    for v in range(m, 5):
        X[v, n], Y[v, n] = (X[m - 1, n], Y[m - 1, n]) if m else (0.0, 0.0)
    return m


@device
def _to_pixels(X, Y, lens):  # pragma: no cover
    """Points (K, B) on the plane z = 1 to pixels, in place."""
    K, k, fisheye, bends, reach = lens
    for v in range(X.shape[0]):
        x, y = X[v], Y[v]
        if bends:
            for n in range(x.size):
                x[n], y[n] = bend_within(x[n], y[n], k, fisheye, reach)
        for n in range(x.size):
            x[n], y[n] = K[0, 0] * x[n] + K[0, 2], K[1, 1] * y[n] + K[1, 2]


@device
def bend_within(x, y, k, fisheye, reach):  # pragma: no cover
    """Distort a point on the plane z = 1. Edges between distorted corners stay straight: over a card the lens curves them little."""
    beyond = max(np.sqrt(x * x + y * y) / reach, 1.0)
    x, y = _bend(x / beyond, y / beyond, k, fisheye)
    return x * beyond, y * beyond


@device
def _bend(x, y, k, fisheye):  # pragma: no cover
    """OpenCV's distortion formulas."""
    if fisheye:
        r = np.sqrt(x * x + y * y)
        a = np.arctan(r)
        b = a * a
        s = a * (1 + b * (k[0] + b * (k[1] + b * (k[2] + b * k[3])))) / r if r > 1e-9 else 1.0
        return s * x, s * y
    r = x * x + y * y
    s = (1 + r * (k[0] + r * (k[1] + r * k[4]))) / (1 + r * (k[5] + r * (k[6] + r * k[7])))
    return x * s + 2 * k[2] * x * y + k[3] * (r + 2 * x * x), y * s + k[2] * (r + 2 * y * y) + 2 * k[3] * x * y
