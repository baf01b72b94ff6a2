"""Kernels of `PersonRenderer`: sphere tracing of the blended lofts (Hart 1996).

`placed` (P, 22), a row per part: 0-8 columns width, depth, axis of its frame; 9-11 start of the axis; 12-15 centre and radius
of a bounding sphere; 16 length; 17, 18 inverse of its caps; 19 blend; 20 samples per length; 21 where the second material begins.
`table` (P, samples, 4): inverse half widths and half depths, and the centres along the axis. `code` (P, 3): group and both materials.
`joints` (groups, 4): where a group blends into the trunk, and the radius. `parts`: number of a tile's parts, then their indices by group.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.jit import compiled
from shadowpuppet.synthetic.compositing import FAR

STEP_SHARE = 0.85
"""Length of a step over the distance bound: distances to lofts are first-order estimates."""
HIT, EDGE_HIT = 2.5e-4, 1e-3
"""Distance (m) at which a ray hits the surface: rays of pixel centres, and additional rays at edges."""
JOINT_BLEND = 0.06
"""Width of the smooth union of limb and trunk at the joint, metres."""
TILE = 8
"""Side (pixels) of the tiles that list the parts in reach of their rays."""
FAST = {"reassoc", "contract", "nsz", "arcp"}

# "_nrt": no reference counting. The kernels allocate no arrays, and counting references at every call took half of the time.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": FAST, "_nrt": False}
kernel = compiled(**OPTIONS)


@kernel
def part_distance(x, y, z, p, placed, table):
    """First-order distance (m) from a point to loft `p`."""
    dx, dy, dz = x - placed[p, 9], y - placed[p, 10], z - placed[p, 11]
    qx = placed[p, 0] * dx + placed[p, 1] * dy + placed[p, 2] * dz
    qy = placed[p, 3] * dx + placed[p, 4] * dy + placed[p, 5] * dz
    qz = placed[p, 6] * dx + placed[p, 7] * dy + placed[p, 8] * dz
    s = min(max(qz * placed[p, 20], 0.0), table.shape[1] - 1.0)
    i = min(int(s), table.shape[1] - 2)
    w = s - i
    a = table[p, i, 0] + w * (table[p, i + 1, 0] - table[p, i, 0])
    b = table[p, i, 1] + w * (table[p, i + 1, 1] - table[p, i, 1])
    c = 0.0
    if qz < 0.0:
        c = placed[p, 17]
    elif qz > placed[p, 16]:
        qz -= placed[p, 16]
        c = placed[p, 18]
    ux = a * (qx - table[p, i, 2] - w * (table[p, i + 1, 2] - table[p, i, 2]))
    uy = b * (qy - table[p, i, 3] - w * (table[p, i + 1, 3] - table[p, i, 3]))
    uz = c * qz
    square = ux * ux + uy * uy + uz * uz
    vx, vy, vz = ux * a, uy * b, uz * c
    return (square - np.sqrt(square)) / np.sqrt(vx * vx + vy * vy + vz * vz + 1e-18)


@kernel
def blend(a, b, k):
    """Polynomial smooth minimum over a width `k` (Quilez 2013)."""
    h = max(k - abs(a - b), 0.0)
    return min(a, b) - h * h * 0.25 / k


@kernel
def _join(total, limb, x, y, z, group, joints):
    """Union of a limb's distance with the trunk's, blended near the joint only."""
    if total >= FAR:
        return limb
    dx, dy, dz = x - joints[group, 0], y - joints[group, 1], z - joints[group, 2]
    k = JOINT_BLEND * (1.0 - np.sqrt(dx * dx + dy * dy + dz * dz) / joints[group, 3])
    return blend(total, limb, k) if k > 1e-4 else min(total, limb)


@kernel
def distance(x, y, z, parts, placed, table, code, joints):
    """Distance (m) to the union of the listed parts, and the nearest part."""
    total, limb, best = FAR, FAR, FAR
    group, near = -1, -1
    for n in range(1, parts[0] + 1):
        p = parts[n]
        if code[p, 0] != group:
            if group >= 0:
                total = _join(total, limb, x, y, z, group, joints)
            group, limb = code[p, 0], FAR
        k = placed[p, 19]
        dx, dy, dz = x - placed[p, 12], y - placed[p, 13], z - placed[p, 14]
        far = min(limb + k, total + JOINT_BLEND) + placed[p, 15]  # beyond it the part has no influence
        if dx * dx + dy * dy + dz * dz > far * far:
            continue
        d = part_distance(x, y, z, p, placed, table)
        if d < best:
            best, near = d, p
        limb = blend(limb, d, k)
    return (_join(total, limb, x, y, z, group, joints) if group >= 0 else total), near


@kernel
def list_parts(direction, sine, cosine, eye, spheres, lists, span):
    """For each tile the parts that its rays may meet, and the range of their distances.

    direction, sine, cosine: middle ray (N, 3) and half-angle of each tile; spheres: (P, 4, 4), covering the parts.
    Fills lists (N, P + 1), the count first, and span (N, 2).
    """
    for t in range(direction.shape[0]):
        count = 0
        span[t, 0], span[t, 1] = FAR, 0.0
        for p in range(spheres.shape[0]):
            touched = False
            for s in range(spheres.shape[1]):
                dx, dy, dz = spheres[p, s, 0] - eye[0], spheres[p, s, 1] - eye[1], spheres[p, s, 2] - eye[2]
                radius = spheres[p, s, 3]
                along = dx * direction[t, 0] + dy * direction[t, 1] + dz * direction[t, 2]
                square = dx * dx + dy * dy + dz * dz
                if np.sqrt(max(square - along * along, 0.0)) * cosine[t] - along * sine[t] <= radius:
                    touched = True
                    d = np.sqrt(square)
                    span[t, 0], span[t, 1] = min(span[t, 0], max(d - radius, 0.0)), max(span[t, 1], d + radius)
            if touched:
                count += 1
                lists[t, count] = p
        lists[t, 0] = count


@kernel
def march(eye, rx, ry, rz, start, stop, hit, parts, placed, table, code, joints):
    """Distance (m) along a unit ray at which the surface is met, FAR if it is missed, and the part met."""
    t = start
    for _ in range(96):
        d, near = distance(eye[0] + t * rx, eye[1] + t * ry, eye[2] + t * rz, parts, placed, table, code, joints)
        if d < hit:
            return t, near
        t += max(STEP_SHARE * d, 2.0 * hit)
        if t > stop:
            break
    return FAR, -1


@kernel
def _weave(x, y, z):
    """Texture of cloth: smooth variation within 1.5 of 0, a few centimetres in size."""
    return np.sin(61.0 * x + 23.0 * y + 3.0 * np.sin(31.0 * z)) * np.sin(
        47.0 * z + 37.0 * y + 2.0 * np.sin(43.0 * x)
    ) + 0.5 * np.sin(151.0 * x - 89.0 * z) * np.sin(131.0 * z + 113.0 * y)


@kernel
def shade(x, y, z, p, parts, placed, table, code, joints, lights, stripes):
    """Material and brightness at a surface point on part `p`: two lamps, ambient light, occlusion in creases."""
    nx = ny = nz = 0.0
    for i in range(4):
        sx, sy, sz = (1.0 if i & 1 else -1.0), (1.0 if i & 2 else -1.0), (1.0 if i == 0 or i == 3 else -1.0)
        d = distance(x + 1.5e-3 * sx, y + 1.5e-3 * sy, z + 1.5e-3 * sz, parts, placed, table, code, joints)[0]
        nx, ny, nz = nx + sx * d, ny + sy * d, nz + sz * d
    norm = 1.0 / (np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12)
    nx, ny, nz = nx * norm, ny * norm, nz * norm
    d = distance(x + 0.06 * nx, y + 0.06 * ny, z + 0.06 * nz, parts, placed, table, code, joints)[0]
    clear = 1.0 - 11.0 * (0.06 - max(d, 0.0))
    key = max(0.0, nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2])
    fill = max(0.0, nx * lights[1, 0] + ny * lights[1, 1] + nz * lights[1, 2])
    light = lights[0, 3] * key + lights[1, 3] * fill + lights[2, 3] * (0.65 + 0.35 * nz)
    material = code[p, 1]
    dx, dy, dz = x - placed[p, 9], y - placed[p, 10], z - placed[p, 11]
    if placed[p, 6] * dx + placed[p, 7] * dy + placed[p, 8] * dz > placed[p, 21]:
        material = code[p, 2]
    if code[p, 0] == 0 and material == 1:
        p = 1  # the shirt's pattern continues over all parts of the trunk
        dx, dy, dz = x - placed[p, 9], y - placed[p, 10], z - placed[p, 11]
    lx = placed[p, 0] * dx + placed[p, 1] * dy + placed[p, 2] * dz
    ly = placed[p, 3] * dx + placed[p, 4] * dy + placed[p, 5] * dz
    lz = placed[p, 6] * dx + placed[p, 7] * dy + placed[p, 8] * dz
    grain = 1.0 + _weave(lx, ly, lz) * (0.02 if material == 0 else 0.06)
    if material == 1 and np.sin(lz * 130.0) > 0.3:
        grain -= stripes
    return material, light * max(clear, 0.3) * grain


@kernel
def find_surface(eye, rays, tiles, lists, span, placed, table, code, joints, depth, near):
    """Fill depth (H, W) along the rays (H, W, 3), FAR where missed, and the part met; tiles: number in a row."""
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            tile = (v // TILE) * tiles + u // TILE
            depth[v, u], near[v, u] = FAR, -1
            if lists[tile, 0] > 0:
                rx, ry, rz, start, stop = rays[v, u, 0], rays[v, u, 1], rays[v, u, 2], span[tile, 0], span[tile, 1]
                depth[v, u], near[v, u] = march(eye, rx, ry, rz, start, stop, HIT, lists[tile], placed, table, code, joints)


@kernel
def _edge(v, u, depth, near, code):
    """Whether a neighbouring pixel shows something else: background, another limb, or the same one well behind."""
    for s in range(4):
        vv, uu = v + (s == 0) - (s == 1), u + (s == 2) - (s == 3)
        if 0 <= vv < depth.shape[0] and 0 <= uu < depth.shape[1]:
            p, q = near[v, u], near[vv, uu]
            if (p < 0) != (q < 0) or (p >= 0 and (code[p, 0] != code[q, 0] or abs(depth[vv, uu] - depth[v, u]) > 0.06)):
                return True
    return False


@kernel
def _range(v, u, depth):
    """Least and greatest depth met at a pixel and its eight neighbours."""
    least, greatest = FAR, 0.0
    for vv in range(max(v - 1, 0), min(v + 2, depth.shape[0])):
        for uu in range(max(u - 1, 0), min(u + 2, depth.shape[1])):
            if depth[vv, uu] < FAR:
                least, greatest = min(least, depth[vv, uu]), max(greatest, depth[vv, uu])
    return least, greatest


@kernel
def colour_surface(
    eye, rays, tiles, lists, span, placed, table, code, joints, depth, near, colours, lights, stripes, offsets, picture, alpha
):
    """Add the surface to picture (H, W, 3), premultiplied by alpha (H, W); edges are sampled at `offsets` (K, 2), pixels."""
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            tile = (v // TILE) * tiles + u // TILE
            if lists[tile, 0] == 0:
                continue
            edge = _edge(v, u, depth, near, code)
            if not edge and near[v, u] < 0:
                continue
            count = offsets.shape[0] if edge else 1
            group, material, light = -1, 0, 0.0
            least, greatest = _range(v, u, depth)
            start, stop = max(span[tile, 0], least - 0.1), min(span[tile, 1], greatest + 0.1)
            for k in range(count):
                rx, ry, rz, t, p = rays[v, u, 0], rays[v, u, 1], rays[v, u, 2], depth[v, u], near[v, u]
                if edge:
                    u0, u1, v0, v1 = max(u - 1, 0), min(u + 1, width - 1), max(v - 1, 0), min(v + 1, height - 1)
                    du, dv = offsets[k, 0] / (u1 - u0), offsets[k, 1] / (v1 - v0)
                    rx += du * (rays[v, u1, 0] - rays[v, u0, 0]) + dv * (rays[v1, u, 0] - rays[v0, u, 0])
                    ry += du * (rays[v, u1, 1] - rays[v, u0, 1]) + dv * (rays[v1, u, 1] - rays[v0, u, 1])
                    rz += du * (rays[v, u1, 2] - rays[v, u0, 2]) + dv * (rays[v1, u, 2] - rays[v0, u, 2])
                    t, p = march(eye, rx, ry, rz, start, stop, EDGE_HIT, lists[tile], placed, table, code, joints)
                if p < 0:
                    continue
                if code[p, 0] != group:
                    group = code[p, 0]
                    material, light = shade(eye[0] + t * rx, eye[1] + t * ry, eye[2] + t * rz, p, lists[tile], placed, table, code, joints,
                                            lights, stripes)
                alpha[v, u] += 1.0 / count
                for c in range(3):
                    picture[v, u, c] += colours[material, c] * light / count
