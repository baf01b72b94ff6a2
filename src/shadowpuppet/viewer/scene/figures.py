"""Figures of a body's poses, of a moving skeleton, or of joints alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import BONES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.limbs import DOUBTFUL, LIMBS, limb_of
from shadowpuppet.motion.mesh import Mesh, body_mesh, bone_mesh
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.viewer.scene.scene import LimbDoubt, SceneFigure

DOT = 0.06
"""Length of the mark of a joint without bones, metres."""
MIDPOINTS = {"neck": ("left_shoulder", "right_shoulder"), "pelvis": ("left_hip", "right_hip")}
"""Joints that, if missing, are added midway between two others."""


class LimbStatuses(NamedTuple):
    """The statuses of a motion's limbs."""

    limbs: Sequence[str]
    """Of `LIMBS`, K of them."""
    status: NDArray[np.str_]
    """Of `motion.STATUSES`, of shape (T, K)."""


def animation_figure(name: str, animation: Animation, mesh: Mesh | None = None, kind: str = "estimate",
                     statuses: LimbStatuses | None = None, **more) -> SceneFigure:
    """Figure of a moving skeleton with a mesh, by default a stick along every bone. `more`: fields of `SceneFigure`."""
    places, turns = animation.world()
    own = {"joints": places, "joint_names": animation.names, "bones": bones_of(more.get("joint_names", animation.names))}
    return SceneFigure(name, animation.times, mesh or bone_mesh(animation), animation.rest, places, turns, kind,
                  **_of_statuses(animation.names, statuses), **(own | more))


def _of_statuses(names: Sequence[str], statuses: LimbStatuses | None) -> dict[str, Any]:
    """Fields of a figure with joints of these names."""
    if statuses is None:
        return {}
    return {"doubtful": limb_doubt(names, statuses), "limbs": tuple(statuses.limbs), "limb_status": statuses.status}


def limb_doubt(names: Sequence[str], statuses: LimbStatuses) -> LimbDoubt:
    """Which limbs of a figure with joints of these names are not vouched for."""
    frames = np.zeros((len(statuses.status), len(LIMBS)), bool)
    frames[:, [LIMBS.index(limb) for limb in statuses.limbs]] = np.isin(statuses.status, DOUBTFUL)
    return LimbDoubt(frames, np.array([LIMBS.index(limb_of(name)) for name in names]))


def pose_figure(name: str, body: Body, times: Array, poses: Array, root: Array, kind: str = "estimate") -> SceneFigure:
    """Figure of a body in poses (T, D); `root` (4, 4): the body's frame to the world."""
    return animation_figure(name, BodyTree(body).animation(times, poses, root), body_mesh(body), kind)


def bones_of(names: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Indices of the ends of the bones between joints of these names."""
    return tuple((names.index(a), names.index(b)) for a, b in BONES if a in names and b in names)


def joint_figure(name: str, table: JointTable, kind: str = "estimate", **more) -> SceneFigure:
    """Figure of joints without a skeleton: a stick for every bone between them, a dot for each other joint. `more`: as of
    `animation_figure`."""
    table = _with_midpoints(table)
    names = list(table.names)
    pairs = bones_of(names)
    used = {n for pair in pairs for n in pair}
    places = table.positions
    ends = [(places[:, a], places[:, b], names[b]) for a, b in pairs]
    ends += [(places[:, n], places[:, n] + np.array([0, 0, DOT]), names[n]) for n in range(len(names)) if n not in used]
    more = {"joints": places, "joint_names": tuple(names), "bones": pairs} | more
    return _of_sticks(name, table.times, ends, kind, **more)


def _of_sticks(name: str, times: Array, ends: Sequence[tuple[Array, Array, str]], kind: str,
               statuses: LimbStatuses | None = None, **more) -> SceneFigure:
    """Figure of sticks between moving points (T, 3), each of constant length: the median."""
    T, J = len(times), len(ends) + 1
    lengths = [_median(np.linalg.norm(b - a, axis=1)) for a, b, _ in ends]
    offsets = np.zeros((J, 3))
    tips = {n + 1: (0.0, 0.0, length) for n, length in enumerate(lengths)}
    eye = np.tile(np.eye(3), (T, J, 1, 1))
    parents = (-1, *([0] * len(ends)))
    frame = Animation(("", *(side for _, _, side in ends)), parents, offsets, tips, times, eye, np.zeros((T, J, 3)))
    places, turns = np.full((T, J, 3), np.nan), np.full((T, J, 3, 3), np.nan)
    for n, (a, b, _) in enumerate(ends):
        places[:, n + 1], turns[:, n + 1] = a, _rotations_along(b - a)
        places[~np.isfinite(b).all(1), n + 1] = np.nan
    return SceneFigure(name, times, bone_mesh(frame), np.zeros((J, 3)), places, turns, kind, **_of_statuses(frame.names, statuses), **more)


def _rotations_along(along: Array) -> Array:
    """Rotations (T, 3, 3) with z along vectors (T, 3) and little rotation about z from frame to frame."""
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    good = np.isfinite(lengths[:, 0]) & (lengths[:, 0] > 1e-9)
    z = np.where(good[:, None], along / np.where(good[:, None], lengths, 1), [0.0, 0.0, 1.0])
    aside = np.eye(3)[int(np.abs(z).mean(0).argmin())]
    x = np.cross(aside, z)
    short = np.linalg.norm(x, axis=1) < 1e-6
    x[short] = np.cross(np.eye(3)[(int(np.argmax(aside)) + 1) % 3], z[short])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    out = np.stack([x, np.cross(z, x), z], 2)
    out[~good] = np.nan
    return out


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


def _with_midpoints(table: JointTable) -> JointTable:
    """The table with a neck and a pelvis added between shoulders and hips, if missing."""
    names, places = list(table.names), [table.positions]
    for name, (left, right) in MIDPOINTS.items():
        if name not in names and left in names and right in names:
            places.append((table.positions[:, [names.index(left)]] + table.positions[:, [names.index(right)]]) / 2)
            names.append(name)
    return JointTable(table.times, tuple(names), np.concatenate(places, axis=1))
