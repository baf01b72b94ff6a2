"""Serves the page of a scene."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from shadowpuppet.viewer.scene.scene import Scene
from shadowpuppet.viewer.web.frustum_images import PictureMode
from shadowpuppet.viewer.web.panel import Panel
from shadowpuppet.viewer.web.scene_view import SceneView, ViewOptions
from shadowpuppet.viewer.web.server import address_of, close_server, open_server


def serve_scene(scene: Scene, listen: str = "127.0.0.1", port: int | None = None, options: ViewOptions | None = None,
         ready: Callable[[str], None] = lambda address: None, done: Callable[[], bool] = lambda: False) -> None:
    """Serve a scene's page until `done` returns True, or Ctrl-C. `ready` is called with its address.

    Raises `SettingsError` if the address or port is not free, `ShadowPuppetError` without viser.
    """
    server = open_server(listen, port)
    try:
        view = SceneView(server, scene, options or default_view(scene))
        view.people(view.time)
        panel = Panel(server, view, time.monotonic)
        ready(address_of(server))
        panel.follow(done)
    finally:
        close_server(server)


@contextmanager
def serving(scene: Scene, options: ViewOptions, **more: int) -> Iterator[tuple[str, Panel]]:
    """Serve a scene from a thread; yields the page's address and its controls.

    `more`: arguments of `SceneView`. Raises the errors of `serve_scene`.
    """
    server = open_server(port=0)
    panel = Panel(server, SceneView(server, scene, options, **more))
    thread = threading.Thread(target=panel.follow)
    thread.start()
    try:
        yield address_of(server), panel
    finally:
        panel.stop()
        thread.join()
        panel.view.close()
        close_server(server)


def default_view(scene: Scene, pictures: bool = True) -> ViewOptions:
    """The first view of a scene: bodies transparent if a truth is inside them, hull points if there is no puppet, the pictures of films
    (or their silhouettes alone)."""
    kinds = {figure.kind for figure in scene.figures}
    mode = PictureMode.PICTURE if pictures else PictureMode.SILHOUETTE
    transparent = {"estimate", "truth"} <= kinds
    return ViewOptions(transparent=transparent, hull=scene.hull is not None and "estimate" not in kinds, pictures=mode,
                       uncertainty=scene.has_uncertainty)
