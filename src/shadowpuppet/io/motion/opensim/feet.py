"""Heels and toes of a body's feet, which inverse kinematics need to find the ankles' angles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.geometry import Array
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import TO_REST
from shadowpuppet.motion.motion import JointTable

FEET = {f"{side}_ankle": (f"{side}_heel", f"{side}_toe") for side in ("left", "right")}
"""Points of the foot at each ankle."""
TOES = 0.6
"""Distance of the big toe from the foot's middle, as a share of half its width there."""


def foot_points(body: Body, ankle: str) -> Array | None:
    """Heel and big toe (2, 3), in an ankle's frame at rest (left, up, forward), metres, on the sole; None for a body without
    feet."""
    name = ankle.replace("ankle", "foot")
    if body.limbs is None or name not in body.limbs.parts:
        return None
    n = body.limbs.parts.index(name)
    heel, toes = body.limbs.starts[n], body.limbs.ends[n]  # forward, left, up
    along = (toes - heel) / np.linalg.norm(toes - heel)
    (heel_up, _), (toes_up, half_width) = body.limbs.radii[n]
    heel = heel - along * body.limbs.caps[n, 0] - [0, 0, heel_up]
    toes = toes + along * body.limbs.caps[n, 1] - [0, 0, toes_up]
    aside = TOES * half_width * np.array([0, -1.0 if ankle.startswith("left") else 1.0, 0])
    return np.stack([heel, toes + aside]) @ TO_REST.T


def with_feet(table: JointTable, body: Body, animation: Animation) -> JointTable:
    """The table with heels and toes of a body that has feet; `animation`: the body, moving as in the table, at the same times."""
    places, turns = animation.world()
    names, points = list(table.names), [table.positions]
    for ankle, ends in FEET.items():
        foot = foot_points(body, ankle)
        if foot is None or ends[0] in names:
            continue
        n = animation.names.index(ankle)
        for name, end in zip(ends, foot):
            names.append(name)
            points.append((places[:, n] + turns[:, n] @ end)[:, None])
    return replace(table, names=tuple(names), positions=np.concatenate(points, 1))
