"""Correspondence of surface points and body: each point's nearest part, and the closest point on it.

Distances are of first order: the level of the part's implicit function over the length of its gradient; exact for circles, and right for
ellipses near the surface. The normals modulate a distance: d = (1 - epsilon cos(n, n')) |pp'| (Ni 2008, eq. 31).

Points come in groups of `LANES` that lie close together, so that a bounding sphere rules most parts out for a whole group.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Limbs
from shadowpuppet.geometry import Array
from shadowpuppet.jit import device, reduction_kernel
from shadowpuppet.tracking.multiview.settings import SurfaceSettings

Single = NDArray[np.float32]
LANES = 16
"""Points per group, the number that one AVX-512 instruction processes."""
FAR = np.float32(1e6)
TINY = np.float32(1e-12)
FLAT = np.float32(1e-4)
"""Height (m) of a dome up to which an end is flat."""
PART_NUMBERS = 25
"""Constants per part: axes (9), origin (3), centre and radius of the bounding sphere (4), length, shear (2), radii (4), caps (2)."""


class Cloud(NamedTuple):
    """Surface points in the kernels' layout."""

    rows: Single
    """For each group the points' x, y, z, normal (3) and weight, `LANES` values of each, of shape (G, 7 LANES); metres from `origin`.
    Points that fill up the last group have weight 0."""
    spheres: Single
    """Centre and radius of each group's bounding sphere, of shape (G, 4)."""
    origin: Array
    """World, metres, of shape (3,)."""
    total: float
    """Sum of the weights."""


def normal_weights(settings: SurfaceSettings) -> tuple[np.float32, np.float32]:
    """Weights of the normals in a point's distance (epsilon, eq. 31), and in the distance by which its nearest part is chosen."""
    epsilon = np.float32(settings.epsilon)
    return epsilon, epsilon if settings.nearest == "modulated" else np.float32(0)


