"""Is it the search, or what a silhouette tells? The filter's error beside that of each frame's posterior mean, sampled at length.

    python benchmarks/posterior.py [RECORDING...] [--every 9] [--temperature 20] [--seed 0]

Both arms of a frame are drawn by a tempered sampler (Neal 2001's annealed levels with resampling and Metropolis moves), some 50,000
evaluations an arm, from all over their range, under the tracker's own silhouette cost and posture prior with exact masks and its own
torso; no other frame is used. Its standard deviations and 90 % intervals stand beside those that the tracker
states. Where the mean over these samples is no nearer to the truth than the tracker is, a better search cannot help.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import smallest
from cases import Case
from proving_ground import HERE, made

from shadowpuppet.body.segments import dofs_of
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.motion.metrics import UPPER_JOINTS
from shadowpuppet.pipeline.options import Options
from shadowpuppet.tracking.doubt.monocular import MonocularDoubt
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost

LEVELS = (400.0, 200.0, 100.0, 60.0, 40.0)
"""Temperatures before the last, pixels."""
NUMBER, MOVES, SWEEPS = 1500, 3, 2
WIDTH = 1.645
"""Half of a 90 % interval, in standard deviations."""


def to_directions(arms: Array, side: int) -> Array:
    """Angles of arms (N, 4) to directions of upper arm and forearm (N, 4), rad: in the torso's plane from hanging, and out of it."""
    abduction, forward, roll, flexion = arms.T
    x, y, z = np.sin(flexion) * np.cos(side * roll), np.sin(flexion) * np.sin(side * roll), -np.cos(flexion)
    x, z = np.cos(forward) * x - np.sin(forward) * z, np.sin(forward) * x + np.cos(forward) * z
    y, z = (np.cos(abduction) * y - np.sin(side * abduction) * z, np.sin(side * abduction) * y + np.cos(abduction) * z)
    return np.stack([abduction, forward, side * np.arctan2(y, -z), np.arcsin(np.clip(x, -1, 1))], 1)


def to_arms(directions: Array, side: int) -> Array:
    """The inverse of `to_directions`."""
    abduction, forward, plane, depth = directions.T
    x, y, z = np.sin(depth), np.cos(depth) * np.sin(side * plane), -np.cos(depth) * np.cos(plane)
    y, z = np.cos(abduction) * y + np.sin(side * abduction) * z, -np.sin(side * abduction) * y + np.cos(abduction) * z
    x, z = np.cos(forward) * x + np.sin(forward) * z, -np.sin(forward) * x + np.cos(forward) * z
    return np.stack([abduction, forward, side * np.arctan2(y, x), np.arccos(np.clip(-z, -1, 1))], 1)


def sample(rng: np.random.Generator, cost: Callable[[Array], Array], side: int, low: Array, high: Array, temperature: float) -> Array:
    """Arms (NUMBER, 4) from exp(-cost / temperature) within limits (4,)."""
    start = np.stack([np.radians(rng.uniform(-15, 175, 4000)), rng.normal(0.2, 0.6, 4000), np.radians(rng.uniform(-40, 200, 4000)),
                      rng.normal(0.3, 0.6, 4000)], 1)
    arms = np.clip(to_arms(start, side), low, high)
    costs = cost(arms)
    for n, level in enumerate([*(hot for hot in LEVELS if hot > temperature), temperature]):
        weights = np.exp(-(costs - costs.min()) / level)
        chosen = np.searchsorted(np.cumsum(weights / weights.sum()), (rng.random() + np.arange(NUMBER)) / NUMBER).clip(0, len(arms) - 1)
        arms, costs = arms[chosen], costs[chosen]
        for _ in range(MOVES):
            step = rng.standard_normal((NUMBER, 4)) * (0.08, 0.35, 0.08, 0.35) * 0.8**n * rng.choice([0.3, 1.0, 1.5], (NUMBER, 1))
            moved = np.clip(to_arms(to_directions(arms, side) + step, side), low, high)
            new = cost(moved)
            taken = np.log(rng.random(NUMBER)) < (costs - new) / level
            arms, costs = np.where(taken[:, None], moved, arms), np.where(taken, new, costs)
    return arms


