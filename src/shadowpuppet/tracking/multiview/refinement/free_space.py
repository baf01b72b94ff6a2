"""Silhouette constraint: penalises limbs that project outside the silhouettes (not in Ni 2008).

Surface points do not pull back such a limb. Here spheres along the limbs' axes are pushed into the silhouettes of all cameras, along the
gradient of the distance to the outline.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Limbs
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, bounding_window
from shadowpuppet.camera.projection import NEAR_PLANE, bend_within, make_lens
from shadowpuppet.geometry import Array
from shadowpuppet.jit import device, kernel

SPHERE_SPACING = 0.07
"""Approximate distance between spheres on a limb's axis, metres."""
RADIUS_SHARE = 0.7
"""Radius of a sphere as a share of the limb's smaller radius, as a margin for the model's shape."""
TAU = 0.1
"""Distance (m) beyond which the cost grows linearly, not with the square."""
OUTVOTING_CAMERAS = 3
"""If a sphere's centre is outside one silhouette only and inside at least this many others, the one is ignored: it may lack a limb."""
TRUSTED_CAMERAS = 2
"""The same where sizes are solved for: a chair before a limb cuts it off in one silhouette, and the limb must not shrink for it."""
WINDOW_MARGIN = 24
"""Margin (pixels) around the silhouettes in which distances are computed; farther out they are extrapolated."""


class Spheres(NamedTuple):
    """Spheres along a body's limbs."""

    joints: NDArray[np.int64]
    """Index of each sphere's joint, of shape (K,)."""
    places: Array
    """Centres, joint's frame, metres, of shape (K, 3)."""
    radii: Array
    """Metres, of shape (K,)."""
    limbs: NDArray[np.int64]
    """Index of each sphere's limb, of shape (K,)."""


class FreeSpace(NamedTuple):
    """Distances to the silhouettes' outlines in C pictures, and the parameters of their cameras."""

    fields: NDArray[np.float32]
    """Signed distances to the outline, pixels, negative inside; the windows are concatenated, each row by row."""
    windows: NDArray[np.int64]
    """First value, left column, top row, width, height of each window, and the picture's size, of shape (C, 7)."""
    views: Array
    """World to camera, of shape (C, 3, 4)."""
    matrices: Array
    """Camera matrices, of shape (C, 3, 3)."""
    bends: Array
    """Distortion, padded (8); whether fisheye; whether there is any distortion; radius up to which it holds; of shape (C, 11)."""


def spheres_in(limbs: Limbs, lengths: Array | None = None) -> Spheres:
    """Spheres along each limb's axis, from its start to its end. `lengths` (S,): lengths that set their number; None: the limbs'."""
    joints, places, radii, which = [], [], [], []
    for s, (length, own) in enumerate(zip(limbs.lengths, limbs.lengths if lengths is None else lengths, strict=True)):
        for share in np.linspace(0, 1, max(2, round(own / SPHERE_SPACING) + 1)):
            which.append(s)
            joints.append(limbs.joints[s])
            places.append(limbs.starts[s] + limbs.rotations[s] @ (share * np.array([*limbs.shears[s], length])))
            radii.append(RADIUS_SHARE * ((1 - share) * limbs.radii[s, 0] + share * limbs.radii[s, 1]).min())
    return Spheres(np.array(joints), np.array(places), np.array(radii), np.array(which))


def free_space(views: Sequence[tuple[Camera, Mask]]) -> FreeSpace:
    """Distances for cameras and their masks (H, W); every mask shows a person."""
    fields, windows, start = [np.zeros(0, np.float32)], [], 0
    for camera, mask in views:
        rows, columns = bounding_window(mask, WINDOW_MARGIN)
        field = _distances(mask[rows, columns])
        fields.append(field.ravel())
        windows.append((start, columns.start, rows.start, field.shape[1], field.shape[0], *camera.size))
        start += field.size
    lenses = [make_lens(camera) for camera, _ in views]
    bends = [[*np.pad(k, (0, 8 - len(k))), fisheye, bent, reach] for _, k, fisheye, bent, reach in lenses]
    return FreeSpace(
        np.concatenate(fields),
        np.array(windows, np.int64).reshape(-1, 7),
        np.array([camera.T_camera_world[:3] for camera, _ in views], float).reshape(-1, 3, 4),
        np.array([camera.matrix for camera, _ in views], float).reshape(-1, 3, 3),
        np.array(bends, float).reshape(-1, 11),
    )


