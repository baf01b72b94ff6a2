"""Silhouettes of a body as a camera sees it, and their difference from a mask (eq. 2), for many poses at once.

Masks are packed as bits. A pixel belongs to a polygon if its centre, at integer coordinates, does (half open: left and top edges count).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.forward_kinematics import load_joints, place_joints
from shadowpuppet.body.shapes import Body, Quads
from shadowpuppet.camera.bits import Bits, unpack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.projection import DIRECTIONS, NEAR_PLANE, Lens, make_lens, project_hulls, project_quads
from shadowpuppet.camera.scanline import count_and_clear, draw_outline, find_edges, make_page
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, inverse, rigid, transform
from shadowpuppet.jit import BLOCK, device, kernel

Shapes = tuple[Array, Array, Array, NDArray[np.int64], NDArray[np.int64]]
"""Quads (1 or N, S, 4, 3); ellipsoids' centres and radii (1 or N, S, E, 3) and numbers (S,); joints (S, E)."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A camera's view of a body."""

    body: Body
    camera: Camera
    T_camera_base: Array
    """The body's frame in the camera's, of shape (4, 4), metres."""
    floor: float | None = None
    """Height of the floor in the body's frame, metres; None if it is not known."""

    @cached_property
    def _lens(self) -> Lens:
        return make_lens(self.camera)

    def transforms(self, poses: Array) -> Array:
        """Joint transforms (N, J, 3, 4) into the camera's frame, of poses (N, D)."""
        return self.body.skeleton.forward(poses, self.T_camera_base)

    def polygons(self, transforms: Array, which: NDArray[np.int64],
                 arrays: tuple[Array, ...] | None = None) -> tuple[Array, NDArray[np.int64]]:
        """Outlines of some shapes: corners (N, S, K, 2), pixels, and their number (N, S), 0 if all is behind the camera. `arrays`: those
        of `Body.shapes` with a leading axis N, for bodies of different sizes."""
        block = self._block(len(which), min(BLOCK, max(len(transforms), 1)))
        corners = np.empty((len(transforms), len(which), block[1].shape[1], 2))
        counts = np.empty((len(transforms), len(which)), np.int64)
        _polygons(np.ascontiguousarray(transforms), self._shapes(arrays), which, self._lens, block, corners, counts)
        return corners, counts

    @cached_property
    def _frame(self) -> tuple:
        """The skeleton as kernels use it, and its root's transform."""
        return self.body.skeleton.tree, self.body.skeleton.offsets, np.ascontiguousarray(self.T_camera_base[:3], float)

    def _block(self, shapes: int, size: int) -> tuple:
        """Buffers for `size` poses: joints T (J, 3, 4, B), corners X, Y (S, K, B) and their numbers (S, B), boxes (S, 6, B), lines (S,
        K, 3, B), intermediate values (R, B)."""
        joints, ellipsoids = len(self.body.skeleton.joints), self.body.shapes.joints.shape[1]
        corners = 5 if isinstance(self.body.shapes, Quads) else len(DIRECTIONS)
        X, Y = np.zeros((2, shapes, corners, size))
        return (np.zeros((joints, 3, 4, size)), X, Y, np.zeros((shapes, size), np.int64), np.zeros((shapes, 6, size)),
                np.zeros((shapes, corners, 3, size)), np.zeros((max(12, 5 * ellipsoids + 4), size)))

    def _shapes(self, arrays: tuple[Array, ...] | None = None) -> Shapes:
        """The body's shapes as kernels use them; one of the two kinds is empty."""
        shapes = self.body.shapes
        if arrays is None:
            return self._own_shapes
        none = np.zeros((1, 0, 0, 3))
        if isinstance(shapes, Quads):
            return (*arrays, none, none, np.zeros(0, np.int64), shapes.joints)  # pyright: ignore[reportReturnType]
        return none, *arrays, shapes.numbers, shapes.joints  # pyright: ignore[reportReturnType]

    @cached_property
    def _own_shapes(self) -> Shapes:
        return self._shapes(tuple(array[None] for array in self.body.shapes.arrays))

    def points(self, poses: Array, names: Iterable[str] | None = None) -> Array:
        """Landmarks (N, L, 3), metres, in the camera's frame, of poses (N, D); all, or those in `names`."""
        return self.body.points(poses, self.T_camera_base, names)

    def points_world(self, poses: ArrayLike, names: Iterable[str] | None = None) -> Array:
        """Landmarks (N, L, 3), metres, in the world, of poses (N, D); all, in the order of `Body.landmark_names`, or those in `names`."""
        return self.body.points(poses, inverse(self.camera.T_camera_world) @ self.T_camera_base, names)

    @cached_property
    def every(self) -> NDArray[np.int64]:
        """Indices (S,) of all shapes."""
        return np.arange(len(self.body.parts))

    def empty(self) -> Bits:
        """Bits (ceil(W / 64), H) of an empty mask."""
        width, height = self.camera.size
        return np.zeros((-(-width // 64), height), np.uint64)

    def draw(self, pose: ArrayLike, which: NDArray[np.int64] | None = None) -> Bits:
        """The silhouette of one pose (D,) as bits; of all shapes, or those in `which`."""
        which = self.every if which is None else which
        bits = self.empty()
        self._compare(np.asarray(pose, float)[None], which, bits, bits, drawn=bits[None])
        return bits

    def legs(self, pose: ArrayLike, spread: float = np.radians(25)) -> NDArray[np.bool_]:
        """Mask (H, W) of `leg_bits`."""
        return unpack(self.leg_bits(pose, spread), self.camera.size[0])

    def leg_bits(self, pose: ArrayLike, spread: float = np.radians(25)) -> Bits:
        """Bits of the region where the legs of a pose (D,) may be: below the waist's lower edge, widening by `spread` (rad) to each
        side. An upper body ends at the waist, so pixels below say nothing about it. For a body with legs the region is empty."""
        width, height = self.camera.size
        if self.body.hem is None:
            return self.empty()
        T = self.transforms(np.asarray(pose, float)[None])[0, self.body.skeleton.joint_index("pelvis")]
        low = self.body.hem @ T[:, :3].T + T[:, 3]
        if low[:, 2].min() < NEAR_PLANE:
            return self.empty()
        pixels = self.camera.project(transform(inverse(self.camera.T_camera_world), low))
        left, right, top = pixels[:, 0].min(), pixels[:, 0].max(), np.median(pixels[:, 1])
        deep = max(height - top, 1.0)
        wide = deep * np.tan(spread)
        return polygon_bits([[left, top], [right, top], [right + wide, top + deep], [left - wide, top + deep]], (width, height))

    def mask(self, pose: ArrayLike) -> NDArray[np.bool_]:
        """The silhouette of one pose (D,), of shape (H, W): h(x, y, d) of Liu 2011, eq. 2."""
        return unpack(self.draw(pose), self.camera.size[0])

    def added(self, poses: Array, which: NDArray[np.int64], silhouette: Bits, fixed: Bits, joints: NDArray[np.int64] | None = None,
              measures: tuple[Array, ...] | None = None) -> NDArray[np.int64]:
        """Change of eq. 2, pixels (N,), by drawing some shapes of poses (N, D) over the mask `fixed`: new pixels outside the silhouette
        less those inside. `joints`: those that move, if not all; the others stay as in the first pose. `measures`: for bodies of
        different sizes, the joints' offsets (N, J, 3) and the arrays of `Body.shapes` with a leading axis N."""
        shape = self.empty().shape
        if silhouette.shape != shape or fixed.shape != shape:  # the kernel would write past their ends
            raise ShadowPuppetError(f"masks of {silhouette.shape} and {fixed.shape} words x rows, expected the camera's {shape}")
        return self._compare(poses, which, silhouette, fixed, joints, measures)

    def _compare(self, poses: Array, which: NDArray[np.int64], silhouette: Bits, fixed: Bits, joints: NDArray[np.int64] | None = None,
                 measures: tuple[Array, ...] | None = None, drawn: Bits | None = None) -> NDArray[np.int64]:
        tree, offsets, root = self._frame
        frame, shapes = (tree, offsets if measures is None else measures[0], root), self._shapes(measures and measures[1:])
        joints = tree[7] if joints is None else joints
        key = len(which), min(BLOCK, max(len(poses), 1))
        poses, out = self.body.skeleton.checked(poses), np.empty(len(poses), np.int64)
        block, page, room = buffers = self._take_buffers(*key)
        _compare(poses, joints, frame, shapes, which, self._lens, self.camera.size[0],
                 (silhouette, fixed, *room), block, page, out, np.empty((0, 0, 0), np.uint64) if drawn is None else drawn)
        self._free_buffers[key].append(buffers)
        return out

    def _take_buffers(self, shapes: int, size: int) -> tuple:
        """Buffers for a comparison, which no other thread uses meanwhile; a kernel leaves nothing in them that counts."""
        try:
            return self._free_buffers[shapes, size].pop()
        except IndexError:  # all in use, or none made so far
            block = self._block(shapes, size)
            words, height = self.empty().shape
            page = make_page(words, height, block[1].shape[1])
            return block, page, (np.zeros_like(page[0]), np.zeros_like(page[0]))

    @cached_property
    def _free_buffers(self) -> defaultdict[tuple[int, int], list[tuple]]:
        return defaultdict(list)


def place(camera: Camera, distance: float, elevation: float, up: Array | None = None) -> Array:
    """T_camera_base (4, 4): the frame of Liu 2011's model, X toward the camera, Y to the image's right, Z up. Its origin, the middle of
    the torso's lower edge at torso_y = 0, is `distance` metres from the camera along -X and `elevation` metres above it. Z is `up` (3,)
    in the camera's frame, by default the world's if the camera is oriented, else the camera's own, as in the paper."""
    if up is None:
        up = camera.T_camera_world[:3, 2] if camera.oriented else np.array([0.0, -1.0, 0.0])
    if abs(up[2]) > 0.9:  # the camera looks straight down or up: its own frame
        up = np.array([0.0, -1.0, 0.0])
    x = np.array([0.0, 0.0, -1.0]) + up * up[2]
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(up, x), up], axis=1)
    return rigid(R, R @ np.array([-distance, 0.0, elevation]))


def polygon_bits(corners: ArrayLike, size: tuple[int, int]) -> Bits:
    """A convex polygon of corners (K, 2), pixels, as bits of a mask."""
    corners = np.asarray(corners, float).reshape(-1, 2)
    count, page = len(corners), make_page(-(-size[0] // 64), size[1], len(corners))
    X, Y = (np.ascontiguousarray(corners[None, :, i, None]) for i in range(2))
    if count:
        _draw_corners(X, Y, np.full((1, 1), count), size[0], size[1], np.empty((1, 6, 1)), np.empty((1, count, 3, 1)), page)
    return np.ascontiguousarray(page[0][:, : size[1]])


# Kernels


@device
def _project(begin, shapes, which, lens, block):  # pragma: no cover
    """Corners of a block's shapes from its joints."""
    quads, centres, radii, numbers, joints = shapes
    T, X, Y, counts, work = block[0], block[1], block[2], block[3], block[6]
    if quads.shape[1]:
        project_quads(T, begin, quads, joints, which, lens, X, Y, counts, work)
    else:
        project_hulls(T, begin, centres, radii, numbers, joints, which, lens, X, Y, counts, work)


@kernel
def _compare(poses, joints, frame, shapes, which, lens, width, masks, block, page, added, drawn):  # pragma: no cover
    """For each pose the pixels (N,) that its shapes add to the mask `fixed` outside the silhouette, less those inside. Joints that do
    not move stay as in the first pose. `masks`: silhouette and fixed, (C, H) each, and work arrays for outside and inside, (C, rows).
    `drawn` (N or 0, C, H) receives the drawn masks."""
    tree, offsets, root = frame
    silhouette, fixed, outside, inside = masks
    words, height = silhouette.shape
    for c in range(words):
        for r in range(height):
            outside[c, r], inside[c, r] = ~fixed[c, r] & ~silhouette[c, r], ~fixed[c, r] & silhouette[c, r]
    T, X, Y, counts, boxes, lines, work = block
    if joints.size < T.shape[0]:
        place_joints(poses[:1], np.int64(0), tree[7], tree, offsets, root, T, work)
    for begin in range(0, poses.shape[0], T.shape[3]):
        place_joints(poses, begin, joints, tree, offsets, root, T, work)
        _project(begin, shapes, which, lens, block)
        find_edges(X, Y, counts, float(width), float(height), boxes, lines)
        for n in range(min(T.shape[3], poses.shape[0] - begin)):
            for s in range(which.size):
                draw_outline(s, n, boxes, lines, float(width), page)
            if drawn.shape[0]:
                for c in range(words):
                    for r in range(height):
                        drawn[begin + n, c, r] = page[0][c, r]
            added[begin + n] = count_and_clear(outside, inside, page)


@kernel
def _draw_corners(X, Y, counts, width, height, boxes, lines, page):  # pragma: no cover
    """Draw polygons of corners X, Y (S, K, 1) on a page."""
    find_edges(X, Y, counts, float(width), float(height), boxes, lines)
    for s in range(X.shape[0]):
        draw_outline(s, np.int64(0), boxes, lines, float(width), page)


@kernel
def _polygons(transforms, shapes, which, lens, block, corners, counts):  # pragma: no cover
    """Corners (N, S, K, 2) and their numbers (N, S) of some shapes, of joints (N, J, 3, 4)."""
    T, X, Y, numbers = block[0], block[1], block[2], block[3]
    for begin in range(0, transforms.shape[0], T.shape[3]):
        load_joints(transforms, begin, T)
        _project(begin, shapes, which, lens, block)
        for n in range(min(T.shape[3], transforms.shape[0] - begin)):
            for s in range(which.size):
                counts[begin + n, s] = numbers[s, n]
                for v in range(X.shape[1]):
                    corners[begin + n, s, v, 0], corners[begin + n, s, v, 1] = X[s, v, n], Y[s, v, n]
