"""Make docs/assets/several.png, hull.png, parts.png, forces.png and bodies.png: python docs/rig_pictures.py [DEMO_FOLDER]; without a
folder, the demo runs first."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.synthesize import run_demo
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.synthetic import Ring, Spec
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import ForceSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.video import open_frames, write_image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.speed import naive_multi as naive

ASSETS = Path(__file__).parent / "assets"
FRAME, SHARE = 34, 0.3
"""Index of the frame of points and parts, and the share of the film before the overlay's."""
LARGE, GREYS, PAPER = 3, 6, 235
"""Magnification; quantisation step of the grey levels; background of drawings."""
NORMAL, NEAREST = 0.045, 2.0
"""Length of a normal, and minimum distance of the drawn points (m)."""
TAU = 0.06
"""Bound of the forces (m)."""
PALETTE = [(180, 119, 31), (14, 127, 255), (44, 160, 44), (40, 39, 214), (189, 103, 148), (75, 86, 140), (194, 119, 227), (34, 189, 188),
           (207, 190, 23), (120, 60, 20), (0, 0, 160), (0, 110, 0), (160, 0, 160), (160, 120, 0), (60, 60, 60), (0, 160, 220),
           (200, 80, 80)]  # fmt: skip
"""Blue, green, red of each part's points."""


class Scene(NamedTuple):
    """A frame of a run with several cameras."""

    cameras: tuple[Camera, ...]
    images: list[np.ndarray]
    surface: SurfacePoints
    body: Body
    pose: Array


def scene(folder: Path) -> Scene:
    """Images, surface points of the exact silhouettes, and estimated pose of one frame of the demo."""
    recording, run = folder / "recording-ring", read_run(folder / "run-ring")
    cameras = tuple(read_calibration(recording / "calibration.toml"))
    images, masks = ([list(open_frames(recording / kind / f"{camera.name}{ending}"))[FRAME].image for camera in cameras]
                     for kind, ending in (("video", ".mp4"), ("masks", ".mkv")))  # fmt: skip
    body = make_body(run.motion.body_name, read_person(folder / "run-ring" / "person.toml", run.motion.body_name).sizes)
    return Scene(cameras, images, VisualHull(cameras).points([ready_mask(mask) for mask in masks]), body, run.motion.poses[FRAME])


def enlarged(camera: Camera, image: np.ndarray | None = None) -> tuple[Camera, np.ndarray]:
    """A camera with enlarged images, and one of these."""
    size = camera.size[0] * LARGE, camera.size[1] * LARGE
    ground = np.full((*size[::-1], 3), PAPER, np.uint8) if image is None else cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
    return camera.resized(size), np.asarray(ground, np.uint8)


def lines(out: np.ndarray, camera: Camera, starts: Array, ends: Array, colour: tuple[int, int, int], tips: bool = False) -> None:
    """Draw lines in space, from dots or to arrow heads."""
    a, b = (np.rint(camera.project(points)).astype(int).tolist() for points in (starts, ends))
    for start, end in zip(a, b):
        if tips:
            cv2.arrowedLine(out, start, end, colour, 1, cv2.LINE_AA, tipLength=0.25)
        else:
            cv2.line(out, start, end, colour, 1, cv2.LINE_AA)
            cv2.circle(out, start, 2, colour, -1, cv2.LINE_AA)


def facing(camera: Camera, points: Array, normals: Array) -> np.ndarray:
    """Mask (P,) of the points that face a camera and are not close in front of it."""
    away = camera.centre - points
    return ((away * normals).sum(1) > 0) & (np.linalg.norm(away, axis=1) > NEAREST)


def hull(found: Scene) -> np.ndarray:
    """Points with normals over two images, and over the fitted body."""
    tiles, (points, normals) = [], found.surface[:2]
    for n in (0, 1):
        camera, image = enlarged(found.cameras[n], found.images[n])
        drawn = enlarged(found.cameras[n])[1]
        draw_model(drawn, Picture(found.body, camera, camera.T_camera_world), found.pose)
        near = facing(camera, points, normals)
        for tile in (image, drawn):
            lines(tile, camera, points[near], points[near] + NORMAL * normals[near], (40, 40, 200))
            tiles.append(cropped(tile, camera, found.body.points(found.pose[None])[0]))
    return row(tiles)


def nearest(body: Body, pose: Array, points: Array, normals: Array, epsilon: float = 0.3) -> tuple[np.ndarray, Array, Array]:
    """The nearest part (P,) of each point, the closest point on it (P, 3), and the cosine of the normals (P,)."""
    assert body.limbs is not None
    T, _ = naive.place(body.skeleton, pose)
    each = [naive.closest(body.limbs, s, T[joint], points) for s, joint in enumerate(body.limbs.joints)]
    cosines = np.array([(one.normals * normals).sum(1) for one in each])
    which = (np.abs([one.distance for one in each]) * (1 - epsilon * cosines)).argmin(0)
    own = which, np.arange(len(points))
    return which, np.array([one.feet for one in each])[own], cosines[own]


def parts(found: Scene) -> np.ndarray:
    """Points in the colour of their body part."""
    which = nearest(found.body, found.pose, *found.surface[:2])[0]
    tiles = []
    for n in range(4):
        camera, tile = enlarged(found.cameras[n])
        near = facing(camera, *found.surface[:2])
        for pixel, part in zip(np.rint(camera.project(found.surface.points[near])).astype(int).tolist(), which[near]):
            cv2.circle(tile, pixel, 4, PALETTE[part % len(PALETTE)], -1, cv2.LINE_AA)
        tiles.append(cropped(tile, camera, found.body.points(found.pose[None])[0]))
    return row(tiles)


