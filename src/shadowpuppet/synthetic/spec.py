"""The spec of a synthetic recording, validated: body, motions, cameras and scene."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, PlainValidator, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError
from shadowpuppet.settings import STRICT, nearly
from shadowpuppet.synthetic.faults.fault import Fault
from shadowpuppet.synthetic.furniture import Coordinate, Furniture, Obstacle
from shadowpuppet.synthetic.movement.gestures import GESTURES
from shadowpuppet.synthetic.movement.resting import LYING_GESTURES, PostureName, chair_place
from shadowpuppet.synthetic.movement.script import Gesture
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.viewpoint import Name, Ring, Viewpoint
from shadowpuppet.synthetic.walls import WallStyle


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Bystander:
    """Another person in the picture, with a truth of their own; absent from the film of the empty scene."""

    kind: Literal["woman", "man", "child", "random"] = "random"
    """Kind of person; body and clothes are drawn."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of body and clothes."""
    motion: Gesture = Gesture(motion="stand")
    """Motion for the length of the film."""
    ahead: Coordinate = -1.0
    """Distance in front of the person, metres; negative behind."""
    left: Coordinate = 0.9
    """Distance to the person's left, metres."""
    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Rotation to their left, degrees; 0 looks where the person looks."""
    from_start: bool = False
    """Whether they stand in the first frame at that distance from where the person stands then; else the middle of the area over which they
    walk is that far from the middle of the person's."""
    away: tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]] | None = None
    """Seconds from and to which they are not in the scene; None: they are always there."""

    def __post_init__(self) -> None:
        """Check that the bystander does not stand at the person's place; one who walks passes over it at other times."""
        if np.hypot(self.ahead, self.left) < 0.5 and self.motion.motion not in ("walk", "jog"):
            raise ValueError(f"ahead, left: found {self.ahead:g}, {self.left:g}, where the person stands; expected 0.5 m of distance")


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Scene:
    """Clothes, room, obstacles, bystanders and picture quality."""

    clothing: Annotated[int, Field(ge=0)] = 1
    """Seed of clothes, hair and skin."""
    room: Annotated[int, Field(ge=0)] = 1
    """Seed of wall, floor and lamps."""
    shadow: Annotated[float, Field(ge=0, le=1)] = 0.2
    """Darkness of the person's shadow on floor and wall."""
    noise: Annotated[float, Field(ge=0, le=40)] = 2.5
    """Sensor noise: standard deviation in grey levels at middle grey."""
    empty_seconds: Annotated[float, Field(ge=0, le=60)] = 4.0
    """Length of the film of the empty scene, seconds; 0: there is no such film."""
    background: WallStyle = "room"
    """Walls and floor: a room with some posters, a plain wall and floor, a wall cluttered with shelves, or textured bricks and planks."""
    camouflage: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Similarity of shirt and trousers to the wall's colour: 0 as drawn, 1 the same."""
    flicker: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Relative amplitude of the lamps' flicker, also in the empty scene."""
    flicker_hz: Annotated[float, Field(gt=0, le=120)] = 1.7
    """Frequency of the flicker, Hz: the beat of mains and frame rate in a film."""
    drift: Annotated[float, Field(ge=-0.8, le=1)] = 0.0
    """Relative change of the light by the end of the film; negative: it fades."""
    crf: Annotated[int, Field(ge=0, le=51)] = 18
    """Compression of the films, H.264's constant rate factor: 0 is lossless but for half of the colour resolution, 18 hardly visible, 35
    coarse, 51 the worst."""
    obstacles: tuple[Obstacle, ...] = ()
    """Obstacles in the scene."""
    bystanders: tuple[Bystander, ...] = ()
    """Other people."""


