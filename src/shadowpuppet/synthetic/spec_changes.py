"""Frequent changes to a spec, each a flag of the command line."""

from __future__ import annotations

import re
from dataclasses import asdict, fields, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.body.sizes import expected_metres, is_within
from shadowpuppet.errors import SettingsError
from shadowpuppet.settings import STRICT
from shadowpuppet.synthetic.company import RING_FOV, RING_RADIUS, RING_RADIUS_EACH, SEED, Together, members
from shadowpuppet.synthetic.faults.fault import faults_from_text
from shadowpuppet.synthetic.movement.gestures import GESTURES
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.movement.script import SHORTEST, Gesture
from shadowpuppet.synthetic.person.mannequin import STATURES, Mannequin
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values
from shadowpuppet.synthetic.viewpoint import Viewpoint
from shadowpuppet.synthetic.walls import WallStyle

OCCLUDERS: dict[str, dict[str, float]] = {"table": {"ahead": 0.75}, "chair": {"ahead": 0.7, "left": -0.25, "turn_deg": 180},
                                          "pillar": {"ahead": 0.9, "left": 0.2}, "cabinet": {"ahead": 0.7, "left": 0.35}}
"""Place (m) and rotation (degrees) of each kind of `occluder`."""
SECOND_PERSONS: dict[str, dict[str, Any]] = {
    "behind": {"ahead": -1.0, "left": -0.6},
    "aside": {"ahead": 0.0, "left": 1.0},
    "passing": {"ahead": -1.3, "left": 0.0, "turn_deg": 90, "motion": {"motion": "walk", "path": "line", "size": 3.0}},
}
"""The bystander of each choice of `second_person`."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class SpecChanges:
    """Frequent changes to a spec; None leaves the spec as it is."""

    motion: str | None = None
    """Gestures and their seconds, such as "wave_hands 4, reach 5"; those without seconds share --seconds, or take 4 each. Or a file of
    motion capture (.amc)."""
    seconds: Annotated[float, Field(ge=2, le=3600)] | None = None
    """Length of the motion; the film has 0.8 s of standing before and after it."""
    posture: PostureName | None = None
    """Posture from the first frame to the last."""
    chair: Literal["known", "new"] | None = None
    """Chair on which the person sits: known is in the film of the empty scene too, new is not."""
    body: Literal["woman", "man", "child", "random"] | None = None
    """Kind of person; drawn by the seed from published proportions."""
    height: float | None = None
    """Height of the person, metres."""
    cameras: Annotated[int, Field(ge=1, le=64)] | None = None
    """Number of cameras; several stand in a ring around the person."""
    ring_radius: float | None = None
    """Distance of the ring's cameras from the person's place, metres."""
    distance: float | None = None
    """Distance of a single camera from the person's place, metres. Without it a motion of the whole body is filmed from where the floor is
    seen wherever the person goes."""
    camera_height: float | None = None
    """Height of the cameras over the floor, metres."""
    fov: float | None = None
    """Horizontal field of view of the cameras, degrees."""
    fisheye: bool | None = None
    """Fisheye lenses."""
    size: str | None = None
    """Width and height of the pictures, such as 640x480."""
    rate: float | None = None
    """Frames per second."""
    background: WallStyle | None = None
    """Walls and floor."""
    room: int | None = None
    """Seed of wall, floor and lamps."""
    clothing: int | None = None
    """Seed of clothes, hair and skin."""
    camouflage: float | None = None
    """Similarity of the clothes' colour to the wall's, 0 to 1."""
    shadow: float | None = None
    """Darkness of the person's shadow on floor and wall, 0 to 1."""
    noise: float | None = None
    """Sensor noise: standard deviation in grey levels."""
    flicker: float | None = None
    """Relative amplitude of the lamps' flicker, such as 0.03."""
    drift: float | None = None
    """Relative change of the light by the end of the film; negative: it fades."""
    crf: int | None = None
    """Compression of the films, H.264's crf: 0 the best, 18 the default, 51 the worst."""
    occluder: Literal["table", "chair", "pillar", "cabinet"] | None = None
    """Obstacle between the person and the first camera."""
    empty_seconds: float | None = None
    """Length of the film of the empty scene, seconds; 0: there is none."""
    second_person: Literal["behind", "aside", "passing"] | None = None
    """A second person: standing behind or aside, or passing to and fro behind."""
    people: Annotated[int, Field(ge=2, le=6)] | None = None
    """Number of people, 2 to 6, each with a body, clothes, motion and truth of their own."""
    together: Together | None = None
    """Their motion: walk round or past each other, dance on the spot, or shake hands; two people if --people does not say how many."""
    faults: str | None = None
    """Faults of the pictures: kind, amount, @begin-end in seconds, drift, cameras, such as "gain 1.3 @3-6, nudge 20 @4 cam2, black @5"; all
    but the kind may be left out."""


