"""Formats of calibration files: which one a file has, and which file of a folder is the calibration."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from shadowpuppet.errors import CalibrationError, check_regular, choices, reason
from shadowpuppet.io.calibration.colmap import is_colmap, read_colmap
from shadowpuppet.io.calibration.draft import Drafts
from shadowpuppet.io.calibration.json_cameras import mentions_cameras, read_json
from shadowpuppet.io.calibration.kalibr import CAMERA, read_kalibr
from shadowpuppet.io.calibration.number_blocks import read_biocv, read_krt
from shadowpuppet.io.calibration.opencv import SUFFIXES, files_of, pair_of, read_opencv
from shadowpuppet.io.calibration.pose2sim import read_tables
from shadowpuppet.io.calibration.qualisys import read_qualisys
from shadowpuppet.io.calibration.rough import ROUGH_NAME, is_rough, read_rough
from shadowpuppet.io.calibration.vicon import read_vicon
from shadowpuppet.io.files.text import encoding_of
from shadowpuppet.removed import FILES

ENDINGS = (".toml", ".json", ".yml", ".yaml", ".xml", ".xcp", ".txt", ".cal", ".calib", ".krt", ".pickle", ".pkl")
"""Endings of files that may be calibrations."""
NO_CALIBRATIONS = ("recording.toml", "spec.toml", "person.toml", "run.toml", "Config.toml", "sessionMetadata.yaml")
"""Names of files with such endings that are no calibrations."""
ONE_A_FILE = (".cal", ".calib", *SUFFIXES)
"""Endings of calibration files that may come one per camera."""
HEAD_BYTES = 4096
"""Number of bytes from which a format is recognised."""


class Format(NamedTuple):
    """A format of calibration files."""

    name: str
    """Name in messages."""
    fits: Callable[[Path, str], bool]
    """Whether a file has this format, given its path and the beginning of its text."""
    read: Callable[[Path], Drafts]


def _ends(path: Path, *endings: str) -> bool:
    return path.suffix.lower() in endings


QUALISYS_TAGS = re.compile(r"<calibration[\s>].*<cameras?[\s>]", re.DOTALL)
"""OpenCV's files have tags that begin so: `<calibration_time>`, `<camera_matrix>`."""
QUALISYS = Format("Qualisys (.qca.txt)", lambda path, text: QUALISYS_TAGS.search(text) is not None, read_qualisys)
VICON = Format("Vicon (.xcp)", lambda path, text: "<Cameras" in text or _ends(path, ".xcp"), read_vicon)
EASYMOCAP = Format("EasyMocap (intri.yml, extri.yml)",
                   lambda path, text: path.stem in ("intri", "extri") and _ends(path, *SUFFIXES), read_opencv)
OPENCV = Format("OpenCV (YAML, XML)",
                lambda path, text: _ends(path, *SUFFIXES) or "<opencv_storage" in text or "!!opencv-matrix" in text, read_opencv)
TABLES = Format("TOML (Pose2Sim, Anipose, FreeMoCap, Caliscope)",
                lambda path, text: _ends(path, ".toml") or all(f"\n{key}" in f"\n{text}" for key in ("matrix", "distortions")), read_tables)
ROUGH = Format("rough places (TOML with at, toward, fov)", lambda path, text: path.name == ROUGH_NAME or is_rough(text), read_rough)
COLMAP = Format("COLMAP (cameras.txt, images.txt)", lambda path, text: is_colmap(path), read_colmap)
JSON = Format("JSON", lambda path, text: _ends(path, ".json"), read_json)
KALIBR = Format("Kalibr (camchain.yaml)", lambda path, text: CAMERA.search(text) is not None and "camera_model" in text, read_kalibr)
BIOCV = Format("BioCV (.calib)", lambda path, text: _ends(path, ".calib"), read_biocv)
KRT = Format("KRT", lambda path, text: path.stem.upper() == "KRT" or _ends(path, ".krt"), read_krt)
FORMATS = (JSON, COLMAP, QUALISYS, VICON, EASYMOCAP, KALIBR, OPENCV, BIOCV, KRT, ROUGH, TABLES)
"""All formats, in the order in which they are tried."""


def format_of(path: Path) -> Format:
    """The format of a file or folder. Raises `CalibrationError` if it is none of `FORMATS`."""
    kinds = (path.suffix.lower(), *({file.suffix.lower() for file in path.iterdir()} & {".cal"} if path.is_dir() else ()))
    for kind in kinds:
        if kind in FILES:
            raise CalibrationError(f"{path}: {FILES[kind]}")
    if path.is_dir():
        if any(path.glob("*.calib")):
            return BIOCV
        if is_colmap(path):
            return COLMAP
        if not files_of(path):
            raise CalibrationError(f"{path}: is a directory, and no calibration is in it that takes a whole one, expected a file, a folder "
                                   "with EasyMocap's intri.yml and extri.yml, or one with a .calib or OpenCV file a camera")
        return EASYMOCAP if any(file.stem in ("intri", "extri") for file in files_of(path)) else OPENCV
    try:
        check_regular(path)
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read ({reason(error)})") from None
    if path.suffix.lower() in (".pickle", ".pkl") or (head[:1] == b"\x80" and head[1:2] in b"\2\3\4\5"):
        raise CalibrationError(f"{path}: is a pickle, as OpenCap saves calibrations: reading one runs any program that is in it, so it is "
                               "not opened here; where you trust it, Pose2Sim makes TOML of it (calibration type convert, from opencap)")
    text = head.decode(encoding_of(head) or "utf-8", "replace")
    kind = next((kind for kind in FORMATS if kind.fits(path, text)), None)
    if kind is None:
        raise CalibrationError(f"{path}: found no calibration in it that is known, expected one of: {'; '.join(f.name for f in FORMATS)}")
    return kind


def is_calibration(path: Path) -> bool:
    """Whether a file or folder is a calibration, by its beginning; reading it may still fail."""
    try:
        kind = format_of(path)
    except CalibrationError:
        return path.suffix.lower() in (".pickle", ".pkl", ".cal")
    if kind is JSON:
        return mentions_cameras(path)
    if path.is_file() and kind is TABLES:
        with path.open("rb") as file:
            return b"matrix" in file.read(HEAD_BYTES).replace(b"\0", b"")
    return True


def find_calibration(folder: Path) -> Path | None:
    """The calibration in a recording folder, or in its folder `calibration`; None if there is none, or only rough places. calibration.toml
    is preferred.

    Raises `CalibrationError` if there are several.
    """
    if (folder / "calibration.toml").exists():
        return folder / "calibration.toml"
    for place in (folder, folder / "calibration", folder / "Calibration"):
        if not place.is_dir():
            continue
        files = [path for path in sorted(place.iterdir()) if path.is_file() and path.suffix.lower() in ENDINGS and path.name[0] != "."
                 and path.name not in NO_CALIBRATIONS and is_calibration(path) and format_of(path) is not ROUGH]
        whole = {place if _in_pieces(path, files) else path for path in files}
        if len(whole) > 1:
            raise CalibrationError(f"{place}: found several calibrations ({choices(path.name for path in files)}); say in recording.toml "
                                   f"which counts, as calibration = \"{files[0].name}\"")
        if whole:
            return whole.pop()
    return None


def _in_pieces(path: Path, files: list[Path]) -> bool:
    """Whether a file is only a part of its folder's calibration."""
    if is_colmap(path):
        return True
    alike = [other for other in files if other.suffix == path.suffix]
    return pair_of(path) is not None or (len(alike) > 1 and len(alike) == len(files) and path.suffix.lower() in ONE_A_FILE)
