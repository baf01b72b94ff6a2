"""Exact silhouettes of the made person in a ring of cameras, without films."""

from __future__ import annotations

from functools import cache

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.synthetic import Mannequin, Ring, Spec
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.scene_renderer import dressed
from shadowpuppet.synthetic.spec_changes import parse_gestures


@cache
def person(stature: float, posture: PostureName = "standing", motion: str = "stand", moments: int = 1,
           cameras: int = 4) -> tuple[list[Camera], list[tuple[Mask, ...]]]:
    """The cameras, and masks (H, W) by time and camera of a person of a stature, metres, at moments spread over a motion of two seconds."""
    ring = Ring(count=cameras, radius=3.5, fov_deg=60, size=(240, 180))
    spec = Spec(body=Mannequin(stature=stature), motion=parse_gestures(f"{motion} 2"), posture=posture, rate=10, ring=ring)
    times, figure = perform(spec, np.random.default_rng(3))
    views, clothes = [view.camera() for view in spec.views()], Clothes()
    drawn = [PersonRenderer(view, dressed(spec.body, clothes), clothes, np.array([[0, 0, 1.0, 0]] * 3)) for view in views]
    chosen = np.linspace(0.3, 0.8, moments) * (len(times) - 1)
    return views, [tuple(each.mask(figure, int(n)) for each in drawn) for n in chosen]
