"""What was added to the empty scene: found by stillness, colour and the fitted body, and put into the scene."""

import numpy as np
import pytest

from shadowpuppet.silhouette.added import AddedParts, BesideBody, always_alike, find_added, find_nobody, find_still

SIZE = (48, 64)
WALL, SHIRT, TROUSERS, WOOD = (150, 160, 170), (30, 40, 160), (120, 40, 30), (40, 90, 140)
TRUNK, LEGS, CHAIR = (np.zeros(SIZE, bool) for _ in range(3))
TRUNK[6:24, 20:32] = True
LEGS[24:44, 20:32] = True
CHAIR[16:44, 34:38] = CHAIR[24:28, 32:38] = CHAIR[24:44, 46:50] = CHAIR[24:28, 38:50] = True


def film(frames=12, chair=True, person=True, seed=0):
    """Frames of a person whose trunk sways and whose legs hold still, beside a chair; and their masks."""
    rng, images, masks = np.random.default_rng(seed), [], []
    for n in range(frames):
        image, mask = np.empty((*SIZE, 3)), np.zeros(SIZE, bool)
        image[:] = WALL
        swaying = np.roll(TRUNK, n % 3, axis=1)
        for where, colour, shown in ((CHAIR, WOOD, chair), (LEGS, TROUSERS, person), (swaying, SHIRT, person)):
            if shown:
                image[where] = colour
                mask |= where
        image[swaying & person] += 20 * rng.standard_normal()
        images.append(np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8))
        masks.append(mask)
    return images, masks


def some_of(mask, rows):
    out = np.zeros_like(mask)
    out[rows] = mask[rows]
    return out


def test_still_parts_are_what_keeps_its_value_and_is_silhouette():
    parts = find_still(*film())
    assert parts is not None
    assert parts.still[LEGS].mean() > 0.95
    assert parts.still[CHAIR].mean() > 0.95
    assert parts.still[TRUNK].mean() < 0.2
    assert not parts.still[~(TRUNK | LEGS | CHAIR)].any()
    assert parts.calm[:5].mean() > 0.9


def test_few_frames_say_nothing():
    assert find_still(*film(frames=5)) is None


def test_a_chair_is_found_as_a_whole_from_the_part_that_no_body_explains():
    parts = find_still(*film())
    added = find_added(parts, BesideBody(some_of(CHAIR, slice(30, 44)), TRUNK | LEGS))
    assert added is not None
    assert added.mask[CHAIR].mean() > 0.95
    assert not added.mask[LEGS].any()
    assert not added.mask[TRUNK].any()


def test_the_chair_is_found_although_an_arm_of_the_body_was_put_on_its_back():
    parts = find_still(*film())
    arm = some_of(CHAIR, slice(16, 22))
    added = find_added(parts, BesideBody(some_of(CHAIR, slice(28, 44)), TRUNK | LEGS | arm))
    assert added is not None
    assert added.mask[arm].all()


def test_a_leg_that_the_body_misses_has_the_colour_of_the_other_and_stays():
    parts = find_still(*film(chair=False))
    missed = LEGS & (np.arange(SIZE[1]) >= 27)
    assert find_added(parts, BesideBody(missed, TRUNK | (LEGS & ~missed))) is None


def test_what_is_small_beside_the_person_is_left_alone():
    parts = find_still(*film())
    speck = some_of(CHAIR, slice(43, 44)) & (np.arange(SIZE[1]) < 37)
    assert find_added(parts, BesideBody(speck, TRUNK | LEGS)) is None


def test_silhouettes_in_which_nothing_moves_are_nobody():
    images, masks = film(person=False)
    assert always_alike(masks)
    found = find_nobody(find_still(images, masks), masks)
    assert found is not None
    assert found.mask[CHAIR].all()


def test_a_person_who_hardly_moves_is_a_person():
    images, masks = film(chair=False)
    assert find_nobody(find_still(images, masks), masks) is None


def test_added_parts_are_put_into_each_picture_of_the_scene():
    scene = [np.full((*SIZE, 3), grey, np.uint8) for grey in (10, 20)]
    parts = AddedParts(np.full((*SIZE, 3), 99, np.uint8), CHAIR)
    first, second = parts.into(iter(scene))
    assert (first[CHAIR] == 99).all()
    assert (first[~CHAIR] == 10).all()
    assert (second[~CHAIR] == 20).all()
    assert (scene[0] == 10).all()


def test_earlier_findings_stay():
    one, two = (AddedParts(np.full((*SIZE, 3), grey, np.uint8), mask) for grey, mask in ((1, CHAIR), (2, LEGS)))
    both = one.joined(two)
    assert (both.mask == CHAIR | LEGS).all()
    assert (both.picture[LEGS] == 2).all()
    assert (both.picture[CHAIR] == 1).all()
    assert one.joined(None) is one


@pytest.mark.parametrize("scale", [(1.0, 1.0), (2.0, 3.0)])
def test_described_in_the_films_pixels(scale):
    text = AddedParts(np.zeros((*SIZE, 3), np.uint8), CHAIR).described(scale)
    assert f"x {round(32 * scale[0])} to {round(50 * scale[0])}, y {round(16 * scale[1])} to {round(44 * scale[1])}" in text


@pytest.mark.parametrize(("frames", "told"), [(8, True), (7, False)])
def test_eight_frames_tell_that_nothing_moves(frames, told):
    images, masks = film(frames=12, person=False)
    still = find_still(images, masks)
    assert (find_nobody(still, masks[:frames]) is not None) == told
    empty = [np.zeros(SIZE, bool)] * 5  # count for nothing
    assert (find_nobody(still, [*masks[:frames], *empty]) is not None) == told
