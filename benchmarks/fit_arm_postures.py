"""Usual postures of arms, from motion capture: the mixture of `tracking/multiview/arm_postures.toml`.

    python benchmarks/fit_arm_postures.py JOINTS.npz [--components 24] [-o FILE]

JOINTS.npz has an array of joints (T, J, 3) for each take, metres, Z up, and their names, `names_a` of takes with 17 joints and `names_b` of
those with 15. Of each take every third frame counts, and a long take less than its length: by its root.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import smallest
import tomli_w

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.arm_postures import JOINTS, TABLE, THICKNESS, ArmPostures, arm_directions

SOURCE = ("CMU motion capture, 92 takes: climbing, dance, basketball, walking, Indian dance, martial arts, salsa. The data used in this "
          "project was obtained from mocap.cs.cmu.edu. The database was created with funding from NSF EIA-0196217.")  # fmt: skip
PACKAGE = Path(__file__).resolve().parents[1] / "src" / "shadowpuppet"
ITERATIONS = 60
EVERY = 3


def joints_of(path: Path, names: Sequence[str]) -> list[Array]:
    """The joints (T, J, 3) that are named, of each take in a file."""
    with np.load(path, allow_pickle=False) as takes:
        known = {17: takes["names_a"].tolist(), 15: takes["names_b"].tolist() if "names_b" in takes else []}
        found = [takes[name].astype(float)[::EVERY] for name in takes if not name.startswith("names")]
    return [joints[:, [known[joints.shape[1]].index(name) for name in names]] for joints in found]


def directions_of(path: Path) -> tuple[Array, Array]:
    """Arm directions (N, 6) of all takes in a file, and their weights (N,)."""
    found = [arm_directions(joints).reshape(-1, 6) for joints in joints_of(path, JOINTS)]
    found = [take[np.isfinite(take).all(1)] for take in found]
    return np.concatenate(found), np.concatenate([np.full(len(take), 1 / np.sqrt(max(len(take), 1))) for take in found])


def fit(X: Array, weights: Array, components: int) -> ArmPostures:
    """A mixture of directions (N, 6) by expectation maximisation, with covariances of at least `THICKNESS`^2."""
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(X), components, p=weights / weights.sum(), replace=False)
    found = ArmPostures(np.full(components, 1 / components), X[chosen], np.repeat(0.1 * np.eye(6)[None], components, axis=0))
    for _ in range(ITERATIONS):
        off = X[:, None] - found.means
        distances = np.einsum("nki,kij,nkj->nk", off, np.linalg.inv(found.covariances), off, optimize=True)
        logs = np.log(found.weights) - 0.5 * (distances + np.linalg.slogdet(found.covariances)[1])
        shares = weights[:, None] * np.exp(logs - np.logaddexp.reduce(logs, axis=1, keepdims=True))
        total = shares.sum(0) + 1e-9
        means = shares.T @ X / total[:, None]
        off = X[:, None] - means
        spread = np.einsum("nk,nki,nkj->kij", shares, off, off, optimize=True) / total[:, None, None]
        found = ArmPostures(total / total.sum(), means, spread + THICKNESS**2 * np.eye(6))
    return found


def table(found: ArmPostures) -> dict[str, object]:
    """What the file has: the most frequent component first."""
    parts = [{"weight": round(float(found.weights[k]), 5), "mean": np.round(found.means[k], 4).tolist(),
              "covariance": np.round(found.covariances[k], 5).tolist()} for k in np.argsort(-found.weights)]  # fmt: skip
    return {"source": SOURCE, "components": parts}


def _smallest(folder: Path) -> list[object]:
    rng, names = np.random.default_rng(3), np.array(["head", *JOINTS, *(f"joint_{n}" for n in range(8))])
    np.savez(folder / "joints.npz", take=rng.normal(size=(300, 17, 3)), names_a=names)
    return [folder / "joints.npz", "--components", 3, "-o", folder / TABLE]


def main() -> None:
    """Parse, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("joints", type=Path)
    parser.add_argument("--components", type=int, default=24)
    parser.add_argument("-o", "--output", type=Path, default=PACKAGE / "tracking" / "multiview" / TABLE)
    args = smallest.parse(parser, _smallest)
    X, weights = directions_of(args.joints)
    found = fit(X, weights, args.components)
    args.output.write_bytes(tomli_w.dumps(table(found)).encode())
    print(f"{len(X)} arms, {len(found.weights)} components; rarity 10, 50, 90 %: {np.percentile(found.rarity(X), [10, 50, 90]).round(1)}")


if __name__ == "__main__":
    main()
