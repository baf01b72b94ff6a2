"""The lens of a camera from views of a board: focal lengths, principal point, and the model of distortion that predicts unseen views
best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.solve.board_pose import board_poses
from shadowpuppet.calibration.solve.bundle import Bundle, Free, Observations, Solved, adjust
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, transform

MIN_VIEWS, MAX_VIEWS = 8, 40
"""Least and greatest number of views a lens is solved from."""
SHARP_SHARE = 0.5
"""Share of the sharpest views from which those are chosen that differ most."""
MODELS = ("k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3", "k1 ... k6 p1 p2", "fisheye")
"""Models of distortion, the simplest first."""
KNOWN_SHARE = 0.7
"""Least share of views that a lens must be able to show."""
CERTAIN, LEAST_GAIN = 2.0, 0.01
"""A richer model is chosen if the logarithm of the held-out errors' squares is less by this many standard errors, and by this much."""
OUTLIER = 3.0
"""Views with a residual over this many times the median are left out."""
FISHEYE_ANGLES = (70, 100, 130, 160, 185)
"""Horizontal fields of view, degrees, from which a fisheye lens is first guessed."""
WRONG = 5.0
"""Views whose first pose errs by over this many times the median are left out."""
MIN_DEPTH_SHARE = 0.12
"""Least depth of a corner over its distance: 83 degrees off the optical axis."""
MAX_FOCAL_SD = 0.003
"""Greatest relative standard deviation of a focal length that counts as known."""
CELLS = (6, 4)
"""Columns and rows of a picture's grid for coverage."""
MIN_COVERAGE, MIN_TILT, MIN_DISTANCES = 0.6, 20.0, 1.3
"""What good views have at least: share of the grid's cells with corners, greatest angle of the board against the picture, degrees, and
ratio of the greatest to the least distance."""


@dataclass(frozen=True, kw_only=True)
class LensFit:
    """A solved lens, and how well its views determine it."""

    camera: Camera
    """At the world's origin; only the lens counts."""
    model: str
    """One of `MODELS`."""
    views: int
    """Number of views used."""
    rms: float
    """Root mean square of the reprojection error, pixels."""
    held_out: float
    """The same of views that the lens was not solved from."""
    focal_sd: float
    """Relative standard deviation of the focal length."""
    coverage: float
    """Share of the picture's grid in which corners were seen."""
    tilt: float
    """Greatest angle between board and picture, degrees."""
    distances: float
    """Ratio of the greatest to the least distance of the board."""
    corners: Array
    """All corners of the views used, of shape (N, 2), pixels."""
    residuals: Array
    """Their reprojection errors, of shape (N, 2), pixels."""


def chosen_views(board: Board, views: Sequence[View], size: tuple[int, int], count: int = MAX_VIEWS) -> list[View]:
    """`count` of the views at most: of the sharper half, those that differ most in where and how they show the board, in order of time."""
    if len(views) <= MIN_VIEWS:
        return list(views)
    limit = float(np.quantile([view.sharpness for view in views], 1 - max(SHARP_SHARE, min(1.0, 2 * MIN_VIEWS / len(views)))))
    sharp = [view for view in views if view.sharpness >= limit]
    frames = np.array([_outline(board, view).ravel() / size[0] for view in sharp])
    picked = [int(np.argmax([len(view.ids) for view in sharp]))]
    away = np.linalg.norm(frames - frames[picked[0]], axis=1)
    while len(picked) < min(count, len(sharp)):
        k = int(away.argmax())
        if away[k] < 0.005:  # all others show what is chosen already: a board at rest
            break
        picked.append(k)
        away = np.minimum(away, np.linalg.norm(frames - frames[k], axis=1))
    return [sharp[k] for k in sorted(picked)]


def _outline(board: Board, view: View) -> Array:
    """Where a view shows the board's four outer corners, of shape (4, 2), pixels: by the affine map nearest to its corners, and how its
    two halves differ in size, which tells a tilt."""
    place = board.points[view.ids, :2]
    A = np.concatenate([place, np.ones((len(place), 1)), place[:, :1] * place[:, 1:], place**2], axis=1)
    fit = np.linalg.lstsq(A, view.pixels, rcond=1e-6)[0]
    x, y = board.points[:, 0].max(), board.points[:, 1].max()
    ends = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    return np.concatenate([ends, np.ones((4, 1)), ends[:, :1] * ends[:, 1:], ends**2], axis=1) @ fit


def solve_lens(name: str, board: Board, views: Sequence[View], size: tuple[int, int]) -> LensFit:
    """The lens that predicts views of a board best. Raises `CalibrationError` with what to film if there are too few views."""
    chosen = chosen_views(board, views, size)
    if len(chosen) < MIN_VIEWS:
        raise CalibrationError(f"camera {name!r}: found {len(chosen)} different views of the board ({board.text}), expected "
                               f"{MIN_VIEWS} or more: film it again for half a minute, near and far, in all parts of the picture, tilted "
                               "by up to 45 degrees" + ("" if views else "; is it the board that the settings describe?"))
    best, errors = None, np.full(len(chosen), np.inf)
    for model in MODELS:
        tried = _held_out(name, board, size, model, chosen)
        if np.isfinite(tried).mean() > KNOWN_SHARE and (best is None or _is_better(tried, errors)):
            best, errors = model, tried
    if best is None:
        raise CalibrationError(f"camera {name!r}: no lens explains the {len(chosen)} views of the board ({board.text}): are its numbers of "
                               "squares and its dictionary those of the board that was filmed?")
    lens = _without_outliers(name, board, size, best, chosen)
    return _described(lens, best, float(np.sqrt(np.median(errors))))


