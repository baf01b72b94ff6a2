"""Places of cameras from a board carried through the room and laid on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.solve.board_pose import Pose, pose_error
from shadowpuppet.calibration.solve.bundle import Bundle, Free, Solved, adjust
from shadowpuppet.calibration.solve.lens import observations
from shadowpuppet.calibration.solve.relative_places import Moment, Pair, linked, pairs_of, poses_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, inverse

OUTLIER, OUTLIER_PIXELS = 4.0, 1.0
"""Views are left out whose error is over this many times the median of all views and over this many pixels."""
FLOOR_FROM_BOARD = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])
"""Board to world for a board that lies on the floor: x as the board's, z up."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """Where cameras stand."""

    cameras: tuple[Camera, ...]
    """In the world whose floor is the board's, or else whose z is up in the pictures."""
    solved: Solved
    """The bundle adjustment; its boards are in the world, too."""
    views: tuple[tuple[int, int, View], ...]
    """The views used: camera, board pose and view."""
    left_out: int
    """Number of views that did not fit."""
    pairs: tuple[Pair, ...]
    """What pairs of cameras saw together."""
    floor: bool
    """Whether a board on the floor defines the world."""


def place_cameras(cameras: Sequence[Camera], board: Board, moments: Sequence[Moment], floor: Moment | None = None,
                  velocities: Sequence[dict[int, Array]] | None = None) -> Placement:
    """Places of cameras whose lenses are known.

    moments: views of the carried board at the same times; floor: views of the board on the floor, defines the world's floor and origin.
    velocities: of the corners of each view (K, 2), by moment and camera, pixels/s: films' delays are solved, too.
    Raises `CalibrationError` with what to film again if cameras are not linked.
    """
    every = [*moments, *([floor] if floor else [])]
    poses = poses_of(cameras, board, every)
    pairs = pairs_of(len(cameras), poses)
    places, groups = linked(len(cameras), pairs)
    _check_linked(cameras, poses, pairs, groups)
    known = [T for T in places if T is not None]
    used = [m for m, each in enumerate(poses) if len(each) > 1 or (floor is not None and m == len(moments) and each)]
    boards = np.array([_board_pose(cameras, board, every[m], poses[m], known) for m in used])
    moving = velocities or []
    views = [(c, b, every[m][c]) for b, m in enumerate(used) for c in sorted(poses[m])]
    speeds = [moving[m].get(c, np.zeros_like(view.pixels)) if m < len(moving) else np.zeros_like(view.pixels)
              for (c, b, view) in views for m in (used[b],)]
    rig = tuple(replace(camera, T_camera_world=T, oriented=True) for camera, T in zip(cameras, known))
    keep = _in_front(board, rig, boards, views)
    views, speeds, left_out = [views[k] for k in keep], [speeds[k] for k in keep], len(views) - len(keep)
    laid = len(used) - 1 if floor is not None and used and used[-1] == len(moments) else None
    solved, keep = _robust(rig, board, boards, views, speeds, laid, timed=velocities is not None)
    left_out += len(views) - len(keep)
    views = [views[k] for k in keep]
    world = _world(solved.bundle, laid, board)
    return Placement(cameras=world.cameras, solved=solved._replace(bundle=world), views=tuple(views), left_out=left_out,
                     pairs=tuple(pairs), floor=laid is not None)


def _robust(rig: tuple[Camera, ...], board: Board, boards: Array, views: Sequence[tuple[int, int, View]], speeds: Sequence[Array],
            laid: int | None, timed: bool) -> tuple[Solved, list[int]]:
    """The bundle adjusted, then again without views that do not fit; and the indices of the views that do. The board `laid` on the floor is
    held, or else the reference camera is, so that doubts are those of places before it."""
    C, keep = len(rig), list(range(len(views)))
    reference = int(np.argmin([np.linalg.norm(camera.T_camera_world - np.eye(4)) for camera in rig]))
    others = [n != reference for n in range(C)]
    solved = None
    start = Bundle(rig, boards, np.zeros(C))
    for attempt in range(3):
        chosen = [views[k] for k in keep]
        seen = observations(board, chosen, [speeds[k] for k in keep])
        watched = np.isin(np.arange(len(boards)), [b for _, b, _ in chosen])
        shows = [bool(np.any(seen.velocities[seen.camera == n])) for n in range(C)]
        held = laid is not None and bool(watched[laid])
        if held:
            watched[laid] = False
        late = [timed and attempt > 0 and other and moves for other, moves in zip(others, shows)]
        free = Free([True] * C if held else others, watched, late, [False] * C)
        solved = adjust(start, seen, free)
        start = solved.bundle
        number = np.repeat(np.arange(len(keep)), [len(view.ids) for _, _, view in chosen])
        errors = np.sqrt(np.bincount(number, (solved.residuals**2).sum(1)) / np.bincount(number))
        good = errors <= max(OUTLIER * float(np.median(errors)), OUTLIER_PIXELS)
        if attempt == 2 or (good.all() and not (timed and attempt == 0)):
            break
        keep = [k for k, fits in zip(keep, good) if fits]
    assert solved is not None
    return solved, keep


