"""Pictures of quads and of hulls of ellipsoids as convex polygons, for many poses at once: what `rasterize` draws."""

from __future__ import annotations

import numba
import numpy as np

from shadowpuppet.camera import Camera
from shadowpuppet.geometry import Array

DIRECTIONS = np.stack([np.cos(np.arange(10) * np.pi / 5), np.sin(np.arange(10) * np.pi / 5)], 1)
"""Directions in which a hull's outline is taken: the corners of its polygon."""
NEAR = 0.05
"""What is nearer to the camera than this (m) is cut off, so that nothing behind it is drawn."""
STEPS = 1000
"""Angles off the optical axis at which a lens is tried."""
Lens = tuple[Array, Array, bool, bool, float]
"""Matrix (3, 3); distortion (8,) or (4,); whether it is a fisheye's; whether it bends; the radius on the plane z = 1 to which it holds."""


def make_lens(camera: Camera) -> Lens:
    """What the kernels know of a camera.

    Polynomials of distortion are fitted to the picture; somewhere outside it they turn back, or mirror, and would draw into the picture
    what lies far out. Where they turn they end here, and points go on outward in proportion.
    """
    bends = bool(camera.fisheye or camera.distortion.any())
    reach = float(_reach(camera.distortion, camera.fisheye)) if bends else np.inf
    return camera.matrix, camera.distortion, camera.fisheye, bends, reach


@numba.njit(cache=True)
def project_quads(transforms, quads, joints, which, lens, corners, counts):  # pragma: no cover
    """Quads (1 or N, S, 4, 3) into the camera's frame, cut at the near plane, projected: `corners` (N, S, 5, 2), `counts` (N, S)."""
    K, k, fisheye, bends, reach = lens
    P = np.empty((4, 3))
    for n in range(transforms.shape[0]):
        shape = quads[n if quads.shape[0] > 1 else 0]
        for i in range(which.size):
            q = which[i]
            T = transforms[n, joints[q]]
            for v in range(4):
                x, y, z = shape[q, v, 0], shape[q, v, 1], shape[q, v, 2]
                P[v, 0] = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
                P[v, 1] = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
                P[v, 2] = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
            out = corners[n, i]
            m = 0
            if min(P[0, 2], P[1, 2], P[2, 2], P[3, 2]) >= NEAR:
                for m in range(4):
                    out[m, 0], out[m, 1] = P[m, 0] / P[m, 2], P[m, 1] / P[m, 2]
                m = 4
            else:
                m = _clip(P, out)
            for v in range(m):
                x, y = out[v, 0], out[v, 1]
                if bends:
                    x, y = _bend_within(x, y, k, fisheye, reach)
                out[v, 0], out[v, 1] = K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]
            counts[n, i] = m


@numba.njit(cache=True)
def project_hulls(transforms, centres, radii, joints, which, lens, directions, corners, counts):  # pragma: no cover
    """Outlines of hulls of ellipsoids: in each direction n the farthest point of any of the ellipses that the ellipsoids look like.

    An ellipse of centre c and semi-axes s_i reaches c + sum s_i (s_i . n) / h in direction n, h = sqrt(sum (s_i . n)^2).
    """
    K, k, fisheye, bends, reach = lens
    count = centres.shape[2]
    c, axes = np.empty((count, 2)), np.empty((count, 3, 2))
    for n in range(transforms.shape[0]):
        m = n if centres.shape[0] > 1 else 0
        for i in range(which.size):
            q = which[i]
            ahead = False
            for e in range(count):
                T, p = transforms[n, joints[q, e]], centres[m, q, e]
                x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]
                y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]
                z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
                ahead |= z > NEAR
                z = max(z, NEAR)
                c[e, 0], c[e, 1] = x / z, y / z
                for a in range(3):
                    r = radii[m, q, e, a] / z
                    axes[e, a, 0] = r * (T[0, a] - c[e, 0] * T[2, a])
                    axes[e, a, 1] = r * (T[1, a] - c[e, 1] * T[2, a])
            counts[n, i] = directions.shape[0] if ahead else 0
            for d in range(directions.shape[0]):
                u, v = directions[d, 0], directions[d, 1]
                best, x, y = -np.inf, 0.0, 0.0
                for e in range(count):
                    s0 = axes[e, 0, 0] * u + axes[e, 0, 1] * v
                    s1 = axes[e, 1, 0] * u + axes[e, 1, 1] * v
                    s2 = axes[e, 2, 0] * u + axes[e, 2, 1] * v
                    h = np.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
                    value = c[e, 0] * u + c[e, 1] * v + h
                    if value > best:
                        best = value
                        x = c[e, 0] + (axes[e, 0, 0] * s0 + axes[e, 1, 0] * s1 + axes[e, 2, 0] * s2) / h
                        y = c[e, 1] + (axes[e, 0, 1] * s0 + axes[e, 1, 1] * s1 + axes[e, 2, 1] * s2) / h
                if bends:
                    x, y = _bend_within(x, y, k, fisheye, reach)
                corners[n, i, d, 0], corners[n, i, d, 1] = K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]


@numba.njit(cache=True)
def _clip(P, out):  # pragma: no cover
    """Cut a quad (4, 3) at the near plane; x / z and y / z of the up to five corners left; returns their number."""
    m = 0
    for v in range(4):
        w = (v + 1) & 3
        if P[v, 2] >= NEAR:
            out[m, 0], out[m, 1] = P[v, 0] / P[v, 2], P[v, 1] / P[v, 2]
            m += 1
        if (P[v, 2] >= NEAR) != (P[w, 2] >= NEAR):
            s = (NEAR - P[v, 2]) / (P[w, 2] - P[v, 2])
            for a in range(2):
                out[m, a] = (P[v, a] + s * (P[w, a] - P[v, a])) / NEAR
            m += 1
    return m


@numba.njit(cache=True)
def _bend_within(x, y, k, fisheye, reach):  # pragma: no cover
    """Distortion of a point on the plane z = 1. Edges between bent corners stay straight: a card is small beside the lens's bend."""
    beyond = max(np.sqrt(x * x + y * y) / reach, 1.0)
    x, y = _bend(x / beyond, y / beyond, k, fisheye)
    return x * beyond, y * beyond


@numba.njit(cache=True)
def _bend(x, y, k, fisheye):  # pragma: no cover
    """OpenCV's formulas."""
    if fisheye:
        r = np.sqrt(x * x + y * y)
        a = np.arctan(r)
        b = a * a
        s = a * (1 + b * (k[0] + b * (k[1] + b * (k[2] + b * k[3])))) / r if r > 1e-9 else 1.0
        return s * x, s * y
    r = x * x + y * y
    s = (1 + r * (k[0] + r * (k[1] + r * k[4]))) / (1 + r * (k[5] + r * (k[6] + r * k[7])))
    return x * s + 2 * k[2] * x * y + k[3] * (r + 2 * x * x), y * s + k[2] * (r + 2 * y * y) + 2 * k[3] * x * y


@numba.njit(cache=True)
def _reach(k, fisheye):  # pragma: no cover
    """Radius on the plane z = 1 up to which bent points move outward."""
    last, step = 0.0, np.pi / 2 / STEPS
    for i in range(1, STEPS):
        x = _bend(np.tan(i * step), 0.0, k, fisheye)[0]
        if x <= last:
            return np.tan(max(i - 1, 1) * step)
        last = x
    return np.inf
