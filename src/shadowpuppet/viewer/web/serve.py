"""Serves the page of a scene to this machine's browser: images, hull points and particles are made when the page asks for them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from http import HTTPStatus

import numpy as np

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.network import is_loopback, open_page, page_headers, shown_host
from shadowpuppet.page_server import PageHandler, PageServer
from shadowpuppet.viewer.scene.scene import Stage
from shadowpuppet.viewer.web.content import page_text
from shadowpuppet.viewer.web.frustum_images import Undistorter
from shadowpuppet.viewer.web.page import encoded_image

PORT = 8610
"""Port tried first if none is given."""
WIDTH = 640
"""Width of images, pixels."""
POINTS, PARTICLES = 2400, 150
"""Greatest numbers of hull points and of particles that are shown: those of greatest weight."""


class ScenePage:
    """Answers to the requests of a scene's page. Thread-safe."""

    def __init__(self, scene: Stage) -> None:
        """Reads a film at the first request."""
        self.scene, self.lenses = scene, [Undistorter(each.camera, WIDTH) for each in scene.cameras]
        self._reading = threading.Lock()

    @cached_property
    def text(self) -> bytes:
        """The page."""
        return page_text(self.scene, self.lenses, None).encode()

    def part(self, path: str) -> tuple[bytes, str] | None:
        """Content of a path of the server, and its type; None for an unknown path, empty if there is nothing to show:

        /image/CAMERA/FRAME/pictures|silhouettes, /hull/FRAME, /particles/FRAME; the latter two are numbers of 32 bits, little-endian.
        """
        kind, *rest = path.strip("/").split("/")
        frame = _number(rest[1] if kind == "image" and len(rest) == 3 else rest[-1] if rest else "", len(self.scene.times))
        if path == "/":
            return self.text, "text/html; charset=utf-8"
        if frame is None:
            return None
        now = float(self.scene.times[frame])
        with self._reading:  # films, backgrounds and hulls are for one thread at a time
            if kind == "image" and len(rest) == 3 and rest[2] in ("pictures", "silhouettes"):
                return self._image(rest[0], now, rest[2] == "pictures")
            if kind == "hull" and self.scene.hull is not None:
                return _bytes(self._hull(now))
            if kind == "particles" and self.scene.cloud is not None:
                return _bytes(self._particles(now))
        return None

    def _image(self, camera: str, now: float, pictures: bool) -> tuple[bytes, str] | None:
        n = _number(camera, len(self.lenses))
        images = None if n is None else self.scene.cameras[n].images
        if n is None or images is None:
            return None
        return encoded_image(images, self.lenses[n], now, pictures) or (b"", "image/png")

    def _hull(self, now: float) -> Array:
        """Points and the number of their camera, (P, 4)."""
        assert self.scene.hull is not None
        found = self.scene.hull(now)
        order = np.unique(np.linspace(0, len(found.points) - 1, min(POINTS, len(found.points))).round().astype(int))
        return np.column_stack([found.points[order], found.cameras[order].astype(float)])

    def _particles(self, now: float) -> Array:
        """Ends of the bones of the particles, least weight first, and the weight, (N B, 7)."""
        assert self.scene.cloud is not None
        cloud = self.scene.cloud(now)
        if cloud is None:
            return np.zeros((0, 7))
        order = np.argsort(-cloud.weights, kind="stable")[:PARTICLES][::-1]
        lines = cloud.lines[order]
        weights = np.repeat(cloud.weights[order], lines.shape[1])
        return np.column_stack([lines.reshape(-1, 6), weights])


def _number(text: str, count: int) -> int | None:
    """A number below `count`, in decimal digits; None if it is none."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 and int(text) < count else None


def _bytes(values: Array) -> tuple[bytes, str]:
    return np.ascontiguousarray(values, "<f4").tobytes(), "application/octet-stream"


class _SceneServer(PageServer):
    def __init__(self, page: ScenePage, listen: str, port: int) -> None:
        self.page = page
        super().__init__(_SceneHandler, listen, port)


class _SceneHandler(PageHandler):
    server: _SceneServer  # pyright: ignore[reportIncompatibleVariableOverride]
    page_headers = page_headers("base-uri 'none'")  # the page has its own policy inside

    def do_GET(self) -> None:
        """Answer with the page, an image, or numbers."""
        if not self.is_accepted():
            return
        try:
            found = self.server.page.part(self.path)
        except ShadowPuppetError as error:
            self.refuse(HTTPStatus.INTERNAL_SERVER_ERROR, str(error))
            return
        if found is None:
            self.refuse(HTTPStatus.NOT_FOUND, "no such page")
        elif not found[0]:
            self.begin("text/plain", HTTPStatus.NO_CONTENT, 0)
        else:
            self.answer(*found)


@contextmanager
def serving(scene: Stage, listen: str = "127.0.0.1", port: int | None = None) -> Iterator[str]:
    """Serve a scene's page; yields its address. Raises `SettingsError` if the address or port is not free. Warns if other machines can
    reach it."""
    page = ScenePage(scene)
    server = open_page(lambda tried: _SceneServer(page, listen, tried), listen, port, PORT)
    if not is_loopback(listen):
        warn(f"the page is served at {listen}: everybody who reaches this machine can see what it shows")
    thread = threading.Thread(target=server.serve_forever, name="page", daemon=True)
    thread.start()
    try:
        yield f"http://{shown_host(listen)}:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def serve_scene(scene: Stage, listen: str = "127.0.0.1", port: int | None = None,
                ready: Callable[[str], None] = lambda address: None) -> None:
    """Serve a scene's page until Ctrl-C. `ready` is called with its address. Raises `SettingsError` if the address or port is not free."""
    with serving(scene, listen, port) as address:
        ready(address)
        while True:
            time.sleep(3600)
