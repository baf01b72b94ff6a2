"""A live session in 3D on the viewer's page: the puppet, the camera and its picture, and the session's buttons."""

from __future__ import annotations

import threading
import time
from typing import Any, Self

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.live.display.choice import FOOTERS
from shadowpuppet.live.display.drawing import drawn
from shadowpuppet.live.display.view import Display, View
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.limbs import limb_of, limbs_of
from shadowpuppet.motion.mesh import body_mesh
from shadowpuppet.viewer.scene.figures import LimbStatuses, animation_figure
from shadowpuppet.viewer.scene.scene import Figure, Scene, SceneCamera
from shadowpuppet.viewer.web.frustum_images import Undistorter
from shadowpuppet.viewer.web.scene_view import SceneView
from shadowpuppet.viewer.web.server import address_of, close_server, open_server

MOST_A_SECOND = 10.0
"""Greatest number of views drawn per second; more would slow the tracker."""
BUTTONS = {"Stop": "stop", "Learn the background again": "learn", "Measure the person again": "measure"}
WIDE, QUALITY = 320, 80
"""Width of the picture, pixels, and its JPEG quality."""


class ViewerDisplay(Display):
    """Display on the viewer's page, served until the end of its `with` block. A thread draws the newest view; older ones are dropped."""

    def __init__(self, listen: str = "127.0.0.1", port: int | None = None, footer: str = "") -> None:
        """`footer`: text below the controls. Raises the errors of `open_server`."""
        self.server = open_server(listen, port)
        self.where = f"at {address_of(self.server)}"
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 92, 148))
        gui.set_panel_label("shadowpuppet live")
        self.status = gui.add_markdown("getting ready")
        self.image = gui.add_image(np.full((9, 16, 3), 40, np.uint8), format="jpeg", jpeg_quality=QUALITY)
        for label, command in BUTTONS.items():
            gui.add_button(label).on_click(lambda _, command=command: self._press(command))
        gui.add_markdown(footer)
        self._command, self._over = "", False
        self._view: View | None = None
        self._phase = ""
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._follow, name="viewer", daemon=True)
        self._stage: _LiveScene | None = None

    def __enter__(self) -> Self:
        """Start the drawing thread."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the drawing thread and close the server."""
        with self._changed:
            self._over = True
            self._changed.notify_all()
        self._thread.join(timeout=5)
        close_server(self.server)

    def show(self, view: View) -> None:
        """Pass the next view to the drawing thread; it replaces one that is not yet drawn."""
        if view.image is None and not view.trouble and view.phase == self._phase:
            return  # nothing new: the last view stays
        with self._changed:
            self._view, self._phase = view, view.phase
            self._changed.notify_all()

    def command(self) -> str:
        """Command of the last button pressed since the last call; empty if none was."""
        command, self._command = self._command, ""
        return command

    def _press(self, command: str) -> None:
        self._command = command

    def _follow(self) -> None:
        while True:
            with self._changed:
                if self._view is None and not self._over:
                    self._changed.wait(1.0)
                view, self._view = self._view, None
                if self._over:
                    return
            if view is not None:
                began = time.monotonic()
                self._draw(view)
                time.sleep(max(1 / MOST_A_SECOND - (time.monotonic() - began), 0.0))

    def _draw(self, view: View) -> None:
        self.status.content = words(view)
        image = drawn(view)
        if image is not None:
            self.image.image = _small(image)
        if view.picture is None or view.image is None:
            return
        if self._stage is None or self._stage.picture is not view.picture:
            self._stage = _LiveScene(self.server, view.picture)
        self._stage.to(view)


class _LiveScene:
    """Puppet and camera of a measured person in the viewer; a new measurement makes a new one."""

    def __init__(self, server: Any, picture: Picture) -> None:
        self.picture = picture
        self.root = inverse(picture.camera.T_camera_world) @ picture.T_camera_base
        self.tree, self.mesh = BodyTree(picture.body), body_mesh(picture.body)
        rest = picture.body.skeleton.clamp(np.zeros((1, len(picture.body.skeleton.dofs))))
        every = frozenset(picture.body.landmark_names)  # so that there are pale nodes for all limbs
        self.figure = posed(picture.body, self.tree, self.mesh, rest[0], self.root, every)
        server.scene.reset()
        show = Scene(title="live", times=np.zeros(1), figures=(self.figure,), cameras=(SceneCamera(picture.camera),))
        self.stage = SceneView(server, show, WIDE)
        for client in server.get_clients().values():  # pages that are already open
            client.camera.position, client.camera.look_at = show.viewpoint, show.middle
        self.plain = Undistorter(picture.camera, WIDE)

    def to(self, view: View) -> None:
        """Draw a view."""
        figure = None if view.pose is None else posed(self.picture.body, self.tree, self.mesh, view.pose, self.root, view.doubtful)
        puppet, eye = self.stage.figures[0], self.stage.frustums[0]
        image = drawn(View(phase=view.phase, image=view.image, mask=view.mask))
        with self.stage.server.atomic():
            if figure is not None:
                puppet.figure = figure
            puppet.to(0.0, figure is not None)
            if image is not None:
                eye.put(np.ascontiguousarray(self._fitted(image)[..., ::-1]), True)
        self.stage.server.flush()

    def _fitted(self, image: np.ndarray) -> np.ndarray:
        """A picture of any size, undistorted and scaled for the frustum."""
        import cv2

        width, height = self.picture.camera.size
        return self.plain(np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8))


def open_viewer(listen: str = "127.0.0.1", port: int | None = None, record: bool = False) -> ViewerDisplay:
    """The display for `--show viewer`. Raises `SettingsError` if the address or port is not free, `ShadowPuppetError` without viser."""
    return ViewerDisplay(listen, port, FOOTERS[record])


def posed(body: Body, tree: BodyTree, mesh: Any, pose: Array, root: Array, doubtful: frozenset[str] = frozenset()) -> Figure:
    """Figure of a body in one pose (D,), limbs of `doubtful` landmarks pale; `root` (4, 4): the body's frame to the world."""
    animation, limbs = tree.animation(np.zeros(1), np.asarray(pose, float)[None], root), limbs_of(body.landmark_names)
    pale = {limb_of(name) for name in body.landmark_names if name in doubtful}
    statuses = LimbStatuses(limbs, np.array([["uncertain" if limb in pale else "tracked" for limb in limbs]]))
    return animation_figure(body.name, animation, mesh, statuses=statuses)


def _small(image: np.ndarray) -> np.ndarray:
    """A picture (H, W, 3), blue green red, scaled to the page's width, red green blue."""
    import cv2

    height, width = image.shape[:2]
    return np.ascontiguousarray(cv2.resize(image, (WIDE, max(1, round(WIDE * height / width))), interpolation=cv2.INTER_AREA)[..., ::-1])


def words(view: View) -> str:
    """Status line of a view: its phase, message, latency, frame rate, overlap and countdown."""
    figures = view.figures()
    said = [f"**{figures['chip']}**", figures["message"]]
    if figures["latency"] is not None:
        lag = f" ({figures['lag']:.0f} ms of it the lag of smoothing)" if figures["lag"] else ""
        said.append(f"{figures['latency']:.0f} ms from capture to pose{lag}")
    if figures["rate"] is not None:
        said.append(f"{figures['rate']:.0f} frames/s")
    if figures["overlap"] is not None:
        said.append(f"overlap {figures['overlap']:.2f}")
    if figures["countdown"]:
        said.append(f"{np.ceil(figures['countdown']):.0f}")
    return " · ".join(word for word in said if word)
