"""A recording of two people, from films to a run folder for each."""

from __future__ import annotations

import os
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import actor
import made
import made_rig
import numpy as np
import pytest
from solids import Ellipsoid, ring, seen_by

from benchmarks import detector
from shadowpuppet.camera.keypoints import cameras_with_persons
from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import NOTED, FormatError, SettingsError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import rigid, rotation_about
from shadowpuppet.io.checkpoint import FRAMES as EXACT
from shadowpuppet.io.checkpoint import STATE
from shadowpuppet.io.files.lock import LOCK
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.people import person_folders, read_places
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import CompleteRun
from shadowpuppet.pipeline import frame_process, progress
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.people import fitting
from shadowpuppet.pipeline.people import run as module
from shadowpuppet.pipeline.people.census import are_apart, census_by_keypoints, people_in, sampled_sets, take_census
from shadowpuppet.pipeline.people.fitting import fit_apart
from shadowpuppet.pipeline.people.group import first_people
from shadowpuppet.pipeline.people.run import check_people
from shadowpuppet.pipeline.people.state import Measured
from shadowpuppet.pipeline.people.truths import matched_truths
from shadowpuppet.pipeline.person_rig import average_person
from shadowpuppet.pipeline.prepare import MULTIVIEW
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.track import run as track_run
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.people.figures import find_people
from shadowpuppet.tracking.people.views import views_of

FRAMES, KILLED = 6, (1, 4)


def cameras():
    made = ring(4, radius=4.5, height=1.2, size=(128, 96), focal=92.0)
    T = np.eye(4)
    T[2, 3] = -0.9
    return [replace(camera, T_camera_world=camera.T_camera_world @ T) for camera in made]


def standing(x: float, y: float) -> list[Ellipsoid]:
    """A person of ellipsoids at a place on the floor."""
    return [Ellipsoid((x, y, 1.15), (0.14, 0.19, 0.4)), Ellipsoid((x, y, 1.62), (0.1, 0.08, 0.13)),
            *(Ellipsoid((x, y + side * 0.1, 0.42), (0.08, 0.08, 0.45)) for side in (-1, 1)),
            *(Ellipsoid((x, y + side * 0.26, 1.1), (0.05, 0.05, 0.32)) for side in (-1, 1))]  # fmt: skip


def people(n: int) -> list[list[Ellipsoid]]:
    return [standing(-0.8 + 0.04 * n, 0.3), standing(0.9, -0.2 - 0.04 * n)]


@pytest.fixture(scope="module")
def seen():
    made = cameras()
    return made, [[np.logical_or.reduce([seen_by(camera, one) for one in people(n)]) for camera in made] for n in range(FRAMES)]


