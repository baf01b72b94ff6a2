from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from silhouette_scenes import SIZE, empty_shots, grey, overlap, scene, shot

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette import learn_background, recover_scene
from shadowpuppet.silhouette.recovery.head import missing_head
from shadowpuppet.silhouette.recovery.separation import _persons_parts

TRUNK, LEGS, SKIN, POSTER = (120, 45, 40), (30, 32, 30), (90, 120, 190), (40, 200, 90)


def standing(wall: np.ndarray, n: int, head_still: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A person (picture, mask) who stands, sways and breathes by a pixel, and swings both arms. The picture cuts the legs."""
    sway, lift, reach = round(1.5 * np.sin(1.7 * n)), round(np.sin(2.3 * n)), round(30 * np.sin(0.9 * n))
    picture, mask = wall.copy(), np.zeros(SIZE, np.uint8)

    def draw(x, y, width, height, colour, lift=lift):
        for image, value in ((picture, colour), (mask, 1)):
            cv2.rectangle(image, (x, y + lift), (x + width, y + height + lift), value, -1)

    draw(60 + sway, 45, 36, 40, TRUNK)
    draw(62 + sway, 86, 14, 45, LEGS)
    draw(82 + sway, 86, 14, 45, LEGS)
    draw(70 + sway * (not head_still), 20, 16, 24, SKIN, lift * (not head_still))
    for side, x in ((-1, 60), (1, 96)):
        for image, colour, end in ((picture, TRUNK, 0.6), (mask, 1, 0.6), (picture, SKIN, 1), (mask, 1, 1)):
            start = (x + sway, 50) if end == 0.6 else (x + sway + int(side * 18), 50 + int(0.6 * reach))
            cv2.line(image, start, (x + sway + int(side * 30 * end), 50 + int(reach * end)), colour, 7)
    return picture, mask > 0


def film(rng: np.random.Generator, wall: np.ndarray, count=40, head_still=False) -> tuple[list[np.ndarray], list[np.ndarray]]:
    shown = [standing(wall, n, head_still) for n in range(count)]
    return [shot(rng, picture) for picture, _ in shown], [mask for _, mask in shown]


def with_poster(wall: np.ndarray) -> np.ndarray:
    """A wall with a poster that the right arm passes over."""
    out = wall.copy()
    out[25:60, 110:135] = POSTER
    return out


@pytest.mark.parametrize("furnished", [False, True])
def test_who_stands_through_the_whole_film_is_found(rng, furnished):
    wall = with_poster(scene(rng)) if furnished else scene(rng)
    frames, masks = film(rng, wall)
    found = recover_scene(frames)
    assert found.doubt is None
    assert found.frames == len(frames)
    always = np.all(masks, axis=0)
    assert (found.covered & always).sum() > 0.9 * always.sum()
    assert (found.covered & ~np.any(masks, axis=0)).sum() < 0.03 * always.sum()
    assert np.abs(found.picture.astype(float) - wall)[~found.covered & (np.mean(masks, axis=0) < 0.8)].mean() < 3
    segmenter = learn_background([found.picture], film=frames, covered=found.covered)
    overlaps = [overlap(segmenter(frame), mask) for frame, mask in zip(frames, masks)]
    assert np.median(overlaps) > 0.93
    assert min(overlaps) > 0.88


def test_a_head_that_never_moves_is_the_person_s(rng):
    frames, masks = film(rng, scene(rng), head_still=True)
    found = recover_scene(frames)
    assert found.head_still
    head = np.all(masks, axis=0)
    head[43:] = False
    assert (found.covered & head).sum() > 0.8 * head.sum()
    assert found.covered[:43].sum() < 1.6 * head.sum()
    assert not recover_scene(film(rng, scene(rng))[0]).head_still


def test_only_a_trunk_that_stands_there_throughout_is_given_a_head():
    covered, passing = np.zeros((100, 120), bool), np.zeros((20, 100, 120), bool)
    covered[50:90, 45:75] = True
    passing[:, 55:60, 20:100] = True
    head = missing_head(covered, passing)
    assert head is not None
    rows, columns = np.nonzero(head)
    assert 30 <= rows.min() < 38
    assert 46 < rows.max() <= 52
    assert abs(columns.mean() - 59.5) < 1
    seen = passing.copy()
    seen[:, 34:50, 54:66] = True  # the head, which moves
    assert missing_head(covered, seen) is None
    for n, frame in enumerate(passing):  # who walks, so that only a little is covered always
        frame[5:95, 5 * n : 5 * n + 40] = True
    assert missing_head(covered & (np.arange(100)[:, None] > 75), passing) is None
    assert missing_head(np.roll(covered, -45, axis=0), np.roll(seen, -45, axis=0) & False) is None  # above the picture


def test_the_gap_between_the_legs_is_scene(rng):
    frames, masks = film(rng, scene(rng))
    found = recover_scene(frames).covered
    assert not np.any(masks, axis=0)[110, 79]
    assert not found[95:118, 79].any()


def test_a_grey_film_serves_too(rng):
    frames, masks = film(rng, scene(rng))
    found = recover_scene([grey(frame) for frame in frames])
    assert found.picture.shape == SIZE
    assert (found.covered & np.all(masks, axis=0)).sum() > 0.7 * np.all(masks, axis=0).sum()


def test_it_is_the_same_each_time_and_leaves_the_frames_alone(rng):
    frames, _ = film(rng, scene(rng), 20)
    before = [frame.copy() for frame in frames]
    one, other = recover_scene(frames), recover_scene(frames)
    assert np.array_equal(one.picture, other.picture)
    assert np.array_equal(one.covered, other.covered)
    assert all(np.array_equal(a, b) for a, b in zip(frames, before))


def before_blue(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A person in black (picture, mask) before a blue wall of many shades, whose shadow on it moves; arms hang but in every fifth."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    wall = np.stack([200 + 40 * np.sin(x / 30), 25 + 12 * np.cos(y / 25), 3 + 0 * x], -1)
    mask, sway = np.zeros(SIZE, np.uint8), round(1.5 * np.sin(1.7 * n))
    for left, top, right, bottom in ((66, 20, 84, 42), (60, 42, 92, 90), (62, 90, 76, 119), (80, 90, 94, 119)):
        cv2.rectangle(mask, (left + sway, top), (right + sway, bottom), 1, -1)
    for side, shoulder in ((-1, 60), (1, 92)):
        hand = (shoulder + sway + side * (38 if n % 5 == 0 else 9), 48 if n % 5 == 0 else 84)
        cv2.line(mask, (shoulder + sway, 46), hand, 1, 7)
    shadow = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 6 + 2 * np.sin(n))[..., None]
    picture = np.where(mask[..., None] > 0, np.array([12, 8, 8]), wall * (1 - 0.35 * shadow))
    return shot(rng, picture.round().astype(np.uint8)), mask > 0


def test_shades_of_the_wall_beside_a_person_are_not_the_person_s(rng):
    frames, masks = map(list, zip(*(before_blue(rng, n) for n in range(60))))
    found = recover_scene(frames)
    ever, always = np.any(masks, axis=0), np.all(masks, axis=0)
    assert (found.covered & always).sum() > 0.9 * always.sum()
    assert (found.covered & ~always).sum() < 0.08 * always.sum()
    assert (found.covered & ~ever).sum() < 0.006 * always.sum()


def passing(rng: np.random.Generator, wall: np.ndarray, count=30) -> Iterator[np.ndarray]:
    """A film in which a dark block crosses the picture."""
    for n in range(count):
        picture = wall.copy()
        picture[30:110, 5 * n : 5 * n + 30] = (30, 30, 30)
        yield shot(rng, picture)


def test_behind_who_passes_all_is_seen(rng):
    wall = scene(rng)
    found = recover_scene(list(passing(rng, wall)))
    assert found.picture.shape == wall.shape
    assert found.picture.dtype == np.uint8
    assert np.abs(found.picture - wall).max() < 8
    assert not found.covered.any()


def test_changes_of_the_light_are_taken_off(rng):
    frames, masks = film(rng, scene(rng))
    lit = [np.clip(frame * (1 + 0.15 * np.sin(n / 6)), 0, 255).astype(np.uint8) for n, frame in enumerate(frames)]
    found = recover_scene(lit)
    always = np.all(masks, axis=0)
    assert (found.covered & always).sum() > 0.9 * always.sum()
    assert (found.covered & ~np.any(masks, axis=0)).sum() < 0.1 * always.sum()


def test_a_film_in_which_nothing_moves_is_doubted(rng):
    picture, _ = standing(scene(rng), 0)
    found = recover_scene([shot(rng, picture) for _ in range(20)])
    assert "nothing moves in the film" in (found.doubt or "")
    assert "--background" in (found.doubt or "")
    assert not found.covered.any()


def test_a_camera_that_moves_is_doubted(rng):
    wall = np.clip(cv2.GaussianBlur(rng.normal(0, 60, SIZE), (0, 0), 2)[..., None] * np.full(3, 5) + 128, 0, 255)
    assert "camera or the light" in (recover_scene([shot(rng, np.roll(wall, 3 * n, 1)) for n in range(20)]).doubt or "")


def test_it_needs_a_film(rng):
    with pytest.raises(SilhouetteError, match="2 frames, expected at least 3"):
        recover_scene(empty_shots(rng, scene(rng), 2))
    with pytest.raises(SilhouetteError, match="80 x 60 colour, expected 160 x 120 colour"):
        recover_scene([*empty_shots(rng, scene(rng), 3), np.zeros((60, 80, 3), np.uint8)])


def test_a_striped_skirt_belongs_to_the_person_above(rng):
    """Its stripes stir, and something small in the scene has its colour; what passes over the scene are arms and trunk alone."""
    wall, colour = scene(rng), np.array((45, 60, 50), np.uint8)
    wall[5:11, 5:11] = colour
    frames, masks = film(rng, wall)
    for n, (frame, mask) in enumerate(zip(frames, masks)):
        sway = round(1.5 * np.sin(1.7 * n))
        cloth = np.broadcast_to(colour, frame.shape).copy()
        cloth[:, sway % 3 :: 3] += np.uint8(12)
        skirt = np.s_[86:, 62 + sway : 96 + sway]
        frame[skirt] = shot(rng, cloth)[skirt]
        mask[skirt] = True
    always = np.all(masks, axis=0)
    always[:88] = False
    assert (recover_scene(frames).covered & always).sum() > 0.9 * always.sum()


def test_legs_that_keep_still_belong_to_the_person_above(rng):
    wall = scene(rng)
    frames, masks = film(rng, wall)
    legs = np.zeros(SIZE, bool)
    for x in (62, 82):
        legs[80:108, x : x + 15] = True
    still = wall.copy()
    still[legs] = LEGS
    for frame, mask in zip(frames, masks):
        frame[80:], mask[80:] = shot(rng, still)[80:], legs[80:]
    found = recover_scene(frames)
    always = np.all(masks, axis=0)
    assert (found.covered & legs).sum() > 0.9 * legs.sum()
    assert (found.covered & ~np.any(masks, axis=0)).sum() < 0.05 * always.sum()


def test_parts_of_the_person_are_large_enough_of_their_colours_and_connected():
    """Beside the largest part: one like it, one of another colour, one too small, one that nothing connects."""
    covered, ratio = np.zeros((120, 100), bool), np.zeros((120, 100))
    parts = {"trunk": (slice(40, 90), slice(30, 60), 4.0), "head": (slice(20, 35), slice(38, 50), 3.0),
             "chair": (slice(95, 110), slice(30, 60), 1.0), "speck": (slice(60, 65), slice(70, 74), 4.0),
             "lamp": (slice(5, 30), slice(80, 95), 4.0)}  # fmt: skip
    for rows, columns, value in parts.values():
        covered[rows, columns], ratio[rows, columns] = True, value
    passing = np.zeros((10, 120, 100), bool)
    passing[:, 30:100, 40:75] = True
    passing[:7, 10:50, 60:85] = True  # in seven of ten frames
    region = np.ones_like(covered)
    found = _persons_parts(covered, passing, region, ratio[region])
    assert {name for name, (rows, columns, _) in parts.items() if found[rows, columns].any()} == {"trunk", "head"}
    assert found[40:90, 30:60].all()
    passing[:8, 10:50, 60:85] = True
    assert _persons_parts(covered, passing, region, ratio[region])[5:30, 80:95].all()
    assert not _persons_parts(np.zeros_like(covered), passing, region, ratio[region]).any()
