"""Runs with several cameras around a tracker: files, statuses, what breaks off. The tracker here only stands where the points are."""

from __future__ import annotations

import json

import made
import made_rig
import numpy as np
import pytest
from follower import followed
from measured import evaluate_run

from shadowpuppet.errors import RecordingError, ShadowPuppetError, ShadowPuppetWarning, TrackingError
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.motion.table import read_raw
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.pipeline import frame_process
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.prepare import MULTIVIEW, look_at
from shadowpuppet.pipeline.progress import STAGES, Listener
from shadowpuppet.pipeline.rig import open_rig, read_frames
from shadowpuppet.pipeline.track import run
from shadowpuppet.video import open_frames

pytestmark = pytest.mark.usefixtures("scale_unfitted")
made_of = []


def fit(rng, survey, options) -> MultiviewSubject:
    subject = followed(survey.rig.cameras)
    made_of.append((subject.tracker, survey.first))
    return subject


def track(recording, folder, options=None, listener=None):
    options = options or Options(masks=True)
    return run(open_rig(recording, options), MULTIVIEW._replace(fit=fit), folder, options, listener or Listener())


@pytest.fixture(scope="module")
def recording(rig_recording):
    return rig_recording


@pytest.fixture(scope="module")
def whole(recording, tmp_path_factory):
    return track(recording, tmp_path_factory.mktemp("run") / "run", Options(overlay=True))


def test_a_run_has_a_row_for_every_set_at_its_time(whole):
    motion = read_run(whole.folder).motion
    assert motion.times == pytest.approx(np.arange(made_rig.FRAMES) / made_rig.RATE, abs=1e-6)
    assert set(motion.status) == {"tracked"}
    pelvis = motion.table.select(["pelvis"]).positions[:, 0]
    true = np.array([made_rig.place(n) for n in range(made_rig.FRAMES)])
    assert np.linalg.norm(pelvis - true, axis=1).max() < 0.35
    assert (motion.joint_sd > 0).all()
    assert motion.limbs == LIMBS
    assert whole.metrics["limb_status"] == motion.limb_status_counts


def test_a_run_says_how_it_was_made(recording, whole):
    info = read_run(whole.folder).info
    assert info["recording"] == str(recording.resolve())
    assert info["method"] == "after Ni 2008, 4 cameras"
    assert info["cameras"] == ["cam1", "cam2", "cam3", "cam4"]
    assert info["body"] == "anatomical"
    assert set(whole.metrics["ms_per_frame"]) == set(STAGES)
    assert whole.metrics["ms_per_frame"]["segment"] > 0
    assert "cost_px" not in whole.metrics
    assert evaluate_run(whole.folder)["cost_m2"]["count"] == made_rig.FRAMES
    look = json.loads((whole.folder / "look.json").read_text())
    assert look["person"] == {"height": 1.7}
    assert "the sizes are a guess" in [finding["words"] for finding in look["findings"]]
    assert max(look["agreement"]["apart"]) < 1.5
    assert [camera.name for camera in read_calibration(whole.folder / "calibration.toml")] == info["cameras"]


def test_the_fit_gets_the_first_seconds(recording, whole):
    _, first = made_of[-1]
    assert first.times[0] == 0
    assert len(first.masks[0]) == made_rig.CAMERAS
    assert all(mask is not None and mask.any() for row in first.masks for mask in row)


def test_an_overlay_is_a_grid_of_the_cameras(whole):
    frames = made.images(whole.folder / "overlay.mp4")
    assert len(frames) == made_rig.FRAMES
    assert frames[0].shape[1] == 2 * made_rig.SIZE[0]
    assert 2 * made_rig.SIZE[1] < frames[0].shape[0] < 3 * made_rig.SIZE[1]  # names above, words below
    film = made.images(whole.folder.parent / "run" / "overlay.mp4")[5]
    assert film.std() > 10


def test_of_so_many_sets_one_is_tracked(recording, tmp_path):
    whole, third = (track(recording, tmp_path / str(every), make_options({"masks": True, "every": every, "overlay": True}))
                    for every in (1, 3))  # fmt: skip
    assert third.motion.times == pytest.approx(whole.motion.times[::3])
    film = open_frames(third.folder / "overlay.mp4")
    assert film.rate == pytest.approx(open_frames(whole.folder / "overlay.mp4").rate / 3)


def test_a_subset_of_the_cameras_can_be_tracked(recording, tmp_path):
    summary = track(recording, tmp_path / "run", Options(masks=True, camera="cam1,cam2,cam4"))
    assert read_run(summary.folder).info["cameras"] == ["cam1", "cam2", "cam4"]


