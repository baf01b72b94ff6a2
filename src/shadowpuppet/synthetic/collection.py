"""Specs that the project uses again and again: the demo's, and the proving ground on which settings are chosen."""

from __future__ import annotations

import numpy as np

from shadowpuppet.synthetic.mannequin import Mannequin
from shadowpuppet.synthetic.shorthand import gestures_from
from shadowpuppet.synthetic.spec import Scene, Spec
from shadowpuppet.synthetic.viewpoint import Ring, Viewpoint


def demo_spec() -> Spec:
    """The recording of `shadowpuppet demo`: the three motions of Liu 2011 and a reach, 15 s."""
    gestures = gestures_from("wave_hands 3.6, bend_aside 3.6, bow_forward 2.8, reach 4.2")
    return Spec(name="demo", body=Mannequin(stature=1.78), motion=gestures, scene=Scene(clothing=7, room=2))


PAPER = "wave_hands 3.6, bend_aside 3.6, bow_forward 2.8"
PROVING = (
    # name, kind and seed of the body, gestures, distance (m), fov (degrees), pitch (degrees), noise (grey levels), turn (degrees)
    ("man_paper", "man", 1, PAPER, 2.0, 60, 0, 2.5, 0),
    ("woman_paper", "woman", 2, PAPER, 2.0, 60, 0, 2.5, 0),
    ("child_paper", "child", 9, PAPER, 1.8, 60, 0, 2.5, 0),
    ("man_reach", "man", 3, "reach 6, forearms_up 3", 2.0, 60, 0, 2.5, 0),
    ("woman_reach", "woman", 5, "reach 6, twist 3.2", 2.4, 55, 0, 2.5, 0),
    ("woman_random", "woman", 6, "random 10", 2.2, 60, 0, 2.5, 0),
    ("man_random", "man", 7, "random 10", 2.6, 50, 0, 2.5, 8),
    ("child_random", "child", 18, "random 10", 2.2, 50, 5, 2.5, 0),
    ("man_wide_near", "man", 9, "wave_hands 3.4, reach 6", 1.8, 75, 0, 2.5, 0),
    ("woman_far", "woman", 13, "bend_aside 3.4, random 6", 3.5, 45, 0, 2.5, 0),
    ("man_from_above", "man", 11, "wave_hands 3.4, reach 6", 2.4, 60, 15, 2.5, 0),
    ("woman_from_below", "woman", 12, "bow_forward 2.6, overhead 3, twist 3.2", 2.2, 60, -12, 2.5, 0),
    ("man_noisy", "man", 13, "wave_hands 3.4, random 6", 2.0, 60, 0, 8.0, 0),
    ("woman_noisy", "woman", 14, "bend_aside 3.4, reach 6", 2.3, 60, 0, 6.0, -10),
    ("man_boxing", "man", 16, "box 9", 2.2, 60, 0, 2.5, 12),
    ("woman_boxing", "woman", 17, "box 9", 2.4, 55, 0, 2.5, 0),
    ("woman_twist_reach", "woman", 19, "twist 3.2, reach 6", 2.2, 60, 0, 2.5, 0),
    ("child_reach", "child", 21, "reach 6, overhead 3", 2.0, 60, 0, 2.5, 0),
)


def proving_ground() -> tuple[Spec, ...]:
    """Recordings of one camera, bodies x motions x cameras x noise, each of about ten seconds, to choose settings by.

    They are fixed; make the n-th with `numpy.random.default_rng([seed, n])`, for which its own seed is (0, n). Cameras stand
    at 0.9 of the stature when level, so that the picture cuts the legs; higher or lower when pitched, so that the person stays in it.
    """
    return tuple(_proof(n, *row) for n, row in enumerate(PROVING))


def _proof(
    n: int, name: str, kind, seed: int, gestures: str, distance: float, fov: float, pitch: float, noise: float, turn: float
) -> Spec:
    body = Mannequin.draw(np.random.default_rng(seed), kind)
    height = 0.9 * body.stature + distance * float(np.tan(np.radians(pitch)))
    view = Viewpoint(fov_deg=fov, height=height, distance=distance, pitch_deg=pitch)
    return Spec(
        name=name,
        body=body,
        motion=gestures_from(gestures),
        cameras=(view,),
        scene=Scene(clothing=n, room=n, noise=noise),
        turn_deg=turn,
        seed=(0, n),
    )


AROUND = (
    # name, kind and seed of the body, gestures, distance of the seven cameras (m)
    ("ring_upper", "woman", 4, "wave_hands 4, reach 5, random 6", 3.5),
    ("ring_walking", "man", 21, "walk 7", 4.8),
    ("ring_jogging", "woman", 22, "jog 6.5", 4.8),
    ("ring_boxing", "man", 23, "box 6.5", 4.2),
)


def around() -> tuple[Spec, ...]:
    """Recordings of seven cameras around a person, 640 x 480 at 60 pictures a second, of the length of those of HumanEva."""
    specs = []
    for n, (name, kind, seed, gestures, radius) in enumerate(AROUND):
        body = Mannequin.draw(np.random.default_rng(seed), kind)  # pyright: ignore[reportArgumentType]
        ring = Ring(count=7, radius=radius, jitter=0.5, seed=n, size=(640, 480), distortion=(-0.09, 0.05, 0.0, 0.0))
        scene = Scene(clothing=30 + n, room=30 + n)
        specs.append(Spec(name=name, body=body, motion=gestures_from(gestures), ring=ring, scene=scene, rate=60, seed=(1, n)))
    return tuple(specs)


def named_specs() -> dict[str, Spec]:
    """All of them by name: the demo's, the proving ground's, and those of several cameras."""
    return {spec.name: spec for spec in (demo_spec(), *proving_ground(), *around())}
