"""The fixed set of faults, and the made films that get them: for `faults.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shadowpuppet.synthetic import Mannequin, Ring, Scene, Spec, Viewpoint, spec_from
from shadowpuppet.synthetic.faults.fault import faults_from_text
from shadowpuppet.synthetic.spec import spec_values
from shadowpuppet.synthetic.spec_changes import parse_gestures

CLEAN = "clean"


@dataclass(frozen=True)
class Row:
    """A fault, or an event, in the films of one camera or of several."""

    name: str
    faults: str = ""
    """As `--faults` of `shadowpuppet synthesize` has them."""
    begin: float = 0.0
    """Second of its beginning; 0: the whole film has it."""
    end: float = np.inf
    """Second of its end, from which all should be as before; infinite: it stays."""
    scene: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the scene that differ."""

    def of(self, film: Spec) -> Spec:
        """The spec of a film with this fault."""
        values = spec_values(film)
        values["scene"] |= self.scene
        return spec_from(values | {"faults": faults_from_text(self.faults) if self.faults else []})


def _stays(name: str, fault: str, camera: str = "", since: float = 3.0) -> Row:
    return Row(name, f"{fault} @{since:g} {camera}".strip(), since)


def _passes(name: str, fault: str, begin: float, end: float, camera: str = "") -> Row:
    return Row(name, f"{fault} @{begin:g}-{end:g} {camera}".strip(), begin, end)


def _beside(**values: Any) -> dict[str, Any]:
    return {"bystanders": [{"seed": 4, "kind": "man", **values}]}


def _thing(**times: float) -> dict[str, Any]:
    """A pillar before an arm, in the film only."""
    return {"obstacles": [{"kind": "pillar", "ahead": 0.7, "left": 0.35, **times}]}


def _moved_chair() -> dict[str, Any]:
    """A chair in the empty scene, too, that stands elsewhere from second 2 on."""
    return {"obstacles": [{"kind": "chair", "ahead": -0.3, "left": 1.4, "leaves": 2.0},
                          {"kind": "chair", "ahead": -0.2, "left": 0.85, "turn_deg": 30, "enters": 2.0}]}  # fmt: skip


