"""Runs by keypoints alone: no empty scene is needed, one camera is enough, and what cannot be is refused."""

from __future__ import annotations

import shutil
from pathlib import Path

import actor
import made
import made_rig
import numpy as np
import pytest

from benchmarks.detector import Detector, detected
from shadowpuppet.errors import RecordingError, ShadowPuppetWarning, TrackingError
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.prepare import look_at
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.tracking.keypoints.definitions import landmarks_of

BODY = actor.body()
MARKS, TIMES = landmarks_of(BODY), np.arange(made_rig.FRAMES) / made_rig.RATE
POSES = actor.walk(BODY.skeleton, made_rig.FRAMES, made_rig.RATE)
BY_KEYPOINTS = {"evidence": "keypoints", "multiview": {"particles": 12}}


def with_keypoints(recording: Path, folder: Path, scale: float = 1.0, frames: int = made_rig.FRAMES) -> Path:
    """A copy of a recording without its empty scene, with keypoints of a walk of `scale` times the actor's size in the first frames."""
    made.copied(recording, folder)
    shutil.rmtree(folder / "background")
    places = scale * BODY.skeleton.points(POSES, MARKS.joints, MARKS.places)
    found = detected(np.random.default_rng(0), made_rig.cameras(), TIMES, MARKS.names, places, Detector(exchanges=0.0))[:frames]
    (folder / "keypoints").mkdir()
    for n, camera in enumerate(made_rig.cameras()):
        xy, sure = (np.array([getattr(of[n], what)[0] for of in found]) for what in ("xy", "confidence"))
        xy, sure = xy.reshape(frames, len(MARKS.names), 2), sure.reshape(frames, len(MARKS.names))
        film = film_keypoints(MARKS.names, np.arange(frames), np.zeros(frames, int), xy, sure, "made", camera.size)
        write_keypoints(folder / "keypoints" / f"{camera.name}.npz", film)
    return folder


@pytest.fixture(scope="module")
def walk(rig_recording, tmp_path_factory) -> Path:
    return with_keypoints(rig_recording, tmp_path_factory.mktemp("walk") / "walk")


def errors(motion) -> np.ndarray:
    """Distances (T, J), metres, of a motion's joints from the walk's."""
    return np.linalg.norm(motion.joints - BODY.points(POSES, names=motion.joint_names), axis=2)


def test_several_cameras_follow_a_person_without_an_empty_scene(walk, tmp_path):
    found = track_recording(walk, tmp_path / "run", make_options(BY_KEYPOINTS | {"overlay": True}))
    assert np.median(errors(found.motion)) < 0.04
    assert set(found.motion.status) == {"tracked"}
    sizes = found.look.person
    assert "keypoints of the first seconds" in sizes["source"]
    assert sizes["sizes"]["thigh_length"] == pytest.approx(BODY_THIGH, abs=0.03)
    assert "overlap" not in sizes
    written = read_run(tmp_path / "run")
    assert written.info["cameras"] == [camera.name for camera in made_rig.cameras()]
    assert (tmp_path / "run" / "overlay.mp4").stat().st_size > 0
    within = np.abs(found.motion.joints - BODY.points(POSES, names=found.motion.joint_names)) < 1.645 * found.motion.joint_sd
    assert within.mean() > 0.7


BODY_THIGH = float(np.linalg.norm(np.diff(BODY.points(POSES[:1], names=["left_hip", "left_knee"])[0], axis=0)))


@pytest.mark.parametrize("known", ["sizes", "height"])
def test_one_camera_follows_a_person_given_the_sizes_or_the_height(walk, tmp_path, known):
    write_person(tmp_path / "person.toml", Person(actor.sizes(), 1.75, "the actor's own"))
    given = {"person": str(tmp_path / "person.toml")} if known == "sizes" else {"height": 1.75}
    found = track_recording(walk, tmp_path / "run", make_options(BY_KEYPOINTS | {"camera": "cam1"} | given)).motion
    if known == "sizes":
        assert np.median(errors(found)) < 0.15
    within = np.abs(found.joints - BODY.points(POSES, names=found.joint_names)) < 1.645 * found.joint_sd
    assert within.mean() > 0.8
    across = made_rig.cameras()[0].project(found.joints) - made_rig.cameras()[0].project(BODY.points(POSES, names=found.joint_names))
    assert np.median(np.linalg.norm(across, axis=2)) < 3  # of 160 pixels
    assert read_run(tmp_path / "run").info["cameras"] == ["cam1"]


