"""Nodes of a scene in viser: figures as skinned meshes, cameras as frustums."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array, inverse
from shadowpuppet.viewer.scene.colours import mesh_colours
from shadowpuppet.viewer.scene.scene import Figure, SceneCamera
from shadowpuppet.viewer.web.frustum_images import Undistorter

if TYPE_CHECKING:
    import viser

NOWHERE = np.array([0.0, 0.0, -1e4])
"""Position of unknown bones: out of sight."""
BLUE = (0, 114, 178)
"""Colour of cameras."""
PALE_OPACITY = 0.5
"""Opacity of limbs that are not vouched for."""


class FigureNodes:
    """Nodes of a figure: a skinned mesh for each limb and colour, and a pale one for each that is not vouched for in some frames. One of
    both is visible: the page builds a new mesh if its opacity changes."""

    def __init__(self, server: viser.ViserServer, figure: Figure, name: str) -> None:
        """Adds the nodes, under a name."""
        self.figure = figure
        self.frame = server.scene.add_frame(name, show_axes=False, position=figure.shift)
        mesh = figure.mesh
        limbs = np.zeros(len(mesh.joints), np.int64) if figure.doubtful is None else figure.doubtful.limbs[mesh.joints]
        groups, which = np.unique(np.column_stack([limbs, mesh_colours(figure)]), axis=0, return_inverse=True)
        self.parts = []
        for k, (limb, *colour) in enumerate(groups.astype(int).tolist()):
            points = np.flatnonzero(which.ravel() == k)
            back = np.full(len(mesh.points), -1)
            back[points] = np.arange(len(points))
            faces = back[mesh.triangles]
            faces = faces[(faces >= 0).all(1)]
            if not len(faces):
                continue
            joints, carried = np.unique(mesh.joints[points], return_inverse=True)
            weights = np.zeros((len(points), len(joints)), np.float32)
            weights[np.arange(len(points)), carried.ravel()] = 1
            made = partial(
                server.scene.add_mesh_skinned, vertices=mesh.points[points].astype(np.float32), faces=faces.astype(np.uint32),
                skin_weights=weights, bone_wxyzs=np.tile([1.0, 0, 0, 0], (len(joints), 1)),
                bone_positions=figure.rest[joints].astype(np.float32), color=(colour[0], colour[1], colour[2]),
                side="double" if mesh.two_sided else "front", cast_shadow=False, receive_shadow=False)  # fmt: skip
            ever = figure.doubtful is not None and bool(figure.doubtful.frames[:, limb].any())
            pale = made(f"{name}/{k} pale", opacity=PALE_OPACITY, visible=False) if ever else None
            self.parts.append(_Part(made(f"{name}/{k}"), pale, joints, limb))

    def to(self, time: float, visible: bool) -> None:
        """Show the figure at a time, seconds; hide it if not `visible` or unknown then."""
        n = self.figure.at(time) if visible else None
        self.frame.visible = n is not None
        if n is None:
            return
        places, turns = self.figure.places[n], self.figure.quaternions[n]
        for part in self.parts:
            for bone, j in zip(part.shown(self.figure, n).bones, part.joints.tolist()):
                known = bool(np.isfinite(places[j]).all())
                bone.position = places[j] if known else NOWHERE
                bone.wxyz = turns[j]


class _Part(NamedTuple):
    """Nodes of a part of a figure."""

    solid: Any
    pale: Any
    """None if the limb is always vouched for."""
    joints: NDArray[np.int64]
    """Joints of the figure that carry it, of shape (B,)."""
    limb: int

    def shown(self, figure: Figure, n: int) -> Any:
        """Make the node for a frame visible, and the other one not; returns it."""
        if self.pale is None or figure.doubtful is None:
            return self.solid
        doubtful = bool(figure.doubtful.frames[n, self.limb])
        self.solid.visible, self.pale.visible = not doubtful, doubtful
        return self.pale if doubtful else self.solid


class Frustum:
    """Node of a camera, with its image."""

    def __init__(self, server: viser.ViserServer, n: int, scene_camera: SceneCamera, undistort: Undistorter, scale: float) -> None:
        """`n`: number of the camera; `scale`: distance of the image, metres."""
        from scipy.spatial.transform import Rotation

        camera = scene_camera.camera
        T = inverse(camera.T_camera_world)
        turn = np.roll(Rotation.from_matrix(T[:3, :3]).as_quat(), 1)
        name = f"/cameras/{n} {node_name(camera.name)}"
        volume = float(np.cbrt(np.tan(undistort.fov / 2) ** 2 * undistort.aspect / 3))  # viser's scale is that of a volume
        self.handle = server.scene.add_camera_frustum(
            name, undistort.fov, undistort.aspect, scale=scale * volume, thickness=1.6, thickness_units="screen", color=BLUE,
            wxyz=turn, position=triple(T[:3, 3]), cast_shadow=False, receive_shadow=False)  # fmt: skip
        server.scene.add_label(f"{name}/name", camera.name, font_screen_scale=0.8, anchor="bottom-center")

    def put(self, image: NDArray[np.uint8] | None, visible: bool) -> None:
        """Show an image, RGB or RGBA; or none."""
        self.handle.visible = visible
        if visible and (image is not None or self.handle.image is not None):
            self.handle.image = image


def node_name(name: str) -> str:
    """A name as one part of a path in viser's scene tree."""
    return "".join(sign if sign.isalnum() or sign in " -_.," else "_" for sign in name)[:60]


def triple(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Three numbers as viser takes them."""
    x, y, z = (float(value) for value in values)
    return x, y, z
