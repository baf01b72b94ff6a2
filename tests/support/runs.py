"""Run folders of known motion, of any body, without tracking: for the tests of what is made of runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.body.models import MODELS, average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.geometry import Array, rigid, rotation_about
from shadowpuppet.io.people import open_places, person_folder, write_place
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import MotionFrame

BODIES = tuple(MODELS)
ROOT = rigid(rotation_about([0, 0, 1], 2.0), [0.3, -1.2, 1.05])
"""Where an upper body's frame stands in the world: as a camera put it there."""
RATE = 25.0


def body_of(name: str, height: float = 1.78) -> Body:
    return make_body(name, average_sizes(name, height))


def smooth_poses(body: Body, frames: int, rng: np.random.Generator, reach: float = 0.6) -> Array:
    """Poses (T, D) that go through much of the limits, a slow wave a degree of freedom; a whole body turns more than once around."""
    low, high = (np.clip(limit, -2.0, 2.0) for limit in body.skeleton.limits)
    waves = np.sin(2 * np.pi * np.outer(np.arange(frames) / 50, rng.uniform(0.3, 1.0, len(low))) + rng.uniform(0, 6, len(low)))
    poses = (low + high) / 2 + reach * (high - low) / 2 * waves
    names = body.skeleton.dof_names
    if "root_heading" in names:
        poses[:, names.index("root_heading")] = np.linspace(0, 7, frames)
        poses[:, names.index("root_z")] = 0.95
        poses[:, [names.index("root_bow"), names.index("root_tilt")]] *= 0.3  # so that up is where the head is
    return poses


def root_of(body: Body) -> Array:
    return np.eye(4) if body.limbs is not None else ROOT


def make_run(folder: Path, name: str = "anatomical", frames: int = 40, seed: int = 1, lost: tuple[int, ...] = (), spread: bool = False,
             times: Array | None = None, person: bool = True, doubtful: dict[int, dict[str, str]] | None = None) -> Path:  # fmt: skip
    """A finished run of a body's smooth poses; `lost`: frames that are; `spread`: with standard deviations; `doubtful`: statuses, by frame
    and limb, of limbs that are not tracked."""
    body, rng = body_of(name), np.random.default_rng(seed)
    poses = smooth_poses(body, frames, rng)
    joints = [landmark for landmark in body.landmark_names if not landmark.endswith("_fist")]
    places = body.points(poses, root_of(body), joints)
    times = np.arange(frames) / RATE if times is None else times
    with RunWriter(folder, name, body.skeleton.dof_names, joints, {"recording": "made"}) as run:
        if person:
            write_person(run.folder / "person.toml", Person(average_sizes(name, 1.78), 1.78, "tests"))
        for t in range(frames):
            if t in lost:
                run.write(MotionFrame(times[t], "lost"))
            else:
                sd = {"joint_sd": rng.uniform(0.001, 0.03, places[t].shape)} if spread else {}
                limbs = [(doubtful or {}).get(t, {}).get(limb, "tracked") for limb in limbs_of(joints)]
                run.write(MotionFrame(times[t], "tracked", poses[t], places[t], cost=10.0, overlap=0.9, limb_status=limbs, **sd))
    return folder


def make_people(folder: Path, number: int = 2, frames: int = 12) -> Path:
    """A finished run of several people, the second of whom is seen from frame 2 on."""
    for n in range(1, number + 1):
        times = np.arange(frames) / RATE + (2 / RATE if n == 2 else 0)
        make_run(person_folder(folder, n), frames=frames, seed=n, spread=True, times=times)
    with open_places(folder) as file:
        for n in range(1, number + 1):
            write_place(file, 0.0, n, "tracked", np.array([float(n), 0.0]))
    (folder / "run.toml").write_text((person_folder(folder, 1) / "run.toml").read_text())
    return folder
