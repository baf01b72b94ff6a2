"""Draws the silhouette's outline, the body and the skeleton on the camera's picture for a live display."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.camera.drawing import SILHOUETTE_ONLY, draw_person
from shadowpuppet.live.display.view import SessionState

if TYPE_CHECKING:
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.video import Image, Size

MIN_SIDE, MAX_SIDE = 640, 960
"""Limits of the picture's longer side, pixels; lines on smaller pictures would look coarse."""


def drawn(view: SessionState) -> Image | None:
    """The view's picture (H, W, 3), blue green red, with outline, body and skeleton drawn if known; None without a picture."""
    import cv2

    if view.image is None:
        return None
    size = _shown_size((view.image.shape[1], view.image.shape[0]))
    out = view.image if view.image.ndim == 3 else cv2.cvtColor(view.image, cv2.COLOR_GRAY2BGR)
    out = np.array(cv2.resize(out, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    if view.trouble or view.phase in ("learning", "measuring"):
        out = np.asarray(cv2.convertScaleAbs(out, alpha=0.45), np.uint8)  # dim without tracking
    if view.picture is not None and view.pose is not None:
        draw_person(out, _scaled(view.picture, size), view.pose, view.doubtful)
    if view.mask is not None:
        _draw_outline(out, view.mask, size)
    return out


def jpeg(image: Image, quality: int = 85) -> bytes:
    """A picture encoded as JPEG."""
    import cv2

    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _shown_size(size: Size) -> Size:
    longest = max(size)
    scale = min(max(longest, MIN_SIDE), MAX_SIDE) / longest
    return round(size[0] * scale), round(size[1] * scale)


@lru_cache(maxsize=2)
def _scaled(picture: Picture, size: Size) -> Picture:
    return replace(picture, camera=picture.camera.resized(size))


def _draw_outline(out: Image, mask: np.ndarray, size: Size) -> None:
    import cv2

    large = cv2.GaussianBlur(cv2.resize(mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_LINEAR), (0, 0), 1.5)
    lines = cv2.findContours((large > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    cv2.drawContours(out, lines, -1, SILHOUETTE_ONLY, 2, cv2.LINE_AA)
