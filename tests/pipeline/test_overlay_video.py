"""The overlay of several cameras: the model where it is, pale where it was, and the films around it as they are."""

from __future__ import annotations

import made_rig
import numpy as np
import pytest
import runs

from shadowpuppet.camera.mask import Seen
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.overlay_video import TALLEST, WIDEST, grid_of, overlay_grid
from shadowpuppet.pipeline.rig import FrameSet

SIZE = (320, 240)
CAMERAS = made_rig.cameras(4, SIZE)
BODY = runs.body_of("anatomical")
PICTURES = [Picture(BODY, camera, camera.T_camera_world) for camera in CAMERAS]
WORDS = 70
"""Rows at the lower end that words may take."""


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
    """Without the words."""
    out = overlay_grid(films(without), found, PICTURES, last)
    assert out.shape == (2 * SIZE[1], 2 * SIZE[0], 3)
    return out[:-WORDS]


def test_a_pose_is_drawn_whatever_was_before_and_where_there_is_none_the_last_one_all_pale():
    last = frame(limbs="tracked", left_shoulder_x=1.2)
    np.testing.assert_array_equal(shown(frame(), last), shown(frame()))
    for status in ("lost", "absent"):
        np.testing.assert_array_equal(shown(frame(status), last), shown(frame(limbs="predicted", left_shoulder_x=1.2)))
    assert (shown(frame("lost"), last) != shown(last)).any()


def test_nothing_but_the_model_is_drawn_into_the_films():
    bare, found = shown(frame("lost")), frame()
    changed = (shown(found) != bare).any(2)
    for n, picture in enumerate(PICTURES):
        y, x = divmod(n, 2)
        rows = slice(y * SIZE[1], min((y + 1) * SIZE[1], len(changed)))
        drawn, mask = changed[rows, x * SIZE[0] : (x + 1) * SIZE[0]], picture.mask(np.asarray(found.pose))[: rows.stop - rows.start]
        assert (drawn & mask).sum() > 0.95 * mask.sum() > 1000
        assert (drawn & ~mask).sum() < 0.3 * mask.sum()  # outlines
        image = films().images[n]
        assert image is not None
        plain = bare[rows, x * SIZE[0] : (x + 1) * SIZE[0]][40:190]
        np.testing.assert_array_equal(plain, image[40:190][: len(plain)])


def test_a_camera_without_a_picture_is_black_but_for_words():
    whole, out = shown(frame()), shown(frame(), without=1)
    np.testing.assert_array_equal(out[:, : SIZE[0]], whole[:, : SIZE[0]])
    assert not out[40 : SIZE[1], SIZE[0] :].any()
    assert out[:40, SIZE[0] :].any()


@pytest.mark.parametrize("sizes", [[(640, 480)] * 7, [(1080, 1920)] * 4, [(640, 480)] * 2, [(320, 240), (640, 360), (480, 640)]])
def test_a_grid_holds_all_cameras_and_is_of_a_reasonable_size(sizes):
    columns, rows, (width, height) = grid_of(sizes)
    assert columns * rows >= len(sizes) > columns * (rows - 1)
    assert columns * width <= WIDEST + 2 * columns
    assert rows * height <= TALLEST + 2 * rows
    assert width % 2 == height % 2 == 0