def posterior(rng: np.random.Generator, picture: Picture, mask: Array, pose: Array, weight: float, temperature: float,
              ) -> tuple[Array, Array]:
    """Means and standard deviations (6, 3) of the joints of `metrics.UPPER_JOINTS`, world: both arms sampled in turn, the torso as in
    `pose` (D,)."""
    skeleton, pose = picture.body.skeleton, pose.copy()
    observation, places = Observation.without_legs(mask, picture, pose), {}
    for sweep, side in ((sweep, side) for sweep in range(SWEEPS) for side in SIDES):
        dofs = dofs_of(skeleton, f"{side}_arm")
        silhouette = PartialCost(picture, dofs).costs(observation, pose)

        def put(arms: Array, dofs=dofs) -> Array:
            poses = np.repeat(pose[None], len(arms), axis=0)
            poses[:, dofs] = arms
            return poses

        def cost(arms: Array, put=put, silhouette=silhouette) -> Array:
            return silhouette(put(arms)) + weight * skeleton.posture_penalty(put(arms))

        sign = 1 if side == "left" else -1
        arms = sample(rng, cost, sign, skeleton.limits[0][dofs], skeleton.limits[1][dofs], temperature)
        if sweep == SWEEPS - 1:
            points = picture.points_world(put(arms))
            found = np.stack([points.mean(0), points.std(0)])
            places |= {name: found[:, picture.body.landmark_names.index(name)] for name in UPPER_JOINTS if name.startswith(side)}
        middle = to_arms(to_directions(arms, sign).mean(0)[None], sign)[0]
        pose[dofs] = np.clip(middle, skeleton.limits[0][dofs], skeleton.limits[1][dofs])
    means, sd = np.stack([places[name] for name in UPPER_JOINTS], 1)
    return means, sd


def compare(path: Path, every: int, temperature: float, seed: int) -> Array:
    """Of the tracker and of the posterior in every `every`-th frame: mean error and standard deviation along an axis, mm, and the share of
    the true positions, axis by axis, that are within 1.645 standard deviations of it, per cent (2, 3)."""
    case, options = Case.read(path, masks=True), Options(masks=True)
    for_fit, for_track, for_sample = np.random.default_rng(seed).spawn(3)
    picture = case.person(options, for_fit).picture(case.camera, options.tracker.body)
    tracker, truth = MonocularTracker(picture, options.tracker), case.truth.select(UPPER_JOINTS).positions
    columns = [picture.body.landmark_names.index(name) for name in UPPER_JOINTS]
    state, doubt, before, rows = tracker.start(for_track, case.masks[0]), MonocularDoubt(tracker), None, []
    for n, mask in enumerate(case.masks):
        state = tracker.step(for_track, state, mask) if n else state
        stated, before = doubt(state, mask, float(case.times[n]), before)
        if n % every == 0:
            own = picture.points_world(state.pose[None])[0][columns]
            sampled = posterior(for_sample, picture, mask, state.pose, options.tracker.posture_weight, temperature)
            rows.append([(1000 * np.linalg.norm(places - truth[n], axis=1).mean(), 1000 * sd.mean(),
                          100 * (np.abs(places - truth[n]) <= WIDTH * sd).mean())
                         for places, sd in ((own, stated.joint_sd[columns]), sampled)])
    return np.mean(rows, axis=0)


def _smallest(folder: Path) -> list[object]:
    return [smallest.make(folder / "tiny"), "--every", 20]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, nargs="*", help="folders; the proving ground without")
    parser.add_argument("--every", type=int, default=9, help="frames from one that is sampled to the next")
    parser.add_argument("--temperature", type=float, default=20.0, help="pixels: of the last level")
    parser.add_argument("--seed", type=int, default=0)
    args = smallest.parse(parser, _smallest)
    print("| recording | tracker: error, mm | sd stated | within 90 % | posterior mean: error, mm | sd | within 90 % |")
    print("|---|" + "---:|" * 6)
    found = []
    for path in args.recordings or made(HERE):
        found.append(compare(path, args.every, args.temperature, args.seed))
        print(_row(path.name, found[-1]), flush=True)
    print(_row("all", np.mean(found, axis=0)))


def _row(name: str, values: Array) -> str:
    return f"| {name} | " + " | ".join(f"{value:.0f}" for value in values.ravel()) + " |"


if __name__ == "__main__":
    main()
