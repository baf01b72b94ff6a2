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
    """Times of each, by name: every round calls all, one after another.

    Each call that is timed follows one that is not, so that none pays for what the one before it left in the caches.
    """
    spent: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, (run, units) in contenders.items():
            run()
            start = time.perf_counter()
            run()
            spent[name].append((time.perf_counter() - start) / units)
    return {name: Times(float(np.median(took)), float(min(took)), rounds) for name, took in spent.items()}
