"""Keypoints of a recording, as a user sees them: `info` lists them, and says what is wrong about a file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.recording import read_recording


@pytest.fixture
def columns() -> int:
    """A wide terminal: rows are not broken."""
    return 300


def test_info_lists_what_a_detector_found(shell, spoilt):
    (view,) = read_recording(spoilt).views
    (spoilt / "keypoints").mkdir()
    xy, confidence = np.full((3, 2, 2), 9.0), np.ones((3, 2))
    made = film_keypoints(("nose", "left_wrist"), [0, 0, 3], [0, 1, 0], xy, confidence, "MediaPipe", view.camera.size)
    write_keypoints(spoilt / "keypoints" / f"{view.camera.name}.npz", made)
    code, out, _ = shell("info", spoilt)
    assert code == 0
    words = f"{view.camera.name}: 2 landmarks by MediaPipe, persons in 2 frames, up to 2 in one"
    assert f"keypoints {words}" in " ".join(out.split())
    look = json.loads(shell("info", spoilt, "--json")[1])["keypoints"]
    film = {"camera": view.camera.name, "detector": "MediaPipe", "landmarks": 2, "frames": 2, "persons": 2}
    assert look == {"films": [film], "apart": None, "apart_pixels": None}


@pytest.mark.parametrize(("name", "text", "words"), [
    ("{}.jsonl", "{}", "names: found None, expected a list of landmarks' names"), ("{}.npz", "damaged", "File is not a zip file"),
    ("{}.json", '[{"image_id": 3', "found no JSON"), ("{}.csv", "a,b\n", "found the columns 'a, b'"), ("{}.h5", "a", "found no keypoints"),
    ("{}_json/0.json", '{"people": 3}', "people: found 3, expected a list"), ("other.npz", "", "found other, but the calibration knows"),
])  # fmt: skip
def test_a_malformed_file_is_one_sentence(shell, spoilt, name, text, words):
    (view,) = read_recording(spoilt).views
    path = spoilt / "keypoints" / name.format(view.camera.name)
    path.parent.mkdir(parents=True)
    path.write_text(text)
    code, out, err = shell("info", spoilt)
    (line,) = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert (code, out) == (2, "")
    assert line.startswith("error: ")
    assert str(path.parent if name == "other.npz" else path) in line
    assert words in line
