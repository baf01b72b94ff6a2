"""The worst frames of a run of several cameras, drawn.

    python benchmarks/worst_frames.py RECORDING RUN -o FILE.png [--frames 5] [--cameras 4]

Outlines over the pictures: red what was found, green the true joints' pose with the same sizes, white the exact silhouette, where there
is one. Frames are those of the greatest mean error over the limb joints, at least half a second apart; which, and which joints are far
off, is printed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
import smallest

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.person import read_person
from shadowpuppet.io.recording import Recording, View, read_recording
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.metrics import LIMBS, joint_errors
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.video import open_frames, write_image

FOUND, TRUE, EXACT, TILE, MARGIN = (0, 0, 255), (0, 255, 0), (255, 255, 255), 400, 20
"""Colours (blue green red), and pixels of a tile and around the person in it."""


def worst(run: JointTable, truth: JointTable, count: int, apart: float = 0.5) -> list[int]:
    """Frames of the truth with the greatest mean error, `apart` seconds or more from one another, in order of time; tells them."""
    errors = 1000 * joint_errors(run, truth, LIMBS).distance
    chosen: list[int] = []
    for n in np.argsort(-np.nan_to_num(errors.mean(1), nan=-1)):
        if len(chosen) < count and all(abs(truth.times[n] - truth.times[m]) >= apart for m in chosen):
            chosen.append(int(n))
    for n in sorted(chosen):
        far = ", ".join(f"{name} {error:.0f}" for name, error in zip(LIMBS, errors[n]) if error > 50)
        print(f"frame {n}, {truth.times[n]:.2f} s: {errors[n].mean():.0f} mm; over 50 mm: {far or 'none'}")
    return sorted(chosen)


def tiles(view: View, body: Body, poses: list[tuple[int, Array, Array]]) -> list[np.ndarray]:
    """A view's pictures of some frames, each with the pose found (D,) and the true one (D,)."""
    picture, out = Picture(body, view.camera, view.camera.T_camera_world), []
    films = [open_frames(view.video), open_frames(view.masks, grey=True) if view.masks is not None else open_frames(view.video)]
    wanted = {n: (found, true) for n, found, true in poses}
    for n, (frame, exact) in enumerate(zip(*films)):
        if n not in wanted:
            continue
        image = np.ascontiguousarray(frame.image)
        shown = [(picture.mask(pose), colour) for pose, colour in zip(wanted[n], (FOUND, TRUE)) if np.isfinite(pose).all()]
        shown += [(exact.image > 127, EXACT)] if view.masks is not None else []
        for mask, colour in shown:
            cv2.drawContours(image, cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0], -1, colour, 1)
        out.append(_tile(image, np.any([mask for mask, _ in shown], axis=0), f"{view.camera.name} {n}"))
    return out


def _tile(image: np.ndarray, around: np.ndarray, text: str) -> np.ndarray:
    """The part of a picture in which something is, scaled to a tile."""
    out = np.zeros((TILE, TILE, 3), np.uint8)
    y, x = np.nonzero(around) if around.any() else np.nonzero(np.ones_like(around))
    part = image[max(y.min() - MARGIN, 0) : y.max() + MARGIN, max(x.min() - MARGIN, 0) : x.max() + MARGIN]
    part = cv2.resize(part, None, fx=TILE / max(part.shape[:2]), fy=TILE / max(part.shape[:2]), interpolation=cv2.INTER_CUBIC)[:TILE, :TILE]
    out[: part.shape[0], : part.shape[1]] = part
    return np.asarray(cv2.putText(out, text, (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 255, 255)))


def draw(recording: Recording, folder: Path, count: int, cameras: int) -> np.ndarray:
    """A row a camera, a column a frame."""
    run, truth = read_run(folder).motion, read_joints(recording.truth)  # pyright: ignore[reportArgumentType]
    person = read_person(folder / "person.toml")
    name = "cylinders" if type(person.sizes).__name__.startswith("Cylinder") else "anatomical"
    fitted = fit_poses(truth, name, person.sizes)  # pyright: ignore[reportArgumentType]
    frames = worst(run.table, truth, count)
    nearest = [int(np.abs(run.times - truth.times[n]).argmin()) for n in frames]
    poses = [(n, run.poses[m], fitted.poses[n]) for n, m in zip(frames, nearest)]
    return np.vstack([np.hstack(tiles(view, fitted.body, poses)) for view in recording.views[:cameras]])


def _smallest(folder: Path) -> list[object]:
    recording, run = smallest.track(folder, smallest.RING)
    return [recording, run, "--output", folder / "worst.png", "--frames", 2, "--cameras", 2]


def main() -> None:
    """Parse, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("worst.png"))
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--cameras", type=int, default=4)
    args = smallest.parse(parser, _smallest)
    write_image(args.output, draw(read_recording(args.recording), args.run, args.frames, args.cameras))


if __name__ == "__main__":
    main()
