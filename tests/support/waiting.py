"""Waiting for what other threads and processes bring about: as long as a loaded machine needs."""

from __future__ import annotations

import time
from collections.abc import Callable

LONG = 600.0
"""Seconds after which something never comes."""


def until(true: Callable[[], bool]) -> None:
    """Wait until it is true."""
    end = time.monotonic() + LONG
    while not true():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.005)
