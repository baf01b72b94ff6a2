"""A motion prior from joints over time (Ni 2008, IV): fit poses, resample to one frame rate, cut gaps, learn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.errors import ShadowPuppetError, choices, warn
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import resample, resample_table, true_runs
from shadowpuppet.motion.inverse_kinematics import FittedPoses, fit_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.vqpca import PriorFit, RegionChoice, choose_regions, fit_prior

RATE = 60.0
"""Default frame rate of a prior, frames/s: HumanEva's."""
DOUBTFUL_RESIDUAL, WRONG_RESIDUAL = 0.03, 0.1
"""Residuals of the joints, metres, from which a motion gives a warning, and an error: no person, or joints with other definitions."""
MIN_MOTION = np.radians(0.5)
"""Root mean square deviation of the angles, rad, below which there is no motion."""


@dataclass(frozen=True, eq=False)
class TrainingClip:
    """Poses fitted to the joints of one file."""

    name: str
    fitted: FittedPoses
    """At the file's frame rate or the prior's, whichever is lower."""
    parts: list[Array]
    """Poses (T, D) of all DOF at the prior's rate, without gaps."""

    @property
    def frames(self) -> int:
        """Number of frames that are learnt from."""
        return sum(map(len, self.parts))


class TrainedPrior(NamedTuple):
    """A prior, its training clips and errors."""

    prior: MotionPrior
    fit: PriorFit
    clips: tuple[TrainingClip, ...]
    choice: RegionChoice | None
    """How the number of regions was chosen; None if it was given."""
    error: float
    """Root mean square error of encoding and reconstructing a pose, rad (and metres, of translations)."""
    joint_error: float
    """The same of the joint positions, metres, with the root held."""


def train_prior(rng: np.random.Generator, tables: Mapping[str, JointTable], settings: PriorSettings | None = None, *,
                body: str = "anatomical", rate: float = RATE, candidates: Sequence[int] = ()) -> TrainedPrior:
    """Learn a motion prior of a body, at `rate` frames/s, from joints (metres, Z up) of clips by name, of any frame rate and person.

    `candidates`: numbers of regions to choose from, instead of that in `settings`. Raises `ShadowPuppetError`, naming the clip, if joints
    are not a whole person's or too few frames are left for the regions; warns of a bad fit and of clips without motion.
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
    return TrainedPrior(fit.prior, fit, clips, choice, error, joint_error)


def modelled(skeleton: Skeleton, dofs: str = "articulation") -> tuple[str, ...]:
    """Names of the DOF that a prior models: `articulation`: all but position and heading; `all`: all, as in the paper."""
    return tuple(name for name in skeleton.dof_names if dofs == "all" or name not in GLOBAL_DOFS)


def matched(prior: MotionPrior, skeleton: Skeleton, rate: float) -> MotionPrior:
    """The prior with transitions for another frame rate (frames/s): powers of the transition matrix A, and for a part f of a step
    (1 - f) I + f A. Raises `ShadowPuppetError` if the prior is of another body than the skeleton.
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


def reconstruction_errors(prior: MotionPrior, clips: Sequence[TrainingClip]) -> tuple[float, float]:
    """Root mean square errors of encoding and reconstructing the clips' poses: of the DOF, and of the joint positions (metres)."""
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
    """Tables by name, and with `both` their mirror images."""
    for name, table in tables.items():
        yield name, table
        if both:
            yield f"{name}, mirrored", mirrored(table)


def _clip(name: str, table: JointTable, body: str, rate: float) -> TrainingClip:
    """Poses of a table. A lower frame rate is fitted before it is resampled, which keeps the bones' lengths; a higher one after."""
    known = np.flatnonzero(np.isfinite(table.positions).all(2).any(0))
    table = table.select([table.names[n] for n in known])
    slower = len(table.times) < 2 or np.median(np.diff(table.times)) >= 1 / rate
    table = table if slower else resample_table(table, rate)
    fitted = fit_poses(table, body, source=name)
    _check_fit(name, fitted)
    complete = np.asarray(np.isfinite(table.positions).all((1, 2)))
    poses = resample(fitted.times, np.where(complete[:, None], fitted.poses, np.nan), rate)[1]
    return TrainingClip(name, fitted, without_gaps(poses))


def _check_fit(name: str, fitted: FittedPoses) -> None:
    residual = fitted.residual
    if residual < DOUBTFUL_RESIDUAL:
        return
    worst = max(fitted.by_joint, key=fitted.by_joint.__getitem__)
    said = f"{name}: joints lie {1000 * residual:.0f} mm off the body on average, {worst} {1000 * fitted.by_joint[worst]:.0f} mm"
    if residual >= WRONG_RESIDUAL:
        raise ShadowPuppetError(f"{said}, expected a person with the body's joints, whose bones keep their lengths")
    warn(f"{said}: are its joints those of the body?")


def _same_turn(parts: list[Array], skeleton: Skeleton) -> list[Array]:
    """Poses of the parts, without whole turns between their headings."""
    column = skeleton.dof_names.index("root_heading")
    base, out = float(np.median(parts[0][:, column])), []
    for part in parts:
        turned = part.copy()
        turned[:, column] -= 2 * np.pi * np.round((np.median(part[:, column]) - base) / (2 * np.pi))
        out.append(turned)
    return out


def _check_moves(clips: Sequence[Array], names: str) -> None:
    if float(np.sqrt(np.concatenate(clips).var(0).mean())) < MIN_MOTION:
        warn(f"{names}: nobody moves there, so that the prior knows one posture only")


OTHER_SIDE = {"left_": "right_", "right_": "left_"}


def mirrored(table: JointTable) -> JointTable:
    """The motion mirrored at the world's X axis: left and right change places, y changes its sign.

    Raises `ShadowPuppetError` if a joint of one side has no counterpart.
    """
    names = tuple(_other_side(name) for name in table.names)
    alone = [name for name, other in zip(table.names, names, strict=True) if other not in table.names]
    if alone:
        raise ShadowPuppetError(f"joint {alone[0]!r}: found no {_other_side(alone[0])!r} beside it, which a mirror needs")
    reflected = table.positions * (1, -1, 1)
    return JointTable(table.times, table.names, reflected[:, [table.names.index(name) for name in names]])


def without_gaps(values: ArrayLike, shortest: int = 2) -> list[Array]:
    """The runs of frames of a clip (T, D) without missing numbers, each of `shortest` frames or more."""
    values = np.asarray(values, float)
    return [values[start:end] for start, end in true_runs(np.isfinite(values).reshape(len(values), -1).all(1)) if end - start >= shortest]


def _other_side(name: str) -> str:
    for side, other in OTHER_SIDE.items():
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
