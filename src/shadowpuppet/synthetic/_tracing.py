"""Kernels of the renderer: sphere tracing of the blended lofts (Hart 1996). Arrays and scalars only; see `renderer.py`."""

from __future__ import annotations

import numpy as np
from numba import njit

FAR = 1e9
STEP = 0.85
"""Share of the distance bound that a step takes: lofts' distances are first-order estimates."""
HIT = 2.5e-4
"""A ray that comes this close to the surface (m) hits it."""
TILE = 8
"""Pixels along the side of the tiles that list the parts in reach of their rays."""


@njit(cache=True, inline="never")
def part_distance(x, y, z, origin, axes, table, size):
    """First-order distance (m) from a point to one loft."""
    dx, dy, dz = x - origin[0], y - origin[1], z - origin[2]
    qx = axes[0, 0] * dx + axes[1, 0] * dy + axes[2, 0] * dz
    qy = axes[0, 1] * dx + axes[1, 1] * dy + axes[2, 1] * dz
    qz = axes[0, 2] * dx + axes[1, 2] * dy + axes[2, 2] * dz
    last = table.shape[0] - 1
    s = min(max(qz / size[0], 0.0), 1.0) * last
    i = min(int(s), last - 1)
    w = s - i
    a = table[i, 0] + w * (table[i + 1, 0] - table[i, 0])
    b = table[i, 1] + w * (table[i + 1, 1] - table[i, 1])
    qx -= table[i, 2] + w * (table[i + 1, 2] - table[i, 2])
    qy -= table[i, 3] + w * (table[i + 1, 3] - table[i, 3])
    out = 0.0
    c = 1.0
    if qz < 0.0:
        out, c = -qz, size[1]
    elif qz > size[0]:
        out, c = qz - size[0], size[2]
    ux, uy, uz = qx / a, qy / b, out / c
    k0 = np.sqrt(ux * ux + uy * uy + uz * uz)
    vx, vy, vz = ux / a, uy / b, uz / c
    k1 = np.sqrt(vx * vx + vy * vy + vz * vz)
    if k1 < 1e-9:
        return -min(a, b)
    return k0 * (k0 - 1.0) / k1


@njit(cache=True)
def blend(a, b, k):
    """Polynomial smooth minimum over a width `k` (Quilez 2013)."""
    h = k - abs(a - b)
    m = min(a, b)
    if h > 0.0:
        m -= h * h * 0.25 / k
    return m


@njit(cache=True)
def distance(x, y, z, parts, count, origin, axes, table, size, code, middle, reach, joints, near):
    """Distance (m) to the union of the listed parts and the nearest part; `near[0]` receives its index.

    parts: indices ordered by group; middle, reach: a sphere about each part; joints: (groups, 4) where a group
    melts into the trunk and how far around.
    """
    total = FAR
    current = FAR
    group = -1
    best = FAR
    for n in range(count):
        p = parts[n]
        if code[p, 0] != group:
            if group >= 0:
                total = _join(total, current, x, y, z, joints[group])
            group = code[p, 0]
            current = FAR
        dx, dy, dz = x - middle[p, 0], y - middle[p, 1], z - middle[p, 2]
        far = current + reach[p] + size[p, 3]
        if far < FAR and dx * dx + dy * dy + dz * dz > far * far:
            continue
        d = part_distance(x, y, z, origin[p], axes[p], table[p], size[p])
        if d < best:
            best = d
            near[0] = p
        current = d if current >= FAR else blend(current, d, size[p, 3])
    return _join(total, current, x, y, z, joints[group]) if group >= 0 else total


@njit(cache=True)
def _join(total, current, x, y, z, joint):
    """A limb's distance joined to the trunk's: blended near the joint only."""
    if total >= FAR:
        return current
    dx, dy, dz = x - joint[0], y - joint[1], z - joint[2]
    k = 0.06 * (1.0 - np.sqrt(dx * dx + dy * dy + dz * dz) / joint[3])
    if k > 1e-4:
        return blend(total, current, k)
    return min(total, current)


