"""Fingerprints of made recordings: what the documentation's figures were measured on stays what it is.

After an intended change `python tests/support/kept.py` updates `kept.json`, and the documented figures must be measured again.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from papers.ni2008.recordings import humaneva
from shadowpuppet.synthetic import Bystander, Fault, Gesture, Mannequin, Obstacle, Ring, Scene, Spec, Viewpoint, spec_text
from shadowpuppet.synthetic.collection import around, named_specs, proving_ground, proving_rings, resting
from shadowpuppet.synthetic.faults.camera_faults import CameraFaults
from shadowpuppet.synthetic.faults.kinds import KINDS
from shadowpuppet.synthetic.movement.actions import ACTIONS
from shadowpuppet.synthetic.movement.gestures import GESTURES
from shadowpuppet.synthetic.recording import _bystander, perform
from shadowpuppet.synthetic.scene_renderer import SceneRenderer

FILE = Path(__file__).with_name("kept.json")
WOMAN = Mannequin.draw(np.random.default_rng(3), "woman")
BODIES = [Mannequin.draw(np.random.default_rng(5), kind) for kind in ("man", "child", None)]

MOTIONS = {name: Spec(motion=(Gesture(motion=name, seconds=6),)) for name in (*GESTURES, *ACTIONS)}
MOTIONS |= {f"walk_{path}": Spec(motion=(Gesture(motion="walk", seconds=7, path=path),)) for path in ("circle", "ellipse", "line", "spot")}
MOTIONS |= {"walk_fast": Spec(motion=(Gesture(motion="walk", seconds=4, speed=1.9, size=3),)),
            "walk_slow": Spec(motion=(Gesture(motion="walk", seconds=4, speed=0.6, size=3),)),
            "jog": Spec(motion=(Gesture(motion="jog", seconds=4, size=3),)),
            "many": Spec(motion=tuple(Gesture(motion=name, seconds=2) for name in ("walk", "reach", "turn_around", "sit")), still=0),
            **{posture: Spec(motion=(Gesture(motion="wave_hands"),), posture=posture) for posture in ("seated", "kneeling", "lying")}}

SMALL = Spec(motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(Viewpoint(size=(64, 48)),), rate=4, frames=3)
THINGS = (Obstacle(kind="table", ahead=0.7, left=0.5, turn_deg=20), Obstacle(kind="chair", ahead=-0.6, left=-0.8, turn_deg=-130),
          Obstacle(kind="pillar", ahead=0.4, left=-0.5, colour=4), Obstacle(kind="cabinet", ahead=-0.5, left=1.0, enters=0.5))
SCENES = {style: replace(SMALL, scene=Scene(background=style)) for style in ("room", "plain", "cluttered", "textured")}
SCENES |= {"things": replace(SMALL, scene=Scene(obstacles=THINGS, room=4)),
           "shadow": replace(SMALL, scene=Scene(clothing=5, room=9, shadow=0.6, noise=0)),
           "camouflage": replace(SMALL, scene=Scene(camouflage=0.8)), "lamps": replace(SMALL, scene=Scene(flicker=0.3, drift=-0.5)),
           "company": replace(SMALL, scene=Scene(bystanders=(Bystander(kind="child", motion=Gesture(motion="walk")),))),
           "ring": replace(SMALL, cameras=(Viewpoint(),), ring=Ring(count=3, size=(64, 48), jitter=0.6, distortion=(-0.09, 0.05, 0, 0))),
           "fisheye": replace(SMALL, cameras=(Viewpoint(size=(64, 48), fisheye=True, fov_deg=110, pitch_deg=10, roll_deg=5,
                                                        azimuth_deg=70),)),
           **{f"body_{n}": replace(SMALL, body=body, scene=Scene(clothing=n + 2)) for n, body in enumerate(BODIES)}}  # fmt: skip

FAULTS = {kind: replace(SMALL, frames=5, scene=Scene(noise=0), faults=(Fault(kind=kind),)) for kind in KINDS}
FAULTS["two"] = replace(SMALL, frames=5, faults=(Fault(kind="gain", drift=True, end=1), Fault(kind="nudge", roll_deg=5, begin=0.5)))

SETS = {"proving_ground": proving_ground, "proving_rings": proving_rings, "around": around, "humaneva": humaneva, "resting": resting,
        "named": lambda: tuple(named_specs().values())}


def kept() -> dict[str, dict]:
    return json.loads(FILE.read_text("utf-8"))


def fingerprint(*values: np.ndarray) -> list[float]:
    """Three sums of all values with random weights."""
    row = np.concatenate([np.ravel(value).astype(float) for value in values])
    return (np.random.default_rng(7).normal(size=(3, len(row))) @ row / np.sqrt(len(row))).tolist()


def motion(name: str) -> list[float]:
    """Of a woman's joints, turns of the segments and fingers, at 5 frames/s."""
    return fingerprint(*perform(replace(MOTIONS[name], body=WOMAN, rate=5, turn_deg=10), np.random.default_rng(1))[1])


def pictures(spec: Spec) -> list[float]:
    """Of the first frames of all cameras, of their masks and of the empty scene."""
    found, (_, figure) = [], perform(spec, np.random.default_rng(1))
    count = len(figure.joints)
    others = [_bystander(spec, each, count, np.random.default_rng(2), figure) for each in spec.scene.bystanders]
    for view in spec.views():
        faults = CameraFaults(spec.faults, view.camera(), count, spec.rate, np.random.default_rng(4))
        studio = SceneRenderer(spec, view.camera(), np.random.default_rng(3), others, faults=faults)
        found += [studio.empty(), *(array for frame in studio.film(figure, 1) for array in (frame.image, frame.mask, frame.people))]
    return fingerprint(*found)


def digest(name: str) -> str:
    """Of all specs of a set, with six digits of each number: processors differ in the last one."""
    text = "".join(map(spec_text, SETS[name]()))
    return hashlib.sha256(re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.6g}", text).encode()).hexdigest()


if __name__ == "__main__":
    made = {"motions": {name: motion(name) for name in MOTIONS}, "sets": {name: digest(name) for name in SETS},
            "scenes": {name: pictures(spec) for name, spec in SCENES.items()},
            "faults": {name: pictures(spec) for name, spec in FAULTS.items()}}
    FILE.write_text(json.dumps(made, indent=1) + "\n", "utf-8")
