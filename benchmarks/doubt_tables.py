"""What `calibrate_doubt.py` says of degrees of freedom, of other places of arms, and of false alarms, beside joints and limbs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
from doubt_runs import Tracked
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.doubt.variance import ModeWeights, without_side

WIDTH = 1.6448536269514722
"""Half width of a 90 % interval, in standard deviations."""
SCALES = np.geomspace(0.5, 4, 61)
"""Factors of a degree of freedom's deviation from which the best is chosen."""
WEIGHTS = (0.05, 0.15, 0.25, 0.35, 0.5, 0.65, 0.8, 1.01)
"""Limits of the rows of `mode_table`."""
Folds = Sequence[tuple[list[Tracked], list[Tracked]]]
"""Parts of the runs, each with the others."""


# Degrees of freedom


def dof_errors(runs: Sequence[Tracked]) -> dict[str, tuple[Array, Array]]:
    """Errors and deviations (N,) of each degree of freedom, left and right together; rad or m."""
    found = dict[str, list[Array]]()
    for run in runs:
        for d, name in enumerate(run.dofs):
            known = np.isfinite(run.pose_errors[:, d])
            found.setdefault(without_side(name), []).append(np.stack([np.abs(run.pose_errors[known, d]), run.pose_sd[known, d]]))
    return {name: tuple(np.concatenate(parts, 1)) for name, parts in found.items()}


def fit_dofs(runs: Sequence[Tracked]) -> dict[str, float]:
    """The factors of the degrees of freedom's deviations, by name without side: those of least mean interval score."""
    out = {}
    for name, (errors, sd) in dof_errors(runs).items():
        half = WIDTH * SCALES[:, None] * sd
        out[name] = float(SCALES[(half + 10 * np.maximum(errors - half, 0)).mean(1).argmin()])
    return out


def dof_table(folds: Folds) -> str:
    """Coverage of the degrees of freedom's intervals before and after calibration on other recordings, as Markdown."""
    rows = dict[str, list[Array]]()
    for own, others in folds:
        factors = fit_dofs(others)
        for name, (errors, sd) in dof_errors(own).items():
            rows.setdefault(name, []).append(np.stack([errors, sd, sd * factors[name]]))
    lines = ["| degree of freedom | uncalibrated: covered by 90 % | covered by 90 % | sd | error |", "|---|" + "---:|" * 4]
    for name, parts in rows.items():
        errors, before, sd = np.concatenate(parts, 1)
        covered = [100 * float((errors <= WIDTH * each).mean()) for each in (before, sd)]
        length = name.endswith(("_x", "_y", "_z"))
        values = (f"{1000 * value:.0f} mm" if length else f"{np.degrees(value):.1f}°" for value in (sd.mean(), errors.mean()))
        lines.append(f"| `{name}` | {covered[0]:.0f} | {covered[1]:.0f} | " + " | ".join(values) + " |")
    return "\n".join(lines)


# Other places of arms


def places(runs: Sequence[Tracked]) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """Of every arm and frame with other places: what each costs more than the estimate, pixels (K,), and which of all, the estimate
    first, is nearest to the truth (K + 1,)."""
    for run in runs:
        begin = 0
        while run.weighting is not None and begin < len(run.modes):
            end = begin + 1 + int(np.searchsorted(np.cumsum(run.modes[begin:, 0]), 1 - 1e-6))
            weights, nearest = run.modes[begin:end].T
            odds = run.weighting.odds * (len(weights) - 1) ** run.weighting.growth
            yield -run.weighting.temperature * np.log(weights[1:] * odds / weights[0]), nearest > 0
            begin = end


def fit_modes(runs: Sequence[Tracked]) -> ModeWeights:
    """The weights of other places with the best logarithmic score."""
    from scipy.optimize import minimize

    known = list(places(runs))
    more = np.full((len(known), max(len(each) for each, _ in known)), np.inf)
    nearest = np.zeros((len(known), more.shape[1] + 1), bool)
    for row, (costs, best) in enumerate(known):
        more[row, : len(costs)], nearest[row, : len(best)] = costs, best
    number = np.log(np.isfinite(more).sum(1))

    def score(parameters: Array) -> float:
        cold, odds, growth = parameters
        logs = np.column_stack([odds + growth * number, np.clip(-more * np.exp(cold), -700, 700)])
        return float((np.logaddexp.reduce(logs, axis=1) - logs[nearest]).mean())

    cold, odds, growth = minimize(score, (-6.0, 0.5, 0.0), method="Nelder-Mead").x
    return ModeWeights(float(np.exp(-cold)), float(np.exp(odds)), float(growth))


def mode_table(folds: Folds) -> str:
    """How often the truth is nearest to places of an arm by their weight, calibrated on other recordings, as Markdown."""
    rows = list[Array]()
    for own, others in folds:
        model = fit_modes(others)
        for more, nearest in places(own):
            shares = model.shares(more)
            rows.append(np.column_stack([[1 - shares.sum(), *shares], nearest]))
    weights, nearest = np.concatenate(rows).T
    lines = ["| stated weight | places | mean weight, % | the truth is nearest, % |", "|---|" + "---:|" * 3]
    for low, high in pairwise(WEIGHTS):
        own = (weights >= low) & (weights < high)
        if own.any():
            lines.append(f"| {100 * low:.0f} to {100 * min(high, 1):.0f} % | {own.sum()} | {100 * weights[own].mean():.0f} | "
                         f"{100 * nearest[own].mean():.0f} |")
    return "\n".join(lines)


# False alarms of arms


def alarm_table(variances: Mapping[str, Array], errors: Array, silent: float, near: float, far: float) -> str:
    """False alarms without each component, at the same silence, as Markdown; the least useful first.

    `variances`: of each component, of arms' joints (N, J), m^2; `errors`: distances (N, J), metres, of the same joints. `silent`: share of
    the joints that may be over `far` (m) off and vouched for; `near`: error (m) below which a doubtful joint is a false alarm.
    """
    def alarms(radius: Array) -> tuple[float, float, NDArray[np.bool_]]:
        order = np.argsort(radius)
        passed = np.cumsum((errors[order] > far).sum(1)) / errors.size
        doubtful = radius > radius[order][min(np.searchsorted(passed, silent, "right"), len(order) - 1)]
        right = (errors < near).all(1)
        return (100 * float((doubtful[:, None] & (errors < near)).sum() / max((errors < near).sum(), 1)),
                100 * float(doubtful[right].mean()) if right.any() else np.nan, doubtful)

    total = np.add.reduce(list(variances.values()))
    joints, arms, doubtful = alarms(np.sqrt(total.max(1)))
    rows = {name: alarms(np.sqrt((total - own).max(1)))[:2] for name, own in variances.items()}
    lines = ["| without | joints under 100 mm called doubtful, % | arms with all joints under 100 mm called doubtful, % |",
             "|---|---:|---:|"]
    lines += [f"| {name} | {a:.1f} | {b:.1f} |" for name, (a, b) in
              [("(nothing)", (joints, arms)), *sorted(rows.items(), key=lambda row: row[1][0])]]
    false, worst = doubtful[:, None] & (errors < near), errors.max(1)
    shares = [100 * false[which].sum() / max(false.sum(), 1) for which in (worst > far, (worst > near) & (worst <= far), worst <= near)]
    return "\n".join([*lines, "", f"Of the false alarms {shares[0]:.0f} % are joints of an arm with another joint over 300 mm off,\n"
                      f"{shares[1]:.0f} % with one 100 to 300 mm off, {shares[2]:.0f} % of an arm that is right."])
