"""Make docs/assets/puppet.webp, the moving picture of the README: python docs/make_readme_picture.py [FOLDER]. Takes a minute.

A person jogs on the spot in front of four synthetic cameras. Shown are the films, the silhouettes with the estimated skeleton, and the body
model with the surface points of the visual hull, from a camera that orbits it once. FOLDER keeps the recording and its run for reuse.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import BONES
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.drawing import draw_model, draw_skeleton
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.synthetic import Gesture, Mannequin, Ring, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.video import open_frames

TARGET, LARGEST = Path(__file__).parent / "assets" / "puppet.webp", 1_000_000
"""The picture, and its maximum size in bytes."""
RATE, EVERY, LOOP = 24, 2, (60, 90)
"""Frame rate of the films, step between displayed frames, and the least and greatest length of the loop in frames."""
TILE, PANEL, GAP, FINER = (132, 180), (300, 364), 4, 2
"""Pixels of a camera's panel, of the body model's panel, and of the gap; oversampling factor."""
MARGIN, QUALITY = 0.08, 60
"""Margin around the person, as a share of the panel; WebP quality, of 100."""
GROUND, GRID, DOT, SHADOW = (34, 29, 26), (66, 58, 52), (170, 160, 150), (236, 236, 236)
"""Colours (BGR) of the background, the floor's lines, surface points and silhouettes. A dark background works on light and dark pages."""
CERTAIN = 0.4
"""Minimum weight of the drawn surface points, as a share of the greatest weight."""
ROUND = Viewpoint(size=(PANEL[0] * FINER, PANEL[1] * FINER), fov_deg=20, distance=5.2, height=1.5, pitch_deg=7)
"""The first position of the camera that orbits the body model."""


class Seen(NamedTuple):
    """The frames of the loop."""

    cameras: list[Camera]
    images: list[list[np.ndarray]]
    """By camera, then by frame."""
    masks: list[list[np.ndarray]]
    body: Body
    poses: Array


def made(folder: Path) -> tuple[Path, Path]:
    """The recording and its run."""
    spec = Spec(name="jog", body=Mannequin(stature=1.74), motion=(Gesture(motion="jog", seconds=5, path="spot"),), rate=RATE,
                ring=Ring(count=4, radius=4.6, start_deg=35, jitter=0.4, fov_deg=34, seed=3, size=(480, 360)),
                scene=Scene(clothing=8, room=3, empty_seconds=1.5, noise=1.0))  # fmt: skip
    recording, run = folder / "recording", folder / "run"
    if not recording.exists():
        synthesize(spec, recording, np.random.default_rng(1))
    if not run.exists():
        track_recording(recording, run, make_options({"seed": 1}))
    return recording, run


def looked_at(recording: Path, run: Path) -> Seen:
    """The frames between the two most similar poses."""
    cameras, motion = list(read_calibration(recording / "calibration.toml")), read_run(run).motion
    first, length = loop_of(motion.poses)
    chosen = range(first, first + length, EVERY)
    images, masks = ([[frame.image for n, frame in enumerate(open_frames(recording / kind / f"{camera.name}{ending}")) if n in chosen]
                      for camera in cameras] for kind, ending in (("video", ".mp4"), ("masks", ".mkv")))  # fmt: skip
    body = make_body(motion.body_name, read_person(run / "person.toml", motion.body_name).sizes)
    return Seen(cameras, images, [[ready_mask(mask) for mask in each] for each in masks], body, motion.poses[list(chosen)])


def loop_of(poses: Array) -> tuple[int, int]:
    """First frame and number of frames of a loop whose end matches its beginning in pose and motion."""
    apart = {(a, n): sum(np.abs(poses[a + k] - poses[a + n + k]).max() for k in (0, 1))
             for n in range(*LOOP, EVERY) for a in range(RATE, len(poses) - n - 1)}  # fmt: skip
    return min(apart, key=lambda key: apart[key])


def window(masks: list[np.ndarray]) -> Array:
    """Affine map (2, 3) from a camera's pixels to its panel: the whole person, in all frames, centred."""
    rows, columns = (np.flatnonzero(np.any(masks, axis=0).any(axis)) for axis in (1, 0))
    wide, high = FINER * TILE[0], FINER * TILE[1]
    scale = min(wide / np.ptp(columns), high / np.ptp(rows)) / (1 + 2 * MARGIN)
    middle = np.array([columns[0] + columns[-1], rows[0] + rows[-1]]) / 2
    return np.column_stack([scale * np.eye(2), np.array([wide, high]) / 2 - scale * middle])