def _distances(mask: Mask) -> NDArray[np.float32]:
    """Signed distances (H, W) to a mask's outline, pixels."""
    import cv2

    pixels = np.ascontiguousarray(mask).view(np.uint8)
    outside, inside = (cv2.distanceTransform(part, cv2.DIST_L2, 3) for part in (1 - pixels, pixels))
    return np.asarray(outside - inside, np.float32)


@device
def _look_up(fields, window, x, y):  # pragma: no cover
    """Distance to the outline at a pixel (x, y), by bilinear interpolation, and its derivatives along x and y."""
    width, height = window[3], window[4]
    u, v = x - window[1], y - window[2]
    a, b = min(max(u, 0.0), width - 1.001), min(max(v, 0.0), height - 1.001)
    i, j = int(a), int(b)
    s, t, at = a - i, b - j, window[0] + j * width + i
    p, q, r, w = fields[at], fields[at + 1], fields[at + width], fields[at + width + 1]
    distance = (1 - t) * ((1 - s) * p + s * q) + t * ((1 - s) * r + s * w)
    along, down = (1 - t) * (q - p) + t * (w - r), (1 - s) * (r - p) + s * (w - q)
    beyond = np.sqrt((u - a) ** 2 + (v - b) ** 2)
    if beyond > 1:
        distance, along, down = distance + beyond, (u - a) / beyond, (v - b) / beyond
    return distance, along, down


@device
def placed(T, place):  # pragma: no cover
    """World coordinates of a point in a joint's frame."""
    return (T[0, 0] * place[0] + T[0, 1] * place[1] + T[0, 2] * place[2] + T[0, 3],
            T[1, 0] * place[0] + T[1, 1] * place[1] + T[1, 2] * place[2] + T[1, 3],
            T[2, 0] * place[0] + T[2, 1] * place[1] + T[2, 2] * place[2] + T[2, 3])  # fmt: skip


@device
def _sphere_distances(T, spheres, space, c, distances):  # pragma: no cover
    """Fill distances (K, 4) for camera c: how far (m) each sphere reaches out of the silhouette, and the gradient along the camera's axes;
    -inf for spheres outside the picture."""
    V, K, window, lens = space.views[c], space.matrices[c], space.windows[c], space.bends[c]
    fisheye, bends, reach, focal = lens[8] > 0, lens[9] > 0, lens[10], np.sqrt(K[0, 0] * K[1, 1])
    for k in range(spheres.radii.size):
        joint, place, own = T[spheres.joints[k]], spheres.places[k], distances[k]
        own[0] = -np.inf
        p0, p1, p2 = placed(joint, place)
        z = V[2, 0] * p0 + V[2, 1] * p1 + V[2, 2] * p2 + V[2, 3]
        if z < NEAR_PLANE:
            continue
        u = (V[0, 0] * p0 + V[0, 1] * p1 + V[0, 2] * p2 + V[0, 3]) / z
        v = (V[1, 0] * p0 + V[1, 1] * p1 + V[1, 2] * p2 + V[1, 3]) / z
        a, b = bend_within(u, v, lens, fisheye, reach) if bends else (u, v)
        x, y = K[0, 0] * a + K[0, 2], K[1, 1] * b + K[1, 2]
        if not (0 <= x < window[5] and 0 <= y < window[6]):
            continue
        distance, along, down = _look_up(space.fields, window, x, y)
        own[0] = distance * z / focal + spheres.radii[k]
        own[1], own[2], own[3] = along, down, -(along * u + down * v)


def reach(T: Array, spheres: Spheres, space: FreeSpace) -> Array:
    """How far (m) K spheres under transforms T (J, 3, 4) reach out of C silhouettes, (C, K); -inf outside the pictures."""
    distances = np.empty((len(space.windows), len(spheres.radii), 4))
    _fill_reach(np.ascontiguousarray(T), spheres, space, distances)
    return distances[:, :, 0]


@kernel
def _fill_reach(T, spheres, space, distances):  # pragma: no cover
    for c in range(space.windows.shape[0]):
        _sphere_distances(T, spheres, space, c, distances[c])