class Kills(Listener):
    """Keeps the folder of a run as it is when a process is killed after some of its frames."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.now = folder, ""

    def begin(self, title: str, total: int | None = None) -> None:
        self.now = title

    def advance(self, frames: int) -> None:
        if self.now == "tracking" and frames in KILLED:
            for name in (f"killed-{frames}", f"killed-{frames}-spare"):
                shutil.copytree(self.folder, self.folder.with_name(name))


@pytest.fixture(scope="module")
def tracked(seen, tmp_path_factory):
    """How to track the recording into a folder: it is surveyed once."""
    rig, masks = seen
    recording = made_rig.write(tmp_path_factory.mktemp("people") / "recording", rig, masks)
    options = make_options({"masks": True, "overlay": True, "multiview": {"particles": 4}})
    opened = open_rig(recording, options)
    survey = MULTIVIEW.survey(opened, options)

    def track(folder, listener=None, resume=False, counted=2, place=None, **changed):
        shown = replace(survey, census=replace(survey.census, number=counted))
        kind = MULTIVIEW._replace(survey=lambda *_, **__: shown)
        other = None if place is None else open_rig(place, options)
        if other is not None and any(each.keypoints is not None for each in other.footage):
            shown = MULTIVIEW.survey(other, options)
        seen = opened if other is None else replace(other, footage=opened.footage)
        return track_run(seen, kind, folder, replace(options, **changed), listener or Listener(), resume=resume)

    track.recording = recording
    return track


@pytest.fixture(scope="module")
def run(tracked, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(progress, "CHECKPOINT_SECONDS", 0.0)
        patch.setattr(progress, "CHECKPOINT_COST", 0.0)
        return tracked(folder, Kills(folder))


def with_keypoints(recording: Path, headings: tuple[float, float]) -> Path:
    """The recording with what a detector finds of its two people, who face some ways (rad), in any order."""
    body, made = actor.body(), cameras()
    marks = landmarks_of(body)
    poses = [[actor.stance(body.skeleton, 0.0, heading, place) for place in places] for heading, places in zip(headings, (
        [(-0.8 + 0.04 * n, 0.3) for n in range(FRAMES)], [(0.9, -0.2 - 0.04 * n) for n in range(FRAMES)]))]  # fmt: skip
    joints = [body.skeleton.points(np.array(each), marks.joints, marks.places) for each in poses]
    found = detector.detected_together(np.random.default_rng(5), made, np.arange(FRAMES) / made_rig.RATE, marks.names, joints,
                                       detector.EXACT)
    (recording / "keypoints").mkdir()
    for n, camera in enumerate(made):
        frame = np.repeat(np.arange(FRAMES), [len(seen[n].person) for seen in found])
        xy, sure = (np.concatenate([getattr(seen[n], what) for seen in found]) for what in ("xy", "confidence"))
        film = film_keypoints(marks.names, frame, 0 * frame, xy, sure, "made", camera.size)
        write_keypoints(recording / "keypoints" / f"{camera.name}.npz", film)
    return recording


@pytest.mark.parametrize("headings", [(0.0, np.pi)])
def test_keypoints_tell_the_front_of_each_person(tracked, headings, tmp_path, monkeypatch):
    """The silhouettes of these people are the same from before and behind, and their sizes average ones: without keypoints nothing of them
    is vouched for."""
    given = list[int]()

    def fit(rng, floor, options, rate, seen, shown):
        given.extend(cameras_with_persons(shown[each.time]) for each in seen)
        return Measured.of(average_person(rng, floor.cameras, options, rate, 1.75))

    monkeypatch.setattr(module, "fit_apart", fit)
    found = tracked(tmp_path / "run", place=with_keypoints(shutil.copytree(tracked.recording, tmp_path / "recording"), headings),
                    overlay=False)
    people = [read_run(folder).motion for folder in person_folders(found.folder).values()]
    assert len(people) == 2
    assert given == [len(cameras())] * 2 * FRAMES
    for motion, heading in zip(sorted(people, key=lambda motion: motion.poses[0, 0]), headings):
        assert (np.cos(motion.poses[:, motion.dof_names.index("root_heading")] - heading) > 0.9).all()
        assert set(motion.status) == {"tracked"}


def test_people_are_followed_by_keypoints_alone(tracked, tmp_path):
    headings = (0.5, -2.0)
    place = with_keypoints(shutil.copytree(tracked.recording, tmp_path / "recording"), headings)
    shutil.rmtree(place / "masks")
    options = make_options({"evidence": "keypoints", "overlay": True, "multiview": {"particles": 4}})
    found = track_recording(place, tmp_path / "run", options)
    assert "2 people are in the recording" in str(found.look.doubts[0])
    people = [read_run(folder) for folder in person_folders(found.folder).values()]
    people.sort(key=lambda each: each.motion.poses[0, 0])
    assert len(people) == 2
    for each, heading, x in zip(people, headings, (-0.8, 0.9)):
        motion = each.motion
        assert set(motion.status) == {"tracked"}
        assert len(motion) == FRAMES
        assert (np.cos(motion.poses[:, motion.dof_names.index("root_heading")] - heading) > 0.95).all()
        assert motion.poses[0, 0] == pytest.approx(x, abs=0.05)
        body = actor.body()
        truth = body.points(np.array([actor.stance(body.skeleton, 0.0, heading, motion.poses[0, :2])]), names=motion.joint_names)
        assert np.linalg.norm(motion.joints[0] - truth[0], axis=1).mean() < 0.05
    assert (found.folder / "overlay.mp4").stat().st_size > 0


def test_people_are_counted_by_keypoints_alone(tracked, tmp_path):
    place = with_keypoints(shutil.copytree(tracked.recording, tmp_path / "recording"), (0.0, 0.0))
    census = census_by_keypoints(open_rig(place, make_options({"evidence": "keypoints"})))
    assert census is not None
    assert census.number == 2
    assert set(census.numbers) == {2}


def test_sizes_are_measured_by_the_keypoints_of_views_that_show_a_person_apart(seen, monkeypatch):
    rig, masks = seen
    census = take_census(rig, sets_of(masks))
    assert census is not None
    (one, _), given = first_people(census.floor, np.arange(FRAMES), sets_of(masks)), []
    names = tuple(each.name for each in rig)
    monkeypatch.setattr(fitting, "fit_in_views", lambda *args, keypoints, **more: given.extend(zip(args[2], keypoints)) or average)
    average = average_person(np.random.default_rng(0), rig, make_options({}), 10.0, 1.7)
    monkeypatch.setattr(fitting, "views_of", lambda floor, figure, others, masks: (masks[0], None, *masks[2:]))
    fit_apart(np.random.default_rng(0), census.floor, make_options({}), 10.0, one.sightings, {0.0: names, 2.0: names})
    assert len(given) == FRAMES
    for n, (view, found) in enumerate(given):
        assert found == (tuple(name if mask is not None else None for mask, name in zip(view, names)) if n in (0, 2) else ())


def test_sizes_by_keypoints_alone_are_measured_by_the_persons_own(tracked, tmp_path, monkeypatch):
    place = with_keypoints(shutil.copytree(tracked.recording, tmp_path / "recording"), (0.0, 0.0))
    options = make_options({"evidence": "keypoints"})
    survey = MULTIVIEW.survey(open_rig(place, options), options)
    first, rig, given = survey.first, survey.rig.cameras, []
    average = average_person(np.random.default_rng(0), rig, options, 10.0, 1.7)
    monkeypatch.setattr(fitting, "fit_in_views", lambda *args, keypoints, **more: given.extend(keypoints) or average)
    sets = [first.seen(n) for n in range(len(first.times))]
    for one in first_people(survey.census.floor, first.times, sets):
        given.clear()
        fit_apart(np.random.default_rng(0), survey.census.floor, options, 10.0, one.sightings, dict(zip(first.times, first.keypoints)))
        assert len(given) == len(sets)
        for each, found in zip(one.sightings, given):
            middle = [[*each.figure.place.tolist(), 1.0]]
            assert [len(own.person) for own in found] == [1] * len(rig)
            for camera, own in zip(rig, found):
                assert np.linalg.norm(np.nanmedian(own.xy[0], axis=0) - camera.project(np.array(middle))[0]) < 8


def surveyed(folder: Path, rig: list, masks: list):
    options = make_options({"masks": True})
    return MULTIVIEW.survey(open_rig(made_rig.write(folder / "recording", rig, masks), options), options).look


def test_cameras_that_agree_about_each_person_are_not_doubted(seen, tmp_path):
    """All people together are taller and wider than a person: that says nothing about the calibration."""
    look = surveyed(tmp_path, *seen)
    assert [doubt.short for doubt in look.findings if doubt.severity != NOTED] == []
    assert 1.5 < look.agreement.height < 2.0


@pytest.mark.parametrize("degrees", [3.0, 12.0])
def test_a_camera_that_was_turned_is_named_by_several_people(seen, tmp_path, degrees):
    rig, masks = seen
    turn = rigid(rotation_about([0, 1, 0], np.radians(degrees)), np.zeros(3))
    turned = [*rig[:2], replace(rig[2], T_camera_world=turn @ rig[2].T_camera_world), rig[3]]
    assert any("cam3" in doubt.short for doubt in surveyed(tmp_path, turned, masks).findings)


def test_each_has_a_run_of_their_own(run):
    folders = person_folders(run.folder)
    assert list(folders) == [1, 2]
    for number, folder in folders.items():
        one = read_run(folder)
        assert one.complete
        assert len(one.motion) == FRAMES
        assert one.info["person"] == number
        names = {path.name for path in folder.iterdir()}
        assert {"joints.csv", "angles.csv", "motion.npz", "person.toml", "calibration.toml", "look.json"} <= names


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a run but for overlays and times."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name not in ("overlay.mp4", "metrics.json", LOCK))
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.whole
@pytest.mark.parametrize("frames", KILLED)
def test_a_run_killed_anywhere_goes_on_to_the_same_result(run, tracked, frames):
    left = run.folder.with_name(f"killed-{frames}")
    assert (left / STATE).exists()
    with (left / "people.csv").open("a") as rows:
        rows.write("0.5,1,tra")  # a row that was being written
    done = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Listener, "advance", lambda _, frames: done.append(frames))
        tracked(left, resume=True)
    assert done == [*range(frames + 1, FRAMES + 1), *range(1, FRAMES + 1)]  # tracked, and drawn
    ours, theirs = contents(left), contents(run.folder)
    assert sorted(ours) == sorted(theirs)
    assert [name for name in ours if ours[name] != theirs[name]] == []
    assert len(made.images(left / "overlay.mp4")) == FRAMES


@pytest.mark.whole
@pytest.mark.parametrize(("threads", "processes"), [("1", 0), ("7", 0), ("7", 1)])
def test_cores_change_nothing(run, tracked, tmp_path, monkeypatch, threads, processes):
    monkeypatch.setenv("SHADOWPUPPET_THREADS", threads)
    monkeypatch.setattr(frame_process.Task, "is_long", processes > 0)
    monkeypatch.setattr(frame_process, "usable_cores", lambda: 2)
    started = []
    monkeypatch.setattr(frame_process, "_received", lambda packed, original=frame_process._received: started.append(1) or original(packed))
    other = tracked(tmp_path / "run")
    assert len(started) == processes
    for name in ("people.csv", "person-1/motion.npz", "person-2/joints.csv"):
        assert (other.folder / name).read_bytes() == (run.folder / name).read_bytes(), name


class Touches(Listener):
    """Changes the time of a file after some frame sets."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def advance(self, frames: int) -> None:
        if frames == KILLED[1]:
            os.utime(self.path, (1, 1))


