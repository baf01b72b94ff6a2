"""What a made recording is made of, as data: a body, motions, cameras and a scene, each validated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from shadowpuppet.camera import Camera
from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import rigid, rotation_about
from shadowpuppet.synthetic.mannequin import Mannequin
from shadowpuppet.synthetic.paths import PathName

STRICT = ConfigDict(extra="forbid")
MotionName = Literal[
    "stand", "wave_hands", "bend_aside", "bow_forward", "twist", "reach", "forearms_up", "overhead", "random",
    "walk", "jog", "box", "lift", "squat", "sit", "march", "jump", "turn_around", "random_body", "mocap",
]  # fmt: skip
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Gesture:
    """A motion and how long it takes."""

    motion: MotionName
    """Its name: a gesture of the arms and trunk, an act of the whole body, `walk`, `jog`, or `mocap` from a file."""
    seconds: Annotated[float, Field(ge=2, le=3600)] = 4.0
    """Its length; of a file no more than there is."""
    speed: Annotated[float, Field(ge=0.4, le=5)] | None = None
    """Of walk (0.4 to 2.0) and jog (1.6 to 5), m/s; without it a comfortable one."""
    path: PathName = "circle"
    """Where walk and jog go: a circle or ellipse to the left, a line there and back, or on the spot as on a treadmill."""
    size: Annotated[float, Field(ge=0.5, le=20)] = 1.2
    """Radius of the circle, half the longer axis of the ellipse, length of the line, metres."""
    file: str | None = None
    """Motion capture to play (`mocap`): a .amc file; its skeleton, the .asf file, lies beside it."""
    start: Annotated[float, Field(ge=0)] = 0.0
    """Seconds of the file to leave out."""
    file_rate: Annotated[float, Field(gt=0, le=1000)] = 120.0
    """Frames a second of the file."""

    def __post_init__(self) -> None:
        """A speed must fit the gait, and motion capture needs a file."""
        low, high = {"walk": (0.4, 2.0), "jog": (1.6, 5.0)}.get(self.motion, (0.0, 5.0))
        if self.speed is not None and not low <= self.speed <= high:
            raise ValueError(f"speed: found {self.speed:g}, expected {low:g} to {high:g} for {self.motion}")
        if (self.motion == "mocap") != (self.file is not None):
            raise ValueError("file: needed by the motion mocap, and only by it")


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Viewpoint:
    """A camera that looks horizontally, or pitched, at the vertical axis through the person's place."""

    name: Name = "cam"
    """Its name: that of its films."""
    size: tuple[Annotated[int, Field(ge=16, le=4096)], Annotated[int, Field(ge=16, le=4096)]] = (320, 240)
    """Width and height of its pictures, pixels."""
    fov_deg: Annotated[float, Field(ge=10, le=120)] = 60.0
    """Horizontal field of view, degrees, before distortion."""
    height: Annotated[float, Field(ge=0.05, le=6)] = 1.6
    """Height over the floor, metres."""
    distance: Annotated[float, Field(ge=0.8, le=20)] = 2.0
    """Horizontal distance from the person's place, metres."""
    azimuth_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Where around the person it stands, degrees: 0 before them, 90 on their left."""
    pitch_deg: Annotated[float, Field(ge=-60, le=60)] = 0.0
    """How far it looks down, degrees."""
    distortion: tuple[float, ...] = ()
    """OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6]]; none for a perfect lens."""

    def __post_init__(self) -> None:
        """The numbers of distortion must be a model's."""
        if len(self.distortion) not in (0, 4, 5, 8):
            raise ValueError(f"distortion: found {len(self.distortion)} numbers, expected 0, 4, 5 or 8")

    def camera(self) -> Camera:
        """The calibrated camera in the world: Z up, floor at 0, the person at the origin facing -Y."""
        focal = self.size[0] / (2 * np.tan(np.radians(self.fov_deg) / 2))
        matrix = np.array([[focal, 0, (self.size[0] - 1) / 2], [0, focal, (self.size[1] - 1) / 2], [0, 0, 1]])
        around = rotation_about([0, 0, 1], np.radians(self.azimuth_deg))
        level = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
        R = rotation_about([1, 0, 0], np.radians(self.pitch_deg)) @ level @ around.T
        centre = around @ np.array([0, -self.distance, self.height])
        distortion = np.array(self.distortion) if self.distortion else np.zeros(4)
        return Camera(self.name, self.size, matrix, distortion, rigid(R, -R @ centre))


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Scene:
    """Clothes, room and picture quality."""

    clothing: Annotated[int, Field(ge=0)] = 1
    """Seed of clothes, hair and skin."""
    room: Annotated[int, Field(ge=0)] = 1
    """Seed of wall, floor and lamps."""
    shadow: Annotated[float, Field(ge=0, le=1)] = 0.2
    """How dark the person's shadow is on floor and wall."""
    noise: Annotated[float, Field(ge=0, le=40)] = 2.5
    """Sensor noise: standard deviation in grey levels at middle grey."""
    empty_seconds: Annotated[float, Field(ge=0.2, le=60)] = 4.0
    """Length of the film of the empty scene."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Spec:
    """A recording to be made: bodies x motions x cameras x scenes are chosen independently."""

    name: Name = "made"
    """What it is called in tables."""
    body: Mannequin = Mannequin()
    """The person."""
    motion: Annotated[tuple[Gesture, ...], Field(min_length=1)] = (Gesture(motion="wave_hands"),)
    """Gestures, one after another."""
    cameras: Annotated[tuple[Viewpoint, ...], Field(min_length=1)] = (Viewpoint(),)
    """One camera, or several."""
    scene: Scene = Scene()
    """Clothes, room and noise."""
    rate: Annotated[float, Field(ge=1, le=240)] = 15.0
    """Pictures a second."""
    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """How far the person stands turned to their left, degrees; in the references they do not."""
    still: Annotated[float, Field(ge=0, le=3)] = 1.0
    """Factor on sway and tremor: 0 is a robot."""
    tells: Literal["height and distance", "height", "distance", "nothing"] = "height and distance"
    """What recording.toml says of the subject."""

    def __post_init__(self) -> None:
        """Camera names must differ."""
        names = [view.name for view in self.cameras]
        if len(set(names)) < len(names):
            raise ValueError(f"cameras: found the names {', '.join(names)}, each must be used once")


def spec_from(values: Mapping[str, Any], source: str = "spec") -> Spec:
    """A `Spec` of plain values, as read from TOML. Raises `SettingsError`: one sentence on the first thing that is wrong."""
    try:
        return TypeAdapter(Spec).validate_python(dict(values))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(key) for key in first["loc"]) or "values"
        if first["type"] == "unexpected_keyword_argument":
            raise SettingsError(f"{source}: {place}: no such setting; possible are {_siblings(first['loc'])}") from None
        found = "" if first["type"] in ("missing", "value_error") else f", found {first['input']!r}"
        raise SettingsError(f"{source}: {place}: {first['msg'][:1].lower()}{first['msg'][1:]}{found}") from None


def _siblings(place: tuple[int | str, ...]) -> str:
    """Names of the settings beside the one at `place`."""
    from dataclasses import fields

    kind: Any = Spec
    for key in place[:-1]:
        kind = {"body": Mannequin, "motion": Gesture, "cameras": Viewpoint, "scene": Scene}.get(str(key), kind)
    return ", ".join(sorted(f.name for f in fields(kind)))
