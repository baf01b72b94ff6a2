"""Times of things that are to be compared: measured in turns, so that a busy machine slows all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np


class Times(NamedTuple):
    """How long one thing took, seconds a unit (a particle, a frame)."""

    median: float
    least: float
    rounds: int


class Contender(NamedTuple):
    """Something to be timed."""

    run: Callable[[], object]
    units: float = 1
    """Units that one call works off."""


def in_turns(contenders: Mapping[str, Contender], rounds: int) -> dict[str, Times]:
    """Times of each, by name: every round calls all, one after another; a first round, which may compile, does not count."""
    spent: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(rounds + 1):
        for name, (run, units) in contenders.items():
            start = time.perf_counter()
            run()
            if turn:
                spent[name].append((time.perf_counter() - start) / units)
    return {name: Times(float(np.median(took)), float(min(took)), rounds) for name, took in spent.items()}
