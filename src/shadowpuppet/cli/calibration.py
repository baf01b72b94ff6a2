"""The commands about calibrations: one explained, or written as another kind; and one tested against silhouettes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from shadowpuppet.cli.flags import OTHER, AsJson, LookFlags, options_from
from shadowpuppet.errors import RecordingError, SettingsError

ForCheck = Annotated[LookFlags | None, Parameter(name="*")]
Config = Annotated[Path | None, Parameter(group=OTHER, help="File of settings, TOML, as `shadowpuppet settings` prints it.")]


def check(recording: Annotated[Path, Parameter(help="Folder with video/ and a calibration, of two cameras or more.")], /, *,
          config: Config = None, as_json: AsJson = False, flags: ForCheck = None) -> None:
    """Test a calibration against the silhouettes of a recording: which camera disagrees with the others, by how many pixels, how far it was
    turned; and by how many frames each film is late."""
    from shadowpuppet.cli.calibration_tables import check_table
    from shadowpuppet.cli.terminal import show, show_json, terminal
    from shadowpuppet.pipeline.check_calibration import check_rig
    from shadowpuppet.pipeline.rig import open_rig

    if recording.is_file() and is_explained(recording):
        raise RecordingError(f"{recording}: is a calibration, expected a recording with films to test it on; `info` explains it")
    options = options_from(flags, config)
    with terminal(quiet=as_json) as shown:
        found = check_rig(open_rig(recording, options), options, shown)
    if as_json:
        show_json(found)
    else:
        show(check_table(found))


def is_explained(path: Path) -> bool:
    """Whether `info` is asked about a calibration, not a recording."""
    from shadowpuppet.io.calibration.calibration_files import find_calibration, is_calibration

    if path.is_dir():
        made = any((path / name).exists() for name in ("video", "recording.toml"))
        return not made and (is_calibration(path) or find_calibration(path) is not None)
    return path.is_file() and is_calibration(path)


def explain(path: Path, to: Path | None, unit: str | None, up: str | None, as_json: bool) -> None:
    """Tell what a calibration says, and write it as another file where that is asked for."""
    from shadowpuppet.calibration.overview import look_at_calibration
    from shadowpuppet.cli.calibration_tables import calibration_table
    from shadowpuppet.cli.terminal import show, show_json, terminal
    from shadowpuppet.io.calibration.calibration_files import find_calibration, is_calibration, write_calibration

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
            raise SettingsError(f"flags: {name}: found {str(value)!r} for {path}, which is no calibration file; a recording has unit and "
                                "up in its recording.toml")
