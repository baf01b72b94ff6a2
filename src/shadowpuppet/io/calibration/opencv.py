"""Reads calibrations in OpenCV's YAML or XML: one camera per file, several by numbered or named keys, a stereo pair, EasyMocap's pair.

Programs use different names; keys are recognised by their beginnings: camera_matrix, K_1, M1, cameraMatrix ... Rotations and
translations are from the world to the camera. A single rotation and translation with two lenses is `stereoCalibrate`'s: from the first
camera, which is the world, to the second. EasyMocap: intri.yml has `names`, K_<name>, dist_<name> and perhaps H_, W_<name>, extri.yml
has R_<name> (a vector), Rot_<name> (a matrix), T_<name>, usually in metres.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, choices
from shadowpuppet.geometry import Array, rigid, rotation_from_vector, vector_from_rotation
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.keys import LENS_KEYS, UNIT_KEYS, is_fisheye, is_transposed, stated_unit, unknown_keys
from shadowpuppet.io.calibration.opencv_storage import read_storage
from shadowpuppet.io.calibration.programs.mc_calib import is_mc_calib, read_mc_calib

STEMS = {
    "matrix": "camera_?matrix|intrinsic_?matrix|intrinsics?|matrix|mtx|k|m",
    "distortion": "distortion_?coefficients|distortion_?coeffs|dist_?coeffs|distortions?|dist|d",
    "rotation": "rotation_?matrix|rotation_?vector|rotation|rot|rvec|rmat|r",
    "translation": "translation_?vector|translation|tvec|trans|t",
    "width": "image_?width|width|w", "height": "image_?height|height|h", "size": "image_?size|img_?size|resolution|size",
}
"""Programs' names for a camera's parameters."""
PATTERNS = {kind: re.compile(rf"({stem})(?:[_-]?(\d+)|[_-](.+))?", re.IGNORECASE) for kind, stem in STEMS.items()}
IGNORED = re.compile("names|camera_name|calibration_(time|date)|n_?frames|nr_of_frames|board_(width|height)|square_size|marker_size|flags|"
                     "(fix_)?aspect_?ratio|pattern|(avg|mean|per_view|total)_reprojection_errors?|reprojection_error|rms|"
                     "extrinsic_parameters|image_points|grid_points|E|F|Q|P[12]?|R[12]|rectification_matrix|projection_matrix|"
                     "valid_?roi.*|n_cameras", re.IGNORECASE)
"""Keys of OpenCV's, ROS' and EasyMocap's files that do not say where a camera of unrectified pictures sees a point."""
PAIR = (("intri", "extri"), ("intrinsics", "extrinsics"), ("intrinsic", "extrinsic"))
"""Names of pairs of files."""
SUFFIXES = (".yml", ".yaml", ".xml")
JARVIS = ("intrinsicMatrix", "R")
"""JARVIS' keys of K and R, which are transposed there, as in MATLAB; its T is in millimetres."""


def read_opencv(path: Path) -> Drafts:
    """Cameras of a file, a pair of files, or a folder with one file per camera. Raises `CalibrationError`."""
    if path.is_dir():
        pair = next((pair for pair in map(pair_of, sorted(path.iterdir())) if pair is not None), None)
        return read_opencv(pair[0]) if pair is not None else _one_a_file(path)
    pair = pair_of(path)
    values: dict[str, Any] = {}
    for file in pair or [path]:
        values |= read_storage(file)
    return _drafts(path, values, path.stem if pair is None else "cam")


def pair_of(path: Path) -> tuple[Path, Path] | None:
    """The pair of files, intrinsics and extrinsics, to which a file belongs; None if it has no partner."""
    for names in PAIR:
        if path.stem in names and path.suffix.lower() in SUFFIXES:
            files = path.with_stem(names[0]), path.with_stem(names[1])
            return files if all(file.is_file() for file in files) else None
    return None


def files_of(folder: Path) -> list[Path]:
    """Files of a folder with an ending of `SUFFIXES`."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file() and path.name[0] != ".")


def _one_a_file(folder: Path) -> Drafts:
    files = files_of(folder)
    found = [_drafts(file, read_storage(file), file.stem) for file in files]
    for file, each in zip(files, found):
        if len(each.drafts) != 1:
            raise CalibrationError(f"{file}: found {len(each.drafts)} cameras, expected one, as there are several files in {folder}")
    units = {each.unit for each in found}
    if len(units) > 1:
        raise CalibrationError(f"{folder}: found lengths in {choices(unit or 'an unknown unit' for unit in units)}, expected one unit")
    return Drafts(tuple(each.drafts[0] for each in found), units.pop() if units else None,
                  tuple(note for each in found for note in each.notes), tuple(key for each in found for key in each.unused))


def _drafts(path: Path, values: dict[str, Any], alone: str) -> Drafts:
    """Cameras from entries whose keys end in the camera's name; `alone`: name of a camera without such endings."""
    try:
        if is_mc_calib(values):
            return read_mc_calib(values)
        jarvis, fisheye, unit = _is_jarvis(values), is_fisheye("", values), stated_unit("", [values])
        cameras = _grouped(values | {key: values[key].T for key in JARVIS} if jarvis else values)
        lenses = {end: parts for end, parts in cameras.items() if "matrix" in parts}
        theirs = [key for key, value in values.items() if (found := _parameter(key, value)) is not None and found[0] in ("", *lenses)]
        unused = tuple(unknown_keys("", values, (*theirs, IGNORED, LENS_KEYS, UNIT_KEYS)))
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None
    if not lenses:
        raise CalibrationError(f"{path}: no camera matrix in it, expected camera_matrix, or K_<camera> for each; found "
                               f"{choices(values)[:200]}")
    shared = cameras.get("", {})
    if len(lenses) == 2 and "" not in lenses and not any("rotation" in parts for parts in lenses.values()) and "rotation" in shared:
        first, second = sorted(lenses)
        lenses[first] |= {"rotation": np.eye(3), "translation": np.zeros(3)}
        lenses[second] |= {"rotation": shared["rotation"], "translation": shared.get("translation")}
    for parts in lenses.values():
        parts.update({key: shared[key] for key in ("width", "height", "size") if key in shared and key not in parts})
    bare = [end or alone for end, parts in lenses.items() if "rotation" not in parts]
    if bare and len(lenses) > 1:
        raise CalibrationError(f"{path}: no rotation of {choices(bare)}, expected R and T (or rvec and tvec) of every camera; EasyMocap "
                               "has them in extri.yml beside intri.yml")
    notes = [f"{path.name} states the lens alone: the camera is taken for level, at the world's origin"] if bare else []
    named = values.get("camera_name") if len(lenses) == 1 and isinstance(values.get("camera_name"), str) else None
    drafts = tuple(_draft(path, named or end or alone, parts, fisheye) for end, parts in lenses.items())
    return Drafts(drafts, unit or ("mm" if jarvis else None), tuple(notes), unused)


