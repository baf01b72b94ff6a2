"""What a calibration session leaves in its folder: the calibration, the old one kept, and the page about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

from shadowpuppet.calibration.session import Calibrated
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, reason
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole


def write_results(found: Calibrated, path: Path, page: Callable[[Calibrated], str] | None) -> list[Path]:
    """Write the calibration to `path` (.toml), and what `page` makes of it beside it (.html); returns the files written. A calibration
    that is there is kept under another name. Raises `ShadowPuppetError` if a file cannot be written."""
    if path.suffix.lower() != ".toml":
        raise CalibrationError(f"{path}: found the ending {path.suffix!r}, expected .toml; `shadowpuppet info FILE --to` writes other "
                               "formats")
    written = replace_calibration(path, found.cameras)
    if page is not None:
        beside = path.with_suffix(".html")
        write_whole(beside, page(found))
        written.append(beside)
    return written


def replace_calibration(path: Path, cameras: Sequence[Camera]) -> list[Path]:
    """Write a calibration (.toml), and keep one that is there under another name; returns the files written. Raises `CalibrationError`."""
    kept = keep_old(path)
    write_calibration(path, cameras)
    return [path, *([kept] if kept is not None else [])]


def keep_old(path: Path) -> Path | None:
    """Copy a file to NAME.before1, .before2, ... beside it, before its ending; returns the copy, None if there is no file. Raises
    `CalibrationError`."""
    if not path.exists():
        return None
    places = (path.with_name(f"{path.stem}.before{n}{path.suffix}") for n in count(1))
    place = next(place for place in places if not place.exists())
    try:
        write_whole(place, path.read_bytes())
    except OSError as error:
        raise CalibrationError(f"{place}: cannot be written ({reason(error)})") from None
    return place