def test_a_look_says_what_detectors_found_and_needs_no_pictures_of_the_scene(walk):
    look = look_at(walk, make_options(BY_KEYPOINTS))
    assert look.refusal is None
    assert look.keypoints is not None
    assert look.keypoints.apart is not None
    assert look.keypoints.apart < 0.05
    assert {camera.background for camera in look.cameras} == {"none, keypoints alone"}


def test_one_cameras_scale_is_a_guess_without_a_height(walk):
    unknown, known = (look_at(walk, make_options(BY_KEYPOINTS | {"camera": "cam1"} | given)) for given in ({}, {"height": 1.75}))
    assert [each.short for each in unknown.findings] == ["height not known: all lengths are guesses; give --height"]
    assert not known.findings


def test_one_camera_tracks_by_silhouettes_and_keypoints_together(rig_recording, walk, tmp_path):
    both = made.copied(walk, tmp_path / "both")
    made.copied(rig_recording / "background", both / "background")
    options = {"camera": "cam1", "height": 1.75, "body": "anatomical"}
    assert not [each for each in look_at(both, make_options(options)).findings if "keypoints" in each.short]
    found = {evidence: track_recording(both, tmp_path / str(evidence), make_options(options | {"evidence": evidence})).motion
             for evidence in (None, "silhouettes,keypoints", "silhouettes")}  # fmt: skip
    assert np.array_equal(found[None].poses, found["silhouettes,keypoints"].poses, equal_nan=True)
    vouched = (found["silhouettes"].limb_status == "tracked").any(1)
    assert np.array_equal(found["silhouettes"].status == "tracked", vouched)
    assert np.mean(found[None].status == "uncertain") > 0.8  # the film shows another walk than the keypoints


def test_a_wrong_scale_is_said_and_a_hopeless_one_refused(rig_recording, walk, tmp_path):
    large = with_keypoints(rig_recording, tmp_path / "large", 1.25)
    told = [each.short for each in look_at(large, make_options(BY_KEYPOINTS | {"height": 1.75})).findings]
    assert told[0].startswith("calibration's scale is wrong, 1.2")
    assert not [each for each in look_at(walk, make_options(BY_KEYPOINTS | {"height": 1.75})).findings if "scale" in each.short]
    with pytest.raises(TrackingError, match=r"the calibration makes the person 0\.\d\d m tall"):
        track_recording(with_keypoints(rig_recording, tmp_path / "small", 0.2), tmp_path / "run", make_options(BY_KEYPOINTS))


def test_what_cannot_be_is_refused(rig_recording, walk, tmp_path):
    with pytest.raises(RecordingError, match="no keypoints of camera 'cam1' in it"):
        track_recording(rig_recording, tmp_path / "run", make_options(BY_KEYPOINTS))
    with pytest.raises(TrackingError, match="nobody is found"):
        track_recording(walk, tmp_path / "run", make_options({"evidence": "keypoints", "multiview": {"keypoints": 0}}))
    empty = with_keypoints(rig_recording, tmp_path / "empty", frames=0)
    with pytest.raises(TrackingError, match="the detector found no person in two cameras at the same time"):
        track_recording(empty, tmp_path / "run", make_options(BY_KEYPOINTS))
    with pytest.warns(ShadowPuppetWarning, match="no effect with keypoints alone: masks"):
        track_recording(walk, tmp_path / "masks", make_options(BY_KEYPOINTS | {"masks": True, "end": "0.3"}))
