from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette.quality import mask_quality

SIZE = (60, 80)


def person(x=40, y=20, width=12, height=30, size=SIZE) -> np.ndarray:
    """A block that stands for a person, centred at column x, from row y on."""
    mask = np.zeros(size, bool)
    mask[max(y, 0) : y + height, max(x - width // 2, 0) : x + width // 2] = True
    return mask


def walking(count=40) -> list[np.ndarray]:
    """A person who crosses the picture without touching its sides, a pixel a frame."""
    return [person(20 + n) for n in range(count)]


def test_good_silhouettes_raise_no_word():
    quality = mask_quality(iter(walking()))
    assert quality.frames == 40
    assert quality.area == pytest.approx(12 * 30 / (60 * 80))
    assert (quality.area_change, quality.area_jumps, quality.flicker) == (0, 0, 0)
    assert (quality.specks, quality.speck_area, quality.holes, quality.hole_area) == (0, 0, 0, 0)
    assert (quality.empty, quality.full, quality.first_empty, quality.first_full) == (0, 0, None, None)
    assert quality.border == {"left": 0, "right": 0, "top": 0, "bottom": 0}
    assert quality.warnings() == ()
    assert quality.refusal() is None


@given(st.integers(0, 2**32 - 1))
def test_mirrored_silhouettes_are_as_good(seed):
    rng = np.random.default_rng(seed)
    masks = [rng.random((9, 11)) < 0.4 for _ in range(6)]
    one, other = mask_quality(masks), mask_quality(m[::-1, ::-1] for m in masks)
    assert one.area == other.area
    assert one.flicker == other.flicker
    assert one.specks == pytest.approx(other.specks)
    assert one.hole_area == pytest.approx(other.hole_area)
    assert (one.border["left"], one.border["top"]) == (other.border["right"], other.border["bottom"])


@given(st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_figures_stay_in_their_ranges(density, seed):
    rng = np.random.default_rng(seed)
    quality = mask_quality(rng.random((7, 8)) < density for _ in range(5))
    for share in (quality.area, quality.area_change, quality.area_jumps, *quality.border.values()):
        assert 0 <= share <= 1
    for figure in (quality.flicker, quality.specks, quality.speck_area, quality.holes, quality.hole_area):
        assert figure >= 0
    for sentence in (*map(str, quality.warnings()), quality.refusal() or ""):
        assert "nan" not in sentence


@pytest.mark.parametrize(("side", "place"), [("left", {"x": 3}), ("right", {"x": 77}), ("top", {"y": 0})])
def test_a_person_partly_outside_is_reported(side, place):
    masks = [*walking(30), *[person(**place)] * 20]
    quality = mask_quality(masks)
    assert quality.border[side] == pytest.approx(20 / 50)
    assert sum(quality.border.values()) == pytest.approx(20 / 50)
    assert any(f"touches the {side} border in 40 % of the frames: the person is partly outside" in w for w in quality.warnings())


def test_legs_cut_by_the_lower_border_are_right_and_one_pixel_is_noise():
    masks = [person(y=30) for _ in range(20)]
    for mask in masks:
        mask[5, 0] = True
    quality = mask_quality(masks)
    assert quality.border == {"left": 0, "right": 0, "top": 0, "bottom": 1}
    assert quality.warnings() == ()


def test_empty_frames_are_reported_and_mostly_empty_films_refused():
    nobody = np.zeros(SIZE, bool)
    quality = mask_quality([*walking(30), nobody, nobody, *walking(18)])
    assert (quality.empty, quality.first_empty) == (2, 30)
    assert any("empty in 4 % of the frames, first in frame 30" in w for w in quality.warnings())
    assert quality.area == pytest.approx(12 * 30 / (60 * 80))
    assert mask_quality([nobody] * 60 + walking()).area == quality.area
    refused = mask_quality([nobody] * 19 + walking(1))
    assert "empty in 95 % of the frames" in (refused.refusal() or "")
    assert refused.warnings() == ()


def test_full_frames_are_reported_and_mostly_full_films_refused():
    everything = np.ones(SIZE, bool)
    quality = mask_quality([*walking(36), everything, everything, everything, everything])
    assert (quality.full, quality.first_full) == (4, 36)
    assert any("is silhouette in 10 % of the frames, first in frame 36" in w for w in quality.warnings())
    assert "the light changed or the camera moved" in (mask_quality([everything] * 6 + walking(4)).refusal() or "")


def test_no_frame_at_all_is_refused():
    quality = mask_quality([])
    assert quality.frames == 0
    assert "no frames" in (quality.refusal() or "")


def test_specks_and_holes_are_counted_and_told():
    masks = walking(20)
    for mask in masks:
        mask[2:6, 2:6] = mask[2:6, 70:74] = True
        mask[25:35, 0] = False
    quality = mask_quality(masks)
    assert quality.specks == 2
    assert quality.speck_area == pytest.approx(32 / 360)
    assert any("2.0 parts beside the person, 9 % of its area" in w for w in quality.warnings())
    masks = [person(40) for _ in range(20)]
    for mask in masks:
        mask[24:32, 37:43] = False
    quality = mask_quality(masks)
    assert quality.holes == 1
    assert quality.hole_area == pytest.approx(48 / (360 - 48))
    assert any("1.0 holes, 15 % of its area" in w for w in quality.warnings())


def test_a_gap_that_is_open_to_the_outside_is_no_hole():
    mask = person()
    mask[20:30, 38:42] = False
    assert mask_quality([mask]).holes == 0
    mask = person(y=30)
    mask[50:, 38:42] = False
    assert mask_quality([mask]).holes == 0


def test_flicker_is_noise_and_not_motion(rng):
    still = [person() for _ in range(20)]
    noisy = [mask ^ (rng.random(SIZE) < 0.02) for mask in still]
    quality = mask_quality(noisy)
    # A pixel differs from both neighbours in time if it alone is wrong, or only they are.
    expected = (0.02 * 0.98**2 + 0.98 * 0.02**2) * 60 * 80 / 360
    assert quality.flicker == pytest.approx(expected, rel=0.25)
    assert any("flicker from frame to frame" in w for w in quality.warnings())
    assert mask_quality(walking()).flicker == 0
    jumping = walking(60)
    jumping[20:26] = [person(15 + 25 * (n % 2)) for n in range(6)]  # to and fro, as nobody does for long
    assert mask_quality(jumping).flicker == 0


def test_lost_parts_are_reported():
    quality = mask_quality(person(height=30 if n % 10 else 15) for n in range(40))
    assert quality.area_jumps == pytest.approx(7 / 39)
    assert any("changes by over 25 % at once" in w for w in quality.warnings())
    quality = mask_quality(person(height=30 - 3 * (n % 2)) for n in range(40))
    assert quality.area_jumps == 0
    assert quality.area_change == pytest.approx(0.1)
    assert any("changes by 10 % from frame to frame" in w for w in quality.warnings())


def test_a_tiny_person_is_reported():
    quality = mask_quality(person(50 + n, 50, 4, 12, (240, 320)) for n in range(5))
    assert any("0.062 % of the picture: too little to see limbs" in w for w in quality.warnings())


def test_what_is_no_silhouette_is_refused():
    with pytest.raises(SilhouetteError, match=r"silhouette 0: found uint8 of shape \(60, 80\), expected true and false"):
        mask_quality([person().astype(np.uint8)])
    with pytest.raises(SilhouetteError, match="silhouette 1: found 80 x 30 pixels, expected 80 x 60"):
        mask_quality([person(), person()[:30]])
    with pytest.raises(SilhouetteError, match="silhouette 0: found int"):
        mask_quality([3])  # pyright: ignore[reportArgumentType]


@pytest.mark.shared
@pytest.mark.parametrize("name", ["upper_body/masks/cam.mkv", "reaching/masks/cam.mkv", "jogging/masks/cam5.mkv"])
def test_exact_silhouettes_raise_no_word(shared, name):
    from shadowpuppet.silhouette import ready_mask
    from shadowpuppet.video import open_frames

    quality = mask_quality(ready_mask(frame.image) for frame in open_frames(shared / "recordings" / name))
    assert quality.warnings() == ()
    assert quality.refusal() is None


@pytest.mark.shared
def test_the_plain_rule_is_called_noisy(shared):
    from shadowpuppet.silhouette import SilhouetteSettings, learn_background
    from shadowpuppet.video import open_frames

    folder = shared / "recordings" / "upper_body"
    background = (frame.image for frame in open_frames(folder / "background/cam.mp4"))
    plain = learn_background(background, SilhouetteSettings(method="averaging"))
    film = islice(open_frames(folder / "video/cam.mp4"), 100)
    warnings = mask_quality(plain(frame.image) for frame in film).warnings()
    assert any("flicker" in w for w in warnings)
    assert any("parts beside the person" in w for w in warnings)


@pytest.mark.parametrize("jumps", [0.0, 1.0])
def test_complaints_about_ready_masks_speak_of_masks(jumps):
    spoilt = replace(mask_quality([person()] * 3), frames=10, empty=2, full=2, first_empty=1, first_full=4, flicker=1, speck_area=1,
                     holes=99, area_change=1, area_jumps=jumps, ready=True)
    cautions, refusals = spoilt.warnings(), [replace(spoilt, **{kind: 10}).refusal() for kind in ("empty", "full")]
    assert len(cautions) == 6
    for said in (*cautions, *(each.short for each in cautions), *refusals):
        assert not any(word in said for word in ("light", "scene", "background", "clothes", "colours", "camera", "method")), said
    assert sum("masks" in said for said in (*cautions, *refusals)) == 8
    made = replace(spoilt, ready=False)
    assert all("masks" not in said for said in (*made.warnings(), replace(made, full=10).refusal()))
