"""Films of a board: their views at sampled times, read by seeking, several films at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.detection import BoardDetector, View
from shadowpuppet.errors import CalibrationError, choices
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.names import composed
from shadowpuppet.silhouette.background import to_brightness
from shadowpuppet.threads import usable_cores
from shadowpuppet.video.container import FILM_SUFFIXES, opened
from shadowpuppet.video.images import IMAGE_SUFFIXES, read_image
from shadowpuppet.video.seeking import Seeker

SAMPLES = 120
"""Number of times at which a film is looked at, evenly spread."""
LEAST_STEP = 0.2
"""Least time between two samples, seconds."""
MIRROR_TRIES = 12
"""Number of pictures in which a board that was never found is looked for mirrored."""


class BoardFilm(NamedTuple):
    """A film of the board, sampled."""

    path: Path
    size: tuple[int, int]
    """Width and height, pixels."""
    rate: float
    """Frames/s; 0 for pictures."""
    times: Array
    """Times looked at, of shape (T,), seconds of the session: the film's less its start."""
    views: tuple[View | None, ...]
    """The view at each time; None where the board was not found."""
    velocities: tuple[Array | None, ...]
    """Velocities of its corners, of shape (K, 2), pixels/s; None if unknown."""

    @property
    def found(self) -> list[View]:
        """All views."""
        return [view for view in self.views if view is not None]


def films_in(folder: Path) -> dict[str, Path]:
    """The films, pictures and folders of pictures in a folder by the camera's name, which is their own. Raises `CalibrationError` if two
    have one name."""
    out: dict[str, Path] = {}
    for path in sorted(folder.iterdir()) if folder.is_dir() else []:
        pictures = path.is_dir() and any(file.suffix.lower() in IMAGE_SUFFIXES for file in path.iterdir())
        if path.name.startswith(".") or not (pictures or path.suffix.lower() in (*FILM_SUFFIXES, *IMAGE_SUFFIXES)):
            continue
        name = composed(path.name if path.is_dir() else path.stem)
        if name in out:
            raise CalibrationError(f"{folder}: found {choices([out[name].name, path.name])} for the camera {name!r}, expected one of them")
        out[name] = path
    return out


def read_films(films: Mapping[str, Path], board: Board, starts: Mapping[str, float], moving: bool,
               advance: Callable[[], None] = lambda: None) -> dict[str, BoardFilm]:
    """Films sampled at the same times of the session, several at once.

    starts: seconds of each film before the session begins. moving: whether corners' velocities are measured, too, which takes a second
    picture each time.
    """
    facts = {name: _facts(path) for name, path in films.items()}
    films_only = [facts[name].seconds - starts.get(name, 0.0) for name in films if facts[name].rate > 0]
    length = max(films_only, default=0.0)
    times = np.arange(0.0, max(length, 1e-9), max(LEAST_STEP, length / SAMPLES))

    def read(name: str) -> BoardFilm:
        film = _read_film(films[name], facts[name], board, times, starts.get(name, 0.0), moving)
        advance()
        return film

    with ThreadPoolExecutor(usable_cores(), "boards") as pool:
        return dict(zip(films, pool.map(read, films)))


class _Facts(NamedTuple):
    size: tuple[int, int]
    rate: float
    seconds: float


def _facts(path: Path) -> _Facts:
    """Size, frames/s (0 for pictures) and length of a film. Raises `VideoError`."""
    pictures = _pictures(path)
    if pictures:
        height, width = read_image(pictures[0]).shape[:2]
        return _Facts((width, height), 0.0, 0.0)
    with opened(path) as (container, stream):
        rate = float(stream.average_rate or stream.guessed_rate or 0)
        seconds = float(stream.duration * stream.time_base) if stream.duration and stream.time_base else (container.duration or 0) / 1e6
        return _Facts((stream.codec_context.width, stream.codec_context.height), rate or 25.0, seconds)