def make_cloud(points: Array, normals: Array, weights: Array, origin: Array | None = None) -> Cloud:
    """Surface points (P, 3) with normals (P, 3) and weights (P,), in compact groups. `origin`: default the points' mean."""
    if origin is None:
        origin = np.asarray(points.mean(0) if len(points) else np.zeros(3), float)
    order = _along_a_curve(points - origin)
    groups = -(-len(points) // LANES)
    flat = np.zeros((7, groups * LANES), np.float32)
    flat[:3, : len(points)] = (points - origin)[order].T
    flat[3:6, : len(points)] = normals[order].T
    flat[6, : len(points)] = weights[order]
    if len(points):
        flat[:6, len(points) :] = flat[:6, len(points) - 1 : len(points)]
    rows = np.ascontiguousarray(flat.reshape(7, groups, LANES).swapaxes(0, 1))
    weight = float(rows[:, 6].sum())
    low, high = rows[:, :3].min(2), rows[:, :3].max(2)
    middle = (low + high) / 2
    radius = np.sqrt(((rows[:, :3] - middle[..., None]) ** 2).sum(1).max(1))
    return Cloud(rows.reshape(groups, 7 * LANES), np.concatenate([middle, radius[:, None]], 1), np.asarray(origin, float), weight)


def _along_a_curve(points: Array, bits: int = 6, reach: float = 1.5) -> NDArray[np.int64]:
    """Order of points (P, 3) along a Morton curve."""
    cells = np.clip((points / (2 * reach) + 0.5) * (1 << bits), 0, (1 << bits) - 1).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for bit in range(bits):
        for axis in range(3):
            key |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return key.argsort(kind="stable")


def part_constants(limbs: Limbs) -> Single:
    """Constants of the parts, of shape (S, PART_NUMBERS); those that change with the pose are filled in by `place_parts`."""
    out = np.zeros((len(limbs.joints), PART_NUMBERS), np.float32)
    out[:, 16], out[:, 17:19] = limbs.lengths, limbs.shears
    out[:, 19:23], out[:, 23:25] = limbs.radii.reshape(-1, 4), limbs.caps
    high = limbs.lengths + limbs.caps.sum(1)
    wide = np.hypot(limbs.radii.max((1, 2)) + np.abs(limbs.shears).max(1), 0.5 * high)
    out[:, 15] = wide
    return out


@device
def place_parts(T, origin, joints, rotations, starts, parts):  # pragma: no cover
    """Fill in the axes, origins and centres of parts (S, PART_NUMBERS) under transforms T (J, 3, 4), metres from `origin` (3,)."""
    for s in range(joints.size):
        joint, numbers = T[joints[s]], parts[s]
        middle = 0.5 * (numbers[16] + numbers[24] - numbers[23])
        for r in range(3):
            for c in range(3):
                numbers[3 * c + r] = (joint[r, 0] * rotations[s, 0, c] + joint[r, 1] * rotations[s, 1, c]
                                      + joint[r, 2] * rotations[s, 2, c])
            numbers[9 + r] = (joint[r, 0] * starts[s, 0] + joint[r, 1] * starts[s, 1] + joint[r, 2] * starts[s, 2] + joint[r, 3]
                              - origin[r])
        for r in range(3):
            numbers[12 + r] = (numbers[9 + r] + 0.5 * (numbers[17] * numbers[r] + numbers[18] * numbers[3 + r])
                               + middle * numbers[6 + r])


@reduction_kernel
def closest_on_part(q, rows, out):  # pragma: no cover
    """Fill out (8 LANES,) for a group of points (7 LANES,) and one part q (PART_NUMBERS,): signed distance, cosine between the normals,
    closest point (3) and its outward normal (3), the last two in the part's frame."""
    if _is_round(q):
        for i in range(LANES):
            _enter(out, i, _closest_if_round(q, rows, i))
    else:
        for i in range(LANES):
            _enter(out, i, _closest(q, rows, i))


@device
def _enter(out, i, found):  # pragma: no cover
    """Enter what `_closest` found of point i."""
    for k in range(8):
        out[k * LANES + i] = found[k]


@reduction_kernel
def _compete(q, number, rows, epsilon, choice, near):  # pragma: no cover
    """Enter part q into `near` (3 LANES,), laid out as in `nearest`, for those points of a group that are closer to it."""
    one = np.float32(1)
    for i in range(LANES):
        d, cosine, _, _, _, _, _, _ = _closest(q, rows, i)
        d = abs(d)
        _enter_if_closer(near, i, number, d * (one - epsilon * cosine), d * (one - choice * cosine))  # eq. 31


@reduction_kernel
def _compete_by_distance(q, number, rows, near):  # pragma: no cover
    """As `_compete` without normals."""
    for i in range(LANES):
        d = abs(_closest(q, rows, i)[0])
        _enter_if_closer(near, i, number, d, d)


@reduction_kernel
def _compete_if_round(q, number, rows, near):  # pragma: no cover
    """As `_compete_by_distance` for a part with domed ends."""
    for i in range(LANES):
        d = abs(_closest_if_round(q, rows, i)[0])
        _enter_if_closer(near, i, number, d, d)


@device
def _enter_if_closer(near, i, number, distance, apart):  # pragma: no cover
    """Enter a part, its distance and that by which parts are chosen, for point i, if it is closer by the latter."""
    closer = apart < near[2 * LANES + i]
    near[i] = distance if closer else near[i]
    near[LANES + i] = number if closer else near[LANES + i]
    near[2 * LANES + i] = apart if closer else near[2 * LANES + i]


@reduction_kernel
def nearest(parts, rows, sphere, epsilon, choice, near):  # pragma: no cover
    """Find the nearest part of each point of a group. Fills near (3 LANES,): the distance d (1 - epsilon cos) of eq. 31, the part's number,
    and the distance d (1 - choice cos) by which the part is chosen.

    The part whose number is at near[LANES] is tried first.
    """
    x, y, z, radius = sphere[0], sphere[1], sphere[2], sphere[3]
    first, worst = np.int64(near[LANES]), FAR
    for i in range(LANES):
        near[i] = near[2 * LANES + i] = FAR
    for turn in range(parts.shape[0]):
        s = first if turn == 0 else (turn - 1 if turn <= first else turn)
        q, number = parts[s], np.float32(s)
        dx, dy, dz = q[12] - x, q[13] - y, q[14] - z
        gap = np.sqrt(dx * dx + dy * dy + dz * dz) - radius - q[15]
        if gap * (np.float32(1) - choice) <= worst:
            if choice != 0 or epsilon != 0:
                _compete(q, number, rows, epsilon, choice, near)
            elif _is_round(q):
                _compete_if_round(q, number, rows, near)
            else:
                _compete_by_distance(q, number, rows, near)
            worst = _greatest(near[2 * LANES :])


@device
def is_first_of_part(near, i):  # pragma: no cover
    """Whether no earlier point of the group is nearest to the same part as point `i`."""
    k = i - 1
    while k >= 0 and near[LANES + k] != near[LANES + i]:
        k -= 1
    return k < 0


@reduction_kernel
def _greatest(near):  # pragma: no cover
    """The greatest of the first `LANES` numbers."""
    worst = near[0]
    for i in range(LANES):
        worst = max(worst, near[i])
    return worst


@device
def closest_point(q, out, i):  # pragma: no cover
    """The closest point p' to point i, as `closest_on_part` found it, metres from the cloud's origin."""
    u, v, w = out[2 * LANES + i], out[3 * LANES + i], out[4 * LANES + i]
    return (q[0] * u + q[3] * v + q[6] * w + q[9], q[1] * u + q[4] * v + q[7] * w + q[10], q[2] * u + q[5] * v + q[8] * w + q[11])


@device
def _load(q, rows, i):  # pragma: no cover
    """Position and normal of point i of a group in the frame of part q."""
    x, y, z = rows[i] - q[9], rows[LANES + i] - q[10], rows[2 * LANES + i] - q[11]
    nx, ny, nz = rows[3 * LANES + i], rows[4 * LANES + i], rows[5 * LANES + i]
    return (q[0] * x + q[1] * y + q[2] * z, q[3] * x + q[4] * y + q[5] * z, q[6] * x + q[7] * y + q[8] * z,
            q[0] * nx + q[1] * ny + q[2] * nz, q[3] * nx + q[4] * ny + q[5] * nz, q[6] * nx + q[7] * ny + q[8] * nz)


@device
def _is_round(q):  # pragma: no cover
    """Whether both ends of part q are domed."""
    return min(q[23], q[24]) > FLAT


@device
def _round(q, px, py, pz):  # pragma: no cover
    """Signed distance of a point in the frame of part q, as if both ends were domed, and the gradient (3) there; the point from the axis
    (2) and from the nearest place between the ends, and the square of its level."""
    one, nil = np.float32(1), np.float32(0)
    L, a0, b0, a1, b1, h0, h1 = q[16], q[19], q[20], q[21], q[22], q[23], q[24]
    slope_x, slope_y, slope_a, slope_b = q[17] / L, q[18] / L, (a1 - a0) / L, (b1 - b0) / L
    inner = min(max(pz, nil), L)
    over = pz - inner
    u, v, a, b = px - slope_x * inner, py - slope_y * inner, a0 + slope_a * inner, b0 + slope_b * inner
    ia, ib = one / a, one / b
    su, sv = u * ia, v * ib
    square = su * su + sv * sv
    height = h0 if over < nil else h1
    ih = one / height if height > FLAT else nil
    w = over * ih
    rho2 = square + w * w + TINY
    # the gradient of rho, times rho
    gx, gy = su * ia, sv * ib
    along = -(su * su * slope_a * ia + sv * sv * slope_b * ib + gx * slope_x + gy * slope_y)
    gz = along if over == nil else w * ih
    steep = one / np.sqrt(gx * gx + gy * gy + gz * gz + TINY)
    return (rho2 - np.sqrt(rho2)) * steep, gx * steep, gy * steep, gz * steep, u, v, over, rho2


@device
def _closest_if_round(q, rows, i):  # pragma: no cover
    """What `_closest` finds, if both ends are domed."""
    px, py, pz, mx, my, mz = _load(q, rows, i)
    d, ux, uy, uz, _, _, _, _ = _round(q, px, py, pz)
    return d, ux * mx + uy * my + uz * mz, px - d * ux, py - d * uy, pz - d * uz, ux, uy, uz


@device
def _closest(q, rows, i):  # pragma: no cover
    """Signed distance of point i of a group to part q, cosine of the normals, closest point (3) and outward normal (3) in the part's
    frame."""
    one, nil = np.float32(1), np.float32(0)
    L, h0, h1 = q[16], q[23], q[24]
    px, py, pz, mx, my, mz = _load(q, rows, i)
    d, ux, uy, uz, u, v, over, rho2 = _round(q, px, py, pz)
    fx, fy, fz = px - d * ux, py - d * uy, pz - d * uz
    # beyond a flat end: the nearest point of a disc; inside, near a flat end: the end
    side = over == nil
    inside = side & (rho2 < one)
    low = inside & (h0 <= FLAT) & (pz < -d) & ((h1 > FLAT) | (pz <= L - pz))
    high = inside & (h1 <= FLAT) & (L - pz < -d) & ((h0 > FLAT) | (L - pz < pz))
    flat = ((not side) & ((h0 if over < nil else h1) <= FLAT)) | low | high
    up = (over > nil) | high
    level = L if up else nil
    shrink = one / np.sqrt(rho2) if rho2 > one else one
    ex, ey = px - u + u * shrink, py - v + v * shrink
    dx, dy, dz = px - ex, py - ey, pz - level
    reach = np.sqrt(dx * dx + dy * dy + dz * dz) + TINY
    outside = not side
    end = one if up else -one
    edge = outside & (rho2 > one)
    d = (reach if outside else -reach) if flat else d
    ux = ((dx / reach) if edge else nil) if flat else ux
    uy = ((dy / reach) if edge else nil) if flat else uy
    uz = ((dz / reach) if edge else end) if flat else uz
    fx, fy, fz = ex if flat else fx, ey if flat else fy, level if flat else fz
    return d, ux * mx + uy * my + uz * mz, fx, fy, fz, ux, uy, uz
