"""A live scene drawn with viser: its nodes are created once and updated for each view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.viewer.scene.scene import Scene
from shadowpuppet.viewer.web.frustum_images import Undistorter
from shadowpuppet.viewer.web.nodes import FigureNodes, Frustum, node_name, triple

if TYPE_CHECKING:
    import viser

FRUSTUM_SHARE, FRUSTUM_LENGTHS = 0.22, (0.18, 0.75)
"""Length of frustums as a share of the scene's size, and its limits in metres."""


class SceneView:
    """The nodes of a scene in a viser server."""

    def __init__(self, server: viser.ViserServer, scene: Scene, width: int = 320) -> None:
        """`width`: of images in frustums, pixels."""
        self.server, self.scene = server, scene
        server.scene.set_up_direction("+z")
        self._floor()
        length = float(np.clip(FRUSTUM_SHARE * scene.size, *FRUSTUM_LENGTHS))
        self.figures = [FigureNodes(server, figure, f"/people/{n} {node_name(figure.name)}") for n, figure in enumerate(scene.figures)]
        self.frustums = [Frustum(server, n, each, Undistorter(each.camera, width), length) for n, each in enumerate(scene.cameras)]
        server.initial_camera.position = triple(scene.viewpoint)
        server.initial_camera.look_at = triple(scene.middle)
        server.initial_camera.up = (0.0, 0.0, 1.0)

    def _floor(self) -> None:
        low, high = self.scene.box
        side = float(np.ceil(max(high[0] - low[0], high[1] - low[1]) + 2.5))
        place = (float(np.round(self.scene.middle[0])), float(np.round(self.scene.middle[1])), self.scene.floor)
        self.server.scene.add_grid("/floor", width=side, height=side, position=place, cell_size=0.5, section_size=1.0,
                                   cell_color=(214, 218, 224), section_color=(176, 182, 192), shadow_opacity=0.0)
