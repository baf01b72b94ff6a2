"""Is a calibration's wrong scale named, and no right one? Made rings of 3 to 8 cameras around children, tall people and others, who walk,
stand and sit; the scale of each is made wrong by known factors.

    python benchmarks/scale.py [--rings 30] [--from 0]

Silhouettes are exact. Bodies are fitted once a ring: the heights they ask for grow in proportion to the scale
(tests/tracking/multiview/test_seen_stature.py). A quarter of an hour on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.pipeline.findings.scale import few_of, fitted_heights, judged, moments_of, stands
from shadowpuppet.synthetic import Mannequin, Ring, Scene, Spec
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.mannequin import PersonKind
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.scene_renderer import dressed
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

FACTORS = (0.7, 0.87, 1.0, 1.15, 1.4, 2.0)
PEOPLE: tuple[tuple[PersonKind, float | None], ...] = (
    ("child", 1.2), ("man", 2.05), ("woman", None), ("man", None), ("child", None))  # fmt: skip
"""Kind and stature, metres; None: drawn."""
MOTIONS: tuple[tuple[str, PostureName], ...] = (
    ("walk", "standing"), ("stand", "standing"), ("reach", "standing"), ("reach", "seated"), ("stand", "seated"))  # fmt: skip
"""Gesture and posture."""
LIGHTS = np.array([[0, 0, 1.0, 0]] * 3)
"""Silhouettes need none."""


def rings() -> Iterator[tuple[str, Spec]]:
    """The rings, each with a name."""
    for n in range(30):
        rng, (kind, stature), (gesture, posture) = np.random.default_rng([49, n]), PEOPLE[n % 5], MOTIONS[n // 5 % 5 if n < 25 else n % 5]
        ring = Ring(count=3 + n % 6, radius=float(rng.uniform(3.2, 4.2)), height=float(rng.uniform(1.0, 2.2)), jitter=0.8, fov_deg=66,
                    start_deg=float(rng.uniform(-180, 180)), seed=n)
        body = Mannequin.draw(rng, kind, stature=stature)
        yield (f"{kind} of {body.stature:.2f} m, {posture if posture == 'seated' else gesture}, {ring.count} cameras",
               Spec(body=body, motion=parse_gestures(f"{gesture} 3"), posture=posture, rate=10, ring=ring,
                    scene=Scene(clothing=n), seed=n))


def silhouettes(spec: Spec) -> tuple[list[Camera], list[tuple[Mask, ...]]]:
    """The cameras, and the masks (H, W) by time and camera of the moments that are looked at."""
    times, figure = perform(spec, np.random.default_rng(spec.seed))
    cameras, clothes = [view.camera() for view in spec.views()], Clothes.draw(np.random.default_rng(spec.scene.clothing))
    drawn = [PersonRenderer(camera, dressed(spec.body, clothes), clothes, LIGHTS) for camera in cameras]
    moments = np.linspace(0.1, 0.9, 6) * (len(times) - 1)
    return cameras, [tuple(each.mask(figure, int(n)) for each in drawn) for n in moments]


@one_blas_thread()
def row(spec: Spec) -> tuple[str, list[bool], list[bool]]:
    """The height found over the true one with its spread, and by factor whether the scale is named without and with the height."""
    cameras, masks = silhouettes(spec)
    settings, true = MultiviewSettings(), spec.body.stature
    moments = few_of(moments_of(cameras, masks, settings))
    heights = np.array([*fitted_heights(cameras, moments, settings)])

    def is_named(factor: float, height: float | None) -> bool:
        quick = stands([factor * moment.extents for moment in moments], height)
        return not quick and judged(factor * heights, height) is not None

    found = f"{np.median(heights) / true:.3f} ± {np.log(heights).std():.3f}" if len(heights) else "none"
    return found, [is_named(factor, None) for factor in FACTORS], [is_named(factor, true) for factor in FACTORS]


def _smallest(folder: Path) -> list[object]:
    return ["--rings", 1, "--from", 1]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rings", type=int, default=30)
    parser.add_argument("--from", type=int, default=0, dest="begin")
    told = smallest.parse(parser, _smallest)
    factors = " | ".join(f"{factor:g}" for factor in FACTORS)
    print(f"| ring | found/true | {factors} | with the height: {factors} |\n" + "|---" * (2 + 2 * len(FACTORS)) + "|")
    without, known = np.zeros((2, len(FACTORS)), int)
    chosen = list(rings())[told.begin : told.begin + told.rings]
    for name, spec in chosen:
        found, plain, given = row(spec)
        without, known = without + plain, known + given
        print(f"| {name} | {found} | " + " | ".join("named" if each else "" for each in (*plain, *given)) + " |", flush=True)
    print(f"| named of {len(chosen)} | | " + " | ".join(map(str, (*without, *known))) + " |")


if __name__ == "__main__":
    main()
