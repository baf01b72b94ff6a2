"""Make docs/assets/angles.png, what each angle of the body `anatomical` does: python docs/make_angles_picture.py. Needs matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.conventions import BEND, Convention, conventions
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import AXES, BONES
from shadowpuppet.geometry import Array

TARGET = Path(__file__).parent / "assets" / "angles.png"
TURN = np.radians(35)
"""By which each angle is increased."""
VIEWS = (("from the front", (1, 2), (1, 1)), ("from the left", (0, 2), (-1, 1)), ("from above", (1, 0), (-1, 1)))
"""By the axis that an angle turns about: name, the body's axes to the picture's right and up, and their signs."""
SPAN = ((-0.72, 0.72), (-1.02, 0.82))
"""Of a panel, metres, about the pelvis; from above less."""
COLUMNS, GREY, RED = 7, "#b4bac2", "#d55e00"


def draw(axes: Any, body: Body, d: int, each: Convention) -> None:
    """The skeleton at zero, grey, and with an angle increased, red, along the angle's axis."""
    pose = body.skeleton.pose(**{each.bent: np.radians(BEND)} if each.bent else {})
    more = pose.copy()
    more[d] += TURN
    name, plane, signs = VIEWS[AXES[each.dof.axis][0]]
    before, after = (places[:, plane] * signs for places in body.points(np.stack([pose, more])))
    moved = np.linalg.norm(body.points(np.stack([pose, more]))[1] - body.points(pose[None])[0], axis=1) > 1e-6
    for places, colour, chosen in ((before, GREY, None), (after, RED, moved)):
        _bones(axes, body, places, colour, chosen)
    n = body.landmark_names.index(each.landmark)
    axes.annotate("", after[n], before[n], arrowprops={"arrowstyle": "->", "color": RED, "lw": 1.2})
    axes.set_title(each.dof.name, fontsize=10, fontweight="bold", pad=26)
    words = f"{name}: {each.landmark.replace('_', ' ')}\nmoves {each.moves}"
    axes.text(0.5, 1.01, words, transform=axes.transAxes, ha="center", va="bottom", fontsize=8.5)
    near = 0.42 if name == "from above" else 1.0
    axes.set(aspect="equal", xlim=np.multiply(SPAN[0], near), ylim=np.multiply(SPAN[1], near))
    axes.set_axis_off()


def _bones(axes: Any, body: Body, places: Array, colour: str, chosen: Array | None) -> None:
    names = body.landmark_names
    for a, b in (*BONES, ("left_heel", "left_toe"), ("right_heel", "right_toe")):
        i, k = names.index(a), names.index(b)
        if chosen is None or chosen[i] or chosen[k]:
            axes.plot(*places[[i, k]].T, color=colour, lw=2, solid_capstyle="round")


def main() -> None:
    """Write the picture."""
    body = make_body("anatomical", average_sizes("anatomical", AVERAGE_HEIGHT))
    shown = [(d, each) for d, each in enumerate(conventions(body))
             if each.dof.kind != "translation" and not each.dof.name.startswith("right_")]  # fmt: skip
    rows = -(-len(shown) // COLUMNS)
    figure = Figure(figsize=(12.5, 3.0 * rows), layout="constrained")
    grid = figure.subplots(rows, COLUMNS)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (d, each) in zip(grid.flat, shown):
        draw(axes, body, d, each)
    figure.savefig(TARGET, dpi=90, bbox_inches="tight", pad_inches=0.1)
    print(f"{TARGET}: {TARGET.stat().st_size} bytes")


if __name__ == "__main__":
    main()