class _Lens(NamedTuple):
    solved: Solved
    seen: Observations
    views: list[View]

    @property
    def camera(self) -> Camera:
        return self.solved.bundle.cameras[0]

    @property
    def errors(self) -> Array:
        """Mean square of each view's reprojection error, of shape (V,), pixels squared."""
        return np.bincount(self.seen.board, (self.solved.residuals**2).sum(1)) / np.bincount(self.seen.board)


def _held_out(name: str, board: Board, size: tuple[int, int], model: str, views: Sequence[View]) -> Array:
    """Mean square (pixels squared) of each view's reprojection error, of shape (V,), with a lens solved from every other view; infinite
    where the lens cannot show it."""
    out = np.full(len(views), np.inf)
    for first in (0, 1):
        lens = _fitted(name, board, size, model, views[1 - first :: 2])
        if lens is not None:
            out[first::2] = _errors(lens.camera, board, views[first::2])
    return out


def _errors(camera: Camera, board: Board, views: Sequence[View]) -> Array:
    """Mean square of each view's reprojection error, of shape (V,), with the pose that fits it best."""
    out = np.full(len(views), np.inf)
    poses = {n: found[0] for n, view in enumerate(views) if (found := board_poses(camera, board, view))}
    if not poses:
        return out
    lens = _adjusted(board, camera, [views[n] for n in poses], [pose.T for pose in poses.values()], False)
    out[list(poses)] = lens.errors if lens is not None else np.inf
    return out


def _adjusted(board: Board, camera: Camera, views: list[View], poses: Sequence[Array], free: bool) -> _Lens | None:
    """The poses of the board in each view and, if it is `free`, the lens, by bundle adjustment; None if a board is behind the camera."""
    seen = observations(board, [(0, b, view) for b, view in enumerate(views)])
    try:
        start = Bundle((camera,), np.array(poses), np.zeros(1))
        return _Lens(adjust(start, seen, Free([False], [True] * len(poses), [False], [free])), seen, views)
    except (CalibrationError, np.linalg.LinAlgError):
        return None


def _is_better(errors: Array, others: Array) -> bool:
    """Whether errors (V,) of views are below others of the same views for certain: less in the median by over twice its doubt."""
    if np.isfinite(errors).sum() > np.isfinite(others).sum() + len(errors) / 10:
        return True
    both = np.isfinite(errors) & np.isfinite(others)
    if both.sum() < 3 or np.isfinite(errors).sum() < np.isfinite(others).sum() - len(errors) / 10:
        return False
    gain = np.log(others[both] / np.maximum(errors[both], 1e-12))
    doubt = 1.4826 * np.median(np.abs(gain - np.median(gain))) * 1.25 / np.sqrt(len(gain))
    return bool(np.median(gain) > max(CERTAIN * doubt, LEAST_GAIN))


def _without_outliers(name: str, board: Board, size: tuple[int, int], model: str, views: Sequence[View]) -> _Lens:
    lens = _fitted(name, board, size, model, views)
    assert lens is not None
    errors = np.sqrt(lens.errors)
    keep = [view for view, error in zip(lens.views, errors) if error <= OUTLIER * np.median(errors)]
    if MIN_VIEWS <= len(keep) < len(lens.views):
        lens = _fitted(name, board, size, model, keep) or lens
    return lens


def _fitted(name: str, board: Board, size: tuple[int, int], model: str, views: Sequence[View]) -> _Lens | None:
    """A lens of one model; None if the views do not determine one."""
    start = _fisheye_start(name, board, size, views) if model == "fisheye" else _pinhole_start(name, board, size, model, views)
    if start is None:
        return None
    camera, poses = start
    held = [(view, pose) for view, pose in zip(views, poses) if pose is not None]
    if len(held) < 3:
        return None
    lens = _adjusted(board, camera, [view for view, _ in held], [pose for _, pose in held], True)
    if lens is None:
        return None
    x, y = np.diag(lens.camera.matrix)[:2]
    return lens if 0.1 * max(size) < x < 30 * max(size) and abs(np.log(x / y)) < 0.3 else None