def tiles(seen: Seen, n: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Panels of one frame: the cameras' images; and the silhouettes with the skeleton."""
    films, shadows, size = [], [], (FINER * TILE[0], FINER * TILE[1])
    for camera, images, masks in zip(seen.cameras, seen.images, seen.masks):
        part = window(masks)
        films.append(cv2.warpAffine(images[n], part, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE))
        mask = cv2.warpAffine(masks[n].astype(np.float32), part, size, flags=cv2.INTER_CUBIC)[..., None].clip(0, 1)
        shadows.append(np.uint8(np.array(GROUND) * (1 - mask) + np.array(SHADOW) * mask))
        near = replace(camera, size=size, matrix=np.vstack([part, [0, 0, 1]]) @ camera.matrix)
        draw_skeleton(shadows[-1], Picture(seen.body, near, near.T_camera_world), seen.poses[n])
    return films, shadows


def puppet(seen: Seen, hull: VisualHull, n: int) -> np.ndarray:
    """Panel of the body model on the floor with the hull's points, from the orbiting camera."""
    azimuth = (360 * n / len(seen.poses) + 205) % 360 - 180
    camera, pose = replace(ROUND, azimuth_deg=azimuth).camera(), seen.poses[n]
    out = np.full((*camera.size[::-1], 3), GROUND, np.uint8)
    ends = np.linspace(-1, 1, 5)
    for a, b in [*(((x, -1, 0), (x, 1, 0)) for x in ends), *(((-1, y, 0), (1, y, 0)) for y in ends)]:
        line(out, camera, a, b, GRID, 2)
    names, joints = seen.body.landmark_names, seen.body.points(pose[None])[0]
    dark = np.zeros(out.shape[:2], np.uint8)
    for a, b in BONES:  # a light high above
        if a in names and b in names:
            line(dark, camera, *(joints[names.index(end)] * (1, 1, 0) for end in (a, b)), 255, 14 * FINER)
    out = np.uint8(out * (1 - 0.55 * cv2.GaussianBlur(dark, (0, 0), 5 * FINER)[..., None] / 255))
    surface = hull.points([masks[n] for masks in seen.masks])
    points, near = surface.points, ((camera.centre - surface.points) * surface.normals).sum(1) > 0
    certain = surface.weights > CERTAIN * surface.weights.max()
    dots(out, camera, points[certain & ~near])
    drawn = out.copy()
    draw_model(drawn, Picture(seen.body, camera, camera.T_camera_world), pose)
    dots(drawn, camera, points[certain & near])
    return drawn


def line(out: np.ndarray, camera: Camera, a, b, colour, thickness: int) -> None:
    """Draw a line in space."""
    start, end = np.rint(camera.project(np.array([a, b], float)) * 16).astype(int).tolist()
    cv2.line(out, start, end, colour, thickness, cv2.LINE_AA, 4)


def dots(out: np.ndarray, camera: Camera, points: Array) -> None:
    """Draw points in space."""
    for pixel in np.rint(camera.project(points) * 16).astype(int).tolist():
        cv2.circle(out, pixel, FINER * 9, DOT, -1, cv2.LINE_AA, 4)


def frame(seen: Seen, hull: VisualHull, n: int) -> np.ndarray:
    """One frame of the animation: films, silhouettes, body model."""
    films, shadows = tiles(seen, n)
    parts = [*(beside([stacked(each[:2]), stacked(each[2:])]) for each in (films, shadows)), puppet(seen, hull, n)]
    for part, what in zip(parts, ("films", "silhouettes", "puppet")):
        for ink, thickness in (((0, 0, 0), 3 * FINER), ((255, 255, 255), FINER)):
            cv2.putText(part, what, (6 * FINER, len(part) - 8 * FINER), cv2.FONT_HERSHEY_SIMPLEX, 0.5 * FINER, ink, thickness, cv2.LINE_AA)
    whole = beside(parts)
    return cv2.resize(whole, (whole.shape[1] // FINER, whole.shape[0] // FINER), interpolation=cv2.INTER_AREA)


def beside(images: list[np.ndarray]) -> np.ndarray:
    """Images of equal height side by side, with gaps."""
    gap = np.full((images[0].shape[0], GAP * FINER, 3), GROUND, np.uint8)
    return np.concatenate([piece for image in images for piece in (gap, image)][1:], axis=1)


def stacked(images: list[np.ndarray]) -> np.ndarray:
    """Images of equal width, one below the other, with gaps."""
    return beside([image.transpose(1, 0, 2) for image in images]).transpose(1, 0, 2).copy()


def main() -> None:
    """Write the picture."""
    with tempfile.TemporaryDirectory() as scratch:
        seen = looked_at(*made(Path(sys.argv[1] if len(sys.argv) > 1 else scratch)))
    hull, film = VisualHull(seen.cameras), cv2.Animation()
    film.frames = [frame(seen, hull, n) for n in range(len(seen.poses))]
    film.durations = [1000 * EVERY // RATE] * len(film.frames)
    cv2.imwriteanimation(str(TARGET), film, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    size, shape = TARGET.stat().st_size, film.frames[0].shape
    print(f"{TARGET}: {size} bytes, {len(film.frames)} frames of {shape[1]} x {shape[0]}")
    if size > LARGEST:
        sys.exit(f"{TARGET}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