def _is_jarvis(values: dict[str, Any]) -> bool:
    matrix, R = (values.get(key) for key in JARVIS)
    square = all(isinstance(value, np.ndarray) and value.shape == (3, 3) for value in (matrix, R))
    return square and is_transposed(np.asarray(matrix))


def _grouped(values: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The parameters of each camera, by the endings of the keys."""
    cameras: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        if value is None or (key in ("R1", "R2") and "P1" in values):  # stereoRectify's, which are no extrinsics
            continue
        if (found := _parameter(key, value)) is not None:
            cameras.setdefault(found[0], {}).setdefault(found[1], value)
    return cameras


def _parameter(key: str, value: object) -> tuple[str, str] | None:
    """The camera's ending and the kind (of `STEMS`) of the parameter that a key names; None if it names none."""
    for kind, pattern in PATTERNS.items():
        match = pattern.fullmatch(key)
        if match is not None and (kind not in ("width", "height") or isinstance(value, float)):
            return match[2] or match[3] or "", kind
    return None


def _draft(path: Path, name: str, parts: dict[str, Any], fisheye: bool) -> Draft:
    def numbers(kind: str, counts: Sequence[int]) -> Array:
        try:
            value = np.asarray(parts[kind], float)
        except (TypeError, ValueError):
            value = np.zeros(0)
        if value.size not in counts:
            raise CalibrationError(f"{path}: camera {name!r}: {kind}: found {str(parts[kind])[:80]!r}, expected "
                                   f"{' or '.join(map(str, counts))} finite numbers")
        return value.ravel()

    matrix = numbers("matrix", (9,)).reshape(3, 3)
    lens = numbers("distortion", (0, 1, 2, 3, 4, 5, 8, 12, 14)) if parts.get("distortion") is not None else np.zeros(0)
    size = numbers("size", (2,)) if "size" in parts else None
    if size is None and {"width", "height"} <= set(parts):
        size = np.concatenate([numbers("width", (1,)), numbers("height", (1,))])
    if "rotation" not in parts:
        return Draft(name, matrix, lens, None, None if size is None else size.tolist(), fisheye, False)
    if parts.get("translation") is None:
        raise CalibrationError(f"{path}: camera {name!r}: found a rotation without a translation, expected T (or tvec) too")
    R = numbers("rotation", (3, 9))
    R = R.reshape(3, 3) if R.size == 9 else rotation_from_vector(R)
    T = rigid(R, numbers("translation", (3,)))
    return Draft(name, matrix, lens, T, None if size is None else size.tolist(), fisheye)


def easymocap_texts(cameras: Sequence[Camera]) -> tuple[str, str]:
    """Contents of EasyMocap's intri.yml and extri.yml; metres. Raises `CalibrationError` for what these cannot hold."""
    for camera in cameras:
        if camera.fisheye:
            raise CalibrationError(f"camera {camera.name!r} is a fisheye, which EasyMocap's files have no place for; write TOML")
        if not re.fullmatch(r"[A-Za-z0-9_-]+", camera.name):
            raise CalibrationError(f"camera {camera.name!r}: OpenCV's files take letters, digits, - and _ in names; rename it, or write "
                                   "TOML")
    head = "%YAML:1.0\n---\nnames:\n" + "".join(f'  - "{camera.name}"\n' for camera in cameras)
    intri, extri = [head], [head]
    for camera in cameras:
        lens, T = camera.distortion, camera.T_camera_world
        intri += [_entry(f"K_{camera.name}", camera.matrix), _entry(f"dist_{camera.name}", (lens if lens[5:].any() else lens[:5])[None]),
                  f"H_{camera.name}: {camera.size[1]}\nW_{camera.name}: {camera.size[0]}\n"]
        extri += [_entry(f"R_{camera.name}", vector_from_rotation(T[:3, :3])[:, None]), _entry(f"Rot_{camera.name}", T[:3, :3]),
                  _entry(f"T_{camera.name}", T[:3, 3:])]
    return "".join(intri), "".join(extri)


def _entry(key: str, values: Array) -> str:
    rows, cols = values.shape
    data = ", ".join(map(repr, values.ravel().tolist()))
    return f"{key}: !!opencv-matrix\n  rows: {rows}\n  cols: {cols}\n  dt: d\n  data: [{data}]\n"
