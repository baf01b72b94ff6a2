"""What a check of a calibration concludes from made figures: sets compared, certain offsets, [start], sentences."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.calibration.agreement import MAX_DISAGREEMENT
from shadowpuppet.calibration.silhouettes import ALIGNED, aligned_sets
from shadowpuppet.calibration.time_offset import TimeOffsets, certain_offsets
from shadowpuppet.pipeline.repair import check as judging
from shadowpuppet.pipeline.repair.check import (
    RotationFix,
    _directions,
    _in_frames,
    _standing_out,
    _starts,
    doubts_of,
)

NAMES = ("a", "b", "c", "d")


def offsets(frames, spread=(0.1,) * 4) -> TimeOffsets:
    return TimeOffsets(names=NAMES, frames=frames, spread=spread, pairs=((None, 0.5, 0.25, 0.0),) * 4)


@pytest.mark.parametrize("shifts", [(0, 0, 0, 0), (3.4, 0, 0, 0), (0, -2.0, 5.6, 0)])
def test_sets_are_spread_over_all_that_every_camera_has(shifts):
    rows = [[(frame, camera) for camera in range(4)] for frame in range(40)]
    found = aligned_sets(rows, shifts)
    steps = [round(shift) for shift in shifts]
    begins = [row[3][0] for row in found]
    assert begins[0] == -min(steps)
    assert begins[-1] == 39 - max(steps)
    assert len(found) == ALIGNED
    assert np.ptp(np.diff(begins)) <= 1
    assert all(row == [(begin + step, camera) for camera, step in enumerate(steps)] for row, begin in zip(found, begins))


def test_of_too_few_sets_what_is_missing_is_nothing():
    assert aligned_sets([["a0", "b0"], ["a1", "b1"]], [0, 3]) == [["a0", None]]
    assert aligned_sets([["a0", "b0"], ["a1", "b1"]], [0, 0]) == [["a0", "b0"], ["a1", "b1"]]


def test_an_offset_is_certain_beyond_its_limits():
    assert certain_offsets(offsets((0.51, 0.51, -0.51, 0.5)), ("b",)) == [0.51, 0.0, -0.51, 0.0]
    assert certain_offsets(offsets((1.6, 1.6, None, -1.4), (1.0, 1.0, None, 1.0)), ("b",)) == [1.6, 1.6, 0.0, 0.0]
    assert certain_offsets(offsets((0.6, 1.5, 0.6, 0.6), (None, 0.0, 0.39, 0.41)), ("b",)) == [0.6, 0.0, 0.6, 0.0]


def test_offsets_of_sets_are_those_of_frames():
    found = _in_frames(offsets((1.234, None, -0.5, 0.0)), 3)
    assert found.frames == (3.7, None, -1.5, 0.0)
    assert found.spread == (0.3,) * 4
    assert found.pairs[1] == (None, 1.5, 0.75, 0.0)


def test_starts_are_those_there_are_and_the_offsets_from_the_earliest():
    footage = [SimpleNamespace(camera=SimpleNamespace(name=name), view=SimpleNamespace(start=start))
               for name, start in zip(NAMES, (0.0, 0.5, 0.0, 1.0))]
    rig = SimpleNamespace(footage=footage, rate=25.0)
    assert _starts(rig, [0.0, 0.0, 0.0, 0.0], 2) == {}
    assert _starts(rig, [0.0, 1.0, -2.0, 0.0], 2) == {"a": 0.16, "b": 0.74, "d": 1.16}


def agreement(apart, **more):
    return SimpleNamespace(**({"names": NAMES, "apart": apart, "limit": 20.0, "wrong": (), "hopeless": False, "remedy": None,
                               "doubts": lambda: []} | more))  # fmt: skip


def test_the_worst_camera_stands_out():
    slight = 0.004 / MAX_DISAGREEMENT * 20
    assert _standing_out(agreement((0.1, slight - 0.01, 0.1, 0.1)), 3) == ()
    assert _standing_out(agreement((0.1, slight + 0.01, 0.1, 0.1)), 3) == ("b",)
    assert _standing_out(agreement((10, 10, 10, 29.9)), 3) == ()
    assert _standing_out(agreement((10, 10, 10, 30.1)), 3) == ("d",)
    assert _standing_out(agreement((10, 10, None, 30.1)), 3) == ("d",)
    assert _standing_out(agreement((0.1, None, None, 30.1)), 1) == ()
    assert _standing_out(agreement((None,) * 4), 3) == ()


def turn(**angles):
    plain = {"right": 0.0, "down": 0.0, "clockwise": 0.0, "degrees": 3.0, "distance": 0.0, "spread": (0.2, 0.2, 0.2)}
    return SimpleNamespace(**(plain | angles))


def test_directions():
    assert _directions(turn(right=2.04, down=-1.0, clockwise=0.3)) == "2.0 ± 0.2 to the right, 1.0 ± 0.2 up, 0.3 ± 0.2 clockwise"
    wide = turn(right=-2.0, down=1.0, clockwise=-3.0, spread=(0.5, 0.4, 3.2))
    assert _directions(wide) == "2.0 ± 0.5 to the left, 1.0 ± 0.4 down"  # about the axis it may be none
    assert _directions(turn(right=-2.0, down=1.0, clockwise=-3.0)).endswith("3.0 ± 0.2 counter-clockwise")
    assert _directions(turn(right=0.1)) == "no direction for certain"
    assert _directions(turn(right=0.04, spread=(0.0, 0.0, 0.0))) == "no direction for certain"


def check(**changes):
    plain = {"agreement": agreement((1.0, 2.0, 1.5, 1.0)), "late": (), "lateness": None, "starts": {}, "turns": {}}
    return SimpleNamespace(**(plain | changes))


def test_doubts():
    assert doubts_of(check()) == []
    late = {"late": ("b", "c"), "lateness": offsets((0.0, 2.25, -3.0, 0.4)), "starts": {"a": 0.12, "b": 0.123456}}
    said = ("the films do not begin together (b 2.2 frames late, c 3.0 frames early): put into [start] of recording.toml: "
            "a = 0.12, b = 0.1235")
    assert doubts_of(check(**late)) == [said]
    assert doubts_of(check(**late, agreement=agreement((None,) * 4, hopeless=True, remedy="swap them"))) == [said, "swap them"]
    fix = RotationFix(turn(right=3.0), 1.25)
    doubts = ["camera 'b' disagrees much", "camera 'c' disagrees much"]
    found = doubts_of(check(turns={"b": fix}, agreement=agreement((1.0, 9.0, 1.5, None), doubts=lambda: doubts)))
    assert found == ["camera 'c' disagrees much",
                     "camera 'b' disagrees with the others by 9.0 pixels, they by 1.5 at most; it is as if it had been turned by 3.0 "
                     "degrees (3.0 ± 0.2 to the right) since it was calibrated: turned back, 1.2 pixels would be left; calibrate it again, "
                     "or leave it out: --camera a,c,d"]  # fmt: skip
    pushed = RotationFix(turn(right=3.0, distance=0.052), 0.4)
    (sentence,) = doubts_of(check(turns={"b": pushed}, agreement=agreement((1.0, 9.0, 1.5, None))))
    assert "turned by 3.0 degrees (3.0 ± 0.2 to the right) and moved by 5 cm since it was calibrated: put back, 0.4 pixels" in sentence
    assert doubts_of(check(agreement=agreement((1.0, 9.0, 1.5, 1.0)))) == [
        "camera 'b' disagrees with the others by 9.0 pixels, they by 1.5 at most; calibrate it again, or leave it out: --camera a,c,d"]
    assert doubts_of(check(agreement=agreement((1.0, 9.0, 1.5, 1.0), doubts=lambda: ["a word"]))) == ["a word"]


@pytest.mark.parametrize(("before", "after", "stated"), [
    ((466.0, 470, 480, 466), (464.0, 468, 478, 464), False),  # most cameras fit no better: noise
    ((9.0, 9, 20, 9), (1.0, 1, 1.2, 1), True), ((0.3, 0.2, 0.4, 0.2), (0.3, 0.25, 0.4, 0.2), True),  # a slow person hides a delay
    ((0.3, 0.2, 0.4, 0.2), (0.9, 0.9, 0.9, 0.9), False), ((9.0, 9, 60, 9), (1.0, 1, 60, 1), True),  # one camera is misplaced besides
])
def test_a_delay_is_stated_only_where_the_films_fit_with_it(monkeypatch, before, after, stated):
    results = iter([agreement(before), agreement(after)])
    monkeypatch.setattr(judging, "compare_cameras", lambda *_, **__: next(results))
    monkeypatch.setattr(judging, "time_offsets", lambda *_: offsets((0.0, 0.0, 5.0, 0.0)))
    monkeypatch.setattr(judging, "_rotations", lambda *_: {})
    monkeypatch.setattr(judging, "_pushed", lambda *_: {})
    rows = [[None] * 4] * 40
    rig = SimpleNamespace(cameras=[SimpleNamespace(name=name) for name in NAMES])
    assert judging._judged(rig, rows).shifts == ([0.0, 0.0, 5.0, 0.0] if stated else [0.0] * 4)
