"""A scene drawn with viser: its nodes are created once and updated for each time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.threads import usable_cores
from shadowpuppet.viewer.scene.scene import Ellipsoids, HullPoints, ParticleCloud, Scene
from shadowpuppet.viewer.web.frustum_images import PictureMode, Undistorter
from shadowpuppet.viewer.web.nodes import BY_CAMERA, TRANSPARENT_OPACITY, FigureNodes, Frustum, node_name, triple, unit_sphere

if TYPE_CHECKING:
    import viser

POINTS = 2400
"""Greatest number of hull points drawn."""
DRAWN = 150
"""Greatest number of particles drawn: those of greatest weight."""
SIGMAS = 2.0
"""Half axes of ellipsoids in standard deviations: 74 % of a normal distribution in space are within."""
FRUSTUM_SHARE, FRUSTUM_LENGTHS = 0.22, (0.18, 0.75)
"""Length of frustums as a share of the scene's size, and its limits in metres."""
LONE_FRUSTUM_SHARE = 0.6
"""The share for a single camera without figures."""


@dataclass
class ViewOptions:
    """What a view of a scene shows."""

    figures: dict[str, bool] = field(default_factory=lambda: {"estimate": True, "truth": True, "other": True, "mean": True})
    """Whether figures are shown, by kind."""
    transparent: bool = False
    """Whether bodies are transparent."""
    hull: bool = False
    """Whether points on the visual hull are shown."""
    cameras: bool = True
    pictures: PictureMode = PictureMode.SILHOUETTE
    """Images in the frustums."""
    uncertainty: bool = False
    """Ellipsoids of the stated uncertainty; of the spread of the particles if the run states none."""
    particles: bool = False
    through: int | None = None
    """Index of the camera from which the scene is seen; None: from a free viewpoint."""


