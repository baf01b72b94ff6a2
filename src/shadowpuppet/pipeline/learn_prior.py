"""Learns motion priors from motion files, and gets the prior of a run: from a file, or learnt from its training motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.prior import read_prior, write_prior
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.training import RATE, TrainedPrior, matched, train_prior
from shadowpuppet.pipeline.options import Options
from shadowpuppet.threads import one_blas_thread

CANDIDATES = (5, 10, 15, 20, 30, 40, 60, 80)
"""Numbers of regions tried if the best is to be chosen (Ni 2008, Figs. 4 and 8)."""


@one_blas_thread()
def prior_from_files(motions: Sequence[str | Path], file: str | Path, settings: PriorSettings | None = None, *, seed: int = 0,
                     body: str = "anatomical", rate: float = RATE, choose: bool = False) -> TrainedPrior:
    """Learn a prior from files that `read_motion` reads, at `rate` frames/s, and save it (.npz).

    `choose`: find the number of regions among `CANDIDATES`. Raises `FormatError` or `ShadowPuppetError`, naming the file.
    """
    file, paths = Path(file), [Path(motion) for motion in motions]
    if file.suffix.lower() != ".npz":
        raise ShadowPuppetError(f"{file}: found the ending {file.suffix!r}, expected .npz")
    if not file.parent.is_dir():
        raise ShadowPuppetError(f"{file}: cannot be written (no such folder)")
    twice = [path for n, path in enumerate(paths) if path in paths[:n]]
    if twice:
        raise ShadowPuppetError(f"{twice[0]}: found it twice among the files to learn from, expected each once")
    tables = {str(path): read_motion(path) for path in paths}
    trained = train_prior(np.random.default_rng(seed), tables, settings, body=body, rate=rate, candidates=CANDIDATES if choose else ())
    write_prior(file, trained.prior)
    return trained


class Familiar(NamedTuple):
    """Knowledge from training data before a run: a motion prior, the person's sizes, and training poses."""

    prior: MotionPrior | None
    """Prior for the film's frame rate; None if there is neither a prior file nor training motion."""
    sizes: BoneSizes | None
    """Sizes of the person in the training motion; None without training motion."""
    poses: Array
    """Poses of the training motion in the world, (T, D), all DOF: candidates for the search for the first pose. T is 0 without training
    motion."""


def familiar(rng: np.random.Generator, options: Options, training: JointTable | None, body: str, rate: float,
             source: str = "training") -> Familiar:
    """The prior of a run at `rate` frames/s, from the file `options.prior` or else learnt from `training` with `options.training`; and the
    sizes and poses of the training motion.

    `source`: name of the training motion in messages. Raises `FormatError` or `ShadowPuppetError` if the file is not a prior or is for
    another body, or if nothing can be learnt from the motion.
    """
    skeleton = make_body(body, average_sizes(body, AVERAGE_HEIGHT)).skeleton
    given = None if options.prior is None else _given(options.prior, skeleton, rate)
    if training is None:
        return Familiar(given, None, np.zeros((0, len(skeleton.dofs))))
    if given is not None:
        fitted = fit_poses(training, body, source=source)
        return Familiar(given, fitted.sizes, fitted.poses[np.isfinite(fitted.poses).all(1)])
    trained = train_prior(rng, {source: training}, options.training, body=body, rate=rate)
    clip = trained.clips[0]
    return Familiar(trained.prior, clip.fitted.sizes, np.concatenate(clip.parts))


def _given(file: Path, skeleton: Skeleton, rate: float) -> MotionPrior:
    prior = read_prior(file)
    try:
        return matched(prior, skeleton, rate)
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{file}: {error}") from None
