"""Usual postures of legs, for one camera: standing, squatting, seated, kneeling; and the floor, which no leg goes below.

A silhouette from the front says little of a leg's depth: straight legs and those of a seated person look alike where the feet are out of
the picture. A pull to standing legs alone would decide for straight ones.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from shadowpuppet.body.segments import dofs_of, leg_postures, limbs_of
from shadowpuppet.body.skeleton import Skeleton, bounded
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import pixel_scale
from shadowpuppet.tracking.silhouette_cost import Cost, Soles

USUAL = np.radians([(50, 70, -15), (88, 90, 0), (110, 120, -25), (0, 90, 55)])
"""Flexion of hip, knee and ankle (upward negative) of usual legs besides standing ones, rad: half a squat, seated, a squat, kneeling."""
SPREAD = np.radians((25, 25, 20))
"""Their standard deviations."""
RARER = np.array([1.0, 1.0, 2.0, 2.0])
"""What they cost more than standing, in squared deviations."""
ABOVE_FLOOR, BELOW_FEET = 0.05, 0.15
"""Least height of the hips over the floor, metres; and how far below the straight legs' soles a floor may be that is the person's."""
FLOOR_WEIGHT = 5000.0
"""Cost of a point of the feet or a knee below the floor (pixels per m^2, at 320 x 240)."""
CONTACT_WEIGHT, REACH = 20000.0, 0.15
"""Cost of both feet off the floor, in the same unit; and the distance (m) from which it grows in proportion only."""
SOLES_REACH = 4.5
"""Distance (pixels at 320 x 240) of the soles from the silhouette's last row at which its cost no longer grows much."""
CUT_OFF = 2.0
"""How much farther below the end of a silhouette soles may be that the picture cuts off."""


def posture_penalty(skeleton: Skeleton, poses: Array) -> Array:
    """As `Skeleton.posture_penalty` (N,) of poses (N, D), but each leg's is that of the nearest usual posture."""
    legs = [limb for limb in limbs_of(skeleton) if limb.endswith("leg")]
    if not legs:
        return skeleton.posture_penalty(poses)
    deviations = skeleton.deviations(poses)
    total = deviations.sum(1)
    for leg in legs:
        dofs, (usual, spread) = dofs_of(skeleton, leg), _usual(skeleton, leg)
        standing = deviations[:, dofs].sum(1)
        other = bounded((poses[:, None, dofs] - usual) / spread).sum(2)
        total += np.minimum((RARER + other).min(1) - standing, 0)
    return total


@cache
def _usual(skeleton: Skeleton, leg: str) -> tuple[Array, Array]:
    """The `USUAL` values (K, d) of a leg's DOF, and their standard deviations (d,)."""
    dofs = dofs_of(skeleton, leg)
    _, below, above = (each[dofs] for each in skeleton.rest_and_spread)
    usual = leg_postures(skeleton, leg, USUAL)
    bent = np.argmax(np.ptp(usual, axis=0)[:3])  # the hip's DOF that flexes it
    spread = np.minimum(below, above)
    spread[bent], spread[3] = SPREAD[:2]
    spread[4:5] = SPREAD[2]
    return usual, spread


def floor_below(picture: Picture) -> float | None:
    """Height (m) of the floor in the body's frame; None if it is not known, or cannot be the floor on which the person is whose hips are at
    the body's place."""
    skeleton, floor = picture.body.skeleton, picture.floor
    if floor is None or not any(limb.endswith("leg") for limb in limbs_of(skeleton)):
        return None
    hips, ankles = picture.body.points(skeleton.pose()[None], names=["left_hip", "left_ankle"])[0, :, 2]
    return floor if ankles - BELOW_FEET <= floor <= hips - ABOVE_FLOOR else None


def soles_cost(picture: Picture, soles: Soles, weight: float) -> Cost:
    """The cost (N,) of poses (N, D) whose lower sole is not where the silhouette ends, or, if that is cut off, some pixels below; `weight`:
    per squared pixel at 320 x 240. It is bounded: shoes may be like the floor. The silhouette's sides say less of the distance: clothes
    make a person wider by an unknown share."""
    camera, unit = picture.camera, pixel_scale(picture.camera.size)
    names = [f"{side}_{name}" for side in ("left", "right") for name in ("heel", "toe")]

    def cost(poses: Array) -> Array:
        off = camera.project(picture.points_world(poses, names))[..., 1].max(1) - soles.row
        squared = np.where(soles.cut & (off > 0), off / CUT_OFF, off) ** 2 / unit
        return weight * unit * np.where(np.isfinite(squared), squared / (1 + squared / SOLES_REACH**2), SOLES_REACH**2)

    return cost


def contact_cost(picture: Picture, level: float, weight: float) -> Cost:
    """The cost (N,) of poses (N, D) none of whose feet stands on a floor at a height `level` (m) in the body's frame; `weight`: per m^2. A
    foot stands on heel and toes; who kneels is on knee and toes. Far away it grows in proportion: a person may jump, or sit with hanging
    feet."""
    known, sides = picture.body.landmark_names, ("left", "right")
    feet = [[f"{side}_{name}" for name in names] for side in sides for names in (("heel", "toe"), ("knee", "toe"))]
    if any(name not in known for names in feet for name in names):
        feet = [[name] for name in _lowest(picture)]

    def cost(poses: Array) -> Array:
        squared = np.min([((picture.body.points(poses, names=names)[..., 2] - level) ** 2).mean(1) for names in feet], axis=0)
        return weight * 2 * REACH**2 * (np.sqrt(1 + squared / REACH**2) - 1)

    return cost


def standing_costs(picture: Picture, level: float) -> list[Cost]:
    """What speaks against poses on a floor at a height `level` (m) in the body's frame: feet below it, and feet off it."""
    scale = pixel_scale(picture.camera.size)
    return [floor_cost(picture, level, FLOOR_WEIGHT * scale), contact_cost(picture, level, CONTACT_WEIGHT * scale)]


def floor_cost(picture: Picture, level: float, weight: float) -> Cost:
    """The cost (N,) of poses (N, D) whose feet or knees are below a floor at a height `level` (m) in the body's frame; `weight`: per
    m^2."""
    names = _lowest(picture)
    return lambda poses: weight * (np.minimum(picture.body.points(poses, names=names)[..., 2] - level, 0) ** 2).sum(1)


def _lowest(picture: Picture) -> list[str]:
    """Names of the landmarks that may be on the floor."""
    known = picture.body.landmark_names
    return [f"{side}_{name}" for side in ("left", "right") for name in ("heel", "toe", "ankle", "knee") if f"{side}_{name}" in known]
