"""Checks before a fit that joints are a person's, in metres, with Z up and left and right in place."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.errors import ShadowPuppetError, choices, warn
from shadowpuppet.geometry import Array, unit
from shadowpuppet.motion.motion import JointTable

NEEDED_JOINTS = tuple(f"{side}_{name}" for name in ("shoulder", "elbow", "knee") for side in SIDES)
"""Joints that a fit of the whole body needs, in addition to the pelvis or both hips."""
TRUNK_LENGTH = (0.2, 0.8)
"""Possible distance from the hips to the shoulders, metres."""
LENGTH_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}
BENT = np.radians(25)
"""Bend (rad) of a knee or elbow from which its direction is known."""


def check_person(table: JointTable, source: str = "joints") -> None:
    """Raise a `ShadowPuppetError` if joints are missing, not in metres, upside down, or left and right are swapped. Warns if the trunk
    lies level most of the time, which suggests that Y is up."""
    missing = [name for name in NEEDED_JOINTS if name not in table.names]
    if "pelvis" not in table.names and not {"left_hip", "right_hip"} <= set(table.names):
        missing = ["pelvis (or left_hip and right_hip)", *missing]
    if missing:
        raise ShadowPuppetError(f"{source}: no joint {missing[0]}; needed are {choices(NEEDED_JOINTS)}, and pelvis or both hips; found: "
                                f"{choices(table.names)}")
    trunk = midpoint(table, "shoulder") - midpoint(table, "hip")
    length = float(_median(np.linalg.norm(trunk, axis=1)))
    if not np.isfinite(length):
        raise ShadowPuppetError(f"{source}: found no frame in which hips and shoulders are known")
    least, most = TRUNK_LENGTH
    if not least <= length <= most:
        units = [name for name, metres in LENGTH_UNITS.items() if least <= length * metres <= most]
        hint = f" (are these {' or '.join(units)}?)" if units else ""
        raise ShadowPuppetError(f"{source}: found {length:.4g} from hips to shoulders, expected {least:g} to {most:g} metres{hint}")
    _check_upright(trunk, source)
    _check_sides(table, trunk, source)


def midpoint(table: JointTable, joint: str) -> Array:
    """Midpoint of both sides' joints (T, 3), metres; for hips that a table lacks, the pelvis."""
    if joint == "hip" and not {"left_hip", "right_hip"} <= set(table.names):
        return positions_of(table, "pelvis")
    return (positions_of(table, f"left_{joint}") + positions_of(table, f"right_{joint}")) / 2


def positions_of(table: JointTable, joint: str) -> Array:
    """Positions (T, 3) of a joint; not a number if the table lacks it."""
    return table.positions[:, table.names.index(joint)] if joint in table.names else np.full((len(table.times), 3), np.nan)


def leftward(table: JointTable) -> Array:
    """Unit vectors (T, 3) from right to left: along the hips, or along the shoulders if a table has no hips."""
    hips = unit(positions_of(table, "left_hip") - positions_of(table, "right_hip"))
    return np.where(np.isfinite(hips), hips, unit(positions_of(table, "left_shoulder") - positions_of(table, "right_shoulder")))


def _check_upright(trunk: Array, source: str) -> None:
    lean = float(_median(unit(trunk)[:, 2]))
    if lean < -0.5:
        raise ShadowPuppetError(f"{source}: found the shoulders under the hips most of the time, expected the world's Z up")
    if lean < 0.3:
        warn(f"{source}: the trunk lies level most of the time: is the world's Z up?")


def _check_sides(table: JointTable, trunk: Array, source: str) -> None:
    """Raise a `ShadowPuppetError` if the trunk is twisted too far, or knees bend forward or elbows backward, as in a mirror image."""
    shoulders = positions_of(table, "left_shoulder") - positions_of(table, "right_shoulder")
    if {"left_hip", "right_hip"} <= set(table.names) and _median((leftward(table) * unit(shoulders)).sum(1)) < -0.3:
        raise ShadowPuppetError(f"{source}: found the left shoulder over the right hip most of the time: have left and right changed "
                                "places?")
    ahead = np.cross(leftward(table), unit(trunk))
    wrong, bent = _bends(table, ahead, ("hip", "knee", "ankle"), -1)
    what = "knees bend forward"
    if bent < 20:
        wrong, bent = _bends(table, ahead, ("shoulder", "elbow", "wrist"), 1, hanging=-unit(trunk))
        what = "the elbows of hanging arms bend backward"
    if bent >= 20 and wrong > 0.7 * bent:
        raise ShadowPuppetError(f"{source}: {what} in {wrong} of {bent} places where they are bent: have left and right changed places, "
                                "or is the motion mirrored (an axis with the wrong sign)?")


def _bends(table: JointTable, ahead: Array, chain: tuple[str, str, str], sign: int, hanging: Array | None = None) -> tuple[int, int]:
    """Number of frames and sides in which a chain's middle joint bends against `sign` along `ahead` (T, 3), and in which it is bent."""
    wrong = total = 0
    for side in SIDES:
        a, b, c = (positions_of(table, f"{side}_{name}") for name in chain)
        upper, lower = unit(b - a), unit(c - b)
        along = (upper * lower).sum(1)
        bent = along < np.cos(BENT)
        if hanging is not None:
            bent &= (upper * hanging).sum(1) > 0.7
        ahead_bend = ((lower - along[:, None] * upper) * ahead).sum(1)
        bent &= np.abs(ahead_bend) > 0.3 * np.sin(BENT)
        wrong, total = wrong + int((bent & (ahead_bend * sign < 0)).sum()), total + int(bent.sum())
    return wrong, total


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan
