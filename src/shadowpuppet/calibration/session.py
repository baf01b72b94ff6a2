"""A calibration session: films of a board in a folder, and the cameras solved from them.

LAB/board.toml describes the board; LAB/intrinsics/CAMERA.mp4 shows it to one camera, near, far and tilted; LAB/extrinsics/CAMERA.mp4 are
films begun together of the board carried through the room; LAB/floor/CAMERA.jpg or .mp4 shows it lying where the world's origin is to be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.calibration.boards.board import Board, board_of, check_turned
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.boards.films import BoardFilm, films_in, read_films, view_at_rest
from shadowpuppet.calibration.solve.lens import LensFit, lens_advice, solve_lens
from shadowpuppet.calibration.solve.placement import Placement, place_cameras
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.io.recording import BOARD_FOLDERS
from shadowpuppet.names import composed

MAX_RMS = 1.0
"""Greatest reprojection error, pixels of a picture 1000 wide, that is not remarked on."""
MAX_PLACE_SD, MAX_ANGLE_SD = 0.005, np.radians(0.1)
"""Greatest standard deviations of a camera's place, metres, and direction, radians, that are not remarked on."""
DOUBT_FACTOR = 3.0
"""Factor on the bundle's standard deviations: corners of one view err together, which the bundle does not know."""
MIN_DELAY = 0.15
"""Least delay of a film, frames, that is remarked on, if it is over `DOUBT_FACTOR` times its doubt."""
MAX_DELAY = 0.5
"""Delay of a film, frames, over which its pictures are read again at the times of the others': corners hardly move straight for longer."""
MIN_VIEW_ANGLE = np.radians(4.0)
"""Least angle between two cameras as the board sees them; with less, depth is hardly known."""


@dataclass(frozen=True, kw_only=True)
class Session:
    """The films of a session."""

    folder: Path
    board: Board
    films: Mapping[str, Mapping[str, Path]]
    """Films by folder, of `BOARD_FOLDERS`, and camera."""
    starts: Mapping[str, float]
    """Seconds of each film of extrinsics/ before the session begins."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cameras."""
        return tuple(sorted({name for films in self.films.values() for name in films}))


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibrated:
    """The result of a session."""

    session: Session
    cameras: tuple[Camera, ...]
    """The cameras; without films of the carried board or the floor each is level at the world's origin."""
    lenses: tuple[LensFit | None, ...]
    """How each lens was solved; None if it was given."""
    placement: Placement | None
    """How places were solved; None if only lenses were."""
    advice: tuple[str, ...]
    """What to film again and why, a sentence each; none if all is well."""
    notes: tuple[str, ...]
    """What was done and found, a sentence each."""


def open_session(folder: Path, board: Board | None = None) -> Session:
    """The session in a folder; `board` replaces board.toml. Raises `CalibrationError` if there is no board or no films."""
    if not folder.is_dir():
        raise CalibrationError(f"{folder}: expected a folder with {', '.join(f'{name}/' for name in BOARD_FOLDERS)} and board.toml")
    values: dict[str, Any] = {}
    path = folder / "board.toml"
    if path.exists():
        values = read_toml(path, CalibrationError)
    elif board is None:
        raise CalibrationError(f"{folder}: board.toml is missing, which describes the board (kind, columns, rows, square); or say "
                               "--board 'charuco 7x5' --square 0.04")
    starts = _starts(values.pop("start", {}), path)
    films = {name: films_in(folder / name) for name in BOARD_FOLDERS}
    session = Session(folder=folder, board=board or board_of(values, path), films=films, starts=starts)
    if not session.names:
        raise CalibrationError(f"{folder}: found no films in {', '.join(f'{name}/' for name in BOARD_FOLDERS)}; expected a film a camera, "
                               "named after it: intrinsics/cam1.mp4")
    for name in starts:
        if name not in session.names:
            raise CalibrationError(f"{path}: start: found {name!r}, there are films of {choices(session.names)}")
    return session


def _starts(table: object, path: Path) -> dict[str, float]:
    if not isinstance(table, dict):
        raise CalibrationError(f"{path}: start: found {table!r}, expected a table of seconds by camera")
    for name, value in table.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value) or abs(value) > 1e5:
            raise CalibrationError(f"{path}: start.{name}: found {value!r}, expected seconds")
    return {composed(str(name)): float(value) for name, value in table.items()}


def calibrate(session: Session, lenses: Mapping[str, Camera] | None = None, say: Callable[[str, int], None] = lambda what, count: None,
              advance: Callable[[], None] = lambda: None) -> Calibrated:
    """Solve a session. Raises a `ShadowPuppetError`, mostly with what to film again.

    lenses: cameras whose lenses are known, by name: not solved again. say, advance: progress: a phase with its number of steps; one step.
    """
    board, given = session.board, {composed(name): camera for name, camera in (lenses or {}).items()}
    say("films of the carried board", len(session.films["extrinsics"]))
    carried = read_films(session.films["extrinsics"], board, session.starts, True, advance)
    say("films of the floor", len(session.films["floor"]))
    laid = read_films(session.films["floor"], board, {}, False, advance)
    own = {name: path for name, path in session.films["intrinsics"].items() if name not in given}
    say("films of each lens", len(own))
    single = read_films(own, board, {}, False, advance)
    say("solving", 0)
    names = session.names
    fits = {name: _lens(name, board, [films[name] for films in (single, carried, laid) if name in films]) for name in names
            if name not in given}
    cameras = [_known_lens(given[name], name, [films[name] for films in (carried, laid) if name in films]) if name in given
               else fits[name].camera for name in names]
    advice = [sentence for fit in fits.values() for sentence in lens_advice(fit)]
    advice += [f"{fit.camera.name!r}: {_bad_fit(fit)}" for fit in fits.values() if _bad_fit(fit)]
    notes = [f"camera {name!r}: lens from the film of the carried board, as intrinsics/ has none of it"
             for name in fits if name not in single]
    notes += _print_notes([*single.items(), *carried.items(), *laid.items()])
    if not carried and not laid:
        return Calibrated(session=session, cameras=tuple(cameras), lenses=tuple(fits.get(name) for name in names), placement=None,
                          advice=tuple(advice), notes=(*notes, "lenses only: there are no films in extrinsics/ or floor/"))
    placed, more = _placed(session, names, cameras, carried, laid)
    late = {camera.name: float(delay) for camera, delay in zip(placed.cameras, placed.solved.bundle.delays) if camera.name in carried}
    if any(abs(seconds) * carried[name].rate > MAX_DELAY for name, seconds in late.items()):
        say("films of the carried board, in step", len(late))
        starts = {name: session.starts.get(name, 0.0) + seconds for name, seconds in late.items()}
        carried = read_films(session.films["extrinsics"], board, starts, True, advance)
        say("solving", 0)
        placed, more = _placed(session, names, cameras, carried, laid)
        placed = later_by(placed, late)
    advice += place_advice(placed, carried)
    return Calibrated(session=session, cameras=placed.cameras, lenses=tuple(fits.get(name) for name in names), placement=placed,
                      advice=tuple(advice), notes=(*notes, *more))


def _lens(name: str, board: Board, films: Sequence[BoardFilm]) -> LensFit:
    sizes = {film.size for film in films}
    if len(sizes) > 1:
        found = choices(f"{w} x {h}" for w, h in sorted(sizes))
        raise CalibrationError(f"camera {name!r}: its films have {found} pixels, expected one size: film all with the same "
                               "setting, as zoom and cropping change the lens")
    views = films[0].found
    for film in films[1:] if len(views) < 20 else []:
        views = views + film.found
    return solve_lens(name, board, views, films[0].size)


def _print_notes(films: Iterable[tuple[str, BoardFilm]]) -> list[str]:
    """A sentence if the board of some cameras' films is printed inverted."""
    names = sorted({name for name, film in films if any(view.inverted for view in film.found)})
    return [f"the board is printed inverted, black and white exchanged: found so by {', '.join(names)}"] if names else []


def _known_lens(camera: Camera, name: str, films: Sequence[BoardFilm]) -> Camera:
    for film in films:
        if film.size != camera.size:
            raise CalibrationError(f"{film.path}: found {film.size[0]} x {film.size[1]} pixels, expected {camera.size[0]} x "
                                   f"{camera.size[1]}, as the given lens of camera {name!r} has")
    return replace(camera, name=name)


def _bad_fit(fit: LensFit) -> str | None:
    limit = MAX_RMS * max(fit.camera.size) / 1000
    if fit.rms <= limit:
        return None
    return (f"the lens leaves {fit.rms:.2f} pixels of error (expected under {limit:.2g}): is the board flat, are its sizes right, and does "
            "the picture stay the same (no autofocus, zoom or stabilisation)? hold the board still now and then, and film again")


