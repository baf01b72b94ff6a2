"""Writes glTF 2.0 animations as a binary file (GLB): a skinned puppet for Blender, game engines and browsers."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.mesh import Mesh

TYPES = {"<f4": 5126, "u1": 5121, "<u2": 5123, "<u4": 5125}
"""The format's numbers of the types of values in buffers."""
POINTS, INDICES = 34962, 34963
"""Targets of buffers: vertices, and indices of triangles."""
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MIN_ROTATION = 1e-7
"""Difference of rotation matrices from the identity below which a joint is not animated."""


def write_glb(path: str | Path, animation: Animation, mesh: Mesh, smoothing: str = "", at_rest: bool = False) -> None:
    """Write a skinned mesh and its animation: metres, Y up, times from 0.

    Unknown frames have no keys: the puppet's scale is 0 there, which hides it, and `extras.unknown` of the animation lists them as pairs
    of seconds, from and to; a warning says so. `smoothing`: how the motion was smoothed, written to `asset.extras`. `at_rest`: nodes stand
    in the rest pose, feet on the floor, rather than in the first frame's. Raises `ShadowPuppetError` if no frame is known or the file
    cannot be written.
    """
    path, known = Path(path), np.flatnonzero(animation.known)
    if not len(known):
        raise ShadowPuppetError(f"{path}: found no frame in which the whole skeleton is known, expected one at least")
    gaps = len(animation.times) - len(known)
    if gaps:
        warn(f"{path}: {gaps} of {len(animation.times)} frames are not known: the puppet is hidden in them")
    buffer = _Buffer()
    primitive = _primitive(buffer, mesh)
    skin = buffer.add(_inverse_bind(animation), "MAT4")
    motion = _motion(buffer, animation, known)
    joints = _nodes(animation, None if at_rest else int(known[0]))
    content = {
        "asset": {"version": "2.0", "generator": "shadowpuppet", **({"extras": {"smoothing": smoothing}} if smoothing else {})},
        "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "puppet", "mesh": 0, "skin": 0}, *joints],
        "meshes": [{"name": "puppet", "primitives": [primitive]}],
        "skins": [{"inverseBindMatrices": skin, "skeleton": 1, "joints": list(range(1, 1 + len(joints)))}],
        "materials": [{"name": "puppet", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8},
                       "doubleSided": mesh.two_sided}],
        "animations": [motion],
        "accessors": buffer.accessors, "bufferViews": buffer.views, "buffers": [{"byteLength": len(buffer.data)}],
    }  # fmt: skip
    text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer.data), b"BIN\0") + bytes(buffer.data)
    write_whole(path, struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


class _Buffer:
    """A buffer of arrays, with a view and an accessor for each."""

    def __init__(self) -> None:
        self.data, self.views, self.accessors = bytearray(), list[dict[str, Any]](), list[dict[str, Any]]()

    def add(self, values: NDArray, kind: str, dtype: str = "<f4", bounds: bool = False, target: int | None = None) -> int:
        """Append values (N, width of `kind`) as one of `TYPES`; returns their accessor's index. `bounds`: store minimum and maximum."""
        flat = np.ascontiguousarray(values).astype(dtype).reshape(-1, WIDTHS[kind])
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.data), "byteLength": flat.nbytes}
        self.views.append(view | ({"target": target} if target else {}))
        accessor: dict[str, Any] = {"bufferView": len(self.views) - 1, "componentType": TYPES[dtype], "count": len(flat), "type": kind}
        if bounds:
            accessor |= {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        self.accessors.append(accessor)
        self.data += flat.tobytes() + b"\0" * (-flat.nbytes % 4)
        return len(self.accessors) - 1


def _primitive(buffer: _Buffer, mesh: Mesh) -> dict[str, Any]:
    """The mesh; each point belongs to one joint."""
    joints = np.stack([mesh.joints, *[np.zeros_like(mesh.joints)] * 3], 1)
    attributes = {
        "POSITION": buffer.add(mesh.points, "VEC3", bounds=True, target=POINTS),
        "NORMAL": buffer.add(mesh.normals, "VEC3", target=POINTS),
        "COLOR_0": buffer.add(mesh.colours, "VEC3", target=POINTS),
        "JOINTS_0": buffer.add(joints, "VEC4", "u1" if mesh.joints.max() < 256 else "<u2", target=POINTS),
        "WEIGHTS_0": buffer.add(np.tile([1.0, 0, 0, 0], (len(joints), 1)), "VEC4", target=POINTS),
    }
    triangles = buffer.add(mesh.triangles, "SCALAR", "<u4" if len(mesh.points) > 0xFFFF else "<u2", target=INDICES)
    return {"attributes": attributes, "indices": triangles, "material": 0}


def _inverse_bind(animation: Animation) -> Array:
    """From the mesh at rest to each joint's axes (J, 4, 4), in column-major order."""
    matrices = np.tile(np.eye(4), (len(animation.names), 1, 1))
    matrices[:, :3, 3] = -animation.rest
    return np.swapaxes(matrices, 1, 2)


def _nodes(animation: Animation, frame: int | None) -> list[dict[str, Any]]:
    """A node for each joint, posed as in `frame` for viewers without animation; None: at rest, the lowest joint on the floor."""
    if frame is None:
        shifts, turns = animation.offsets.copy(), np.tile([0.0, 0, 0, 1.0], (len(animation.names), 1))
        shifts[0, 1] = -animation.rest[:, 1].min()
    else:
        shifts = _shifts(animation)[frame]
        turns = np.concatenate([quaternions(_turns(animation, j)[[frame]]) for j in range(len(animation.names))])
    nodes = []
    for j, name in enumerate(animation.names):
        node: dict[str, Any] = {"name": name, "translation": shifts[j].tolist(), "rotation": turns[j].tolist()}
        children = [child + 1 for child, parent in enumerate(animation.parents) if parent == j]
        nodes.append(node | ({"children": children} if children else {}))
    return nodes


def _motion(buffer: _Buffer, animation: Animation, known: NDArray[np.int64]) -> dict[str, Any]:
    """Samplers and channels: rotations and positions of joints if they change, and scale 0 in unknown frames."""
    times = animation.times - animation.times[0]
    keys, shifts = buffer.add(times[known], "SCALAR", bounds=True), _shifts(animation)[known]
    samplers, channels = list[dict[str, Any]](), list[dict[str, Any]]()

    def animate(joint: int, path: str, values: Array, at: int = keys, how: str = "LINEAR") -> None:
        output = buffer.add(values, "VEC4" if path == "rotation" else "VEC3")
        samplers.append({"input": at, "output": output, "interpolation": how})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": joint + 1, "path": path}})

    for j in range(len(animation.names)):
        turns = _turns(animation, j)[known]
        if j == 0 or j in animation.moving:
            animate(j, "translation", shifts[:, j])
        if j == 0 or np.abs(turns - np.eye(3)).max() > MIN_ROTATION:
            animate(j, "rotation", quaternions(turns))
    gaps = _gaps(animation)
    if gaps:
        changes = np.flatnonzero(np.diff(animation.known.astype(int), prepend=-1))
        at = buffer.add(times[changes], "SCALAR", bounds=True)
        animate(0, "scale", np.repeat(animation.known[changes, None].astype(float), 3, 1), at, "STEP")
    found: dict[str, Any] = {"name": "motion", "samplers": samplers, "channels": channels}
    return found | ({"extras": {"unknown": gaps}} if gaps else {})


def _gaps(animation: Animation) -> list[list[float]]:
    """Intervals of unknown frames, seconds: from the first to the next known frame, or the last."""
    times, edges = animation.times - animation.times[0], np.diff((~animation.known).astype(int), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [[float(times[start]), float(times[min(end, len(times) - 1)])] for start, end in zip(starts, ends)]


def _turns(animation: Animation, joint: int) -> Array:
    """Rotations (T, 3, 3) of a joint in the file's world."""
    return animation.rotations[:, joint] if joint else Y_UP @ animation.rotations[:, 0]


def _shifts(animation: Animation) -> Array:
    shifts = animation.shifts.copy()
    shifts[:, 0] = shifts[:, 0] @ Y_UP.T
    return shifts


def quaternions(rotations: Array) -> Array:
    """Unit quaternions x, y, z, w (T, 4) of rotations (T, 3, 3), each with the sign nearest to the one before."""
    from scipy.spatial.transform import Rotation

    found = Rotation.from_matrix(rotations).as_quat()
    flips = np.cumprod(np.where((found[1:] * found[:-1]).sum(1) < 0, -1.0, 1.0))
    found[1:] *= flips[:, None]
    return found