def test_nobody_s_run_is_complete_if_an_input_changes_while_people_are_followed(tracked, tmp_path):
    place = shutil.copytree(tracked.recording, tmp_path / "place")
    with pytest.raises(ShadowPuppetError, match=r"run: calibration\.toml has changed while the run went on: it is not complete"):
        tracked(tmp_path / "run", Touches(place / "calibration.toml"), place=place)
    folders = [tmp_path / "run", *person_folders(tmp_path / "run").values()]
    assert len(folders) == 3
    assert not any(tomllib.loads((folder / "run.toml").read_text())["complete"] for folder in folders)


def test_what_a_run_cannot_go_on_from(run, tracked, tmp_path):
    left = shutil.copytree(run.folder.with_name("killed-4-spare"), tmp_path / "left")
    with pytest.raises(ShadowPuppetError, match=r"cannot go on as another one: settings\.seed was 0, and is 4"):
        tracked(left, resume=True, seed=4)
    other = shutil.copytree(tracked.recording, tmp_path / "other")
    (other / "calibration.toml").write_text((other / "calibration.toml").read_text() + "\n")
    with pytest.raises(ShadowPuppetError, match=r"the run there cannot go on: calibration\.toml has changed since; expected the files"):
        tracked(left, resume=True, place=other)
    exact = left / "person-2" / EXACT
    whole = exact.read_bytes()
    exact.write_bytes(whole[:-9])
    with pytest.raises(FormatError, match=r"checkpoint\.frames: found 3 frames, expected 4"):
        tracked(left, resume=True)
    exact.write_bytes(whole)
    (left / "people.csv").write_text("time,person,status,x,y\n")
    with pytest.raises(FormatError, match=r"people\.csv: found fewer lines than the checkpoint beside it"):
        tracked(left, resume=True)
    with pytest.raises(CompleteRun):
        tracked(run.folder, resume=True)


