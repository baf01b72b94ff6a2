"""Keypoints of whole films: what a frame shows, their own format to the last bit, a script's lines, and files that are neither."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.camera.keypoints import LANDMARKS, Keypoints
from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning, TrackingError
from shadowpuppet.io.files.npz import archive_bytes
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, read_npz, write_keypoints
from shadowpuppet.io.keypoints.names import landmark_of
from shadowpuppet.io.keypoints.script_output import read_jsonl

SIZE = (640, 480)
NAMES = ("nose", "left_wrist")
GOOD = {"names": np.array(NAMES), "frame": [0, 2], "person": [-1, 0], "xy": np.full((2, 2, 2), 5.0), "confidence": np.full((2, 2), 0.5),
        "detector": "made", "size": SIZE}  # fmt: skip
HEADER = {"names": list(NAMES), "detector": "made", "origin": 0.5}


def film(**changes):
    values = {key: value for key, value in GOOD.items() if key != "names"} | {"names": NAMES} | changes
    return film_keypoints(**values)


def lines(path, *rows):
    path.write_text("".join(f"{row if isinstance(row, str) else json.dumps(row)}\n" for row in rows))
    return path


def test_a_frame_holds_its_persons_and_a_frame_without_any_none():
    made = film(frame=[7, 2, 7], person=[1, -1, 0], xy=np.arange(12.0).reshape(3, 2, 2), confidence=np.ones((3, 2)))
    assert [made.at(frame).person.tolist() for frame in (0, 2, 7)] == [[], [-1], [1, 0]]
    assert made.at(7).xy.tolist() == [[[0, 1], [2, 3]], [[8, 9], [10, 11]]]
    assert made.at(0).xy.shape == (0, 2, 2)
    assert (made.persons == [1, 2]).all()


def test_persons_of_a_frame_keep_their_order():
    made = film(frame=np.tile([1, 0], 40), person=np.arange(80), xy=np.full((80, 2, 2), 5), confidence=np.ones((80, 2)))
    assert made.person.tolist() == [*range(1, 80, 2), *range(0, 80, 2)]


def test_points_outside_the_picture_or_without_confidence_and_persons_without_points_are_left_out():
    xy = np.array([[[-0.4, 479.4], [-0.6, 0]], [[640, 0], [np.nan, 3]], [[5, 5], [6, 6]]])
    made = film(frame=[0, 1, 2], person=[0, 1, 2], xy=xy, confidence=[[0.5, 0.5], [1, 1], [0, np.nan]])
    assert made.frame.tolist() == [0]
    np.testing.assert_array_equal(made.at(0).xy[0], np.array([[-0.4, 479.4], [np.nan, np.nan]], np.float32))
    assert made.at(0).confidence.tolist() == [[0.5, 0]]


@pytest.mark.parametrize(("changes", "words"), [
    ({"names": ("nose", "nose")}, "names: found nose, nose"), ({"names": ("nose", "tail")}, "names: found nose, tail"),
    ({"names": ()}, "names: found "), ({"frame": [0, -1]}, "frame: found -1 to 0"), ({"frame": [0, 10**9]}, "frame: found 0 to 1000000000"),
    ({"person": [0, -2]}, "person: found -2"), ({"confidence": np.full((2, 2), 1.5)}, "confidence: found 0 to 1.5, expected 0 to 1"),
    ({"confidence": np.full((2, 2), -0.5)}, "confidence: found -0.5 to 0"), ({"xy": np.zeros((2, 3, 2))}, "xy: found shape (2, 3, 2)"),
])  # fmt: skip
def test_what_cannot_be_keypoints_is_refused(changes, words):
    with pytest.raises(ShadowPuppetError) as error:
        film(**changes)
    assert str(error.value).startswith(words)


def test_keypoints_of_a_frame_have_the_shapes_of_their_persons():
    with pytest.raises(TrackingError, match=r"expected \(0, 1, 2\) and \(0, 1\), persons and landmarks"):
        Keypoints(("nose",), np.zeros((1, 1, 2)), np.zeros((0, 1)), np.zeros(0, np.int64), "made")


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(names=st.lists(st.sampled_from(LANDMARKS), min_size=1, unique=True), frames=st.lists(st.integers(0, 10**9 - 1), max_size=6),
       seed=st.integers(0, 2**32 - 1), size=st.tuples(st.integers(1, 9000), st.integers(1, 9000)),
       detector=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9))
def test_a_written_film_is_read_to_the_last_bit(tmp_path, names, frames, seed, size, detector):
    rng, shape = np.random.default_rng(seed), (len(frames), len(names))
    xy, confidence = rng.uniform(-0.2, 1.1, (*shape, 2)) * size, rng.choice([0, 1, np.nan, 0.25, rng.random()], shape)
    made = film_keypoints(names, frames, rng.integers(-1, 3, len(frames)), xy, confidence, detector, size)
    write_keypoints(tmp_path / "a.npz", made)
    read = read_npz(tmp_path / "a.npz", size)
    assert (read.names, read.detector, read.size) == (made.names, made.detector, made.size)
    for name in ("frame", "person", "xy", "confidence"):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name))
        assert getattr(read, name).dtype == getattr(made, name).dtype
    assert sum(len(read.at(frame).person) for frame in set(frames)) == len(read.frame)


@pytest.mark.parametrize(("changes", "words"), [
    ({"frame": None}, "frame: found no such array, expected whole numbers of 1 dimensions"),
    ({"frame": np.zeros(2)}, "frame: found float64 of shape (2,), expected whole numbers"),
    ({"names": np.array([1, 2])}, "names: found int64 of shape (2,), expected text"),
    ({"xy": np.zeros((2, 2))}, "xy: found float64 of shape (2, 2), expected numbers of 3 dimensions"),
    ({"origin": 0.5}, "arrays: found origin, expected only names,"), ({"size": [640, 480, 3]}, "size: found [640, 480, 3]"),
    ({"size": [320, 240]}, "size: found keypoints in pictures of 320 x 240 pixels, expected the film's 640 x 480"),
    ({"person": np.array([None, None])}, "found Python objects in an array, which are never read"),
])  # fmt: skip
def test_an_archive_that_is_no_keypoints_is_refused_by_file_and_array(tmp_path, changes, words):
    path, arrays = tmp_path / "a.npz", {key: value for key, value in (GOOD | changes).items() if value is not None}
    if "person" in changes:
        np.savez(path, allow_pickle=True, **arrays)
    else:
        path.write_bytes(archive_bytes(**arrays))
    with pytest.raises(FormatError) as error:
        read_npz(path, SIZE)
    assert str(error.value).startswith(f"{path}: {words}")


def test_a_film_with_the_padding_of_its_codec_has_the_keypoints_of_the_one_without(tmp_path):
    write_keypoints(tmp_path / "a.npz", film(size=(1920, 1080)))
    assert read_npz(tmp_path / "a.npz", (1920, 1088)).size == (1920, 1088)


def test_a_script_says_its_origin_and_a_missing_point_is_null(tmp_path):
    path = lines(tmp_path / "a.jsonl", HEADER, {"people": []}, {"people": [
        {"id": 3, "points": [[10.5, 20.25, 0.75], None]}, {"points": [None, [3, 4, 1]]}]})  # fmt: skip
    seen = read_jsonl(path, SIZE).at(1)
    assert (seen.names, seen.detector, seen.person.tolist()) == (NAMES, "made", [3, -1])
    np.testing.assert_array_equal(seen.xy, [[[10, 19.75], [np.nan, np.nan]], [[np.nan, np.nan], [2.5, 3.5]]])
    assert seen.confidence.tolist() == [[0.75, 0], [0, 1]]


def test_a_scripts_landmarks_that_are_not_known_are_named(tmp_path):
    path = lines(tmp_path / "a.jsonl", HEADER | {"names": ["LWrist", "tail"]}, {"people": [{"points": [[10.5, 20.5, 1], [3, 4, 1]]}]})
    with pytest.warns(ShadowPuppetWarning, match="landmarks that are not known are left out: tail"):
        assert read_jsonl(path, SIZE).names == ("left_wrist",)


@pytest.mark.parametrize(("rows", "words"), [
    (["[]"], "found a list of 0, expected a line {"), (["{"], "found no JSON"), ([HEADER | {"nmaes": 1}], "found the key 'nmaes'"),
    ([HEADER | {"origin": 0.3}], "origin: found 0.3, expected"), ([HEADER | {"origin": True}], "origin: found True, expected"),
    ([HEADER | {"detector": 3}], "detector: found 3"), ([HEADER | {"names": ["nose", 3]}], "names: found a list of 2"),
    ([HEADER | {"names": ["a", "b"]}], "names: found 'a, b', expected some of nose,"),
    ([HEADER | {"names": ["nose", "Nose"]}], "names: found 'nose' and 'Nose', expected every landmark once"),
    ([HEADER, {"persons": []}], "line 2: found the key 'persons'"), ([HEADER, {}], "line 2: people: found None"),
    ([HEADER, ""], "line 2: found no JSON"), ([HEADER, "[" * 100_000], "line 2: found JSON nested too deeply"),
    ([HEADER, {"people": [{"points": [None]}]}], "line 2: people[0].points: found a list of 1, expected a list of 2"),
    ([HEADER, {"people": [{"points": [None, [1, 2]]}]}], "line 2: people[0].points: found a list of 2, expected 2 x 3 numbers"),
    ([HEADER, {"people": [{"points": [None, [1, "2", 1]]}]}], "line 2: people[0].points: found a list of 2, expected 2 x 3 numbers"),
    ([HEADER, {"people": [{"id": "a", "points": []}]}], "line 2: people[0].id: found 'a', expected a whole number"),
    ([HEADER, {"people": [{"points": [[0.5, 0.7, 1], None]}]}], "points: found none beyond 1, expected pixels"),
    ([HEADER, {"people": [{"points": [[5, 7, 50], None]}]}], "confidence: found 0 to 50, expected 0 to 1"),
])  # fmt: skip
def test_a_scripts_lines_that_are_no_keypoints_are_refused_by_file_and_line(tmp_path, rows, words):
    path = lines(tmp_path / "a.jsonl", *rows)
    with pytest.raises(FormatError) as error:
        read_jsonl(path, SIZE)
    assert str(error.value).startswith(f"{path}: {words}")


@pytest.mark.parametrize(("name", "landmark"), [
    ("left_shoulder", "left_shoulder"), ("LShoulder", "left_shoulder"), ("r hip", "right_hip"), ("Ankle_Left", "left_ankle"),
    ("left_foot_index", "left_big_toe"), ("RBigToe", "right_big_toe"), ("pelvis", "mid_hip"), ("Nose", "nose"), ("leftknee", "left_knee"),
    ("hip", None), ("tail", None), ("left_right_hip", None), ("", None),
])  # fmt: skip
def test_landmarks_are_known_by_other_programs_names(name, landmark):
    assert landmark_of(name) == landmark
