"""Reads calibration files of all formats as cameras in metres, Z up, and writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, ShadowPuppetError, printable, reason, warn
from shadowpuppet.geometry import Array, inverse, rigid
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.formats import ROUGH, format_of
from shadowpuppet.io.calibration.keys import is_transposed
from shadowpuppet.io.calibration.opencv import SUFFIXES, easymocap_texts
from shadowpuppet.io.calibration.pose2sim import check_name, tables_text
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Units of length in metres."""
UPS = {"z": (0, 0, 1), "y": (0, 1, 0), "x": (1, 0, 0), "-z": (0, 0, -1), "-y": (0, -1, 0), "-x": (-1, 0, 0), "cameras": None}
"""Possible up directions in a file's world; `cameras`: the up direction in the pictures."""
MAX_DISTANCE = 100.0
"""Greatest distance of a camera from the origin, metres; if it is greater, lengths are probably millimetres."""
LEAST_MILLIMETRES = 1000.0
"""From there on; if it is less, probably centimetres: rooms are some metres large."""
SIZES = ((640, 480), (848, 480), (800, 600), (1024, 768), (1280, 720), (1280, 960), (1280, 1024), (1440, 1080), (1600, 1200), (1920, 1080),
         (1920, 1200), (2048, 1536), (2704, 1520), (2560, 1440), (3840, 2160), (4096, 2160))
"""Common picture sizes; a camera without a size gets the one nearest to twice its principal point."""
SIZE_TOLERANCE = 0.08
"""Largest relative difference to one of `SIZES`."""
MIN_SPREAD, MIN_AGREEMENT = 0.02, 0.8
"""For `_level`: least second eigenvalue of the directions of rows, and cosine between their normal and the mean up direction."""


@dataclass(frozen=True)
class Calibration:
    """A calibration's cameras, and how it was read."""

    path: Path
    format: str
    cameras: tuple[Camera, ...]
    """Cameras in metres, Z up if known."""
    unit: str
    """Unit of the file: m, cm or mm."""
    unit_known: bool
    """Whether the file, its format or the user states the unit; else metres are assumed."""
    notes: tuple[str, ...]
    """Remarks for the user, a sentence each."""
    turns: tuple[int, ...] = ()
    """Quarter turns clockwise by which each camera's pictures stand upright; empty if the file says nothing of it."""
    unused: str = ""
    """A sentence about keys of the file that are not used; empty if there are none."""

    @property
    def shown(self) -> tuple[Camera, ...]:
        """The cameras turned about their axes so that their pictures stand upright: for directions only, not to project."""
        return _turned(self.cameras, self.turns)


def read_calibration(path: str | Path, *, unit: str | None = None, up: str | None = None,
                     sizes: Callable[[str], tuple[int, int] | None] | None = None, places: bool = True) -> tuple[Camera, ...]:
    """Cameras of a calibration file or folder, in its order: metres, X_camera = R X_world + t, OpenCV's lens.

    Formats, recognised by content: JSON with K, R and t a camera, COLMAP's text, TOML of Pose2Sim, Anipose, FreeMoCap and Caliscope (its
    own and its export), OpenCV's YAML and XML, EasyMocap's pair, JARVIS, MC-Calib, multical, transforms.json, Kalibr's camera chain, KRT,
    BioCV's .calib, Qualisys' .qca.txt, Vicon's .xcp. Warns of keys that are not known. Raises `CalibrationError` with the file, camera and
    field if something is missing or impossible.

    Args:
        path: the file or folder.
        unit: unit of lengths (m, cm, mm), for files that do not state it.
        up: direction of the file's world that is up, of `UPS`.
        sizes: width and height of a camera's pictures by its name, for files without sizes.
        places: whether several cameras without places are refused; False where only lenses are needed.
    """
    found = examine_calibration(path, unit, up, sizes, places)
    if found.unused:
        warn(found.unused)
    return found.cameras


