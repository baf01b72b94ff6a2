"""A calibration tested against silhouettes: what is found against what is true."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.cli.app import run
from shadowpuppet.errors import RecordingError
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.repair.films import check_calibration
from shadowpuppet.pipeline.rig import open_rig

FRAMES = 70
MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def masks(cameras):
    return made_rig.masks(cameras, FRAMES)


@pytest.fixture(scope="module")
def recording(tmp_path_factory, cameras, masks):
    return made_rig.write(tmp_path_factory.mktemp("check") / "r", cameras, masks[:50])


def checked(folder, options=MASKS):
    return check_calibration(open_rig(folder, options), options)


@pytest.mark.parametrize("options", [MASKS, Options()], ids=["exact", "from film"])
def test_an_untouched_recording_is_good(recording, options):
    found = checked(recording, options)
    assert found.good
    assert found.agreement.wrong == ()
    assert max(found.agreement.apart) < 1.6
    assert max(abs(frames) for frames in found.lateness.frames) < 0.5
    assert (found.turns, found.late, found.starts) == ({}, (), {})


@pytest.fixture
def again(recording, cameras, scale_unfitted):
    """With another calibration; as it was afterwards."""
    yield lambda changed: write_calibration(recording / "calibration.toml", changed) or recording
    write_calibration(recording / "calibration.toml", cameras)


def test_a_camera_that_was_turned_is_named_with_its_turn(again, cameras):
    found = checked(again([*cameras[:2], made_rig.moved(cameras[2], right=5), cameras[3]]))
    (doubt,) = found.doubts
    assert re.search(r"camera 'cam3' disagrees .* turned by [45]\.\d degrees \([45]\.\d ± \d\.\d to the right", doubt)
    assert doubt.endswith("--camera cam1,cam2,cam4")
    assert found.turns["cam3"].apart < 1.5
    assert found.late == ()


@pytest.mark.usefixtures("scale_unfitted")
def test_a_late_film_is_reported_with_what_mends_it(tmp_path, cameras, masks):
    folder = made_rig.write(tmp_path / "r", cameras, made_rig.shifted(masks, (0, 0, 4, 0)))
    found = checked(folder)
    assert found.late == ("cam3",)
    assert found.starts == {"cam3": pytest.approx(4 / made_rig.RATE, abs=0.03)}
    (doubt,) = found.doubts
    assert re.search(r"cam3 (3\.9|4\.0|4\.1) frames late\): put into \[start\] of recording.toml: cam3 = 0\.[34]", doubt)
    (folder / "recording.toml").write_text("start.cam3 = 0.4\n")
    assert checked(folder).good


@pytest.mark.usefixtures("scale_unfitted")
def test_turned_and_late_at_once(tmp_path, cameras, masks):
    turned = [*cameras[:2], made_rig.moved(cameras[2], down=4), cameras[3]]
    folder = made_rig.write(tmp_path / "r", turned, made_rig.shifted(masks, (0, 0, 4, 0)))
    found = checked(folder)
    assert found.late == ("cam3",)
    assert found.turns["cam3"].turn.down == pytest.approx(4, abs=0.6)
    assert len(found.doubts) == 2


def test_a_camera_that_was_carried_off_is_named_and_not_late(again, cameras):
    carried = replace(cameras[2], T_camera_world=rigid(np.eye(3), [0.4, 0, 0]) @ cameras[2].T_camera_world)
    found = checked(again([*cameras[:2], carried, cameras[3]]))
    assert found.late == ()
    assert any("camera 'cam3' disagrees" in doubt for doubt in found.doubts)


def test_swapped_films_are_reported_and_no_time_is(recording, again, cameras):
    swapped = [replace(cameras[1], name="cam1"), replace(cameras[0], name="cam2"), *cameras[2:]]
    found = checked(again(swapped))
    assert "'cam1' and 'cam2' are swapped" in found.doubts[0]
    assert found.lateness is None


@pytest.mark.parametrize(("options", "words"), [(MASKS, "the masks of no two cameras show a person"),
                                                (Options(), "no two cameras see a person.*do the films belong")])  # fmt: skip
def test_nobody_is_said_of_masks_and_of_films(tmp_path, cameras, options, words):
    folder = made_rig.write(tmp_path / "r", cameras, [[np.zeros(camera.size[::-1], bool) for camera in cameras]] * 4)
    with pytest.raises(RecordingError, match=words):
        checked(folder, options)


def test_check_as_a_user_types_it(recording, again, cameras, capsys, tmp_path):
    assert run(["check", str(recording), "--masks"]) == 0
    out = capsys.readouterr().out
    assert "all cameras agree" in out
    assert out.count(" frames") >= 4
    again([*cameras[:2], made_rig.moved(cameras[2], right=5), cameras[3]])
    assert run(["check", str(recording), "--masks", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["agreement"]["names"] == ["cam1", "cam2", "cam3", "cam4"]
    assert "cam3" in told["turns"]
    assert run(["check", str(tmp_path / "nowhere")]) == 2
    assert "no such recording" in capsys.readouterr().err
    assert run(["check", str(recording / "calibration.toml")]) == 2
    assert "is a calibration, expected a recording with films" in capsys.readouterr().err
    assert run(["check", str(next(path for path in (recording / "video").iterdir()))]) == 2
    assert "found one film, expected the folder of a recording of two cameras or more" in " ".join(capsys.readouterr().err.split())
    assert run(["check", str(recording), "--camera", "cam1"]) == 2
    assert "found one camera, expected two or more" in capsys.readouterr().err
