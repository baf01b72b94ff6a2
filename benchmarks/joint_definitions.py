"""How much of a run's error is another definition of the joints: offsets of its joints from the truth's, constant in the limbs' frames.

    python benchmarks/joint_definitions.py RECORDING RUN [--pixels 5.6]

A detector's knee, a mesh's and an anatomist's are points of the thigh some centimetres apart, whatever the pose. Each joint of the run
loses the offset, constant in the segment that carries it (shoulders: the chest; elbows: the upper arm; hips: the pelvis; ...), that is best
in one half of the film, and the error is measured in the other half, and the other way round: an offset that does not stay is no
definition. What it takes away no tracker can gain against that truth without learning its definition from it; what is left is tracking.

`--pixels`: by how much the calibration is known to be off; the table's last line says what that is in space, at the person.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.person import read_person
from shadowpuppet.io.recording import Recording, read_recording
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.metrics import LIMB_JOINTS, joint_errors
from shadowpuppet.motion.motion import JointTable

PARTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")


def carrier(body: Body, name: str) -> int:
    """Index of the joint whose frame is the segment above a landmark: the chest's for a shoulder, the forearm's for a wrist."""
    joint, place = body.landmarks[name]
    skeleton = body.skeleton
    parent = skeleton.joints[skeleton.joint_index(joint)].parent
    return skeleton.joint_index(joint if any(place) or parent is None else parent)


def in_segments(body: Body, poses: Array, delta: Array) -> Array:
    """Differences (T, J, 3) of the limb joints, world, along the axes of the segments that carry them, of poses (T, D)."""
    frames = body.skeleton.forward(np.nan_to_num(poses))[..., :3]
    turned = [np.einsum("tji,tj->ti", frames[:, carrier(body, name)], delta[:, k]) for k, name in enumerate(LIMB_JOINTS)]
    return np.stack(turned, 1)


def without_offsets(delta: Array) -> tuple[Array, Array]:
    """What is left (T, J, 3) of differences when each half of the frames loses the other half's mean, and the mean of all (J, 3)."""
    half, left = np.arange(len(delta)) < len(delta) // 2, delta.copy()
    for one in (half, ~half):
        left[one] -= np.nanmean(delta[~one], axis=0)
    return left, np.nanmean(delta, axis=0)


def off_by(recording: Recording, joints: JointTable, pixels: float) -> float:
    """Size (m) at the person of a number of pixels, the mean over cameras."""
    middle = np.nanmean(joints.positions, axis=(0, 1))
    sizes = []
    for view in recording.views:
        camera = view.camera
        depth = float(np.linalg.norm(middle - camera.centre))
        sizes.append(pixels * depth / float(camera.matrix[0, 0]))
    return float(np.mean(sizes))


def table(recording: Recording, folder: Path, pixels: float) -> str:
    """Mean distances (mm) by joint, as they are and without the constant offsets; the offsets."""
    run, truth = read_run(folder).motion, read_joints(recording.truth)  # pyright: ignore[reportArgumentType]
    person = read_person(folder / "person.toml")
    name = "cylinders" if type(person.sizes).__name__.startswith("Cylinder") else "anatomical"
    body = make_body(name, person.sizes)
    nearest = [int(np.abs(run.times - time).argmin()) for time in truth.times]
    delta = 1000 * in_segments(body, run.poses[nearest], joint_errors(run.table, truth, LIMB_JOINTS).delta)
    left, offsets = without_offsets(delta)
    before, after = np.linalg.norm(delta, axis=2), np.linalg.norm(left, axis=2)
    lines = ["| | error | without the offset | offset | forward | left | up |", "|---|" + 6 * "---:|"]
    for part in (*PARTS, "all"):
        k = [n for n, name in enumerate(LIMB_JOINTS) if name.endswith(part) or part == "all"]
        mean, size = offsets[k].mean(0), np.linalg.norm(offsets[k], axis=1).mean()
        axes = "| " * 3 if part == "all" else "".join(f"| {each:.0f} " for each in mean)
        lines.append(f"| {part} | {np.nanmean(before[:, k]):.1f} | {np.nanmean(after[:, k]):.1f} | {size:.1f} {axes}|")
    if pixels:
        lines.append(f"\n{pixels:g} pixels are {1000 * off_by(recording, truth, pixels):.0f} mm at the person, in each picture.")
    return "\n".join(lines)


def _smallest(folder: Path) -> list[object]:
    return [*smallest.track(folder, smallest.RING), "--pixels", 1]


def main() -> None:
    """Parse, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("--pixels", type=float, default=0.0, help="error of the calibration")
    args = smallest.parse(parser, _smallest)
    print(table(read_recording(args.recording), args.run, args.pixels))


if __name__ == "__main__":
    main()
