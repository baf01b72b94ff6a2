"""Fig. 5: the pose that was found (green) over the true one (red), below the picture of one camera, a frame from each motion."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from papers.common.claims import Verdict
from papers.common.experiment import Outcome, Request, Table
from papers.ni2008.inputs import Case, Source, load, sources
from papers.ni2008.measures import Errors, errors
from papers.ni2008.tracks import HYBRID, Track, of, tracks
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.io.recording import read_recording
from shadowpuppet.video import open_frames

GREEN, RED, GROUND, INK = (70, 160, 40), (60, 60, 220), 255, (40, 40, 40)
"""Blue, green, red."""
HEIGHT, MARGIN = 330, 0.35
"""Of each picture, pixels; what is shown around the person, metres."""
CLOSE = 50.0
"""A pose closely matches whose joints' root mean square distance is less than this, mm."""


def make(request: Request) -> Outcome:
    """Draw the frame of median error of each recording."""
    tiles, rows, verdict = [], [], []
    for source in sources(request):
        case = load(request, source)
        track = of(tracks(request, [case], [HYBRID], [request.seed]), case, HYBRID)[0]
        found = errors(case, track)
        frame, camera = median_frame(found), best_view(case)
        tiles.append(tile(source, case, track, frame, camera))
        rows.append((case.motion, frame, case.cameras[camera].name, float(found.by_frame[frame])))
        verdict.append(found)
    table = Table(("recording", "frame", "camera", "rmse_mm"), rows, shown=True)
    return Outcome({"seed": request.seed, **HYBRID.plain}, {"figure_5": side_by_side(tiles)}, {"figure_5": table}, [matches(rows, verdict)])


def matches(rows: list[Any], found: list[Errors]) -> Verdict:
    """"It can be observed that the estimated human pose closely matches the ground truth.\""""
    got = "; ".join(f"{name} {rmse:.0f} mm" for name, _, _, rmse in rows)
    whole = ", ".join(f"{np.nanpercentile(one.by_frame, 95):.0f}" for one in found)
    return Verdict("The estimated pose closely matches the true one in the frames shown", "VI, Fig. 5",
                   f"RMSE of the joints in frames of median error: {got}; 95 of 100 frames are under {whole} mm (close: under {CLOSE:.0f})",
                   all(row[3] < CLOSE for row in rows), "figure_5.png")


def median_frame(found: Errors) -> int:
    """The frame whose error is in the middle of all."""
    known = np.flatnonzero(np.isfinite(found.by_frame))
    return int(known[np.argsort(found.by_frame[known])[len(known) // 2]])


def best_view(case: Case) -> int:
    """The camera that saw the person largest at first."""
    return int(np.argmax([0 if mask is None else mask.sum() for mask in case.masks(0)]))


def tile(source: Source, case: Case, track: Track, frame: int, camera: int) -> np.ndarray:
    """A camera's picture, and below it both poses as it would see them."""
    image = picture_of(source, case, frame, camera)
    shown = np.full_like(image, GROUND)
    view = Picture(case.body, case.cameras[camera], case.cameras[camera].T_camera_world)
    for pose, colour in ((case.true_poses[frame], RED), (track.poses[frame], GREEN)):
        if np.isfinite(pose).all():
            paint(shown, view, pose, colour)
    x0, y0, x1, y1 = box(case, camera, frame, track)
    both = [cv2.resize(each[y0:y1, x0:x1], (round((x1 - x0) * HEIGHT / (y1 - y0)), HEIGHT), interpolation=cv2.INTER_AREA if y1 - y0 > HEIGHT
                       else cv2.INTER_CUBIC) for each in (image, shown)]  # fmt: skip
    cv2.putText(both[1], f"{case.motion}, frame {frame + 1}", (8, HEIGHT - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
    return np.concatenate(both)


def picture_of(source: Source, case: Case, frame: int, camera: int) -> np.ndarray:
    """What a camera filmed at a time of the case; the silhouette where there is no film."""
    if source.path is None:
        mask = case.masks(frame)[camera]
        assert mask is not None
        return np.where(mask[..., None], np.uint8(235), np.uint8(60)).repeat(3, axis=2)
    view = next(view for view in read_recording(source.path).views if view.camera.name == case.cameras[camera].name)
    film = open_frames(view.video if not isinstance(view.video, str) else Path(view.video))
    wanted = case.times[frame] + view.start
    best = min(islice(film, frame + round(view.start * case.rate) + 3), key=lambda each: abs(each.time - wanted))
    image = np.asarray(best.image)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def paint(image: np.ndarray, view: Picture, pose: Array, colour: tuple[int, int, int], strength: float = 0.5) -> None:
    """The body in one colour that lets through what is below, darker toward the edges of each part."""
    corners, counts = view.polygons(view.transforms(pose[None]), np.arange(len(view.body.parts)))
    ink = image.copy()
    for polygon, number in zip(corners[0], counts[0]):
        if number:
            cv2.fillConvexPoly(ink, np.rint(polygon[:number]).astype(np.int32), colour, cv2.LINE_AA)
    image[:] = np.rint(strength * ink + (1 - strength) * image).astype(np.uint8)
    for polygon, number in zip(corners[0], counts[0]):
        if number:
            cv2.polylines(image, [np.rint(polygon[:number]).astype(np.int32)], True, [0.6 * value for value in colour], 1, cv2.LINE_AA)


def box(case: Case, camera: int, frame: int, track: Track) -> tuple[int, int, int, int]:
    """What is shown of a picture: left, top, right, bottom."""
    own = case.cameras[camera]
    places = np.concatenate([case.truth.positions[frame], case.body.points(track.poses[frame][None])[0]])
    places = places[np.isfinite(places).all(1)]
    steps = MARGIN * np.concatenate([np.eye(3), -np.eye(3)])
    pixels = own.project(np.concatenate([places + step for step in steps]))
    low, high = np.clip(pixels.min(0), 0, None), np.minimum(pixels.max(0), own.size)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def side_by_side(tiles: list[np.ndarray]) -> np.ndarray:
    """Tiles of one height in a row, a line between."""
    gap = np.full((tiles[0].shape[0], 6, 3), 255, np.uint8)
    return np.concatenate([part for each in tiles for part in (each, gap)][:-1], axis=1)
