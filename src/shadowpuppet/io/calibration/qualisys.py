"""Reads Qualisys' calibrations (.qca.txt), XML exported by QTM.

Positions are in millimetres. `r11` to `r33` rotate the world to the camera's axes, x right, y up and z backward, so that y and z are
negated here. Focal lengths and the principal point are in 64ths of a pixel of the whole sensor; `fov_video` is the recorded part.
Distortion is as OpenCV's. Pose2Sim (0.10) divides it by 64, too, which would leave a Miqus camera none.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration._xml import Entry, entries, of_films, tree_of
from shadowpuppet.io.calibration.draft import Draft, Drafts

BACKWARD = np.diag([1.0, -1.0, -1.0])
"""From axes with y up and z backward to OpenCV's."""
CAMERA_KEYS = ("active", "avg-residual", "calibrated", "id", "message", "model", "name", "point-count", "points-count", "serial",
               "video_resolution", "viewrotation")
"""Attributes of a camera. `active`, `model` and `serial` are used; `viewrotation` is named where it is not zero."""
PARTS = {"fov_video": ("left", "top", "right", "bottom"),
         "transform": ("x", "y", "z", *(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))),
         "intrinsic": ("focallength", "sensorMinU", "sensorMaxU", "sensorMinV", "sensorMaxV", "focalLengthU", "focalLengthV",
                       "centerPointU", "centerPointV", *(f"radialDistortion{n}" for n in (1, 2, 3)),
                       *(f"tangentalDistortion{n}" for n in (1, 2)))}
"""Attributes of a camera's parts; `skew` is refused unless it is zero."""
OTHER_PARTS = ("fov_marker", "fov_marker_max", "fov_video_max")


def read_qualisys(path: Path) -> Drafts:
    """Cameras of a .qca.txt file: those with a film beside it or in the recording around it, and those made for films by their model; all
    if there is neither. Raises `CalibrationError`."""
    cameras = [entry for entry in entries(path, tree_of(path), ".//cameras/camera", "serial") if entry.element.get("active", "1") != "0"]
    used = of_films(path, cameras, "model")
    if not used:
        raise CalibrationError(f"{path}: no active camera in it, expected <cameras> with a <camera> each")
    left_out = [entry.camera for entry in cameras if entry not in used]
    notes = [f"cameras for markers are left out: {', '.join(left_out)}"] if left_out else []
    turned = [entry.camera for entry in used if _is_turned(entry)]
    if turned:
        notes.append(f"the view of {', '.join(turned)} was turned in QTM: films must have been exported without turning")
    unused = tuple(key for entry in used for key in _unused(entry))
    return Drafts(tuple(map(_draft, used)), "mm", tuple(notes), unused)


def _unused(entry: Entry) -> Iterator[str]:
    """Attributes of a camera and its parts that are not used."""
    yield from entry.unknown(CAMERA_KEYS)
    yield from ["viewrotation"] if _is_turned(entry) else []
    for tag, keys in PARTS.items():
        yield from entry.child(tag).unknown(keys)
    yield from (part.tag for part in entry.element if part.tag not in (*PARTS, *OTHER_PARTS))


def _is_turned(entry: Entry) -> bool:
    return entry.element.get("viewrotation", "0") not in ("0", "")


def _draft(entry: Entry) -> Draft:
    view, lens, place = entry.child("fov_video"), entry.child("intrinsic"), entry.child("transform")
    left, top, right, bottom = (view.number(key) for key in ("left", "top", "right", "bottom"))
    fu, fv, cu, cv = (lens.number(key) / 64 for key in ("focalLengthU", "focalLengthV", "centerPointU", "centerPointV"))
    radial = [lens.number(f"radialDistortion{n}", "0") for n in (1, 2, 3)]
    tangential = [lens.number(f"tangentalDistortion{n}", "0") for n in (1, 2)]  # sic
    R = BACKWARD @ np.array([[place.number(f"r{i}{j}") for j in (1, 2, 3)] for i in (1, 2, 3)])
    centre = np.array([place.number(axis) for axis in "xyz"])
    return Draft(name=entry.camera, matrix=[[fu, 0, cu - left], [0, fv, cv - top], [0, 0, 1]],
                 distortion=[*radial[:2], *tangential, radial[2]], T=rigid(R, -R @ centre),
                 size=(right - left + 1, bottom - top + 1))
