"""Cameras that fit together, and every fault that keeps them from it: who is blamed, by how many pixels, and what is advised."""

from __future__ import annotations

import re
from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.agreement import agreement
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import inverse, rigid

STEP = 1 / made_rig.RATE


@pytest.fixture(scope="module")
def masks(cameras):
    return made_rig.masks(cameras, 30)


def moved(camera: Camera, degrees: float) -> Camera:
    """The camera turned about its own vertical axis."""
    a = np.radians(degrees)
    turn = rigid([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]], np.zeros(3))
    return replace(camera, T_camera_world=turn @ camera.T_camera_world)


def test_cameras_that_fit_are_within_a_pixel(cameras, masks):
    found = agreement(cameras, masks, STEP)
    assert max(found.apart) < 0.6
    assert found.wrong == ()
    assert found.doubts() == ()
    assert found.refusal() is None
    assert 1.4 < found.height < 2.2


@pytest.mark.parametrize("lens", [{"distortion": (-0.1, 0.05, 0.001, 0.0)}, {"fisheye": True}], ids=["distorted", "fisheye"])
def test_lenses_are_undone(lens):
    cameras = made_rig.cameras(4, **lens)
    assert max(agreement(cameras, made_rig.masks(cameras, 6)).apart) < 0.6


def test_a_camera_that_was_moved_is_named_with_its_pixels(cameras, masks):
    wrong = [moved(camera, 6) if n == 2 else camera for n, camera in enumerate(cameras)]
    found = agreement(wrong, masks, STEP)
    assert found.wrong == ("cam3",)
    expected = np.radians(6) * cameras[2].matrix[0, 0]
    assert 0.3 * expected < found.apart[2] < 1.5 * expected
    assert max(apart for n, apart in enumerate(found.apart) if n != 2) < 1.0
    (doubt,) = found.doubts()
    assert re.match(r"camera 'cam3' disagrees with the others by \d+ pixels, they with each other by 0\.\d", doubt.words)
    assert doubt.words.endswith("--camera cam1,cam2,cam4")


def test_of_three_cameras_a_wrong_one_blames_no_other(cameras, masks):
    """Each good camera has one good and one bad partner: it counts by the good one."""
    wrong = [cameras[0], cameras[1], moved(cameras[2], 6)]
    found = agreement(wrong, [row[:3] for row in masks], STEP)
    assert found.wrong == ("cam3",)
    assert max(found.apart[:2]) < 1.0


@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 3)])
def test_films_of_two_cameras_swapped_are_found(cameras, masks, a, b):
    order = list(range(len(cameras)))
    order[a], order[b] = b, a
    found = agreement(cameras, [[row[n] for n in order] for row in masks], STEP)
    assert found.remedy is not None
    assert found.remedy.startswith(f"cameras {cameras[a].name!r} and {cameras[b].name!r} are swapped, it seems")
    assert re.search(r"then all agree within 0\.\d pixels, instead of \d+$", found.remedy)
    assert [str(doubt) for doubt in found.doubts()] == [found.remedy]


@pytest.mark.parametrize(("camera", "steps"), [(1, 3), (0, -3)])
def test_a_film_that_runs_late_is_found_with_its_time(cameras, camera, steps):
    masks = made_rig.masks(cameras, 40)
    seen = [[masks[10 + n + (steps if k == camera else 0)][k] for k in range(len(cameras))] for n in range(24)]
    found = agreement(cameras, seen, STEP)
    name, late = cameras[camera].name, -steps * STEP
    assert found.remedy is not None
    assert f"camera {name!r} is about {abs(late):.2f} s {'late' if late > 0 else 'early'}" in found.remedy
    if late > 0:
        assert f"add to [start] of recording.toml: {name} = {late:.2f}" in found.remedy
    else:
        others = ", ".join(f"{other.name} = {-late:.2f}" for other in cameras if other.name != name)
        assert f"add to [start] of recording.toml: {others}" in found.remedy


