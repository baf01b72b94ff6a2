"""Which frames a report shows, which pictures of them, and what of these."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured import TRUTH, run_that_errs, write_run

from shadowpuppet.camera.camera import Camera
from shadowpuppet.evaluation.evaluation import measure_run
from shadowpuppet.evaluation.report.pictures import (
    MAX_LOST,
    MAX_WIDTH,
    MIN_HEIGHT,
    WORST,
    _box,
    _jpeg,
    _mean_errors,
    _nearest_images,
    _pixels,
    _scaled,
    _typical_frames,
    _worst_frames,
    report_frames,
)
from shadowpuppet.geometry import rigid
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.video.frames import Frame


@settings(max_examples=40)
@given(seed=st.integers(0, 1000), seconds=st.sampled_from([2.0, 8.0, 90.0]))
def test_the_worst_frames_are_taken_one_after_another(seed, seconds):
    rng = np.random.default_rng(seed)
    times, badness, blank = np.sort(rng.uniform(0, seconds, 80)), rng.uniform(size=80).round(1), rng.uniform(size=80) < 0.2
    badness[rng.uniform(size=80) < 0.1] = np.nan
    length = times[-1] - times[0]
    apart = {2.0: length / 12, 8.0: 0.5, 90.0: length / 60}[seconds]
    found = []
    for n in sorted(np.flatnonzero(~np.isnan(badness)), key=lambda n: (-badness[n], n)):
        too_many = blank[n] and sum(blank[m] for m in found) == MAX_LOST
        if len(found) < WORST and all(abs(times[n] - times[m]) >= apart for m in found) and not too_many:
            found.append(n)
    assert _worst_frames(badness, times, blank) == sorted(found)


def test_typical_frames_are_nearest_to_the_median_of_all_in_each_half():
    badness = np.r_[np.arange(20.0), np.arange(40.0, 60)]
    blank = np.zeros(40, bool)
    assert _typical_frames(badness, badness, blank) == [19, 20]  # the median is 29.5
    blank[20], badness[19] = True, np.nan  # 0 to 18 and 41 to 59
    assert _typical_frames(badness, badness, blank) == [18, 21]
    blank[0] = blank[1] = blank[2] = blank[3] = blank[4] = blank[5] = True
    assert len(_typical_frames(badness, badness, blank)) == 2
    blank[6] = True  # 31 are too few to call any typical
    assert _typical_frames(badness, badness, blank) == []


def test_the_mean_is_over_the_joints_with_a_truth():
    known = np.array([[True, True, False], [False, False, False]])
    np.testing.assert_array_equal(_mean_errors(np.array([[1.0, 2, np.nan], [1, 1, 1]]), known), [1.5, np.nan])


@pytest.mark.parametrize("frames", [[0], [2, 3, 7], [9], [0, 9]])
@pytest.mark.parametrize("shift", [-0.04, 0.0, 0.03])
def test_images_are_the_nearest_in_time(frames, shift):
    """Images at 25 frames/s, of a run at 10."""
    times, film = np.arange(10) / 10 + shift, np.arange(30) / 25
    shots = [Frame(time, np.full((1, 1, 3), n, np.uint8)) for n, time in enumerate(film)]
    found = {n: int(image[0, 0, 0]) for n, image in _nearest_images(iter(shots), times, frames)}
    assert set(found) == set(frames)
    for n, shot in found.items():
        assert abs(film[shot] - times[n]) == pytest.approx(np.abs(film - times[n]).min())


def test_after_the_film_s_end_one_frame_more_has_an_image():
    shots = [Frame(n / 10, np.full((1, 1, 3), n, np.uint8)) for n in range(5)]
    times = np.arange(10) / 10
    assert [(n, int(image[0, 0, 0])) for n, image in _nearest_images(iter(shots), times, [4, 5, 6])] == [(4, 4), (5, 4)]
    assert list(_nearest_images(iter([]), times, [0])) == []


def test_joints_are_found_in_pictures_of_any_size():
    camera = Camera("cam", (160, 120), [[140, 0, 79.5], [0, 140, 59.5], [0, 0, 1]])
    table = JointTable(np.zeros(1), ("a", "b"), np.array([[[0.0, 0, 2], [0.5, -0.25, 2]]]))
    np.testing.assert_allclose(_pixels(np.zeros((120, 160, 3)), camera, table), [[79.5, 59.5], [114.5, 42]])
    twice = _pixels(np.zeros((240, 320, 3)), camera, table)
    np.testing.assert_allclose(twice, 2 * np.array([[79.5, 59.5], [114.5, 42]]) + 0.5)  # pixels' middles
    np.testing.assert_allclose(_pixels(np.zeros((250, 320, 3)), camera, table), twice)  # of a grid with room left


def box(places, size=(160, 120)) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of what is cut out around places (pixels)."""
    camera = Camera("cam", (160, 120), [[1, 0, 0], [0, 1, 0], [0, 0, 1]], T_camera_world=rigid(np.eye(3), [0, 0, 1.0]))
    table = JointTable(np.zeros(1), tuple("abcdefg"[: len(places)]), np.array([[(*place, 0.0) for place in places]]))
    found = _box(np.zeros((size[1], size[0], 3)), camera, [table])
    assert found is not None
    rows, columns = found
    return columns.start, rows.start, columns.stop, rows.stop


