"""A scene as one file that plays in a browser without a server and fetches nothing."""

from __future__ import annotations

import base64
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.synchronization import step_of
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.threads import usable_cores
from shadowpuppet.viewer.scene.scene import CameraImages, Stage
from shadowpuppet.viewer.web.content import page_text
from shadowpuppet.viewer.web.frustum_images import Undistorter, camera_image

MAX_RATE = 30.0
"""Highest frame rate of a file, frames/s."""
WIDTH = 240
"""Width of a file's images in pixels: small, as every frame is in the file."""
QUALITY = 75
"""Of JPEG, percent."""


def check_page(path: Path) -> None:
    """Raise `ShadowPuppetError` if no page can be written there."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShadowPuppetError(f"{path}: found the ending {path.suffix!r}, expected .html")
    if not path.parent.is_dir():
        raise ShadowPuppetError(f"{path}: cannot be written (there is no folder {path.parent})")


def write_page(path: str | Path, scene: Stage, pictures: bool = False, listener: Listener | None = None) -> Path:
    """Write a scene as one file, with silhouettes, and with pictures of people only if `pictures`. Raises `ShadowPuppetError` if it cannot
    be written."""
    path, listener = Path(path), listener or Listener()
    check_page(path)
    frames, lenses = kept_frames(scene.times), [Undistorter(each.camera, WIDTH) for each in scene.cameras]
    listener.begin("writing", len(frames))
    images: dict[str, list[list[str]]] = {layer: [[] for _ in lenses] for layer in ("pictures", "silhouettes")[not pictures :]}
    with ThreadPoolExecutor(usable_cores(), "images") as pool:  # a camera's images are for one thread at a time
        for n, frame in enumerate(frames.tolist()):
            time = float(scene.times[frame])
            made = pool.map(lambda each, lens, time=time: [_url(each.images, lens, time, layer == "pictures") for layer in images],
                            scene.cameras, lenses)
            for camera, urls in enumerate(made):
                for kept, url in zip(images.values(), urls):
                    kept[camera].append(url)
            listener.advance(n + 1)
    write_whole(path, page_text(scene, lenses, images, frames))
    return path


def kept_frames(times: Array) -> NDArray[np.int64]:
    """Indices of the frames in a file: all, or every Nth for at most `MAX_RATE`."""
    if len(times) < 2:
        return np.arange(len(times))
    every = max(int(np.ceil(1 / (MAX_RATE * step_of(times)) - 1e-6)), 1)
    return np.arange(0, len(times), every)


def _url(images: CameraImages | None, lens: Undistorter, time: float, pictures: bool) -> str:
    found = None if images is None else encoded_image(images, lens, time, pictures)
    return "" if found is None else f"data:{found[1]};base64,{base64.b64encode(found[0]).decode()}"


def encoded_image(images: CameraImages, lens: Undistorter, time: float, pictures: bool) -> tuple[bytes, str] | None:
    """A camera's undistorted image at a time (s), and its content type; None if there is none."""
    image = camera_image(images, lens, time, pictures)
    if image is None:
        return None
    how = [cv2.IMWRITE_JPEG_QUALITY, QUALITY] if pictures else [cv2.IMWRITE_PNG_BILEVEL, 1, cv2.IMWRITE_PNG_COMPRESSION, 9]
    return cv2.imencode(".jpg" if pictures else ".png", image, how)[1].tobytes(), "image/jpeg" if pictures else "image/png"
