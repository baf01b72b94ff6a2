"""A body's poses as an animated skeleton for other programs: its joints and landmarks as one tree, under the landmarks' names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shadowpuppet.body.shapes import Body, Quads
from shadowpuppet.body.whole_body import Three
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, align
from shadowpuppet.motion.animation import SAME_PLACE, Animation
from shadowpuppet.motion.motion import Motion

TO_REST = np.array([[0.0, 1, 0], [0, 0, 1.0], [1.0, 0, 0]])
"""From a body's axes (forward, left, up) to those of skeletons at rest (left, up, forward)."""
JOINT_TOLERANCE = 1e-4
"""Largest distance (m) of a run's joints from its body's with one transform for all frames."""
MIN_END = 0.01
"""Smallest length of a bone's end, metres."""


@dataclass(frozen=True)
class TreeNode:
    """A joint of the body, or a landmark fixed to one."""

    name: str
    parent: int
    """Index of the parent node; -1 for none."""
    joint: int
    """The body's joint that it moves with."""
    place: Three | None
    """Position of a landmark in that joint's frame, metres; None for the joint itself."""


@dataclass(frozen=True, eq=False)
class BodyTree:
    """A body's joints and landmarks as one tree."""

    body: Body

    @cached_property
    def nodes(self) -> tuple[TreeNode, ...]:
        """Parents before children; a joint with a landmark at its place has the landmark's name."""
        skeleton, names = self.body.skeleton, self._names
        nodes = list[TreeNode]()
        for j, joint in enumerate(skeleton.joints):
            above = -1 if joint.parent is None else self._joint_node(nodes, skeleton.joint_index(joint.parent))
            nodes.append(TreeNode(names[j], above, j, None))
        for name, (joint, place) in self._fixed:
            nodes.append(TreeNode(name, self._above(nodes, joint, place), joint, place))
        return tuple(nodes)

    def node_of(self, joint: int) -> int:
        """The node of a joint of the body."""
        return self._joint_node(self.nodes, joint)

    @cached_property
    def ends(self) -> dict[int, Three]:
        """Ends of the last node of each chain (crown, fingertips, toes or soles), in the body's axes."""
        leaves = [n for n in range(len(self.nodes)) if n not in {node.parent for node in self.nodes}]
        return {n: self._end(self.nodes[n]) for n in leaves}

    def animation(self, times: Array, poses: Array, roots: Array) -> Animation:
        """The tree in poses (T, D) at times (T,), seconds; `roots` (4, 4) or (T, 4, 4): the body's frame in the world."""
        known = np.asarray(np.isfinite(poses).all(1))
        frames = self.body.skeleton.forward(np.where(known[:, None], poses, 0.0))
        rotations, shifts = (np.empty((len(poses), len(self.nodes), *shape)) for shape in ((3, 3), (3,)))
        for n, node in enumerate(self.nodes):
            rotations[:, n], shifts[:, n] = self._against(frames, node)
        R, t = roots[..., :3, :3], roots[..., :3, 3]
        rotations[:, 0], shifts[:, 0] = R @ frames[:, 0, :, :3] @ TO_REST.T, (R @ frames[:, 0, :, 3:])[..., 0] + t
        rotations[~known], shifts[~known] = np.nan, np.nan
        parents = tuple(node.parent for node in self.nodes)
        ends = {n: tuple((TO_REST @ place).tolist()) for n, place in self.ends.items()}
        return Animation(tuple(node.name for node in self.nodes), parents, self.offsets, ends, np.asarray(times, float), rotations, shifts)

    @cached_property
    def offsets(self) -> Array:
        """Positions (N, 3) of the nodes relative to their parents, metres, at rest."""
        frames = self.body.skeleton.forward(np.zeros((1, len(self.body.skeleton.dofs))))
        return np.array([np.zeros(3) if node.parent < 0 else self._against(frames, node)[1][0] for node in self.nodes])

    def _against(self, frames: Array, node: TreeNode) -> tuple[Array, Array]:
        """Rotations (T, 3, 3) and positions (T, 3) of a node relative to its parent, rest axes, from the joints' frames (T, J, 3, 4)."""
        if node.parent < 0:
            return frames[:, node.joint, :, :3], frames[:, node.joint, :, 3]
        above = self.nodes[node.parent]
        A, B = frames[:, above.joint], frames[:, node.joint]
        start = np.zeros(3) if above.place is None else np.array(above.place)
        if node.place is not None:
            shift = np.broadcast_to(np.array(node.place) - start, (len(A), 3))
            return np.broadcast_to(np.eye(3), (len(A), 3, 3)), shift @ TO_REST.T
        back = np.swapaxes(A[:, :, :3], 1, 2)
        shift = (back @ (B[:, :, 3:] - A[:, :, 3:]))[..., 0] - start
        return TO_REST @ (back @ B[:, :, :3]) @ TO_REST.T, shift @ TO_REST.T

    @cached_property
    def _names(self) -> list[str]:
        """The joints' names: of the landmark at their place, or their own."""
        skeleton = self.body.skeleton
        names = [joint.name for joint in skeleton.joints]
        for name, (joint, place) in self.body.landmarks.items():
            at = self._joint_at(skeleton.joint_index(joint), place)
            if at is not None:
                names[at] = name
        return names

    @cached_property
    def _fixed(self) -> list[tuple[str, tuple[int, Three]]]:
        """Landmarks that are not joints, nearest to their joint first."""
        found = [(name, (self.body.skeleton.joint_index(joint), place)) for name, (joint, place) in self.body.landmarks.items()
                 if not name.endswith("_fist")]  # fmt: skip
        loose = [(name, (joint, place)) for name, (joint, place) in found if self._joint_at(joint, place) is None]
        return sorted(loose, key=lambda each: float(np.linalg.norm(each[1][1])))

    def _joint_at(self, joint: int, place: Three) -> int | None:
        """The joint that coincides with a position in a joint's frame in every pose, if there is one."""
        if np.linalg.norm(place) < SAME_PLACE:
            return joint
        skeleton = self.body.skeleton
        moved = {coupling.joint for coupling in skeleton.couplings} | {dof.joint for dof in skeleton.dofs if dof.kind == "translation"}
        for j, other in enumerate(skeleton.joints):
            near = np.abs(np.subtract(other.offset, place)).max() < SAME_PLACE
            if near and other.parent == skeleton.joints[joint].name and other.name not in moved:
                return j
        return None

    def _above(self, nodes: list[TreeNode], joint: int, place: Three) -> int:
        """The parent node of a landmark: the last landmark between it and its joint, or that joint."""
        length = float(np.linalg.norm(place))
        for n in range(len(nodes) - 1, -1, -1):
            node = nodes[n]
            if node.joint == joint and node.place is not None and np.dot(node.place, place) > 0.999 * length * np.linalg.norm(node.place):
                return n
        return self._joint_node(nodes, joint)

    @staticmethod
    def _joint_node(nodes: list[TreeNode] | tuple[TreeNode, ...], joint: int) -> int:
        return next(n for n, node in enumerate(nodes) if node.joint == joint and node.place is None)

    def _end(self, leaf: TreeNode) -> Three:
        """How far the body's shapes extend beyond a leaf, along its bone; from a joint, toward the farthest of them."""
        start = np.zeros(3) if leaf.place is None else np.array(leaf.place)
        shapes = self.body.shapes
        joints = np.broadcast_to(shapes.joints, (*shapes.joints.shape[:1], 4)) if isinstance(shapes, Quads) else shapes.joints
        centres = shapes.corners if isinstance(shapes, Quads) else shapes.centres
        radii = np.zeros_like(centres) if isinstance(shapes, Quads) else shapes.radii
        own = joints == leaf.joint
        if not own.any():
            return (0.0, 0.0, -MIN_END)
        centres, radii = centres[own], radii[own]
        toward = start if leaf.place is not None else centres[np.linalg.norm(centres, axis=1).argmax()]
        along = toward / max(float(np.linalg.norm(toward)), SAME_PLACE)
        reach = (centres @ along + np.sqrt(((radii * along) ** 2).sum(1))).max() - start @ along
        x, y, z = (max(float(reach), MIN_END) * along).tolist()
        return (x, y, z)