@kernel
def push_inside(T, spheres, space, distances, weight, origin, sums, adding):  # pragma: no cover
    """Cost of spheres under transforms T (J, 3, 4) that reach out of silhouettes: `weight` times the squared distances (m^2), linear beyond
    `TAU`. With `adding` their normal equations are added to sums (J, >= 27), as in `part_sums`. `distances` (C, K, 4): work array."""
    cameras, number = space.windows.shape[0], spheres.radii.size
    if cameras == 0:
        return 0.0
    total, share = 0.0, weight / (number * cameras)
    for c in range(cameras):
        _sphere_distances(T, spheres, space, c, distances[c])
    for k in range(number):
        outvoted = _is_outvoted(distances, k, spheres.radii[k], OUTVOTING_CAMERAS)
        for c in range(cameras):
            own, V = distances[c, k], space.views[c]
            r = own[0]
            if r <= 0 or (outvoted and r > spheres.radii[k]):
                continue
            fade = min(1.0, TAU / r)
            total += share * (r * r if fade == 1 else TAU * (2 * r - TAU))
            if adding:
                joint, place = T[spheres.joints[k]], spheres.places[k]
                p0, p1, p2 = placed(joint, place)
                n0, n1, n2 = _inward(own, V)
                add_equation(n0, n1, n2, p0 - origin[0], p1 - origin[1], p2 - origin[2], share * fade, r, sums[spheres.joints[k]])
    return total


@kernel
def rows_inside(T, spheres, space, distances, weight, origin, out):  # pragma: no cover
    """Fill out (9, C K), for each camera and sphere as in `push_inside`: the distance (m) by which it reaches out of the silhouette, the
    weight of its square, moment and normal (6) of the direction inward, and the cost. The cost of one sphere is bounded, so that holes
    of silhouettes do not decide. `distances` (C, K, 4): work array."""
    cameras, number = space.windows.shape[0], spheres.radii.size
    out[:] = 0.0
    for c in range(cameras):
        _sphere_distances(T, spheres, space, c, distances[c])
    for k in range(number):
        outvoted = _is_outvoted(distances, k, spheres.radii[k], TRUSTED_CAMERAS)
        p0, p1, p2 = placed(T[spheres.joints[k]], spheres.places[k])
        x0, x1, x2 = p0 - origin[0], p1 - origin[1], p2 - origin[2]
        for c in range(cameras):
            own, V, at = distances[c, k], space.views[c], c * number + k
            r = own[0]
            out[0, at] = max(r, -1.0)  # none outside the picture
            if r <= 0 or (outvoted and r > spheres.radii[k]):
                continue
            bound, share = 1 / (1 + (r / TAU) ** 2), weight / (number * cameras)
            n0, n1, n2 = _inward(own, V)
            out[1, at] = share * bound**2
            out[2, at], out[3, at], out[4, at] = x1 * n2 - x2 * n1, x2 * n0 - x0 * n2, x0 * n1 - x1 * n0
            out[5, at], out[6, at], out[7, at] = n0, n1, n2
            out[8, at] = share * bound * r * r


@device
def _is_outvoted(distances, k, radius, cameras):  # pragma: no cover
    """Whether the centre of sphere `k` is outside one silhouette only and inside at least `cameras`, by distances (C, K, 4)."""
    inside = outside = 0
    for c in range(distances.shape[0]):
        middle = distances[c, k, 0] - radius
        outside += middle > 0
        inside += -np.inf < middle <= 0
    return outside == 1 and inside >= cameras


@device
def _inward(own, V):  # pragma: no cover
    """Direction (3), world, into a silhouette from what `_sphere_distances` says of a sphere, (4,), and the camera's transform."""
    return (-(V[0, 0] * own[1] + V[1, 0] * own[2] + V[2, 0] * own[3]),
            -(V[0, 1] * own[1] + V[1, 1] * own[2] + V[2, 1] * own[3]),
            -(V[0, 2] * own[1] + V[1, 2] * own[2] + V[2, 2] * own[3]))


@device
def add_equation(n0, n1, n2, x0, x1, x2, weight, distance, own):  # pragma: no cover
    """Add to a joint's sums the equation of a point x that is to move a distance along n, as `gauss_newton` does for surface points."""
    row = (x1 * n2 - x2 * n1, x2 * n0 - x0 * n2, x0 * n1 - x1 * n0, n0, n1, n2)
    at = 0
    for i in range(6):
        for j in range(i, 6):
            own[at] += weight * row[i] * row[j]
            at += 1
        own[21 + i] += weight * row[i] * distance
