"""Learning a motion prior (Ni 2008, IV): vector quantisation by local principal components (VQPCA), in a hidden Markov model.

In the paper's loop the regions depend only on the frames (eqs. 8-14), and the transitions on the regions (eqs. 1-7, 15-17). So the regions
are learnt first, with an error that never rises, and then the transitions, with a likelihood that never falls: the same fixed point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.hmm import posterior
from shadowpuppet.motion.prior.local_pca import Regions, Subspaces, principal_subspaces
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.motion.prior.settings import PriorSettings

MAX_VALUE = 1e9
"""Bound of the values in a pose: squares of larger ones lose precision."""
MIN_VARIANCE = 1e-150
"""Smallest variance, for poses that hardly vary: densities stay finite."""


class PriorFit(NamedTuple):
    """A prior and the course of its learning."""

    prior: MotionPrior
    errors: tuple[float, ...]
    """Root mean square reconstruction error, in the poses' units, after each round of the regions; never rises."""
    log_likelihoods: tuple[float, ...]
    """Of the training clips, before each EM iteration and after the last; never falls."""


class RegionChoice(NamedTuple):
    """Errors of several numbers of regions, and the number chosen."""

    regions: int
    """The number chosen, M."""
    candidates: tuple[int, ...]
    """The K numbers tried, rising."""
    training_errors: tuple[float, ...]
    """Root mean square reconstruction errors (K) on the training folds."""
    held_out_errors: tuple[float, ...]
    """The same on the held-out folds."""


def fit_prior(rng: np.random.Generator, clips: Sequence[ArrayLike], settings: PriorSettings | None = None, *, names: Sequence[str] = (),
        rate: float | None = None) -> PriorFit:
    """Learn a motion prior from clips of poses (T, D) in the order of time, all at one frame rate.

    `names` (D) and `rate` (frames/s) are stored in the prior. Raises `ShadowPuppetError` for clips that differ in width, have gaps, or have
    too few poses for the number of regions; `SettingsError` for settings that do not suit them.
    """
    settings = settings or PriorSettings()
    arrays = check_clips(clips)
    subspaces, errors = learn_subspaces(rng, np.concatenate(arrays), settings)
    initial = np.full(len(subspaces), 1 / len(subspaces))  # equal, as in the paper: a film may start anywhere in the motion
    densities = [subspaces.log_densities(clip) for clip in arrays]
    transitions, log_likelihoods = _maximise(densities, initial, settings)
    return PriorFit(MotionPrior(subspaces, transitions, initial, tuple(names), rate), tuple(errors), tuple(log_likelihoods))


def choose_regions(rng: np.random.Generator, clips: Sequence[ArrayLike], candidates: Sequence[int] = (5, 10, 15, 20, 30, 40, 60, 80),
                   settings: PriorSettings | None = None, *, folds: int = 5, margin: float = 0.05) -> RegionChoice:
    """The smallest number of regions whose held-out error is within a share `margin` of the best.

    Each clip of poses (T, D) is cut into `folds` pieces; each piece in turn is left out of learning and reconstructed. (The paper picks the
    number from the training error, which always falls.) Candidates with too few poses are skipped. Raises as `fit_prior`.
    """
    settings, arrays = settings or PriorSettings(), check_clips(clips)
    if folds < 2:
        raise SettingsError(f"folds: found {folds}, expected two or more")
    splits = [_split(arrays, fold, folds) for fold in range(folds)]
    splits = [(kept, out) for kept, out in splits if kept and out]
    if not splits:
        raise ShadowPuppetError(f"clips: found {sum(map(len, arrays))} frames in {len(arrays)} clips, expected {folds} or more in one")
    most = min(len(np.unique(np.concatenate(kept), axis=0)) for kept, _ in splits)
    tried = sorted({int(number) for number in candidates if number <= most})
    if not tried:
        raise ShadowPuppetError(f"clips: found {most} different poses beside each fold, expected {min(candidates, default=1)} or more")
    seeds = rng.integers(2**63, size=len(splits))  # the same for every candidate
    errors = np.array([[_errors(np.random.default_rng(seed), *split, settings, number) for split, seed in zip(splits, seeds, strict=True)]
                       for number in tried])
    training, held_out = np.sqrt((errors**2).mean(1)).T
    chosen = tried[int(np.flatnonzero(held_out <= (1 + margin) * held_out.min())[0])]
    return RegionChoice(chosen, tuple(tried), tuple(training.tolist()), tuple(held_out.tolist()))


