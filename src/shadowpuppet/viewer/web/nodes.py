"""What a show is drawn of: figures as skinned meshes, cameras as frustums."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array, inverse
from shadowpuppet.viewer.scene.show import Eye, Figure
from shadowpuppet.viewer.web.pictures import Look, Plain, shown

if TYPE_CHECKING:
    import viser

NOWHERE = np.array([0.0, 0.0, -1e4])
"""Where bones are put that are not known: out of sight."""
PLAIN = {"truth": (64, 196, 122), "other": None, "mean": None, "estimate": None}
"""Colours by a figure's kind; those without have the mesh's, left warm and right blue."""
BLENDED = {"other": ((150, 98, 196), 0.55), "mean": ((150, 156, 164), 0.35)}
"""Colours that a kind's own are mixed with, and how much."""
BY_CAMERA = np.array([(0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (213, 94, 0), (240, 228, 66)], np.uint8)
"""Colours of cameras (Okabe and Ito 2008), and of the surface points on their contours."""
GLASS = 0.5
"""How opaque figures are that are seen through."""


class Puppet:
    """A figure's nodes: a skinned mesh a colour, so that left and right are told apart."""

    def __init__(self, server: viser.ViserServer, figure: Figure, name: str, glass: bool) -> None:
        """`glass`: from the start, for a mesh that is changed later is made anew by the page, which in a file shows at every loop."""
        self.figure = figure
        self.frame = server.scene.add_frame(name, show_axes=False, position=figure.shift)
        mesh, opacity = figure.mesh, GLASS if glass and figure.kind != "truth" else None
        colours, which = np.unique(mesh.colours, axis=0, return_inverse=True)
        self.parts = []
        for k in range(len(colours)):
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
            handle = server.scene.add_mesh_skinned(
                f"{name}/{k}", mesh.points[points].astype(np.float32), faces.astype(np.uint32), skin_weights=weights,
                bone_wxyzs=np.tile([1.0, 0, 0, 0], (len(joints), 1)), bone_positions=figure.rest[joints].astype(np.float32),
                color=colour_of(figure.kind, colours[k]), opacity=opacity,
                side="double" if mesh.two_sided else "front", cast_shadow=False, receive_shadow=False)  # fmt: skip
            self.parts.append((handle, joints))

    def to(self, time: float, wished: bool) -> None:
        """Set it to a time, seconds; it is not seen where it is not wished for, or not known."""
        n = self.figure.at(time) if wished else None
        self.frame.visible = n is not None
        if n is None:
            return
        places, turns = self.figure.places[n], self.figure.quaternions[n]
        for handle, joints in self.parts:
            for bone, j in zip(handle.bones, joints.tolist()):
                known = bool(np.isfinite(places[j]).all())
                bone.position = places[j] if known else NOWHERE
                bone.wxyz = turns[j]

    def set_opacity(self, opacity: float | None) -> None:
        """0 to 1; None: solid."""
        for handle, _ in self.parts:
            handle.opacity = opacity


class Frustum:
    """A camera's node, with what it saw in it."""

    def __init__(self, server: viser.ViserServer, n: int, eye: Eye, plain: Plain, scale: float) -> None:
        """The camera's number tells its colour; its picture is put `scale` metres before it."""
        self.eye, self.plain = eye, plain
        from scipy.spatial.transform import Rotation

        T = inverse(eye.camera.T_camera_world)
        turn = np.roll(Rotation.from_matrix(T[:3, :3]).as_quat(), 1)
        self.wxyz, self.centre = turn, T[:3, 3]
        name = f"/cameras/{n} {clean(eye.camera.name)}"
        colour = tuple(BY_CAMERA[n % len(BY_CAMERA)].tolist())
        self.volume = float(np.cbrt(np.tan(plain.fov / 2) ** 2 * plain.aspect / 3))  # viser's scale is one of volumes
        self.handle = server.scene.add_camera_frustum(
            name, plain.fov, plain.aspect, scale=scale * self.volume, thickness=1.6, thickness_units="screen", color=colour, wxyz=turn,
            position=three(T[:3, 3]), cast_shadow=False, receive_shadow=False)  # fmt: skip
        server.scene.add_label(f"{name}/name", eye.camera.name, font_screen_scale=0.8, anchor="bottom-center")

    def reach(self, away: float) -> None:
        """Put the picture so many metres before the camera."""
        self.handle.scale = away * self.volume

    def seen(self, time: float, look: Look) -> NDArray[np.uint8] | None:
        """What it is to show at a time, seconds: this takes its time."""
        return None if self.eye.seen is None else shown(self.eye.seen, self.plain, time, look)

    def put(self, image: NDArray[np.uint8] | None, wished: bool) -> None:
        """Show a picture, (H, W, 3) red green blue or (H, W, 4); or none."""
        self.handle.visible = wished
        if wished and (image is not None or self.handle.image is not None):
            self.handle.image = image


@lru_cache(maxsize=1)
def ball(count: int = 120) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """A unit ball as triangles: points (V, 3) spread by the golden angle, and corners (F, 3), counterclockwise from outside."""
    from scipy.spatial import ConvexHull

    n = np.arange(count) + 0.5
    z, turn = 1 - 2 * n / count, np.pi * (1 + 5**0.5) * n
    flat = np.sqrt(1 - z**2)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], 1)
    faces = ConvexHull(points).simplices
    outward = np.einsum("fx,fx->f", np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]),
                        points[faces].mean(1)) > 0  # fmt: skip
    return points.astype(np.float32), np.where(outward[:, None], faces, faces[:, ::-1]).astype(np.uint32)


def colour_of(kind: str, linear: Array) -> tuple[int, int, int]:
    """A mesh's colour, linear RGB, as a figure of a kind has it, 0..255."""
    plain = PLAIN.get(kind)
    if plain is not None:
        return plain
    own = 255 * np.clip(linear, 0, 1) ** (1 / 2.2)
    mixed, share = BLENDED.get(kind, ((0, 0, 0), 0.0))
    red, green, blue = ((1 - share) * own + share * np.array(mixed)).round().astype(int).tolist()
    return red, green, blue


def clean(name: str) -> str:
    """A name as one step of a path in the scene's tree."""
    return "".join(sign if sign.isalnum() or sign in " -_.," else "_" for sign in name)[:60]


def three(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Three numbers as viser takes them."""
    x, y, z = (float(value) for value in values)
    return x, y, z
