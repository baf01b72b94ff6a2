"""Recordings with masks of another program: films linked, masks written, complete or not at all."""

from __future__ import annotations

import os

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, SilhouetteError
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.made.made_recording import MADE_BY, link, readable_recording, write_made_recording
from shadowpuppet.io.recording import read_recording
from shadowpuppet.video import open_frames, write_frames, write_image

WIDTH, HEIGHT, FRAMES = 32, 24, 5


def film(path, count=FRAMES):
    path.parent.mkdir(exist_ok=True, parents=True)
    with write_frames(path, 10) as writer:
        for n in range(count):
            writer.write(np.full((HEIGHT, WIDTH, 3), 40 * n, np.uint8))
    return path


@pytest.fixture
def two(tmp_path):
    folder = tmp_path / "lab"
    for name in ("left", "right"):
        film(folder / "video" / f"{name}.mp4")
        write_image((folder / "background").joinpath(f"{name}.png") if (folder / "background").mkdir(exist_ok=True) is None else folder,
                    np.zeros((HEIGHT, WIDTH), np.uint8))  # fmt: skip
    write_calibration(folder / "calibration.toml", [Camera.from_fov((WIDTH, HEIGHT), 1.0, name) for name in ("left", "right")])
    (folder / "truth.csv").write_text("time\n")
    (folder / "recording.toml").write_text("rate = 12.5\nduration = 0.3\n[subject]\nheight = 1.7\n[start]\nright = 0.1\n")
    return folder


def half(view):
    """A mask for each frame: the left half."""
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[:, : WIDTH // 2] = True
    return [mask] * FRAMES


def write_masked_recording(recording, folder, masks, **more):
    """Write a recording with masks of each view."""
    def write(part):
        for view in recording.views:
            with write_frames(part / "masks" / f"{view.camera.name}.mkv", 10, lossless=True) as writer:
                for mask in masks(view):
                    writer.write(255 * mask.astype(np.uint8))

    write_made_recording(("masks",), recording, folder, write, **more)


def test_a_recording_keeps_all_that_it_had(two, tmp_path):
    before, calibrated = readable_recording(two)
    assert calibrated
    write_masked_recording(before, tmp_path / "new", half, made_by={"script": "half"})
    after = read_recording(tmp_path / "new")
    assert (after.rate, after.duration, after.subject) == (12.5, 0.3, before.subject)
    for old, new in zip(before.views, after.views):
        assert (new.start, new.camera.name, new.camera.size) == (old.start, old.camera.name, old.camera.size)
        np.testing.assert_allclose(new.camera.matrix, old.camera.matrix)
        assert os.path.samefile(new.video, old.video)
        assert os.path.samefile(new.background, old.background)
        frames = [frame.image for frame in open_frames(new.masks, grey=True)]
        assert len(frames) == FRAMES
        np.testing.assert_array_equal(frames[0], 255 * half(new)[0])
    assert os.path.samefile(after.truth, two / "truth.csv")
    assert (tmp_path / "new" / "masks" / MADE_BY).read_text() == 'script = "half"\n'
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lab", "new"]


def test_a_film_without_calibration_has_none_afterwards(tmp_path):
    recording, calibrated = readable_recording(film(tmp_path / "walk.mp4"))
    assert not calibrated
    write_masked_recording(recording, tmp_path / "new", half, calibrated=False)
    assert not (tmp_path / "new" / "calibration.toml").exists()
    assert read_recording(tmp_path / "new", fov=1.0).views[0].masks is not None


def test_what_is_no_recording_is_refused_for_its_own_reason(tmp_path, two):
    with pytest.raises(RecordingError, match="no such recording"):
        readable_recording(tmp_path / "gone")
    (two / "calibration.toml").unlink()
    with pytest.raises(RecordingError, match=r"no calibration\.toml for its 2 cameras"):
        readable_recording(two)
    (tmp_path / "live").mkdir()
    (tmp_path / "live" / "recording.toml").write_text("[video]\ncam = 0\n")
    write_calibration(tmp_path / "live" / "calibration.toml", [Camera.from_fov((WIDTH, HEIGHT), 1.0, "cam")])
    with pytest.raises(RecordingError, match="live camera"):
        readable_recording(tmp_path / "live")


def test_nothing_is_left_of_a_recording_whose_masks_fail(two, tmp_path):
    def fails(view):
        yield from half(view)[:2]
        raise SilhouetteError("the script failed")

    with pytest.raises(SilhouetteError):
        write_masked_recording(readable_recording(two)[0], tmp_path / "new", fails)
    assert [path.name for path in tmp_path.iterdir()] == ["lab"]
    with pytest.raises(SilhouetteError):
        write_masked_recording(readable_recording(two)[0], two, fails)
    assert not list(two.glob(".*"))
    assert not (two / "masks").exists()


def test_masks_of_the_recording_itself_are_replaced_only_if_asked(two):
    recording = readable_recording(two)[0]
    write_masked_recording(recording, two, half)
    assert read_recording(two).views[1].masks == two / "masks" / "right.mkv"
    (two / "masks" / "mine.txt").write_text("mine")
    with pytest.raises(RecordingError, match=r"found masks there already; .* or replace them with --force"):
        write_masked_recording(recording, two, half)
    assert (two / "masks" / "mine.txt").exists()
    write_masked_recording(recording, two, half, replaced=True)
    assert sorted(path.name for path in (two / "masks").iterdir()) == ["left.mkv", MADE_BY, "right.mkv"]
    assert not list(two.glob(".*"))


def test_other_files_are_not_written_over(two, tmp_path):
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "a.txt").write_text("a")
    for folder in (tmp_path / "notes", tmp_path / "notes" / "a.txt"):
        with pytest.raises(RecordingError, match="found other files there"):
            write_masked_recording(readable_recording(two)[0], folder, half, replaced=True)
    (tmp_path / "empty").mkdir()
    write_masked_recording(readable_recording(two)[0], tmp_path / "empty", half)
    assert (tmp_path / "empty" / "video" / "left.mp4").exists()


def test_a_folder_of_pictures_is_linked_and_is_no_recording_to_write_into(tmp_path):
    (tmp_path / "walk").mkdir()
    for n in range(FRAMES):
        write_image(tmp_path / "walk" / f"{n}.png", np.full((HEIGHT, WIDTH), 40 * n, np.uint8))
    (tmp_path / "walk" / "timestamps.txt").write_text("".join(f"{n / 10}\n" for n in range(FRAMES)))
    recording, _ = readable_recording(tmp_path / "walk")
    with pytest.raises(RecordingError, match="found other files there"):
        write_masked_recording(recording, tmp_path / "walk", half, calibrated=False)
    write_masked_recording(recording, tmp_path / "new", half, calibrated=False)
    assert len(list(open_frames(tmp_path / "new" / "video" / "walk"))) == FRAMES


def test_films_are_copied_where_links_are_not_possible(tmp_path, monkeypatch):
    def no_links(*_, **__):
        raise OSError(1, "not permitted")

    monkeypatch.setattr(os, "symlink", no_links)
    (tmp_path / "a.txt").write_text("a")
    link(tmp_path / "a.txt", tmp_path / "to" / "b.txt")
    link(tmp_path / "to", tmp_path / "copy")
    assert (tmp_path / "copy" / "b.txt").read_text() == "a"
    assert not (tmp_path / "copy").is_symlink()