CROSSING = {"turn_deg": 90, "motion": {"motion": "walk", "path": "line", "size": 5.5}}
"""A person who walks past, in the picture between the rows' begin and end."""
ONE: tuple[Row, ...] = (
    Row(CLEAN),
    _stays("gain 0.9 from the middle on", "gain 0.9"),
    _stays("gain 1.3 from the middle on", "gain 1.3"),
    _passes("gain 0.6 for 1.5 s", "gain 0.6", 2.5, 4),
    Row("gain 0.9 throughout", "gain 0.9"),
    Row("gain from 0.7 slowly to 1.3", "gain 0.7, gain 1.857 drift"),
    Row("sunset: slowly to gain 0.6, redder", "gain 0.6 drift, white_balance 1.15 drift"),
    _stays("white balance 1.1 from the middle on", "white_balance 1.1"),
    _stays("white balance 1.3 from the middle on", "white_balance 1.3"),
    Row("white balance slowly to 1.4", "white_balance 1.4 drift"),
    Row("flicker of 5 %", "flicker 0.05"),
    Row("flicker of 20 %", "flicker 0.2"),
    _stays("a lamp switched on, 1.5", "lamp 1.5"),
    _stays("a lamp switched off, 0.5", "lamp 0.5"),
    Row("a patch of sun, 1.5, wanders", "sun 1.5 drift"),
    Row("vignetting of 20 %", "vignetting 0.2"),
    Row("vignetting of 50 %", "vignetting 0.5"),
    Row("noise of 5", "noise 5"),
    Row("noise of 10", "noise 10"),
    Row("noise of 15", "noise 15"),
    Row("noise of 15, empty scene too", scene={"noise": 15.0}),
    Row("crf 28", "crf 28"),
    Row("crf 32", "crf 32"),
    Row("crf 32, empty scene too", scene={"crf": 32}),
    Row("crf 40", "crf 40"),
    Row("blur over 2 frames", "motion_blur 2"),
    Row("blur over 5 frames", "motion_blur 5"),
    Row("out of focus, 2 pixels", "defocus 2"),
    _stays("nudged by 5 pixels", "nudge 5"),
    _stays("nudged by 20 pixels", "nudge 20"),
    Row("shaking by 2 pixels", "shake 2"),
    Row("shaking by 10 pixels", "shake 10"),
    _passes("frozen for 1 s", "frozen", 3, 4),
    _stays("frozen for good", "frozen"),
    _passes("black for 1 s", "black", 3, 4),
    _passes("leaves for 2 s", "absent", 2.5, 4.5),
    Row("a pillar comes and stays", begin=3, scene=_thing(enters=3.0)),
    Row("a pillar comes for 1.5 s", begin=2.5, end=4, scene=_thing(enters=2.5, leaves=4.0)),
    Row("a chair beside is moved", begin=2, scene=_moved_chair()),
    Row("a second person 1 m aside", scene=_beside(ahead=0.0, left=1.0)),
    Row("a second person passes behind", begin=2, end=5.5, scene=_beside(ahead=-1.2, left=0.0, **CROSSING)),
    Row("a second person passes in front", begin=2.7, end=4.7, scene=_beside(ahead=0.5, left=0.0, **CROSSING)),
)
"""Faults of one camera's film."""
SEVERAL: tuple[Row, ...] = (
    Row(CLEAN),
    Row("all: gain 0.7 throughout", "gain 0.7"),
    _stays("all: gain 1.3 from the middle on", "gain 1.3", since=2),
    _stays("one: white balance 1.3 from the middle on", "white_balance 1.3", "cam2", 2),
    Row("all: crf 32", "crf 32"),
    Row("one: crf 40", "crf 40 cam2"),
    Row("all: noise of 15", "noise 15"),
    Row("all: blur over 2 frames", "motion_blur 2"),
    _stays("one nudged by 5 pixels", "nudge 5", "cam2", 2),
    _stays("one nudged by 20 pixels", "nudge 20", "cam2", 2),
    Row("one shaking by 5 pixels", "shake 5 cam2"),
    _passes("one frozen for 1 s", "frozen", 2, 3, "cam2"),
    _stays("one frozen for good", "frozen", "cam2", 2),
    _stays("one black for good", "black", "cam2", 2),
    _stays("one late by 5 frames", "late 5", "cam2", 2),
    Row("one loses a frame in 20", "dropped 0.05 cam2"),
    _passes("all: every picture twice for 1 s", "repeated 2", 2, 3),
    Row("a pillar comes and stays", begin=2, scene=_thing(enters=2.0)),
    Row("a second person 1 m aside", scene=_beside(ahead=0.0, left=1.0)),
)
"""Faults of several cameras' films; cam2 is the second of four."""


def films_of_one() -> tuple[Spec, ...]:
    """Films of one camera, some 7 s each: a plain one, and one with clothes near the wall's colour in front of bricks."""
    scene: dict[str, Any] = {"empty_seconds": 2.0}
    man, woman = (Mannequin.draw(np.random.default_rng(seed), kind) for seed, kind in ((61, "man"), (62, "woman")))
    return (
        Spec(name="man_waves", body=man, motion=parse_gestures("wave_hands 2.7, bend_aside 2.7"), seed=(15, 1),
             cameras=(Viewpoint(height=0.9 * man.stature, distance=2.1),), scene=Scene(clothing=61, room=61, **scene)),
        Spec(name="woman_bends", body=woman, motion=parse_gestures("bend_aside 2.7, overhead 2.7"), seed=(15, 2),
             cameras=(Viewpoint(height=0.9 * woman.stature, distance=2.3, fov_deg=56),),
             scene=Scene(clothing=62, room=64, background="textured", camouflage=0.3, **scene)),
    )


def films_of_several() -> tuple[Spec, ...]:
    """Films of four cameras, some 4 s each."""
    man = Mannequin.draw(np.random.default_rng(63), "man")
    return (Spec(name="man_walks", body=man, motion=parse_gestures("walk 2.6"), ring=Ring(count=4, radius=4.2, fov_deg=44, seed=15),
                 training=(), scene=Scene(clothing=63, room=63, empty_seconds=2.0), rate=20, seed=(15, 3)),)


def tiny(film: Spec) -> Spec:
    """The film in few and small pictures, for `--smallest`."""
    cameras = tuple(replace(view, size=(160, 120)) for view in film.cameras)
    return replace(film, cameras=cameras, rate=6, scene=replace(film.scene, empty_seconds=1))
