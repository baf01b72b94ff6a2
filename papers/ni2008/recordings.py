"""Recordings in place of HumanEva's, which need a licence: the paper's cameras, rate and numbers of frames (Ni 2008, VI and Table I)."""

from __future__ import annotations

import numpy as np

from shadowpuppet.synthetic import Mannequin, Ring, Scene, Spec
from shadowpuppet.synthetic.collection import PLAIN_LENS, VGA
from shadowpuppet.synthetic.person.mannequin import PersonKind
from shadowpuppet.synthetic.spec_changes import parse_gestures

HUMANEVA: tuple[tuple[str, PersonKind, int, str, float, int, float, float, tuple[int, int]], ...] = (
    # name, kind and seed of the body, gestures, seconds of them before the film, its frames, distance (m) and field of view (degrees) of
    # the cameras, seeds of clothes and room
    ("humaneva_walking", "man", 21, "walk 11", 2.0, 433, 4.8, 48, (92, 92)),
    ("humaneva_jogging", "woman", 22, "jog 10", 2.0, 393, 4.8, 48, (81, 81)),
    ("humaneva_boxing", "man", 23, "box 10", 1.2, 377, 4.2, 42, (91, 92)),
)
TRAINING_FRAMES = 100
"""Number of training frames in Table I."""


def humaneva() -> tuple[Spec, ...]:
    """Seven cameras of 640 x 480 at 60 frames/s; 433 frames of walking, 393 of jogging and 377 of boxing; 100 training frames of the same
    person's joints.

    People move by published angles, not by motion capture, and the training motion is another performance of the same gestures.
    """
    specs = []
    for n, (name, kind, seed, gestures, begin, frames, radius, fov, (clothing, room)) in enumerate(HUMANEVA):
        ring = Ring(count=7, radius=radius, fov_deg=fov, jitter=0.5, seed=10 + n, size=VGA, distortion=PLAIN_LENS)
        specs.append(Spec(name=name, body=Mannequin.draw(np.random.default_rng(seed), kind), motion=parse_gestures(gestures), begin=begin,
                          frames=frames, training_frames=TRAINING_FRAMES, ring=ring, scene=Scene(clothing=clothing, room=room), rate=60,
                          tells="height", seed=(3, n)))
    return tuple(specs)
