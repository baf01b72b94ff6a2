"""Usual postures of the whole body, from motion capture: the mixture of `tracking/multiview/body_postures.npz`.

    python benchmarks/fit_body_postures.py JOINTS.npz [--components 60] [--held-out 5] [-o FILE]

JOINTS.npz is as for `fit_arm_postures.py`. `--held-out N`: instead, N times another share of the takes is left out, and the mean log
density of its postures under the mixture of the others is printed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import smallest
from fit_arm_postures import PACKAGE, SOURCE, joints_of

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.body_postures import JOINTS, TABLE, BodyPostures, D, body_directions, mirrored

THICKNESS = 0.12
"""Least standard deviation of a component: what joint definitions differ by."""
ITERATIONS = 60


def takes_of(path: Path) -> list[Array]:
    """Directions (N, 27) of each take in a file."""
    found = [body_directions(joints) for joints in joints_of(path, JOINTS)]
    found = [take[np.isfinite(take).all(1)] for take in found]
    return [take for take in found if len(take)]


def fit(takes: list[Array], components: int) -> BodyPostures:
    """A mixture of the takes' directions by expectation maximisation; each take counts by the root of its length, a mirrored posture as the
    posture does."""
    X, rng = np.concatenate(takes), np.random.default_rng(0)
    weights = np.concatenate([np.full(len(take), len(take) ** -0.5) for take in takes])
    both = np.concatenate([X, mirrored(X)])
    chosen = rng.choice(len(X), components, p=weights / weights.sum(), replace=False)
    found = BodyPostures(np.full(components, 1 / components), X[chosen], np.repeat(0.1 * np.eye(D)[None], components, axis=0))
    for _ in range(ITERATIONS):
        parts = np.stack([found.log_parts(X), found.log_parts(mirrored(X))])
        shares = (weights[:, None] * np.exp(parts - np.logaddexp.reduce(parts, axis=(0, 2), keepdims=True))).reshape(len(both), -1)
        total = shares.sum(0) + 1e-9
        means = shares.T @ both / total[:, None]
        spread = np.empty((components, D, D))
        for k in range(components):
            off = both - means[k]
            spread[k] = (off * shares[:, k, None]).T @ off / total[k]
        found = BodyPostures(total / total.sum(), means, spread + THICKNESS**2 * np.eye(D))
    return found


def held_out(takes: list[Array], components: int, folds: int) -> list[float]:
    """Mean log densities of takes under the mixture of the others, a share of the takes after the other."""
    order, found = np.random.default_rng(1).permutation(len(takes)), []
    for n in range(folds):
        rest = fit([takes[t] for t in order if t not in order[n::folds]], components)
        X = np.concatenate([takes[t] for t in order[n::folds]])
        found.append(float(rest.log_density(X).mean()))
    return found


def _smallest(folder: Path) -> list[object]:
    rng, names = np.random.default_rng(3), np.array(["head", *JOINTS, "left_hand", "right_hand"])
    np.savez(folder / "joints.npz", take=rng.normal(size=(300, 17, 3)), names_a=names)
    return [folder / "joints.npz", "--components", 3, "-o", folder / TABLE]


def main() -> None:
    """Parse, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("joints", type=Path)
    parser.add_argument("--components", type=int, default=60)
    parser.add_argument("--held-out", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, default=PACKAGE / "tracking" / "multiview" / TABLE)
    args = smallest.parse(parser, _smallest)
    takes = takes_of(args.joints)
    if args.held_out:
        print(f"log density of takes left out: {np.round(held_out(takes, args.components, args.held_out), 2)}")
        return
    found = fit(takes, args.components)
    order, lower = np.argsort(-found.weights), np.linalg.cholesky(found.covariances)[:, *np.tril_indices(D)]
    np.savez_compressed(args.output, source=np.array(SOURCE), weights=found.weights[order].astype(np.float32),
                        means=found.means[order].astype(np.float32), factors=lower[order].astype(np.float32))  # fmt: skip
    rarity = np.percentile(np.concatenate([found.rarity(take) for take in takes]), [10, 50, 90])
    print(f"{sum(map(len, takes))} postures, {len(found.weights)} components; rarity 10, 50, 90 %: {rarity.round(1)}")


if __name__ == "__main__":
    main()
