"""A show drawn with viser: made once, then set to one time after another."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.threads import usable_cores
from shadowpuppet.viewer.scene.show import Cloud, Show, Spread
from shadowpuppet.viewer.web.nodes import BY_CAMERA, GLASS, Frustum, Puppet, ball, clean, three
from shadowpuppet.viewer.web.pictures import Look, Plain

if TYPE_CHECKING:
    import viser

POINTS = 2400
"""Surface points that are drawn, at most."""
DRAWN = 150
"""Particles that are drawn, at most: those that weigh most."""
SIGMAS = 2.0
"""Standard deviations that half an axis of an ellipsoid is long: within it are 74 % of what is normally spread in space."""
SHARE, LEAST_AND_MOST = 0.22, (0.18, 0.75)
"""How long frustums are, of what is shown, within metres."""
ALONE = 0.6
"""The same of a camera with nobody beside it."""


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
    """The stated uncertainty, as ellipsoids; where the run states none, how far the particles are spread."""
    cloud: bool = False
    """Particles of the frame."""
    through: int | None = None
    """The camera that is looked through."""


class Stage:
    """A show's nodes in a viser server: `to(time)` sets them."""

    def __init__(self, server: viser.ViserServer, show: Show, wish: Wish | None = None, *, width: int = 320, points: int = POINTS) -> None:
        """`width`: pixels of pictures in frustums; `points`: on the hull."""
        self.server, self.show, self.wish, self.points = server, show, wish or Wish(), points
        self.time = float(show.times[0])
        scene = server.scene
        scene.set_up_direction("+z")
        self._floor()
        glass, near = self.wish.glass, self._near()
        self.figures = [Puppet(server, figure, f"/people/{n} {clean(figure.name)}", glass) for n, figure in enumerate(show.figures)]
        self.eyes = [Frustum(server, n, eye, Plain(eye.camera, width), near) for n, eye in enumerate(show.eyes)]
        for n, (text, place) in enumerate(show.labels):
            scene.add_label(f"/labels/{n}", text, position=place, font_screen_scale=0.9)
        self._hull: Any = None
        self._ellipsoids: Any = None
        self._cloud: Any = None
        self._warm, self._pool = False, ThreadPoolExecutor(usable_cores(), "seen")
        server.initial_camera.position = three(show.viewpoint)
        server.initial_camera.look_at = three(show.middle)
        server.initial_camera.up = (0.0, 0.0, 1.0)

    def to(self, time: float) -> None:
        """Set everything that is wished for to a time, seconds; what has to be read or made first comes with the rest, all at once."""
        self.time = time
        if not self._warm:  # backgrounds are learnt before the first silhouette: the people need not wait for that
            self.people(time)
        made = list(self._pool.map(lambda eye: eye.seen(time, self.wish.pictures), self.eyes)) if self.wish.cameras else []
        surface = self.show.hull(time) if self.show.hull is not None and self.wish.hull else None
        stated = self._stated(time)
        cloud = self._particles(time, stated is None)
        self._warm = True
        with self.server.atomic():
            self.people(time)
            for n, eye in enumerate(self.eyes):
                eye.put(made[n] if made else None, self.wish.cameras)
            self._put_hull(None if surface is None else (surface.points, surface.cameras))
            self._put_spread((stated or (cloud and cloud.spread)) if self.wish.spread else None)
            self._put_cloud(cloud if self.wish.cloud else None)
        self.server.flush()

    @property
    def reads_first(self) -> bool:
        """Whether backgrounds are learnt before the next time is shown."""
        return not self._warm and self.wish.cameras and any(eye.eye.seen is not None for eye in self.eyes)

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
        share = SHARE if self.show.figures or len(self.show.eyes) > 1 else ALONE
        return float(np.clip(share * self.show.size, *LEAST_AND_MOST))

    def _particles(self, time: float, unstated: bool) -> Cloud | None:
        """Particles, where they are asked for, or how far they are spread and the run states nothing."""
        wanted = self.wish.cloud or (self.wish.spread and unstated)
        return self.show.cloud(time) if wanted and self.show.cloud is not None else None

    def _stated(self, time: float) -> Spread | None:
        """The uncertainty that the run states."""
        for figure in self.show.figures if self.wish.spread else ():
            n = figure.at(time) if figure.kind == "estimate" else None
            if n is not None and (stated := figure.spread(n)) is not None:
                return stated
        return None

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
                                                           position=three(self.show.middle))
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
            points, faces = ball()  # drawn as nets: what is solid hides, and glass within glass is hidden
            self._ellipsoids = self.server.scene.add_batched_meshes_simple(
                "/uncertainty", points, faces, turns, places, batched_scales=axes, batched_colors=(214, 60, 90), lod="off",
                wireframe=True, cast_shadow=False, receive_shadow=False)  # fmt: skip
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
