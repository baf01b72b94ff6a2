"""A recording of two people, from films to a run folder for each."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest
from solids import Ellipsoid, ring, seen_by

from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.io.people import person_folders, read_places
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.people.census import people_in, sampled_sets, take_census
from shadowpuppet.pipeline.people.fitting import views_of
from shadowpuppet.pipeline.people.group import first_people
from shadowpuppet.pipeline.people.run import PeopleRun, check_people, matched_truths
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.tracking.people.figures import find_people

FRAMES = 6


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


@pytest.fixture(scope="module")
def run(seen, tmp_path_factory):
    made, masks = seen
    folder = tmp_path_factory.mktemp("people")
    recording = made_rig.write(folder / "recording", made, masks)
    options = make_options({"masks": True, "multiview": {"particles": 4}})
    return track_recording(recording, folder / "run", options)


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


def test_places_are_those_of_the_people(run):
    ends = sorted((where[-1].round(2).tolist() for _, _, where in read_places(run.folder).values()), key=lambda place: place[0])
    assert np.allclose(ends, [(-0.6, 0.3), (0.9, -0.4)], atol=0.15)


def test_the_number_is_said(run):
    assert "2 people are in the recording" in str(run.look.doubts[0])
    assert set(run.metrics["people"]) == {1, 2}


def test_sizes_are_measured_where_people_are_apart(seen):
    made, masks = seen
    census = take_census(made, masks)
    assert census is not None
    assert census.number == 2
    assert census.numbers == (2,) * FRAMES
    one, other = find_people(census.floor, masks[0])
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
    census = take_census(made, [full] * 3)
    assert census is not None
    assert census.numbers == (1, 1, 1)
    assert [len(figures) for figures in first_people(census.floor, [0.0, 0.1, 0.2], [full] * 3)[1]] == [1, 1, 1]


def test_who_comes_later_is_counted(seen):
    made, masks = seen
    alone = [[seen_by(camera, people(n)[0]) for camera in made] for n in range(FRAMES)]
    census = take_census(made, alone, masks)
    assert census is not None
    assert census.number == 2
    assert census.numbers == (1,) * FRAMES + (2,) * FRAMES


def test_parts_of_a_picture_that_may_be_people():
    mask = np.zeros((40, 60), bool)
    assert people_in(mask) == 0
    mask[5:35, 5:15] = True
    mask[38:40, 50:52] = True
    assert people_in(mask) == 1
    mask[10:34, 30:38] = True
    assert people_in(mask) == 2


def test_what_several_people_cannot_have():
    with pytest.raises(ShadowPuppetError, match="--resume: found several people"):
        check_people(make_options({}), True)
    with pytest.raises(SettingsError, match=r"person: found .*one\.toml for several people"):
        check_people(make_options({"person": "one.toml"}), False)


def test_no_truth_is_nobodys(run):
    motions = {number: read_run(folder).motion for number, folder in person_folders(run.folder).items()}
    assert matched_truths(motions, []) == {}


def test_nothing_of_a_person_who_may_face_the_other_way_is_vouched_for():
    frame = PeopleRun._doubted(MotionFrame(0.0, "tracked", limb_status=["tracked", "predicted", "lost"]))
    assert (frame.status, frame.limb_status) == ("uncertain", ["uncertain", "predicted", "lost"])
    assert PeopleRun._doubted(MotionFrame(0.0, "lost")).status == "lost"
