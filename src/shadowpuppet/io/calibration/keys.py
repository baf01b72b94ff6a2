"""Keys of calibration files: a reader names those that it does not know, and refuses those that may change where a point is seen."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from shadowpuppet.errors import CalibrationError, shown
from shadowpuppet.geometry import Array

TELLING = re.compile("fish|equidist|omnidir|kannala|rotat|distort|(camera|lens)_?model|projection_?(model|type)|units?$|^unit|scale|"
                     "ax[ei]s|transpos|invers|invert|flip|mirror|handed|convention|coordinate|skew", re.IGNORECASE)
"""Names of keys that may change where a point is seen; one that is not known is refused."""
NEUTRAL = ("", "none", "no", "false", "off", "0")
"""Values by which such a key states nothing."""
LENS_KEYS = re.compile("(is_?)?fish_?eye(_?model)?|(camera|lens|distortion|projection)_?(model|type)|projection", re.IGNORECASE)
"""Keys that name the model of the lens."""
MODEL_KEYS = re.compile("model|lens|type", re.IGNORECASE)
"""Keys that may name the model of the lens, or the product."""
FISHEYES = ("fisheye", "equidistant", "opencvfisheye", "kannalabrandt", "kannalabrandt4", "kb", "kb4")
PINHOLES = ("pinhole", "standard", "radtan", "plumbbob", "brown", "brownconrady", "rational", "rationalpolynomial", "opencv", "fullopencv",
            "simplepinhole", "simpleradial", "radial", "perspective", "rectilinear", *NEUTRAL)
"""Models of lenses by name, without capitals, blanks and dashes."""
UNIT_KEYS = re.compile("((length|translation|world|distance)_?)?units?", re.IGNORECASE)
UNIT_NAMES = {"m": ("m", "meter", "meters", "metre", "metres"), "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres"),
              "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres")}  # fmt: skip


def unknown_keys(where: str, table: Mapping[str, object], known: Iterable[str | re.Pattern[str]]) -> Iterator[str]:
    """The keys of a table that are not `known` (names or patterns) and not `TELLING`, for `Drafts.unused`.

    Raises `CalibrationError`, which begins with `where`, for one that is `TELLING` and states something.
    """
    rules = tuple(known)
    names = {rule for rule in rules if isinstance(rule, str)}
    patterns = [rule for rule in rules if isinstance(rule, re.Pattern)]
    for key, value in table.items():
        if key in names or any(pattern.fullmatch(key) for pattern in patterns):
            continue
        if not TELLING.search(key):
            yield key
        elif not _is_neutral(value):
            raise CalibrationError(f"{where}{key}: found {shown(value)[:80]}, which is not known here and may change where points are "
                                   "seen; take it out if it does not, or convert the file")


def _is_neutral(value: object) -> bool:
    if isinstance(value, str):
        return value.strip().lower() in NEUTRAL
    if isinstance(value, dict | list):
        return not value
    return value is None or (isinstance(value, bool | int | float) and value == 0)


def is_fisheye(where: str, table: Mapping[str, object]) -> bool:
    """Whether a camera has OpenCV's fisheye lens, by its keys `fisheye`, `camera_model`, `distortion_model` and the like.

    Raises `CalibrationError`, which begins with `where`, for a model that is not known, or two keys that contradict each other.
    """
    found: dict[str, bool] = {}
    for key, value in table.items():
        if LENS_KEYS.fullmatch(key) and (fisheye := _lens_named(where, key, value)) is not None:
            found[key] = fisheye
        elif MODEL_KEYS.fullmatch(key) and isinstance(value, str) and _plain(value) in FISHEYES:
            found[key] = True
    flags = {key: fisheye for key, fisheye in found.items() if "fish" in key.lower()}
    if False in flags.values() and True in found.values():
        raise CalibrationError(f"{where}{' and '.join(found)}: found {' and '.join(shown(table[key]) for key in found)}, expected one "
                               "model of the lens")
    return any(found.values())


def _lens_named(where: str, key: str, value: object) -> bool | None:
    """Whether a key's value is a fisheye; None for nothing."""
    if value is None:
        return None
    flag = "fish" in key.lower()
    if flag and isinstance(value, bool | int | float) and value in (0, 1):
        return bool(value)
    word = _plain(value) if isinstance(value, str) else None
    if word in FISHEYES or (flag and word in ("true", "yes", "1")):
        return True
    if word in PINHOLES:
        return False
    possible = "true or false" if flag else "pinhole, opencv, fisheye or equidistant, by these or similar names"
    raise CalibrationError(f"{where}{key}: found {shown(value)[:80]}, expected {possible}")


def _plain(word: str) -> str:
    return re.sub(r"[\s_-]", "", word).lower()


def stated_unit(where: str, tables: Iterable[Mapping[str, object]]) -> str | None:
    """The unit of lengths (m, cm, mm) that keys such as `units` state; None if none does.

    Raises `CalibrationError`, which begins with `where`, for another unit, or two of them.
    """
    found: dict[str, str] = {}
    for table in tables:
        for key, value in table.items():
            if not UNIT_KEYS.fullmatch(key) or _is_neutral(value):
                continue
            unit = next((unit for unit, names in UNIT_NAMES.items() if str(value).strip().lower() in names), None)
            if unit is None or (found and unit not in found):
                raise CalibrationError(f"{where}{key}: found {shown(value)[:80]}, expected one of {', '.join(UNIT_NAMES)} for all")
            found[unit] = key
    return next(iter(found), None)


def is_transposed(matrix: Array) -> bool:
    """Whether an intrinsic matrix (3, 3) has its principal point in the last row, as MATLAB's have."""
    return bool(abs(matrix[:2, 2]).max() < 1e-9 and abs(matrix[2, :2]).max() > 1e-9 and matrix[2, 2] == 1)
