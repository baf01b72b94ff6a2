"""Contours and viewing edges once more, plainly: sides by looking at every pair of pixels, edges by looking at every piece of a ray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.projection import NEAR_PLANE
from shadowpuppet.geometry import Array, inverse, transform
from shadowpuppet.tracking.multiview.surface.viewing_edges import CONFIRMING_VIEWS, FAR, MIN_LENGTH


def sides(mask: Mask, seen: Mask | None = None) -> dict[tuple[float, float], tuple[tuple[int, int], bool]]:
    """Middles (x, y) of the pixels' sides between what is denied and what is not, with the way that has the latter to the right.

    Beside each whether a person is there, rather than what the picture does not show.
    """
    height, width = mask.shape
    seen = np.ones_like(mask) if seen is None else seen
    state = {(x, y): (bool(mask[y, x]), True) if seen[y, x] else (True, False) for y in range(height) for x in range(width)}
    out = {}
    for (x, y), (inside, _) in state.items():
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            beside, person = state.get((x + dx, y + dy), (True, False))
            if not inside and beside:
                out[(x + dx / 2, y + dy / 2)] = (dy, -dx), person
    return out


def holds(polygons: Sequence[Array], point: Array) -> bool:
    """Whether a point (2,) lies in an odd number of polygons (N, 2), by a ray to the right."""
    count = 0
    for P in polygons:
        Q = np.roll(P, -1, 0)
        crossing = (P[:, 1] > point[1]) != (Q[:, 1] > point[1])
        P, Q = P[crossing], Q[crossing]
        count += int((P[:, 0] + (point[1] - P[:, 1]) / (Q[:, 1] - P[:, 1]) * (Q[:, 0] - P[:, 0]) > point[0]).sum())
    return count % 2 == 1


def viewing_edges(ray: Array, view: int, cameras: Sequence[Camera], polygons: Sequence[Sequence[Array]], tolerated: int,
                  longest: float) -> Array:
    """Depths (E, 2) of a ray (3,), z = 1, of a view that the others leave; their polygons are on the plane z = 1."""
    others = [j for j in range(len(cameras)) if j != view]
    relative = {j: cameras[j].T_camera_world @ inverse(cameras[view].T_camera_world) for j in others}
    ends = np.unique(np.concatenate([[NEAR_PLANE, FAR], *(_crossings(ray, relative[j], polygons[j]) for j in others)]))
    places = (ends[:-1] + ends[1:]) / 2
    times = [sum(_denied(ray * z, relative[j], polygons[j]) for j in others) for z in places]
    for level in range(tolerated + 1):
        out, start = [], None
        for k in range(len(places) + 1):
            fits = k < len(places) and times[k] <= level
            if fits and start is None:
                start = ends[k]
            elif not fits and start is not None:
                needed = max(1, (1 + CONFIRMING_VIEWS) * level)
                seen = sum(_pictured(ray * (start + ends[k]) / 2, relative[j], cameras[j]) for j in others)
                if start > NEAR_PLANE and ends[k] < FAR and ends[k] - start > MIN_LENGTH and seen >= needed:
                    out.append((start, ends[k]))
                start = None
        if any((end - start) * np.linalg.norm(ray) <= longest for start, end in out):
            break
    return np.array(out).reshape(-1, 2)


def _crossings(ray: Array, T: Array, polygons: Sequence[Array]) -> Array:
    """Depths on a ray where its picture in another view lies on a polygon's side, or the view's near plane is passed."""
    a, b = T[:3, 3], T[:3, :3] @ ray
    out = [(NEAR_PLANE - a[2]) / b[2]] if b[2] else []
    for P in polygons:
        for p, q in zip(P, np.roll(P, -1, 0)):
            normal = np.cross([*p, 1], [*q, 1])  # of the plane through the view's centre and the side
            if abs(normal @ b) > 1e-15:
                z = -(normal @ a) / (normal @ b)
                x = a + z * b
                inside = x[2] > 0 and (x[:2] / x[2] - p) @ (x[:2] / x[2] - q) <= 0
                out += [z] if inside else []
    return np.array([z for z in out if NEAR_PLANE < z < FAR])


def _denied(point: Array, T: Array, polygons: Sequence[Array]) -> bool:
    x = transform(T, point)
    return bool(x[2] >= NEAR_PLANE) and holds(polygons, x[:2] / x[2])


def _pictured(point: Array, T: Array, camera: Camera) -> bool:
    x = transform(T, point)
    if x[2] < NEAR_PLANE:
        return False
    u, v = camera.project(transform(inverse(camera.T_camera_world), x))
    return bool(-0.5 <= u < camera.size[0] - 0.5 and -0.5 <= v < camera.size[1] - 0.5)