def motion_animation(body: Body, motion: Motion) -> tuple[Animation, float]:
    """A run's motion as an animated skeleton, and the largest distance (m) of its joints from the run's. Raises `ShadowPuppetError`
    without any pose."""
    root, off = base_in_world(body, motion)
    poses = np.where(motion.known[:, None], motion.poses, np.nan)
    return BodyTree(body).animation(motion.times, poses, root), off


def base_in_world(body: Body, motion: Motion) -> tuple[Array, float]:
    """The body's frame in a run's world, aligned to the joints, and the largest distance (m) left. One transform (4, 4) for all frames,
    as for fixed cameras; if that does not fit, for example after a live run has measured the person again, one for each frame (T, 4, 4).
    Raises `ShadowPuppetError` without any pose."""
    known = motion.known
    if not known.any():
        raise ShadowPuppetError("found no frame with a pose, expected one at least")
    names = [name for name in motion.joint_names if name in body.landmark_names]
    wanted = motion.joints[known][:, [motion.joint_names.index(name) for name in names]]
    ours = body.points(motion.poses[known], names=names)
    root = align(ours.reshape(-1, 3), wanted.reshape(-1, 3)).matrix
    off = _off(root, ours, wanted)
    if off > JOINT_TOLERANCE:
        some = align(ours, wanted).matrix
        off, root = _off(some, ours, wanted), np.tile(np.eye(4), (len(motion), 1, 1))
        root[known] = some
    return root, off


def _off(root: Array, points: Array, targets: Array) -> float:
    moved = points @ np.swapaxes(root[..., :3, :3], -1, -2) + root[..., None, :3, 3]
    return float(np.linalg.norm(moved - targets, axis=2).max())