@njit(cache=True)
def list_parts(direction, sine, cosine, eye, spheres, lists, span):
    """For each tile the parts that its rays may meet, and between which distances.

    direction, sine, cosine: each tile's middle ray (N, 3) and half-angle; spheres: (P, 3, 4) that cover the parts.
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
                across = np.sqrt(max(square - along * along, 0.0))
                if across * cosine[t] - along * sine[t] <= radius:
                    touched = True
                    d = np.sqrt(square)
                    span[t, 0] = min(span[t, 0], max(d - radius, 0.0))
                    span[t, 1] = max(span[t, 1], d + radius)
            if touched:
                count += 1
                lists[t, count] = p
        lists[t, 0] = count


@njit(cache=True)
def march(eye, ray, start, stop, parts, count, origin, axes, table, size, code, middle, reach, joints, near):
    """Where along a unit ray (m) the surface is met; FAR where it is missed."""
    t = start
    for _ in range(96):
        d = distance(eye[0] + t * ray[0], eye[1] + t * ray[1], eye[2] + t * ray[2],
                     parts, count, origin, axes, table, size, code, middle, reach, joints, near)
        if d < HIT:
            return t
        t += STEP * d
        if t > stop:
            return FAR
    return FAR


@njit(cache=True)
def _texture(x, y, z):
    """Smooth pseudo-random variation about 0, within 1, a few centimetres in size: sines in odd directions."""
    return (np.sin(61.0 * x + 23.0 * y + 3.0 * np.sin(31.0 * z)) * np.sin(47.0 * z + 37.0 * y + 2.0 * np.sin(43.0 * x))
            + 0.5 * np.sin(151.0 * x - 89.0 * z) * np.sin(131.0 * z + 113.0 * y))


@njit(cache=True)
def shade(eye, ray, t, parts, count, origin, axes, table, size, code, middle, reach, joints, near, colours, lights, stripes, out):
    """The light (3,) that the surface at `t` sends along the ray: two lamps, ambient light from above, occlusion in creases."""
    x, y, z = eye[0] + t * ray[0], eye[1] + t * ray[1], eye[2] + t * ray[2]
    distance(x, y, z, parts, count, origin, axes, table, size, code, middle, reach, joints, near)
    p = near[0]
    nx = ny = nz = 0.0
    e = 1.5e-3
    for i in range(4):
        sx, sy, sz = (1.0 if i & 1 else -1.0), (1.0 if i & 2 else -1.0), (1.0 if (i == 0 or i == 3) else -1.0)
        d = distance(x + e * sx, y + e * sy, z + e * sz, parts, count, origin, axes, table, size, code, middle, reach, joints, near)
        nx += sx * d
        ny += sy * d
        nz += sz * d
    norm = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    open_ = 1.0
    for i in range(3):
        step = 0.02 + 0.035 * i
        d = distance(x + step * nx, y + step * ny, z + step * nz, parts, count, origin, axes, table, size, code, middle, reach, joints, near)
        open_ -= (step - max(d, 0.0)) * (9.0 - 3.0 * i)
    open_ = max(open_, 0.25)
    key = max(0.0, nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2])
    fill = max(0.0, nx * lights[1, 0] + ny * lights[1, 1] + nz * lights[1, 2])
    light = lights[0, 3] * key + lights[1, 3] * fill + lights[2, 3] * (0.6 + 0.4 * nz) * open_
    material, dark = _material(x, y, z, p, origin, axes, size, code)
    grain = _texture(x, y, z) if material == 0 else 0.0
    dx, dy, dz = x - origin[p, 0], y - origin[p, 1], z - origin[p, 2]
    lx = axes[p, 0, 0] * dx + axes[p, 1, 0] * dy + axes[p, 2, 0] * dz
    ly = axes[p, 0, 1] * dx + axes[p, 1, 1] * dy + axes[p, 2, 1] * dz
    lz = axes[p, 0, 2] * dx + axes[p, 1, 2] * dy + axes[p, 2, 2] * dz
    grain = _texture(lx, ly, lz) * (0.02 if material == 0 else 0.06)
    if material == 1 and stripes > 0.0:
        grain -= stripes * (1.0 if np.sin(lz * 130.0) > 0.3 else 0.0)
    for c in range(3):
        out[c] = colours[material, c] * light * dark * (1.0 + grain)


@njit(cache=True)
def _material(x, y, z, p, origin, axes, size, code):
    """Material at a point of part `p`, and a factor that darkens eyes, brows and mouth."""
    dx, dy, dz = x - origin[p, 0], y - origin[p, 1], z - origin[p, 2]
    along = axes[p, 0, 2] * dx + axes[p, 1, 2] * dy + axes[p, 2, 2] * dz
    material = code[p, 2] if along > size[p, 4] else code[p, 1]
    return material, 1.0


@njit(cache=True)
def render(eye, rays, tiles, lists, span, origin, axes, table, size, code, middle, reach, joints, colours, lights, stripes, offsets, depth, picture, alpha):
    """Trace a whole picture.

    rays: unit directions (H, W, 3); tiles: tiles in a row; offsets: sub-pixel positions (K, 2) for pixels at edges.
    Fills depth (H, W), FAR where the pixel's centre misses, and picture (H, W, 3) premultiplied by alpha (H, W).
    """
    height, width = depth.shape
    near = np.zeros(1, np.int64)
    kind = np.full((height, width), -1)
    light = np.zeros(3)
    ray = np.zeros(3)
    for v in range(height):
        for u in range(width):
            tile = (v // TILE) * tiles + u // TILE
            depth[v, u] = FAR
            if lists[tile, 0] > 0:
                depth[v, u] = march(eye, rays[v, u], span[tile, 0], span[tile, 1], lists[tile, 1:], lists[tile, 0],
                                    origin, axes, table, size, code, middle, reach, joints, near)
                kind[v, u] = code[near[0], 0] if depth[v, u] < FAR else -1
    for v in range(height):
        for u in range(width):
            edge = False
            for s in range(4):
                vv, uu = v + (s == 0) - (s == 1), u + (s == 2) - (s == 3)
                if 0 <= vv < height and 0 <= uu < width:
                    edge = edge or kind[vv, uu] != kind[v, u] or abs(depth[vv, uu] - depth[v, u]) > 0.04
            alpha[v, u] = 0.0
            picture[v, u] = 0.0
            if not edge and kind[v, u] < 0:
                continue
            tile = (v // TILE) * tiles + u // TILE
            if not edge:
                shade(eye, rays[v, u], depth[v, u], lists[tile, 1:], lists[tile, 0], origin, axes, table, size, code, middle, reach, joints,
                      near, colours, lights, stripes, light)
                alpha[v, u] = 1.0
                for c in range(3):
                    picture[v, u, c] = light[c]
                continue
            if lists[tile, 0] == 0:
                continue
            ahead, below = rays[v, min(u + 1, width - 1)] - rays[v, max(u - 1, 0)], rays[min(v + 1, height - 1), u] - rays[max(v - 1, 0), u]
            share = 1.0 / offsets.shape[0]
            for k in range(offsets.shape[0]):
                for c in range(3):
                    ray[c] = rays[v, u, c] + 0.5 * (offsets[k, 0] * ahead[c] + offsets[k, 1] * below[c])
                t = march(eye, ray, span[tile, 0], span[tile, 1], lists[tile, 1:], lists[tile, 0],
                          origin, axes, table, size, code, middle, reach, joints, near)
                if t < FAR:
                    shade(eye, ray, t, lists[tile, 1:], lists[tile, 0], origin, axes, table, size, code, middle, reach, joints,
                          near, colours, lights, stripes, light)
                    alpha[v, u] += share
                    for c in range(3):
                        picture[v, u, c] += share * light[c]
