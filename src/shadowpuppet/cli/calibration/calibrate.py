"""The command `calibrate`: lenses and places of cameras from films of a board, or places from those of a person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter
from rich.console import Group, RenderableType

from shadowpuppet.cli.flags import OTHER, Switch, flag, output
from shadowpuppet.cli.tables import pairs, show, table
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import vector_from_rotation
from shadowpuppet.output import say

if TYPE_CHECKING:
    from shadowpuppet.calibration.boards.board import Board
    from shadowpuppet.calibration.session import Calibrated
    from shadowpuppet.camera.camera import Camera
    from shadowpuppet.pipeline.repair.placing import Placed


def calibrate(lab: Annotated[Path | None, Parameter(help="Folder with board.toml and films of a board: intrinsics/CAMERA.mp4, "
                                                         "extrinsics/CAMERA.mp4, floor/CAMERA.mp4 or .jpg.")] = None, /, *,
              board: Annotated[str | None, flag("The board in place of board.toml: 'charuco 7x5' or 'checkerboard 9x6', counted "
                                               "in squares along a row and a column. OpenCV counts a checkerboard's inner corners, one "
                                               "less each way (8x5).")] = None,
              square: Annotated[float | None, flag("Side of the board's squares in metres, as measured on the print.")] = None,
              dictionary: Annotated[str | None, flag("A ChArUco board's set of markers, such as 4X4_50 or 5X5_100.")] = None,
              lenses: Annotated[Path | None, flag("A calibration whose lenses are kept; only places are solved.")] = None,
              to: Annotated[Path | None, output("Calibration to write; LAB/calibration.toml if not given. An old one is kept "
                                                "as calibration.before1.toml.")] = None,
              from_person: Annotated[Switch, Parameter(help="LAB is a recording of a person who walks, with a rough "
                                                            "calibration or rough.toml: refine places by outlines, scale by "
                                                            "--height, floor by the feet.")] = False,
              height: Annotated[float | None, flag("With --from-person: the person's height in metres, with shoes on.")] = None,
              masks: Annotated[Switch, Parameter(help="With --from-person: use the recording's masks/.")] = False,
              print_board: Annotated[Path | None, flag("Write the board as a PDF of true size, and end.")] = None,
              no_report: Annotated[Switch, Parameter(group=OTHER, help="Write no calibration.html.")] = False) -> int:
    """Calibrate the cameras of a lab from films of a board: lenses from a board shown to each camera, places from one carried through the
    room before several, the floor from one that lies on it.

    Writes LAB/calibration.toml, and LAB/calibration.html with errors, coverage, places, and what to film again.
    Exit code 1 if something should be filmed again.
    With --from-person no board is needed: lenses are those of the rough calibration; fields of view in rough.toml are refined.
    """
    if print_board is not None:
        from shadowpuppet.calibration.boards.printing import write_board

        made = _board(lab, board, square, dictionary)
        sheet = write_board(print_board, made)
        say(f"written: {print_board}, {made.text}, on {sheet}; print it at 100 %, and measure a square")
        return 0
    if lab is None:
        raise CalibrationError("expected a folder with films of a board; or --print-board board.pdf --board 'charuco 7x5' --square 0.04")
    if from_person:
        return _from_person(lab, height, masks, to)
    from shadowpuppet.calibration.results import write_results
    from shadowpuppet.calibration.session import calibrate as solve
    from shadowpuppet.calibration.session import open_session
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.evaluation.report.calibration_page import calibration_page
    from shadowpuppet.io.calibration.calibration_files import read_calibration

    with terminal() as listener:
        session = open_session(lab, None if board is None else _board(lab, board, square, dictionary))
        known = {camera.name: camera for camera in read_calibration(lenses, places=False)} if lenses is not None else None
        done = 0

        def begin(what: str, count: int) -> None:
            nonlocal done
            done = 0
            listener.begin(what, count or None)

        def advance() -> None:
            nonlocal done
            done += 1
            listener.advance(done)

        found = solve(session, known, begin, advance)
        written = write_results(found, to or lab / "calibration.toml", None if no_report else calibration_page)
        listener.stop()
        show(result_table(found), pairs([("written", [*map(str, written)])]))
        for sentence in found.advice:
            listener.warn(sentence)
    return 1 if found.advice else 0


def _from_person(recording: Path, height: float | None, masks: bool, to: Path | None) -> int:
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.repair.placing import NO_HEIGHT, open_rough, place_cameras, write_placed

    options = make_options({"height": height, "masks": masks})
    with terminal() as listener:
        rig, rough_focal = open_rough(recording, options)
        if options.height is None and rig.recording.subject.height is None:
            listener.warn(NO_HEIGHT)  # before the work and what it writes
        placed = place_cameras(rig, options, listener, rough_focal)
        written = write_placed(rig, placed, to)
        listener.stop()
        show(placed_table(placed, rig.cameras), pairs([("written", [*map(str, written)])]))
        for sentence in placed.advice:
            listener.warn(sentence)
    return 1 if placed.advice else 0


def placed_table(placed: Placed, before: Sequence[Camera]) -> RenderableType:
    """A row a camera: how far its tangents were and are from the others', how it was moved, and how well it is known."""
    rows = []
    for n, (camera, old) in enumerate(zip(placed.cameras, before)):
        turned = np.degrees(np.linalg.norm(vector_from_rotation(camera.T_camera_world[:3, :3] @ old.T_camera_world[:3, :3].T)))
        rows.append((camera.name, f"{placed.fit.before[n]:.1f} px", f"{placed.fit.after[n]:.1f} px",
                     f"{1000 * np.linalg.norm(camera.centre - old.centre):.0f} mm", f"{turned:.1f}°",
                     f"{1000 * placed.place_doubt[n]:.0f} mm, {np.degrees(placed.angle_doubt[n]):.2f}°", *_field_of_view(placed, n)))
    what = (f"{placed.sets} sets of silhouettes, {placed.fit.tangents} pairs of tangents; lengths times {placed.scale:.3f}, floor "
            f"tilted by {np.degrees(placed.tilt):.1f}°")
    late = ", ".join(f"{name} {seconds:.3f} s" for name, seconds in placed.starts.items())
    facts = [("compared", what), *([("in step", f"films begin at {late} ([start] of recording.toml)")] if late else [])]
    columns = ("camera", "apart", "now", "moved", "turned", "within the rig to", *(["field of view"] if placed.focal_doubt.any() else []))
    return Group(pairs(facts), "", table("", columns, rows, right=(1, 2, 3, 4)))


