"""Nodes of a scene in viser: figures as skinned meshes, cameras as frustums."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array, inverse
from shadowpuppet.viewer.scene.scene import Figure, SceneCamera
from shadowpuppet.viewer.web.frustum_images import PictureMode, Undistorter, frustum_image

if TYPE_CHECKING:
    import viser

NOWHERE = np.array([0.0, 0.0, -1e4])
"""Position of unknown bones: out of sight."""
COLOURS = {"truth": (64, 196, 122), "other": None, "mean": None, "estimate": None}
"""Colours by kind of figure; None: those of the mesh, left warm and right blue."""
BLENDED = {"estimate": ((40, 50, 70), 0.3), "other": ((150, 98, 196), 0.55), "mean": ((150, 156, 164), 0.35)}
"""Colours mixed into those of a kind, and their share: those of the mesh are too pale for a white page."""
TINT = 0.5
"""Share of a person's own tint."""
BY_CAMERA = np.array([(0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (213, 94, 0), (240, 228, 66)], np.uint8)
"""Colours of cameras (Okabe and Ito 2008) and of the hull points on their contours."""
TRANSPARENT_OPACITY = 0.75
"""Opacity of transparent figures."""
PALE_OPACITY = 0.5
"""Opacity of limbs that are not vouched for."""


class FigureNodes:
    """Nodes of a figure: a skinned mesh for each limb and colour, and a pale one for each that is not vouched for in some frames. One of
    both is visible: the page builds a new mesh if its opacity changes."""

    def __init__(self, server: viser.ViserServer, figure: Figure, name: str, transparent: bool) -> None:
        """`transparent`: set at the start, as the page rebuilds a mesh if this changes; in a file that would be visible at every loop."""
        self.figure = figure
        self.frame = server.scene.add_frame(name, show_axes=False, position=figure.shift)
        mesh, opacity = figure.mesh, TRANSPARENT_OPACITY if transparent and figure.kind != "truth" else None
        limbs = np.zeros(len(mesh.joints), np.int64) if figure.doubtful is None else figure.doubtful.limbs[mesh.joints]
        groups, which = np.unique(np.column_stack([limbs, mesh.colours]), axis=0, return_inverse=True)
        self.parts = []
        for k, (limb, *colour) in enumerate(groups):
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
                bone_positions=figure.rest[joints].astype(np.float32), color=colour_of(figure.kind, np.array(colour), figure.tint),
                side="double" if mesh.two_sided else "front", cast_shadow=False, receive_shadow=False)  # fmt: skip
            ever = figure.doubtful is not None and bool(figure.doubtful.frames[:, int(limb)].any())
            pale = made(f"{name}/{k} pale", opacity=PALE_OPACITY, visible=False) if ever else None
            self.parts.append(_Part(made(f"{name}/{k}", opacity=opacity), pale, joints, int(limb)))

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

    def set_opacity(self, opacity: float | None) -> None:
        """0 to 1; None: solid."""
        for part in self.parts:
            part.solid.opacity = opacity


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
        """`n`: number of the camera, which chooses its colour; `scale`: distance of the image, metres."""
        self.scene_camera, self.undistort, camera = scene_camera, undistort, scene_camera.camera
        from scipy.spatial.transform import Rotation

        T = inverse(camera.T_camera_world)
        turn = np.roll(Rotation.from_matrix(T[:3, :3]).as_quat(), 1)
        self.wxyz, self.centre = turn, T[:3, 3]
        name = f"/cameras/{n} {node_name(camera.name)}"
        colour = tuple(BY_CAMERA[n % len(BY_CAMERA)].tolist())
        self.volume = float(np.cbrt(np.tan(undistort.fov / 2) ** 2 * undistort.aspect / 3))  # viser's scale is that of a volume
        self.handle = server.scene.add_camera_frustum(
            name, undistort.fov, undistort.aspect, scale=scale * self.volume, thickness=1.6, thickness_units="screen", color=colour,
            wxyz=turn, position=triple(T[:3, 3]), cast_shadow=False, receive_shadow=False)  # fmt: skip
        server.scene.add_label(f"{name}/name", camera.name, font_screen_scale=0.8, anchor="bottom-center")

    def set_distance(self, distance: float) -> None:
        """Put the image at a distance from the camera, metres."""
        self.handle.scale = distance * self.volume

    def image(self, time: float, mode: PictureMode) -> NDArray[np.uint8] | None:
        """Make the image for a time, seconds; slow."""
        images = self.scene_camera.images
        return None if images is None else frustum_image(images, self.undistort, time, mode)

    def put(self, image: NDArray[np.uint8] | None, visible: bool) -> None:
        """Show an image, RGB or RGBA; or none."""
        self.handle.visible = visible
        if visible and (image is not None or self.handle.image is not None):
            self.handle.image = image


@lru_cache(maxsize=1)
def unit_sphere(count: int = 120) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """A unit sphere: points (V, 3) spread by the golden angle, and triangles (F, 3), counterclockwise from outside."""
    from scipy.spatial import ConvexHull

    n = np.arange(count) + 0.5
    z, turn = 1 - 2 * n / count, np.pi * (1 + 5**0.5) * n
    flat = np.sqrt(1 - z**2)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], 1)
    faces = ConvexHull(points).simplices
    outward = np.einsum("fx,fx->f", np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]),
                        points[faces].mean(1)) > 0  # fmt: skip
    return points.astype(np.float32), np.where(outward[:, None], faces, faces[:, ::-1]).astype(np.uint32)


def colour_of(kind: str, linear: Array, tint: tuple[int, int, int] | None = None) -> tuple[int, int, int]:
    """Colour 0..255 for a mesh colour (linear RGB) of a kind of figure, or of a person with a tint of their own."""
    fixed = COLOURS.get(kind)
    if fixed is not None:
        return fixed
    own = 255 * np.clip(linear, 0, 1) ** (1 / 2.2)
    mixed, share = (tint, TINT) if tint is not None else BLENDED.get(kind, ((0, 0, 0), 0.0))
    red, green, blue = ((1 - share) * own + share * np.array(mixed)).round().astype(int).tolist()
    return red, green, blue


def node_name(name: str) -> str:
    """A name as one part of a path in viser's scene tree."""
    return "".join(sign if sign.isalnum() or sign in " -_.," else "_" for sign in name)[:60]


def triple(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Three numbers as viser takes them."""
    x, y, z = (float(value) for value in values)
    return x, y, z
