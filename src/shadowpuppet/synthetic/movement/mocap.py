"""Retargets motion capture to the mannequin: directions of the measured segments, lengths of the mannequin.

Limbs take their directions from the measured joints, so that their swing is exact; their axial rotation follows from the planes of elbow
and knee, and from thumbs and toes. Trunk, head and feet take their rotation from the capture's rest posture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import Array, shortest_rotation
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.synthetic.person.kinematics import SEGMENTS, SIDES, Assembly, PosedBody, rotations
from shadowpuppet.synthetic.person.mannequin import Mannequin

if TYPE_CHECKING:
    from shadowpuppet.io.motion.amc import Capture
    from shadowpuppet.synthetic.movement.script import Gesture

JointPlaces = dict[str, Array]


def animate_mocap(body: Mannequin, gestures: Sequence[Gesture], t: Array, turn: float = 0.0) -> PosedBody:
    """The figure of `body` at times `t` (T,), s, moving as in the file of `gestures`; it begins facing -Y rotated by `turn`.

    The middle of the area it covers lies at the origin. Raises `FormatError` if the file cannot be used.
    """
    gesture, capture = _one(gestures)
    table = capture.joints(gesture.file_rate)
    shown = _at(table, t + gesture.start)
    figure = retarget(body, shown, capture.at_rest.joints())
    pelvis = figure.rotation[:, 0]
    heading = turn - float(np.arctan2(-pelvis[0, 0, 1], pelvis[0, 1, 1]))
    R = rotations(*np.zeros((2, 1)), np.array([heading]))[0]
    joints, origin = figure.joints @ R.T, figure.origin @ R.T
    middle = np.append((joints[:, 0, :2].max(0) + joints[:, 0, :2].min(0)) / 2, 0.0)
    return PosedBody(joints - middle, R @ figure.rotation, origin - middle, figure.curl)


def mocap_seconds(gestures: Sequence[Gesture]) -> float:
    """Length of the motion, seconds: the gesture's, at most the rest of its file."""
    gesture, capture = _one(gestures)
    there = (len(capture.root) - 1) / gesture.file_rate - gesture.start
    if there <= 0:
        raise SettingsError(f"start: found {gesture.start:g} s, but {gesture.file} has only {there + gesture.start:.2f} s")
    return min(gesture.seconds, there)


def _one(gestures: Sequence[Gesture]) -> tuple[Gesture, Capture]:
    from shadowpuppet.io.motion.amc import read_mocap

    if len(gestures) != 1 or gestures[0].file is None:
        raise SettingsError(f"motion: found mocap among {len(gestures)} motions, expected it alone")
    return gestures[0], read_mocap(gestures[0].file)


def _at(table: JointTable, t: Array) -> JointTable:
    """The table at times `t`, interpolated by cubics."""
    from scipy.interpolate import CubicSpline

    t = np.clip(t, table.times[0], table.times[-1])
    if len(table.times) < 3:
        return JointTable(np.arange(len(t), dtype=float), table.names, np.repeat(table.positions[:1], len(t), 0))
    return JointTable(np.arange(len(t), dtype=float), table.names, CubicSpline(table.times, table.positions)(t))


def retarget(body: Mannequin, table: JointTable, rest: JointTable) -> PosedBody:
    """The figure of `body` in the postures of `table`, one per row; rest: one row, the same skeleton upright, arms level, facing -Y.

    Both tables have the joints of `io.motion.amc.ENDS`, `pelvis` and `face`. The pelvis follows the measured one, scaled by the length of
    the legs; the lowest soles are brought to the floor.
    """
    p: JointPlaces = dict(zip(table.names, table.positions.swapaxes(0, 1)))
    calm: JointPlaces = dict(zip(rest.names, rest.positions.swapaxes(0, 1)))
    parts = Assembly(body.rest())
    legs = _length(calm, "hip", "knee") + _length(calm, "knee", "ankle")
    centre = p["pelvis"] * (body.length("thigh") + body.length("shank")) / legs
    pelvis, thorax, head = (_frame(p, *axes) @ _frame(calm, *axes).swapaxes(1, 2) for axes in TRUNK_AXES)
    parts.add_trunk(centre, pelvis, _between(pelvis, thorax), thorax, _between(thorax, head), head)
    for side in SIDES:
        _add_arm(parts, p, calm, side)
        _add_leg(parts, body, p, calm, side)
    return _on_the_floor(body, parts.figure(np.full((len(table.times), 2), 0.35)))


TRUNK_AXES = (("pelvis", "lumbar", "right_hip", "left_hip"), ("lumbar", "neck", "right_shoulder", "left_shoulder"),
              ("head", "crown", "crown", "face"))
"""Axes of pelvis, thorax and head: up from the first joint to the second; left or ahead from the third to the fourth."""


def _frame(p: JointPlaces, low: str, high: str, start: str, end: str) -> Array:
    """Frames (T, 3, 3) with z from `low` to `high` and x as near as possible to the direction from `start` to `end`."""
    z = _unit(p[high] - p[low])
    x = p[end] - p[start]
    x = _unit(x - (x * z).sum(1, keepdims=True) * z)
    return np.stack([x, np.cross(z, x), z], -1)


