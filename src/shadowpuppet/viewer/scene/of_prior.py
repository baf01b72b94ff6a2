"""A motion prior to be shown: the mean posture of each region, and a motion drawn from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import MODELS, average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.prior import read_prior
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.video.frames import ASSUMED_RATE
from shadowpuppet.viewer.scene.figures import of_poses
from shadowpuppet.viewer.scene.show import Figure, Show

SECONDS = 10.0
"""Of the motion that is drawn."""
APART, BEHIND = 1.1, 1.6
"""Metres between mean postures, and from them to who moves."""
SETTLED = 1 << 20
"""Steps of the chain after which it has forgotten where it began."""


def show_prior(path: Path, seed: int = 0) -> Show:
    """A prior as `fit-prior` saves it. Raises `FormatError` where it is none, or of no body that there is."""
    prior = read_prior(path)
    body = body_of(path, prior)
    rate = prior.rate or ASSUMED_RATE
    times = np.arange(round(SECONDS * rate)) / rate
    drawn = drawn_motion(np.random.default_rng(seed), prior, len(times))
    walker = of_poses("drawn from the prior", body, times, standing(body, prior, drawn), np.eye(4))
    shares = resting(prior)
    means, labels = [], []
    for n, mean in enumerate(standing(body, prior, prior.subspaces.centres)):
        place = _place(n, len(shares))
        means.append(_still(f"region {n + 1}", body, mean, place))
        labels.append((f"{n + 1}: {100 * shares[n]:.0f} %", (place[0], place[1], 2.05)))
    facts = {"prior": str(path), "body": body.name, "regions": f"{len(shares)}, the mean posture of each, and the share of time in it",
             "rate": f"{rate:g} frames/s"}  # fmt: skip
    return Show(title=path.name, times=times, figures=(walker, *means), labels=tuple(labels), facts=facts,
                notes=("Who moves is drawn at random from the prior alone, frame by frame, as the tracker proposes poses before it "
                       "looks: no one's recorded motion.",))  # fmt: skip


def body_of(path: Path, prior: MotionPrior) -> Body:
    """The average person of the body whose degrees of freedom a prior names. Raises `FormatError` where there is none."""
    for name in reversed(MODELS):
        body = make_body(name, average_sizes(name, AVERAGE_HEIGHT))
        if prior.names and set(prior.names) <= set(body.skeleton.dof_names):
            return body
    told = f"{prior.names[0]}, ..." if prior.names else "none"
    raise FormatError(f"{path}: names: found {told}, expected degrees of freedom of one of {', '.join(MODELS)}")


def drawn_motion(rng: np.random.Generator, prior: MotionPrior, frames: int) -> Array:
    """Poses (T, D) of the prior's numbers, each proposed from the one before (Ni 2008, V-A, step 3)."""
    region = rng.choice(len(prior.initial), p=prior.initial / prior.initial.sum())
    poses, regions = prior.subspaces.centres[[region]], np.array([region])
    out = np.empty((frames, poses.shape[1]))
    for n in range(frames):
        out[n] = poses[0]
        poses, regions = prior.propose(rng, poses, regions)
    return out


def standing(body: Body, prior: MotionPrior, values: Array) -> Array:
    """Whole poses (N, D) of a prior's numbers, all else at rest, with the lowest point on the floor."""
    skeleton = body.skeleton
    poses = np.tile(skeleton.clamp(np.zeros((1, len(skeleton.dofs)))), (len(values), 1))
    poses[:, skeleton.dof_indices(prior.names)] = values
    poses = skeleton.clamp(poses)
    if "root_z" in skeleton.dof_names:
        poses[:, skeleton.dof_names.index("root_z")] -= body.points(poses)[:, :, 2].min(1) - 0.08
    return poses


def resting(prior: MotionPrior) -> Array:
    """The share (M,) of time that the chain spends in each region in the long run."""
    lazy = (np.eye(len(prior.initial)) + prior.transitions) / 2  # so that chains that alternate settle too
    share = prior.initial @ np.linalg.matrix_power(lazy, SETTLED)
    return share / share.sum()


def _still(name: str, body: Body, pose: Array, place: tuple[float, float, float]) -> Figure:
    root = np.eye(4)
    root[:3, 3] = place
    return of_poses(name, body, np.zeros(1), pose[None], root, "mean")


def _place(n: int, count: int) -> tuple[float, float, float]:
    """A place in rows behind the origin, as it is seen from the front, +X."""
    columns = max(int(np.ceil(np.sqrt(1.8 * count))), 1)
    row, column = divmod(n, columns)
    return -BEHIND - APART * row, APART * (column - (min(columns, count) - 1) / 2), 0.0
