"""A scene as one file that plays in a browser without a server and fetches nothing."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.viewer.scene.scene import Scene
from shadowpuppet.viewer.web.frustum_images import PictureMode
from shadowpuppet.viewer.web.scene_view import SceneView, ViewOptions
from shadowpuppet.viewer.web.server import POLICY, close_server, open_server

if TYPE_CHECKING:
    import viser

MAX_RATE = 30.0
"""Highest frame rate of a file, frames/s."""
POINTS, WIDTH = 700, 200
"""Hull points a frame, and width of images in pixels: small, as every frame is in the file."""
HEAD = "<head>"


def check_page(path: Path) -> None:
    """Raise `ShadowPuppetError` if no page can be written there."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShadowPuppetError(f"{path}: found the ending {path.suffix!r}, expected .html")
    if not path.parent.is_dir():
        raise ShadowPuppetError(f"{path}: cannot be written (there is no folder {path.parent})")


def write_page(path: str | Path, scene: Scene, options: ViewOptions | None = None, listener: Listener | None = None) -> Path:
    """Write a scene as one file, with pictures of people only if `options.pictures` says so, else silhouettes.

    It has no curves, and no controls but the timeline's. Raises `ShadowPuppetError` if it cannot be written, or without viser.
    """
    path = Path(path)
    check_page(path)
    server = open_server(port=0)
    try:
        text = _recorded(server, scene, options or ViewOptions(pictures=PictureMode.SILHOUETTE), listener or Listener())
    finally:
        close_server(server)
    write_whole(path, sealed_page(text, scene.title))
    return path


def sealed_page(page: str, title: str) -> str:
    """A page with its title and a policy that forbids the browser to fetch anything."""
    head = page.index(HEAD) + len(HEAD)
    kept = page[:head] + f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">' + page[head:]
    return kept.replace("<title>Viser</title>", f"<title>{html.escape(title)}</title>", 1)


def kept_frames(times: Array) -> Array:
    """Times of the frames in a file: all, or every Nth for at most `MAX_RATE`."""
    if len(times) < 2:
        return times
    every = max(int(np.ceil(1 / (MAX_RATE * float(np.median(np.diff(times)))) - 1e-6)), 1)
    return times[::every]


def _recorded(server: viser.ViserServer, scene: Scene, options: ViewOptions, listener: Listener) -> str:
    view, times = SceneView(server, scene, options, width=WIDTH, points=POINTS), kept_frames(scene.times)
    view.to(float(times[0]))
    serializer = server.get_scene_serializer()
    listener.begin("writing", len(times))
    for n, now in enumerate(times):
        view.to(float(now))
        if n + 1 < len(times):
            serializer.insert_sleep(float(times[n + 1] - now))
        listener.advance(n + 1)
    if len(times) > 1:
        serializer.insert_sleep(float(np.median(np.diff(times))))
    return serializer.as_html()