def _pictures(path: Path) -> list[Path]:
    if path.is_dir():
        return sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES)
    return [path] if path.suffix.lower() in IMAGE_SUFFIXES else []


def _read_film(path: Path, facts: _Facts, board: Board, times: Array, start: float, moving: bool) -> BoardFilm:
    detector = BoardDetector(board)
    pictures = _pictures(path)
    if pictures:
        chosen = [pictures[k] for k in evenly_spread(len(pictures), SAMPLES)]
        for file in chosen:
            found_size = read_image(file).shape[1::-1]
            if found_size != facts.size:
                raise CalibrationError(f"{file}: found {found_size[0]} x {found_size[1]} pixels, expected {facts.size[0]} x "
                                       f"{facts.size[1]} as in {chosen[0].name}")
        views = [detector.find(to_brightness(read_image(file)), float(n)) for n, file in enumerate(chosen)]
        _check_not_mirrored(path, board, detector, views, [to_brightness(read_image(file)) for file in chosen[:MIRROR_TRIES]])
        return BoardFilm(path, facts.size, 0.0, np.arange(len(chosen), dtype=float), tuple(views), (None,) * len(views))
    views, velocities = list[View | None](), list[Array | None]()
    with Seeker(path, facts.size) as film:
        for time in times.tolist():
            picture = film.at(time + start) if time + start >= 0 else None
            view = None if picture is None else detector.find(to_brightness(picture), time)
            shown = film.shown
            later = film.at(shown + 1 / facts.rate) if moving and view is not None else None
            speed = None if view is None or later is None else _velocity(view, detector.find(to_brightness(later)), facts.rate)
            if view is not None and speed is not None:  # frames lie beside the wanted times, each film's elsewhere
                view = view._replace(pixels=view.pixels + speed * (time + start - shown))
            velocities.append(speed)
            views.append(view)
        tries = [film.at(float(t)) for t in np.linspace(0, times[-1] + start, MIRROR_TRIES)] if not any(views) else []
    _check_not_mirrored(path, board, detector, views, [to_brightness(picture) for picture in tries if picture is not None])
    return BoardFilm(path, facts.size, facts.rate, times, tuple(views), tuple(velocities))


def _velocity(view: View, later: View | None, rate: float) -> Array | None:
    """Velocities (K, 2) of a view's corners, pixels/s; of those lost in the next picture, the others' mean."""
    if later is None:
        return None
    same, a, b = np.intersect1d(view.ids, later.ids, return_indices=True)
    if len(same) < len(view.ids) / 2:
        return None
    moved = (later.pixels[b] - view.pixels[a]) * rate
    out = np.tile(moved.mean(0), (len(view.ids), 1))
    out[a] = moved
    return out


def _check_not_mirrored(path: Path, board: Board, detector: BoardDetector, views: Sequence[View | None],
                        pictures: Sequence[NDArray[np.uint8]]) -> None:
    """Raise `CalibrationError` if a board with markers is found in the mirrored pictures only."""
    if board.kind == "charuco" and not any(views) and any(detector.find(np.ascontiguousarray(grey[:, ::-1])) for grey in pictures):
        raise CalibrationError(f"{path}: the film is mirrored: the board's markers are found only when left and right are exchanged; turn "
                               "the camera's mirroring off, and film again")


def view_at_rest(views: Sequence[View]) -> View | None:
    """One view of a board that does not move, from several: the median of each corner; None if there is none."""
    if not views:
        return None
    ids = np.unique(np.concatenate([view.ids for view in views]))
    held = {int(n): [view.pixels[view.ids == n][0] for view in views if n in view.ids] for n in ids}
    often = [n for n, pixels in held.items() if 2 * len(pixels) >= len(views)]
    kept = np.array(often, np.int64) if len(often) >= 8 else ids
    pixels = np.array([np.median(held[int(n)], axis=0) for n in kept])
    return View(views[0].time, kept, pixels, float(np.median([view.sharpness for view in views])))
