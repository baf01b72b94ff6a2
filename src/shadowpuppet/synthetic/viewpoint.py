"""Cameras of a spec: placed one by one, or in a ring."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import inverse, rigid, rotation_about, transform
from shadowpuppet.settings import STRICT

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
Side = Annotated[int, Field(ge=16, le=4096)]
AngleDeg = Annotated[float, Field(ge=-180, le=180)]
FovDeg = Annotated[float, Field(ge=10, le=170)]
Height = Annotated[float, Field(ge=0.05, le=6)]
Coefficient = Annotated[float, Field(allow_inf_nan=True)]  # infinite and NaN are refused by `Viewpoint`, whose message shows all numbers
Distance = Annotated[float, Field(ge=0.8, le=20)]
MAX_PINHOLE_FOV = 120.0
"""Greatest horizontal field of view of a pinhole lens, degrees."""
BORDER_SLACK = 8
"""Pixels beyond the border of a picture that the renderer's tiles use (not for a fisheye)."""
BODY_CENTRE = 0.52
"""Height of a person's middle over the stature."""
RING_JITTER = {"azimuth_deg": 7.0, "height": 0.25, "yaw_deg": 3.0, "pitch_deg": 3.0, "roll_deg": 4.0}
"""Greatest irregularity of a ring's cameras at a jitter of 1, metres and degrees."""
RING_SCALE_JITTER = 0.07
"""The same for distance and field of view, relative."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Viewpoint:
    """A camera directed at the vertical axis through the person's place."""

    name: Name = "cam"
    """Name of the camera and of its films."""
    size: tuple[Side, Side] = (320, 240)
    """Width and height of its pictures, pixels."""
    fov_deg: FovDeg = 60.0
    """Horizontal field of view, degrees, before distortion; up to 120, a fisheye's to 170."""
    height: Height = 1.6
    """Height over the floor, metres."""
    distance: Distance = 2.0
    """Horizontal distance from the person's place, metres."""
    azimuth_deg: AngleDeg = 0.0
    """Direction from the person to the camera, degrees: 0 in front of the person, 90 on their left."""
    pitch_deg: Annotated[float, Field(ge=-60, le=60)] = 0.0
    """Angle below the horizontal, degrees."""
    distortion: tuple[Coefficient, ...] = ()
    """OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6]], or a fisheye's k1 k2 k3 k4; empty for no distortion."""
    yaw_deg: Annotated[float, Field(ge=-60, le=60)] = 0.0
    """Angle by which it looks past the person to its right, degrees."""
    roll_deg: AngleDeg = 0.0
    """Clockwise rotation about its optical axis, degrees."""
    fisheye: bool = False
    """Whether the lens is a fisheye (OpenCV's model, equidistant without distortion)."""

    def __post_init__(self) -> None:
        """Check the number of distortion coefficients, and that every pixel has a ray."""
        allowed = (0, 4) if self.fisheye else (0, 4, 5, 8)
        if len(self.distortion) not in allowed:
            expected = f"{', '.join(map(str, allowed[:-1]))} or {allowed[-1]}"
            raise ValueError(f"distortion: found {len(self.distortion)} numbers, expected {expected}")
        if not np.isfinite(self.distortion).all():
            raise ValueError(f"distortion: found {list(self.distortion)}, expected finite numbers")
        if self.fov_deg > MAX_PINHOLE_FOV and not self.fisheye:
            raise ValueError(f"fov_deg: found {self.fov_deg:g}, expected at most {MAX_PINHOLE_FOV:g}, or fisheye = true")
        corner = self.fov_deg / 2 * np.hypot(*self.size) / self.size[0]
        if self.fisheye and corner > 88:
            most = np.floor(self.fov_deg * 88 / corner)
            raise ValueError(f"fov_deg: found {self.fov_deg:g}, expected at most {most:g} for a fisheye of this shape: corners see farther")
        if (any(self.distortion) or self.fisheye) and not sees_everywhere(self.camera()):
            raise ValueError(f"distortion: found {list(self.distortion)}, which bends the picture so far that its border shows nothing")

    def camera(self) -> Camera:
        """The calibrated camera; world: Z up, floor at 0, the person at the origin facing -Y."""
        half = np.radians(self.fov_deg) / 2
        focal = self.size[0] / (2 * (half if self.fisheye else np.tan(half)))
        matrix = np.array([[focal, 0, (self.size[0] - 1) / 2], [0, focal, (self.size[1] - 1) / 2], [0, 0, 1]])
        around = rotation_about([0, 0, 1], np.radians(self.azimuth_deg))
        level = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
        R = rotation_about([1, 0, 0], np.radians(self.pitch_deg)) @ level @ around.T
        if self.yaw_deg or self.roll_deg:
            aside = rotation_about([0, 1, 0], np.radians(-self.yaw_deg))
            R = rotation_about([0, 0, 1], np.radians(-self.roll_deg)) @ aside @ R
        centre = around @ np.array([0, -self.distance, self.height])
        distortion = np.array(self.distortion) if self.distortion else np.zeros(4)
        return Camera(self.name, self.size, matrix, distortion, rigid(R, -R @ centre), fisheye=self.fisheye)


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Ring:
    """Cameras evenly around the person or another place, directed at its middle, with the irregularity of real rigs."""

    count: Annotated[int, Field(ge=2, le=64)] = 7
    """Number of cameras; their names are cam1, cam2, ..."""
    radius: Distance = 3.5
    """Horizontal distance from the ring's middle, metres."""
    ahead: Annotated[float, Field(ge=-8, le=8)] = 0.0
    """Distance of its middle in front of the person, metres; negative behind."""
    left: Annotated[float, Field(ge=-8, le=8)] = 0.0
    """Distance of its middle to the person's left, metres."""
    height: Height = 1.6
    """Height over the floor, metres."""
    start_deg: AngleDeg = 0.0
    """Direction from the middle to the first camera, degrees: 0 in front of the person, 90 on their left; the others follow to the left."""
    jitter: Annotated[float, Field(ge=0, le=1)] = 0.3
    """Irregularity of place, direction and focal length: 0 a perfect ring; 1 up to 7 degrees, 25 cm, 7 % of the radius."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the irregularities."""
    size: tuple[Side, Side] = (320, 240)
    """Width and height of the pictures, pixels."""
    fov_deg: FovDeg = 60.0
    """Horizontal field of view, degrees, before distortion."""
    distortion: tuple[Coefficient, ...] = ()
    """As in `Viewpoint`."""
    fisheye: bool = False
    """As in `Viewpoint`."""

    def __post_init__(self) -> None:
        """Check that every camera is possible for any stature."""
        for stature in (0.9, 2.2):
            self.views(stature)

    def views(self, stature: float) -> tuple[Viewpoint, ...]:
        """The cameras around a person of a `stature` (m), in order."""
        rng, views = np.random.default_rng(self.seed), []
        for n in range(self.count):
            off = {name: self.jitter * most * rng.uniform(-1, 1) for name, most in RING_JITTER.items()}
            distance = float(np.clip(self.radius * (1 + self.jitter * RING_SCALE_JITTER * rng.uniform(-1, 1)), 0.8, 20))
            fov = float(np.clip(self.fov_deg * (1 + self.jitter * RING_SCALE_JITTER * rng.uniform(-1, 0)), 10, 170))
            height = float(np.clip(self.height + off["height"], 0.05, 6))
            down = np.degrees(np.arctan2(height - BODY_CENTRE * stature, distance)) + off["pitch_deg"]
            direction = wrapped(self.start_deg + 360 * n / self.count + off["azimuth_deg"])
            distance, azimuth = self._from_person(distance, direction)
            yaw = float(np.clip(off["yaw_deg"] + wrapped(azimuth - direction), -60, 60))  # it looks at the middle, not at the person
            views.append(Viewpoint(name=f"cam{n + 1}", size=self.size, fov_deg=fov, height=height, distance=distance, azimuth_deg=azimuth,
                                   pitch_deg=float(np.clip(down, -60, 60)), yaw_deg=yaw, roll_deg=off["roll_deg"],
                                   distortion=self.distortion, fisheye=self.fisheye))  # fmt: skip
        return tuple(views)

    def _from_person(self, distance: float, direction: float) -> tuple[float, float]:
        """Distance (m) and direction (degrees) from the person of a camera that is given by those from the middle."""
        if not (self.ahead or self.left):
            return distance, direction
        left = self.left + distance * np.sin(np.radians(direction))
        ahead = self.ahead + distance * np.cos(np.radians(direction))
        return float(np.clip(np.hypot(left, ahead), 0.8, 20)), float(np.degrees(np.arctan2(left, ahead)))


def wrapped(degrees: float) -> float:
    """The same angle from -180 to below 180, degrees."""
    return float((degrees + 180) % 360 - 180)


def sees_everywhere(camera: Camera) -> bool:
    """Whether every pixel's ray projects back to the pixel: too strong distortion folds the picture."""
    (width, height), slack = camera.size, 0.5 if camera.fisheye else BORDER_SLACK
    pixels = np.stack(np.meshgrid(np.linspace(-slack, width - 1 + slack, 17), np.linspace(-slack, height - 1 + slack, 17)), -1)
    rays = camera.rays(pixels)
    if not np.isfinite(rays).all() or np.abs(rays).max() > 60:
        return False
    turned = transform(inverse(camera.T_camera_world), rays)
    return bool(np.abs(camera.project(turned) - pixels).max() < 0.1)