@pytest.fixture
def lines(shell, tracked, tmp_path):
    """Tracks the recording of two people as a user types it, into the folder `run`."""
    def call(*flags: object):
        return shell("track", tracked.recording, "--masks", "--multiview.particles", "4", "-o", tmp_path / "run", *flags)

    return call


@pytest.mark.whole
def test_one_of_two_people_is_followed_if_that_is_asked_for(lines, run, tmp_path):
    said = lines("--people", "1", "--person", run.folder / "person-1" / "person.toml")
    assert said.code == 0, said.err
    assert "2 people: one is tracked, others are ignored" in said.out + said.err
    assert (tmp_path / "run" / "joints.csv").exists()
    assert person_folders(tmp_path / "run") == {}
    assert not (tmp_path / "run" / "person-1").exists()
    found = read_run(tmp_path / "run")
    assert found.info["settings"]["people"] == 1
    assert len(found.motion) == FRAMES


@pytest.mark.whole
def test_the_run_of_the_only_one_who_could_be_followed_lies_in_its_own_folder(tracked, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "first_people", lambda *given: first_people(*given)[:1])
    with pytest.warns(ShadowPuppetWarning, match="2 people were counted, 1 could be followed"):
        found = tracked(tmp_path / "run", overlay=False)
    assert "people" not in found.metrics
    assert found.metrics["frames_per_s"] > 0
    one = read_run(tmp_path / "run")
    assert one.complete
    assert len(one.motion) == len(found.motion) > 0
    assert {"person", "people"}.isdisjoint(one.info)
    assert one.metrics["verdict"] == found.metrics["verdict"]
    assert not list((tmp_path / "run").glob("person-*"))
    assert not (tmp_path / "run" / "people.csv").exists()
    assert not list((tmp_path / "run").glob("checkpoint*"))