SCENE_CHANGES = ("room", "clothing", "camouflage", "shadow", "noise", "flicker", "drift", "crf", "background", "empty_seconds")
"""Changes that are settings of the scene."""
CAMERA_CHANGES = {"fov": "fov_deg", "camera_height": "height", "fisheye": "fisheye"}
"""Changes that are settings of every camera, and their names there."""


def apply_changes(changes: SpecChanges, spec: Spec, source: str = "flags") -> Spec:
    """A spec with `changes` applied. Raises `SettingsError` for an impossible one."""
    said = {field.name: value for field in fields(SpecChanges) if (value := getattr(changes, field.name)) is not None}
    values = spec_values(spec)
    values["scene"] |= {name: said[name] for name in SCENE_CHANGES if name in said}
    values |= {name: said[name] for name in ("rate", "posture") if name in said}
    if {"motion", "seconds"} & set(said):
        values["motion"] = _motion(said.get("motion"), said.get("seconds"), spec, source)
    if "height" in said:
        if not is_within(said["height"], STATURES):
            raise SettingsError(f"{source}: height: found {said['height']:g}, {expected_metres(said['height'], STATURES)}")
        values["body"]["stature"] = said["height"]
    if "body" in said:
        kind = None if said["body"] == "random" else said["body"]
        values["body"] = asdict(Mannequin.draw(np.random.default_rng(spec.seed), kind, stature=said.get("height")))
    if "people" in said or "together" in said:
        _gather(values, said, spec, source)
    _place_cameras(values, said, source)
    if "faults" in said:
        values["faults"] = faults_from_text(said["faults"], f"{source}: faults")
    if "occluder" in said:
        values["scene"]["obstacles"] = [{"kind": said["occluder"], **OCCLUDERS[said["occluder"]]}]
    if "chair" in said:
        chair = {"kind": "chair", "seat": True} | ({"enters": 0.0} if said["chair"] == "new" else {})
        others = [thing for thing in values["scene"].get("obstacles", ()) if not thing.get("seat")]
        values["scene"]["obstacles"] = [*others, chair]
    if "second_person" in said:
        values["scene"]["bystanders"] = [SECOND_PERSONS[said["second_person"]]]
    changed = spec_from(values, source)
    moves = "motion" in said and any(gesture.motion not in GESTURES for gesture in changed.motion)
    if moves and changed.ring is None and "distance" not in said and [view.distance for view in changed.cameras] == [Viewpoint().distance]:
        return _showing_feet(changed)
    return _around_all(changed) if said.get("around_all") else changed


def _around_all(spec: Spec) -> Spec:
    """The spec with its ring of cameras around the middle of the floor that all people cover."""
    from shadowpuppet.synthetic.recording import covered_places

    assert spec.ring is not None
    places = covered_places(spec)
    x, y = ((places.min(0) + places.max(0)) / 2).round(3).tolist()
    return replace(spec, ring=replace(spec.ring, ahead=-y, left=x))


def _showing_feet(spec: Spec) -> Spec:
    """The spec with its one camera so far away that it sees the floor wherever the people go."""
    from shadowpuppet.synthetic.recording import covered_places

    (view,), (width, height) = spec.cameras, spec.cameras[0].size
    nearest = view.height / (np.tan(np.radians(view.fov_deg / 2)) * height / width)
    reach = float(np.linalg.norm(covered_places(spec), axis=1).max())
    return replace(spec, cameras=(replace(view, distance=round(float(nearest) + reach, 1)),))


def _gather(values: dict[str, Any], said: dict[str, Any], spec: Spec, source: str) -> None:
    """Add people to a spec's plain values: the first person's motion unless --motion gives it, and bystanders. Cameras in a ring stand
    around all of them, and back to see them all, unless they were placed."""
    if "second_person" in said:
        raise SettingsError(f"{source}: found --second-person and --people or --together, expected one of them")
    count = said.get("people", 2)
    first, *others = members(said.get("together", "round"), count)
    seconds = said.get("seconds", sum(gesture.seconds for gesture in spec.motion))
    if "motion" not in said:
        values["motion"] = [first.motion | {"seconds": seconds}]
    values["turn_deg"], values["training"] = first.turn_deg, []
    values["scene"]["bystanders"] = [
        {"motion": other.motion, "ahead": -other.y, "left": other.x, "turn_deg": other.turn_deg, "seed": SEED + n,
         "from_start": True}
        for n, other in enumerate(others)
    ]  # fmt: skip
    if "ring" not in values and said.get("cameras", 1) > 1:
        said.setdefault("ring_radius", RING_RADIUS + RING_RADIUS_EACH * (count - 2))
        said.setdefault("fov", RING_FOV)
        said["around_all"] = True