def forces(found: Scene) -> np.ndarray:
    """A displaced arm and the forces on it (eq. 32); after 20 and 100 iterations; after 10 of Gauss-Newton."""
    skeleton, cloud, refiner = found.body.skeleton, make_cloud(*found.surface[:3]), Refiner(found.body)
    settled = refiner.gauss_newton(found.pose[None], ((cloud, 10, 0.05),), found.pose[None], np.full(len(found.pose), 1e-5))[0]
    side = "left"
    pose = settled.copy()
    pose[skeleton.dof_indices((f"{side}_shoulder_y", f"{side}_elbow_flexion"))] += 0.08, 0.3
    pulled = [refiner.forces(pose[None], cloud, ForceSettings(iterations=n))[0] for n in (20, 100)]
    solved = refiner.gauss_newton(pose[None], ((cloud, 10, 0.05),), pose[None], np.full(len(pose), 1e-5))[0]
    parts, tiles = [f"{side}_{part}" for part in ("upper_arm", "forearm", "hand")], []
    arm = [s for s, part in enumerate(found.body.limbs.parts) if part in parts]  # pyright: ignore
    about = found.body.points(settled[None], names=[f"{side}_shoulder", f"{side}_elbow", f"{side}_hand"])[0]
    for shown in (pose, *pulled, solved):
        camera, tile = enlarged(found.cameras[1])
        draw_model(tile, Picture(found.body, camera, camera.T_camera_world), shown)
        tile[:] = np.uint8(0.45 * tile + 0.55 * PAPER)
        which, feet, cosines = nearest(found.body, shown, *found.surface[:2])
        mine = np.isin(which, arm) & (cosines > 0)
        points, feet = found.surface.points[mine], feet[mine]
        away = np.linalg.norm(points - feet, axis=1) + 1e-9
        force = (points - feet) * (np.minimum(cosines[mine] * away, TAU) / away)[:, None]
        lines(tile, camera, points, points, (40, 40, 40))
        lines(tile, camera, feet, feet + force, (40, 40, 220), tips=True)
        tiles.append(cropped(tile, camera, about, 70))
    return row(tiles)


def bodies() -> np.ndarray:
    """Both whole bodies from the front, the side, and in a stride from between."""
    tiles = []
    for name in ("cylinders", "anatomical"):
        body = make_body(name, average_sizes(name, 1.75))
        stand, stride = body.skeleton.pose(root_z=0.95), body.skeleton.pose(root_z=0.93, **striding(body))
        for pose, azimuth in ((stand, 90), (stand, 0), (stride, 50)):
            camera = Spec(ring=Ring(count=2, radius=5.0, height=1.2, start_deg=azimuth, fov_deg=11, size=(200, 400))).views()[0].camera()
            tile = np.full((400, 200, 3), PAPER, np.uint8)
            draw_model(tile, Picture(body, camera, camera.T_camera_world), pose)
            tiles.append(tile)
    return row(tiles)


def striding(body: Body) -> dict[str, float]:
    """Angles of a stride."""
    named = {"left_elbow_flexion": 0.5, "right_elbow_flexion": 0.7, "left_knee_flexion": 0.15, "right_knee_flexion": 0.6}
    swings = {"left_shoulder": -0.5, "right_shoulder": 0.6, "left_hip": 0.5, "right_hip": -0.25}
    turns = {f"{joint}_flexion": angle for joint, angle in swings.items()} | {f"{joint}_y": -angle for joint, angle in swings.items()}
    return named | {name: angle for name, angle in turns.items() if name in body.skeleton.dof_names}


def overlay(folder: Path) -> np.ndarray:
    """A frame of the overlay film."""
    frames = list(open_frames(folder / "run-ring" / "overlay.mp4"))
    return np.asarray(cv2.bilateralFilter(frames[round(SHARE * len(frames))].image, 7, 30, 3) // GREYS * GREYS, np.uint8)


def cropped(image: np.ndarray, camera: Camera, points: Array, margin: int = 85) -> np.ndarray:
    """The part of an image around projected points (P, 3)."""
    pixels = camera.project(points)
    (x0, y0), (x1, y1) = (pixels.min(0) - margin).astype(int).clip(0), (pixels.max(0) + margin).astype(int)
    return image[y0:y1, x0:x1]


def row(tiles: list[np.ndarray], height: int = 430) -> np.ndarray:
    """Pictures of one height, side by side."""
    scaled = [cv2.resize(tile, (round(tile.shape[1] * height / tile.shape[0]), height), interpolation=cv2.INTER_AREA) for tile in tiles]
    return np.asarray(np.concatenate(scaled, axis=1) // GREYS * GREYS, np.uint8)


def main() -> None:
    """Write the pictures, from an existing or a new demo."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else made)
        if len(sys.argv) < 2:
            run_demo(folder, Options(overlay=True))
        found = scene(folder)
        pictures = {"several": overlay(folder), "hull": hull(found), "parts": parts(found), "forces": forces(found), "bodies": bodies()}
    for name, image in pictures.items():
        write_image(ASSETS / f"{name}.png", image)
        print(f"{ASSETS / name}.png: {(ASSETS / f'{name}.png').stat().st_size} bytes")


if __name__ == "__main__":
    main()
