"""Policy for searching for the person again, the same for one camera and for several."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

SETTLE_CYCLES = 10
"""Number of estimation cycles on the same frame after a search."""
OVERLAP_DROP = 0.2
"""With several cameras, a fall of the agreement by more than this in a frame starts a search: wrong poses may agree too much for `lost`."""


class TrackerState(Protocol):
    """The fields of a tracker's state that the policy uses."""

    @property
    def agreement(self) -> float:
        """How well the estimate agrees with what is seen, from 0 to 1: overlap with the silhouettes, or the keypoints' `support`."""
        ...

    @property
    def status(self) -> str:
        """`tracked`, `uncertain`, `lost` or `absent`."""
        ...


State = TypeVar("State", bound=TrackerState)


def track_or_recover(state: State, *, is_absent: bool, hold: Callable[[State], State], cycle: Callable[[State], State],
                     search: Callable[[], State], recover: bool, drop: float = np.inf) -> State:
    """The state after a frame. If the person is absent, the pose is held.

    With `recover`, a search replaces tracking for a person who was absent; after a loss, or when the agreement falls by more than `drop`,
    the better of the two counts.
    """
    if is_absent:
        return hold(state)
    if state.status == "absent" and recover:
        return search()
    tracked = cycle(state)
    if not recover or not (tracked.status == "lost" or tracked.agreement < state.agreement - drop):
        return tracked
    found = search()
    return found if found.agreement > tracked.agreement else tracked


def settle(state: State, cycle: Callable[[State], State]) -> State:
    """The state after `SETTLE_CYCLES` further cycles on the frame of a search."""
    for _ in range(SETTLE_CYCLES):
        state = cycle(state)
    return state
