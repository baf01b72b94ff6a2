"""Keypoints of one made film in every format are the same; models by number of landmarks; files that are malformed."""

from __future__ import annotations

import json

import numpy as np
import pytest
from detections import (
    SIZE,
    made_film,
    mmpose_demo,
    openpose,
    write_all,
)

from shadowpuppet.camera.keypoints import LANDMARKS
from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints
from shadowpuppet.io.keypoints.keypoint_files import KeypointSource, keypoints_in, read_keypoints
from shadowpuppet.io.keypoints.models import MODELS, stated_model
from shadowpuppet.io.keypoints.names import UNUSED

FORMATS = ("own", "openpose", "pose2sim", "script", "inferencer", "demo", "alphapose", "coco", "deeplabcut", "sleap")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A film, and its files by format."""
    film = made_film(np.random.default_rng(3))
    return film, write_all(tmp_path_factory.mktemp("keypoints"), film)


def same(one, other):
    """Whether two films have the same persons, landmarks and points, in any order of landmarks."""
    assert set(one.names) == set(other.names)
    order = [other.names.index(name) for name in one.names]
    np.testing.assert_array_equal(one.frame, other.frame)
    np.testing.assert_array_equal(one.person, other.person)
    np.testing.assert_allclose(one.xy, other.xy[:, order], atol=0.01)
    np.testing.assert_allclose(one.confidence, other.confidence[:, order], atol=1e-5)


def write(path, value):
    path.write_text(value if isinstance(value, str) else json.dumps(value))
    return path


def refusal(path, model=None):
    with pytest.raises(FormatError) as error:
        read_keypoints(path, SIZE, model)
    assert str(error.value).startswith(f"{path}: ")
    return str(error.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", FORMATS)
def test_one_film_is_the_same_in_every_format(made, name):
    film, paths = made
    assert set(paths) == set(FORMATS)
    same(film, read_keypoints(paths[name], SIZE))


@pytest.mark.parametrize("model", MODELS)
def test_landmarks_are_those_of_the_model(tmp_path, model):
    film = made_film(np.random.default_rng(1), model)
    moved = read_keypoints(openpose(tmp_path / "a", film), SIZE, stated_model(model))
    shift = 0.5 if model == "MEDIAPIPE_33" else 0.0
    same(film, film_keypoints(moved.names, moved.frame, moved.person, moved.xy + shift, moved.confidence, model, SIZE))
    assert moved.detector == model


def test_models_name_every_landmark_once_and_have_as_many_as_their_names_say():
    for model, table in MODELS.items():
        used = [name for name in table if name != UNUSED]
        assert len(used) == len(set(used))
        assert set(used) <= set(LANDMARKS)
        assert len(table) == int(model.rpartition("_")[2].rstrip("B"))


@pytest.mark.parametrize(("stated", "model"), [
    ("Body_with_feet", "HALPE_26"), ("body", "COCO_17"), ("Whole_body_wrist", "COCO_133"), ("BODY_25B", "BODY_25B"),
    ("coco", "OPENPOSE_18"),
])  # fmt: skip
def test_models_have_the_names_that_pose2sim_has_for_them(stated, model):
    assert stated_model(stated).name == model


def test_a_custom_model_is_a_tree_of_names_and_ids():
    tree = [{"name": "Hip", "id": 3, "children": [{"name": "RHip", "id": 0}, {"name": "Neck", "id": "None", "children": [
        {"name": "Nose", "id": 1}]}]}]  # fmt: skip
    assert stated_model(tree).landmarks == ("RHip", "Nose", UNUSED, "mid_hip")


@pytest.mark.parametrize("stated", ["Hand", 3, [], {"name": "Hip", "id": -1}, {"name": 3, "id": 1}, True])
def test_other_models_are_refused_by_name(stated):
    with pytest.raises(ShadowPuppetError, match="model: found"):
        stated_model(stated)


def test_body_25b_is_not_taken_for_body_25(tmp_path):
    heights = {"eye": 50, "ear": 52, "nose": 58, "neck": 90, "shoulder": 100, "elbow": 170, "wrist": 110, "hip": 240, "knee": 340}
    for model in ("BODY_25", "BODY_25B"):
        names = MODELS[model]
        xy = [[320 + (-20 if "left" in name else 20), heights.get(name.rpartition("_")[2], 440)] for name in names]
        film = film_keypoints(names, [0], [0], [xy], np.ones((1, 25)), model, SIZE)
        folder = openpose(tmp_path / model, film)
        same(film, read_keypoints(folder, SIZE, stated_model(model)))
        if model == "BODY_25":
            same(film, read_keypoints(folder, SIZE))
        else:
            assert refusal(folder).startswith("model: found 25 landmarks a person that fit BODY_25B better than BODY_25, expected it to be")


def test_scores_of_networks_over_one_are_clipped(tmp_path):
    folder = tmp_path / "a"
    folder.mkdir()
    write(folder / "0.json", {"people": [{"pose_keypoints_2d": [5, 6, 1.4, 7, 8, -0.1] + [0] * 45}]})
    assert read_keypoints(folder, SIZE).at(0).confidence[0, :2].tolist() == [1, 0]


def test_a_film_without_any_person_has_no_keypoints(tmp_path):
    folder = tmp_path / "a"
    folder.mkdir()
    write(folder / "0.json", {"people": []})
    assert [len(read_keypoints(path, SIZE).frame) for path in (folder, write(tmp_path / "a.json", []))] == [0, 0]


@pytest.mark.parametrize(("values", "words"), [
    ("{", "found no JSON"), ("[" * 100_000, "found JSON nested too deeply"), ({"people": 3}, "people: found 3, expected a list"),
    ([], "people: found None"),
    ({"people": [{"pose_keypoints": []}]}, "people: found a table without pose_keypoints_2d"),
    ({"people": [{"pose_keypoints_2d": [1, 2, 3]}]}, "found 1 landmarks a person, expected a model of BODY_25,"),
    ({"people": [{"pose_keypoints_2d": ["a"] * 51}]}, "keypoints: found a list of 51, expected 17 x 3 numbers"),
    ({"people": [{"pose_keypoints_2d": [5.0] * 52}]}, "keypoints: found a list of 52, expected 17 x 3 numbers"),
    ({"people": [{"pose_keypoints_2d": [[5, [5]]] * 51}]}, "keypoints: found a list of 51, expected 17 x 3 numbers"),
    ({"people": [{"pose_keypoints_2d": [5] * 51}, {"pose_keypoints_2d": [5] * 54}]}, "keypoints: found 18 landmarks, expected 17 as in"),
    ({"people": [{"pose_keypoints_2d": [5] * 51, "keypoint_scale": 3}]}, "keypoint_scale: found 3, which is not known here and may change"),
    ({"people": [], "keypoint_scale": 3}, "keypoint_scale: found 3, which is not known here and may change where points are seen"),
])  # fmt: skip
def test_a_malformed_frame_of_openpose_is_refused_by_name(tmp_path, values, words):
    folder = tmp_path / "a"
    folder.mkdir()
    path = write(folder / "frame_7.json", values)
    with pytest.raises(FormatError) as error:
        read_keypoints(folder, SIZE)
    assert str(error.value).startswith(f"{path}: {words}")


@pytest.mark.parametrize(("stated", "person"), [
    ([3], 3), (3.0, 3), ([-1], -1), (None, -1), ([], -1), ([1, 2], -1), ("a", -1), (float("nan"), -1), (float("inf"), -1), (2**40, -1),
])  # fmt: skip
def test_a_persons_number_is_one_or_unknown(tmp_path, stated, person):
    folder = tmp_path / "a"
    folder.mkdir()
    write(folder / "0.json", {"people": [{"person_id": stated, "pose_keypoints_2d": [5, 5, 1] * 17}]})
    assert read_keypoints(folder, SIZE).person.tolist() == [person]


def test_a_person_of_whom_only_hands_were_found_is_left_out(tmp_path):
    folder = tmp_path / "a"
    folder.mkdir()
    hands = {"pose_keypoints_2d": [], "hand_left_keypoints_2d": [5, 5, 1] * 21}
    write(folder / "0.json", {"people": [hands, {"pose_keypoints_2d": [5, 5, 1] * 17}]})
    assert len(read_keypoints(folder, SIZE).person) == 1


def test_keys_that_are_not_known_are_named(made, tmp_path):
    film, _ = made
    folder = openpose(tmp_path / "a", film, mood="good")
    with pytest.warns(ShadowPuppetWarning, match="keys that are not known are not used: mood"):
        same(film, read_keypoints(folder, SIZE))
    with pytest.warns(ShadowPuppetWarning, match="columns that are not known are not used: mood"):
        read_keypoints(write(tmp_path / "a.csv", "frame_idx,mood,nose.x,nose.y,nose.score\n0,9,5,6,0.5\n"), SIZE)


def test_shares_of_the_picture_are_no_pixels(tmp_path):
    folder = tmp_path / "a"
    folder.mkdir()
    write(folder / "0.json", {"people": [{"pose_keypoints_2d": [0.5, 0.7, 0.9] * 17}]})
    assert refusal(folder) == "points: found none beyond 1, expected pixels, no shares of the picture"


def test_points_that_are_all_outside_the_picture_are_another_films(tmp_path):
    path = write(tmp_path / "a.json", [{"image_id": "0.jpg", "keypoints": [900, 600, 0.9] * 17}])
    assert refusal(path) == "points: found all outside the picture of 640 x 480 pixels, expected those of its film"


@pytest.mark.parametrize(("names", "words"), [
    ((), "found no files of JSON in it"), (("a_7", "b_07"), "found frame 7 in it and in a_7.json, expected every frame once"),
    (("a",), "frame: found no number in 'a'"), (("1" * 30,), "frame: found no number in "), (("9999999999",), "frame: found 9999999999,"),
])  # fmt: skip
def test_files_of_openpose_have_the_numbers_of_their_frames(tmp_path, names, words):
    folder = tmp_path / "a"
    folder.mkdir()
    for name in names:
        write(folder / f"{name}.json", {"people": [{"pose_keypoints_2d": [5, 5, 1] * 17}]})
    with pytest.raises(FormatError) as error:
        read_keypoints(folder, SIZE)
    assert words in str(error.value)


@pytest.mark.parametrize(("change", "words"), [
    (lambda demo: demo["instance_info"][0].pop("frame_id"), "found a table with frame_id None and instances a list of 2, expected a whole"),
    (lambda demo: demo["instance_info"][0].update(frame_id=0), "frame: found -1, expected 0 to under"),
    (lambda demo: demo["instance_info"].append(3), "found 3 with frame_id None"),
    (lambda demo: demo["instance_info"][0].update(frame_rotation=3), "frame_rotation: found 3, which is not known here and may"),
    (lambda demo: demo.update(scale=3), "scale: found 3, which is not known here"),
    (lambda demo: demo["instance_info"][0]["instances"][0].pop("keypoint_scores"), "instances: found a table, expected keypoints and"),
    (lambda demo: demo["instance_info"][0]["instances"][0].pop("keypoints"), "keypoints: found None and scores a list of 26, expected"),
    (lambda demo: demo["instance_info"][0]["instances"][0]["keypoints"].pop(), "keypoints: found a list of 25, expected 26 x 2 numbers"),
])  # fmt: skip
def test_a_malformed_file_of_mmpose_is_refused_by_name(made, tmp_path, change, words):
    demo = mmpose_demo(made[0])
    change(demo)
    assert refusal(write(tmp_path / "a.json", demo)).startswith(words)


def test_names_that_a_file_of_mmpose_states_are_used_where_they_are_others(made, tmp_path):
    film, demo = made[0], mmpose_demo(made[0])
    names = demo["meta_info"]["keypoint_id2name"]
    names["5"], names["6"] = names["6"], names["5"]
    read = read_keypoints(write(tmp_path / "a.json", demo), SIZE)
    assert read.detector == "CUSTOM"
    np.testing.assert_allclose(read.at(0).xy[:, read.names.index("left_shoulder")], film.at(0).xy[:, film.names.index("right_shoulder")])


@pytest.mark.parametrize(("values", "words"), [
    ({}, "found a table, expected MMPose's or AlphaPose's list"), (3, "found 3, expected"), ([3], "found 3 among persons, expected tables"),
    ([{"image_id": "1.jpg", "category_id": 17, "keypoints": [5, 5, 1] * 17}], "found a table among persons, expected tables"),
    ([{"keypoints": [5, 5, 1] * 17}], "image_id: found None, expected an image's name or number"),
    ([{"image_id": "a", "keypoints": [5, 5, 1] * 17}], "frame: found no number in 'a'"),
    ([{"image_id": 397133, "keypoints": [5, 5, 1] * 17}], "image_id: found 1 numbers from 397133 to 397133, expected all from 0 or 1 on"),
    ([{"image_id": n, "keypoints": [5, 5, 1] * 17} for n in (0, 2)], "image_id: found 2 numbers from 0 to 2, expected all"),
    ([{"image_id": "1.jpg", "keypoints": 3}], "keypoints: found 3 and scores None, expected lists"),
])  # fmt: skip
def test_a_malformed_list_of_persons_is_refused_by_name(tmp_path, values, words):
    assert refusal(write(tmp_path / "a.json", values)).startswith(words)


@pytest.mark.parametrize(("text", "words"), [
    ("a,b\n1,2\n", "found the columns 'a, b', expected DeepLabCut's lines"), (",,\n", "found the columns"),
    ('""\n', "found the columns ''"),
    ("scorer,a\nbodyparts,nose\n", "found the lines scorer, bodyparts, expected scorer, (individuals), bodyparts, coords"),
    ("scorer,a,a\nbodyparts,nose,nose\ncoords,x,y\n0,5,6\n", "coords: found x, y in 2 columns, expected x, y and likelihood"),
    ("scorer,a,a,a\nbodyparts,nose,nose,nose\ncoords,x,x,y\n0,5,6,7\n", "coords: found x, y in 3 columns"),
    ("scorer,a,a,a,a\nbodyparts,nose,nose,nose,nose\ncoords,x,y,likelihood,x\n0,5,6,1,7\n", "coords: found likelihood, x, y in 4 columns"),
    ("scorer,a,a,a\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n0,5,6\n", "line 4: found 3 cells, expected 4 as in the first"),
    ("scorer,a,a,a\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\nimg,5,6,1\n", "line 4: found the frame 'img', expected a whole"),
    ("scorer,a,a,a\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n0,5,b,1\n", "line 4, column 'nose': found 'b', expected a number"),
    ("scorer,a,a,a\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n0,5,6,2\n", "confidence: found 0 to 2, expected 0 to 1"),
    ("scorer,a,a,a\nbodyparts,tail,tail,tail\ncoords,x,y,likelihood\n0,5,6,1\n", "names: found 'tail', expected some of nose,"),
    ("frame_idx,nose.x,nose.y\n0,5,6\n", "found the columns 'frame_idx, nose.x, nose.y', expected every one once, and nose.score among"),
    ("frame_idx,nose.x,nose.y,nose.score,nose.x\n0,5,6,1,2\n", "found the columns 'frame_idx, nose.x, nose.y, nose.score', expected every"),
    ("frame_idx,nose.x,nose.y,nose.score\n-1,5,6,1\n", "line 2: found the frame '-1', expected a whole number from 0 on"),
])  # fmt: skip
def test_a_malformed_table_is_refused_by_line_and_column(tmp_path, text, words):
    assert refusal(write(tmp_path / "a.csv", text)).startswith(words)


@pytest.mark.parametrize("name", ["a.h5", "a.slp", "a.pickle", "a.txt"])
def test_files_that_may_hold_pickles_are_not_opened(tmp_path, name):
    words = refusal(write(tmp_path / name, "\x80\x04"))
    assert words.startswith("found no keypoints, expected .npz")
    assert ("pickles" in words) == (name != "a.txt")


def test_a_source_is_read_with_the_model_that_is_stated_beside_it(made):
    film, paths = made
    same(film, KeypointSource(paths["openpose"], "Body_with_feet").read(SIZE))
    with pytest.raises(FormatError, match="model: found 'Hand', expected one of BODY_25"):
        KeypointSource(paths["openpose"], "Hand").read(SIZE)
    with pytest.raises(FormatError, match="keypoints: found 26 landmarks, expected 17 as in COCO_17"):
        KeypointSource(paths["openpose"], "Body").read(SIZE)


def test_files_belong_to_the_camera_of_their_name(tmp_path):
    for name in ("cam1_json", "b"):
        (tmp_path / name).mkdir()
    for name in ("cam2.npz", "cam3DLC_resnet50_made.csv", ".hidden.npz", "notes.txt", "b.json"):
        write(tmp_path / name, "")
    found = {name: [path.name for path in paths] for name, paths in keypoints_in(tmp_path).items()}
    assert found == {"cam1": ["cam1_json"], "cam2": ["cam2.npz"], "cam3": ["cam3DLC_resnet50_made.csv"], "b": ["b", "b.json"]}
