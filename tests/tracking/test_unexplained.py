"""Parts of the silhouettes that the body leaves unexplained: what is left out, what never is, and what is taken back."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.tracking.unexplained import Unexplained, left_out, look_beside, looks_in, near, without

SIZE, LOOKS = (60, 80), 5
BODY = np.zeros(SIZE, bool)
BODY[10:50, 20:36] = True
ARM = np.zeros(SIZE, bool)
ARM[14:19, 36:56] = True
BOX = np.zeros(SIZE, bool)
BOX[30:50, 50:70] = True


def follow(silhouettes, drawn=BODY, last=None):
    for mask in silhouettes:
        last = look_beside(last, mask, drawn, LOOKS)
    return last


def with_box() -> Unexplained:
    found = follow([BODY] * LOOKS + [BODY | BOX] * (LOOKS + 3))
    assert found is not None
    return found


def test_a_thing_that_comes_and_stays_is_left_out_after_some_looks():
    before = follow([BODY] * LOOKS + [BODY | BOX] * (LOOKS - 1))
    assert left_out(before) is None
    found = with_box()
    assert found.left_out[BOX].all()
    assert not found.left_out[~BOX].any()
    assert (without(BODY | BOX, found) == BODY).all()


def test_the_body_itself_is_never_left_out_however_long_it_holds_still():
    assert left_out(follow([BODY] * 100)) is None


def test_a_limb_that_the_body_misses_from_the_first_picture_on_is_not_left_out():
    found = follow([BODY | ARM] * 40)
    assert found.stays[ARM].any()
    assert left_out(found) is None


def test_a_limb_that_is_lost_later_adds_no_area_and_is_not_left_out():
    found = follow([BODY | ARM] * LOOKS, drawn=BODY | ARM)
    assert left_out(follow([BODY | ARM] * 20, last=found)) is None


def test_a_misplaced_body_says_nothing():
    away = np.roll(BODY, 30, axis=1)
    found = follow([BODY | BOX] * 20, drawn=away, last=follow([BODY] * LOOKS))
    assert left_out(found) is None


def test_what_is_left_out_counts_again_near_the_body():
    found = with_box()
    reaching = BODY.copy()
    reaching[34:40, 20:58] = True
    beside = found.beside(reaching)
    assert beside is not None
    assert not (beside & near(reaching)).any()
    assert beside[46, 66]
    covered = np.ones(SIZE, bool)
    assert found.beside(covered) is None


def test_what_leaves_is_taken_back_at_once_by_area_and_forgotten_by_its_pixels():
    gone = follow([BODY] * (LOOKS + 2), last=with_box())
    assert left_out(gone) is None
    assert not gone.counts.any()


def test_what_moves_about_is_not_left_out():
    moving = [BODY | np.roll(BOX, 8 * n, axis=0) for n in range(30)]
    assert left_out(follow([BODY] * LOOKS + moving)) is None


def test_ignored_pixels_are_never_left_out():
    found = None
    for mask in [BODY] * LOOKS + [BODY | BOX] * 20:
        found = look_beside(found, mask, BODY, LOOKS, BOX)
    assert left_out(found) is None


def test_narrow_rims_and_specks_are_not_left_out():
    rim = np.zeros(SIZE, bool)
    rim[10:50, 45] = rim[5, 60:62] = True
    assert not follow([BODY] * LOOKS + [BODY | rim] * 20).stays.any()


def test_looks_are_seconds_times_rate_and_none_for_no_time():
    assert (looks_in(1.0, 29.97), looks_in(0.0, 30.0), looks_in(0.001, 30.0)) == (30, 0, 1)


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_only_silhouette_that_the_body_does_not_cover_becomes_left_out(seed, looks):
    rng, found = np.random.default_rng(seed), None
    for _ in range(15):
        mask = BODY | (rng.random(SIZE) < 0.3)
        before = found
        found = look_beside(found, mask, BODY, looks)
        fresh = found.left_out & ~(before.stays if before is not None else np.zeros(SIZE, bool))
        assert not (fresh & (near(BODY) | ~mask)).any()
        assert found.counts.max() <= looks


def test_a_picture_that_is_silhouette_all_over_adds_nothing_and_what_left_is_forgotten_while_the_person_is_absent():
    drawn = np.zeros((60, 80), bool)
    drawn[10:50, 30:45] = True
    last = None
    for _ in range(5):
        last = look_beside(last, drawn, drawn, 3)
    for _ in range(9):
        last = look_beside(last, np.ones_like(drawn), drawn, 3)
    assert left_out(last) is None
    thing = drawn.copy()
    thing[20:50, 55:75] = True
    for _ in range(9):
        last = look_beside(last, thing, drawn, 3)
    assert left_out(last) is not None
    for _ in range(5):
        last = look_beside(last, np.zeros_like(drawn), np.zeros_like(drawn), 3)
    assert left_out(last) is None
