"""How the cost of a particle grows: with the number of particles, the size of the picture, the number of cards."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.camera.rasterize import pack
from shadowpuppet.evaluation.bench.mono_cases import SIZE, Case
from shadowpuppet.evaluation.bench.timing import Contender, in_turns

PARTICLES = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
WIDTHS = (80, 160, 320, 640, 1280, 1920)
CARDS = (1, 2, 4, 6, 8, 10, 12, 15)
BODIES = ("cardbox", "boxes", "rounded")


def curves(rounds: int, quick: bool = False) -> dict[str, Any]:
    """Least times, microseconds a particle: for each axis its values and, by body, the times."""
    step = 3 if quick else 1
    particles, widths, cards = PARTICLES[::step], WIDTHS[::step], CARDS[::step]
    runs: dict[str, Contender] = {}
    for body in BODIES:
        runs |= {f"particles {body} {n}": Contender(Case(body, particles=n).run, n) for n in particles}
        runs |= {f"width {body} {w}": Contender(Case(body, size=(w, w * 3 // 4)).run, 200) for w in widths}
    runs |= {f"cards cardbox {n}": Contender(_some_cards(n), 200) for n in cards}
    took = {name: 1e6 * times.least for name, times in in_turns(runs, rounds).items()}
    return {
        "particles": {"values": particles, **{body: [took[f"particles {body} {n}"] for n in particles] for body in BODIES}},
        "width": {"values": widths, **{body: [took[f"width {body} {w}"] for w in widths] for body in BODIES}},
        "cards": {"values": cards, "cardbox": [took[f"cards cardbox {n}"] for n in cards]},
    }


def _some_cards(number: int):
    """Costs of a cardbox of which only some cards are drawn, evenly spread over its parts."""
    case = Case(size=SIZE)
    which = np.unique(np.linspace(0, len(case.picture.body.parts) - 1, number).round().astype(np.int64))
    silhouette, empty = pack(case.mask), case.picture.empty()
    return lambda: case.picture.added(case.poses, which, silhouette, empty)
