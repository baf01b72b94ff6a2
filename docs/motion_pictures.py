"""Make docs/assets/motions.png, four motions from the side: python docs/motion_pictures.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.synthetic import Gesture, Mannequin, Spec, Viewpoint
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import PosedBody
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.scene_renderer import dressed
from shadowpuppet.video import write_image

TARGET = Path(__file__).parent / "assets" / "motions.png"
ROWS = (
    ("woman", Gesture(motion="walk", seconds=8, path="spot"), 4.0, 0.125),
    ("man", Gesture(motion="jog", seconds=8, path="spot"), 4.0, 0.09),
    ("child", Gesture(motion="box", seconds=8), 2.4, 0.31),
    ("woman", Gesture(motion="lift", seconds=6), 1.2, 0.42),
)
"""Body, motion, first time (s) and time step (s) of each row."""
COUNT, SIZE, GREYS = 9, (136, 186), 6
"""Images per row, the size of each, and the quantisation step of the grey levels."""
LAMPS = np.array([[0.5, -0.5, 0.7, 0.5], [0.6, 0.5, 0.2, 0.25], [0, 0, 0, 0.55]])


def row(n: int, kind, gesture: Gesture, begin: float, step: float) -> np.ndarray:
    """A motion seen from the person's left."""
    rng = np.random.default_rng(n)
    body, clothes = Mannequin.draw(rng, kind), Clothes.draw(np.random.default_rng(n + 11))
    _, figure = perform(Spec(body=body, motion=(gesture,), rate=100.0), rng)
    view = Viewpoint(size=SIZE, fov_deg=18.5, distance=4.6, height=0.93, azimuth_deg=90, pitch_deg=1)
    renderer = PersonRenderer(view.camera(), dressed(body, clothes), clothes, LAMPS)
    tiles = []
    for index in np.rint((begin + step * np.arange(COUNT)) * 100).astype(int):
        one, there = PosedBody(*(part[index : index + 1] for part in figure)), figure.joints[index, 0] * [1, 1, 0]
        shot = renderer.draw(one._replace(origin=one.origin - there, joints=one.joints - there), 0)
        tiles.append(shot.picture + (1 - shot.alpha[..., None]) * 0.93)
    return np.concatenate(tiles, 1)


def main() -> None:
    """Write the picture."""
    sheet = np.concatenate([row(n, *values) for n, values in enumerate(ROWS)])
    write_image(TARGET, (np.clip(255 * sheet, 0, 255).astype(np.uint8) // GREYS * GREYS)[..., ::-1])
    print(f"{TARGET}: {TARGET.stat().st_size} bytes")


if __name__ == "__main__":
    main()
