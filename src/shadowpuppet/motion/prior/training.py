"""From joints over time to a motion prior of a body: poses fitted, one frame rate, gaps cut, regions learnt (Ni 2008, IV)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple
from warnings import warn

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning, choices
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import resample, resample_table
from shadowpuppet.motion.inverse_kinematics import FittedPoses, fit_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.clips import mirrored, without_gaps
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.vqpca import Choice, Fit, choose_regions, fit_prior

RATE = 60.0
"""Frames/s that are learnt where nothing else is wanted: HumanEva's, and the recordings' of the paper."""
DOUBTFUL, WRONG = 0.03, 0.1
"""Residuals of joints, metres, from which on a motion is doubted, and refused: it is no person's, or its joints are others than ours."""
STILL = np.radians(0.5)
"""Root mean square deviation of the angles, rad, below which nobody moves."""


@dataclass(frozen=True, eq=False)
class Clip:
    """Joints of one file as poses."""

    name: str
    fitted: FittedPoses
    """At the rate it was measured at, or at the prior's where that is less."""
    parts: list[Array]
    """Poses (T, D) of all DOF at the prior's rate, without gaps."""

    @property
    def frames(self) -> int:
        """Frames that were learnt from."""
        return sum(map(len, self.parts))


class Trained(NamedTuple):
    """A prior, and what it was learnt from."""

    prior: MotionPrior
    fit: Fit
    clips: tuple[Clip, ...]
    choice: Choice | None
    """How the number of regions was chosen, where it was."""
    error: float
    """Root mean square of what encoding and reconstructing loses of a pose, rad (and metres, where there are places among the DOF)."""
    joint_error: float
    """The same of the joints' places, metres, the pelvis held where it is."""


def train_prior(rng: np.random.Generator, tables: Mapping[str, JointTable], settings: PriorSettings | None = None, *,
                body: str = "anatomical", rate: float = RATE, candidates: Sequence[int] = ()) -> Trained:
    """Learn a motion from joints (metres, Z up) of one or several clips, by their names, of any frame rates and people.

    `candidates`: numbers of regions to choose among, instead of that in `settings`. Raises `ShadowPuppetError` naming the clip, where
    joints are not a whole person's, or too few frames are left for the regions; warns where they fit badly, or nobody moves.
    """
    settings = settings or PriorSettings()
    if not tables:
        raise ShadowPuppetError("clips: found none, expected one or more")
    if not 0 < rate < np.inf:
        raise ShadowPuppetError(f"rate: found {rate:g}, expected frames a second, more than zero")
    clips = tuple(_clip(name, table, body, rate) for name, table in _sides(tables, settings.mirrored))
    if not any(clip.parts for clip in clips):
        raise ShadowPuppetError(f"{choices(tables)}: found no two frames in a row with all joints, expected a motion")
    names = modelled(make_body(body, average_sizes(body, AVERAGE_HEIGHT)).skeleton, settings.dofs)
    poses = _same_turn([part for clip in clips for part in clip.parts], clips[0].fitted.body.skeleton)
    columns = clips[0].fitted.body.skeleton.dof_indices(names)
    chosen = [part[:, columns] for part in poses]
    _check_moves(chosen, choices(tables))
    choice = choose_regions(rng, chosen, candidates, settings) if candidates else None
    fit = fit_prior(rng, chosen, settings if choice is None else replace(settings, regions=choice.regions), names=names, rate=rate)
    error, joint_error = reconstruction_errors(fit.prior, clips)
    return Trained(fit.prior, fit, clips, choice, error, joint_error)


def modelled(skeleton: Skeleton, dofs: str = "articulation") -> tuple[str, ...]:
    """DOF that a prior of a whole body models: `articulation` is all but place and heading, `all` is all, as in the paper."""
    return tuple(name for name in skeleton.dof_names if dofs == "all" or name not in GLOBAL_DOFS)