def _board_pose(cameras: Sequence[Camera], board: Board, moment: Moment, poses: dict[int, list[Pose]], places: Sequence[Array]) -> Array:
    """The board's pose in the world (4, 4) that fits all views of a moment best, of the poses of each alone."""
    candidates = [inverse(places[c]) @ pose.T for c, found in poses.items() for pose in found]

    def off(T: Array) -> float:
        errors = [pose_error(cameras[c], board, moment[c], places[c] @ T) for c in poses]
        return float(np.mean(np.nan_to_num(np.minimum(errors, 1e3), nan=1e3)))

    return min(candidates, key=off)


def _in_front(board: Board, rig: Sequence[Camera], boards: Array, views: Sequence[tuple[int, int, View]]) -> list[int]:
    """Indices of the views whose board is in front of its camera."""
    return [k for k, (c, b, view) in enumerate(views)
            if np.isfinite(pose_error(rig[c], board, view, rig[c].T_camera_world @ boards[b]))]


def _check_linked(cameras: Sequence[Camera], poses: Sequence[dict[int, list[Pose]]], pairs: Sequence[Pair],
                  groups: Sequence[Sequence[int]]) -> None:
    """Raise `CalibrationError` if some camera is not linked with the others."""
    if len(groups) == 1:
        return
    alone = groups[1]
    names = " and ".join(repr(cameras[n].name) for n in alone)
    rest = ", ".join(repr(cameras[n].name) for n in groups[0])
    bridges = [pair for pair in pairs if (pair.first in alone) != (pair.second in alone)]
    if any(pair.two_sided for pair in bridges):
        pair = next(pair for pair in bridges if pair.two_sided)
        both = f"{cameras[pair.first].name!r} and {cameras[pair.second].name!r}"
        raise CalibrationError(f"cameras {both} see the two sides of the board, and "
                               "both have the same pattern: which side is which cannot be known; cover one side, and film the board "
                               "again so that neighbouring cameras see the same side at the same time")
    if not any(n in each for n in alone for each in poses):
        raise CalibrationError(f"camera {names} never sees the board well enough for a pose: film the board again nearer to it, turned "
                               "toward it and one neighbour")
    if bridges:
        most = max(bridges, key=lambda pair: pair.seen)
        raise CalibrationError(f"camera {names} and the others ({rest}) see the board at the same time in {most.seen} moments, but these "
                               "do not agree on where they stand: were the films begun together (say in board.toml's [start] when each "
                               "began), and is the board flat? film again, holding it still at some places that both see")
    raise CalibrationError(f"camera {names} never sees the board at the same time as the others ({rest}): film again, carrying the board "
                           "where they and a neighbour see it together, and turn it half-way between the two")


def _world(bundle: Bundle, laid: int | None, board: Board) -> Bundle:
    """The bundle in the world of the floor's board, or with z up as the pictures have it."""
    from shadowpuppet.io.calibration.calibration_files import rotated_up

    if laid is None:
        cameras = rotated_up(bundle.cameras, "cameras")
        change = inverse(cameras[0].T_camera_world) @ bundle.cameras[0].T_camera_world
        return Bundle(cameras, change @ bundle.boards, bundle.delays)
    lift = np.eye(4)
    lift[2, 3] = board.thickness
    change = lift @ FLOOR_FROM_BOARD @ inverse(bundle.boards[laid])
    cameras = tuple(replace(camera, T_camera_world=camera.T_camera_world @ inverse(change)) for camera in bundle.cameras)
    return Bundle(cameras, change @ bundle.boards, bundle.delays)
