"""Images shown in a camera's frustum: undistorted pictures and silhouettes."""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.video import Image
from shadowpuppet.viewer.scene.scene import CameraImages

WIDEST = 1.9
"""Tangent of half the greatest field of view; fisheye pictures are cut there."""
PERSON, OUTLINE = (46, 92, 138), (255, 200, 60)
"""Colours of a silhouette, and of its outline over a picture, RGB."""
VEIL = 40
"""Opacity of the background of a silhouette, of 255."""


class PictureMode(Enum):
    """What frustums show."""

    PICTURE = "pictures"
    """The picture, with the silhouette's outline."""
    SILHOUETTE = "silhouettes"
    """The silhouette alone: no face, nothing of the room."""
    NOTHING = "nothing"


def frustum_image(images: CameraImages, undistort: Undistorter, time: float, mode: PictureMode) -> NDArray[np.uint8] | None:
    """Image of a frustum at a time (s): RGB (H, W, 3), or RGBA (H, W, 4); None if there is none."""
    import cv2

    if mode is PictureMode.NOTHING:
        return None
    mask = images.mask(time)
    outline = None if mask is None else undistort(mask.astype(np.uint8) * 255)
    if mode is PictureMode.SILHOUETTE:
        if outline is None:
            return None
        out = np.empty((*outline.shape, 4), np.uint8)
        out[..., :3], out[..., 3] = PERSON, np.maximum(outline, VEIL)
        return out
    image = images.picture(time)
    if image is None:
        return None
    out = np.ascontiguousarray(undistort(image)[..., ::-1])
    if outline is None:
        return out
    lines = cv2.findContours((outline > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    cv2.drawContours(out, lines, -1, OUTLINE, 1, cv2.LINE_AA)
    return out


class Undistorter:
    """Undistorts and scales a camera's pictures: to those of a pinhole camera with a central principal point, as a frustum needs them."""

    def __init__(self, camera: Camera, width: int) -> None:
        """`width`: of the result, pixels."""
        (full, high), (fx, fy) = camera.size, np.diag(camera.matrix)[:2]
        self.size = (min(width, full), max(1, round(min(width, full) * high / full)))
        half = min(full / (2 * fx), WIDEST), min(high / (2 * fy), WIDEST * high / full)
        self.fov = 2 * float(np.arctan(half[1]))
        """Vertical field of view, radians."""
        self.aspect = half[0] / half[1]
        columns, rows = ((np.arange(side) + 0.5) / side * 2 - 1 for side in self.size)
        x, y = np.meshgrid(half[0] * columns, half[1] * rows)
        still = Camera(camera.name, camera.size, camera.matrix, camera.distortion, fisheye=camera.fisheye)
        pixels = still.project(np.stack([x, y, np.ones_like(x)], 2))
        self._map = np.nan_to_num(pixels, nan=-1e6).astype(np.float32)
        self._shrunk = max(full / self.size[0], 1.0)

    def __call__(self, image: Image) -> Image:
        """Undistorted picture of (H, W) or (H, W, 3); black outside the camera's picture."""
        import cv2

        if self._shrunk > 1.5:  # so that thin things do not flicker
            image = np.asarray(cv2.blur(image, (round(self._shrunk), round(self._shrunk))), np.uint8)
        return np.asarray(cv2.remap(image, self._map[..., 0], self._map[..., 1], cv2.INTER_LINEAR), np.uint8)