@np.errstate(all="ignore")  # impossible numbers are refused where they are checked
def examine_calibration(path: str | Path, unit: str | None = None, up: str | None = None,
              sizes: Callable[[str], tuple[int, int] | None] | None = None, places: bool = True) -> Calibration:
    """As `read_calibration`; also returns format, unit and remarks."""
    path = Path(path)
    for what, value, known in (("unit", unit, UNITS), ("up", up, UPS)):
        if value is not None and value not in known:
            raise CalibrationError(f"{path}: {what}: found {value!r}, expected one of {', '.join(known)}")
    kind = format_of(path)
    if kind is ROUGH:  # metres and z up always: what a recording states is its calibration's
        unit = up = None
    found = kind.read(path)
    if places:
        _check_places(path, found)
    used, notes = unit or found.unit or "m", list(found.notes)
    cameras: dict[str, Camera] = {}
    for draft in found.drafts:
        try:
            camera = _camera(draft, UNITS[used], sizes, notes)
            if camera.name in cameras:
                raise CalibrationError(f"name: found {camera.name!r}, which another section has; every camera needs its own")
        except CalibrationError as error:
            where = draft.where or f"camera {draft.name!r}: "
            raise CalibrationError(f"{path}: {'' if str(error).startswith(where) else where}{error}") from None
        cameras[camera.name] = camera
    made, turns = tuple(cameras.values()), tuple(draft.turns for draft in found.drafts)
    unused = f"{path}: stated there but not used: {shorten(dict.fromkeys(map(printable, found.unused)))}" if found.unused else ""
    upright = rotated_up(made, up, _turned(made, turns)) if up else made
    return Calibration(path, kind.name, upright, used, bool(unit or found.unit), (*notes, *([unused] if unused else [])), turns, unused)


def _check_places(path: Path, found: Drafts) -> None:
    """Raise `CalibrationError` for several cameras if one has no place."""
    bare = [draft.name for draft in found.drafts if draft.T is None]
    if bare and len(found.drafts) > 1:
        unused = f"; stated there but not used: {shorten(dict.fromkeys(map(printable, found.unused)))}" if found.unused else ""
        raise CalibrationError(f"{path}: found lenses without places of {shorten(bare)}, expected R and t (or the like) of every camera, "
                               f"as there are {len(found.drafts)}{unused}")


def _turned(cameras: tuple[Camera, ...], turns: tuple[int, ...]) -> tuple[Camera, ...]:
    """The cameras turned about their axes by quarter turns of their pictures, clockwise."""
    if not any(turns):
        return cameras
    quarter = rigid(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.zeros(3))
    return tuple(replace(camera, T_camera_world=np.linalg.matrix_power(quarter, n % 4) @ camera.T_camera_world)
                 for camera, n in zip(cameras, turns, strict=True))


def _camera(draft: Draft, metres: float, sizes: Callable[[str], tuple[int, int] | None] | None, notes: list[str]) -> Camera:
    check_name(draft.name)
    T = draft.T if draft.T is not None else Camera.from_fov((2, 2), 1.0).T_camera_world
    distance = float(np.linalg.norm(T[:3, 3])) * metres
    if not distance <= MAX_DISTANCE:
        unit, name = ("cm", "centimetres") if distance < LEAST_MILLIMETRES else ("mm", "millimetres")
        raise CalibrationError(f"translation: found {T[:3, 3].tolist()}, {distance:g} long, expected at most {MAX_DISTANCE:g} "
                               f"metres; it is probably in {name}: say so by unit = \"{unit}\" in recording.toml, or write it in metres, "
                               f"with `shadowpuppet info FILE --unit {unit} --to NEW.toml`")
    _check_transposed(draft)
    size = draft.size or (sizes(draft.name) if sizes is not None else None) or _guessed(draft, notes)
    matrix = Camera.from_fov((int(size[0]), int(size[1])), draft.fov).matrix if draft.fov is not None else np.asarray(draft.matrix)
    lens = np.ravel(np.asarray(draft.distortion, float))
    if not draft.fisheye:
        lens = lens[:8] if lens.size > 8 and not lens[8:].any() else lens
        lens = np.pad(lens, (0, 4 - lens.size)) if draft.where[:1] != "[" and 0 < lens.size < 4 else lens
    scaled = rigid(T[:3, :3], T[:3, 3] * metres)
    return Camera(draft.name, (size[0], size[1]), matrix, lens, scaled, draft.fisheye, draft.oriented)  # pyright: ignore[reportArgumentType]


def _check_transposed(draft: Draft) -> None:
    matrix = None if draft.matrix is None else np.asarray(draft.matrix, float)
    if matrix is not None and matrix.shape == (3, 3) and is_transposed(matrix):
        raise CalibrationError(f"matrix: found a last row of {matrix[2].tolist()}, expected 0 0 1: the matrix is transposed, as MATLAB's "
                               "are; transpose it, and the rotation, which is probably transposed too")


