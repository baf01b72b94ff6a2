"""The mannequin's surface as lofts, and as arrays for the renderer.

A loft is a tube about a straight axis whose half width, half depth and centre change smoothly along it, with rounded caps: limbs
taper, swell and lie off their bones. The renderer blends neighbouring lofts into one another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.kinematics import SEGMENTS

MATERIALS = ("skin", "shirt", "trousers", "hair", "shoes", "eyes", "lips")
GROUPS = ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")
"""Parts blend within a group, and limbs with the trunk only close to shoulder or hip: a hanging arm does not melt into it."""
Sections = list[tuple[float, ...]]
"""Cross-sections: (place along the axis, half width, half depth[, centre's width, centre's depth])."""
LOFT_SAMPLES = 33
"""Cross-sections of a loft."""


@dataclass(frozen=True, eq=False)
class Loft:
    """One part of the surface."""

    segment: str
    """The segment it moves with, one of `SEGMENTS`."""
    start: Array
    """Start of the axis, of shape (3,), metres, in the segment's frame, from its joint."""
    frame: Array
    """Columns width, depth, axis, of shape (3, 3), in the segment's frame."""
    stations: Array
    """Rows of (along, half width, half depth, centre's width, centre's depth), of shape (n, 5), metres."""
    caps: tuple[float, float]
    """Height of the rounded ends, metres."""
    blend: float
    """Width of the smooth union with the parts before it in its group, metres."""
    materials: tuple[str, str] = ("skin", "skin")
    """Materials before and after `change`."""
    change: float = 9.0
    """Place along the axis where the second material begins, metres."""
    group: str = "trunk"
    """Group of parts that it blends with, one of `GROUPS`."""

    def mirrored(self) -> Loft:
        """The mirrored part on the right."""
        flip = np.array([-1.0, 1.0, 1.0])
        segment, group = (name.replace("left", "right") for name in (self.segment, self.group))
        return replace(self, segment=segment, group=group, start=self.start * flip, frame=self.frame * flip[:, None])

    def sampled(self) -> Array:
        """Half width, half depth and centre at `LOFT_SAMPLES` places evenly along the axis, of shape (SAMPLES, 4), metres."""
        from scipy.interpolate import PchipInterpolator

        along = self.stations[:, 0]
        return PchipInterpolator(along, self.stations[:, 1:])(np.linspace(along[0], along[-1], LOFT_SAMPLES))


class Surface(NamedTuple):
    """All lofts as arrays; P parts, in the order of their groups."""

    segment: np.ndarray
    """Index into `SEGMENTS`, of shape (P,)."""
    start: Array
    """Starts of the axes, of shape (P, 3), metres."""
    frame: Array
    """Columns width, depth, axis, of shape (P, 3, 3)."""
    table: Array
    """Half width, half depth, centre, sampled evenly along the axis, of shape (P, SAMPLES, 4), metres."""
    length: Array
    """Lengths of the axes, of shape (P,), metres."""
    caps: Array
    """Heights of the rounded ends, of shape (P, 2), metres."""
    blend: Array
    """Widths of the smooth unions, of shape (P,), metres."""
    change: Array
    """Places along the axes where the second material begins, of shape (P,), metres."""
    code: np.ndarray
    """Index into `GROUPS` and twice into `MATERIALS`, of shape (P, 3)."""

    @classmethod
    def of(cls, lofts: list[Loft]) -> Surface:
        """The arrays of `lofts`."""
        lofts = sorted(lofts, key=lambda loft: GROUPS.index(loft.group))
        return cls(segment=np.array([SEGMENTS.index(p.segment) for p in lofts]), start=np.stack([p.start for p in lofts]),
                   frame=np.stack([p.frame for p in lofts]), table=np.stack([p.sampled() for p in lofts]),
                   length=np.array([np.ptp(p.stations[:, 0]) for p in lofts]), caps=np.array([p.caps for p in lofts]),
                   blend=np.array([p.blend for p in lofts]), change=np.array([p.change for p in lofts]),
                   code=np.array([(GROUPS.index(p.group), *map(MATERIALS.index, p.materials)) for p in lofts]))

    @property
    def radius(self) -> Array:
        """Greatest reach of each part from its axis, of shape (P,), metres."""
        return (np.maximum(self.table[..., 0], self.table[..., 1]) + np.hypot(self.table[..., 2], self.table[..., 3])).max(1)


def loft_between(segment: str, joint: Array, start: Array, end: Array, rows: Sections, **more: Any) -> Loft:
    """A loft from `start` to `end` on a segment with its joint at `joint` (all (3,), world, T-pose); rows: places as shares of length."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length
    depth = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.8 else np.array([0.0, 0.0, 1.0])
    return Loft(segment, start - joint, frame_of(axis, depth), stations_of(rows, length), **more)


def frame_of(axis: Array, depth: Array) -> Array:
    """Columns width, depth, axis, (3, 3), with the depth as near to `depth` as possible."""
    depth = depth - (depth @ axis) * axis
    depth = depth / np.sqrt(depth @ depth)
    return np.stack([np.cross(depth, axis), depth, axis], 1)


def stations_of(rows: Sections, scale: float = 1.0) -> Array:
    """`Loft.stations` (n, 5) of rows: missing centres are 0; places along the axis are counted from the first and multiplied by `scale`."""
    table = np.array([(*row, *(5 - len(row)) * (0.0,)) for row in rows], float)
    table[:, 0] = (table[:, 0] - table[0, 0]) * scale
    return table


def ellipsoid(segment: str, joint: Array, middle: Array, radii: tuple[float, float, float], **more: Any) -> Loft:
    """An ellipsoid with half axes `radii` (x, y, z), metres: a short loft with long caps."""
    half, cap = np.array([0, 0, 0.02 * radii[2]]), 0.98 * radii[2]
    rows: Sections = [(0, radii[0], radii[1]), (1, radii[0], radii[1])]
    return loft_between(segment, joint, middle - half, middle + half, rows, caps=(cap, cap), **more)