def _add_arm(parts: Assembly, p: JointPlaces, calm: JointPlaces, side: str) -> None:
    """Add clavicle, upper arm, forearm, hand and fingers of one side."""
    sign, thorax = 1.0 if side == "left" else -1.0, parts.frame["thorax"][0]
    now = _unit(np.einsum("tji,tj->ti", thorax, p[f"{side}_shoulder"] - p["neck"]))
    clavicle = thorax @ shortest_rotation(_unit(calm[f"{side}_shoulder"] - calm["neck"]), now, 1e-6)
    upper, fore = (_unit(p[f"{side}_{b}"] - p[f"{side}_{a}"]) for a, b in (("shoulder", "elbow"), ("elbow", "wrist")))
    hinge = _steady_normals(-sign * np.cross(upper, fore), thorax @ np.array([sign, 0, 0.3]))
    upper_arm, bare = (_along_x(sign * axis, hinge) for axis in (upper, fore))
    hand_axis = _unit(p[f"{side}_hand"] - p[f"{side}_wrist"])
    thumb = p[f"{side}_thumb"] - p[f"{side}_wrist"]
    hand = _along_x(sign * hand_axis, np.cross(sign * hand_axis, -thumb))
    forearm = _between(bare, shortest_rotation(hand[..., 0], bare[..., 0], 1e-6) @ hand)  # half of the hand's axial rotation
    parts.add_arm(side, clavicle, upper_arm, bare, forearm, hand, np.zeros(len(hand)))


def _add_leg(parts: Assembly, body: Mannequin, p: JointPlaces, calm: JointPlaces, side: str) -> None:
    """Add thigh, shank, foot and toes of one side."""
    pelvis, centre = parts.frame["pelvis"]
    hip, knee, ankle = (p[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    ahead = _steady_normals(knee - (hip + ankle) / 2, pelvis @ np.array([0, -1.0, 0]))
    thigh, shank = (_along_z(_unit(a - b), -ahead) for a, b in ((hip, knee), (knee, ankle)))
    axes = (f"{side}_ankle", f"{side}_ball", f"{side}_ankle", f"{side}_knee")
    foot = _frame(p, *axes) @ _frame(calm, *axes).swapaxes(1, 2)
    bend = _bend(p, side) - _bend(calm, side)
    hip = centre + pelvis @ (parts.rest[f"{side}_hip"] - parts.rest["pelvis"])
    knee = hip - thigh @ np.array([0, 0, body.length("thigh")])
    ankle = knee - shank @ np.array([0, 0, body.length("shank")])
    parts.joint |= {f"{side}_hip": hip, f"{side}_knee": knee, f"{side}_ankle": ankle}
    parts.frame |= {f"{side}_thigh": (thigh, hip), f"{side}_shank": (shank, knee), f"{side}_foot": (foot, ankle),
                    f"{side}_toes": (foot @ rotations(-bend, 0 * bend, 0 * bend), ankle + foot @ body.ball())}


def _bend(p: JointPlaces, side: str) -> Array:
    """Upward bend of the toes against the foot, rad, of shape (T,)."""
    foot, toes = _unit(p[f"{side}_ball"] - p[f"{side}_ankle"]), _unit(p[f"{side}_toes"] - p[f"{side}_ball"])
    across = np.cross(foot, _unit(p[f"{side}_knee"] - p[f"{side}_ankle"]))
    return np.arctan2((np.cross(foot, toes) * _unit(across)).sum(1), (foot * toes).sum(1))


def _on_the_floor(body: Mannequin, figure: PosedBody) -> PosedBody:
    """The figure shifted vertically so that the lowest ankle or ball is as high as in standing (2nd percentile over time)."""
    lowest = []
    for side in SIDES:
        ball = figure.origin[:, SEGMENTS.index(f"{side}_toes"), 2] - (body.ball()[2] + body.length("ankle"))
        lowest += [ball, figure.origin[:, SEGMENTS.index(f"{side}_foot"), 2] - body.length("ankle")]
    shift = np.array([0, 0, -float(np.percentile(np.min(lowest, 0), 2))])
    return PosedBody(figure.joints + shift, figure.rotation, figure.origin + shift, figure.curl)


def _steady_normals(plane: Array, usual: Array) -> Array:
    """Normals (T, 3) of elbow or knee planes; those of a nearly straight limb follow their neighbours in time, or else `usual`."""
    from scipy.ndimage import gaussian_filter1d

    size = np.linalg.norm(plane, axis=1).max(initial=1e-9)
    near = gaussian_filter1d(plane, 4.0, axis=0, mode="nearest") if len(plane) > 1 else plane
    return plane + 0.5 * near + 0.05 * size * usual


def _along_x(x: Array, z: Array) -> Array:
    """Frames (T, 3, 3) with x along unit vectors `x` and z as near to `z` as possible."""
    z = _unit(z - (z * x).sum(1, keepdims=True) * x)
    return np.stack([x, np.cross(z, x), z], -1)


def _along_z(z: Array, y: Array) -> Array:
    """Frames (T, 3, 3) with z along unit vectors `z` and y as near to `y` as possible."""
    y = _unit(y - (y * z).sum(1, keepdims=True) * z)
    return np.stack([np.cross(y, z), y, z], -1)


def _between(a: Array, b: Array) -> Array:
    """Rotations (T, 3, 3) halfway from `a` to `b`."""
    from scipy.spatial.transform import Rotation

    half = Rotation.from_matrix(a.swapaxes(1, 2) @ b).as_rotvec() / 2
    return a @ Rotation.from_rotvec(half).as_matrix()


def _length(p: JointPlaces, a: str, b: str) -> float:
    """Mean distance of two joints of both sides."""
    return float(np.mean([np.linalg.norm(p[f"{side}_{a}"] - p[f"{side}_{b}"]) for side in SIDES]))


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