class SceneView:
    """The nodes of a scene in a viser server; `to(time)` sets them."""

    def __init__(self, server: viser.ViserServer, scene: Scene, options: ViewOptions | None = None, *, width: int = 320,
                 points: int = POINTS) -> None:
        """`width`: of images in frustums, pixels; `points`: on the hull."""
        self.server, self.scene, self.options, self.points = server, scene, options or ViewOptions(), points
        self.time = float(scene.times[0])
        server.scene.set_up_direction("+z")
        self._floor()
        self.figures = [FigureNodes(server, figure, f"/people/{n} {node_name(figure.name)}", self.options.transparent)
                        for n, figure in enumerate(scene.figures)]
        self.frustums = [Frustum(server, n, each, Undistorter(each.camera, width), self._frustum_length())
                         for n, each in enumerate(scene.cameras)]
        for n, (text, place) in enumerate(scene.labels):
            server.scene.add_label(f"/labels/{n}", text, position=place, font_screen_scale=0.9)
        self._hull: Any = None
        self._ellipsoids: Any = None
        self._cloud: Any = None
        self._warm, self._pool = False, ThreadPoolExecutor(usable_cores(), "images")
        server.initial_camera.position = triple(scene.viewpoint)
        server.initial_camera.look_at = triple(scene.middle)
        server.initial_camera.up = (0.0, 0.0, 1.0)

    def to(self, time: float) -> None:
        """Show everything chosen by `options` at a time, seconds: read and compute it, then update all nodes at once."""
        self.time = time
        if not self._warm:  # learning the backgrounds is slow: show the figures before
            self.people(time)
        mode = self.options.pictures
        images = list(self._pool.map(lambda frustum: frustum.image(time, mode), self.frustums)) if self.options.cameras else []
        hull = self.scene.hull(time) if self.scene.hull is not None and self.options.hull else None
        stated = self._stated(time)
        cloud = self._particles(time, stated is None)
        self._warm = True
        with self.server.atomic():
            self.people(time)
            for n, frustum in enumerate(self.frustums):
                frustum.put(images[n] if images else None, self.options.cameras)
            self._put_hull(hull)
            self._put_ellipsoids((stated or (cloud and cloud.ellipsoids)) if self.options.uncertainty else None)
            self._put_cloud(cloud if self.options.particles else None)
        self.server.flush()

    @property
    def reads_first(self) -> bool:
        """Whether the next call of `to` has to learn backgrounds."""
        return not self._warm and self.options.cameras and any(each.images is not None for each in self.scene.cameras)

    def people(self, time: float) -> None:
        """Set the figures alone."""
        with self.server.atomic():
            for figure in self.figures:
                figure.to(time, self.options.figures.get(figure.figure.kind, True))
        self.server.flush()

    def close(self) -> None:
        """Stop the threads that make images."""
        self._pool.shutdown(cancel_futures=True)

    def set_transparent(self, transparent: bool) -> None:
        """Make bodies transparent or solid."""
        self.options.transparent = transparent
        for figure in self.figures:
            if figure.figure.kind != "truth":
                figure.set_opacity(TRANSPARENT_OPACITY if transparent else None)

    def look_through(self, n: int | None) -> None:
        """Move the image of camera `n` behind the figures, for a view from that camera; None: move every image to its frustum."""
        self.options.through = n
        for k, frustum in enumerate(self.frustums):
            distance = float(np.linalg.norm(self.scene.cameras[k].camera.centre - self.scene.middle))
            frustum.set_distance(distance + 0.6 * self.scene.size if k == n else self._frustum_length())

    # Parts

    def _floor(self) -> None:
        low, high = self.scene.box
        side = float(np.ceil(max(high[0] - low[0], high[1] - low[1]) + 2.5))
        place = (float(np.round(self.scene.middle[0])), float(np.round(self.scene.middle[1])), self.scene.floor)
        self.server.scene.add_grid("/floor", width=side, height=side, position=place, cell_size=0.5, section_size=1.0,
                                   cell_color=(214, 218, 224), section_color=(176, 182, 192), shadow_opacity=0.0)

    def _frustum_length(self) -> float:
        share = FRUSTUM_SHARE if self.scene.figures or len(self.scene.cameras) > 1 else LONE_FRUSTUM_SHARE
        return float(np.clip(share * self.scene.size, *FRUSTUM_LENGTHS))

    def _particles(self, time: float, unstated: bool) -> ParticleCloud | None:
        """Particles at a time, s; None unless they are shown, or their spread is in place of an uncertainty that the run does not state."""
        wanted = self.options.particles or (self.options.uncertainty and unstated)
        return self.scene.cloud(time) if wanted and self.scene.cloud is not None else None

    def _stated(self, time: float) -> Ellipsoids | None:
        """The uncertainty stated by the run, of all people, at a time, s; None if it is not shown or not stated."""
        own = [figure for figure in self.scene.figures if figure.kind == "estimate"] if self.options.uncertainty else []
        stated = [found for figure in own if (n := figure.at(time)) is not None and (found := figure.uncertainty(n)) is not None]
        return Ellipsoids(*map(np.concatenate, zip(*stated))) if stated else None

    def _put_hull(self, hull: HullPoints | None) -> None:
        if hull is None or not len(hull.points):
            if self._hull is not None:
                self._hull.visible = False
            return
        order = np.linspace(0, len(hull.points) - 1, self.points).round().astype(int)  # a constant number, so that the page keeps the node
        places = (hull.points[order] - self.scene.middle).astype(np.float16)
        colours = BY_CAMERA[hull.cameras[order] % len(BY_CAMERA)]
        if self._hull is None:
            self._hull = self.server.scene.add_point_cloud("/hull points", places, colours, point_size=0.009, point_shape="circle",
                                                           position=triple(self.scene.middle))
        else:
            self._hull.points, self._hull.colors, self._hull.visible = places, colours, True

    def _put_ellipsoids(self, ellipsoids: Ellipsoids | None) -> None:
        if ellipsoids is None:
            if self._ellipsoids is not None:
                self._ellipsoids.visible = False
            return
        from scipy.spatial.transform import Rotation

        turns = np.roll(Rotation.from_matrix(ellipsoids.turns).as_quat(), 1, axis=1).astype(np.float32)
        places, axes = ellipsoids.points.astype(np.float32), (SIGMAS * ellipsoids.axes).astype(np.float32)
        if self._ellipsoids is None or len(self._ellipsoids.batched_positions) != len(places):
            points, faces = unit_sphere()  # as wire frames: solid ones hide the rest, transparent bodies hide transparent ones
            self._ellipsoids = self.server.scene.add_batched_meshes_simple(
                "/uncertainty", points, faces, turns, places, batched_scales=axes, batched_colors=(214, 60, 90), lod="off",
                wireframe=True, cast_shadow=False, receive_shadow=False)  # fmt: skip
        else:
            self._ellipsoids.batched_positions, self._ellipsoids.batched_scales = places, axes
            self._ellipsoids.batched_wxyzs, self._ellipsoids.visible = turns, True

    def _put_cloud(self, cloud: ParticleCloud | None) -> None:
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
