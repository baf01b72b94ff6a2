"""A show as one file that plays in a browser with no server, and fetches nothing."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.viewer.scene.show import Show
from shadowpuppet.viewer.web.pictures import Look
from shadowpuppet.viewer.web.server import POLICY, close_server, open_server
from shadowpuppet.viewer.web.stage import Stage, Wish

if TYPE_CHECKING:
    import viser

FASTEST = 30.0
"""Frames of a file a second, at most."""
POINTS, WIDE = 700, 200
"""Surface points a frame, and pixels of pictures' width: every frame of them is in the file."""
HEAD = "<head>"


def check_page(path: Path) -> None:
    """Raise `ShadowPuppetError` where no page can be written."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShadowPuppetError(f"{path}: found the ending {path.suffix!r}, expected .html")
    if not path.parent.is_dir():
        raise ShadowPuppetError(f"{path}: cannot be written (there is no folder {path.parent})")


def write_page(path: str | Path, show: Show, wish: Wish | None = None, listener: Listener | None = None) -> Path:
    """Write a show as one file. Pictures of people are in it only where `wish.pictures` says so; silhouettes are otherwise.

    Curves and controls but the timeline's are not in it. Raises `ShadowPuppetError` where it cannot be written, or without viser.
    """
    path = Path(path)
    check_page(path)
    server = open_server(port=0)
    try:
        text = _recorded(server, show, wish or Wish(pictures=Look.SILHOUETTE), listener or Listener())
    finally:
        close_server(server)
    write_whole(path, closed(text, show.title))
    return path


def closed(page: str, title: str) -> str:
    """A page with its title, to which the browser is told to fetch nothing."""
    head = page.index(HEAD) + len(HEAD)
    kept = page[:head] + f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">' + page[head:]
    return kept.replace("<title>Viser</title>", f"<title>{html.escape(title)}</title>", 1)


def kept_frames(times: Array) -> Array:
    """The times of the frames that are in a file: all, or so many a second."""
    if len(times) < 2:
        return times
    every = max(int(np.ceil(1 / (FASTEST * float(np.median(np.diff(times)))) - 1e-6)), 1)
    return times[::every]


def _recorded(server: viser.ViserServer, show: Show, wish: Wish, listener: Listener) -> str:
    stage, times = Stage(server, show, wish, width=WIDE, points=POINTS), kept_frames(show.times)
    stage.to(float(times[0]))
    serializer = server.get_scene_serializer()
    listener.begin("writing", len(times))
    for n, now in enumerate(times):
        stage.to(float(now))
        if n + 1 < len(times):
            serializer.insert_sleep(float(times[n + 1] - now))
        listener.advance(n + 1)
    if len(times) > 1:
        serializer.insert_sleep(float(np.median(np.diff(times))))
    return serializer.as_html()
