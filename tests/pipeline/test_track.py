from __future__ import annotations

import json
import tracemalloc
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import made
import numpy as np
import pytest

from shadowpuppet.body.models import make_body
from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, ShadowPuppetWarning, SilhouetteError
from shadowpuppet.evaluation.interval_coverage import rank_histogram
from shadowpuppet.geometry import align
from shadowpuppet.io.intervals import read_intervals
from shadowpuppet.io.motion.table import read_joints, read_raw
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.metrics import jitter, overlap
from shadowpuppet.pipeline.footage import RUN, RUNS, CameraFrame, open_footage, take_sample
from shadowpuppet.pipeline.options import Options, make_options, plain_options, read_options
from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.pipeline.prepare import MONOCULAR, MULTIVIEW, fit_person, look_at
from shadowpuppet.pipeline.progress import StageTimer
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.pipeline.silhouettes import learn_silhouettes, read_masks
from shadowpuppet.pipeline.track import Listener, json_text, track_recording
from shadowpuppet.pipeline.track import run as track_run
from shadowpuppet.video import open_frames

JOINTS = {"pelvis", "neck", "head", *(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist", "hand"))}

QUICK = {"tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}}
"""For tests of what does not depend on how well it is done."""


@pytest.fixture(scope="module")
def run(recording, tmp_path_factory):
    return track_recording(recording, tmp_path_factory.mktemp("run") / "run", Options(overlay=True))


def test_most_true_positions_are_within_the_intervals_and_few_wrong_joints_are_vouched_for(recording, run):
    motion, truth = run.motion, read_joints(recording / "truth.csv")
    names = [name for name in motion.joint_names if name in truth.names]
    own, theirs = ([of.index(name) for name in names] for of in (motion.joint_names, truth.names))
    off = motion.joints[:, own] - truth.positions[: len(motion)][:, theirs]
    assert 0.8 < np.mean(np.abs(off) < 1.645 * motion.joint_sd[:, own]) <= 1
    tails = rank_histogram(-off.ravel(), motion.joint_sd[:, own].ravel(), bins=20)[[0, -1]]
    assert tails.max() < 0.2, "more than one true position in five is in the lowest or highest twentieth of what is stated for it"
    vouched = motion.limb_status[:, [motion.limbs.index(limb_of(name)) for name in names]] == "tracked"
    assert np.mean(vouched & (np.linalg.norm(off, axis=2) > 0.3)) < 0.01
    assert vouched.mean() > 0.3


def test_a_film_is_also_tracked_backward_where_the_run_is_smoothed(recording, tmp_path, monkeypatch):
    """raw.csv has the forward pass; the backward pass changes joints and statements of doubt, and nothing where it is off."""
    def tracked(name, **values):
        phases, options = [], make_options(QUICK | values)
        listener = Listener()
        listener.begin = lambda what, total=None: phases.append(what)
        summary = track_recording(recording, tmp_path / name, options, listener)
        return summary, phases

    both, phases = tracked("both")
    assert phases[-2:] == ["tracking backward", "smoothing"]
    assert both.metrics["backward_s"] > 0
    once, phases = tracked("once", tracker={**QUICK["tracker"], "both_ways": False})
    assert "tracking backward" not in phases
    assert (both.folder / "raw.csv").read_bytes() == (once.folder / "raw.csv").read_bytes()
    assert np.abs(both.motion.joints - once.motion.joints).max() > 0.005
    assert np.abs(both.motion.joint_sd - once.motion.joint_sd).max() > 0.005
    off, phases = tracked("off", smooth="off")
    assert "tracking backward" not in phases
    np.testing.assert_allclose(off.motion.joints, read_raw(once.folder / "raw.csv", "rounded").joints, atol=1e-5)
    monkeypatch.setattr("shadowpuppet.pipeline.track.MaskStore", partial(MaskStore, 1000))
    long, _ = tracked("long")
    assert (long.folder / "joints.csv").read_bytes() == (once.folder / "joints.csv").read_bytes()  # too many silhouettes to be kept


def test_backward_the_arms_colours_are_known_from_the_start(recording, tmp_path, monkeypatch):
    """All that was seen forward, and of the film's pictures, not only of those since the tracker turned back."""
    known = []

    def backward(writer, subject, options, listener, store):
        known.append((subject.colours, list(store)))
        return writer.motion

    monkeypatch.setattr("shadowpuppet.pipeline.track.backward", backward)
    track_recording(recording, tmp_path / "run", make_options(QUICK))
    ((colours, sets),) = known
    assert colours.rest.sum() > 0
    assert all(frames.seen.codes[0][frames.seen.masks[0]].any() for frames in sets)
    track_recording(recording, tmp_path / "run", make_options(QUICK | {"tracker": {**QUICK["tracker"], "arm_colours": False}}))
    assert known[1][0] is None


class Stops(Listener):
    """Breaks a run off at a frame."""

    def __init__(self, frame: int, error: BaseException) -> None:
        self.frame, self.error = frame, error

    def advance(self, frames: int) -> None:
        if frames == self.frame:
            raise self.error


def test_a_run_has_a_row_for_every_frame_at_its_time(recording, run):
    times = [frame.time for frame in open_frames(recording / "video" / "cam.mp4")]
    motion = read_run(run.folder).motion
    assert motion.times == pytest.approx(times, abs=1e-6)
    assert set(motion.joint_names) == JOINTS
    assert np.isfinite(motion.joints).all()
    assert "" not in (run.folder / "joints.csv").read_text().splitlines()[1].split(",")


def test_every_joint_has_an_interval_and_every_limb_a_status(run):
    motion, found = read_run(run.folder).motion, read_intervals(run.folder / "intervals.csv")
    assert ((motion.joint_sd > 0) & (motion.joint_sd < 1)).all()
    assert (motion.pose_sd > 0).all()
    assert found.names == motion.joint_names
    np.testing.assert_allclose((found.high - found.low) / 2, 1.645 * motion.joint_sd, atol=2e-6)
    np.testing.assert_allclose((found.high + found.low) / 2, motion.joints, atol=2e-6)
    assert motion.limbs == ("trunk", "left_arm", "right_arm")
    assert run.metrics["limb_status"] == motion.limb_status_counts
    assert sum(run.metrics["limb_status"]["left_arm"].values()) == len(motion)


def test_joints_are_in_the_world_of_the_calibration(recording, run):
    """Up is Z, the person stands at the origin and faces -Y: the left hand is on the +X side when the arms are to the sides."""
    table, truth = run.motion.table, read_joints(recording / "truth.csv")
    names = ["neck", "left_shoulder", "right_shoulder", "pelvis"]
    found, true = table.select(names).positions.mean(0), truth.select(names).positions.mean(0)
    assert np.abs(found - true)[:3].max() < 0.12
    assert np.abs(found - true)[3].max() < 0.2  # a trunk that the picture cuts hardly tells where it ends
    assert run.metrics["errors"]["plane_mm"] < 150


def test_a_run_says_how_it_was_made(recording, run):
    info = read_run(run.folder).info
    assert info["recording"] == str(recording.resolve())
    assert info["truth"] == str(recording / "truth.csv")
    options = make_options(read_options(run.folder / "run.toml"))
    assert options == Options(overlay=True)
    assert options.initialization.rounds == Options().initialization.rounds


def test_sizes_camera_look_and_times_lie_beside(recording, run):
    person = read_person(run.folder / "person.toml")
    assert person.source == "references"
    assert person.height == pytest.approx(made.SPEC.body.stature, abs=1e-3)
    look = json.loads((run.folder / "look.json").read_text())
    assert look["person"]["sizes"] == pytest.approx(dict(zip(person.sizes.names(), person.sizes.to_array())))
    metrics = json.loads((run.folder / "metrics.json").read_text())
    assert metrics["complete"]
    assert set(metrics["ms_per_frame"]) == {"decode", "segment", "track", "doubt", "write"}
    assert metrics["frames_per_s"] > 0
    assert metrics["errors"]["frames"] == len(run.motion)
    assert (run.folder / "calibration.toml").exists()


def test_a_look_says_beforehand_what_the_run_s_says(recording, run):
    assert json_text(run.look) == json_text(look_at(recording))


def test_an_overlay_has_a_frame_for_each_of_the_film(recording, run):
    overlay = made.images(run.folder / "overlay.mp4")
    assert len(overlay) == len(run.motion)
    assert overlay[0].shape[1:] == (made.SIZE[0], 3)
    below = np.array(overlay)[:, 3 * made.SIZE[1] :]
    assert below.max((1, 2, 3)).min() > 100, "legend and status stand below"
    assert (np.abs(np.diff(below.astype(int), axis=0)).max((1, 2, 3)) > 60).all(), "each frame has its time"
    bottom, film = overlay[10][2 * made.SIZE[1] : 3 * made.SIZE[1]], made.images(recording / "video" / "cam.mp4")[10]
    assert np.abs(bottom.astype(int) - film).mean() < 20


@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("a bug")], ids=lambda e: type(e).__name__)
def test_a_run_that_breaks_off_keeps_what_it_has(recording, run, tmp_path, error):
    with pytest.raises(type(error)):
        track_recording(recording, tmp_path / "run", Options(overlay=True), Stops(5, error))
    left = read_run(tmp_path / "run")
    assert not left.complete
    assert len(left.motion) == 5
    # Causal: what was found does not depend on how long the film goes on.
    np.testing.assert_allclose(left.motion.joints, read_raw(run.folder / "raw.csv", "rounded").joints[:5], rtol=0, atol=1e-6)
    assert not (left.folder / "raw.csv").exists()
    assert "smoothing" not in left.info
    assert left.metrics["ms_per_frame"]["track"] > 0
    assert not list((tmp_path / "run").glob("overlay*"))  # it is drawn when the film is over


def test_an_overlay_shows_the_motion_that_is_written(recording, tmp_path, monkeypatch):
    drawn, draw = [], MonocularSubject.draw

    def noted(self, frames, found, last=None):
        drawn.append((frames.time, found))
        return draw(self, frames, found, last)

    monkeypatch.setattr(MonocularSubject, "draw", noted)
    run = track_recording(recording, tmp_path / "run", make_options(QUICK | {"overlay": True}))
    assert len(drawn) == len(run.motion)
    np.testing.assert_array_equal([time for time, _ in drawn], run.motion.times)
    np.testing.assert_array_equal([found.pose for _, found in drawn], run.motion.poses)
    assert not np.array_equal(run.motion.joints, read_raw(run.folder / "raw.csv", "rounded").joints)


def test_silhouettes_that_were_too_many_to_be_kept_are_made_again_for_an_overlay(recording, run, tmp_path, monkeypatch):
    monkeypatch.setattr(MaskStore, "add", lambda *_: None)
    other = track_recording(recording, tmp_path / "run", make_options({"overlay": True, "tracker": {"both_ways": False}}))
    assert len(made.images(other.folder / "overlay.mp4")) == len(other.motion)
    ours, theirs = (made.images(each.folder / "overlay.mp4")[10].astype(int) for each in (other, run))
    assert np.abs(ours - theirs).mean() < 10


def test_a_run_that_never_began_leaves_the_last_one(recording, run, tmp_path):
    made.copied(run.folder, tmp_path / "run")
    with pytest.raises(ShadowPuppetError, match="no such recording"):
        track_recording(tmp_path / "nowhere", tmp_path / "run")
    assert len(read_run(tmp_path / "run").motion) == len(run.motion)
    with pytest.raises(ShadowPuppetError, match="no such recording"):
        track_recording(tmp_path / "nowhere", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_folder_that_is_no_run_is_refused_before_anything_is_done(recording, tmp_path):
    (tmp_path / "thesis.tex").touch()
    looked = Stops(0, AssertionError())
    looked.begin = lambda what, total=None: pytest.fail(what)
    with pytest.raises(ShadowPuppetError, match=r"found thesis.tex in it but no run.toml"):
        track_recording(recording, tmp_path, None, looked)


def test_frames_before_the_person_and_without_them_are_absent(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "late")
    masks = made.images(recording / "masks" / "cam.mkv")
    for n in (0, 1, 2, 15, 16):
        masks[n] = np.zeros_like(masks[n])
    made.write_film(spoilt / "masks" / "cam.mkv", masks, lossless=True)
    result = track_recording(spoilt, tmp_path / "run", make_options(QUICK | {"masks": True, "overlay": True, "gaps": 0}))
    absent = np.isin(np.arange(len(masks)), (0, 1, 2, 15, 16))
    np.testing.assert_array_equal(result.motion.status == "absent", absent)
    np.testing.assert_array_equal(np.isnan(result.motion.joints).all((1, 2)), absent)
    assert any("the silhouette is empty in" in doubt for doubt in result.look.doubts)
    for n, shown in enumerate(made.images(result.folder / "overlay.mp4")):
        height = made.SIZE[1]
        assert (shown[height + 4 : 2 * height - 4].max() < 60) == absent[n]  # nothing is drawn of who is not there


def test_a_run_that_lost_the_person_says_so(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "lost")
    masks = made.images(recording / "masks" / "cam.mkv")
    for n in range(10, 20):
        masks[n] = np.zeros_like(masks[n])
        masks[n][::4] = 255  # stripes all over
    made.write_film(spoilt / "masks" / "cam.mkv", masks, lossless=True)
    with pytest.warns(ShadowPuppetWarning, match=r"the person is lost in \d+ % of the frames, first at 1.\d\d s"):
        result = track_recording(spoilt, tmp_path / "run", make_options(QUICK | {"masks": True}))
    assert np.isnan(result.motion.joints[result.motion.status == "lost"]).all()
    assert (result.motion.status[:10] == "tracked").all()


def test_masks_that_end_early_are_said(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "short")
    made.write_film(spoilt / "masks" / "cam.mkv", made.images(recording / "masks" / "cam.mkv")[:20], lossless=True)
    with pytest.raises(SilhouetteError, match=r"masks/cam.mkv: found 20 silhouettes, expected one for each frame of .*cam.mp4"):
        track_recording(spoilt, tmp_path / "run", Options(masks=True))


def test_of_so_many_frames_one_is_tracked(recording, run, tmp_path):
    said = []

    class Told(Listener):
        def begin(self, what: str, total: int | None = None) -> None:
            said.append((what, total))

    third = track_recording(recording, tmp_path / "run", make_options(QUICK | {"every": 3, "overlay": True}), Told())
    times = [frame.time for frame in open_frames(recording / "video" / "cam.mp4")]
    assert third.motion.times == pytest.approx(times[::3], abs=1e-6)
    number = len(third.motion)
    assert said[-4:] == [("tracking", number), ("tracking backward", number), ("smoothing", None), ("drawing", number)]
    assert open_frames(third.folder / "overlay.mp4").rate == pytest.approx(open_frames(run.folder / "overlay.mp4").rate / 3)


def test_ready_masks_are_used_only_when_asked_for(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "spoilt")
    masks = made.images(recording / "masks" / "cam.mkv")
    made.write_film(spoilt / "masks" / "cam.mkv", [np.zeros_like(mask) for mask in masks], lossless=True)
    assert open_footage(spoilt, Options()).view.masks is not None
    seen = learn_silhouettes(*_sampled(spoilt, Options()))
    shots = list(open_footage(spoilt, Options()).frames(ready=True))
    assert seen(shots[5]).mean() > 0.05
    ready = learn_silhouettes(*_sampled(spoilt, Options(masks=True)))
    assert not ready(shots[5]).any()


@pytest.mark.parametrize("options", [Options(), Options(masks=True)])
def test_the_masks_that_are_read_are_those_that_are_tracked(recording, options):
    footage, sample, _ = _sampled(recording, options)
    seen, read = learn_silhouettes(footage, sample, options), list(read_masks(footage, options))
    assert len(read) == footage.count
    for mask, shot in zip(read, footage.frames(ready=options.masks)):
        np.testing.assert_array_equal(mask, seen(shot))


def _sampled(recording, options):
    footage = open_footage(recording, options)
    return footage, take_sample(footage, options.masks), options


def test_larger_frames_are_scaled_and_joints_stay_where_they_are(recording, run, tmp_path):
    small = track_recording(recording, tmp_path / "run", Options(max_size=100))
    assert small.look.worked_size == (100, 75)
    assert small.look.size == made.SIZE
    shoulders = ["left_shoulder", "right_shoulder", "neck"]
    apart = np.abs(small.motion.table.select(shoulders).positions - run.motion.table.select(shoulders).positions)
    assert np.median(apart) < 0.06


def test_what_is_outside_the_region_is_background(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "intruder")
    film = made.images(recording / "video" / "cam.mp4")
    for image in film:
        image[5:115, 100:158] = (40, 200, 40)  # larger than the person, and at the arm's end
    made.write_film(spoilt / "video" / "cam.mp4", film)
    options = make_options({"region": "0,0,98,120"})
    footage, sample, _ = _sampled(spoilt, options)
    seen, clean = learn_silhouettes(footage, sample, options), learn_silhouettes(*_sampled(recording, Options()))
    for n in (0, 12, 20):
        mask, right = seen(CameraFrame(0, film[n], None)), clean(CameraFrame(0, made.images(recording / "video" / "cam.mp4")[n], None))
        right[:, 98:] = False
        assert not mask[:, 98:].any()
        assert overlap(mask, right) > 0.9


def test_ready_masks_are_cut_to_the_region(recording):
    options = make_options({"region": "0,0,80,120", "masks": True})
    seen, whole = learn_silhouettes(*_sampled(recording, options)), learn_silhouettes(*_sampled(recording, Options(masks=True)))
    shot = next(open_footage(recording, options).frames(ready=True))
    assert whole(shot)[:, 80:].any()
    assert not seen(shot)[:, 80:].any()
    np.testing.assert_array_equal(seen(shot)[:, :80], whole(shot)[:, :80])


def test_a_region_is_reported_in_pixels_of_the_film(recording):
    footage = open_footage(recording, Options(max_size=80, region=(40, 20, 120, 100)))
    assert footage.region == (slice(10, 50), slice(20, 60))


def test_a_persons_sizes_are_used_again(recording, run, tmp_path):
    alone = made.copied(recording, tmp_path / "alone", without=["references"])
    options = make_options(QUICK | {"person": str(run.folder / "person.toml")})
    again = track_recording(alone, tmp_path / "run", options)
    before, after = (read_person(folder / "person.toml") for folder in (run.folder, again.folder))
    assert after.sizes == before.sizes
    assert after.source == str(run.folder / "person.toml")


def test_without_references_sizes_come_from_proportions(recording, tmp_path):
    alone = made.copied(recording, tmp_path / "alone", without=["references"])
    found, look = fit_person(alone, tmp_path / "person.toml")
    assert found.person.source.startswith("proportions")
    assert look.person is not None
    assert found.summary["start_overlap"] > 0.8
    person = read_person(tmp_path / "person.toml")
    assert 0.2 < person.sizes.upper_arm_length < 0.36


def test_a_film_of_a_posture_serves_as_its_reference(recording, tmp_path):
    filmed = made.copied(recording, tmp_path / "filmed")
    for name in ("front_t_pose", "front_arms_t_pose"):
        [image] = made.images(recording / "references" / f"{name}.png")
        empty = made.images(recording / "background" / "cam.mp4")[0]
        (filmed / "references" / f"{name}.png").unlink()
        (filmed / "references" / f"{name}_mask.png").unlink()
        made.write_film(filmed / "references" / f"{name}.mp4", [empty, *[image] * 5, empty])
    _, of_film = fit_person(filmed, tmp_path / "a.toml")
    _, of_picture = fit_person(recording, tmp_path / "b.toml")
    assert of_film.person is not None
    assert of_picture.person is not None
    assert of_film.person["overlaps"] == pytest.approx(of_picture.person["overlaps"], abs=0.1)


def test_a_truth_that_cannot_be_used_does_not_cost_the_run(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "spoilt", without=["truth.trc"])
    made.replace_text(spoilt / "truth.csv", "left_hand_x", "left_hand_q")
    with pytest.warns(ShadowPuppetWarning, match=r"no errors are computed: .*truth.csv"):
        result = track_recording(spoilt, tmp_path / "run", make_options(QUICK))
    assert "errors" not in result.metrics
    assert read_run(tmp_path / "run").complete


def test_options_round_trip_through_plain_values():
    options = make_options({"preset": "liu2011", "region": "1,2,30,40", "height": 1.7, "tracker": {"arm": {"particles": 30}}})
    assert make_options(plain_options(options)) == options
    assert options.tracker.arm.particles == 30
    assert options.tracker.cycles == make_options({"preset": "liu2011"}).tracker.cycles
    assert options == replace(options)


def test_a_timer_counts_each_stage():
    timer = StageTimer()
    assert list(timer.each("decode", [1, 2, 3])) == [1, 2, 3]
    with pytest.raises(KeyError), timer.time("track"):
        raise KeyError
    assert timer.seconds["decode"] > 0
    assert timer.seconds["track"] > 0
    assert timer.seconds["write"] == 0


def test_memory_does_not_grow_with_the_film(recording):
    """A sample of four times the frames takes no more memory."""
    footage, peaks = open_footage(recording, Options()), []
    shots = list(footage.frames(ready=False))
    for times in (4, 16):
        longer, film = replace(footage), replace(footage.film, count=times * len(shots))
        long = [shot._replace(time=n / 10) for n, shot in enumerate(shots * times)]
        object.__setattr__(longer, "film", film)
        object.__setattr__(longer, "frames", lambda ready, strict, wanted, long=long: (shot._replace(image=shot.image.copy())
                                                                                       for shot in long if wanted(shot.time)))
        tracemalloc.start()
        sample = take_sample(longer)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert len(sample.times) == made.FRAMES * times
        assert len(sample.frames) == RUNS * RUN
    assert peaks[1] < 1.3 * peaks[0]


def test_the_motion_is_smoothed_at_the_end_and_is_one_of_the_body(run):
    raw, found = read_raw(run.folder / "raw.csv", "rounded"), read_run(run.folder)
    assert found.info["smoothing"] == {"method": "tracker", "gaps_s": 0.5, "bridged_frames": 0, "turned_frames": 0,
                                       "reversed_frames": 0}
    assert jitter(found.motion.table) < 0.8 * jitter(raw.table)
    np.testing.assert_array_equal(found.motion.joint_sd, run.motion.joint_sd)
    body = make_body("rounded", read_person(run.folder / "person.toml", "rounded").sizes)
    own = body.points(found.motion.poses, names=found.motion.joint_names)
    place = align(own[:1].reshape(-1, 3), found.motion.joints[:1].reshape(-1, 3))
    np.testing.assert_allclose(place.apply(own), found.motion.joints, atol=1e-5)


def test_the_papers_preset_stays_as_tracked_and_gaps_are_bridged_if_that_is_asked_for(recording, tmp_path):
    spoilt = made.copied(recording, tmp_path / "gap")
    masks = made.images(recording / "masks" / "cam.mkv")
    for n in (8, 9):
        masks[n] = np.zeros_like(masks[n])
    made.write_film(spoilt / "masks" / "cam.mkv", masks, lossless=True)
    paper = make_options(QUICK | {"masks": True, "preset": "liu2011"})
    assert paper.smoothing == ("off", 0.0)
    raw = track_recording(spoilt, tmp_path / "raw", paper)
    assert read_run(raw.folder).info["smoothing"] == {"method": "off"}
    assert not (raw.folder / "raw.csv").exists()
    bridged = track_recording(spoilt, tmp_path / "bridged", make_options(QUICK | {"masks": True, "preset": "liu2011", "gaps": 0.6}))
    gap = np.isin(np.arange(len(masks)), (8, 9))
    np.testing.assert_array_equal(bridged.motion.status == "predicted", gap)
    np.testing.assert_array_equal(bridged.motion.joints[~gap], raw.motion.joints[~gap])
    assert read_run(bridged.folder).info["smoothing"]["bridged_frames"] == 2


def test_a_cutoff_that_the_rate_does_not_allow_is_refused_before_tracking(recording, tmp_path):
    with pytest.raises(SettingsError, match="cutoff: found 50 Hz"):
        track_recording(recording, tmp_path / "run", make_options({"smooth": "butterworth", "cutoff": 50}))
    assert not (tmp_path / "run" / "joints.csv").exists()


@pytest.mark.parametrize("several", [False, True])
def test_a_person_or_prior_that_cannot_be_read_is_refused_before_the_recording_is_examined(tmp_path, monkeypatch, several):
    rig, kind = SimpleNamespace(is_multiview=several), MULTIVIEW if several else MONOCULAR
    files = {"person": "gone.toml"} | ({"prior": "gone.npz"} if several else {})
    for name in files:
        with pytest.raises(FormatError, match=files[name]):
            track_run(rig, kind, tmp_path, make_options({name: str(tmp_path / files[name])}), Listener())
