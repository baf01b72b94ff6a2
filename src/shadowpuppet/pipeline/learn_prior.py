"""Motion priors learnt from files of motion, and that of a run: given, or learnt from its training motion."""

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
"""Numbers of regions that are tried where one is to be chosen (Ni 2008, Figs. 4 and 8)."""


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
    """What is known of how a person moves before a run, and of the person from that."""

    prior: MotionPrior | None
    """For the film's rate; None where there is neither a file nor training motion."""
    sizes: BoneSizes | None
    """Of whoever moved in the training motion."""
    poses: Array
    """Of the training motion, of shape (T, D), all DOF, in the world: postures that a search for the first may try; none without."""


def familiar(rng: np.random.Generator, options: Options, training: JointTable | None, body: str, rate: float,
             source: str = "training") -> Familiar:
    """The prior of a run at `rate` frames/s: `options.prior`, else learnt from `training` motion, by `options.training`.

    `source`: what messages call that motion. Raises `FormatError` or `ShadowPuppetError` where a file is no prior, or of another body, or
    the motion cannot be learnt from.
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