def reconstruction_error(prior: MotionPrior, clips: Sequence[ArrayLike]) -> float:
    """Root mean square error, in the poses' units, of encoding and reconstructing clips (T, D)."""
    return _error(prior.subspaces, np.concatenate(check_clips(clips)))


def log_likelihood(prior: MotionPrior, clips: Sequence[ArrayLike]) -> float:
    """Sum of the log likelihoods of clips (T, D)."""
    densities = map(prior.subspaces.log_densities, check_clips(clips))
    return float(sum(posterior(each, prior.initial, prior.transitions).log_likelihood for each in densities))


def check_clips(clips: Sequence[ArrayLike]) -> list[Array]:
    """Clips as arrays (T, D). Raises `ShadowPuppetError` for an empty clip, a gap, or a width that differs from the first's."""
    arrays: list[Array] = []
    for c, clip in enumerate(clips):
        poses = np.asarray(clip, float)
        if poses.ndim != 2 or 0 in poses.shape:
            raise ShadowPuppetError(f"clip {c}: found shape {poses.shape}, expected (frames, numbers of a pose)")
        if arrays and poses.shape[1] != arrays[0].shape[1]:
            raise ShadowPuppetError(f"clip {c}: found poses of {poses.shape[1]} numbers, expected {arrays[0].shape[1]}, as in clip 0")
        bad = np.argwhere(~(np.abs(poses) < MAX_VALUE))
        if len(bad):
            raise ShadowPuppetError(f"clip {c}: found {poses[*bad[0]]} in frame {bad[0, 0]}, the first of {len(np.unique(bad[:, 0]))} such "
                                    f"frames, expected numbers less than {MAX_VALUE:g}; cut clips with gaps by clips.without_gaps")
        arrays.append(poses)
    if not arrays:
        raise ShadowPuppetError("clips: found none, expected one or more")
    return arrays


def _check_settings(settings: PriorSettings, poses: Array) -> None:
    M, m = settings.regions, settings.dimensions
    if m > poses.shape[1]:
        raise SettingsError(f"dimensions: found {m}, expected {poses.shape[1]} at most, which is what a pose has")
    different = len(np.unique(poses, axis=0))
    if different < max(M, 2):
        raise ShadowPuppetError(f"clips: found {different} different poses in {len(poses)} frames, expected {max(M, 2)} or more for "
                                f"{M} regions; learn fewer regions, or from more frames")