def test_what_was_advised_for_a_late_film_mends_it(cameras):
    """`start` is the film's own time that is the recording's 0: what is left out at its beginning."""
    masks = made_rig.masks(cameras, 40)
    late = [[masks[10 + n - (3 if k == 1 else 0)][k] for k in range(len(cameras))] for n in range(24)]
    remedy = agreement(cameras, late, STEP).remedy
    assert remedy is not None
    told = re.search(r"cam2 = ([\d.]+)", remedy)
    assert told is not None
    skipped = round(float(told[1]) * made_rig.RATE)
    mended = [[late[n + (skipped if k == 1 else 0)][k] for k in range(len(cameras))] for n in range(20)]
    assert max(agreement(cameras, mended, STEP).apart) < 0.6


def test_one_camera_of_mirrored_pictures_is_found(cameras, masks):
    found = agreement(cameras, [[mask[:, ::-1].copy() if n == 3 else mask for n, mask in enumerate(row)] for row in masks], STEP)
    assert found.remedy is not None
    assert found.remedy.startswith("camera 'cam4' shows mirrored pictures")


def test_mirrored_pictures_everywhere_are_found(cameras, masks):
    found = agreement(cameras, [[mask[:, ::-1].copy() for mask in row] for row in masks], STEP)
    assert found.remedy is not None
    assert found.remedy.startswith("all cameras show mirrored pictures")


def test_a_calibration_from_camera_to_world_is_found(cameras, masks):
    found = agreement([replace(camera, T_camera_world=inverse(camera.T_camera_world)) for camera in cameras], masks, STEP)
    assert found.remedy is not None
    assert found.remedy.startswith("the calibration says where cameras stand (camera to world)")


def test_places_stated_as_translations_are_found(cameras, masks):
    """As in Human3.6M: t is the camera's centre."""
    stated = [replace(camera, T_camera_world=rigid(camera.T_camera_world[:3, :3], camera.centre)) for camera in cameras]
    found = agreement(stated, masks, STEP)
    assert found.remedy.startswith("the calibration's translations are the places of the cameras")
    assert "by -R T: then all agree within" in found.remedy


def test_millimetres_are_found_and_refused(cameras, masks):
    found = agreement([made_rig.scaled(camera, 1000) for camera in cameras], masks, STEP)
    assert max(found.apart) < 0.6  # silhouettes know no scale
    assert found.hopeless
    assert re.search(r"the person 1,[4-9]\d\d m high .* in millimetres", found.refusal())
    assert found.doubts() == ()


@pytest.mark.parametrize("factor", [0.1, 2.54])
def test_another_unit_is_doubted(cameras, masks, factor):
    (doubt,) = agreement([made_rig.scaled(camera, factor) for camera in cameras], masks, STEP).doubts()
    assert "is it in metres?" in doubt


def test_cameras_that_all_disagree_blame_the_calibration(cameras, masks):
    wrong = [moved(camera, (-1) ** n * (5 + 4 * n)) for n, camera in enumerate(cameras)]
    (doubt,) = agreement(wrong, masks, STEP).doubts()
    assert "the cameras' silhouettes do not fit together" in doubt


def test_silhouettes_cut_by_the_border_say_nothing_there(cameras, masks):
    cut = [[mask.copy() for mask in row] for row in masks]
    for row in cut:
        row[0][:60] = False  # as if the picture began there
    border = [np.roll(row[0], -60, 0) for row in cut]
    near = replace(cameras[0], matrix=cameras[0].matrix - [[0, 0, 0], [0, 0, 60], [0, 0, 0]])
    found = agreement([near, *cameras[1:]], [[first, *row[1:]] for first, row in zip(border, cut)], STEP)
    assert max(apart for apart in found.apart if apart is not None) < 1.0


def test_nothing_seen_is_nothing_said(cameras):
    nobody = [np.zeros(camera.size[::-1], bool) for camera in cameras]
    for rows in ([], [nobody], [[None] * len(cameras)], [[*made_rig.masks(cameras, 1)[0][:1], *[None] * 3]]):
        found = agreement(cameras, rows)
        assert set(found.apart) == {None}
        assert found.height is None
        assert found.doubts() == ()


def test_two_cameras_can_only_be_reported_to_disagree(cameras, masks):
    two = [cameras[0], moved(cameras[1], 8)]
    (doubt,) = agreement(two, [row[:2] for row in masks], STEP).doubts()
    assert "do not fit together" in doubt or "it seems" in doubt
