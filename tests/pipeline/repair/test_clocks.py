"""Films with timecode or sound are put in step by these where silhouettes cannot tell, and never against them."""

from __future__ import annotations

from functools import cache

import made_rig
import noises
import numpy as np
import pytest
from timecodes import add_timecode

from shadowpuppet.errors import RecordingError
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.repair.clocks import clock_offsets, in_step
from shadowpuppet.pipeline.repair.films import check_films
from shadowpuppet.pipeline.repair.fix import fix_recording
from shadowpuppet.pipeline.rig import open_rig

pytestmark = pytest.mark.usefixtures("scale_unfitted")
MASKS = Options(masks=True)
RATE = 16000
LATE = (0, 8, 0, -3)
"""Frames by which each film is late."""
SECONDS = 6.0


@cache
def seen(n):
    """Silhouettes of frame `n`."""
    return made_rig.masks(made_rig.cameras(), 1, n)[0]


def films(folder, frames_of, late):
    """A recording of 60 frames; camera k shows frame `frames_of(n, k)` as its n-th, and is heard `late[k]` frames late; silent if None."""
    cameras = made_rig.cameras()
    count = round(SECONDS * made_rig.RATE)
    path = made_rig.write(folder, cameras, [[seen(frames_of(n, k))[k] for k in range(len(cameras))] for n in range(count)])
    if late is None:
        return path
    rng = np.random.default_rng(3)
    room = noises.events(rng, SECONDS + 3, RATE)
    for camera, each in zip(cameras, late):
        heard = noises.heard(rng, room, RATE, each / made_rig.RATE, way=3.0)
        noises.add_sound(path / "video" / f"{camera.name}.mp4", heard[: round(SECONDS * RATE)], RATE)
    return path


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """Films of a person who does not move; two of them are late."""
    return films(tmp_path_factory.mktemp("sound") / "still", lambda n, k: 12, LATE)


def test_a_still_person_s_films_are_put_in_step_by_what_is_heard(still):
    rig = open_rig(still, MASKS)
    checked = check_films(rig, MASKS)
    found = checked.check
    assert found.by_clock
    assert found.late == ("cam2", "cam4")
    assert found.lateness.frames == pytest.approx(LATE, abs=0.25)
    assert found.starts == pytest.approx({"cam1": 0.3, "cam2": 1.1, "cam3": 0.3}, abs=0.03)
    assert any("the films do not begin together (cam2 8.0 frames late, cam4 3.0 frames early)" in doubt for doubt in found.doubts)
    fix = fix_recording(rig, checked)
    assert fix.done
    assert read_toml(still / "recording.toml", RecordingError)["start"] == found.starts
    again = check_films(open_rig(still, MASKS), MASKS).check  # in step now
    assert (again.by_clock, again.late, again.good) == (False, (), True)


@pytest.mark.whole
def test_sound_that_lags_behind_its_pictures_is_doubted_and_changes_nothing(tmp_path):
    path = films(tmp_path / "lag", lambda n, k: n + 12, LATE)  # the pictures are in step
    rig = open_rig(path, MASKS)
    checked = check_films(rig, MASKS)
    found = checked.check
    assert (found.by_clock, found.late, found.starts) == (False, (), {})
    assert found.clock.seconds == pytest.approx([each / made_rig.RATE for each in LATE], abs=0.025)
    assert found.doubts[-1].startswith("sound and silhouettes disagree about the films' delays")
    assert fix_recording(rig, checked).done == ()


def test_sound_and_silhouettes_that_agree_are_both_stated(tmp_path):
    path = films(tmp_path / "both", lambda n, k: n + 12 - LATE[k], LATE)
    found = check_films(open_rig(path, MASKS), MASKS).check
    assert found.lateness.frames == pytest.approx(LATE, abs=0.4)
    assert found.late == ("cam2", "cam4")
    assert not any("sound and silhouettes" in doubt for doubt in found.doubts)


@pytest.mark.whole
def test_films_that_are_far_from_in_step_are_found_by_sound_first(tmp_path):
    late, heard = (0, 32, 0, 0), (0, 30, 0, 0)  # more than silhouettes are searched for; of what is left they know better
    path = films(tmp_path / "far", lambda n, k: n + 32 - late[k], heard)
    found = check_films(open_rig(path, MASKS), MASKS).check
    assert (found.by_clock, found.late) == (True, ("cam2",))
    assert found.lateness.frames == pytest.approx(late, abs=0.5)
    assert found.starts == pytest.approx({"cam2": 3.2}, abs=0.05)


def test_films_without_sound_and_with_a_rate_of_their_own_are_not_listened_to(tmp_path, still):
    rig = open_rig(made_rig.write(tmp_path / "silent"), MASKS)
    assert clock_offsets(rig) is None
    (still / "recording.toml").write_text("rate = 5.0\n")
    assert clock_offsets(open_rig(still, MASKS)) is None
    (still / "recording.toml").unlink()


@pytest.mark.parametrize(("shown", "stated"), [(0, True), (1, False)])
def test_timecodes_come_before_sound_and_not_before_silhouettes(tmp_path, shown, stated):
    """Of a person who keeps still they count; of one who walks only if the pictures are late, too."""
    path = films(tmp_path / "coded", lambda n, k: shown * n + 12, (0, 0, 0, 0))
    for n, late in enumerate(LATE):
        at = 50 - late  # frames after ten o'clock at which the film begins: one that began earlier shows all later
        add_timecode(path / "video" / f"cam{n + 1}.mp4", f"10:00:{at // 10:02}:{at % 10:02}")
    found = check_films(open_rig(path, MASKS), MASKS).check
    assert found.clock.by == "timecode"
    assert found.clock.seconds == pytest.approx([each / made_rig.RATE for each in LATE])
    assert found.by_clock == stated
    assert found.late == (("cam2", "cam4") if stated else ())
    assert any("timecodes and silhouettes disagree" in doubt for doubt in found.doubts) != stated


def test_no_start_becomes_negative(still):
    rig = open_rig(still, MASKS)
    moved = in_step(rig, clock_offsets(rig).seconds)
    starts = [footage.view.start for footage in moved.footage]
    assert min(starts) == 0
    assert [view.start for view in moved.recording.views] == starts
    assert np.diff(starts) == pytest.approx(np.diff(LATE) / made_rig.RATE, abs=0.03)
