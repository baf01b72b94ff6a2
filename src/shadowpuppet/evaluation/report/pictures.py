"""Pictures of the worst frames of a run, from its overlay or drawn over the recording, with the truth's bones."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.captions import WHITE, strip
from shadowpuppet.camera.drawing import BLACK, DASH, colour_of, draw_line, in_colour
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.evaluation import Evaluation
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import doubtful_joints
from shadowpuppet.motion.metrics import LOST_ERROR
from shadowpuppet.motion.motion import BLANK, JointTable
from shadowpuppet.motion.synchronization import at_times, match, step_of
from shadowpuppet.pipeline.footage import camera_footage, chosen_views, open_recording, worked_size
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.overlay_video import grid_of
from shadowpuppet.removed import of_earlier_run

if TYPE_CHECKING:
    from shadowpuppet.video import Image

WORST, TYPICAL, MAX_LOST = 6, 2, 2
"""Numbers of bad and of typical frames shown, and of bad frames that may be without a pose."""
SPACING = 0.5
"""Seconds between the worst frames; less in short runs, more in long ones."""
MAX_VIEWS = 5
"""Cameras shown side by side: the person is largest in them."""
MAX_WIDTH = 1280
"""Largest width of a picture in the page, pixels."""
MIN_HEIGHT = 440
"""Height of a picture at which thin lines look good, pixels."""


@dataclass(frozen=True)
class ReportFrame:
    """A frame shown in the report."""

    letter: str
    frame: int
    """Index in the run."""
    time: float
    """Seconds."""
    error: float
    """Mean over the joints, mm; NaN without a truth."""
    worst: tuple[tuple[str, float], ...]
    """The joints of greatest error, and their errors, mm."""
    typical: bool
    """Whether it is shown as a typical frame, not a bad one."""


def report_frames(of: Evaluation) -> list[ReportFrame]:
    """The worst frames, some time apart, and typical ones; without a truth by the overlap with the silhouettes."""
    motion = of.run.motion
    if not len(motion):
        return []
    if of.errors is None or of.table is None:
        badness, times = np.where(np.isfinite(motion.overlap), 1 - motion.overlap, np.nan), motion.times
        means = np.full(len(motion), np.nan)
    else:
        means, times = _mean_errors(of.errors.distance, of.errors.known), of.table.times
        badness = means
    index, there = match(motion.times, times)
    blank = np.isin(motion.status[index], BLANK)
    badness = np.where(there, badness, np.nan)
    letters = iter("ABCDEFGHIJKLMNOP")
    chosen = [(n, False) for n in _worst_frames(badness, times, blank)] + [(n, True) for n in _typical_frames(badness, times, blank)]
    return [ReportFrame(next(letters), int(index[n]), float(times[n]), float(1000 * means[n]), _worst_joints(of, n), typical)
            for n, typical in chosen]


def pictures(of: Evaluation, chosen: Sequence[ReportFrame]) -> tuple[dict[str, bytes], str]:
    """JPEG by letter, and their source; none, and the reason, without overlay and recording."""
    wanted = {each.frame: each.letter for each in chosen}
    film = of.run.folder / "overlay.mp4"
    if not wanted:
        return {}, "no frame to show"
    try:
        found = _of_overlay(film, of, wanted) if film.exists() else _of_recording(of, wanted)
        return {letter: _jpeg(image) for letter, image in found}, "overlay.mp4" if film.exists() else "the recording"
    except ShadowPuppetError as error:
        return {}, f"no pictures: {error}"


def _of_overlay(film: Path, of: Evaluation, wanted: Mapping[int, str]) -> Iterator[tuple[str, Image]]:
    """Frames of the run's overlay with the truth's bones; the rows of a single camera side by side, without the words below."""
    from shadowpuppet.video import open_frames

    options, last = _options(of), max(wanted)
    cameras = [camera.resized(worked_size(camera.size, options.max_size)) for camera in of.cameras]
    for n, frame in enumerate(open_frames(film)):
        if n in wanted:
            image, places = np.array(in_colour(frame.image)), _truth_at(of, n)
            high = cameras[0].size[1] if cameras else len(image) // 3
            if len(cameras) <= 1 and len(image) >= 3 * high:
                rows = [_scaled(image[row * high :][:high], height=max(high, MIN_HEIGHT)) for row in range(3)]
                if cameras and places is not None:
                    draw_bones(rows[2], cameras[0], places)
                yield wanted[n], np.concatenate(rows, axis=1)
            else:
                yield wanted[n], _of_grid(image, of, cameras, n)
        if n >= last:
            return


def _of_grid(image: Image, of: Evaluation, cameras: Sequence[Camera], frame: int) -> Image:
    """The person cut out of the overlay of several cameras, with the truth's bones."""
    grid, truth = grid_of(cameras), _truth_at(of, frame)
    tiles = [_scaled(image[grid.place(n)], height=max(grid.height, 2 * MIN_HEIGHT)) for n in range(len(cameras))]  # so that lines are thin
    for tile, camera in zip(tiles, cameras):
        if truth is not None:
            draw_bones(tile, camera, truth)
    return _side_by_side(tiles, cameras, [table for table, _ in _tables(of, frame)])