def _pinhole_start(name: str, board: Board, size: tuple[int, int], model: str,
                   views: Sequence[View]) -> tuple[Camera, list[Array | None]] | None:
    import cv2

    flags = {"k1": cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3,
             "k1 k2": cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3, "k1 k2 p1 p2": cv2.CALIB_FIX_K3, "k1 k2 p1 p2 k3": 0,
             "k1 ... k6 p1 p2": cv2.CALIB_RATIONAL_MODEL}[model]
    points = [board.points[view.ids].astype(np.float32)[:, None] for view in views]
    pixels = [view.pixels.astype(np.float32)[:, None] for view in views]
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 40, 1e-9)
    try:
        _, K, D, turns, shifts = cv2.calibrateCamera(points, pixels, size, np.eye(3), np.zeros(5), flags=flags, criteria=stop)
    except cv2.error:
        return None
    lens = np.ravel(np.asarray(D, float))
    lens = lens[: 8 if model.startswith("k1 ...") else 5]
    K = np.asarray(K, float)
    if not (np.isfinite(K).all() and np.isfinite(lens).all() and (np.abs(lens) < 1e5).all()):
        return None
    poses = list[Array | None]()
    for turn, shift in zip(turns, shifts):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = np.asarray(cv2.Rodrigues(np.asarray(turn, float))[0]), np.asarray(shift, float).ravel()
        poses.append(T)
    try:
        return Camera(name, size, K, lens), poses
    except CalibrationError:
        return None


def _fisheye_start(name: str, board: Board, size: tuple[int, int], views: Sequence[View]) -> tuple[Camera, list[Array | None]] | None:
    """A fisheye lens with the equidistant angle, of `FISHEYE_ANGLES`, that fits the views best, and the boards' poses before it."""
    best, least = None, np.inf
    for angle in FISHEYE_ANGLES:
        focal = size[0] / np.radians(angle)
        K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
        camera = Camera(name, size, K, np.full(4, 1e-6), fisheye=True)
        found = [next(iter(board_poses(camera, board, view)), None) for view in views]
        errors = [pose.error for pose in found if pose is not None]
        if len(errors) >= max(3, len(views) // 2) and (error := float(np.median(errors))) < least:
            least, best = error, (camera, [None if pose is None or pose.error > WRONG * error or _is_aside(board, view, pose.T) else pose.T
                                           for view, pose in zip(views, found)])
    return best


def _is_aside(board: Board, view: View, T: Array) -> bool:
    """Whether a corner is seen so far from the optical axis that OpenCV's fisheye model, which divides by depth, may lose it."""
    points = transform(T, board.points[view.ids])
    return bool((points[:, 2] < MIN_DEPTH_SHARE * np.linalg.norm(points, axis=1)).any())


def observations(board: Board, views: Sequence[tuple[int, int, View]], velocities: Sequence[Array] | None = None) -> Observations:
    """Observations of views, each with the indices of its camera and of its board's pose; velocities (K, 2) of each view's corners in
    pixels/s, 0 if not given."""
    count = [len(view.ids) for _, _, view in views]
    moving = velocities if velocities is not None else [np.zeros_like(view.pixels) for _, _, view in views]
    return Observations(np.repeat([camera for camera, _, _ in views], count), np.repeat([pose for _, pose, _ in views], count),
                        np.concatenate([board.points[view.ids] for _, _, view in views]),
                        np.concatenate([view.pixels for _, _, view in views]), np.concatenate(list(moving)))


def _described(lens: _Lens, model: str, held_out: float) -> LensFit:
    T, seen, solved = lens.solved.bundle.boards, lens.seen, lens.solved
    tilts = np.degrees(np.arccos(np.clip(np.abs(T[:, 2, 2]), 0, 1)))
    distances = np.linalg.norm(T[:, :3, 3], axis=1)
    size = np.array(lens.camera.size)
    cells = np.unique(np.clip((seen.pixels / size * CELLS).astype(int), 0, np.array(CELLS) - 1), axis=0)
    return LensFit(
        camera=replace(lens.camera, oriented=False), model=model, views=len(lens.views), held_out=held_out,
        rms=float(np.sqrt((solved.residuals**2).sum(1).mean())), focal_sd=float(solved.lens_sd[0]),
        coverage=len(cells) / (CELLS[0] * CELLS[1]), tilt=float(np.percentile(tilts, 90)),
        distances=float(np.percentile(distances, 95) / np.percentile(distances, 5)), corners=seen.pixels, residuals=solved.residuals,
    )  # fmt: skip


def lens_advice(fit: LensFit) -> list[str]:
    """What to film again so that the lens is known, a sentence each; none if it is."""
    name, said = fit.camera.name, list[str]()
    if fit.tilt < MIN_TILT:
        said.append(f"camera {name!r}: the board was held square to the camera (at most {fit.tilt:.0f} degrees off), so that focal length "
                    "and distance cannot be told apart: film it again, tilted by 30 to 45 degrees to all sides")
    if fit.coverage < MIN_COVERAGE:
        said.append(f"camera {name!r}: the board was seen in {100 * fit.coverage:.0f} % of the picture: film it again up to all four "
                    "corners of the picture, where lenses bend most")
    if fit.focal_sd > MAX_FOCAL_SD:
        why = "at one distance" if fit.distances < MIN_DISTANCES else "in too few poses"
        said.append(f"camera {name!r}: the focal length is known to {100 * fit.focal_sd:.1f} % only, as the board was seen {why}: film it "
                    "again near and far, and tilted")
    return said
