"""What to compare, brightness, colour or both, chosen by what would set a person off from this background."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.silhouette.background import to_planes
from shadowpuppet.silhouette.classifiers import CERTAIN_FACTOR, KEY_CHANNELS, ChannelClassifier

WARDROBE = (
    (20, 20, 22), (55, 55, 58), (120, 120, 122), (185, 185, 185), (230, 230, 228), (30, 35, 65), (55, 80, 150), (130, 165, 205),
    (165, 40, 45), (95, 30, 45), (50, 100, 60), (95, 95, 60), (95, 70, 50), (195, 175, 145), (225, 180, 155), (185, 135, 105),
    (100, 70, 55),
)
"""Ordinary clothes (black to white, blues, reds, greens, browns) and skin, as cameras show them: red, green, blue."""
CLEAR_FACTOR = 2.0
"""How many times more than a sure pixel's threshold a colour must differ to count: light and shading take some of it away."""
COLOUR_ALONE_SHARE = 0.9
"""Share of clothes and skin from which on colour alone is preferred, as light and shadow change brightness first."""
MIN_COLOUR_GAIN = 0.01
"""Gain in that share below which colour is not worth its noise."""


class KeyChoice(NamedTuple):
    """A key, and why."""

    key: str
    reason: str


def choose_key(rule: ChannelClassifier) -> KeyChoice:
    """The key by which most ordinary clothes and skin would differ clearly from the background of `rule`, whatever its own key.

    Both together always see the most; one alone is taken where it does nearly as well.
    """
    seen = {key: wardrobe_share(replace(rule, key=key)) for key in KEY_CHANNELS}
    brightness, colour, both = (f"{100 * seen[key]:.0f} %" for key in ("brightness", "colour", "both"))
    told = "of ordinary clothes and skin differ clearly from this background"
    if seen["both"] - seen["brightness"] < MIN_COLOUR_GAIN:
        return KeyChoice("brightness", f"brightness: {brightness} {told} in brightness, and colour adds nothing")
    if seen["colour"] >= COLOUR_ALONE_SHARE:
        return KeyChoice("colour", f"colour: {colour} {told} in colour alone ({brightness} in brightness), "
                                "and light and shadow change colour least")
    return KeyChoice("both", f"both: {both} {told} in brightness and colour together, {brightness} in brightness alone, "
                          f"{colour} in colour alone")


def wardrobe_share(rule: ChannelClassifier) -> float:
    """Share of pairs (colour of `WARDROBE`, pixel of the background) in which the one differs clearly from the other."""
    step = max(1, min(rule.mean.shape[:2]) // 40)
    mean, inverse_sigma = (np.ascontiguousarray(a[::step, ::step]).reshape(1, -1, 3) for a in (rule.mean, rule.inverse_sigma))
    sparse = replace(rule, mean=mean, inverse_sigma=inverse_sigma, factor=CLEAR_FACTOR * CERTAIN_FACTOR * rule.factor)
    colours = to_planes(np.array([WARDROBE], np.uint8)[..., ::-1].copy())[0]
    worn = (np.ascontiguousarray(np.broadcast_to(colour, mean.shape)) for colour in colours)
    return float(np.mean([(sparse.labels(planes) > 0).mean() for planes in worn]))