def _placed(session: Session, names: Sequence[str], cameras: Sequence[Camera], carried: Mapping[str, BoardFilm],
            laid: Mapping[str, BoardFilm]) -> tuple[Placement, list[str]]:
    board, notes = session.board, list[str]()
    if len(names) > 1:
        check_turned(board)
    missing = [name for name in names if name not in carried and name not in laid]
    if missing:
        raise CalibrationError(f"{session.folder}: extrinsics/ has no film of {choices(missing)}, expected one of every camera")
    count = max((len(film.views) for film in carried.values()), default=0)
    moments: list[dict[int, View]] = [{} for _ in range(count)]
    speeds: list[dict[int, Array]] = [{} for _ in range(count)]
    for n, name in enumerate(names):
        if (film := carried.get(name)) is None:
            continue
        for k, (view, speed) in enumerate(zip(film.views, film.velocities)):
            if view is not None and (speed is not None or film.rate == 0):
                moments[k][n] = view
                if speed is not None:
                    speeds[k][n] = speed
    floor = {n: view for n, name in enumerate(names) if name in laid and (view := view_at_rest(laid[name].found)) is not None}
    if laid and not floor:
        notes.append("no camera finds the board in floor/: the floor is unknown")
    placed = place_cameras(cameras, board, moments, floor or None, speeds if any(speeds) else None)
    if not placed.floor:
        notes.append("no film of the board on the floor: the world's z is up as the pictures have it, its origin is a camera, and the "
                     "height of the floor is unknown; lay the board where the origin is to be, and film it: floor/CAMERA.mp4")
    return placed, notes


def later_by(placed: Placement, late: Mapping[str, float]) -> Placement:
    """The placement from films that were read later by some seconds, with each film's whole delay."""
    bundle = placed.solved.bundle
    whole = bundle.delays + [late.get(camera.name, 0.0) for camera in placed.cameras]
    return replace(placed, solved=placed.solved._replace(bundle=replace(bundle, delays=whole)))


def delays_of(placed: Placement, carried: Mapping[str, BoardFilm]) -> dict[str, tuple[float, float]]:
    """Delay of each film and its doubt, one standard deviation, in frames, by camera; of films whose board moves."""
    out = {}
    for n, camera in enumerate(placed.cameras):
        film = carried.get(camera.name)
        if film is not None and placed.solved.delay_sd[n] > 0:
            out[camera.name] = (float(placed.solved.bundle.delays[n] * film.rate),
                                float(DOUBT_FACTOR * placed.solved.delay_sd[n] * film.rate))
    return out


def place_advice(placed: Placement, carried: Mapping[str, BoardFilm]) -> list[str]:
    """What is doubtful about places and what to film again, a sentence each."""
    said, solved = list[str](), placed.solved
    number = np.repeat([c for c, _, _ in placed.views], [len(view.ids) for _, _, view in placed.views])
    for n, camera in enumerate(placed.cameras):
        own = solved.residuals[number == n]
        rms, limit = float(np.sqrt((own**2).sum(1).mean())) if len(own) else np.nan, MAX_RMS * max(camera.size) / 1000
        if not len(own):
            said.append(f"camera {camera.name!r}: none of its views of the board fits the others': film the carried board again")
        elif rms > limit:
            said.append(f"camera {camera.name!r}: the carried board is {rms:.1f} pixels off where the other cameras have it (expected "
                        f"under {limit:.2g}): carry it slowly, hold it still now and then, and begin the films together")
        place, angle = DOUBT_FACTOR * solved.place_sd[n], DOUBT_FACTOR * solved.angle_sd[n]
        if place > MAX_PLACE_SD or angle > MAX_ANGLE_SD:
            said.append(f"camera {camera.name!r}: its place is known to {1000 * place:.0f} mm and its direction to {np.degrees(angle):.2f} "
                        "degrees only: carry the board nearer to it and through more of the room, and let neighbours see it at once")
    for name, (late, doubt) in delays_of(placed, carried).items():
        if abs(late) > max(MIN_DELAY, DOUBT_FACTOR * doubt / 3):
            said.append(f"the film of camera {name!r} is {abs(late):.2f} frames {'late' if late > 0 else 'early'} (give or take "
                        f"{2 * doubt:.2f}); this is accounted for here, and other films of this camera may be off as well: see `check`")
    said += _narrow(placed)
    return said


def _narrow(placed: Placement) -> list[str]:
    """A sentence on two cameras alone that see the board from nearly the same direction."""
    if len(placed.cameras) != 2:
        return []
    a, b = (camera.centre for camera in placed.cameras)
    middle = np.median(placed.solved.bundle.boards[:, :3, 3], axis=0)
    u, v = a - middle, b - middle
    angle = float(np.arccos(np.clip(u @ v / max(float(np.linalg.norm(u) * np.linalg.norm(v)), 1e-12), -1, 1)))
    if angle > MIN_VIEW_ANGLE:
        return []
    return [f"the two cameras see the room from nearly the same direction ({np.degrees(angle):.1f} degrees apart, "
            f"{np.linalg.norm(a - b):.2f} m): depth will be uncertain in every recording; place them 60 to 120 degrees apart"]
