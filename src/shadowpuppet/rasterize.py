"""Drawing a body as a silhouette, and counting the pixels in which drawings differ from one, for many poses at once.

Masks are packed as bits `[word_column][row]`, 64 pixels of a row in a 64-bit word, so that the inner loops run over rows and are
vectorised. A pixel belongs to a polygon if its centre, at integer coordinates, does (half open: left and top edges count).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numba.core import config, types
from numba.extending import intrinsic
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body import Body, Quads
from shadowpuppet.camera import Camera
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, inverse, rigid, transform
from shadowpuppet.projection import DIRECTIONS, NEAR, Lens, make_lens, project_hulls, project_quads

Bits = NDArray[np.uint64]
SNAP = 1e-9
"""An edge this near (pixels) to a pixel's centre goes through it: rounding must not decide which of two neighbours gets the pixel."""


def pack(mask: ArrayLike) -> Bits:
    """Mask (H, W) to bits (ceil(W / 64), H)."""
    mask = np.asarray(mask, bool)
    height, width = mask.shape
    padded = np.zeros((height, -(-width // 64) * 64), bool)
    padded[:, :width] = mask
    words = np.packbits(padded, axis=1, bitorder="little").view("<u8")
    return np.ascontiguousarray(words.T, np.uint64)


def unpack(bits: Bits, width: int) -> NDArray[np.bool_]:
    """Bits (C, H) to the mask (H, W)."""
    rows = np.ascontiguousarray(bits.T).astype("<u8").view(np.uint8)
    return np.unpackbits(rows, axis=1, bitorder="little")[:, :width].astype(bool)


def count(bits: Bits) -> int:
    """Number of pixels set."""
    return int(np.bitwise_count(bits).sum())


@dataclass(frozen=True, eq=False)
class Picture:
    """How a camera sees a body: the body, the camera, and the body's frame in the camera's."""

    body: Body
    camera: Camera
    T_camera_base: Array
    """The body's frame in the camera's, of shape (4, 4), metres."""

    @cached_property
    def _lens(self) -> Lens:
        return make_lens(self.camera)

    def transforms(self, poses: Array) -> Array:
        """Joint transforms (N, J, 3, 4) into the camera's frame, of poses (N, D)."""
        return self.body.skeleton.forward(poses, self.T_camera_base)

    def polygons(self, transforms: Array, which: NDArray[np.int64],
                 arrays: tuple[Array, ...] | None = None) -> tuple[Array, NDArray[np.int64]]:
        """Pictures of some shapes: corners (N, S, K, 2) in pixels and their number (N, S), 0 where all is behind the camera.

        `arrays` are those of `Body.shapes`, each with a leading axis N, for poses of bodies of different sizes.
        """
        shapes = self.body.shapes
        arrays = tuple(array[None] for array in shapes.arrays) if arrays is None else arrays
        corners = np.empty((len(transforms), len(which), 5 if isinstance(shapes, Quads) else len(DIRECTIONS), 2))
        counts = np.empty((len(transforms), len(which)), np.int64)
        if isinstance(shapes, Quads):
            (quads,), joints = arrays, shapes.joints[:, 0].copy()
            project_quads(transforms, quads, joints, which, self._lens, corners, counts)
        else:
            centres, radii = arrays
            project_hulls(transforms, centres, radii, shapes.joints, which, self._lens, DIRECTIONS, corners, counts)
        return corners, counts

    def points(self, poses: Array, names: Iterable[str] | None = None) -> Array:
        """Landmarks (N, L, 3), metres, in the camera's frame, of poses (N, D); all, or those named."""
        return self.body.points(poses, self.T_camera_base, names)

    def points_world(self, poses: ArrayLike) -> Array:
        """Landmarks (N, L, 3), metres, in the world, of poses (N, D), in the order of the body's `landmark_names`."""
        return self.body.points(poses, inverse(self.camera.T_camera_world) @ self.T_camera_base)

    def empty(self) -> Bits:
        """An empty mask's bits."""
        width, height = self.camera.size
        return np.zeros((-(-width // 64), height), np.uint64)

    def draw(self, pose: ArrayLike, which: NDArray[np.int64] | None = None) -> Bits:
        """The silhouette of one pose (D,) as bits; of all shapes, or of some."""
        poses = np.ascontiguousarray(np.asarray(pose, float)[None])
        which = np.arange(len(self.body.parts)) if which is None else which
        bits = self.empty()
        corners, counts = self.polygons(self.transforms(poses), which)
        _draw(corners[0], counts[0], self.camera.size[0], bits)
        return bits

    def legs(self, pose: ArrayLike, spread: float = np.radians(25)) -> NDArray[np.bool_]:
        """Mask (H, W) of where the legs of a pose (D,) may be: under the waist's lower edge, wider by `spread` (rad) to each side.

        The model ends at the waist; what is seen below says nothing about it.
        """
        width, height = self.camera.size
        T = self.transforms(np.asarray(pose, float)[None])[0, self.body.skeleton.joint_index("pelvis")]
        low = self.body.hem @ T[:, :3].T + T[:, 3]
        if low[:, 2].min() < NEAR:
            return np.zeros((height, width), bool)
        pixels = self.camera.project(transform(inverse(self.camera.T_camera_world), low))
        left, right, top = pixels[:, 0].min(), pixels[:, 0].max(), np.median(pixels[:, 1])
        deep = max(height - top, 1.0)
        wide = deep * np.tan(spread)
        return draw_polygon([[left, top], [right, top], [right + wide, top + deep], [left - wide, top + deep]], (width, height))

    def mask(self, pose: ArrayLike) -> NDArray[np.bool_]:
        """The silhouette of one pose (D,), of shape (H, W): h(x, y, d) of Liu 2011, eq. 2."""
        return unpack(self.draw(pose), self.camera.size[0])

    def added(self, transforms: Array, which: NDArray[np.int64], silhouette: Bits, fixed: Bits,
              arrays: tuple[Array, ...] | None = None) -> NDArray[np.int64]:
        """What drawing some shapes adds to the mask `fixed`: pixels, and how many of them lie in the silhouette; (N, 2)."""
        shape = self.empty().shape
        if silhouette.shape != shape or fixed.shape != shape:  # the kernel would write past their ends
            raise ShadowPuppetError(f"masks of {silhouette.shape} and {fixed.shape} words x rows, expected the camera's {shape}")
        corners, counts = self.polygons(transforms, which, arrays)
        out = np.empty((len(transforms), 2), np.int64)
        _added(corners, counts, self.camera.size[0], silhouette, fixed, out)
        return out


def place(camera: Camera, distance: float, elevation: float) -> Array:
    """T_camera_base (4, 4): the frame of Liu 2011's model, X toward the camera, Y to the image's right, Z up.

    Its origin, the middle of the torso's lower edge at torso_y = 0, is `distance` metres from the camera along -X and `elevation`
    metres above it. Z is the world's up where the camera knows it, else the camera's own, as in the paper.
    """
    up = camera.T_camera_world[:3, 2] if camera.oriented else np.array([0.0, -1.0, 0.0])
    if abs(up[2]) > 0.9:  # it looks straight down or up: its own frame
        up = np.array([0.0, -1.0, 0.0])
    x = np.array([0.0, 0.0, -1.0]) + up * up[2]
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(up, x), up], axis=1)
    return rigid(R, R @ np.array([-distance, 0.0, elevation]))


def draw_polygon(corners: ArrayLike, size: tuple[int, int]) -> NDArray[np.bool_]:
    """One convex polygon of corners (K, 2), pixels, drawn into an empty mask (H, W)."""
    corners = np.ascontiguousarray(corners, float)
    bits = np.zeros((-(-size[0] // 64), size[1]), np.uint64)
    _draw(corners[None], np.array([len(corners)]), size[0], bits)
    return unpack(bits, size[0])


@intrinsic
def _ctpop(typingctx, word):  # pragma: no cover
    """Number of bits set in a 64-bit word: LLVM's ctpop, which vectorises."""

    def codegen(context, builder, signature, args):
        return builder.ctpop(args[0])

    return types.uint64(types.uint64), codegen


_popcount: Any = np.bitwise_count if config.DISABLE_JIT else _ctpop  # pyright: ignore[reportAttributeAccessIssue]


@numba.njit(cache=True)
def _spans(P, m, width, height, left, right):  # pragma: no cover
    """First pixel and end of a convex polygon's span on every row it covers; returns its box (row, row end, word, word end).

    The span of a row is where it lies inside the half planes of all edges, so the edges' lines may be followed past their ends.
    """
    if m < 3:
        return 0, 0, 0, 0
    top, bottom, west, east, area = P[0, 1], P[0, 1], P[0, 0], P[0, 0], 0.0
    for v in range(m):
        w = v + 1 if v + 1 < m else 0
        area += P[v, 0] * P[w, 1] - P[w, 0] * P[v, 1]
        top, bottom = min(top, P[v, 1]), max(bottom, P[v, 1])
        west, east = min(west, P[v, 0]), max(east, P[v, 0])
    if not 1e-9 <= abs(area) < 1e30 or bottom < 0 or top >= height or east < 0 or west >= width:  # edge-on, no numbers, or outside
        return 0, 0, 0, 0
    r0, r1 = int(np.ceil(max(top, 0.0))), int(np.ceil(min(bottom, float(height))))
    rows = max(r1 - r0, 0)
    for r in range(rows):
        left[r], right[r] = 0.0, width
    for v in range(m):
        w = v + 1 if v + 1 < m else 0
        dy = P[w, 1] - P[v, 1]
        if dy == 0:
            continue
        slope = (P[w, 0] - P[v, 0]) / dy
        x = P[v, 0] + (r0 - P[v, 1]) * slope - SNAP
        if (dy > 0) != (area > 0):
            for r in range(rows):
                left[r] = max(left[r], x + r * slope)
        else:
            for r in range(rows):
                right[r] = min(right[r], x + r * slope)
    c0, c1 = int(max(west, 0.0)) >> 6, (int(min(np.ceil(east), float(width))) + 63) >> 6
    return r0, r1, c0, c1


@numba.njit(cache=True)
def _fill(left, right, r0, r1, c0, c1, bits):  # pragma: no cover
    """Set the bits of the spans, word column by word column, without a branch."""
    one, full = np.uint64(1), np.uint64(0xFFFFFFFFFFFFFFFF)
    for c in range(c0, c1):
        column = bits[c, r0:r1]
        for r in range(column.size):
            a = min(max(np.int64(np.ceil(left[r])) - 64 * c, 0), 64)
            b = min(max(np.int64(np.ceil(right[r])) - 64 * c, 0), 64)
            before = (one << np.uint64(a & 63)) - one if a < 64 else full
            until = (one << np.uint64(b & 63)) - one if b < 64 else full
            column[r] |= until & ~before


@numba.njit(cache=True)
def _draw(corners, counts, width, bits):  # pragma: no cover
    """Draw polygons (Q, 5, 2) into bits."""
    height = bits.shape[1]
    left, right = np.empty(height), np.empty(height)
    for i in range(counts.size):
        r0, r1, c0, c1 = _spans(corners[i], counts[i], width, height, left, right)
        _fill(left, right, r0, r1, c0, c1, bits)


@numba.njit(cache=True)
def _added(corners, counts, width, silhouette, fixed, out):  # pragma: no cover
    """For each pose, the pixels that its polygons add to `fixed`, and how many of these lie in the silhouette."""
    height = silhouette.shape[1]
    left, right = np.empty(height), np.empty(height)
    scratch = np.zeros_like(silhouette)
    for n in range(corners.shape[0]):
        R0, R1, C0, C1 = height, 0, silhouette.shape[0], 0
        for i in range(counts.shape[1]):
            r0, r1, c0, c1 = _spans(corners[n, i], counts[n, i], width, height, left, right)
            if r1 > r0:
                R0, R1, C0, C1 = min(R0, r0), max(R1, r1), min(C0, c0), max(C1, c1)
                _fill(left, right, r0, r1, c0, c1, scratch)
        total, inside = np.uint64(0), np.uint64(0)
        for c in range(C0, C1):
            drawn, kept, seen = scratch[c, R0:R1], fixed[c, R0:R1], silhouette[c, R0:R1]
            for r in range(drawn.size):
                v = drawn[r] & ~kept[r]
                total += _popcount(v)
                inside += _popcount(v & seen[r])
            drawn[:] = 0
        out[n, 0], out[n, 1] = total, inside
