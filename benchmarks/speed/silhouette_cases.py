"""Segmentation as it is timed: a textured room of 640 x 480 pixels, on clean film and under faults."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette import Segmenter, learn_background
from shadowpuppet.silhouette.correction.frame_correction import Corrected
from shadowpuppet.silhouette.correction.light import NEGLIGIBLE
from shadowpuppet.silhouette.correction.registration import STILL

Image = NDArray[np.uint8]
SIZE = (640, 480)
"""Width and height, pixels."""
NUDGE = 17.0, 10.0, 0.02
"""Movement of the camera: pixels across and down, and roll (rad)."""
VIGNETTING = 0.3
"""Share of the light that is lost in the corners."""


class SilhouetteCase:
    """A room and a person in it: frames of a clean film, of a nudged camera, and of uneven light."""

    @cached_property
    def room(self) -> NDArray[np.float64]:
        """The empty scene (H, W, 3), grey levels."""
        import cv2

        rng = np.random.default_rng(0)
        out = np.asarray(cv2.resize(rng.uniform(50, 190, (24, 32, 3)), SIZE, interpolation=cv2.INTER_CUBIC), float)
        for _ in range(30):
            x, y, width, height = (int(value) for value in rng.integers(0, (600, 440, 80, 80)))
            out[y : y + height, x : x + width] = rng.uniform(40, 200, 3)
        return out

    @cached_property
    def frames(self) -> dict[str, Image]:
        """Frames (H, W, 3) by name: clean, moved, uneven."""
        import cv2

        room = self.room.copy()
        cv2.ellipse(room, (320, 260), (50, 150), 0, 0, 360, (70, 30, 30), -1)
        (x, y, roll), (width, height) = NUDGE, SIZE
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), np.degrees(roll), 1)
        matrix[:, 2] += (x, y)
        v, u = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
        moved = np.asarray(cv2.warpAffine(room, matrix, SIZE, borderMode=cv2.BORDER_REFLECT), float)
        uneven = room * (1 - VIGNETTING / 2 * (u**2 + v**2))[..., None]
        return {"clean": _filmed(room, 1), "moved": _filmed(moved, 2), "uneven": _filmed(uneven, 3)}

    @cached_property
    def segmenter(self) -> Segmenter:
        """Learnt from a film of the empty scene."""
        return learn_background([_filmed(self.room, seed) for seed in range(8)], film=[self.frames["clean"]])

    def segment(self) -> NDArray[np.bool_]:
        """The mask (H, W) of a clean frame."""
        return self.segmenter(self.frames["clean"])

    def correct(self, name: str) -> Corrected:
        """What of `segment` looks for changes of light and movement, and undoes them, in the frame of a name."""
        assert self.segmenter.correction is not None
        return self.segmenter.correction(self.frames[name])


    def correct_plainly(self) -> Image:
        """A straightforward correction of the clean frame by OpenCV and NumPy: phase correlation (a shift alone) of the whole picture with
        the empty scene, and the median ratio of all pixels, per channel; none is undone if it is small."""
        import cv2

        assert self.segmenter.correction is not None
        image, scene = self.frames["clean"], self.segmenter.correction.scene
        before, after = (cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).astype(np.float32) for picture in (scene, image))
        shift, _ = cv2.phaseCorrelate(before, after)
        if np.hypot(shift[0], shift[1]) >= STILL:
            image = np.asarray(cv2.warpAffine(image, np.array([[1, 0, -shift[0]], [0, 1, -shift[1]]]), SIZE), np.uint8)
        gains = np.median(np.maximum(image, 1) / np.maximum(scene, np.float32(1)), axis=(0, 1))
        return image if np.abs(np.log(gains)).max() < NEGLIGIBLE else np.clip(np.rint(image / gains), 0, 255).astype(np.uint8)


def _filmed(picture: NDArray[np.floating], seed: int) -> Image:
    rng = np.random.default_rng(seed)
    return np.rint(picture + rng.normal(0, 1.5, picture.shape)).clip(0, 255).astype(np.uint8)
