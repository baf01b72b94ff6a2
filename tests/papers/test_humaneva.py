"""HumanEva: folders made as its owners lay them out become recordings whose films, truth and training are in step."""

from __future__ import annotations

import av
import numpy as np
import pytest
from vicon import c3d

from papers.humaneva.__main__ import main
from papers.humaneva.cal import read_cal
from papers.humaneva.trials import PARTS, Sync, read_humaneva, read_sync, timing_of, write_humaneva
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, FormatError, RecordingError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.video import open_frames

MARKERS = {"PELO": "pelvis", "TRXO": "neck", "HEDO": "head",
           **{f"{side[0].upper()}{marker}": f"{side}_{joint}" for side in ("left", "right") for marker, joint in
              (("CLO", "shoulder"), ("HUO", "elbow"), ("RAO", "wrist"), ("FEP", "hip"), ("FEO", "knee"), ("TIO", "ankle"))}}
SIZE = (64, 48)
SYNCS = {"C1": Sync(82, 61, 2.0), "C2": Sync(81, 61, 2.0), "BW1": Sync(75, 49, 2.0)}
"""The films' pictures 82, 81 and 81 show the same moment."""
CUT = {"Box": (40, 90)}
"""A partition for short films."""


def camera(n: int) -> Camera:
    R = rotation_from_vector([1.2 - 0.1 * n, 0.3 * n, -0.2])
    return Camera(f"cam{n}", SIZE, np.array([[70, 0, 31.5], [0, 71, 23.5], [0, 0, 1.0]]), np.array([-0.2, 0.1, 1e-3, -2e-3, 0.01]),
                  rigid(R, [0.1 * n, 1.0, 4.0]))


def cal(of: Camera, alpha: float = 0.0) -> str:
    """A calibration as Bouguet's toolbox has it, in millimetres."""
    K, T = of.matrix, of.T_camera_world
    rows = [[K[0, 0], K[1, 1]], [K[0, 2], K[1, 2]], [alpha], of.distortion[:5].tolist(), *T[:3, :3].tolist(), (1000 * T[:3, 3]).tolist()]
    return "\n".join("  ".join(f"{value:.15e}" for value in row) for row in rows) + "\n"


def film(path, frames: int) -> None:
    """An AVI whose pictures tell their number, from 1, by their brightness."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=60)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "gray"
        for n in range(1, frames + 1):
            out.mux(stream.encode(av.VideoFrame.from_ndarray(np.full(SIZE[::-1], n, np.uint8), format="gray")))
        out.mux(stream.encode())


def places(frames: int) -> np.ndarray:
    """Markers (T, 15, 3), mm, whose x is the number of the frame of motion capture, from 1."""
    out = np.ones((frames, len(MARKERS), 3)) * np.array([1.0, 200.0, 1000.0])
    out[:, :, 0] = np.arange(1, frames + 1)[:, None]
    return out


@pytest.fixture
def data(tmp_path, monkeypatch):
    monkeypatch.setitem(PARTS, "S2", CUT)
    person = tmp_path / "HumanEva" / "S2"
    for folder in ("Calibration_Data", "Sync_Data", "Image_Data", "Mocap_Data"):
        (person / folder).mkdir(parents=True)
    for n, (name, sync) in enumerate(SYNCS.items()):
        (person / "Calibration_Data" / f"{name}.cal").write_text(cal(camera(n)))
        (person / "Sync_Data" / f"Box_1_({name}).ofs").write_text("\n".join(map(str, sync)) + "\n")
        film(person / "Image_Data" / f"Box_1_({name}).avi", 150 + n)
    markers = places(260)
    markers[150] = np.nan
    (person / "Mocap_Data" / "Box_1.c3d").write_bytes(c3d([f"Erik:{name}" for name in MARKERS], markers, trial=True))
    return person.parent


def test_films_truth_and_training_are_in_step(data, tmp_path):
    found = read_humaneva(data, "S2", "Box", 1, training_frames=30)
    write_humaneva(found, tmp_path / "rec")
    recording = read_recording(tmp_path / "rec")
    truth, training = read_joints(recording.truth), read_joints(recording.training)
    assert [view.camera.name for view in recording.views] == ["C1", "C2", "BW1"]
    assert (recording.rate, recording.duration) == (60.0, pytest.approx(35 / 60))  # frames 6 to 40
    assert truth.names == tuple(j for j in truth.names if j in ("pelvis", "neck", "head", *LIMB_JOINTS))
    assert len(truth.names) == 15
    for view in recording.views:
        seen = {round(frame.time - view.start, 6): int(frame.image.flat[0]) for frame in open_frames(view.video, grey=True, rate=60.0)}
        sync = SYNCS[view.camera.name]
        for time, mocap in zip(truth.times, 1000 * truth.positions[:, 0, 0]):
            picture = seen[round(float(time), 6)]
            assert mocap == pytest.approx(sync.mocap + (picture - sync.image) * sync.scale, abs=1e-3)
    assert np.diff(1000 * truth.positions[:, 0, 0]) == pytest.approx(2.0)
    assert len(training.times) == 30
    assert np.isfinite(training.positions).all()  # frame 151 of motion capture is a gap, so that later ones are taken
    assert 1000 * training.positions[0, 0, 0] > 1000 * truth.positions[-1, 0, 0]
    whole = read_humaneva(data, "S2", "Box", 1, "training", training_frames=0)
    assert whole.recording.duration == pytest.approx(50 / 60)
    assert len(whole.training.times) == len(whole.truth.times) == 50
    assert np.isnan(whole.truth.positions).all((1, 2)).sum() == 1


def test_numbers_by_hand():
    """C1 and C2: picture 82 and 81 with frame 61; BW1: picture 75 with 49, so 81 with 61. The first common frame is limited by mocap's."""
    timing = timing_of(SYNCS)
    assert timing.images == {"C1": 52, "C2": 51, "BW1": 51}
    assert (timing.mocap, timing.scale) == (1.0, 2.0)
    assert timing_of(SYNCS | {"BW1": Sync(75, 49.9, 2.0)}).images["BW1"] == 51  # 50.55 before it is made whole
    late = timing_of({"C1": Sync(3, 61, 2.0), "C2": Sync(10, 61, 2.0)})  # limited by C1's first picture
    assert (late.images, late.mocap) == ({"C1": 1, "C2": 8}, 57.0)