def test_the_person_is_cut_out_three_by_four():
    assert box([(70, 40), (90, 40), (80, 80)]) == (61, 34, 99, 86)  # 40 high, with 14 % more above and below
    assert box([(50, 60), (110, 60), (80, 80)]) == (44, 22, 116, 118)  # wide: 48 to each side of the middle by three quarters
    assert box([(80, 60), (81, 60), (80, 61)]) == (70, 46, 91, 75)  # never less than a quarter of the height
    assert box([(0, 0), (10, 0), (5, 30)]) == (0, 0, 29, 38)  # at the border
    assert box([(150, 110), (159, 119), (155, 90)]) == (132, 83, 160, 120)
    assert box([(0, 0), (159, 119), (80, 60)]) == (34, 0, 124, 120)  # at most the picture's height
    camera = Camera("cam", (160, 120), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert _box(np.zeros((120, 160, 3)), camera, [JointTable(np.zeros(1), ("a", "b"), np.ones((1, 2, 3)))]) is None


def test_pictures_are_scaled_and_limited():
    image = np.random.default_rng(0).integers(0, 255, (100, 300, 3), dtype=np.uint8)
    assert _scaled(image, height=100) is image
    assert _scaled(image, height=50).shape == (50, 150, 3)
    assert _scaled(image, width=600).shape == (200, 600, 3)
    assert _scaled(image, width=2).shape == (1, 2, 3)
    import cv2

    for width in (MAX_WIDTH, MAX_WIDTH + 100):
        data = _jpeg(np.zeros((MIN_HEIGHT, width, 3), np.uint8))
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape[1] == MAX_WIDTH


def test_frames_name_their_worst_joints(tmp_path):
    of = measure_run(run_that_errs(tmp_path))
    for each in report_frames(of):
        assert each.time == pytest.approx(each.frame / 15, abs=1e-5)
        errors = {name: 1000 * of.errors.distance[each.frame, j] for j, name in enumerate(of.errors.names)}
        assert each.error == pytest.approx(np.mean(list(errors.values())))
        assert list(each.worst) == [(name, pytest.approx(errors[name])) for name in sorted(errors, key=lambda name: -errors[name])[:3]]


def test_a_joint_without_a_place_is_off_by_what_counts_for_it(tmp_path):
    table = JointTable(TRUTH.times, TRUTH.names, TRUTH.positions.copy())
    table.positions[7, TRUTH.names.index("left_elbow")] = np.nan
    write_joints(tmp_path / "truth.csv", TRUTH)
    of = measure_run(write_run(tmp_path / "run", table, truth=tmp_path / "truth.csv", status=["tracked"] * len(TRUTH.times)))
    (worst,) = [each for each in report_frames(of) if each.frame == 7]
    assert worst.worst[0] == ("left_elbow", 500)
