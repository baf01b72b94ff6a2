"""Recording folders: what lies there is found; what is missing, unknown or does not fit is said."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, RecordingError, ShadowPuppetWarning, VideoError
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.recording import POSTURES, Subject, is_recording, read_recording
from shadowpuppet.pipeline.footage import open_recording
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.video import open_frames, write_frames, write_image
from shadowpuppet.video.film import is_steady

SIZE = (32, 24)


def picture(size=SIZE):
    return np.full((size[1], size[0]), 100, np.uint8)


def film(path, size=SIZE):
    path.parent.mkdir(exist_ok=True, parents=True)
    with write_frames(path, 10) as writer:
        writer.write(picture(size))
        writer.write(picture(size))
    return path


def still(path, size=SIZE):
    path.parent.mkdir(exist_ok=True, parents=True)
    write_image(path, picture(size))
    return path


def cameras(*names, size=SIZE):
    return [Camera.from_fov(size, 1.0, name) for name in names]


def recording(folder, *names):
    folder.mkdir(exist_ok=True)
    write_calibration(folder / "calibration.toml", cameras(*names))
    for name in names:
        film(folder / "video" / f"{name}.mp4")
    return folder


@pytest.fixture
def one(tmp_path):
    return recording(tmp_path / "bow", "cam")


@pytest.fixture
def two(tmp_path):
    return recording(tmp_path / "walk", "left", "right")


def notes(folder, text):
    (folder / "recording.toml").write_text(text)
    return folder


def said(path, *parts, error=RecordingError, **options):
    with pytest.raises(error) as found:
        read_recording(path, **options)
    for part in parts:
        assert part in str(found.value)
    assert "\n" not in str(found.value)


def test_everything_in_its_place_is_found(one):
    for name in POSTURES:
        still(one / "references" / f"{name}.png")
    still(one / "references" / "front_t_pose_mask.png")
    film(one / "background" / "cam.mp4")
    still(one / "masks" / "cam" / "0.png")
    for name in ("truth.csv", "truth.trc", "training.trc", "video/notes.txt", "references/front_t_pose.csv", "masks/.hidden.mp4"):
        (one / name).write_text("")
    notes(one, "rate = 15\n[subject]\nheight = 1.83\ndistance = 2\n")
    found = read_recording(one)
    view, = found.views
    assert (found.name, found.path, found.rate) == ("bow", one, 15.0)
    assert found.subject == Subject(1.83, 2.0)
    assert (view.camera.name, view.video) == ("cam", one / "video/cam.mp4")
    assert (view.background, view.masks) == (one / "background/cam.mp4", one / "masks/cam")
    assert [r.name for r in found.references] == list(POSTURES)
    assert [r.mask for r in found.references] == [one / "references/front_t_pose_mask.png", None, None]
    assert (found.truth, found.training) == (one / "truth.csv", one / "training.trc")


def test_little_is_enough(one):
    found = read_recording(one)
    assert (found.subject, found.references, found.truth, found.training, found.rate) == (Subject(), (), None, None, None)


def test_views_follow_the_calibration(two):
    assert [v.camera.name for v in read_recording(two).views] == ["left", "right"]


def test_a_film_alone_needs_a_field_of_view_or_a_calibration(one):
    path = film(one / "take.mp4")
    said(path, "take.mp4: no calibration", "--fov DEGREES", "calibration.toml")
    found = read_recording(path, fov=1.0)
    assert (found.name, found.views[0].camera.oriented, found.views[0].camera.size) == ("take", False, SIZE)
    assert read_recording(path, calibration=one / "calibration.toml").views[0].camera.name == "cam"
    said(path, "expected one of them", fov=1.0, calibration=one / "calibration.toml")
    said(path, "between 0 and 180", fov=4.0, error=CalibrationError)


def test_a_film_alone_takes_the_camera_of_its_name(two):
    found = read_recording(two / "video" / "right.mp4", calibration=two / "calibration.toml")
    assert [v.camera.name for v in found.views] == ["right"]
    said(film(two / "middle.mp4"), "no camera 'middle'", "cameras there: left, right", calibration=two / "calibration.toml")


def test_a_folder_of_pictures_alone_is_a_film(tmp_path):
    still(tmp_path / "take" / "1.png")
    found = read_recording(tmp_path / "take", fov=1.0)
    assert (found.views[0].video, found.views[0].camera.size) == (tmp_path / "take", SIZE)


def test_one_camera_s_folder_takes_a_field_of_view_instead(one):
    said(one, "a field of view and a calibration (calibration.toml)", fov=1.0)
    (one / "calibration.toml").unlink()
    said(one, "--fov DEGREES")
    assert not read_recording(one, fov=1.0).views[0].camera.oriented


def test_several_cameras_need_a_calibration(two):
    (two / "calibration.toml").unlink()
    said(two, "no calibration.toml for its 2 cameras (left, right)", fov=1.0)


def test_a_given_calibration_replaces_the_folder_s(one):
    write_calibration(one / "other.toml", cameras("cam", size=(33, 24)))
    said(one, "33 x 24", calibration=one / "other.toml")
    said(notes(one, 'calibration = "other.toml"'), "33 x 24")


def test_paths_are_named_in_recording_toml(one, tmp_path):
    film(tmp_path / "elsewhere.mkv")
    still(one / "empty.png")
    (one / "joints.csv").write_text("")
    notes(one, 'truth = "joints.csv"\ntraining = "joints.csv"\n[video]\ncam = "../elsewhere.mkv"\n'
               '[background]\ncam = "empty.png"\n[masks]\ncam = "empty.png"\n')
    found = read_recording(one)
    view, = found.views
    assert (view.video, view.background) == (one / "../elsewhere.mkv", one / "empty.png")
    assert (found.truth, found.training) == (one / "joints.csv",) * 2


@pytest.mark.parametrize("camera", ["0", '"camera:0"'])
def test_a_live_camera_is_named_in_recording_toml(one, camera):
    found = read_recording(notes(one, f"[video]\ncam = {camera}"))
    assert found.views[0].video in (0, "camera:0")


@pytest.mark.parametrize(("text", "words"), [
    ("hieght = 1.8",
     "found the key hieght; keys known there: background, calibration, duration, keypoints, masks, rate, start, subject, training, truth"),
    ("[subject]\nheigth = 1.8", "found the key subject.heigth; keys known there: distance, height"),
    ("[subject]\nheight = 183", "height: found 183, expected 0.5 to 2.5 metres"),
    ("[subject]\nheight = nan", "height: found nan"),
    ("[subject]\nheight = true", "height: found True"),
    ("[subject]\ndistance = '2 m'", "distance: found '2 m', expected 0.2 to 30 metres"),
    ("subject = 1.8", "subject: found 1.8, expected a table [subject]"),
    ("video = 'cam.mp4'", "video: found 'cam.mp4', expected a table [video]"),
    ("rate = 0", "rate: found 0, expected 0.1 to 10000 frames/s"),
    ("duration = 0", "duration: found 0, expected 0.001 to 1e+06 seconds"),
    ("start = 1.5", "start: found 1.5, expected a table [start]"),
    ("[start]\ncam = -0.1", "start.cam: found -0.1, expected 0 to 100000 seconds"),
    ("[start]\nkam = 1", "found kam, but the calibration knows no such camera; cameras known: cam"),
    ("truth = 'nowhere.csv'", "truth: found 'nowhere.csv', expected the path of an existing file"),
    (f"truth = '{'a' * 300}'", "expected the path of an existing file"),
    ("truth = \"a\\u0000b\"", "expected the path of an existing file"),
    ("calibration = 3", "calibration: found 3"),
    ("[video]\ncam = 'nowhere.mp4'", "video.cam: found 'nowhere.mp4'"),
    ("[video]\ncam = true", "video.cam: found True"),
    ("[masks]\ncam = 'camera:0'", "masks.cam: found 'camera:0'"),
    ("[masks]\nkam = 'video/cam.mp4'", "found kam, but the calibration knows no such camera; cameras known: cam"),
    ("a b", "not valid TOML"),
])
def test_a_mistake_in_recording_toml_is_said(one, text, words):
    said(notes(one, text), words, str(one))


def test_where_films_begin_and_how_much_counts_is_reported(two):
    found = read_recording(notes(two, "rate = 60\nduration = 9.75\n[start]\nright = 1.35\n"))
    assert (found.duration, [view.start for view in found.views]) == (9.75, [0.0, 1.35])
    notes(two, "")
    assert (read_recording(two).duration, {view.start for view in read_recording(two).views}) == (None, {0.0})


def test_films_of_unknown_cameras_are_said(two):
    film(two / "video" / "middle.mp4")
    said(two, "video: found middle", "cameras known: left, right")


def test_a_camera_without_film_is_left_out_with_a_warning(two):
    (two / "video" / "left.mp4").unlink()
    with pytest.warns(ShadowPuppetWarning, match="no film of left; going on with right"):
        assert [v.camera.name for v in read_recording(two).views] == ["right"]
    still(two / "video" / "left.png")
    match = r"no film of left \(left\.png there: found a picture, expected a film\); going on with right"
    with pytest.warns(ShadowPuppetWarning, match=match):
        read_recording(two)


def test_a_picture_is_no_film(tmp_path):
    said(still(tmp_path / "me.png"), "me.png: found a picture, expected a film, or the folder with a film's pictures", fov=1.0)


def test_two_films_of_one_camera_are_said_unless_one_is_named(one):
    film(one / "video" / "cam.mkv")
    said(one, "found cam.mkv and cam.mp4, expected one of them")
    notes(one, '[video]\ncam = "video/cam.mkv"')
    assert read_recording(one).views[0].video == one / "video/cam.mkv"


@pytest.mark.parametrize(("size", "remedy"), [
    ((64, 48), "set size to [64, 48] and multiply the matrix by 2"),
    ((24, 32), "turned by a quarter"),
    ((32, 32), "calibrate this one"),
])
@pytest.mark.parametrize("kind", ["video", "background", "masks"])
def test_pictures_of_another_size_than_the_calibration_s_are_said(one, kind, size, remedy):
    film(one / kind / "cam.mp4", size)
    if kind != "video" and size != (24, 32):
        remedy = "they must come from the same camera at the same setting as the film"
    said(one, f"{kind}/cam.mp4: found pictures of {size[0]} x {size[1]} pixels", "camera 'cam' is for 32 x 24", remedy)


@pytest.mark.parametrize(("pictures", "calibrated", "padded"), [((32, 368), (32, 360), "film"), ((32, 360), (32, 368), "calibration")])
def test_rows_that_fill_the_last_blocks_of_h264_are_no_other_scale(tmp_path, pictures, calibrated, padded):
    folder = tmp_path / "bow"
    folder.mkdir()
    camera = Camera.from_fov(calibrated, 1.0, "cam")
    write_calibration(folder / "calibration.toml", [camera])
    film(folder / "video" / "cam.mp4", pictures)
    with pytest.warns(ShadowPuppetWarning, match=rf"cam\.mp4: found .* 32 x {pictures[1]} .*; the {padded} has the padding of H\.264"):
        found = read_recording(folder).views[0].camera
    assert found.size == pictures
    np.testing.assert_allclose(found.matrix, camera.matrix)  # not scaled: points stay
    film(folder / "masks" / "cam.mp4", calibrated)  # without the padding, or with it
    with pytest.warns(ShadowPuppetWarning, match="padding"):
        read_recording(folder)
    film(folder / "masks" / "cam.mp4", (32, 376))
    with pytest.warns(ShadowPuppetWarning, match="padding"), pytest.raises(RecordingError, match=r"masks/cam\.mp4: found pictures of"):
        read_recording(folder)


def test_references_may_be_films_and_folders(one):
    film(one / "references" / "front_t_pose.mp4")
    still(one / "references" / "side_arms_hanging" / "1.png")
    found = read_recording(one).references
    assert {r.name: r.image.name for r in found} == {"front_t_pose": "front_t_pose.mp4", "side_arms_hanging": "side_arms_hanging"}


def test_unknown_postures_and_lonely_masks_are_said(one):
    path = still(one / "references" / "t_pose.png")
    said(one, "references: found t_pose; postures known: front_t_pose, side_arms_hanging, front_arms_t_pose")
    path.rename(path.with_name("front_t_pose_mask.png"))
    said(one, "found front_t_pose_mask alone, expected the picture front_t_pose beside it")


def test_films_may_lie_beside_their_calibration(tmp_path):
    (tmp_path / "lab").mkdir()
    write_calibration(tmp_path / "lab" / "calibration.toml", cameras("a", "b"))
    for name in ("a", "b"):
        film(tmp_path / "lab" / f"{name}.mp4")
    assert [view.video.name for view in read_recording(tmp_path / "lab").views] == ["a.mp4", "b.mp4"]
    assert is_recording(tmp_path / "lab")  # which `info` looks at, not at the calibration alone
    (tmp_path / "lab" / "calibration.toml").rename(tmp_path / "lab" / "Calib_own.toml")
    assert [view.camera.name for view in read_recording(tmp_path / "lab").views] == ["a", "b"]
    film(tmp_path / "lab" / "overlay.mp4")
    said(tmp_path / "lab", "found overlay, but the calibration knows no such camera")
    film(tmp_path / "lab" / "video" / "a.mp4")  # films in video/ count alone
    with pytest.warns(ShadowPuppetWarning, match="no film of b"):
        assert [view.video for view in read_recording(tmp_path / "lab").views] == [tmp_path / "lab" / "video" / "a.mp4"]


def test_what_is_no_recording_is_said(tmp_path, one):
    said(tmp_path / "nowhere", "no such recording")
    said(tmp_path, "found neither films nor video/ nor calibration.toml nor pictures")

    (one / "video" / "cam.mp4").unlink()
    said(one, "no films in it, expected <camera>.mp4 or video/<camera>.mp4")
    (one / "video" / "cam.mp4").write_bytes(b"no film")
    said(one, "cam.mp4: no film that can be read", error=VideoError)
    said(one / "calibration.toml", "calibration.toml: no ", fov=1.0, error=VideoError)
    (one / "calibration.toml").write_bytes(b"\xff")
    said(one, "no text", error=CalibrationError)

def test_the_recordings_in_a_folder_that_is_none_are_named(two):
    for n in range(4):
        (two.parent / f"day{n}" / "video").mkdir(parents=True)
    said(two.parent, "or a folder of pictures; recordings in it: day0, day1, day2 and 2 more")


@pytest.mark.shared
def test_a_run_is_no_recording(one):
    """With and without its overlay, also where its calibration lies; a recording that was tracked into its own folder is still one."""
    (one.parent / "run").mkdir()
    write_calibration(one.parent / "run" / "calibration.toml", cameras("cam"))
    (one.parent / "run" / "run.toml").write_text("complete = true\n")
    for _ in range(2):
        with pytest.raises(RecordingError, match=r"run: found a run, .*; `shadowpuppet view`, `evaluate` and `export` .*run/run\.toml"):
            read_recording(one.parent / "run")
        film(one.parent / "run" / "overlay.mp4")
    (one / "run.toml").write_text("complete = true\n")
    assert read_recording(one).views


def test_shared_recordings_are_read(shared):
    folders = sorted(p.parent for p in shared.glob("re*/*/calibration.toml") if (p.parent / "video").is_dir())
    assert folders
    for folder in folders:
        found = read_recording(folder)
        named = re.findall(r'^name = "(.*)"', (folder / "calibration.toml").read_text(), re.M)
        assert [v.camera.name for v in found.views] == named
        assert all(v.background for v in found.views)
        height = found.subject.height
        assert len(found.references) == (3 if (folder / "references").exists() else 0)
        assert height is None or math.isclose(height, 1.83)


def test_a_name_that_is_too_long_is_said():
    with pytest.raises(RecordingError, match=r"cannot be read \(file name too long\)|no such recording"):
        read_recording("a" * 300)


def test_a_file_that_is_no_film_is_said_before_its_calibration_is_read(tmp_path):
    (tmp_path / "film.mp4").write_text("no film")
    with pytest.raises(VideoError, match=r"film\.mp4: no film that can be read"):
        read_recording(tmp_path / "film.mp4", calibration=tmp_path / "nowhere.toml")


def test_a_misspelt_name_is_answered_with_the_one_that_is_there(tmp_path):
    (tmp_path / "mine.mp4").touch()
    (tmp_path / "mine.txt").touch()
    with pytest.raises(RecordingError, match=rf"or a film; did you mean {re.escape(str(tmp_path / 'mine.mp4'))}\?"):
        read_recording(tmp_path / "mine.mpv")
    with pytest.raises(RecordingError, match=r"or a film$"):
        read_recording(tmp_path / "other.mov")


def test_what_several_cameras_need_is_said_with_commands_that_can_be_pasted(tmp_path):
    lab = tmp_path / "my lab"
    (lab / "extrinsics").mkdir(parents=True)
    write_calibration(lab / "calibration.toml", cameras("a", "b"))
    with pytest.raises(RecordingError, match=r"no films in it, .*; those in extrinsics/ are of a board: put the person's into video/$"):
        read_recording(lab)
    (lab / "calibration.toml").unlink()
    for name in ("a", "b"):
        film(lab / f"{name}.mp4")
    with pytest.raises(RecordingError) as caught:
        read_recording(lab)
    for words in ("(`shadowpuppet calibrate '{}'`, docs", "(`shadowpuppet calibrate '{}' --from-person --height METRES`)"):
        assert words.format(lab) in str(caught.value)


def test_a_film_that_the_calibration_does_not_know_may_be_left_out(tmp_path):
    lab = tmp_path / "lab"
    lab.mkdir()
    write_calibration(lab / "calibration.toml", cameras("a", "b"))
    for name in ("a", "b", "c"):
        film(lab / f"{name}.mp4")
    with pytest.raises(RecordingError, match=r"lab: found c, but the calibration knows no such camera; .*--camera leaves films out"):
        read_recording(lab)
    assert [view.camera.name for view in read_recording(lab, asked=["a", "b"]).views] == ["a", "b"]
    with pytest.raises(RecordingError, match="found c, but the calibration knows no such camera"):
        read_recording(lab, asked=["a", "c"])
    assert [view.camera.name for view in open_recording(lab, make_options({"camera": "b"})).views] == ["a", "b"]


def stamped(path, times):
    with write_frames(path, 30) as writer:
        for n, time in enumerate(times):
            writer.write(np.full((24, 32), n, np.uint8), float(time))
    return path


def in_rates(folder, *rates, number=60):
    for name, rate in zip(("left", "right"), rates):
        (folder / "video" / f"{name}.mp4").unlink(missing_ok=True)
        with write_frames(folder / "video" / f"{name}.mp4", rate) as writer:
            for _ in range(number):
                writer.write(picture())
    return folder


def test_films_of_equal_numbers_and_nearly_equal_rates_are_in_step_by_number(two):
    in_rates(two, 33.0, 34.9)
    with pytest.warns(ShadowPuppetWarning, match=r"walk: the films have 60 frames each at 33 to 34.9 frames/s: they are taken to be in "
                                                 r"step by number, at 33 frames/s; if they are not, say in \[start\]"):
        found = read_recording(two)
    assert found.rate == pytest.approx(33.0)
    (two / "recording.toml").write_text("[start]\nleft = 0.0\n")
    assert read_recording(two).rate is None  # [start] says that times count


@pytest.mark.parametrize(("rates", "number"), [((30.0, 30.0), 60), ((30.0, 60.0), 60), ((30.0, 30.2), 60)])
def test_films_of_one_rate_or_of_others_keep_their_times(two, rates, number):
    assert read_recording(in_rates(two, *rates, number=number)).rate is None


def test_films_that_miss_frames_keep_their_times(two, tmp_path):
    whole, gap = np.arange(60) / 30, np.delete(np.arange(61) / 30, 20)
    for name, times in (("left", whole), ("right", gap)):
        stamped(two / "video" / f"{name}.mp4", times)
        assert is_steady(two / "video" / f"{name}.mp4") == (name == "left")
    assert open_frames(two / "video" / "right.mp4").rate < 29.6
    assert read_recording(two).rate is None


def folder_of(two, name, number):
    (two / "video" / f"{name}.mp4").unlink()
    (two / "video" / name).mkdir()
    for n in range(number):
        write_image(two / "video" / name / f"{n:03d}.png", picture())


def test_folders_of_pictures_beside_films_need_no_rate(two):
    folder_of(in_rates(two, 25.0, 25.0, number=10), "right", 10)
    assert read_recording(two).rate == 25.0  # no warning
    (two / "video" / "right" / "timestamps.txt").write_text("\n".join(str(n / 50) for n in range(10)))
    assert read_recording(two).rate is None


def test_pictures_that_are_fewer_than_the_films_frames_are_counted(two):
    folder_of(in_rates(two, 25.0, 25.0, number=10), "right", 8)
    with pytest.warns(ShadowPuppetWarning, match=r"right: found 8 pictures without timestamps.txt beside films of 10 frames: they are "
                                                 "taken at the films' 25 frames/s"):
        assert read_recording(two).rate == 25.0


def test_folders_of_pictures_alone_keep_the_assumed_rate(two):
    for name in ("left", "right"):
        folder_of(two, name, 4)
    assert read_recording(two).rate is None
