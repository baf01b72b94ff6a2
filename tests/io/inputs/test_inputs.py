"""The files that a run depends on: by name, content, and changes; and whether an earlier run may go on with them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.inputs import inputs
from shadowpuppet.io.inputs.inputs import Inputs, content_of, fingerprint, inputs_of
from shadowpuppet.io.inputs.same_run import INPUTS, check_same, write_inputs

FILES = ("calibration.toml", "recording.toml", "video/a.mp4", "video/b.mp4", "background/a.png", "masks/a/1.png", "masks/a/2.png",
         "references/front_t_pose.png", "keypoints/a.npz", "truth.csv", "training.csv")
PARTS = {*FILES, "masks/a"} - {"masks/a/1.png", "masks/a/2.png"}


@pytest.fixture
def lab(tmp_path) -> Path:
    """A recording with every kind of file; each holds its name."""
    for name in FILES:
        (tmp_path / "lab" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "lab" / name).write_text("" if name == "recording.toml" else name)
    return tmp_path / "lab"


@pytest.fixture
def person(tmp_path) -> Path:
    (tmp_path / "me.toml").write_text("height = 1.8")
    return tmp_path / "me.toml"


def test_every_file_that_a_run_reads_is_a_part_with_a_name(lab, person, tmp_path):
    (tmp_path / "elsewhere.mp4").write_text("film")
    (lab / "recording.toml").write_text('[video]\nc = "../elsewhere.mp4"\n')
    for unread in ("notes.txt", "video/.hidden.mp4", "overlay.mp4"):
        (lab / unread).write_text("other")
    inputs = inputs_of(lab, {"person": person, "prior": None})
    assert inputs.parts.keys() == PARTS | {"elsewhere.mp4", "--person"}
    assert (inputs.named("video/a.mp4"), inputs.named("--person")) == ("video/a.mp4", "me.toml (--person)")


@pytest.mark.parametrize("layout", ["film", "pictures", "films beside each other", "calibration of another program"])
def test_films_are_parts_wherever_they_lie(tmp_path, layout):
    film, pictures = tmp_path / "film.mp4", tmp_path / "pictures"
    film.write_text("film")
    pictures.mkdir()
    (pictures / "1.png").write_text("picture")
    if layout == "film":
        assert inputs_of(film, {}).parts == {"": film}
        assert inputs_of(film, {}).named("") == "film.mp4"
    elif layout == "pictures":
        assert inputs_of(pictures, {}).parts == {"": pictures}
    elif layout == "films beside each other":
        assert inputs_of(tmp_path, {}).parts == {"film.mp4": film}
    else:
        (tmp_path / "lab.xcp").write_text("<Cameras>")
        assert inputs_of(tmp_path, {}).parts.keys() == {"film.mp4", "lab.xcp"}


@pytest.mark.parametrize("place", ["nowhere", "0", "x" * 5000, "a\0b"])
def test_what_is_no_recording_has_no_parts(place):
    assert inputs_of(place, {}).parts == {}
    assert fingerprint(Path(place)) == fingerprint(Path("nowhere"))


@pytest.mark.parametrize("name", FILES)
def test_another_content_is_named_and_the_time_alone_is_none(lab, name):
    before = inputs_of(lab, {}).contents
    os.utime(lab / name, (1, 1))
    assert inputs_of(lab, {}).contents == before
    (lab / name).write_text("#")
    now = inputs_of(lab, {}).contents
    assert [part for part in now if now[part] != before[part]] == [name if name in PARTS else "masks/a"]


def test_a_copy_in_another_place_has_the_same_content(lab, tmp_path):
    assert inputs_of(shutil.copytree(lab, tmp_path / "copy"), {}).contents == inputs_of(lab, {}).contents
    assert fingerprint(tmp_path / "copy") == fingerprint(lab)


def test_long_files_are_known_by_blocks_over_all_of_their_length(tmp_path, monkeypatch):
    monkeypatch.setattr(inputs, "WHOLE", 1 << 16)
    monkeypatch.setattr(inputs, "LEAST", 1 << 16)
    film, size, gap = tmp_path / "film.mp4", 10 ** 6, 10 ** 6 // (inputs.BLOCKS - 1)
    film.write_bytes(bytes(size))
    whole = content_of([("", film)])
    for place, stretch in ((0, 1), (size - 1, 1), *((place, gap) for place in range(0, size - gap, gap // 7))):
        with film.open("r+b") as data:
            data.seek(place)
            data.write(b"x" * stretch)
        assert content_of([("", film)]) != whole
        film.write_bytes(bytes(size))
    film.write_bytes(bytes(size + 1))
    assert content_of([("", film)]) != whole


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("change", ["size", "time", "removed"])
def test_a_change_while_a_run_goes_on_is_named(lab, name, change):
    inputs = inputs_of(lab, {})
    assert inputs.changed() == ""
    file = lab / name
    if change == "size":
        at = file.stat()
        file.write_text("longer than it was before")
        os.utime(file, ns=(at.st_atime_ns, at.st_mtime_ns))
    elif change == "time":
        os.utime(file, (1, 1))
    else:
        file.unlink()
    assert inputs.changed() == f"{name if name in PARTS else 'masks/a'} has changed"


def test_new_pictures_in_a_folder_are_a_change_and_other_new_files_are_none(lab):
    inputs = inputs_of(lab, {})
    for name in ("masks/a/.DS_Store", "masks/a/Thumbs.db", "notes.txt"):
        (lab / name).write_text("other")
    assert inputs.changed() == ""
    (lab / "masks/a/3.png").write_text("new")
    assert inputs.changed() == "masks/a has changed"


def test_many_changes_are_listed_in_short(lab):
    inputs = inputs_of(lab, {})
    for name in FILES[:2]:
        os.utime(lab / name, (1, 1))
    assert inputs.changed() == "calibration.toml and recording.toml have changed"
    for name in FILES:
        os.utime(lab / name, (1, 1))
    assert inputs.changed().endswith(" and 7 more have changed")


def test_parts_that_are_not_used_are_left_out(lab):
    used = inputs_of(lab, {}).without([lab / "video" / "b.mp4", None, 0])
    assert used.parts.keys() == PARTS - {"video/b.mp4"}
    os.utime(lab / "video" / "b.mp4", (1, 1))
    assert used.changed() == ""


INFO = {"recording": "here", "method": "m", "settings": {"seed": 3, "person": "here/me.toml"}}


def check(folder: Path, inputs: Inputs, has_state: bool = True, **changed) -> None:
    check_same(folder, INFO, INFO | changed, inputs, has_state)


def test_an_earlier_run_goes_on_with_the_same_inputs_also_elsewhere(lab, person, tmp_path):
    write_inputs(tmp_path, inputs_of(lab, {"person": person}))
    check(tmp_path, inputs_of(lab, {"person": person}))
    moved = inputs_of(lab.rename(tmp_path / "moved"), {"person": person.rename(tmp_path / "you.toml")})
    elsewhere = {"recording": "there", "truth": "there/truth.csv", "settings": {"seed": 3, "person": "there/you.toml"}}
    check(tmp_path, moved, **elsewhere)
    with pytest.raises(ShadowPuppetError, match=r"recording was 'here', and is 'there'"):
        check(tmp_path, moved, has_state=False, **elsewhere)  # nothing says that it is the same recording


@pytest.mark.parametrize(("change", "said"), [
    (lambda lab: (lab / "calibration.toml").write_text("moved by 0.5 m"), "calibration.toml has changed since"),
    (lambda lab: (lab / "video" / "a.mp4").write_text("other"), "video/a.mp4 has changed since"),
    (lambda lab: (lab.parent / "me.toml").write_text("height = 1.7"), r"me.toml \(--person\) has changed since"),
    (lambda lab: (lab / "masks" / "a" / "2.png").unlink(), "masks/a has changed since"),
    (lambda lab: (lab / "training.csv").unlink(), "training.csv was there, and is missing now"),
    (lambda lab: (lab / "masks" / "b.mkv").write_text("new"), "masks/b.mkv was not there when it began"),
])  # fmt: skip
def test_another_input_is_refused_by_name(lab, person, tmp_path, change, said):
    write_inputs(tmp_path, inputs_of(lab, {"person": person}))
    change(lab)
    with pytest.raises(ShadowPuppetError, match=f"the run there cannot go on: {said}; expected the files with which it began"):
        check(tmp_path, inputs_of(lab, {"person": person}))


def test_settings_and_a_file_that_was_not_named_are_refused_too(lab, person, tmp_path):
    write_inputs(tmp_path, inputs_of(lab, {}))
    with pytest.raises(ShadowPuppetError, match=r"me.toml \(--person\) was not there when it began"):
        check(tmp_path, inputs_of(lab, {"person": person}))
    with pytest.raises(ShadowPuppetError, match=r"settings.seed was 3, and is 4"):
        check(tmp_path, inputs_of(lab, {}), settings=INFO["settings"] | {"seed": 4})


@pytest.mark.parametrize(("text", "said"), [
    (None, "found a checkpoint without checkpoint.json, as earlier versions wrote it"),
    ("{", "checkpoint.json: not what a run's inputs held"), ("[]", "not what"), ('{"inputs": [1]}', "not what"),
    ('{"inputs": {"a": 1}}', "found a value that is no text")])
def test_a_checkpoint_that_does_not_say_its_inputs_is_refused(lab, tmp_path, text, said):
    if text is not None:
        (tmp_path / INPUTS).write_text(text)
    with pytest.raises(FormatError, match=said):
        check(tmp_path, inputs_of(lab, {}))
    check(tmp_path, inputs_of(lab, {}), has_state=False)
