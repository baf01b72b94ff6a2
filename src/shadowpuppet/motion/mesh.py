"""Triangle meshes of bodies and skeletons, carried by their joints, for programs that show skinned models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body, Hulls, Limbs, Quads
from shadowpuppet.camera.drawing import MIDDLE_COLOUR as DRAWN_MIDDLE
from shadowpuppet.camera.drawing import SIDE_COLOURS, Colour
from shadowpuppet.geometry import Array
from shadowpuppet.motion.animation import Animation, rest_positions
from shadowpuppet.motion.body_animation import TO_REST, BodyTree

POINTS_AROUND, RINGS_ALONG, DOME_RINGS = 24, 6, 5
"""Number of points around a limb, of rings along it, and of rings of a dome."""
BALL_RINGS = 10
"""Number of rings of an ellipsoid."""


def linear(colour: Colour) -> tuple[float, float, float]:
    """Linear red, green, blue, 0..1, of a colour of the overlay: blue, green, red, 0..255 (sRGB)."""
    red, green, blue = (part / 255 / 12.92 if part < 11 else ((part / 255 + 0.055) / 1.055) ** 2.4 for part in colour[::-1])
    return red, green, blue


LEFT_COLOUR, RIGHT_COLOUR, MIDDLE_COLOUR = linear(SIDE_COLOURS["left"]), linear(SIDE_COLOURS["right"]), linear(DRAWN_MIDDLE)
"""The overlay's colours, which make a mirror image obvious."""
BONE_THICKNESS = 0.12
"""Radius of a bone of unknown shape, as a share of its length."""
MAX_BONE_RADIUS = 0.05
"""Upper bound of that radius, metres."""


class Mesh(NamedTuple):
    """A triangle mesh; each point moves with one joint."""

    points: Array
    """In the axes of skeletons at rest, the root at the origin, of shape (V, 3), metres."""
    normals: Array
    """Outward unit vectors, of shape (V, 3)."""
    triangles: NDArray[np.int64]
    """Indices of corners, counterclockwise from outside, of shape (F, 3)."""
    joints: NDArray[np.int64]
    """The animation's joint that carries each point, of shape (V,)."""
    colours: Array
    """Linear RGB, 0..1, of shape (V, 3)."""
    two_sided: bool = False
    """Whether it consists of sheets that are visible from both sides."""


class _Patch(NamedTuple):
    points: Array
    triangles: NDArray[np.int64]
    joints: NDArray[np.int64]
    colour: tuple[float, float, float]


def body_mesh(body: Body) -> Mesh:
    """The mesh of a body for `BodyTree.animation`: of its limbs if it has them, else of its hulls or cards."""
    tree = BodyTree(body)
    nodes = np.array([tree.node_of(j) for j in range(len(body.skeleton.joints))])
    at = rest_positions(tree.offsets, [node.parent for node in tree.nodes])[nodes]
    shapes = body.shapes
    if body.limbs is not None:
        patches = [_of_limb(body.limbs, n) for n in range(len(body.limbs.parts))]
    elif isinstance(shapes, Quads):
        patches = [_Patch(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.repeat(joint, 4), _colour(part))
                   for joint, corners, part in zip(shapes.joints, shapes.corners, body.parts)]  # fmt: skip
    else:
        patches = [_of_hull(shapes, n, body.parts[n], at) for n in range(len(body.parts))]
    moved = [patch._replace(points=patch.points @ TO_REST.T + at[patch.joints], joints=nodes[patch.joints]) for patch in patches]
    return _joined(moved, two_sided=isinstance(shapes, Quads))


def bone_mesh(animation: Animation) -> Mesh:
    """A tapered stick along every bone of a skeleton."""
    patches, rest = list[_Patch](), animation.rest
    bones = [(parent, animation.offsets[n]) for n, parent in enumerate(animation.parents) if parent >= 0]
    bones += [(n, np.array(end)) for n, end in animation.ends.items()]
    for joint, along in bones:
        length = float(np.linalg.norm(along))
        if length > 1e-6:
            wide = min(BONE_THICKNESS * length, MAX_BONE_RADIUS) * np.array([1.0, 0.4])
            points, triangles = _tube(np.stack([wide, wide], 1), length, np.zeros(2), wide)
            turned = points @ _toward(along / length).T + rest[joint]
            patches.append(_Patch(turned, triangles, np.full(len(points), joint), _colour(animation.names[joint])))
    if not patches:  # one joint alone
        points, triangles = _tube(np.full((2, 2), MAX_BONE_RADIUS), MAX_BONE_RADIUS, np.zeros(2), np.full(2, MAX_BONE_RADIUS))
        patches = [_Patch(points, triangles, np.zeros(len(points), np.int64), MIDDLE_COLOUR)]
    return _joined(patches)


def _colour(part: str) -> tuple[float, float, float]:
    small = part.lower()
    return LEFT_COLOUR if small.startswith(("left", "l_")) else RIGHT_COLOUR if small.startswith(("right", "r_")) else MIDDLE_COLOUR


