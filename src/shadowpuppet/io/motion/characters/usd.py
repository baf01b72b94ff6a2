"""Writes UsdSkel as text (.usda): a skinned puppet and its animation, for Omniverse, Houdini, Maya, Unreal, Blender."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.glb import quaternions
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.interpolation import rate_of
from shadowpuppet.motion.mesh import Mesh

TEMPLATE = """#usda 1.0
(
    defaultPrim = "Puppet"
    doc = "{doc}"
    metersPerUnit = 1
    upAxis = "Y"
    startTimeCode = 0
    endTimeCode = {last}
    timeCodesPerSecond = {rate}
    framesPerSecond = {rate}
)

def SkelRoot "Puppet" (
    prepend apiSchemas = ["SkelBindingAPI"]
)
{{{visibility}
    rel skel:skeleton = </Puppet/Skeleton>
    rel skel:animationSource = </Puppet/Motion>

    def Skeleton "Skeleton" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {{
        uniform token[] joints = [{joints}]
        uniform matrix4d[] bindTransforms = [{bind}]
        uniform matrix4d[] restTransforms = [{rest}]
        rel skel:animationSource = </Puppet/Motion>
    }}

    def Mesh "Body" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {{
        uniform token subdivisionScheme = "none"
        uniform bool doubleSided = {two_sided}
        int[] faceVertexCounts = [{counts}]
        int[] faceVertexIndices = [{corners}]
        point3f[] points = [{points}]
        normal3f[] normals = [{normals}] (
            interpolation = "vertex"
        )
        color3f[] primvars:displayColor = [{colours}] (
            interpolation = "vertex"
        )
        int[] primvars:skel:jointIndices = [{carriers}] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [{weights}] (
            elementSize = 1
            interpolation = "vertex"
        )
        matrix4d primvars:skel:geomBindTransform = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )
        rel skel:skeleton = </Puppet/Skeleton>
    }}

    def SkelAnimation "Motion"
    {{
        uniform token[] joints = [{joints}]
        half3[] scales = [{scales}]
        quatf[] rotations.timeSamples = {{
{rotations}
        }}
        float3[] translations.timeSamples = {{
{translations}
        }}
    }}
}}
"""


def write_usda(path: str | Path, animation: Animation, mesh: Mesh, smoothing: str = "") -> None:
    """Write a skinned mesh and its animation: metres, Y up, time codes from 0, `timeCodesPerSecond` of them a second.

    Unknown frames have no samples, and the puppet is invisible in them; a warning says so. `smoothing`: how the motion was smoothed.
    Raises `ShadowPuppetError` if no frame is known or the file cannot be written.
    """
    path, known = Path(path), np.flatnonzero(animation.known)
    if not len(known):
        raise ShadowPuppetError(f"{path}: found no frame in which the whole skeleton is known, expected one at least")
    if gaps := len(animation.times) - len(known):
        warn(f"{path}: {gaps} of {len(animation.times)} frames are not known: the puppet is invisible in them")
    rate = rate_of(animation.times) if len(animation.times) > 1 else 1
    codes = (animation.times - animation.times[0]) * rate
    R, t = animation.rotations.copy(), animation.shifts.copy()
    R[:, 0], t[:, 0] = Y_UP @ R[:, 0], t[:, 0] @ Y_UP.T
    turns = np.stack([np.roll(quaternions(R[known, j]), 1, axis=1) for j in range(len(animation.names))], 1)  # w first
    joints, count = ", ".join(f'"{joint}"' for joint in joint_paths(animation)), len(mesh.points)
    text = TEMPLATE.format(
        doc=f"shadowpuppet; smoothing: {smoothing}" if smoothing else "shadowpuppet", last=f"{codes[-1]:g}", rate=f"{rate:g}",
        visibility=_visibility(animation.known, codes), joints=joints, bind=_matrices(animation.rest), rest=_matrices(animation.offsets),
        two_sided=int(mesh.two_sided), counts=_numbers(np.full(len(mesh.triangles), 3)), corners=_numbers(mesh.triangles.ravel()),
        points=_tuples(mesh.points), normals=_tuples(mesh.normals), colours=_tuples(mesh.colours), carriers=_numbers(mesh.joints),
        weights=_numbers(np.ones(count, int)), scales=_tuples(np.ones((len(animation.names), 3), int)),
        rotations=_samples(codes[known], turns), translations=_samples(codes[known], t[known]),
    )  # fmt: skip
    write_whole(path, text)


def joint_paths(animation: Animation) -> list[str]:
    """The joints as paths from the root, with the characters that USD allows in names."""
    paths = list[str]()
    for name, parent in zip(animation.names, animation.parents):
        own = re.sub(r"\W", "_", name, flags=re.ASCII)
        own = own if re.match(r"[A-Za-z_]", own) else f"_{own}"
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _visibility(known: NDArray[np.bool_], codes: Array) -> str:
    """Samples of the puppet's visibility; empty if every frame is known."""
    if known.all():
        return ""
    changes = np.flatnonzero(np.diff(known.astype(int), prepend=-1))
    samples = ", ".join(f'{codes[n]:g}: "{"inherited" if known[n] else "invisible"}"' for n in changes)
    return f"\n    token visibility.timeSamples = {{ {samples} }}"


def _samples(codes: Array, values: Array) -> str:
    """A line for each time code, of values (T, J, K)."""
    return "\n".join(f"            {code:.10g}: [{_tuples(each)}]," for code, each in zip(codes.tolist(), values))


def _matrices(places: Array) -> str:
    """Transforms (row vectors) that only move, by (J, 3)."""
    return ", ".join(f"( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), ({x:.6g}, {y:.6g}, {z:.6g}, 1) )" for x, y, z in places.tolist())


def _tuples(values: NDArray) -> str:
    return ", ".join(f"({_numbers(row)})" for row in values)


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.7g}" for value in np.asarray(values).tolist())