def _side_by_side(images: Sequence[Image], cameras: Sequence[Camera], tables: Sequence[JointTable]) -> Image:
    """The person cut out of the pictures of the `MAX_VIEWS` cameras that see them largest."""
    boxes = [_box(image, camera, tables) for image, camera in zip(images, cameras)]
    shares = [(box[0].stop - box[0].start) / len(image) if box else 0.0 for image, box in zip(images, boxes)]
    chosen = sorted(sorted(range(len(images)), key=lambda n: -shares[n])[:MAX_VIEWS])
    cut = []
    for n in chosen:
        image = _scaled(np.ascontiguousarray(images[n][boxes[n] or ...]), height=MIN_HEIGHT)
        cut.append((image, strip(image.shape[1], [[(cameras[n].name, WHITE)]])))
    high = max(len(name) for _, name in cut)
    return np.concatenate([np.concatenate([np.pad(name, ((0, high - len(name)), (0, 0), (0, 0))), image]) for image, name in cut], axis=1)


def _of_recording(of: Evaluation, wanted: Mapping[int, str]) -> Iterator[tuple[str, Image]]:
    """Frames of the recording, up to four cameras side by side, with the run's bones and the truth's."""
    path = of.run.info.get("recording")
    if not isinstance(path, str) or not Path(path).exists():
        raise ShadowPuppetError(f"the run has no overlay.mp4, and its recording, {path}, is not there")
    options = _options(of)
    recording = open_recording(path, options)
    views = chosen_views(recording, options.camera)
    motion = of.run.motion
    by_frame: dict[int, dict[Camera, Image]] = {frame: {} for frame in wanted}
    for view in views:
        footage = camera_footage(recording, view, options)
        for frame, image in _nearest_images(footage.frames(False), motion.times, sorted(wanted)):
            image = _scaled(np.array(in_colour(image)), height=max(image.shape[0], 2 * MIN_HEIGHT))
            doubtful = doubtful_joints(motion.joint_names, motion.limb_status[frame])
            for places, own in _tables(of, frame):
                draw_bones(image, footage.camera, places, own, doubtful)
            by_frame[frame][footage.camera] = image
    for frame, images in by_frame.items():
        if len(views) == 1:
            yield from ((wanted[frame], image) for image in images.values())
        elif images:
            yield wanted[frame], _side_by_side([*images.values()], [*images], [table for table, _ in _tables(of, frame)])


def _options(of: Evaluation) -> Options:
    """The settings of the run."""
    return make_options(of_earlier_run(of.run.settings)) if of.run.settings else Options()


def _nearest_images(shots: Iterator, times: Array, frames: list[int]) -> Iterator[tuple[int, Image]]:
    """Images nearest to the times of frames, in increasing order."""
    held, waiting = None, list(frames)
    for shot in shots:
        while waiting and shot.time >= times[waiting[0]]:
            nearer = held if held is not None and times[waiting[0]] - held.time < shot.time - times[waiting[0]] else shot
            yield waiting.pop(0), nearer.image
        if not waiting:
            return
        held = shot
    if held is not None and waiting and times[waiting[0]] - held.time <= step_of(times):
        yield waiting[0], held.image


def draw_bones(image: Image, camera: Camera, places: JointTable, own: bool = False, doubtful: Container[str] = ()) -> None:
    """Draw the bones of one frame into a picture (H, W, 3) of a camera, at any size; `own`: the run's, in the sides' colours, those to
    `doubtful` joints dashed; else thin and white."""
    pixels = dict(zip(places.names, _pixels(image, camera, places)))
    unit = image.shape[0] / 400
    for a, b in BONES:
        ends = [pixels[name] for name in (a, b) if name in pixels]
        if len(ends) < 2 or not np.isfinite(ends).all():
            continue
        for ink, extra in ((BLACK, 2), (colour_of(b) if own else WHITE, 0)):
            width = max(1, round((4 if own else 1.6) * unit))
            draw_line(image, np.array(ends), ink, width + extra, DASH * width * (own and b in doubtful))