def _split(clips: list[Array], fold: int, folds: int) -> tuple[list[Array], list[Array]]:
    """The clips without piece `fold` of `folds`, and those pieces."""
    kept, out = [], []
    for clip in clips:
        start, end = (len(clip) * k // folds for k in (fold, fold + 1))
        kept += [clip[:start], clip[end:]]
        out.append(clip[start:end])
    return [part for part in kept if len(part)], [part for part in out if len(part)]


def _errors(rng: np.random.Generator, kept: list[Array], out: list[Array], settings: PriorSettings, regions: int) -> tuple[float, float]:
    """Reconstruction errors of the training and the held-out poses."""
    subspaces, _ = learn_subspaces(rng, np.concatenate(kept), replace(settings, regions=regions))
    return _error(subspaces, np.concatenate(kept)), _error(subspaces, np.concatenate(out))


def _error(subspaces: Subspaces, poses: Array) -> float:
    """Root mean square reconstruction error of poses (T, D)."""
    return float(np.sqrt(subspaces.distances(poses).min(1).mean() / subspaces.width))


# The regions


def learn_subspaces(rng: np.random.Generator, poses: Array, settings: PriorSettings) -> tuple[Subspaces, list[float]]:
    """Regions of poses (T, D), numbered in order of time, and the errors of their rounds. Raises as `fit_prior`."""
    _check_settings(settings, poses)
    floor = max(settings.noise * float(poses.var(0).mean()), MIN_VARIANCE)
    learnt = [_quantise(rng, poses, settings, floor) for _ in range(settings.starts)]
    partition, errors = min(learnt, key=lambda each: each[1][-1])
    return principal_subspaces(poses, _in_order_of_time(partition), settings.regions, settings.dimensions, floor), errors


def _quantise(rng: np.random.Generator, poses: Array, settings: PriorSettings, floor: float) -> tuple[Regions, list[float]]:
    """A partition (T,) of poses (T, D) into regions, none empty, and the errors of the rounds."""
    from scipy.spatial.distance import cdist  # takes a third of a second to import

    M, every, errors = settings.regions, np.arange(len(poses)), list[float]()
    different = np.unique(poses, axis=0, return_index=True)[1]
    centres = poses[rng.choice(different, M, replace=False)]
    # The paper starts with S = I, whose eigenvectors are arbitrary: the first partition is by the centres alone.
    following = _fill(cdist(poses, centres, "sqeuclidean").argmin(1), np.zeros(len(poses)), M)
    while True:
        partition = following
        found = principal_subspaces(poses, partition, M, settings.dimensions, floor)  # eqs. 12 to 14
        distances = found.distances(poses)  # eqs. 9, 10
        errors.append(float(np.sqrt(distances[every, partition].mean() / poses.shape[1])))
        nearest = distances.argmin(1)  # eq. 8
        following = _fill(nearest, distances[every, nearest], M)
        settled = len(errors) > 1 and errors[-2] - errors[-1] <= settings.tolerance * errors[-2]
        if settled or len(errors) >= settings.iterations or (following == partition).all():
            return partition, errors


def _fill(partition: Regions, scores: Array, regions: int) -> Regions:
    """The partition (T,) with no empty region: each gets the frame of greatest score (T,) among regions with more than one frame."""
    partition = partition.copy()
    counts = np.bincount(partition, minlength=regions)
    for region in np.flatnonzero(counts == 0):
        frame = int(np.where(counts[partition] > 1, scores, -1.0).argmax())
        counts[[partition[frame], region]] += -1, 1
        partition[frame] = region
    return partition


def _in_order_of_time(partition: Regions) -> Regions:
    """The same regions, numbered by their first frame."""
    _, first, number = np.unique(partition, return_index=True, return_inverse=True)
    return first.argsort().argsort()[number]


# The transitions


def _maximise(densities: list[Array], initial: Array, settings: PriorSettings) -> tuple[Array, list[float]]:
    """The likeliest transitions (M, M) for log densities (T, M) of every clip, and the log likelihoods of the iterations."""
    M, frames, values = len(initial), sum(map(len, densities)), list[float]()
    transitions = np.full((M, M), 1 / M)
    while True:
        found = [posterior(each, initial, transitions) for each in densities]  # no transition leads from clip to clip
        values.append(float(sum(each.log_likelihood for each in found)))
        settled = len(values) > 1 and values[-1] - values[-2] <= settings.tolerance * frames
        if settled or len(values) > settings.iterations:
            return transitions, values
        transitions = likeliest_rows(np.sum([each.pairs for each in found], 0), settings.leave / M)


def likeliest_rows(counts: Array, least: float) -> Array:
    """Maximum-likelihood rows of probabilities (M, M), none below `least`, for counts (M, M) of transitions (eq. 17 if `least` is 0).

    Entries are proportional to their counts, or `least` where that is more; equal in a row without counts.
    """
    counts = np.where(counts.sum(1, keepdims=True) > 0, counts, 1.0)
    low = np.zeros(counts.shape, bool)
    while True:
        free = (1 - least * low.sum(1, keepdims=True)) / np.where(low, 0, counts).sum(1, keepdims=True)
        rows = np.where(low, least, counts * free)
        if not (rows < least).any():
            return rows
        low |= rows < least
