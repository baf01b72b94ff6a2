"""A show drawn with viser: made once, then set to one time after another."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array, inverse
from shadowpuppet.threads import usable_cores
from shadowpuppet.viewer.pictures import Look, Plain, shown
from shadowpuppet.viewer.show import Cloud, Figure, Show, Spread

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
POINTS = 2400
"""Surface points that are drawn, at most."""
DRAWN = 150
"""Particles that are drawn, at most: those that weigh most."""
SIGMAS = 2.0
"""Standard deviations that half an axis of an ellipsoid is long: within it are 74 % of what is normally spread in space."""
GLASS = 0.5
"""How opaque figures are that are seen through."""
SHARE = 0.16
"""How large frustums are, of what is shown."""


@dataclass
class Wish:
    """What of a show is to be seen."""

    figures: dict[str, bool] = field(default_factory=lambda: {"estimate": True, "truth": True, "other": True, "mean": True})
    """By kind."""
    glass: bool = False
    """Whether bodies are seen through."""
    hull: bool = False
    cameras: bool = True
    pictures: Look = Look.SILHOUETTE
    spread: bool = False
    """The stated uncertainty, as ellipsoids."""
    cloud: bool = False
    """Particles of the frame."""
    through: int | None = None
    """The camera that is looked through."""


class Stage:
    """A show's nodes in a viser server: `to(time)` sets them."""

    def __init__(self, server: viser.ViserServer, show: Show, wish: Wish | None = None, width: int = 320, points: int = POINTS) -> None:
        """`width`: pixels of pictures in frustums."""
        self.server, self.show, self.wish, self.points = server, show, wish or Wish(), points
        self.time = float(show.times[0])
        scene = server.scene
        scene.set_up_direction("+z")
        self._floor()
        self.figures = [_Puppet(server, figure, f"/people/{n} {_clean(figure.name)}", self.wish.glass) for n, figure in enumerate(show.figures)]
        self.eyes = [_Frustum(server, n, eye, Plain(eye.camera, width), self._near()) for n, eye in enumerate(show.eyes)]
        for n, (text, place) in enumerate(show.labels):
            scene.add_label(f"/labels/{n}", text, position=place, font_screen_scale=0.9)
        self._hull: Any = None
        self._ellipsoids: Any = None
        self._cloud: Any = None
        self._warm, self._pool = False, ThreadPoolExecutor(usable_cores(), "seen")
        server.initial_camera.position = _three(show.viewpoint)
        server.initial_camera.look_at = _three(show.middle)
        server.initial_camera.up = (0.0, 0.0, 1.0)

    def to(self, time: float) -> None:
        """Set everything that is wished for to a time, seconds; what has to be read or made first comes with the rest, all at once."""
        self.time = time
        if not self._warm:  # backgrounds are learnt before the first silhouette: the people need not wait for that
            self.people(time)
        made = list(self._pool.map(lambda eye: eye.seen(time, self.wish.pictures), self.eyes)) if self.wish.cameras else []
        surface = self.show.hull(time) if self.show.hull is not None and self.wish.hull else None
        cloud = self._particles(time)
        self._warm = True
        with self.server.atomic():
            self.people(time)
            for n, eye in enumerate(self.eyes):
                eye.put(made[n] if made else None, self.wish.cameras)
            self._put_hull(None if surface is None else (surface.points, surface.cameras))
            self._put_spread(self._spread(time, cloud))
            self._put_cloud(cloud)
        self.server.flush()

    def people(self, time: float) -> None:
        """Set the figures alone."""
        with self.server.atomic():
            for figure in self.figures:
                figure.to(time, self.wish.figures.get(figure.figure.kind, True))
        self.server.flush()

    def close(self) -> None:
        """Let the films go."""
        self._pool.shutdown(cancel_futures=True)

    def set_glass(self, glass: bool) -> None:
        """Make bodies seen through, or not."""
        self.wish.glass = glass
        for figure in self.figures:
            if figure.figure.kind != "truth":
                figure.set_opacity(GLASS if glass else None)

    def look_through(self, n: int | None) -> None:
        """Put the picture of a camera behind the people, for whoever looks through it; None: no camera's."""
        self.wish.through = n
        for k, eye in enumerate(self.eyes):
            away = float(np.linalg.norm(eye.eye.camera.centre - self.show.middle))
            eye.reach(away + 0.6 * self.show.size if k == n else self._near())

    # Parts

    def _floor(self) -> None:
        low, high = self.show.box
        side = float(np.ceil(max(high[0] - low[0], high[1] - low[1]) + 2.5))
        place = (float(np.round(self.show.middle[0])), float(np.round(self.show.middle[1])), self.show.floor)
        self.server.scene.add_grid("/floor", width=side, height=side, position=place, cell_size=0.5, section_size=1.0,
                                   cell_color=(214, 218, 224), section_color=(176, 182, 192), shadow_opacity=0.0)

    def _near(self) -> float:
        return max(SHARE * self.show.size, 0.18)

    def _particles(self, time: float) -> Cloud | None:
        return self.show.cloud(time) if self.wish.cloud and self.show.cloud is not None else None

    def _spread(self, time: float, cloud: Cloud | None) -> Spread | None:
        """What is drawn as ellipsoids: what the run states, else how far the particles are spread."""
        if not (self.wish.spread or cloud is not None):
            return None
        for figure in self.show.figures:
            n = figure.at(time) if figure.kind == "estimate" else None
            stated = figure.spread(n) if n is not None else None
            if stated is not None:
                return stated
        return cloud.spread if cloud is not None else None

    def _put_hull(self, found: tuple[Array, NDArray[np.int64]] | None) -> None:
        if found is None or not len(found[0]):
            if self._hull is not None:
                self._hull.visible = False
            return
        points, cameras = found
        order = np.linspace(0, len(points) - 1, self.points).round().astype(int)  # always as many: parts of the page are not made anew
        places, colours = (points[order] - self.show.middle).astype(np.float16), BY_CAMERA[cameras[order] % len(BY_CAMERA)]
        if self._hull is None:
            self._hull = self.server.scene.add_point_cloud("/hull points", places, colours, point_size=0.009, point_shape="circle",
                                                           position=_three(self.show.middle))
        else:
            self._hull.points, self._hull.colors, self._hull.visible = places, colours, True

    def _put_spread(self, spread: Spread | None) -> None:
        if spread is None:
            if self._ellipsoids is not None:
                self._ellipsoids.visible = False
            return
        from scipy.spatial.transform import Rotation

        turns = np.roll(Rotation.from_matrix(spread.turns).as_quat(), 1, axis=1).astype(np.float32)
        places, axes = spread.points.astype(np.float32), (SIGMAS * spread.axes).astype(np.float32)
        if self._ellipsoids is None or len(self._ellipsoids.batched_positions) != len(places):
            points, faces = ball()
            self._ellipsoids = self.server.scene.add_batched_meshes_simple(
                "/uncertainty", points, faces, turns, places, batched_scales=axes, batched_colors=(214, 60, 90), opacity=0.45, lod="off",
                cast_shadow=False, receive_shadow=False)  # fmt: skip
        else:
            self._ellipsoids.batched_positions, self._ellipsoids.batched_scales = places, axes
            self._ellipsoids.batched_wxyzs, self._ellipsoids.visible = turns, True

    def _put_cloud(self, cloud: Cloud | None) -> None:
        if cloud is None:
            if self._cloud is not None:
                self._cloud.visible = False
            return
        order = np.argsort(-cloud.weights, kind="stable")[:DRAWN][::-1]
        lines, weights = cloud.lines[order], cloud.weights[order, None, None, None]
        faint, strong = np.array([168, 176, 190]), np.array([220, 40, 80])
        colours = np.broadcast_to(faint + weights * (strong - faint), lines.shape).astype(np.uint8).reshape(-1, 2, 3)
        self._cloud = self.server.scene.add_line_segments("/particles", lines.reshape(-1, 2, 3).astype(np.float32), colours,
                                                          thickness=1.4, thickness_units="screen")


