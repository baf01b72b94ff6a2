"""Masses, centres of mass and inertias of a body's segments, as shares of the whole (de Leva 1996)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.anthropometry import stature_of
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.opensim.coordinates import SIDES
from shadowpuppet.motion.animation import Animation

BODY_MASS_INDEX = 23.0
"""Weight over height squared, kg/m2, where the weight is unknown: the middle of the World Health Organization's normal range."""


def average_weight(animation: Animation) -> float:
    """Weight (kg) of a person of average build with a skeleton's bones."""
    places = dict(zip(animation.names, animation.rest))
    bones = {"upper_arm": ("shoulder", "elbow"), "forearm": ("elbow", "wrist"), "thigh": ("hip", "knee"), "shank": ("knee", "ankle")}
    lengths = {f"{bone}_length": float(np.linalg.norm(places[f"right_{b}"] - places[f"right_{a}"])) for bone, (a, b) in bones.items()}
    return BODY_MASS_INDEX * stature_of(lengths) ** 2


class BodySegment(NamedTuple):
    """A segment between two points of the skeleton."""

    joint: str
    """The joint that it moves with."""
    start: str
    end: str
    mass: float
    """Share of the whole body's."""
    centre: float
    """Of mass, from start to end, as a share of the length."""
    radii: tuple[float, float, float]
    """Of gyration, as shares of the length: about the axis forward, to the right (both across the segment), and along it."""


SEGMENTS = (
    BodySegment("pelvis", "chest", "pelvis", 0.1182, 0.55, (0.524, 0.477, 0.516)),
    BodySegment("chest", "chest", "waist", 0.1549, 0.55, (0.458, 0.369, 0.442)),
    BodySegment("chest", "waist", "neck", 0.1571, 0.75, (0.731, 0.478, 0.689)),
    BodySegment("neck", "crown", "head", 0.0681, 0.594, (0.346, 0.368, 0.315)),
    *(segment for side in SIDES for segment in (
        BodySegment(f"{side}_shoulder", f"{side}_shoulder", f"{side}_elbow", 0.0263, 0.576, (0.282, 0.265, 0.153)),
        BodySegment(f"{side}_elbow", f"{side}_elbow", f"{side}_wrist", 0.0150, 0.457, (0.269, 0.261, 0.108)),
        BodySegment(f"{side}_elbow", f"{side}_wrist", f"{side}_hand", 0.00585, 0.769, (0.580, 0.484, 0.368)),
        BodySegment(f"{side}_hip", f"{side}_hip", f"{side}_knee", 0.1447, 0.385, (0.349, 0.347, 0.156)),
        BodySegment(f"{side}_knee", f"{side}_knee", f"{side}_ankle", 0.0457, 0.444, (0.263, 0.258, 0.098)),
        BodySegment(f"{side}_ankle", f"{side}_heel", f"{side}_toe", 0.0133, 0.421, (0.278, 0.262, 0.132)),
    )),
)  # fmt: skip
"""Means of women and men (de Leva 1996, table 4); their masses are 1 together. The middle and upper trunk meet at the waist, the middle of
our chest."""


class Mass(NamedTuple):
    """Of a rigid body."""

    mass: float
    """Kilograms."""
    centre: Array
    """(3,), in the joint's frame at rest (left, up, forward), metres."""
    inertia: Array
    """About the centre, same axes, (3, 3), kg m2."""


def body_masses(animation: Animation, moving: Mapping[str, str], weight: float) -> dict[str, Mass]:
    """Masses of the rigid bodies of a whole body of a weight (kg). `moving`: for each joint, the joint whose body it belongs to, itself
    or one above. Segments that end at points that the skeleton lacks get what it has: a body without feet carries theirs at the ankles."""
    places = _places(animation)
    parts: dict[str, list[tuple[float, Array, Array]]] = {}
    for segment in SEGMENTS:
        owner = moving.get(segment.joint, "pelvis")
        fallback = places.get(segment.joint, places[owner])
        start, end = (places.get(name, fallback) - places[owner] for name in (segment.start, segment.end))
        mass = segment.mass * weight
        parts.setdefault(owner, []).append((mass, start + segment.centre * (end - start), mass * _inertia(end - start, segment.radii)))
    return {owner: _together(own) for owner, own in parts.items()}


def _places(animation: Animation) -> dict[str, Array]:
    """Points of a skeleton at rest (left, up, forward), metres, relative to the pelvis, by name."""
    places = dict(zip(animation.names, animation.rest))
    end = np.array(animation.ends.get(animation.names.index("head"), (0.0, 0.0, 0.0)))
    places["crown"] = places["head"] + end
    places.setdefault("chest", 0.5 * places["neck"])
    places["waist"] = (places["chest"] + places["neck"]) / 2
    return places


def _inertia(along: Array, radii: tuple[float, float, float]) -> Array:
    """Inertia (3, 3) for each kilogram of a segment along a vector (left, up, forward), metres."""
    length = float(np.linalg.norm(along))
    if not length:
        return np.zeros((3, 3))
    z = along / length
    forward = np.array([0.0, 0, 1]) if abs(z[2]) < 0.9 else np.array([0.0, 1, 0])
    x = forward - (forward @ z) * z
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(z, x), z], 1)
    return axes @ np.diag(np.square(radii) * length**2) @ axes.T


def _together(parts: list[tuple[float, Array, Array]]) -> Mass:
    """Several parts as one rigid body, by the parallel axis theorem."""
    mass = sum(part[0] for part in parts)
    centre = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for m, c, own in parts:
        d = c - centre
        inertia += own + m * (d @ d * np.eye(3) - np.outer(d, d))
    return Mass(mass, centre, inertia)
