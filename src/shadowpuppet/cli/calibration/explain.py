"""A calibration explained in words, a table and a top view, or converted: for `info`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from shadowpuppet.cli.tables import pairs, show, show_json, table
from shadowpuppet.errors import RecordingError, SettingsError, choices

if TYPE_CHECKING:
    from shadowpuppet.calibration.overview import CalibrationLook, CameraPlacement

ARROWS = "→↗↑↖←↙↓↘"
"""Arrows by viewing direction, in eighths of a turn counter-clockwise from +x."""
UNREADABLE = (".abc", ".asf", ".blend", ".dae", ".fbx", ".glb", ".gltf", ".md", ".mot", ".osim", ".sto", ".tsv", ".usd", ".usda",
              ".usdc", ".usdz", ".vsk", ".xls", ".xlsx")
"""Endings of files about motion and cameras that are not read."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
"""Names of cameras in the top view; + for any further."""


def is_explained(path: Path) -> bool:
    """Whether `path` is a calibration, not a recording."""
    from shadowpuppet.io.calibration.formats import find_calibration, is_calibration
    from shadowpuppet.io.recording import is_recording, is_run

    if path.is_dir():
        return not (is_recording(path) or is_run(path)) and (is_calibration(path) or find_calibration(path) is not None)
    return path.is_file() and is_calibration(path)


def explain(path: Path, to: Path | None, unit: str | None, up: str | None, as_json: bool) -> None:
    """Explain a calibration, and write it to `to`."""
    from shadowpuppet.calibration.overview import look_at_calibration
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.io.calibration.calibration_files import write_calibration
    from shadowpuppet.io.calibration.formats import find_calibration, is_calibration

    with terminal(quiet=as_json) as listener:
        path = path if is_calibration(path) else find_calibration(path) or path
        look, found = look_at_calibration(path, unit, up)
        if to is not None:
            write_calibration(to, found.cameras)
        if as_json:
            show_json(look)
        else:
            show(calibration_table(look), *([f"written: {to}, in metres"] if to is not None else []))
        for doubt in look.doubts:
            listener.warn(doubt)


def refuse_for_recordings(path: Path, to: Path | None, unit: str | None, up: str | None) -> None:
    """Raise `SettingsError` for flags that only calibrations take."""
    for name, value in (("to", to), ("unit", unit), ("up", up)):
        if value is not None:
            raise SettingsError(f"flags: {name}: found {str(value)!r} for {path}, which is no calibration file; a recording has unit and "
                                "up in its recording.toml")


def refuse_other_files(path: Path) -> None:
    """Raise `ShadowPuppetError`, saying what it is, for a file that is no film but a calibration, settings or motion that is not read."""
    from shadowpuppet.io.calibration.calibration_files import examine_calibration
    from shadowpuppet.io.calibration.formats import ENDINGS, NO_CALIBRATIONS
    from shadowpuppet.io.motion import READABLE

    ending = path.suffix.lower()
    if not path.is_file():
        return
    if path.name in NO_CALIBRATIONS:
        raise RecordingError(f"{path}: is a file of a recording or run, expected its folder, {path.parent}")
    if ending in UNREADABLE:
        raise RecordingError(f"{path}: found the ending {path.suffix!r}, expected a film, a calibration or a motion file; motion is read "
                             f"from {choices(READABLE)}, calibrations from {choices(ENDINGS)}")
    if ending in ENDINGS:
        examine_calibration(path)
        raise RecordingError(f"{path}: found no camera with a matrix in it, expected a calibration, film or motion file")


def calibration_table(look: CalibrationLook) -> RenderableType:
    """A calibration explained: facts, a row a camera, a top view."""
    parts: list[RenderableType] = [pairs(_facts(look)), "", table("", ("", "camera", "pixels", "wide", "at, m", "looks", "roll", "away",
                                                                      "bend"), _camera_rows(look), right=(3, 4, 6, 7))]  # fmt: skip
    if any(camera.placed for camera in look.cameras):
        parts += ["", top_view(look), pairs(_legend(look))]
    if look.notes:
        parts += ["", pairs([("read", look.notes)])]
    return Group(*parts)