def test_places_are_those_of_the_people(run):
    ends = sorted((where[-1].round(2).tolist() for _, _, where in read_places(run.folder).values()), key=lambda place: place[0])
    assert np.allclose(ends, [(-0.6, 0.3), (0.9, -0.4)], atol=0.15)


def test_the_number_is_said(run):
    assert "2 people are in the recording" in str(run.look.doubts[0])
    assert set(run.metrics["people"]) == {1, 2}


@pytest.mark.whole
def test_who_was_counted_and_cannot_be_followed_is_said(tracked, tmp_path):
    with pytest.warns(ShadowPuppetWarning, match="3 people were counted, 2 could be followed: "):
        found = tracked(tmp_path / "run", counted=3, overlay=False)
    assert set(found.metrics["people"]) == {1, 2}


def sets_of(sets):
    return [Seen(tuple(masks)) for masks in sets]


def test_sizes_are_measured_where_people_are_apart(seen):
    rig, masks = seen
    census = take_census(rig, sets_of(masks))
    assert census is not None
    assert census.number == 2
    assert census.numbers == (2,) * FRAMES
    one, other = find_people(census.floor, Seen(tuple(masks[0])))
    views = views_of(census.floor, one, [other], masks[0])
    shown = [view for view in views if view is not None]
    assert len(shown) >= 2
    for view, mask in zip(views, masks[0]):
        assert view is None or 0 < np.count_nonzero(view) < 0.8 * np.count_nonzero(mask)


def test_a_census_of_nothing():
    assert take_census(cameras(), []) is None
    assert sampled_sets([], []) == []


def test_a_picture_that_is_all_silhouette_shows_nobody():
    made = cameras()
    alone = [seen_by(camera, standing(0.9, -0.2)) for camera in made]
    full = [np.ones_like(alone[0]), *alone[1:]]
    census = take_census(made, sets_of([full] * 3))
    assert census is not None
    assert census.numbers == (1, 1, 1)
    assert [len(each.sightings) for each in first_people(census.floor, [0.0, 0.1, 0.2], sets_of([full] * 3))] == [3]


def test_who_comes_later_is_counted(seen):
    rig, masks = seen
    alone = [[seen_by(camera, people(n)[0]) for camera in rig] for n in range(FRAMES)]
    census = take_census(rig, sets_of(alone), sets_of(masks))
    assert census is not None
    assert census.number == 2
    assert census.numbers == (1,) * FRAMES + (2,) * FRAMES


def test_who_is_there_for_a_twelfth_of_the_film_is_counted(seen):
    rig, masks = seen
    alone = [[seen_by(camera, people(n)[0]) for camera in rig] for n in range(FRAMES)]
    census = take_census(rig, sets_of(alone * 2), sets_of([*alone, *alone[:4], *masks[:2]]))
    assert census is not None
    assert census.number == 2


def test_people_are_apart_where_two_cameras_show_several(seen):
    masks = seen[1]
    alone = [[mask & (np.arange(mask.shape[1]) < 0) for mask in every] for every in masks]
    assert are_apart(sets_of(masks))
    one_camera = [[every[0], *(seen_by(camera, people(n)[0]) for camera in seen[0][1:])] for n, every in enumerate(masks)]
    assert not are_apart(sets_of(one_camera))
    assert not are_apart(sets_of(alone))


def test_parts_of_a_picture_that_may_be_people():
    mask = np.zeros((40, 60), bool)
    assert people_in(mask) == 0
    mask[5:35, 5:15] = True
    mask[38:40, 50:52] = True
    assert people_in(mask) == 1
    mask[10:34, 30:38] = True
    assert people_in(mask) == 2


def test_what_several_people_cannot_have():
    with pytest.raises(SettingsError, match=r"person: found .*one\.toml for several people"):
        check_people(make_options({"person": "one.toml"}))
    check_people(make_options({"person": "one.toml", "people": 1}))


def test_no_truth_is_nobodys(run):
    motions = {number: read_run(folder).motion for number, folder in person_folders(run.folder).items()}
    assert matched_truths(motions, []) == {}