def _joined(patches: Sequence[_Patch], two_sided: bool = False) -> Mesh:
    counts = [len(patch.points) for patch in patches]
    first = np.cumsum([0, *counts[:-1]])
    points = np.concatenate([patch.points for patch in patches])
    triangles = np.concatenate([patch.triangles + start for patch, start in zip(patches, first)])
    colours = np.repeat(np.array([patch.colour for patch in patches]), counts, axis=0)
    return Mesh(points, _normals(points, triangles), triangles, np.concatenate([patch.joints for patch in patches]), colours, two_sided)


def _normals(points: Array, triangles: NDArray[np.int64]) -> Array:
    """Normals (V, 3) from the triangles around each point, weighted by area."""
    a, b, c = (points[triangles[:, n]] for n in range(3))
    sums = np.zeros_like(points)
    for n in range(3):
        np.add.at(sums, triangles[:, n], np.cross(b - a, c - a))
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(lengths > 0, sums / np.where(lengths > 0, lengths, 1), [0.0, 1.0, 0.0])


def _of_limb(limbs: Limbs, n: int) -> _Patch:
    points, triangles = _tube(limbs.radii[n], limbs.lengths[n], limbs.shears[n], limbs.caps[n])
    placed = points @ limbs.rotations[n].T + limbs.starts[n]
    return _Patch(placed, triangles, np.full(len(points), limbs.joints[n]), _colour(limbs.parts[n]))


def _tube(radii: Array, length: float, shear: Array, caps: Array) -> tuple[Array, NDArray[np.int64]]:
    """A closed tapered elliptic cylinder along z from the origin, with domes of heights `caps`: points (V, 3) and triangles (F, 3).
    radii (2, 2): of the ellipses at start and end, along x and y; shear (2,): offset of the end along them."""
    falls = np.pi / 2 * np.arange(1, DOME_RINGS) / DOME_RINGS
    start = [(0.0, np.cos(fall), -caps[0] * np.sin(fall)) for fall in falls[::-1]]
    end = [(1.0, np.cos(fall), caps[1] * np.sin(fall)) for fall in falls]
    rings = [*start, *((share, 1.0, 0.0) for share in np.linspace(0, 1, RINGS_ALONG)), *end]
    turn = 2 * np.pi * np.arange(POINTS_AROUND) / POINTS_AROUND
    circle = np.stack([np.cos(turn), np.sin(turn)], 1)
    points = [np.concatenate([shear * share + wide * ((1 - share) * radii[0] + share * radii[1]) * circle,
                              np.full((POINTS_AROUND, 1), share * length + up)], 1) for share, wide, up in rings]  # fmt: skip
    poles = np.array([[0.0, 0.0, -caps[0]], [*shear, length + caps[1]]])
    return np.concatenate([*points, poles]), _closed(len(rings))


def _closed(rings: int) -> NDArray[np.int64]:
    """Triangles of rings of `POINTS_AROUND` points, one above the other, counterclockwise from above, and poles at both ends."""
    n, last = np.arange(POINTS_AROUND), rings * POINTS_AROUND
    after = (n + 1) % POINTS_AROUND
    sides = [np.stack([POINTS_AROUND * ring + step for step in corner], 1) for ring in range(rings - 1)
             for corner in ((n, after, POINTS_AROUND + after), (n, POINTS_AROUND + after, POINTS_AROUND + n))]  # fmt: skip
    beneath, top = np.stack([np.full(POINTS_AROUND, last), after, n], 1), (rings - 1) * POINTS_AROUND
    return np.concatenate([*sides, beneath, np.stack([np.full(POINTS_AROUND, last + 1), top + n, top + after], 1)])


def _of_hull(shapes: Hulls, n: int, part: str, at: Array) -> _Patch:
    """The convex hull at rest of a shape's ellipsoids; each point is carried by its ellipsoid's joint. `at`: the joints' positions (J,
    3)."""
    from scipy.spatial import ConvexHull

    count = int(shapes.numbers[n])
    ball = _ball()
    points = np.concatenate([shapes.centres[n, e] + shapes.radii[n, e] * ball for e in range(count)])
    joints = np.repeat(shapes.joints[n, :count], len(ball))
    placed = points @ TO_REST.T + at[joints]
    hull = ConvexHull(placed)
    outward = (np.cross(*np.diff(placed[hull.simplices], axis=1).swapaxes(0, 1)) * hull.equations[:, :3]).sum(1) > 0
    triangles = np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1])
    used, compact = np.unique(triangles, return_inverse=True)
    return _Patch(points[used], compact.reshape(-1, 3), joints[used], _colour(part))


def _ball() -> Array:
    """Points (V, 3) of a unit sphere."""
    up, turn = np.linspace(-np.pi / 2, np.pi / 2, BALL_RINGS + 1)[1:-1], 2 * np.pi * np.arange(POINTS_AROUND) / POINTS_AROUND
    heights = np.repeat(np.sin(up)[:, None], POINTS_AROUND, 1)
    rings = np.stack([np.outer(np.cos(up), np.cos(turn)), np.outer(np.cos(up), np.sin(turn)), heights], 2)
    return np.concatenate([rings.reshape(-1, 3), [[0, 0, -1.0], [0, 0, 1.0]]])


def _toward(along: Array) -> Array:
    """A rotation (3, 3) with its z axis along a unit vector (3,)."""
    x = np.cross(np.eye(3)[int(np.abs(along).argmin())], along)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(along, x), along], 1)