def test_cameras_are_those_of_the_calibration(data, rng):
    points = rng.normal(0, 0.5, (40, 3))
    for n, view in enumerate(read_humaneva(data, "S2", "Box", 1).recording.views):
        np.testing.assert_allclose(view.camera.project(points), camera(n).project(points), atol=1e-6)
        assert view.camera.size == SIZE


def test_a_skew_is_left_out_with_a_warning(tmp_path):
    (tmp_path / "C1.cal").write_text(cal(camera(0), 0.01))
    with pytest.warns(ShadowPuppetWarning, match=r"C1\.cal: alpha: found 0\.01, a skew, .* up to 0\.24 pixels"):
        read_cal(tmp_path / "C1.cal", "C1", SIZE)


def test_folders_of_pictures_stand_for_films_and_an_empty_scene_is_found(data, tmp_path):
    from shadowpuppet.video import write_image

    path = data / "S2" / "Image_Data" / "Box_1_(C2).avi"
    folder = path.with_suffix("")
    folder.mkdir()
    for n, frame in enumerate(open_frames(path, grey=True)):
        write_image(folder / f"{n:04}.png", frame.image)
    path.unlink()
    film(data / "Background" / "Image_Data" / "Background_1_(C2).avi", 3)
    found = read_humaneva(data, "S2", "Box", 1)
    assert [view.background is not None for view in found.recording.views] == [False, True, False]
    write_humaneva(found, tmp_path / "rec")
    assert read_recording(tmp_path / "rec").views[1].video == folder.resolve()


def test_trials_without_motion_capture_or_partition(data, tmp_path):
    person = data / "S2"
    for folder, ending in (("Sync_Data", "ofs"), ("Image_Data", "avi")):
        for name in SYNCS:
            (person / folder / f"Combo_1_({name}).{ending}").write_bytes((person / folder / f"Box_1_({name}).{ending}").read_bytes())
    found = read_humaneva(data, "S2", "Combo", 1, "all")
    assert (found.truth, found.training) == (None, None)
    assert found.recording.duration == pytest.approx(94 / 60)  # frames 6 to 99: C1's film has 150 pictures, of which 52 is the first
    write_humaneva(found, tmp_path / "rec")
    assert (read_recording(tmp_path / "rec").truth, read_recording(tmp_path / "rec").training) == (None, None)
    with pytest.raises(RecordingError, match=r"S2 Combo_1 is not divided, expected part all; divided are the first trials of S1, S2, S3"):
        read_humaneva(data, "S2", "Combo", 1)