def _guessed(draft: Draft, notes: list[str]) -> tuple[float, float]:
    """Guess the size (width, height) of a camera's pictures as twice the principal point, or the nearest of `SIZES`; adds a note."""
    if draft.fov is not None:
        raise CalibrationError("size: missing, expected the pictures' width and height in pixels, such as size = [1920, 1080]; in a "
                               "recording the films state it")
    twice = 2 * np.asarray(draft.matrix, float)[:2, 2] + 1
    if not (np.isfinite(twice).all() and (twice >= 2).all() and (twice < 1e5).all()):
        raise CalibrationError(f"found no picture size, and a principal point of {((twice - 1) / 2).tolist()}, expected one in the picture")
    known = [size for wide, high in SIZES for size in ((wide, high), (high, wide))]
    off = np.abs(np.array(known) / twice - 1).max(1)
    best = int(off.argmin())
    size: tuple[float, float] = known[best] if off[best] < SIZE_TOLERANCE else (round(float(twice[0])), round(float(twice[1])))
    notes.append(f"camera {draft.name!r}: no picture size in the file: taken for {size[0]} x {size[1]}, by the principal point")
    return size


def rotated_up(cameras: tuple[Camera, ...], up: str, shown: tuple[Camera, ...] | None = None) -> tuple[Camera, ...]:
    """The cameras after a rotation of the world that brings its direction `up` (of `UPS`) to Z; `shown`: the cameras turned so that their
    pictures stand upright, if they do not."""
    direction = UPS[up]
    if direction is None:
        direction = _level(shown or cameras)
    turn = _turn_to_z(np.asarray(direction, float))
    return tuple(replace(camera, T_camera_world=camera.T_camera_world @ inverse(turn)) for camera in cameras)


def _level(cameras: tuple[Camera, ...]) -> Array:
    """The up direction (3,) for cameras without roll: the normal to the rows of all pictures, which does not depend on the tilt.

    If the rows are parallel, or the normal disagrees with the pictures' mean up direction, the mean is returned.
    """
    mean = -np.mean([camera.T_camera_world[1, :3] for camera in cameras], 0)
    rows = np.array([camera.T_camera_world[0, :3] for camera in cameras])
    sizes, axes = np.linalg.eigh(rows.T @ rows / len(rows))
    up = axes[:, 0] * np.sign(axes[:, 0] @ mean)
    return up if sizes[1] > MIN_SPREAD and up @ mean > MIN_AGREEMENT * np.linalg.norm(mean) else mean


def _turn_to_z(direction: Array) -> Array:
    """The smallest rotation (4, 4) that brings a direction (3,) to Z."""
    length = float(np.linalg.norm(direction))
    d = direction / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])
    v, c = np.cross(d, (0, 0, 1)), d[2]
    if c < -1 + 1e-9:
        return rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return rigid(np.eye(3) + K + K @ K / (1 + c), np.zeros(3))


def write_calibration(path: str | Path, cameras: Iterable[Camera]) -> None:
    """Write cameras for `read_calibration`, in metres: TOML for Pose2Sim and Anipose; into a folder, or for intri.yml or extri.yml,
    EasyMocap's two files.

    Raises `CalibrationError` if they cannot be written.
    """
    path, made = Path(path), list(cameras)
    names = [camera.name for camera in made]
    for name in names:
        check_name(name)
        if names.count(name) > 1:
            raise CalibrationError(f"{path}: two cameras are called {name!r}; every camera needs its own name")
    whole = {path: lambda: tables_text(made)}
    if path.suffix.lower() in SUFFIXES or path.is_dir() or not path.suffix:
        if path.suffix and path.name not in ("intri.yml", "extri.yml"):
            raise CalibrationError(f"{path}: expected NAME.toml, or intri.yml or a folder for EasyMocap's two files")
        folder = path.parent if path.suffix else path
        whole = {folder / f"{stem}.yml": lambda n=n: easymocap_texts(made)[n] for n, stem in enumerate(("intri", "extri"))}
    try:
        texts = {file: text() for file, text in whole.items()}
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None
    try:
        for file, text in texts.items():
            if not path.suffix:
                file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(file, text)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be written ({reason(error)})") from None
    except ShadowPuppetError as error:
        raise CalibrationError(str(error)) from None