class _Puppet:
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
                color=_colour(figure.kind, colours[k]), opacity=opacity,
                side="double" if mesh.two_sided else "front", cast_shadow=False, receive_shadow=False)  # fmt: skip
            self.parts.append((handle, joints))

    def to(self, time: float, wished: bool) -> None:
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
        for handle, _ in self.parts:
            handle.opacity = opacity


class _Frustum:
    """A camera's node, with what it saw in it."""

    def __init__(self, server: viser.ViserServer, n: int, eye: Any, plain: Plain, scale: float) -> None:
        self.eye, self.plain = eye, plain
        T = inverse(eye.camera.T_camera_world)
        from scipy.spatial.transform import Rotation

        turn = np.roll(Rotation.from_matrix(T[:3, :3]).as_quat(), 1)
        self.wxyz, self.centre = turn, T[:3, 3]
        name = f"/cameras/{n} {_clean(eye.camera.name)}"
        colour = tuple(BY_CAMERA[n % len(BY_CAMERA)].tolist())
        self.volume = float(np.cbrt(np.tan(plain.fov / 2) ** 2 * plain.aspect / 3))  # viser's scale is one of volumes
        self.handle = server.scene.add_camera_frustum(name, plain.fov, plain.aspect, scale=scale * self.volume, thickness=1.6, thickness_units="screen",
                                                      color=colour, wxyz=turn, position=_three(T[:3, 3]), format="png",
                                                      cast_shadow=False, receive_shadow=False)  # fmt: skip
        server.scene.add_label(f"{name}/name", eye.camera.name, font_screen_scale=0.8, anchor="bottom-center")

    def reach(self, away: float) -> None:
        """Put the picture so many metres before the camera."""
        self.handle.scale = away * self.volume

    def seen(self, time: float, look: Look) -> NDArray[np.uint8] | None:
        return None if self.eye.seen is None else shown(self.eye.seen, self.plain, time, look)

    def put(self, image: NDArray[np.uint8] | None, wished: bool) -> None:
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


def _colour(kind: str, linear: Array) -> tuple[int, int, int]:
    """A mesh's colour, linear RGB, as a figure of a kind has it, 0..255."""
    plain = PLAIN.get(kind)
    if plain is not None:
        return plain
    own = 255 * np.clip(linear, 0, 1) ** (1 / 2.2)
    mixed, share = BLENDED.get(kind, ((0, 0, 0), 0.0))
    red, green, blue = ((1 - share) * own + share * np.array(mixed)).round().astype(int).tolist()
    return red, green, blue


def _clean(name: str) -> str:
    """A name as one step of a path in the scene's tree."""
    return "".join(sign if sign.isalnum() or sign in " -_.," else "_" for sign in name)[:60]


def _three(values: Sequence[float] | Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