def test_motion_capture_that_ends_too_soon_is_none(data):
    (data / "S2" / "Mocap_Data" / "Box_1.c3d").write_bytes(c3d(list(MARKERS), places(80)))
    found = read_humaneva(data, "S2", "Box", 1)
    assert found.training is None
    assert np.isfinite(found.truth.positions).all()


def test_the_command_makes_a_recording(data, tmp_path, capsys):
    assert main([str(data), "--subject", "S2", "--action", "Box", "-o", str(tmp_path / "rec"), "--training-frames", "20"]) == 0
    shown = capsys.readouterr().out
    assert "3 cameras: C1, C2, BW1, 0.58 s" in shown
    assert "35 frames of 15 joints, 100 % known" in shown
    assert len(read_joints(tmp_path / "rec" / "training.csv").times) == 20
    assert main([str(data), "--subject", "S2", "--action", "Box", "--part", "training", "-o", str(tmp_path / "rec")]) == 0
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "recording.toml").write_text("rate = 60")
    capsys.readouterr()
    assert main([str(data), "--action", "Box", "-o", str(tmp_path / "other")]) == 2
    assert "found something there that is no recording of HumanEva's" in capsys.readouterr().err


@pytest.mark.parametrize(("change", "error", "said"), [
    ({"subject": "S9"}, RecordingError, r"HumanEva: found no S9, expected one of S2"),
    ({"action": "Dance"}, RecordingError, r"Image_Data: found no film of Dance_1, expected one of Box_1"),
    ({"Sync_Data/Box_1_(C2).ofs": "1 2"}, RecordingError, r"Box_1_\(C2\)\.ofs: expected three numbers"),
    ({"Sync_Data/Box_1_(C2).ofs": "1 2 0"}, RecordingError, r"scale more than 0"),
    ({"Sync_Data/Box_1_(C2).ofs": "1 x 2"}, RecordingError, r"expected three numbers"),
    ({"Sync_Data/Box_1_(C2).ofs": None}, FormatError, r"Box_1_\(C2\)\.ofs: cannot be read"),
    ({"Sync_Data/Box_1_(C2).ofs": "1000 61 2"}, RecordingError, r"S2 Box_1: found .* frames that all films have, expected more than 6"),
    ({"Calibration_Data/C2.cal": "1 2 3"}, CalibrationError, r"C2\.cal: expected 22 numbers"),
    ({"Calibration_Data/C2.cal": "nan " * 22}, CalibrationError, r"C2\.cal: expected 22 numbers"),
    ({"Calibration_Data/C2.cal": "100 " * 22}, CalibrationError, r"C2\.cal: alpha: found 100, a skew of up to 2400 pixels"),
    ({"Calibration_Data/C2.cal": "100 100 32 24 " + "0 " * 18}, CalibrationError, r"C2\.cal: camera 'C2': rotation: found"),
    ({"Mocap_Data/Box_1.c3d": "no"}, FormatError, r"Box_1\.c3d: found no C3D header"),
])
def test_what_is_wrong_is_said(data, change, error, said):
    what = {"subject": "S2", "action": "Box"}
    for name, text in change.items():
        if name in what:
            what[name] = text
        elif text is None:
            (data / "S2" / name).unlink()
        else:
            (data / "S2" / name).write_text(text)
    with pytest.raises(error, match=said) as found:
        read_humaneva(data, **what)
    assert "\n" not in str(found.value)


def test_a_camera_without_film_is_left_out_with_a_warning(data):
    (data / "S2" / "Image_Data" / "Box_1_(C1).avi").unlink()
    with pytest.warns(ShadowPuppetWarning, match="no film of C1 for Box_1; going on with BW1, C2"):
        assert len(read_humaneva(data, "S2", "Box", 1).recording.views) == 2


def test_the_partition_is_that_of_the_paper():
    """Test frames of Ni 2008, Table I."""
    validation = {action: last - 5 for action, (last, _) in PARTS["S2"].items()}
    assert (validation["Walking"], validation["Jog"], validation["Box"]) == (433, 393, 377)


def test_sync_files_with_more_numbers(tmp_path):
    (tmp_path / "a.ofs").write_text("82\n61\n2.001\n5 6 7\n")
    assert read_sync(tmp_path / "a.ofs") == Sync(82, 61, 2.001)
    (tmp_path / "a.ofs").write_text("")
    with pytest.raises(ShadowPuppetError, match="empty"):
        read_sync(tmp_path / "a.ofs")
