"""What is undone in a frame before its pixels are compared with the empty scene: movement of the camera, changes of light, the rest of the
room, detail lost to compression."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Window
from shadowpuppet.silhouette.background import Image
from shadowpuppet.silhouette.correction.detail import LostDetail
from shadowpuppet.silhouette.correction.light import Light
from shadowpuppet.silhouette.correction.registration import Gap, Homography, Registration
from shadowpuppet.silhouette.settings import SilhouetteSettings


class Corrected(NamedTuple):
    """A corrected frame."""

    image: Image
    """Of shape (H, W, 3) or (H, W)."""
    gap: Gap | None
    """Pixels that a moved camera does not show; None if it stands still."""
    movement: Homography | None
    """The camera's movement since the empty scene; None if it stands still."""
    gains: NDArray[np.float64]
    """Gain (C,) of each channel over the empty scene; 1 if it is negligible, or not followed."""


@dataclass(frozen=True, eq=False)
class Correction:
    """A frame (H, W, 3) or (H, W) as the camera would see it where and as it stood when it saw the empty scene. It has no state."""

    scene: Image
    """Mean picture of the empty scene, of shape (H, W, 3) or (H, W)."""
    registration: Registration | None = None
    """None: the camera is taken to stand still."""
    light: Light | None = None
    """None: changes of light are not corrected."""
    region: Window | None = None
    """Rows and columns outside which the frame shows the empty scene; None for all."""
    detail: LostDetail | None = None
    """None: the film shows the empty scene in all its detail."""

    @classmethod
    def of(cls, scene: Image, settings: SilhouetteSettings, region: Window | None = None) -> Correction:
        """The correction that settings ask for."""
        registration = Registration(scene) if settings.follows_camera else None
        return cls(scene, registration, Light(scene) if settings.follows_light else None, region)

    def __call__(self, image: Image) -> Corrected:
        """The corrected frame; the frame itself if nothing is to be corrected. What a moved camera does not show is the empty scene."""
        movement = None if self.registration is None else self.registration.movement(image)
        gap, gains = None, np.ones(1)
        if self.registration is not None and movement is not None:
            image, gap = self.registration.undone(image, movement)
        if self.light is not None:
            image, gains = self.light.normalised(image)
        if gap is not None:
            image = gap.blanked(image, self.scene)
        if self.region is not None:
            blank = self.scene.copy()
            blank[self.region] = image[self.region]
            image = blank
        if self.detail is not None:
            image = self.detail(image)
        return Corrected(image, gap, movement, gains)