def parse_gestures(text: str, seconds: float | None = None, source: str = "motion") -> tuple[Gesture, ...]:
    """Gestures from the text `name seconds, name seconds`; those without seconds share the rest of `seconds`, or take 4 each."""
    items = [item.split() for item in text.split(",")]
    for item in items:
        if not 1 <= len(item) <= 2 or (len(item) == 2 and not re.fullmatch(r"\d+(\.\d*)?", item[1])):
            raise SettingsError(f"{source}: found {' '.join(item)!r}, expected gestures and their seconds: name 4, name 5")
    if short := next((item for item in items if len(item) == 2 and float(item[1]) < SHORTEST), None):
        raise SettingsError(f"{source}: found {' '.join(short)}, expected at least {SHORTEST:g} seconds of each gesture")
    fixed, open_ = sum(float(item[1]) for item in items if len(item) == 2), sum(len(item) == 1 for item in items)
    if seconds is not None and not open_:
        raise SettingsError(f"{source}: found seconds for every gesture and {seconds:g} for all, expected one of them")
    each = 4.0 if seconds is None else (seconds - fixed) / open_ if open_ else 0.0
    if open_ and each < SHORTEST:
        raise SettingsError(f"{source}: found {seconds:g} seconds, of which {open_} gestures get {each:g} each, expected at least "
                            f"{SHORTEST:g}")
    values = [({"motion": "mocap", "file": item[0]} if item[0].lower().endswith(".amc") else {"motion": item[0]})
              | {"seconds": float(item[1]) if len(item) == 2 else each} for item in items]
    return spec_from({"motion": values}, source).motion


def _motion(text: str | None, seconds: float | None, spec: Spec, source: str) -> list[dict[str, Any]]:
    """Gestures as plain values: those of the text, or the spec's own scaled to another length."""
    if text is not None:
        return [asdict(gesture) for gesture in parse_gestures(text, seconds, f"{source}: motion")]
    assert seconds is not None
    scale = seconds / sum(gesture.seconds for gesture in spec.motion)
    return [asdict(gesture) | {"seconds": gesture.seconds * scale} for gesture in spec.motion]


def _place_cameras(values: dict[str, Any], said: dict[str, Any], source: str) -> None:
    """Change the cameras in a spec's plain values: their settings, or from one to a ring and back."""
    placed = values.get("cameras") or [spec_values(Spec())["cameras"][0]]
    single, count = placed[0], len(placed)
    lens = {key: single[key] for key in ("size", "fov_deg", "distortion", "fisheye", "height")}
    if said.get("cameras", 1) > 1 and count == 1:
        values["ring"] = values.get("ring", lens) | {"count": said["cameras"]}
    elif said.get("cameras", count) not in (1, count):
        raise SettingsError(f"{source}: cameras: found {said['cameras']}, but the spec places its {count} cameras itself")
    elif said.get("cameras") == 1:
        values.pop("ring", None)
        values["cameras"] = [single]
    for word, key in (("ring_radius", "radius"), ("distance", "distance")):
        if word in said and ("ring" in values) != (word == "ring_radius"):
            other = "several cameras (--cameras 7)" if word == "ring_radius" else "a camera that is in no ring (for one, --ring-radius)"
            raise SettingsError(f"{source}: {word.replace('_', '-')}: found {said[word]:g}, which needs {other}")
        if word in said and word == "ring_radius":
            values["ring"][key] = said[word]
    if "ring" in values:
        values.pop("cameras", None)
    for camera in [values["ring"]] if "ring" in values else values["cameras"]:
        camera |= {key: said[word] for word, key in CAMERA_CHANGES.items() if word in said}
        camera |= {"distance": said["distance"]} if "distance" in said else {}
        camera |= {"size": _size(said["size"], source)} if "size" in said else {}


def _size(text: str, source: str) -> list[int]:
    found = re.fullmatch(r"(\d{1,5})\s*[x×,]\s*(\d{1,5})", text.strip())
    if found is None:
        raise SettingsError(f"{source}: size: found {text!r}, expected width and height in pixels, such as 640x480")
    return [int(found[1]), int(found[2])]
