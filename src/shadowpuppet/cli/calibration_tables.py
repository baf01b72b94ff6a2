"""What the command line shows of a calibration: words, a table, and a top view in characters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from shadowpuppet.calibration.overview import MAP_COLUMNS, CalibrationLook, CameraPlacement
from shadowpuppet.cli.tables import pairs, plain_table
from shadowpuppet.pipeline.check_calibration import CalibrationCheck

ARROWS = "→↗↑↖←↙↓↘"
"""By eighths of a turn, counter-clockwise from +x."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
"""Of cameras in the top view; those after them are +."""


def calibration_table(look: CalibrationLook) -> RenderableType:
    """A calibration explained."""
    parts: list[RenderableType] = [pairs(_above(look)), "", _each(look)]
    if any(camera.placed for camera in look.cameras):
        parts += ["", top_view(look), pairs(_legend(look))]
    if look.notes:
        parts += ["", pairs([("read", "\n".join(look.notes))])]
    return Group(*parts)


def _above(look: CalibrationLook) -> Iterator[tuple[str, str]]:
    yield "calibration", look.path
    yield "format", f"{look.format}; lengths in {look.unit}{'' if look.unit_told else ', as the file does not say otherwise'}"
    count = len(look.cameras)
    apart = f", {look.apart[0]:.2f} to {look.apart[1]:.2f} m apart" if look.apart else ""
    yield "cameras", f"{count} camera{'s' if count > 1 else ''}{apart}"
    if look.middle is not None:
        x, y, z = look.middle
        away = [camera.away for camera in look.cameras if camera.away is not None]
        yield "they look at", f"{x:.2f} {y:.2f} {z:.2f} m, from {min(away):.2f} to {max(away):.2f} m away"


def _each(look: CalibrationLook) -> RenderableType:
    table = plain_table("", ("", "camera", "pixels", "wide", "at, m", "looks", "roll", "away", "bend"), right=(3, 4, 6, 7))
    for n, camera in enumerate(look.cameras):
        place = " ".join(f"{value:.2f}" for value in camera.place) if camera.placed else "not told"
        bend = "not at all" if not camera.bend else f"{camera.bend:.0f} px" if np.isfinite(camera.bend) else "beyond telling"
        table.add_row(_letter(n), camera.name, f"{camera.size[0]}x{camera.size[1]}", f"{camera.fov[0]:.0f}°", place, _looks(camera),
                      f"{round(camera.roll)}°", "" if camera.away is None else f"{camera.away:.2f} m",
                      f"{bend}{', fisheye' if camera.lens == 'fisheye' else ''}")
    return table


def _looks(camera: CameraPlacement) -> str:
    return "level" if abs(camera.down) < 0.5 else f"{abs(camera.down):.0f}° {'down' if camera.down > 0 else 'up'}"


def _letter(n: int) -> str:
    return LETTERS[n] if n < len(LETTERS) else "+"


def top_view(look: CalibrationLook) -> Text:
    """The cameras from above, with arrows the way they look, among figures: how many see a standing person whole."""
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
    yield "figures", (f"how many cameras see somebody of 1.80 m whole who stands there: {most} over {whole:.1f} m²" if most
                      else "no camera sees somebody of 1.80 m whole anywhere here, if Z = 0 is the floor")


def check_table(check: CalibrationCheck) -> RenderableType:
    """What silhouettes say of a calibration."""
    found, late = check.agreement, check.lateness
    table = plain_table("", ("camera", "disagrees by", "with", "late by", "sure to", ""), right=(1, 3, 4))
    for n, name in enumerate(found.names):
        apart, pairs_of = found.apart[n], [pair for pair in found.pairs[n] if pair is not None]
        frames, spread = (None, None) if late is None else (late.frames[n], late.spread[n])
        wrong = [word for word, here in (("place", name in found.wrong or name in check.turns), ("time", name in check.late)) if here]
        table.add_row(name, "unknown" if apart is None else f"{apart:.1f} px", f"{len(pairs_of)} others",
                      "unknown" if frames is None else f"{round(frames, 1) + 0.0:.1f} frames", "" if spread is None else f"{spread:.1f}",
                      f"wrong: {' and '.join(wrong)}" if wrong else "")
    rows = [("recording", check.recording),
            ("compared", f"{check.sets} sets of silhouettes, {check.rate:.4g} a second, of {check.frame_rate:.4g} frames/s"),
            ("limit", f"{found.limit:.1f} px; cameras that fit are apart by about one")]
    if found.height is not None:
        rows.append(("height", f"{found.height:.2f} m from end to end, as the cameras see it"))
    verdict = "all cameras agree" if check.good else "\n".join(check.doubts)
    return Group(pairs(rows), "", table, "", pairs([("verdict", verdict)]))
