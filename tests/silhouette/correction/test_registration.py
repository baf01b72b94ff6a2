"""Movement of the camera: it is found beside a person and under another light, undone, and never found where there is none."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.silhouette.correction.registration import STILL, Registration

HEIGHT, WIDTH = 120, 160
FOCAL = 140.0


def scene_of(seed: int = 0) -> np.ndarray:
    """A textured empty scene (H, W, 3), larger than the picture by 40 pixels at each side."""
    rng = np.random.default_rng(seed)
    size = (HEIGHT + 80, WIDTH + 80)
    rough = cv2.resize(rng.uniform(40, 200, (25, 30, 3)), size[::-1], interpolation=cv2.INTER_CUBIC)
    for _ in range(25):
        x, y, w, h = rng.integers(0, 200), rng.integers(0, 160), rng.integers(8, 40), rng.integers(8, 40)
        cv2.rectangle(rough, (int(x), int(y)), (int(x + w), int(y + h)), rng.uniform(30, 220, 3).tolist(), -1)
    return rough.clip(20, 230).astype(np.uint8)


def turn(pan: float, tilt: float, roll: float) -> np.ndarray:
    """The homography of a camera that turned: pixels of the still picture to pixels of the moved one; pixels, pixels, degrees."""
    rotation = cv2.Rodrigues(np.array([-tilt / FOCAL, pan / FOCAL, np.radians(roll)]))[0]
    matrix = np.array([[FOCAL, 0, (WIDTH - 1) / 2], [0, FOCAL, (HEIGHT - 1) / 2], [0, 0, 1]])
    return matrix @ rotation @ np.linalg.inv(matrix)


def filmed(wide: np.ndarray, homography: np.ndarray | None = None, person: bool = False, gain: float = 1.0, noise: float = 1.5,
           seed: int = 1) -> np.ndarray:
    """What a camera that moved sees of the scene, with a person in dark clothes who stands still in the room."""
    room = wide.copy()
    if person:
        cv2.ellipse(room, (WIDTH // 2 + 40, HEIGHT // 2 + 40), (18, 40), 0, 0, 360, (70, 25, 25), -1)
    middle = np.array([[1, 0, -40], [0, 1, -40], [0, 0, 1.0]])
    moved = cv2.warpPerspective(room, (np.eye(3) if homography is None else homography) @ middle, (WIDTH, HEIGHT))
    rng = np.random.default_rng(seed)
    return np.rint(gain * moved.astype(float) + rng.normal(0, noise, moved.shape)).clip(0, 255).astype(np.uint8)


def error(registration: Registration, image: np.ndarray, homography: np.ndarray) -> float:
    """Greatest distance, pixels, of grid points where a movement puts them and where they are."""
    found = registration.movement(image)
    assert found is not None
    assert found[2, 2] == pytest.approx(1)
    pixels = np.array([[WIDTH / 2, 0, (WIDTH - 1) / 2], [0, WIDTH / 2, (HEIGHT - 1) / 2], [0, 0, 1]])
    grid = np.array([[x, y, 1.0] for x in np.linspace(0, WIDTH - 1, 5) for y in np.linspace(0, HEIGHT - 1, 5)]).T
    there, right = (matrix @ grid for matrix in (pixels @ found @ np.linalg.inv(pixels), homography))
    return float(np.hypot(*(there[:2] / there[2] - right[:2] / right[2])).max())


def test_people_and_their_shadows_are_no_movement():
    """Before a wall and a floor with hardly any texture: where these are to be seen, the scene fits as it is."""
    height, width, rng = 240, 320, np.random.default_rng(54)
    room = 120 + cv2.resize(rng.uniform(-1.5, 1.5, (16, 21, 3)), (width, height), interpolation=cv2.INTER_CUBIC)
    room[: height // 2] += 30
    light, people = np.ones((height, width, 1)), []
    for _ in range(7):
        x, y = rng.uniform(40, width - 40), rng.uniform(height * 0.5, height * 0.65)
        people.append((x, y, rng.uniform(0, 255, 3)))
        shadow = cv2.ellipse(np.zeros((height, width)), (int(x - 60), int(y + 75)), (80, 14), 5, 0, 360, 1, -1)
        light[..., 0] *= 1 - 0.45 * cv2.GaussianBlur(shadow, (0, 0), 6)
    image = room * light
    for x, y, colour in people:
        cv2.ellipse(image, (int(x), int(y)), (20, 75), 0, 0, 360, colour.tolist(), -1)
    scene, filmed = (np.rint(each + rng.normal(0, 1, each.shape)).clip(0, 255).astype(np.uint8) for each in (room, image))
    registration = Registration(scene)
    assert registration.movement(filmed) is None
    assert registration.matches(filmed, None)


@settings(max_examples=25, deadline=None)
@given(pan=st.floats(-12, 12), tilt=st.floats(-8, 8), roll=st.floats(-1.5, 1.5), gain=st.sampled_from([0.7, 1.0]), person=st.booleans())
def test_a_turn_of_the_camera_is_found(pan, tilt, roll, gain, person):
    wide, homography = scene_of(), turn(pan, tilt, roll)
    registration = Registration(filmed(wide, noise=0))
    image = filmed(wide, homography, person, gain)
    if registration.movement(image) is not None:
        assert error(registration, image, homography) < 3
    else:
        assert np.hypot(pan, tilt) + 2 * abs(roll) < 2.5 * STILL


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), gain=st.floats(0.6, 1.1), noise=st.floats(0, 15), person=st.booleans())
def test_a_camera_that_stands_still_is_left_alone(seed, gain, noise, person):
    wide = scene_of()
    registration = Registration(filmed(wide, noise=0))
    image = filmed(wide, None, person, gain, noise, seed)
    assert registration.movement(image) is None
    assert registration.matches(image, None)


def test_a_plain_wall_shows_no_movement():
    wall = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    registration = Registration(wall)
    noisy = (wall + np.random.default_rng(0).normal(0, 3, wall.shape)).astype(np.uint8)
    assert registration.movement(noisy) is None
    assert registration.matches(noisy, None)


@pytest.mark.parametrize("other", ["black", "another room", "too far"])
def test_a_frame_that_does_not_show_the_scene_is_left_alone(other):
    wide = scene_of()
    registration = Registration(filmed(wide, noise=0))
    image = {"black": np.zeros((HEIGHT, WIDTH, 3), np.uint8), "another room": filmed(scene_of(7)),
             "too far": filmed(wide, turn(38, 20, 4))}[other]
    assert registration.movement(image) is None
    assert not registration.matches(image, None)


def test_the_frame_is_brought_back_and_what_it_does_not_show_is_named():
    wide, homography = scene_of(), turn(9, -5, 0.8)
    scene = filmed(wide, noise=0)
    registration = Registration(scene)
    image = filmed(wide, homography, noise=0)
    movement = registration.movement(image)
    assert movement is not None
    back, gap = registration.undone(image, movement)
    seen = gap.unseen == 0
    assert 0.8 < seen.mean() < 0.95
    assert np.median(np.abs(back[seen].astype(int) - scene[seen])) <= 3
    assert np.percentile(np.abs(image[seen].astype(int) - scene[seen]), 60) > 10


def test_a_body_cut_by_the_border_goes_on_where_the_frame_shows_nothing():
    wide, homography = scene_of(), turn(0, 9, 0)
    registration = Registration(filmed(wide, noise=0))
    movement = registration.movement(filmed(wide, homography))
    assert movement is not None
    gap = registration.undone(filmed(wide, homography), movement)[1]
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[60:110, 70:90] = True
    filled = gap.filled(mask)
    assert filled[-1, 75:85].all()
    assert not filled[-1, :60].any()


@pytest.mark.parametrize("grey", [False, True])
def test_the_mask_is_the_still_cameras(grey):
    wide = scene_of()
    shapes = [None, None, turn(6, 4, 0.5), turn(-8, 3, -0.5), turn(12, -6, 1)]
    empty, film = [filmed(wide, seed=k) for k in range(6)], [filmed(wide, shape, True, 0.85, seed=9) for shape in shapes]
    if grey:
        empty, film = [image[..., 1].copy() for image in empty], [image[..., 1].copy() for image in film]
    segmenter = learn_background(empty, film=film)
    first, *others = (segmenter(image) for image in film)
    assert 0.08 < first.mean() < 0.15
    for mask in others:
        assert (first & mask).sum() > 0.93 * (first | mask).sum()
    off = learn_background(empty, SilhouetteSettings(stabilise=False), film=film)
    assert (off(film[-1]) & first).sum() < 0.8 * (off(film[-1]) | first).sum()


def test_the_same_frame_has_the_same_mask_whatever_came_before():
    wide = scene_of()
    film = [filmed(wide, turn(3 * k, k, 0), True, seed=k) for k in range(4)]
    segmenter = learn_background([filmed(wide, seed=k) for k in range(4)], film=film)
    forward = [segmenter(image) for image in film]
    backward = [segmenter(image) for image in film[::-1]][::-1]
    assert all((a == b).all() for a, b in zip(forward, backward))


@pytest.mark.parametrize(("shift", "seen"), [((0, 0), (1, 119, 1, 159)), ((20, 0), (1, 119, 0, 139)), ((-20, 0), (1, 119, 21, 160)),
                                             ((0, 10), (0, 109, 1, 159)), ((0, -10), (11, 120, 1, 159))])
def test_all_is_seen_but_the_frame_s_rim_of_a_pixel_and_what_lies_outside_of_it(shift, seen):
    """By shifts of whole pixels: where the scene's pixels lie in the frame is known exactly."""
    scene = filmed(scene_of(), noise=0)
    movement = np.array([[1, 0, shift[0] / (WIDTH / 2)], [0, 1, shift[1] / (WIDTH / 2)], [0, 0, 1]])
    _, gap = Registration(scene).undone(scene, movement)
    assert gap.seen == seen
    top, bottom, left, right = seen
    wanted = np.full((HEIGHT, WIDTH), 255)
    wanted[top:bottom, left:right] = 0
    np.testing.assert_array_equal(gap.unseen, wanted)


def crowd(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A picture with people before most of the scene, and their mask."""
    image, mask = image.copy(), np.zeros((HEIGHT, WIDTH), np.uint8)
    for n, x in enumerate(range(8, 112, 12)):
        for target, colour in ((image, (230, 230, 230) if n % 2 else (20, 20, 20)), (mask, 1)):
            cv2.ellipse(target, (x, HEIGHT // 2 + 10), (7, HEIGHT // 2), 0, 0, 360, colour, -1)
    return image, mask.view(np.bool_)


def test_a_crowd_that_hides_most_of_the_scene_is_no_other_place():
    wide = scene_of()
    registration = Registration(filmed(wide, noise=0))
    image, people = crowd(filmed(wide))
    assert not registration.matches(image, None)
    assert registration.matches(image, None, people)


def test_another_place_is_none_whoever_stands_in_it():
    registration = Registration(filmed(scene_of(), noise=0))
    image, people = crowd(filmed(scene_of(7)))
    assert not registration.matches(image, None, people)
    assert not registration.matches(image, None, np.ones((HEIGHT, WIDTH), bool))