def _field_of_view(placed: Placed, n: int) -> Iterator[str]:
    """A camera's field of view across its picture, and how well it is known; nothing if the lens was given."""
    camera, doubt = placed.cameras[n], placed.focal_doubt[n]
    if doubt:
        half = camera.fov / 2
        yield f"{np.degrees(2 * half):.1f}° ± {np.degrees(np.sin(2 * half) * doubt):.1f}°"


def _board(lab: Path | None, board: str | None, square: float | None, dictionary: str | None) -> Board:
    from shadowpuppet.calibration.boards.board import board_from, read_board

    if board is not None:
        return board_from(board, square, **({"dictionary": dictionary} if dictionary else {}))
    if lab is not None and (lab / "board.toml").exists():
        return read_board(lab / "board.toml")
    raise CalibrationError("--board is missing, for example --board 'charuco 7x5' --square 0.04")


def result_table(found: Calibrated) -> RenderableType:
    """A row a camera: lens and place."""
    columns = ("camera", "lens", "views", "error", "unseen views", "focal length", "at, m", "known to")
    parts: list[RenderableType] = [pairs([("board", found.session.board.text)]), "",
                                   table("", columns, _rows(found), right=(2, 3, 4, 5))]
    parts += ["", pairs([("notes", found.notes)])] if found.notes else []
    return Group(*parts)


def _rows(found: Calibrated) -> Iterator[tuple[str, ...]]:
    for n, (camera, fit) in enumerate(zip(found.cameras, found.lenses)):
        lens = ("given", "", "", "") if fit is None else (fit.model, str(fit.views), f"{fit.rms:.2f} px", f"{fit.held_out:.2f} px")
        doubt = "" if fit is None else f" ± {100 * fit.focal_sd:.1f} %"
        place = " ".join(f"{value + 0.0:.2f}" for value in np.round(camera.centre, 2)) if found.placement is not None else "not known"
        sure = "" if found.placement is None else f"{1000 * 3 * found.placement.solved.place_sd[n]:.1f} mm"
        yield (camera.name, *lens, f"{camera.matrix[0, 0]:.1f}{doubt}", place, sure)