def _pixels(image: Image, camera: Camera, places: JointTable) -> Array:
    """Pixels (J, 2) of one frame's joints in a camera's picture, at any size."""
    scale = min(image.shape[1] / camera.size[0], image.shape[0] / camera.size[1])
    return (camera.project(places.positions[0]) + 0.5) * scale - 0.5


def _box(image: Image, camera: Camera, tables: Sequence[JointTable]) -> tuple[slice, slice] | None:
    """Rows and columns around the person, three by four; None if no joint is known."""
    pixels = np.concatenate([_pixels(image, camera, table) for table in tables])
    pixels = np.clip(pixels[np.isfinite(pixels).all(1)], 0, [image.shape[1], image.shape[0]])
    if len(pixels) < 3:
        return None
    (left, top), (right, bottom) = pixels.min(0), pixels.max(0)
    half_high = min(max(0.64 * (bottom - top), 0.8 * (right - left), 0.12 * image.shape[0]), image.shape[0] / 2)
    half_wide = min(0.75 * half_high, image.shape[1] / 2)
    y = np.clip((top + bottom) / 2, half_high, image.shape[0] - half_high)
    x = np.clip((left + right) / 2, half_wide, image.shape[1] - half_wide)
    return slice(round(y - half_high), round(y + half_high)), slice(round(x - half_wide), round(x + half_wide))


def _worst_frames(badness: Array, times: Array, blank: NDArray[np.bool_]) -> list[int]:
    """The worst frames, ordered by time."""
    length = float(times[-1] - times[0])
    apart = max(min(SPACING, length / (2 * WORST)), length / (10 * WORST))
    found: list[int] = []
    for n in np.argsort(-np.nan_to_num(badness, nan=-np.inf), kind="stable"):
        if len(found) == WORST or not np.isfinite(badness[n]):
            break
        crowded = any(abs(times[n] - times[m]) < apart for m in found)
        if not crowded and not (blank[n] and blank[found].sum() >= MAX_LOST):
            found.append(int(n))
    return sorted(found)


def _typical_frames(badness: Array, times: Array, blank: NDArray[np.bool_]) -> list[int]:
    """Frames whose error is nearest to the median, one in each half of the run."""
    known = np.flatnonzero(np.isfinite(badness) & ~blank)
    if len(known) < 4 * (WORST + TYPICAL):
        return []
    middle = np.median(badness[known])
    return [int(part[np.abs(badness[part] - middle).argmin()]) for part in np.array_split(known, TYPICAL)]


def _mean_errors(distance: Array, known: NDArray[np.bool_]) -> Array:
    """Mean error (T,), metres, over the joints with a truth."""
    counts = known.sum(1)
    return np.where(counts > 0, np.where(known, distance, 0).sum(1) / np.maximum(counts, 1), np.nan)


def _worst_joints(of: Evaluation, n: int) -> tuple[tuple[str, float], ...]:
    """The three joints of greatest error in a frame."""
    if of.errors is None:
        return ()
    distance = np.where(of.errors.known[n], of.errors.distance[n], -1)
    order = [int(j) for j in np.argsort(-distance)[:3] if distance[j] >= 0]
    return tuple((of.errors.names[j], LOST_ERROR * 1000 if of.errors.lost[n, j] else float(1000 * distance[j])) for j in order)


def _tables(of: Evaluation, frame: int) -> list[tuple[JointTable, bool]]:
    """Joints of the run and, if known, of the truth in a frame; each with whether it is the run's."""
    truth = _truth_at(of, frame)
    return [(_run_at(of, frame), True)] + ([(truth, False)] if truth is not None else [])


def _truth_at(of: Evaluation, frame: int) -> JointTable | None:
    return None if of.truth is None else at_times(of.truth, of.run.motion.times[frame : frame + 1])


def _run_at(of: Evaluation, frame: int) -> JointTable:
    motion = of.run.motion
    return JointTable(motion.times[frame : frame + 1], motion.joint_names, motion.joints[frame : frame + 1])


def _scaled(image: Image, *, height: int | None = None, width: int | None = None) -> Image:
    import cv2

    scale = height / image.shape[0] if height else (width or image.shape[1]) / image.shape[1]
    if scale == 1:
        return image
    size = (max(1, round(scale * image.shape[1])), height or max(1, round(scale * image.shape[0])))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC), np.uint8)


def _jpeg(image: Image) -> bytes:
    import cv2

    small = _scaled(image, width=MAX_WIDTH) if image.shape[1] > MAX_WIDTH else image
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 82])
    assert done
    return data.tobytes()
