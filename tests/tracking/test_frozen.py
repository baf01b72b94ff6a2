"""Frozen pictures: what counts as the same silhouette, and which cameras are set aside, named and taken back."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Seen
from shadowpuppet.tracking.frozen import FROZEN_FRAMES, CameraWatch, is_frozen, same_silhouette
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch

RATE = 20


def person(x: int) -> np.ndarray:
    mask = np.zeros((60, 80), bool)
    mask[10:50, x : x + 12] = True
    return mask


def film(frozen: CameraWatch, positions: list[tuple[int | None, ...]]) -> list[tuple[bool, ...]]:
    """Which cameras are set aside in each frame; None: a camera without a picture."""
    found = []
    for n, row in enumerate(positions):
        masks = [None if x is None else person(x) for x in row]
        kept = frozen(n / RATE, masks)
        assert all(a is b for a, b in zip(kept, masks) if a is not None)
        found.append(tuple(a is None and b is not None for a, b in zip(kept, masks)))
    return found


def test_a_camera_that_freezes_is_set_aside_by_name_and_taken_back():
    frozen = CameraWatch(3)
    found = film(frozen, [(n, n, n) if n < 5 or n > 24 else (n, 5, n) for n in range(30)])
    assert not any(any(row) for row in found[:8])
    assert not any(any(row) for row in found[25:])
    assert all(row == (False, True, False) for row in found[11:25])
    (interval,) = frozen.aside.intervals
    assert (interval.camera, interval.why) == (1, "frozen")
    assert interval.begin <= 11 / RATE < interval.end == pytest.approx(24 / RATE)
    assert interval.frames == round((interval.end - interval.begin) * RATE) + 1


def test_keypoints_of_a_frozen_camera_are_set_aside_with_its_silhouette():
    watch, aside = RigWatch(3), []
    for n in range(25):
        masks = [person(n), person(5 if n >= 5 else n), person(n)]
        keypoints = tuple(Keypoints(("nose",), np.ones((1, 1, 2)), np.ones((1, 1)), np.array([k]), "made") for k in range(3))
        seen = watch(n / RATE, Seen(tuple(masks), keypoints=keypoints))
        kept = seen.masks
        assert [each is None for each in seen.keypoints] == [each is None for each in kept]
        assert all(a is None or a is b for a, b in zip(kept, masks))
        aside.append([a is None for a in kept])
        watch.tracked(())
    assert aside[-1] == [False, True, False]
    (interval,) = watch.intervals
    assert (interval.camera, interval.why) == (1, "frozen")


def test_keypoints_without_silhouettes_are_never_set_aside():
    keypoints = tuple(Keypoints(("nose",), np.ones((1, 1, 2)), np.ones((1, 1)), np.array([k]), "made") for k in range(3))
    watch, seen = RigWatch(3), Seen((None,) * 3, keypoints=keypoints)
    for n in range(25):
        assert watch(n / RATE, seen).keypoints == keypoints
        watch.tracked(())
    assert not watch.intervals


def test_who_stands_still_freezes_no_camera():
    assert not any(any(row) for row in film(CameraWatch(3), [(3, 3, 3)] * 30))


def test_an_empty_picture_is_not_frozen():
    frozen = CameraWatch(3)
    for n in range(30):
        masks = [person(n), person(n), np.zeros((60, 80), bool)]
        assert frozen(n / RATE, masks)[2] is masks[2]


def test_a_camera_whose_picture_turns_black_is_set_aside_at_once_and_named():
    watch = CameraWatch(3)
    for n in range(12):
        masks = [person(n), person(n), np.ones((60, 80), bool) if 4 <= n < 8 else person(n)]
        assert (watch(n / RATE, masks)[2] is None) == (4 <= n < 8)
    (interval,) = watch.aside.intervals
    assert (interval.camera, interval.why, interval.frames) == (2, "blind", 4)


def test_two_cameras_always_stay():
    assert not any(any(row) for row in film(CameraWatch(2), [(n, 3) for n in range(30)]))
    assert not any(any(row) for row in film(CameraWatch(3), [(n, None, 3) for n in range(30)]))


def test_repeated_frames_of_a_film_converted_to_a_higher_rate_are_no_fault():
    rows = [(n, n - n % FROZEN_FRAMES, n) for n in range(40)]
    assert not any(any(row) for row in film(CameraWatch(3), rows))


def test_a_silhouette_is_the_same_up_to_what_a_codec_changes():
    one, other = person(20), person(20)
    assert same_silhouette(one, other)
    large = np.kron(one, np.ones((5, 5), bool))
    changed = large.copy()
    changed[0, :10] = True
    assert same_silhouette(large, changed)
    changed[0, :100] = True
    assert not same_silhouette(large, changed)
    assert not same_silhouette(one, large)


def test_a_film_converted_to_a_higher_rate_is_not_frozen():
    assert not is_frozen(3, 3 / 60)
    assert not is_frozen(4, 4 / 120)
    assert not is_frozen(2, 2.0)
    assert is_frozen(4, 4 / 15)


def test_one_camera_is_never_set_aside_but_noted_as_blind():
    watch, full = RigWatch(1), np.ones((60, 80), bool)
    kept = [watch(n / RATE, Seen((picture,))).masks for n, picture in enumerate([person(3), full, full, *[person(3)] * 30])]
    assert all(masks[0] is not None for masks in kept)
    (interval,) = watch.intervals
    assert (interval.camera, interval.why, interval.frames) == (0, "blind", 2)
    assert (interval.begin, interval.end) == (1 / RATE, 2 / RATE)
