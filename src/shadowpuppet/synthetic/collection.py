"""Named specs: the demo's, and the proving grounds on which settings are chosen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from shadowpuppet.synthetic.furniture import Obstacle
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.movement.script import Gesture
from shadowpuppet.synthetic.person.mannequin import Mannequin, PersonKind
from shadowpuppet.synthetic.spec import Scene, Spec
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.synthetic.viewpoint import Ring, Viewpoint


def demo_spec() -> Spec:
    """The recording of `shadowpuppet demo`: the three motions of Liu 2011 and a reach, 15 s."""
    gestures = parse_gestures("wave_hands 3.6, bend_aside 3.6, bow_forward 2.8, reach 4.2")
    return Spec(name="demo", body=Mannequin(stature=1.78), motion=gestures, scene=Scene(clothing=7, room=2))


def demo_ring_spec() -> Spec:
    """The recording of several cameras of `shadowpuppet demo`: a person walks and turns in front of four small cameras, 5.6 s."""
    ring = Ring(count=4, radius=3.8, start_deg=35, jitter=0.5, fov_deg=42, seed=5)
    scene, gestures = Scene(clothing=8, room=3, empty_seconds=1.5), parse_gestures("walk 2, turn_around 2")
    return Spec(name="demo_ring", body=Mannequin(stature=1.70, build=0.2), motion=gestures, ring=ring, scene=scene, rate=20)


PAPER = "wave_hands 3.6, bend_aside 3.6, bow_forward 2.8"
PROVING: tuple[tuple[str, PersonKind, int, str, float, float, float, float, float], ...] = (
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


def proving_ground(shift: int = 0) -> tuple[Spec, ...]:
    """Recordings of one camera on which settings are chosen: bodies x motions x cameras x noise, about ten seconds each.

    They are fixed; make the n-th with `numpy.random.default_rng([seed, n])`, its own seed being (0, n). Level cameras stand at 0.9 of the
    stature, so that the picture cuts the legs; pitched ones higher or lower, so that the person stays in the picture. With a `shift` they
    have other people, clothes and rooms, to test the choices; their seeds are (shift, n).
    """
    specs = []
    for n, (name, kind, seed, gestures, distance, fov, pitch, noise, turn) in enumerate(PROVING):
        body = Mannequin.draw(np.random.default_rng(seed + shift), kind)
        height = 0.9 * body.stature + distance * float(np.tan(np.radians(pitch)))
        view = Viewpoint(fov_deg=fov, height=height, distance=distance, pitch_deg=pitch)
        specs.append(Spec(name=name, body=body, motion=parse_gestures(gestures), cameras=(view,), turn_deg=turn,
                          scene=Scene(clothing=n + shift, room=n + shift, noise=noise), seed=(shift, n)))
    return tuple(specs)


def _person(kind: PersonKind, seed: int, bmi: float | None = None, age: float | None = None) -> Mannequin:
    return Mannequin.draw(np.random.default_rng(seed), kind, bmi=bmi, age=age)


AROUND: tuple[tuple[str, PersonKind, int, str, float], ...] = (
    # name, kind and seed of the body, gestures, distance of the seven cameras (m)
    ("ring_upper", "woman", 4, "wave_hands 4, reach 5, random 6", 3.5),
    ("ring_walking", "man", 21, "walk 7", 4.8),
    ("ring_jogging", "woman", 22, "jog 6.5", 4.8),
    ("ring_boxing", "man", 23, "box 6.5", 4.2),
)


def around() -> tuple[Spec, ...]:
    """Recordings of seven cameras around a person, 640 x 480 at 60 frames/s, as long as those of HumanEva."""
    specs = []
    for n, (name, kind, seed, gestures, radius) in enumerate(AROUND):
        body = Mannequin.draw(np.random.default_rng(seed), kind)
        ring = Ring(count=7, radius=radius, jitter=0.5, seed=n, size=(640, 480), distortion=(-0.09, 0.05, 0.0, 0.0))
        scene = Scene(clothing=30 + n, room=30 + n)
        specs.append(Spec(name=name, body=body, motion=parse_gestures(gestures), ring=ring, scene=scene, rate=60, seed=(1, n)))
    return tuple(specs)


VGA, WIDE_LENS, PLAIN_LENS = (640, 480), (-0.22, 0.06, 0.0, 0.0), (-0.09, 0.05, 0.0, 0.0)


def _rings() -> tuple[tuple[str, Mannequin, str, str | None, Ring, dict[str, Any], float], ...]:
    """One row per recording; a function, because checking a ring with a distorted lens loads OpenCV."""
    return (
        # name, body, gestures, those of the training (None: the same, "": none), cameras, scene, pictures a second
        ("rings_walk", _person("woman", 41), "walk 4", None, Ring(count=5, radius=4.4, fov_deg=48, size=(480, 360)), {}, 60),
        ("rings_jog", _person("man", 42), "jog 3.5", "walk 4", Ring(count=7, radius=5.0, size=VGA, distortion=PLAIN_LENS), {}, 60),
        ("rings_box", _person("man", 43), "box 4.4", None, Ring(count=4, radius=3.6, height=2.3, fov_deg=50, size=VGA), {"noise": 4.0}, 60),
        ("rings_squat", _person("man", 44, bmi=38), "squat 4.8", "lift 5", Ring(count=6, radius=3.8, start_deg=30, fov_deg=48), {}, 30),
        ("rings_lift", _person("woman", 45, bmi=31), "lift 4.5", "bow_forward 3, squat 2.4",
         Ring(count=5, radius=4.0, height=1.2, jitter=0.8, fov_deg=52, size=(480, 360), distortion=PLAIN_LENS),
         {"background": "cluttered"}, 50),
        ("rings_sit", _person("child", 46, age=9), "sit 4.4", None,
         Ring(count=3, radius=3.2, height=1.9, start_deg=20, fov_deg=44, size=(480, 360)), {}, 30),
        ("rings_reach", _person("woman", 47), "wave_hands 2.4, reach 3", "random 5",
         Ring(count=8, radius=3.4, fov_deg=48, size=(320, 240)), {"noise": 7.0, "shadow": 0.35}, 30),
        ("rings_jump", _person("man", 48), "march 2.4, jump 2.2", "", Ring(count=6, radius=4.2, height=0.8, size=VGA), {}, 60),
        ("rings_cut", _person("man", 49), "walk 4.4", "walk 3, turn_around 3",
         Ring(count=8, radius=2.8, height=1.5, jitter=1.0, fov_deg=46, size=(480, 360)), {}, 50),
        ("rings_child", _person("child", 50, age=7), "box 3, jump 2.2", "random_body 6",
         Ring(count=4, radius=3.0, height=1.4, jitter=0.7, fov_deg=75, size=VGA, distortion=WIDE_LENS), {"background": "textured"}, 60),
        ("rings_bend", _person("woman", 51), "bow_forward 2.6, bend_aside 2.4", "lift 5, reach 3",
         Ring(count=3, radius=3.8, fov_deg=48, size=(480, 360)), {"noise": 5.0}, 30),
        ("rings_turn", _person("man", 52, bmi=21), "turn_around 2.6, random_body 2.6", "walk 4, box 4",
         Ring(count=6, radius=2.6, height=2.6, fov_deg=110, fisheye=True, size=VGA), {"room": 71}, 30),
    )


def proving_rings() -> tuple[Spec, ...]:
    """Recordings of 3 to 8 cameras, four to six seconds each, on which the settings of the several-camera tracker are chosen.

    Bodies (thin to heavy, a child of seven to tall men) x motions x rings (near and far, high and low, irregular, cutting the person,
    fisheyes) x noise and rooms. The training motion is another performance of the same gestures, of other gestures, or absent. They are
    fixed; the n-th is made with its own seed, (2, n).
    """
    return tuple(
        Spec(name=name, body=body, motion=parse_gestures(gestures), ring=replace(ring, seed=n),
             training=None if training is None else parse_gestures(training) if training else (),
             scene=Scene(**{"clothing": 60 + n, "room": 60 + n, "empty_seconds": 2.0, **scene}), rate=rate, seed=(2, n))
        for n, (name, body, gestures, training, ring, scene, rate) in enumerate(_rings(), 1)
    )  # fmt: skip


RESTING: tuple[tuple[str, PersonKind, int, PostureName, str, str, int], ...] = (
    # name, kind and seed of the body, posture, gestures, chair (none, known: in the empty scene too, new: in the film only), cameras
    ("sits", "man", 61, "seated", "reach 4, wave_hands 3", "known", 1),
    ("sits_on_new", "man", 61, "seated", "reach 4, wave_hands 3", "new", 1),
    ("sits_down", "woman", 62, "standing", "sit_down 5", "known", 1),
    ("kneels", "woman", 63, "kneeling", "wave_hands 3, forearms_up 3", "none", 1),
    ("rings_sits", "woman", 72, "seated", "stand 2, reach 4", "known", 4),
    ("rings_sits_on_new", "woman", 72, "seated", "stand 2, reach 4", "new", 4),
    ("rings_sits_down", "man", 65, "standing", "sit_down 5", "known", 4),
    ("rings_kneels", "man", 66, "kneeling", "stand 2, wave_hands 3", "none", 4),
    ("rings_lies", "woman", 67, "lying", "stand 2, reach 4", "none", 4),
)


def resting() -> tuple[Spec, ...]:
    """Recordings of people who sit, sit down, kneel and lie: the upper body with one camera, the whole body with four; and of one who walks
    through the picture of one camera to and fro, away for some 3 s between.

    One camera stands level, 2.1 m away, at the height of the shoulders; its picture shows the hips and cuts the legs.
    """
    body = _person("man", 68)
    walk = Gesture(motion="walk", seconds=11, path="line", size=5.0)
    passes = Spec(name="comes_and_goes", body=body, motion=(walk,), turn_deg=90, scene=Scene(clothing=68, room=68, empty_seconds=2.0),
                  cameras=(Viewpoint(height=0.9 * body.stature, distance=2.4),), tells="height", seed=(4, len(RESTING)))
    return (*(_resting(n) for n in range(len(RESTING))), passes)


def _resting(n: int) -> Spec:
    name, kind, seed, posture, gestures, chair, cameras = RESTING[n]
    body = _person(kind, seed)
    seat = Obstacle(kind="chair", seat=True, enters=0.0 if chair == "new" else None)
    look = {"clothing": seed, "room": seed, "empty_seconds": 2.0, "obstacles": (seat,)[: chair != "none"]}
    spec = Spec(name=name, body=body, posture=posture, motion=parse_gestures(gestures), training=(), scene=Scene(**look), seed=(4, n))
    if cameras > 1:
        ring = Ring(count=cameras, radius=3.6, height=1.7, start_deg=25, jitter=0.5, fov_deg=46, seed=n)
        return replace(spec, ring=ring)
    height = {"seated": 0.62, "kneeling": 0.62}.get(posture, 0.75) * body.stature
    return replace(spec, cameras=(Viewpoint(height=height, distance=2.1),))


def named_specs() -> dict[str, Spec]:
    """All specs by name."""
    chosen = (*proving_ground(), *around(), *proving_rings(), *resting())
    return {spec.name: spec for spec in (demo_spec(), demo_ring_spec(), *chosen)}
