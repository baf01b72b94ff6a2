"""The commands about calibrations: one explained, or written as another kind; and one tested against silhouettes."""

from __future__ import annotations

from pathlib import Path

from shadowpuppet.errors import SettingsError


def is_explained(path: Path) -> bool:
    """Whether `info` is asked about a calibration, not a recording."""
    from shadowpuppet.io.calibration import find_calibration, is_calibration

    if path.is_dir():
        made = any((path / name).exists() for name in ("video", "recording.toml"))
        return not made and (is_calibration(path) or find_calibration(path) is not None)
    return path.is_file() and is_calibration(path)


def explain(path: Path, to: Path | None, unit: str | None, up: str | None, as_json: bool) -> None:
    """Tell what a calibration says, and write it as another file where that is asked for."""
    from shadowpuppet.calibration_tables import calibration_table
    from shadowpuppet.io.calibration import find_calibration, is_calibration, write_calibration
    from shadowpuppet.standing import look_at_calibration
    from shadowpuppet.terminal import show, show_json, terminal

    with terminal(quiet=as_json) as shown:
        path = path if is_calibration(path) else find_calibration(path) or path
        look, found = look_at_calibration(path, unit, up)
        if to is not None:
            write_calibration(to, found.cameras)
        if as_json:
            show_json(look)
        else:
            show(calibration_table(look), *([f"written: {to}, in metres"] if to is not None else []))
        for doubt in look.doubts:
            shown.warn(doubt)


def refuse_for_recordings(path: Path, to: Path | None, unit: str | None, up: str | None) -> None:
    """Raise `SettingsError` for flags that serve calibrations only."""
    for name, value in (("to", to), ("unit", unit), ("up", up)):
        if value is not None:
            raise SettingsError(f"flags: {name}: found {str(value)!r} for {path}, which is no calibration file; a recording has unit and up in "
                                "its recording.toml")
