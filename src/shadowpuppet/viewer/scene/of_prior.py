"""The scene of a motion prior: the mean posture of each region, and a motion sampled from it."""

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
from shadowpuppet.viewer.scene.figures import pose_figure
from shadowpuppet.viewer.scene.scene import SceneFigure, Stage

SECONDS = 10.0
"""Length of the sampled motion."""
APART, BEHIND = 1.1, 1.6
"""Metres between mean postures, and between them and the moving figure."""
SETTLED = 1 << 20
"""Steps after which the Markov chain is stationary."""


def prior_scene(path: Path, seed: int = 0) -> Stage:
    """The scene of a prior saved by `fit-prior`. Raises `FormatError`, also if no body has its degrees of freedom."""
    prior = read_prior(path)
    body = body_of(path, prior)
    rate = prior.rate or ASSUMED_RATE
    times = np.arange(round(SECONDS * rate)) / rate
    drawn = sampled_motion(np.random.default_rng(seed), prior, len(times))
    walker = pose_figure("drawn from the prior", body, times, grounded_poses(body, prior, drawn), np.eye(4))
    shares = stationary_shares(prior)
    means, labels = [], []
    for n, mean in enumerate(grounded_poses(body, prior, prior.subspaces.centres)):
        place = _place(n, len(shares))
        means.append(_still(f"region {n + 1}", body, mean, place))
        labels.append((f"{n + 1}: {100 * shares[n]:.0f} %", (place[0], place[1], 2.05)))
    facts = {"prior": str(path), "body": body.name, "regions": f"{len(shares)}, the mean posture of each, and the share of time in it",
             "rate": f"{rate:g} frames/s"}  # fmt: skip
    return Stage(title=path.name, times=times, figures=(walker, *means), labels=tuple(labels), facts=facts,
                notes=("The moving figure is drawn at random from the prior alone, frame by frame, as the tracker proposes poses before "
                       "it weighs them: it is no recorded motion.",))  # fmt: skip


def body_of(path: Path, prior: MotionPrior) -> Body:
    """The body that has the prior's degrees of freedom, of average size. Raises `FormatError` if there is none."""
    for name in reversed(MODELS):
        body = make_body(name, average_sizes(name, AVERAGE_HEIGHT))
        if prior.names and set(prior.names) <= set(body.skeleton.dof_names):
            return body
    names = f"{prior.names[0]}, ..." if prior.names else "none"
    raise FormatError(f"{path}: names: found {names}, expected degrees of freedom of one of {', '.join(MODELS)}")


def sampled_motion(rng: np.random.Generator, prior: MotionPrior, frames: int) -> Array:
    """Poses (T, D) of the prior's degrees of freedom, each proposed from the one before (Ni 2008, V-A, step 3)."""
    region = rng.choice(len(prior.initial), p=prior.initial / prior.initial.sum())
    poses, regions = prior.subspaces.centres[[region]], np.array([region])
    out = np.empty((frames, poses.shape[1]))
    for n in range(frames):
        out[n] = poses[0]
        poses, regions = prior.propose(rng, poses, regions)
    return out


def grounded_poses(body: Body, prior: MotionPrior, values: Array) -> Array:
    """Full poses (N, D) from the prior's degrees of freedom, the others at rest, the lowest point on the floor."""
    skeleton = body.skeleton
    poses = np.tile(skeleton.clamp(np.zeros((1, len(skeleton.dofs)))), (len(values), 1))
    poses[:, skeleton.dof_indices(prior.names)] = values
    poses = skeleton.clamp(poses)
    if "root_z" in skeleton.dof_names:
        poses[:, skeleton.dof_names.index("root_z")] -= body.points(poses)[:, :, 2].min(1) - 0.08
    return poses


def stationary_shares(prior: MotionPrior) -> Array:
    """Stationary distribution (M,) of the regions."""
    lazy = (np.eye(len(prior.initial)) + prior.transitions) / 2  # so that periodic chains converge too
    share = prior.initial @ np.linalg.matrix_power(lazy, SETTLED)
    return share / share.sum()


def _still(name: str, body: Body, pose: Array, place: tuple[float, float, float]) -> SceneFigure:
    root = np.eye(4)
    root[:3, 3] = place
    return pose_figure(name, body, np.zeros(1), pose[None], root, "mean")


def _place(n: int, count: int) -> tuple[float, float, float]:
    """Position, metres, of the `n`-th of `count` figures in rows behind the origin, seen from the front, +X."""
    columns = max(int(np.ceil(np.sqrt(1.8 * count))), 1)
    row, column = divmod(n, columns)
    return -BEHIND - APART * row, APART * (column - (min(columns, count) - 1) / 2), 0.0