def test_a_person_who_leaves_is_absent_and_searched_for_when_they_come_back(tmp_path):
    cameras = made_rig.cameras()
    seen = made_rig.masks(cameras)
    empty = [np.zeros_like(mask) for mask in seen[0]]
    seen[10:15] = [empty] * 5
    seen[15] = [seen[15][0], *empty[1:]]  # one camera alone
    summary = track(made_rig.write(tmp_path / "r", cameras, seen), tmp_path / "run")
    assert summary.motion.status[8:17].tolist() == ["tracked"] * 2 + ["absent"] * 5 + ["lost", "tracked"]
    assert np.isnan(summary.motion.joints[10:16]).all()
    assert made_of[-1][0].calls.count("start") == 2
    assert made_of[-1][0].calls[10] == "start"


def test_nobody_at_first_is_absent(tmp_path):
    cameras = made_rig.cameras()
    seen = made_rig.masks(cameras)
    empty = [np.zeros_like(mask) for mask in seen[0]]
    seen[:3] = [empty] * 3
    assert track(made_rig.write(tmp_path / "r", cameras, seen), tmp_path / "run").motion.status[:4].tolist() == ["absent"] * 3 + ["tracked"]


def test_a_camera_that_dies_is_missing_and_the_run_goes_on(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "spoilt")
    frames = made.images(spoilt / "video" / "cam2.mp4")
    made.write_film(spoilt / "video" / "cam2.mp4", frames[:9], made_rig.RATE)
    with pytest.warns(ShadowPuppetWarning, match="goes on without camera 'cam2'") as said:
        summary = track(spoilt, tmp_path / "run", Options(overlay=True))
    assert len(summary.motion) == made_rig.FRAMES
    assert set(summary.motion.status) == {"tracked"}
    assert sum("goes on without" in str(each.message) for each in said) == 1
    last = made.images(tmp_path / "run" / "overlay.mp4")[-1]
    width, height = made_rig.SIZE
    assert last[height // 3 : 2 * height // 3, width:].std() < 3 < last[height // 3 : 2 * height // 3, :width].std()


class Stops(Listener):
    def __init__(self, frame: int, error: BaseException) -> None:
        self.frame, self.error = frame, error

    def advance(self, frames: int) -> None:
        if frames == self.frame:
            raise self.error


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ShadowPuppetError("stop")], ids=lambda e: type(e).__name__)
def test_a_run_that_breaks_off_keeps_what_it_has(recording, whole, tmp_path, error):
    with pytest.raises(type(error)):
        track(recording, tmp_path / "run", Options(overlay=True), Stops(5, error))
    left = read_run(tmp_path / "run")
    assert not left.complete
    np.testing.assert_allclose(left.motion.joints, read_raw(whole.folder / "raw.csv", "anatomical").joints[:5], rtol=0, atol=1e-6)
    assert not list((tmp_path / "run").glob("overlay*"))  # it is drawn when the films are over


def test_a_run_that_cannot_begin_leaves_no_folder(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "spoilt")
    (spoilt / "masks" / "cam3.mkv").unlink()
    with pytest.raises(RecordingError, match="no ready silhouettes"):
        track(spoilt, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_nobody_at_all_is_refused(tmp_path):
    cameras = made_rig.cameras()
    recording = made_rig.write(tmp_path / "r", cameras, [[np.zeros(made_rig.SIZE[::-1], bool)] * len(cameras)] * 12)
    with pytest.raises(TrackingError, match="camera 'cam1': the masks are empty in 100 %"):
        track(recording, tmp_path / "run")
    assert look_at(recording, Options(masks=True)).refusal is not None


def test_silhouettes_from_another_process_change_nothing(recording, whole, tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(frame_process.Task, "is_long", True)
    monkeypatch.setattr(frame_process, "usable_cores", lambda: 2)
    monkeypatch.setattr(frame_process, "_received", lambda packed, original=frame_process._received: started.append(1) or original(packed))
    other = track(recording, tmp_path / "run", Options(overlay=True))
    assert started
    assert (other.folder / "joints.csv").read_bytes() == (whole.folder / "joints.csv").read_bytes()
    drawn = [np.array(made.images(each.folder / "overlay.mp4"), int) for each in (other, whole)]
    assert np.abs(drawn[0] - drawn[1]).max() < 20  # the codec's threads


def test_a_camera_that_freezes_is_set_aside_and_named(recording, tmp_path, monkeypatch):
    def frozen(*arguments, **named):
        held = None
        for n, seen in enumerate(read_frames(*arguments, **named)):
            masks = seen.seen.masks
            held = masks[1] if n < 3 else held
            yield seen._replace(seen=seen.seen._replace(masks=(masks[0], held, *masks[2:])))

    monkeypatch.setattr("shadowpuppet.pipeline.frame_process.read_frames", frozen)
    with pytest.warns(ShadowPuppetWarning, match="left out for a time \\(camera 'cam2', frozen from"):
        done = track(recording, tmp_path / "run")
    (found,) = done.metrics["set_aside"]
    assert (found["camera"], found["why"]) == ("cam2", "frozen")
    assert found["to_s"] == pytest.approx((made_rig.FRAMES - 1) / made_rig.RATE, abs=1e-3)
