"""Choice of the key, colour alone or brightness too, that separates a person best from a background."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.silhouette.background import to_planes
from shadowpuppet.silhouette.classifiers import CERTAIN_FACTOR, ChannelClassifier

WARDROBE = (
    (20, 20, 22), (55, 55, 58), (120, 120, 122), (185, 185, 185), (230, 230, 228), (30, 35, 65), (55, 80, 150), (130, 165, 205),
    (165, 40, 45), (95, 30, 45), (50, 100, 60), (95, 95, 60), (95, 70, 50), (195, 175, 145), (225, 180, 155), (185, 135, 105),
    (100, 70, 55),
)
"""Ordinary clothes (black to white, blues, reds, greens, browns) and skin, as cameras show them: red, green, blue."""
CLEAR_FACTOR = 2.0
"""Factor on the threshold of sure pixels from which on a colour differs clearly: light and shading take some of it away."""
COLOUR_ALONE_SHARE = 0.9
"""Share of clothes and skin from which on colour alone is the key, as light and shadow change brightness first."""


class KeyChoice(NamedTuple):
    """A key, and the reason for it."""

    key: str
    reason: str


def choose_key(classifier: ChannelClassifier) -> KeyChoice:
    """Colour alone where most ordinary clothes and skin differ clearly from a classifier's background by it, as from a blue wall; else
    brightness and colour together."""
    share = wardrobe_share(replace(classifier, key="colour"))
    verdict = f"{100 * share:.0f} % of ordinary clothes and skin differ clearly from this background in colour"
    if share >= COLOUR_ALONE_SHARE:
        return KeyChoice("colour", f"colour: {verdict}, and light and shadow change colour least")
    return KeyChoice("both", f"both: brightness and colour, as only {verdict}")


def wardrobe_share(classifier: ChannelClassifier) -> float:
    """Share of pairs (colour of `WARDROBE`, pixel of the background) that differ clearly."""
    step = max(1, min(classifier.mean.shape[:2]) // 40)
    mean, inverse_sigma = (np.ascontiguousarray(a[::step, ::step]).reshape(1, -1, 3)
                           for a in (classifier.mean, classifier.inverse_sigma))
    sparse = replace(classifier, mean=mean, inverse_sigma=inverse_sigma, factor=CLEAR_FACTOR * CERTAIN_FACTOR * classifier.factor)
    colours = to_planes(np.array([WARDROBE], np.uint8)[..., ::-1].copy())[0]
    worn = (np.ascontiguousarray(np.broadcast_to(colour, mean.shape)) for colour in colours)
    return float(np.mean([(sparse.labels(planes) > 0).mean() for planes in worn]))
