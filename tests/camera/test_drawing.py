"""The overlay: its middle row is the cost in colours, its outer rows show the pose where it is, or none where there is none."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import BODIES, shapes_of

from shadowpuppet.body.models import make_body
from shadowpuppet.body.upper_body import CardboxSizes
from shadowpuppet.camera import drawing
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.drawing import draw_keypoints, draw_model, draw_person, draw_skeleton, matching, overlay_frame
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, rigid
from shadowpuppet.video import open_frames, write_frames

SIZES = CardboxSizes(*(1.8 * share for share in (
    0.09, 0.13, 0.05, 0.23, 0.19, 0.23, 0.2, 0.12, 0.11, 0.09, 0.14, 0.14, 0.17, 0.06, 0.25, 0.05, 0.04, 0.02)))
CAMERA = Camera("cam", (160, 120), [[138, 0, 79.5], [0, 138, 59.5], [0, 0, 1]], T_camera_world=rigid(np.eye(3), [0.1, 0.2, 0.3]))
AXES = [[0, 1, 0], [0, 0, -1], [-1, 0, 0]]
"""X toward the camera, Y to the image's right, Z up."""


def a_picture(distance: float = 2.0, body: str = "cardbox") -> Picture:
    return Picture(make_body(body, SIZES), CAMERA, rigid(AXES, [0.0, 0.3, distance]))


def a_pose(picture: Picture, **angles: float) -> Array:
    """Arms held out, the left forearm forward; a hinge's flexion is a bend forward where the body has that instead."""
    level = {"left_shoulder_abduction": 1.5, "right_shoulder_abduction": 1.2, "left_elbow_flexion": 0.6} | angles
    bends = "left_elbow_forward" in picture.body.skeleton.dof_names
    return picture.body.skeleton.pose(**{name.replace("flexion", "forward") if bends else name: angle for name, angle in level.items()})


def a_scene(rng, picture: Picture) -> tuple[np.ndarray, np.ndarray]:
    """A picture, and a mask that is not quite that of a pose."""
    width, height = picture.camera.size
    mask = np.roll(picture.mask(a_pose(picture)), 5, axis=1)
    return rng.integers(0, 256, (height, width, 3), np.uint8), mask


def rows(frame: np.ndarray) -> list[np.ndarray]:
    return np.split(frame, 3)


