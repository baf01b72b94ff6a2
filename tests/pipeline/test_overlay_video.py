"""The overlay of several cameras: the model where it is, dashed where it was, and the films around it as they are."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest
import runs

from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Seen
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.overlay_video import TALLEST, WIDEST, grid_of, overlay_grid, overlay_of_people
from shadowpuppet.pipeline.rig import FrameSet

SIZE = (320, 240)
CAMERAS = made_rig.cameras(4, SIZE)
BODY = runs.body_of("anatomical")
PICTURES = [Picture(BODY, camera, camera.T_camera_world) for camera in CAMERAS]
GRID = grid_of(CAMERAS)


def frame(status: str = "tracked", limbs: str = "tracked", time: float = 1.0, **angles: float) -> MotionFrame:
    if status in ("lost", "absent"):
        return MotionFrame(time, status)
    pose = BODY.skeleton.pose(root_z=0.95, **angles)
    return MotionFrame(time, status, pose, np.zeros((len(BODY.landmark_names), 3)), limb_status=[limbs] * len(LIMBS))


def films(without: int | None = None) -> FrameSet:
    """A picture of noise and half a silhouette of each camera but one."""
    rng = np.random.default_rng(5)
    images = [rng.integers(0, 256, (*SIZE[::-1], 3), np.uint8) for _ in CAMERAS]
    masks = [np.arange(SIZE[1])[:, None] > np.full(SIZE[0], 200) for _ in CAMERAS]
    images, masks = (tuple(None if n == without else each for n, each in enumerate(of)) for of in (images, masks))
    return FrameSet(2.0, images, Seen(masks))


def shown(found: MotionFrame, last: MotionFrame | None = None, without: int | None = None) -> np.ndarray:
    out = overlay_grid(films(without), found, PICTURES, last)
    assert out.shape == (2 * (SIZE[1] + GRID.header), 2 * SIZE[0], 3)
    return out


def test_a_pose_is_drawn_whatever_was_before_and_where_there_is_none_the_last_one_all_dashed():
    last = frame(limbs="tracked", left_shoulder_x=1.2)
    np.testing.assert_array_equal(shown(frame(), last), shown(frame()))
    for status in ("lost", "absent"):
        np.testing.assert_array_equal(shown(frame(status), last), shown(frame(limbs="predicted", left_shoulder_x=1.2)))
    assert (shown(frame("lost"), last) != shown(last)).any()


def test_nothing_but_the_model_is_drawn_into_the_films():
    bare, found = shown(frame("lost")), frame()
    changed = (shown(found) != bare).any(2)
    for n, picture in enumerate(PICTURES):
        drawn, mask = changed[GRID.place(n)], picture.mask(np.asarray(found.pose))
        assert (drawn & mask).sum() > 0.95 * mask.sum() > 1000
        assert (drawn & ~mask).sum() < 0.3 * mask.sum()  # outlines
        image = films().images[n]
        assert image is not None
        np.testing.assert_array_equal(bare[GRID.place(n)][:190], image[:190])


def test_each_camera_has_its_name_above_its_picture_and_none_over_it():
    plain = shown(frame("lost"))
    other = overlay_grid(films(), frame("lost"), [replace(each, camera=replace(each.camera, name=f"door {n}"))
                                                  for n, each in enumerate(PICTURES)])
    for n in range(4):
        rows, columns = GRID.place(n)
        np.testing.assert_array_equal(other[rows, columns], plain[rows, columns])
        assert (other[rows.start - GRID.header : rows.start, columns] != plain[rows.start - GRID.header : rows.start, columns]).any()


def test_a_camera_without_a_picture_is_grey_under_its_name():
    whole, out = shown(frame()), shown(frame(), without=1)
    rows, columns = GRID.place(1)
    np.testing.assert_array_equal(out[:, : SIZE[0]], whole[:, : SIZE[0]])
    assert len(np.unique(out[rows, columns])) == 1
    np.testing.assert_array_equal(out[: rows.start], whole[: rows.start])


def test_a_doubtful_limb_is_dashed_with_several_people_too():
    limbs = ["uncertain" if limb == "left_arm" else "tracked" for limb in LIMBS]
    both = [frame(), frame()._replace(limb_status=limbs)]
    sure, doubted = (overlay_of_people(films(), CAMERAS, [(2, found, PICTURES)]) for found in both)
    changed = (sure != doubted).any(2)
    for n, picture in enumerate(PICTURES):
        arm = picture.mask(np.asarray(both[0].pose)) & changed[GRID.place(n)]
        assert 60 < arm.sum() < 0.5 * picture.mask(np.asarray(both[0].pose)).sum()
    alone = overlay_grid(films(), both[1], PICTURES)
    number = (alone != doubted).any(2)
    assert number.any()
    for n, picture in enumerate(PICTURES):  # the number is above the head
        mask = picture.mask(np.asarray(both[0].pose))
        assert not number[GRID.place(n)][np.nonzero(mask)[0].min() + 2 :].any()


def test_keypoints_are_drawn_into_their_cameras_picture():
    point = Keypoints(("left_wrist",), np.array([[[200.0, 50.0]]]), np.ones((1, 1)), np.array([-1]), "HALPE_26")
    now = films()
    seen = now.seen._replace(keypoints=(None, point, None, None))
    plain, crossed = (overlay_grid(each, frame("lost"), PICTURES) for each in (now, now._replace(seen=seen)))
    changed = np.argwhere((plain != crossed).any(2))
    rows, columns = GRID.place(1)
    assert 10 < len(changed) < 40
    assert np.abs(changed - (rows.start + 50, columns.start + 200)).max() <= 5


@pytest.mark.parametrize("sizes", [[(640, 480)] * 7, [(1080, 1920)] * 4, [(640, 480)] * 2, [(320, 240), (640, 360), (480, 640)]])
def test_a_grid_holds_all_cameras_and_is_of_a_reasonable_size(sizes):
    columns, rows, width, height, header = grid_of([replace(CAMERAS[0], size=size) for size in sizes])
    assert columns * rows >= len(sizes) > columns * (rows - 1)
    assert columns * width <= WIDEST + 2 * columns
    assert rows * height <= TALLEST + 2 * rows
    assert width % 2 == height % 2 == header % 2 == 0
