"""The look at several cameras: what is told of each, doubts with remedies, refusals; as Python and as the command line have it."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import made
import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.agreement import SETS_COMPARED
from shadowpuppet.camera.mask import Seen
from shadowpuppet.cli.app import run
from shadowpuppet.errors import HARMFUL, NOTED, TrackingError
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.pipeline.findings.look import FirstSeconds, RigLook
from shadowpuppet.pipeline.findings.opening import opening_of
from shadowpuppet.pipeline.findings.rig import _agreement_of_one, _rig_doubts, survey_rig
from shadowpuppet.pipeline.footage import RUN, RUN_OF_SEVERAL, RUNS, RUNS_OF_SEVERAL, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import MULTIVIEW, look_at, prepare
from shadowpuppet.pipeline.progress import Listener, Steps, json_text
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.track import track_recording

pytestmark = pytest.mark.usefixtures("scale_unfitted")
MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def recording(rig_recording):
    return rig_recording


def looked(path, options=MASKS) -> RigLook:
    look = look_at(path, options)
    assert isinstance(look, RigLook)
    return look


def test_a_look_tells_of_every_camera(recording):
    look, cameras = looked(recording, Options()), made_rig.cameras()
    assert [camera.name for camera in look.cameras] == [camera.name for camera in cameras]
    for told, camera in zip(look.cameras, cameras):
        assert told.place == pytest.approx(camera.centre, abs=1e-6)
        assert told.size == told.worked_size == made_rig.SIZE
        assert told.rate == pytest.approx(made_rig.RATE)
        assert told.exact_overlap > 0.9
        assert told.background == f"background/{camera.name}.mp4"
    assert look.frames == made_rig.FRAMES
    assert look.refusal is None
    assert max(look.agreement.apart) < 1.6
    assert not look.agreement.wrong


def test_a_look_is_plain(recording):
    told = json.loads(json_text(looked(recording)))
    assert told["agreement"]["names"] == ["cam1", "cam2", "cam3", "cam4"]
    assert told["cameras"][0]["quality"]["empty"] == 0


def test_each_step_is_named_with_its_camera(recording):
    class Told(Listener):
        def __init__(self) -> None:
            self.told = list[str]()

        def begin(self, what: str, total: int | None = None) -> None:
            self.told.append(what)

    listener = Told()
    survey_rig(open_rig(recording, Options()), Options(), listener=listener)
    for camera in ("cam1", "cam2", "cam3", "cam4"):
        for step in ("reading the film", "learning the scene", "judging masks"):
            assert any(re.search(f"{camera}(, cam.)*: {step}", told) for told in listener.told)
    assert listener.told[-1] == "looking: do the cameras agree"
    assert all(told.startswith("looking") for told in listener.told)
    assert any(told.startswith("looking, 3/4 films: cam") for told in listener.told)


def test_a_step_of_many_cameras_is_a_short_line():
    class Told(Listener):
        def begin(self, what: str, total: int | None = None) -> None:
            self.last = what

    listener, names = Told(), [f"cam0{n}" for n in range(1, 8)]
    steps = Steps(listener, names)
    for name in names[:3]:
        steps("recovering the scene", name)
    assert listener.last == "looking, 0/7 films: cam01, cam02, cam03: recovering the scene"
    steps("reading the film", names[3])
    steps("", names[0])
    assert listener.last == "looking, 1/7 films: cam02, cam03: recovering the scene; cam04: reading the film"
    for name in names:
        steps("judging masks", name)
    assert listener.last == "looking, 0/7 films: 7 cameras: judging masks"
    steps("counting people in all films")
    assert listener.last == "looking: counting people in all films"


def test_the_opening_is_spread_over_the_first_seconds(recording):
    opening = survey_rig(open_rig(recording, MASKS), MASKS).first
    assert opening.times[0] == 0
    assert opening.times[-1] > 1.5
    assert len(opening.times) == len(opening.masks) <= 40


def test_a_look_makes_few_silhouettes_of_the_opening(recording, monkeypatch):
    made_ones = list[float]()

    def segmented(silhouettes, frame):
        made_ones.append(frame.time)
        return as_before(silhouettes, frame)

    as_before = Silhouettes.segmented
    survey = survey_rig(open_rig(recording, Options()), Options())
    monkeypatch.setattr(Silhouettes, "segmented", segmented)
    first = survey.first.masks
    assert len(list(first)) > SETS_COMPARED
    assert len(made_ones) == made_rig.CAMERAS * (len(first) - SETS_COMPARED)


def test_each_of_several_cameras_needs_fewer_frames_and_a_few_of_the_empty_scene(spoilt):
    shutil.rmtree(spoilt / "masks")
    for kind in ("video", "background"):
        pictures = [np.full((*made_rig.SIZE[::-1], 3), 3 * n, np.uint8) for n in range(60)]
        made.write_film(spoilt / kind / "cam1.mp4", pictures, made_rig.RATE)
    rig = open_rig(spoilt, Options())
    footage, count = rig.footage[0], RUNS_OF_SEVERAL * RUN_OF_SEVERAL
    assert len(take_sample(footage, opening=opening_of(rig)).frames) == count
    assert len(take_sample(footage).frames) == RUNS * RUN
    assert len(list(footage.empty_scene())) == count
    alone = replace(footage, recording=replace(footage.recording, views=footage.recording.views[:1]))
    assert len(list(alone.empty_scene())) == 60


def cut(look: RigLook, **shares: dict[str, float]) -> RigLook:
    """The look, with shares of frames in which the person touches a side, by camera."""
    def of(camera):
        return replace(camera, quality=replace(camera.quality, border=camera.quality.border | shares.get(camera.name, {})))

    return replace(look, cameras=tuple(map(of, look.cameras)))


def test_who_is_cut_off_in_one_picture_but_whole_in_three_others_is_no_doubt(recording):
    look = looked(recording)
    (one,) = [doubt for doubt in _rig_doubts(cut(look, cam2={"left": 0.3})) if "person is cut off" in doubt.short]
    assert (one.short, one.severity) == ("camera 'cam2': person is cut off at the left: step back", NOTED)
    both = [doubt for doubt in _rig_doubts(cut(look, cam2={"left": 0.3}, cam4={"top": 0.1})) if "person is cut off" in doubt.short]
    assert [doubt.severity for doubt in both] == [HARMFUL, HARMFUL]


def test_feet_that_too_few_cameras_show_are_a_doubt(recording):
    look = looked(recording)
    assert not [doubt for doubt in _rig_doubts(look) if "feet" in doubt.short]
    (some,) = [doubt for doubt in _rig_doubts(cut(look, cam1={"bottom": 0.9}, cam2={"bottom": 0.2})) if "feet" in doubt.short]
    assert (some.short, some.severity) == ("feet cut off in 'cam1' and 'cam2': step back or tilt", NOTED)
    assert "camera 'cam1' in 90 % of the frames, camera 'cam2' in 20 %" in some
    three = {f"cam{n}": {"bottom": 0.6} for n in (1, 2, 3)}
    (most,) = [doubt for doubt in _rig_doubts(cut(look, **three)) if "feet" in doubt.short]
    assert (most.short, most.severity) == ("feet cut off in 3 cameras: step back or tilt", HARMFUL)
    assert not [doubt for doubt in _rig_doubts(cut(look, **three), several=True) if "feet" in doubt.short]


def test_films_of_other_rates_and_lengths_are_doubted(spoilt):
    frames = made.images(spoilt / "video" / "cam2.mp4")
    made.write_film(spoilt / "video" / "cam2.mp4", frames[::2], made_rig.RATE / 2)
    for kind in ("masks", "background"):
        (spoilt / kind / "cam2.mkv").unlink(missing_ok=True)
    (doubt,) = [d for d in looked(spoilt, Options()).findings if "rates" in d]
    assert "cam2 5" in doubt
    assert doubt.short == "camera 'cam2' is of another frame rate: film at one"
    made.write_film(spoilt / "video" / "cam2.mp4", frames[:15], made_rig.RATE)
    (doubt,) = [d for d in looked(spoilt, Options()).doubts if "lengths" in d]
    assert "cam2 1.50" in doubt
    assert "[start] of recording.toml" in doubt
    (spoilt / "recording.toml").write_text("[start]\ncam2 = 0.2\n", encoding="utf-8")
    assert not [d for d in looked(spoilt, Options()).doubts if "lengths" in d]  # it has been said when each began


def test_swapped_films_are_reported(spoilt):
    for kind, end in (("video", "mp4"), ("masks", "mkv"), ("background", "mp4")):
        a, b = (spoilt / kind / f"{name}.{end}" for name in ("cam1", "cam2"))
        shutil.move(a, spoilt / "x")
        shutil.move(b, a)
        shutil.move(spoilt / "x", b)
    assert any("cameras 'cam1' and 'cam2' are swapped" in doubt for doubt in looked(spoilt).doubts)


@pytest.mark.whole
def test_without_an_empty_scene_the_silhouettes_may_be_why_cameras_do_not_fit_together(spoilt):
    def turned(degrees, camera):
        a = np.radians(degrees)
        turn = rigid([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]], np.zeros(3))
        return replace(camera, T_camera_world=turn @ camera.T_camera_world)

    write_calibration(spoilt / "calibration.toml", list(map(turned, (5, -5, 9, -9), made_rig.cameras())))
    assert "cameras and calibration do not fit: calibrate again" in {doubt.short for doubt in looked(spoilt).findings}
    shutil.rmtree(spoilt / "background")
    said = {doubt.short for doubt in looked(spoilt, Options()).findings}
    assert "silhouettes do not fit together: film the empty scene, or calibrate" in said


def test_what_the_look_found_is_shown_where_nobody_can_be_measured(recording):
    def unmeasured(*_):
        raise TrackingError("nobody")

    class Shown(Listener):
        looks: ClassVar[list[RigLook]] = []

        def look(self, look):
            self.looks.append(look)

    with pytest.raises(TrackingError, match="nobody"):
        prepare(np.random.default_rng(0), open_rig(recording, MASKS), MASKS, MULTIVIEW._replace(fit=unmeasured), listener=Shown())
    assert Shown.looks == [looked(recording)]


def test_a_calibration_in_millimetres_is_refused_as_it_is_read(spoilt, capsys):
    write_calibration(spoilt / "calibration.toml", [made_rig.scaled(camera, 1000) for camera in made_rig.cameras()])
    assert run(["info", str(spoilt), "--masks"]) == 2
    shown = capsys.readouterr()
    assert "millimetres" in shown.err
    assert "Traceback" not in shown.err


def test_a_calibration_in_feet_is_doubted(spoilt):
    write_calibration(spoilt / "calibration.toml", [made_rig.scaled(camera, 3.28) for camera in made_rig.cameras()])
    assert any("is it in metres?" in doubt for doubt in looked(spoilt).doubts)


@pytest.mark.whole
def test_a_camera_that_was_turned_is_named_on_the_command_line(spoilt, capsys):
    cameras = made_rig.cameras()
    a = np.radians(5)
    turn = rigid([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]], np.zeros(3))
    cameras[2] = replace(cameras[2], T_camera_world=turn @ cameras[2].T_camera_world)
    write_calibration(spoilt / "calibration.toml", cameras)
    assert run(["info", str(spoilt), "--masks"]) == 0
    brief = capsys.readouterr()
    assert " ".join(brief.out.split()).startswith("verdict on the films doubtful because camera 'cam3' disagrees: calibrate again, or "
                                                  "--camera cam1,cam2,cam4 ")
    assert run(["info", str(spoilt), "--masks", "--verbose"]) == 0
    shown = capsys.readouterr()
    assert "camera 'cam3' disagrees with the others by" in shown.err
    assert "--camera cam1,cam2,cam4" in shown.err
    assert shown.out.count(" px") == 4


@pytest.mark.parametrize(("several", "empty"), [(True, False), (True, True), (False, False)])
def test_several_people_of_a_project_of_which_one_is_found_need_an_empty_scene(spoilt, several, empty):
    if not empty:
        shutil.rmtree(spoilt / "background")
    rig = open_rig(spoilt, Options())
    recording = replace(rig.recording, several=several)
    rig = replace(rig, recording=recording, footage=tuple(replace(footage, recording=recording) for footage in rig.footage))
    refusal = survey_rig(rig, Options()).look.refusal or ""
    assert ("multi_person = true in Config.toml" in refusal) == (several and not empty)


def test_nobody_at_the_same_time_is_refused_before_the_run(tmp_path):
    cameras = made_rig.cameras(3)
    seen = made_rig.masks(cameras, 12)
    seen = [[mask if k == n % 3 else np.zeros_like(mask) for k, mask in enumerate(row)] for n, row in enumerate(seen)]
    recording = made_rig.write(tmp_path / "r", cameras, seen)
    assert "the masks of no two cameras show a person at the same time" in looked(recording).refusal
    with pytest.raises(TrackingError, match="no two cameras"):
        track_recording(recording, tmp_path / "run", MASKS)
    assert not (tmp_path / "run").exists()


def test_the_look_as_json_on_the_command_line(recording, capsys):
    assert run(["info", str(recording), "--masks", "--json", "--camera", "cam1,cam3"]) == 0
    assert [camera["name"] for camera in json.loads(capsys.readouterr().out)["cameras"]] == ["cam1", "cam3"]


def test_an_unknown_camera_is_a_users_mistake(recording, capsys):
    assert run(["info", str(recording), "--camera", "cam1,cam8"]) == 2
    assert "expected one of cam1, cam2, cam3, cam4" in capsys.readouterr().err


def test_a_cable_before_one_camera_accuses_none(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "cable")
    name = made_rig.cameras()[1].name
    images = [image.copy() for image in made.images(spoilt / "masks" / f"{name}.mkv")]
    for image in images:
        image[:, 30:32] = 255
    made.write_film(spoilt / "masks" / f"{name}.mkv", images, lossless=True)
    assert looked(spoilt).agreement.wrong == ()


def test_a_camera_that_shows_a_part_of_the_person_at_first_is_not_to_blame():
    cameras = made_rig.cameras()
    whole = made_rig.masks(cameras, SETS_COMPARED)
    cut_off = [[*row[:1], row[1] & (np.arange(len(row[1]))[:, None] < len(row[1]) // 2), *row[2:]] for row in whole]
    rig, first = SimpleNamespace(cameras=cameras), FirstSeconds([0.1 * n for n in range(len(whole))], list(map(tuple, cut_off)))
    wrong = (cameras[1].name,)
    assert _agreement_of_one(rig, first).wrong == wrong
    assert _agreement_of_one(rig, first, [Seen(tuple(row)) for row in whole]).wrong == ()
    assert _agreement_of_one(rig, first, [Seen(tuple(row)) for row in cut_off]).wrong == wrong