def _seed(value: Any) -> int | tuple[int, ...]:
    numbers = list(value) if isinstance(value, (list, tuple)) else [value]
    if not numbers or not all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in numbers):
        raise ValueError(f"found {value!r}, expected a whole number from 0, or a list of them")
    return tuple(numbers) if isinstance(value, (list, tuple)) else numbers[0]


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Spec:
    """A synthetic recording: body, motion, cameras and scene, chosen independently."""

    name: Name = "made"
    """Name of the recording in tables."""
    body: Mannequin = Mannequin()
    """The person."""
    motion: Annotated[tuple[Gesture, ...], Field(min_length=1)] = (Gesture(motion="wave_hands"),)
    """Gestures, performed one after another."""
    training: tuple[Gesture, ...] | None = None
    """Gestures of the training motion, for several cameras only; by default those of `motion` again; an empty list: no training motion."""
    posture: PostureName = "standing"
    """Posture from the first frame to the last, in which the person performs gestures of arms and trunk: standing, seated (on nothing
    visible, unless an obstacle is their `seat`), kneeling upright, or lying on the back, the feet toward a camera in front. All other
    motions need standing."""
    begin: Annotated[float, Field(ge=0, le=3600)] = 0.0
    """Seconds of the motion, including its 0.8 s of standing, before the film and the training motion begin."""
    frames: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Frames of the film; by default to the motion's end."""
    training_frames: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Frames of the training motion; by default to its end."""
    cameras: Annotated[tuple[Viewpoint, ...], Field(min_length=1)] = (Viewpoint(),)
    """One camera, or several."""
    ring: Ring | None = None
    """Cameras around the person, in place of `cameras`."""
    scene: Scene = Scene()
    """Clothes, room and noise."""
    faults: tuple[Fault, ...] = ()
    """Faults of the films' pictures."""
    rate: Annotated[float, Field(ge=1, le=240)] = 15.0
    """Frames per second."""
    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Rotation of the person to their left, degrees; not in the reference pictures."""
    still: Annotated[float, Field(ge=0, le=3)] = 1.0
    """Factor on sway and tremor; 0: none."""
    tells: Literal["height and distance", "height", "distance", "nothing"] = "height and distance"
    """Data of the subject that recording.toml states; no distance of a person who walks."""
    seed: Annotated[int | tuple[int, ...], PlainValidator(_seed)] = 0
    """Seed of motion and noise if no generator is given: a whole number, or several."""

    def __post_init__(self) -> None:
        """Check that camera names differ, that the posture allows the motions, that no camera is inside an obstacle or a bystander, and
        that faults name cameras."""
        names = [view.name for view in self.cameras]
        if len(set(names)) < len(names):
            raise ValueError(f"cameras: found the names {', '.join(names)}, each must be used once")
        if self.ring is not None and self.cameras != (Viewpoint(),):
            raise ValueError("ring: found cameras as well, expected one of them")
        _check_posture(self.posture, (*self.motion, *(self.training or ())))
        _check_seat(self)
        things = self.furniture()
        for view in self.views() if things else ():
            kind = things.holds(view.camera().centre)
            if kind is not None:
                raise ValueError(f"scene.obstacles: found a {kind} where the camera {view.name!r} stands")
        for view, other in itertools.product(self.views() if self.scene.bystanders else (), self.scene.bystanders):
            if np.hypot(*(view.camera().centre[:2] - (other.left, -other.ahead))) < 0.4:
                raise ValueError(f"scene.bystanders: found a person where the camera {view.name!r} stands")

        for n, fault in enumerate(self.faults):
            known = [view.name for view in self.views()]
            if (unknown := next((name for name in fault.cameras if name not in known), None)) is not None:
                raise ValueError(f"faults.{n}: cameras: found {unknown!r}, there are: {', '.join(known)}")

    def views(self) -> tuple[Viewpoint, ...]:
        """The cameras: those of `cameras`, or the ring's."""
        return self.cameras if self.ring is None else self.ring.views(self.body.stature)


    def furniture(self) -> Furniture:
        """The obstacles; the chair on which the person sits is at their place."""
        left, ahead, scale = chair_place(self.body, self.posture, np.radians(self.turn_deg))
        return Furniture([replace(thing, left=left, ahead=ahead, scale=scale, turn_deg=self.turn_deg) if thing.seat else thing
                          for thing in self.scene.obstacles])


def _check_posture(posture: PostureName, motions: Iterable[Gesture]) -> None:
    """Raise `ValueError` if one of the motions cannot be performed in the posture."""
    possible = LYING_GESTURES if posture == "lying" else tuple(GESTURES)
    for motion in motions if posture != "standing" else ():
        if motion.motion not in possible:
            raise ValueError(f"posture: found the motion {motion.motion} of a person who is {posture}, expected {', '.join(possible)}")


def _check_seat(spec: Spec) -> None:
    """Raise `ValueError` if there is a chair to sit on and the person does not sit there."""
    if not any(thing.seat for thing in spec.scene.obstacles):
        return
    motions = [gesture.motion for gesture in spec.motion]
    away = {"walk", "jog", "turn_around", "mocap"} & set(motions)
    if spec.posture != "seated" and "sit_down" not in motions:
        raise ValueError("scene.obstacles: found a seat, but the person is not seated and never sits down (motion sit_down)")
    if away:
        raise ValueError(f"scene.obstacles: found a seat and the motion {', '.join(sorted(away))}, after which the person is elsewhere")


def spec_from(values: Mapping[str, Any], source: str = "spec") -> Spec:
    """A `Spec` from plain values, as read from TOML. Raises `SettingsError` with the first mistake."""
    try:
        return TypeAdapter(Spec).validate_python(dict(values))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(key) for key in first["loc"]) or "values"
        if first["type"] == "unexpected_keyword_argument":
            raise SettingsError(f"{source}: {place}: no such setting; possible are {_siblings(first['loc'])}") from None
        if first["type"] == "value_error":
            message = first["msg"].removeprefix("Value error, ")
            where = f"{place}: " if first["loc"] else ""
            raise SettingsError(f"{source}: {where}{message}") from None
        if first["type"] in ("dataclass_type", "tuple_type"):
            wanted = "a table" if first["type"] == "dataclass_type" else "a list"
            raise SettingsError(f"{source}: {place}: found {first['input']!r}, expected {wanted}") from None
        found = "" if first["type"] == "missing" else f", found {first['input']!r}"
        raise SettingsError(f"{source}: {place}: {first['msg'][:1].lower()}{first['msg'][1:]}{found}{nearly(first)}") from None


def spec_values(spec: Spec) -> dict[str, Any]:
    """All settings as plain values for TOML, defaults included; the inverse of `spec_from`."""
    from shadowpuppet.io.files.plain import for_toml, plain

    values = for_toml(plain(spec, "spec"))
    if spec.ring is not None:
        del values["cameras"]
    return values


TABLES: dict[str, Any] = {"body": Mannequin, "motion": Gesture, "cameras": Viewpoint, "ring": Ring, "scene": Scene, "obstacles": Obstacle,
                          "bystanders": Bystander, "faults": Fault}
"""The tables of a spec, by name."""


def _siblings(place: tuple[int | str, ...]) -> str:
    """Names of all settings in the table of the one at `place`."""
    from dataclasses import fields

    kind: Any = Spec
    for key in place[:-1]:
        kind = TABLES.get(str(key), kind)
    return ", ".join(sorted(f.name for f in fields(kind)))
