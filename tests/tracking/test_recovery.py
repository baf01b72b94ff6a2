"""The policy of both trackers: hold, track, search, and keep the better of the two."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from shadowpuppet.tracking.recovery import OVERLAP_DROP, SETTLE_CYCLES, settle, track_or_recover
from shadowpuppet.tracking.status import status_of


class Made(NamedTuple):
    agreement: float
    status: str
    by: str = "before"


def made(overlap: float, by: str) -> Made:
    return Made(overlap, status_of(overlap), by)


def after(state: Made, cycled: float, found: float, **chosen) -> tuple[str, list[str]]:
    """What the state after a frame is made by, and what was called."""
    called = []

    def by(name: str, overlap: float) -> Made:
        called.append(name)
        return made(overlap, name)

    chosen = {"is_absent": False, "recover": True} | chosen
    result = track_or_recover(state, hold=lambda state: state._replace(status="absent", by="hold"), cycle=lambda _: by("cycle", cycled),
                              search=lambda: by("search", found), **chosen)
    return result.by, called


@pytest.mark.parametrize(("before", "cycled", "found", "chosen", "by", "called"), [
    (made(0.9, ""), 0.8, 0.9, {}, "cycle", ["cycle"]),  # tracked
    (made(0.9, ""), 0.8, 0.9, {"is_absent": True}, "hold", []),
    (Made(0.0, "absent"), 0.8, 0.9, {}, "search", ["search"]),  # comes back
    (Made(0.0, "absent"), 0.8, 0.9, {"recover": False}, "cycle", ["cycle"]),
    (made(0.9, ""), 0.4, 0.8, {}, "search", ["cycle", "search"]),  # lost, and found
    (made(0.9, ""), 0.4, 0.3, {}, "cycle", ["cycle", "search"]),  # lost, and what is found is worse
    (made(0.9, ""), 0.4, 0.8, {"recover": False}, "cycle", ["cycle"]),
    (made(0.9, ""), 0.6, 0.8, {}, "cycle", ["cycle"]),  # a drop, which one camera does not mind
    (made(0.9, ""), 0.6, 0.8, {"drop": OVERLAP_DROP}, "search", ["cycle", "search"]),
    (made(0.75, ""), 0.6, 0.8, {"drop": OVERLAP_DROP}, "cycle", ["cycle"]),
])  # fmt: skip
def test_what_follows_a_frame(before, cycled, found, chosen, by, called):
    assert after(before, cycled, found, **chosen) == (by, called)


def test_a_search_is_settled_by_cycles():
    assert settle(made(0.0, ""), lambda state: state._replace(agreement=state.agreement + 1)).agreement == SETTLE_CYCLES
