"""The page of a live session with the body in space beside the camera's picture, drawn by the viewer's stage."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.live.display.drawing import drawn, jpeg
from shadowpuppet.live.display.view import SessionState
from shadowpuppet.live.display.web import WebDisplay
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.limbs import limb_of, limbs_of
from shadowpuppet.motion.mesh import body_mesh
from shadowpuppet.viewer.scene.figures import LimbStatuses, animation_figure
from shadowpuppet.viewer.scene.scene import SceneCamera, SceneFigure, Stage
from shadowpuppet.viewer.web.content import content, motion_content, script_text
from shadowpuppet.viewer.web.frustum_images import Undistorter

SCRIPTS = ("stage.js", "space.js")
WIDTH = 320
"""Width of the camera's image in space, pixels."""
NOW = np.zeros(1)
"""The only time of a scene, seconds."""


class SpaceDisplay(WebDisplay):
    """Serves the page within its `with` block; from the moment the person is measured, with the body in space."""

    _space: LiveSpace | None = None

    def figures(self, view: SessionState) -> dict[str, Any]:
        """The figures of a view and, with a measured person, `space`, the number of its scene, and `puppet`, the body's pose in it."""
        if (space := self._space_of(view)) is None:
            return super().figures(view)
        return super().figures(view) | {"space": space.number, "puppet": space.puppet(view)}

    def part(self, path: str) -> tuple[bytes, str] | None:
        """The script that draws in space, the newest scene, and the camera's newest image in it."""
        if path == "/space.js":
            return script_text(SCRIPTS).encode(), "text/javascript; charset=utf-8"
        view = self.next(0, 0.0)[1]
        if path not in ("/space.json", "/space.jpg") or (space := self._space_of(view)) is None:
            return None
        if path == "/space.json":
            return json.dumps(space.content(view), allow_nan=False).encode(), "application/json"
        return space.image(view), "image/jpeg"

    def _space_of(self, view: SessionState) -> LiveSpace | None:
        """The scene of a view's person: a new one, with a new number, whenever the person is measured again."""
        if not view.pictures:
            return None
        with self._drawing:
            old = self._space
            if old is None or any(a is not b for a, b in zip(old.pictures, view.pictures, strict=True)):
                self._space = LiveSpace(view.pictures, 1 if old is None else old.number + 1)
            return self._space


class LiveSpace:
    """The scene of a measured person before one or several cameras. Thread-safe."""

    def __init__(self, pictures: tuple[Picture, ...], number: int) -> None:
        """`pictures`: the body as each camera sees it; `number`: counts the scenes of a session, from 1."""
        self.pictures, self.number = pictures, number
        self.body, self._cameras = pictures[0].body, tuple(SceneCamera(each.camera) for each in pictures)
        self._root = inverse(pictures[0].camera.T_camera_world) @ pictures[0].T_camera_base
        self._tree, self._mesh = BodyTree(self.body), body_mesh(self.body)
        self._lenses = [Undistorter(each.camera, WIDTH) for each in pictures]

    def content(self, view: SessionState) -> dict[str, Any]:
        """The scene for the page's stage, as JSON: the body as in a view, or at rest, and the cameras."""
        rest = self.body.skeleton.clamp(np.zeros((1, len(self.body.skeleton.dofs))))[0]
        figure = self.figure(rest if view.pose is None else view.pose)
        scene = Stage(title="live", times=NOW, figures=(figure,), cameras=self._cameras)
        return content(scene, self._lenses, None, np.arange(1)) | {"number": self.number, "film": len(self._cameras) == 1}

    def puppet(self, view: SessionState) -> dict[str, Any] | None:
        """The body's motion for the stage; None without a trustworthy pose."""
        return None if view.pose is None else motion_content(self.figure(view.pose, view.doubtful), NOW)

    def figure(self, pose: Array, doubtful: frozenset[str] = frozenset()) -> SceneFigure:
        """The body in a pose (D,), the limbs of `doubtful` landmarks hatched."""
        names = self.body.landmark_names
        limbs, pale = limbs_of(names), {limb_of(name) for name in names if name in doubtful}
        statuses = LimbStatuses(limbs, np.array([["uncertain" if limb in pale else "tracked" for limb in limbs]]))
        animation = self._tree.animation(NOW, np.asarray(pose, float)[None], self._root)
        return animation_figure(self.body.name, animation, self._mesh, statuses=statuses)

    def image(self, view: SessionState) -> bytes:
        """The only camera's picture with the silhouette's outline, undistorted, as JPEG; empty without a picture."""
        import cv2

        image = drawn(SessionState(phase=view.phase, trouble=view.trouble, image=view.image, mask=view.mask))
        if image is None:
            return b""
        full = np.asarray(cv2.resize(image, self._cameras[0].camera.size, interpolation=cv2.INTER_AREA), np.uint8)
        return jpeg(self._lenses[0](full))