def _facts(look: CalibrationLook) -> Iterator[tuple[str, str]]:
    yield "calibration", look.path
    yield "format", f"{look.format}; lengths in {look.unit}{'' if look.unit_told else ', as the file does not say otherwise'}"
    count = len(look.cameras)
    apart = f", {look.apart[0]:.2f} to {look.apart[1]:.2f} m apart" if look.apart else ""
    yield "cameras", f"{count} camera{'s' if count > 1 else ''}{apart}"
    if look.middle is not None:
        x, y, z = look.middle
        away = [camera.away for camera in look.cameras if camera.away is not None]
        yield "they look at", f"{x:.2f} {y:.2f} {z:.2f} m, from {min(away):.2f} to {max(away):.2f} m away"


def _camera_rows(look: CalibrationLook) -> Iterator[tuple[str, ...]]:
    for n, camera in enumerate(look.cameras):
        place = " ".join(f"{value:.2f}" for value in camera.place) if camera.placed else "not known"
        bend = "not at all" if not camera.bend else f"{camera.bend:.0f} px" if abs(camera.bend) < float("inf") else "beyond telling"
        yield (_letter(n), camera.name, f"{camera.size[0]}x{camera.size[1]}", f"{camera.fov[0]:.0f}°", place, _looks(camera),
               f"{round(camera.roll)}°", "" if camera.away is None else f"{camera.away:.2f} m",
               f"{bend}{', fisheye' if camera.lens == 'fisheye' else ''}")  # fmt: skip


def _looks(camera: CameraPlacement) -> str:
    return "level" if abs(camera.down) < 0.5 else f"{abs(camera.down):.0f}° {'down' if camera.down > 0 else 'up'}"


def _letter(n: int) -> str:
    return LETTERS[n] if n < len(LETTERS) else "+"


def top_view(look: CalibrationLook) -> Text:
    """The scene from above in characters: cameras, arrows in their viewing directions, and how many cameras see a standing person whole."""
    from shadowpuppet.calibration.overview import MAP_COLUMNS

    x0, y0, x1, y1 = look.corners
    rows = [["·" if not count else str(count) if count < 10 else "#" for count in row] for row in look.seen]

    def put(x: float, y: float, mark: str) -> None:
        column, row = int((x - x0) / (x1 - x0) * MAP_COLUMNS), int((y1 - y) / (y1 - y0) * MAP_COLUMNS / 2)
        for n, character in enumerate(mark):
            if 0 <= row < len(rows) and 0 <= column + n < MAP_COLUMNS:
                rows[row][column + n] = character

    if look.middle is not None:
        put(look.middle[0], look.middle[1], "×")
    for n, camera in enumerate(look.cameras):
        if camera.placed:
            put(camera.place[0], camera.place[1], _letter(n) + ARROWS[round(camera.facing / 45) % 8])
    return Text("\n".join("  " + "".join(row) for row in rows), no_wrap=True)


def _legend(look: CalibrationLook) -> Iterator[tuple[str, str]]:
    x0, y0, x1, y1 = look.corners
    most = max((count for row in look.seen for count in row), default=0)
    cell = (x1 - x0) * (y1 - y0) / sum(map(len, look.seen))
    whole = sum(count == most for row in look.seen for count in row) * cell
    yield "from above", (f"{x1 - x0:.1f} m to a side, x to the right from {x0:.1f} to {x1:.1f}, y up from {y0:.1f} to {y1:.1f}; "
                         "letters are cameras with arrows the way they look, × the place they look at")
    yield "figures", (f"how many cameras see a person of 1.80 m whole who stands there: {most} over {whole:.1f} m²" if most
                      else "no camera sees a person of 1.80 m whole anywhere here, if Z = 0 is the floor")