def matched(prior: MotionPrior, skeleton: Skeleton, rate: float) -> MotionPrior:
    """The prior for a skeleton and frames a second: transitions of more or fewer steps than it has learnt.

    Of a step that is a share f of the learnt one, (1 - f) stays. Raises `ShadowPuppetError` where the prior is of another body.
    """
    other = [name for name in prior.names if name not in skeleton.dof_names]
    if other or not prior.names:
        raise ShadowPuppetError(f"prior: found {other[0] if other else 'no names'!r} among what it models, expected degrees of freedom of "
                                f"the body; learn one for it (fit-prior --body): {choices(skeleton.dof_names)}")
    steps = 1.0 if prior.rate is None else prior.rate / rate
    whole, share = divmod(steps, 1.0)
    rest = (1 - share) * np.eye(len(prior.transitions)) + share * prior.transitions
    rows = np.linalg.matrix_power(prior.transitions, int(whole)) @ rest
    return replace(prior, transitions=rows / rows.sum(1, keepdims=True), rate=rate)


def reconstruction_errors(prior: MotionPrior, clips: Sequence[Clip]) -> tuple[float, float]:
    """Root mean square of what encoding and reconstructing the clips' poses loses: of the DOF, and of the joints' places (metres)."""
    squares, places = list[Array](), list[Array]()
    for clip in clips:
        body = clip.fitted.body
        columns = body.skeleton.dof_indices(prior.names)
        for part in clip.parts:
            again, held = part.copy(), body.skeleton.dof_indices(GLOBAL_DOFS)
            again[:, columns] = prior.reconstruct(prior.encode(part[:, columns]))
            squares.append(((again - part)[:, columns] ** 2).ravel())
            again[:, held] = part[:, held]
            places.append(((body.points(again) - body.points(part)) ** 2).sum(2).ravel())
    return float(np.sqrt(np.concatenate(squares).mean())), float(np.sqrt(np.concatenate(places).mean()))


def _sides(tables: Mapping[str, JointTable], both: bool) -> Iterator[tuple[str, JointTable]]:
    """Tables by name, and their mirror images."""
    for name, table in tables.items():
        yield name, table
        if both:
            yield f"{name}, mirrored", mirrored(table)


def _clip(name: str, table: JointTable, body: str, rate: float) -> Clip:
    """Poses of a table: slower ones are fitted first and then resampled, which leaves bones their length, faster ones the other way."""
    known = np.flatnonzero(np.isfinite(table.positions).all(2).any(0))
    table = table.select([table.names[n] for n in known])
    slower = len(table.times) < 2 or np.median(np.diff(table.times)) >= 1 / rate
    table = table if slower else resample_table(table, rate)
    fitted = fit_poses(table, body, source=name)
    _check_fit(name, fitted)
    complete = np.asarray(np.isfinite(table.positions).all((1, 2)))
    poses = resample(fitted.times, np.where(complete[:, None], fitted.poses, np.nan), rate)[1]
    return Clip(name, fitted, without_gaps(poses))


def _check_fit(name: str, fitted: FittedPoses) -> None:
    residual = fitted.residual
    if residual < DOUBTFUL:
        return
    worst = max(fitted.by_joint, key=fitted.by_joint.__getitem__)
    said = f"{name}: joints lie {1000 * residual:.0f} mm off the body on average, {worst} {1000 * fitted.by_joint[worst]:.0f} mm"
    if residual >= WRONG:
        raise ShadowPuppetError(f"{said}, expected a person with the body's joints, whose bones keep their lengths")
    warn(f"{said}: are its joints those of the body?", ShadowPuppetWarning, stacklevel=4)


def _same_turn(parts: list[Array], skeleton: Skeleton) -> list[Array]:
    """Headings without whole turns between the parts."""
    column = skeleton.dof_names.index("root_heading")
    base, out = float(np.median(parts[0][:, column])), []
    for part in parts:
        turned = part.copy()
        turned[:, column] -= 2 * np.pi * np.round((np.median(part[:, column]) - base) / (2 * np.pi))
        out.append(turned)
    return out


def _check_moves(clips: Sequence[Array], names: str) -> None:
    if float(np.sqrt(np.concatenate(clips).var(0).mean())) < STILL:
        warn(f"{names}: nobody moves there, so that the prior knows one posture only", ShadowPuppetWarning, stacklevel=3)

