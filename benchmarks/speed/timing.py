"""Times of several functions, measured in turns, so that a busy machine slows all equally."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np


class Times(NamedTuple):
    """Seconds a unit (a particle, a frame) of one contender."""

    median: float
    least: float
    rounds: int


class Contender(NamedTuple):
    """A function to be timed."""

    run: Callable[[], object]
    units: float = 1
    """Units of work in one call."""


def in_turns(contenders: Mapping[str, Contender], rounds: int) -> dict[str, Times]:
    """Times by name. Every round calls all contenders, one after another; each timed call follows an untimed one, so that none
    depends on the caches' content after the one before it."""
    spent: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, (run, units) in contenders.items():
            run()
            start = time.perf_counter()
            run()
            spent[name].append((time.perf_counter() - start) / units)
    return {name: Times(float(np.median(seconds)), float(min(seconds)), rounds) for name, seconds in spent.items()}


class Figures(NamedTuple):
    """Figures to compute from the times of contenders, by key."""

    times: Mapping[str, tuple[float, str]]
    """Units in a second (1e3 for ms) and contender: median time."""
    rates: Mapping[str, str]
    """Contender: units a second, by the median."""
    ratios: Mapping[str, tuple[str, str]]
    """Two contenders: the first's time over the second's, by the least times, which other work on the machine hardly changes."""

    def of(self, raw: Mapping[str, Times]) -> dict[str, float]:
        """The figures."""
        return {key: scale * raw[name].median for key, (scale, name) in self.times.items()} | {
            key: 1 / raw[name].median for key, name in self.rates.items()} | {
            key: raw[slow].least / raw[fast].least for key, (slow, fast) in self.ratios.items()}  # fmt: skip
