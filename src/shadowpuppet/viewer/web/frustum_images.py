"""Images of a camera as the viewer shows them: undistorted pictures and silhouettes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.video import Image
from shadowpuppet.viewer.scene.scene import CameraImages

WIDEST = 1.9
"""Tangent of half the greatest field of view; fisheye pictures are cut there."""


def camera_image(images: CameraImages, undistort: Undistorter, time: float, pictures: bool) -> NDArray[np.uint8] | None:
    """A camera's undistorted image at a time (s): the picture, (H, W, 3), blue green red; or the silhouette, (H, W), white on black. None
    if there is none."""
    if pictures:
        image = images.picture(time)
        return None if image is None else undistort(image)
    mask = images.mask(time)
    return None if mask is None else np.where(undistort(mask.astype(np.uint8) * 255) > 127, 255, 0).astype(np.uint8)


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