def test_the_middle_row_is_the_cost_in_colours(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    ignore = np.zeros_like(mask)
    ignore[100:] = True
    pose = a_pose(picture)
    model = picture.mask(pose)
    middle = rows(overlay_frame(image, mask, picture, pose, ignore=ignore))[1]
    for colour, where in {drawing.MODEL_ONLY: model & ~mask, drawing.SILHOUETTE_ONLY: ~model & mask, drawing.WHITE: model & mask,
                          drawing.BLACK: ~model & ~mask}.items():
        np.testing.assert_array_equal((middle == colour).all(2), where & ~ignore)
        assert where.any()


@given(st.integers(0, 2**36 - 1))
def test_matching_tells_all_cases_apart(bits):
    model, mask, ignore = np.array([bits >> i & 1 for i in range(36)], bool).reshape(3, 3, 4)
    cases = (model + 2 * mask).ravel().tolist()
    found = dict(zip(cases, map(tuple, matching(model, mask).reshape(-1, 3).tolist())))
    assert len(set(found.values())) == len(found) == len(set(cases))
    np.testing.assert_array_equal(matching(model, mask, ignore)[~ignore], matching(model, mask)[~ignore])


@pytest.mark.parametrize("body", BODIES)
def test_the_model_is_drawn_where_its_silhouette_is(body):
    picture = a_picture(body=body)
    pose = a_pose(picture, torso_twist=0.5, torso_bow=0.3)
    image = np.zeros((120, 160, 3), np.uint8)
    draw_model(image, picture, pose)
    drawn, mask = image.any(2), picture.mask(pose)
    thick = mask.copy()
    for axis in (0, 1):  # outlines are a pixel or two wide
        thick |= np.roll(thick, 1, axis) | np.roll(thick, -1, axis) | np.roll(thick, 2, axis) | np.roll(thick, -2, axis)
    assert mask.sum() > 1000
    assert not (mask & ~drawn).any()
    assert not (drawn & ~thick).any()


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("behind", [False, True])
def test_what_is_nearer_hides_what_is_behind(body, behind):
    picture = a_picture(body=body)
    arm_before_chest = {"left_shoulder_abduction": -0.35, "left_shoulder_forward": 0.5, "left_elbow_flexion": 0.3}
    pose = a_pose(picture, **arm_before_chest, torso_twist=np.pi if behind else 0.0)
    arm, torso = (unpack(picture.draw(pose, shapes_of(picture.body, *parts)), 160)
                  for parts in (["left_forearm"], ["torso"]))
    image = np.zeros((120, 160, 3), np.uint8)
    draw_model(image, picture, pose)
    both = image[arm & torso].astype(float)
    hues = np.array([drawing.SIDE_COLOURS["left"], drawing.MIDDLE_COLOUR], float)
    nearest = (both @ (hues / np.linalg.norm(hues, axis=1, keepdims=True)).T).argmax(1)
    assert len(nearest) > 30
    assert (nearest == behind).mean() > 0.85


def test_the_skeleton_is_drawn_over_the_raw_picture(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    pose = a_pose(picture)
    bottom = rows(overlay_frame(image, mask, picture, pose))[2]
    points = picture.body.points(pose[None], picture.T_camera_base)[0]
    near = np.zeros(mask.shape, bool)
    for name, point in zip(picture.body.landmark_names, points):
        x, y = np.round(drawing._pixels(picture, point)).astype(int)
        if name.endswith(("elbow", "wrist")):
            assert tuple(bottom[y, x]) == drawing.WHITE
        near[max(y - 40, 0) : y + 41, max(x - 40, 0) : x + 41] = True
    np.testing.assert_array_equal(bottom[~near], image[~near])


def test_the_picture_is_seen_through_the_body_and_the_bones_are_over_it(rng):
    picture = replace(a_picture(), camera=CAMERA.resized((320, 240)))
    image, pose = rng.integers(0, 256, (240, 320, 3), np.uint8), a_pose(picture)
    both, bones = image.copy(), image.copy()
    draw_person(both, picture, pose)
    draw_skeleton(bones, picture, pose)
    drawn = (bones != image).any(2)
    for colour in (drawing.WHITE, drawing.BLACK, *drawing.SIDE_COLOURS.values()):  # all but smooth edges
        there = drawn & (bones == colour).all(2)
        assert there.sum() > 20
        np.testing.assert_array_equal(both[there], bones[there])
    body = picture.mask(pose) & ~drawn
    assert np.corrcoef(both[body].ravel(), image[body].ravel())[0, 1] > 0.5  # nothing is seen through an opaque one
    assert (both[body] != image[body]).any(1).mean() > 0.95


@pytest.mark.parametrize("body", BODIES)
def test_doubtful_parts_are_dashed_outlines_and_the_others_as_before(body):
    """The outline of a doubtful limb has gaps, and what is behind it is seen."""
    picture = replace(a_picture(body=body), camera=CAMERA.resized((640, 480)))
    pose, images = a_pose(picture), []
    arm = [part for part in picture.body.parts if part.startswith("left_")]
    for doubtful in ([], arm):
        images.append(np.full((480, 640, 3), 30, np.uint8))
        draw_model(images[-1], picture, pose, doubtful)
    whole, dashed = ((image != 30).any(2) for image in images)
    limb = unpack(picture.draw(pose, shapes_of(picture.body, *set(arm))), 640)
    others = unpack(picture.draw(pose, shapes_of(picture.body, *set(picture.body.parts) - set(arm))), 640)
    near = cv2.dilate((limb | (whole & ~others)).view(np.uint8), np.ones((9, 9))) > 0
    np.testing.assert_array_equal(images[0][~near], images[1][~near])
    alone = limb & ~(cv2.dilate(others.view(np.uint8), np.ones((7, 7))) > 0)
    assert whole[alone].mean() > 0.99
    assert 0.01 < dashed[alone].mean() < 0.5
    hue = np.array(drawing.SIDE_COLOURS["left"]) / np.linalg.norm(drawing.SIDE_COLOURS["left"])
    lines = (images[1][dashed & alone] - 30.0).clip(0)
    assert ((lines @ hue) > 0.8 * np.linalg.norm(lines, axis=1)).mean() > 0.9  # of the side's colour


def test_bones_to_doubtful_landmarks_are_dashed():
    picture = replace(a_picture(distance=1.5), camera=CAMERA.resized((640, 480)))
    pose, images = a_pose(picture), []
    for doubtful in ((), ("left_elbow", "left_wrist")):
        images.append(np.full((480, 640, 3), 30, np.uint8))
        draw_skeleton(images[-1], picture, pose, doubtful)
    points = dict(zip(picture.body.landmark_names, drawing._pixels(picture, picture.body.points(pose[None], picture.T_camera_base)[0])))
    for end, dashed in (("left", True), ("right", False)):
        start, stop = points[f"{end}_shoulder"], points[f"{end}_elbow"]
        x, y = np.round(start + np.linspace(0.15, 0.85, 60)[:, None] * (stop - start)).astype(int).T
        gaps = (images[1][y, x] == 30).all(1)
        assert gaps.any() == dashed
        assert not (images[0][y, x] == 30).all(1).any()
        assert ((images[0][y, x] == images[1][y, x]).all(1).mean() > 0.9) != dashed


def test_a_dashed_bone_that_leads_far_away_takes_no_time():
    image = np.zeros((60, 80, 3), np.uint8)
    drawing.draw_line(image, np.array([[40.0, 30.0], [1e9, 30.0]]), drawing.WHITE, 2, 9)
    assert image[30, 40:].any(1).all()


def test_without_a_pose_nothing_is_drawn(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    top, middle, bottom = rows(overlay_frame(image, mask, picture, np.full(12, np.nan)))
    np.testing.assert_array_equal(bottom, image)
    np.testing.assert_array_equal(middle, matching(np.zeros_like(mask), mask))
    assert (top <= image.max() * 0.41).all()


def test_without_a_pose_the_last_one_is_drawn_dashed(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    top, middle, bottom = rows(overlay_frame(image, mask, picture, np.full(12, np.nan), last=a_pose(picture)))
    without = rows(overlay_frame(image, mask, picture, np.full(12, np.nan)))
    np.testing.assert_array_equal(top, without[0])
    np.testing.assert_array_equal(middle, without[1])
    doubted = rows(overlay_frame(image, mask, picture, a_pose(picture), doubtful=picture.body.landmark_names))[2]
    np.testing.assert_array_equal(bottom, doubted)
    assert (doubted != rows(overlay_frame(image, mask, picture, a_pose(picture)))[2]).any()


def keypoints(*points: tuple[str, float, float, float]) -> Keypoints:
    """One person's landmarks: name, x, y, confidence."""
    names, x, y, sure = zip(*points)
    return Keypoints(names, np.array([np.stack([x, y], 1)]), np.array([sure]), np.array([-1]), "HALPE_26")


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_keypoints_are_thin_crosses_of_their_side_faint_by_confidence(size):
    image = np.full((*size[::-1], 3), 90, np.uint8)
    points = [("left_wrist", 60, 80, 1.0), ("right_wrist", 140.4, 80, 1.0), ("left_knee", 60, 160, 0.3), ("nose", 140, 160, 1.0),
              ("left_hip", np.nan, np.nan, 0.0), ("right_hip", 0, size[1] - 1, 1.0)]
    draw_keypoints(image, keypoints(*points))
    for name, x, y, sure in points[:4]:
        own, bare = image[round(y) - 3, round(x)].astype(int), np.array([90, 90, 90])
        light = (np.array(drawing.colour_of(name)) + 255) / 2
        np.testing.assert_allclose(own, sure * light + (1 - sure) * bare, atol=2)
        np.testing.assert_array_equal(image[round(y) - 3, round(x) + 3], bare)  # thin
        np.testing.assert_array_equal(image[round(y), round(x) + 2], own)
    around = (image != 90).any(2)
    assert around.sum() < 0.02 * around.size
    assert around[-1, 0], "at the picture's corner, too"


def test_crosses_are_in_the_upper_and_the_lower_row(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    found = keypoints(("nose", 30, 30, 0.9), ("left_wrist", 100, 60, 0.5))
    with_them, without = (rows(overlay_frame(image, mask, picture, a_pose(picture), keypoints=each)) for each in (found, None))
    np.testing.assert_array_equal(with_them[1], without[1])
    for row in (0, 2):
        changed = np.argwhere((with_them[row] != without[row]).any(2))
        assert {bool(np.abs(changed - (y, x)).max(1).min() == 0) for x, y in ((30, 27), (100, 57))} == {True}
        assert np.minimum(*(np.abs(changed - (y, x)).max(1) for x, y in ((30, 30), (100, 60)))).max() <= 5


def test_grey_pictures_do(rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    grey = image[..., 0]
    a, b = (overlay_frame(i, mask.astype(np.uint8) * 255, picture, a_pose(picture)) for i in (grey, np.stack([grey] * 3, 2)))
    np.testing.assert_array_equal(a, b)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(-1, 3), st.sampled_from(list(BODIES)))
def test_any_pose_at_any_distance_is_drawn(seed, distance, body):
    """Across the image's border, close to the camera and behind it."""
    picture = a_picture(distance, body)
    pose = np.random.default_rng(seed).normal(size=12) * 2
    frame = overlay_frame(np.zeros((120, 160), np.uint8), np.zeros((120, 160), bool), picture, pose)
    assert frame.shape == (360, 160, 3)
    np.testing.assert_array_equal((rows(frame)[1] == drawing.MODEL_ONLY).all(2), picture.mask(pose))


def test_pixels_far_outside_stay_far_outside_in_fixed_point_numbers():
    found = drawing._fixed(np.array([1e12, -1e12, 100.25]))
    assert found[0] > 1 << 18
    assert found[1] < -(1 << 18)
    assert found[2] == 1604


@pytest.mark.parametrize(("shapes", "said"), [
    (((60, 80, 3), (120, 160), (120, 160)), "overlay: image: found 80 x 60 pixels, the camera has 160 x 120"),
    (((120, 160), (160, 120), (120, 160)), "overlay: mask: found 120 x 160 pixels"),
    (((120, 160), (120, 160), (1, 160)), "overlay: ignore: found 160 x 1 pixels"),
])
def test_a_picture_of_another_size_is_said(shapes, said):
    picture = a_picture()
    image, mask, ignore = (np.zeros(shape, np.uint8) for shape in shapes)
    with pytest.raises(ShadowPuppetError, match=said):
        overlay_frame(image, mask, picture, a_pose(picture), ignore=ignore)


def test_a_film_of_overlays(tmp_path, rng):
    picture = a_picture()
    image, mask = a_scene(rng, picture)
    with write_frames(tmp_path / "overlay.mp4", 15) as film:
        for i in range(4):
            pose = a_pose(picture, torso_bend=0.1 * i)
            film.write(overlay_frame(image, mask, picture, pose))
    frames = list(open_frames(tmp_path / "overlay.mp4"))
    assert [round(frame.time * 15) for frame in frames] == [0, 1, 2, 3]
    assert frames[0].image.shape == (360, 160, 3)
    middle = rows(frames[0].image)[1].astype(int)
    white = picture.mask(a_pose(picture)) & mask
    assert middle[white].mean() > 220
