from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from silhouette_scenes import CLEANED, METHODS, SIZE, dressed, empty_shots, figure, grey, overlap, scene, shot

from shadowpuppet.errors import SettingsError, SilhouetteError
from shadowpuppet.silhouette import SilhouetteSettings, learn_background, ready_mask, recover_scene
from shadowpuppet.silhouette._kernels import part_sizes, some_parts
from shadowpuppet.silhouette.boundary import SHARP_WIDTH, EdgeProfile
from shadowpuppet.silhouette.channels import wardrobe_share
from shadowpuppet.silhouette.classifiers import ChannelClassifier
from shadowpuppet.silhouette.cleanup import clean, fill_small_holes, main_part

# ---------------------------------------------------------------- silhouettes


@pytest.mark.parametrize("method", CLEANED)
def test_the_person_is_found(rng, method):
    wall, mask = scene(rng), figure()
    segmenter = learn_background(empty_shots(rng, wall), SilhouetteSettings(method=method))
    found = segmenter(shot(rng, dressed(wall, mask)))
    assert found.shape == SIZE
    assert found.dtype == bool
    assert overlap(found, mask) > 0.97
    assert found[39, 136:147].mean() > 0.8  # the finger
    assert not found[66:74, 53:60].any()  # between arm and body


@pytest.mark.parametrize("gain", [1.0, 0.8])
def test_a_silhouette_comes_with_the_frame_in_the_light_of_the_empty_scene(rng, gain):
    wall, mask = scene(rng), figure()
    segmenter, image = learn_background(empty_shots(rng, wall)), dressed(wall, mask)
    found = segmenter.segmented(segmenter.labelled(shot(rng, (image * gain).astype(image.dtype))))
    assert found.image is not None
    assert np.abs(found.image.astype(float) - image)[mask].mean() < 4


def test_it_works_from_a_single_picture_and_from_the_film_itself(rng):
    wall, mask = scene(rng), figure()
    away = empty_shots(rng, wall, 8)
    frames = [*away[:4], *(shot(rng, dressed(wall, np.roll(mask, s, 1))) for s in range(-30, 30, 10)), *away[4:]]
    for background in (shot(rng, wall), recover_scene(frames).picture):
        segmenter = learn_background([background], film=frames)
        assert overlap(segmenter(shot(rng, dressed(wall, mask))), mask) > 0.97


@pytest.mark.parametrize("method", METHODS)
def test_a_mask_depends_on_no_other_frame(rng, method):
    wall = scene(rng)
    segmenter = learn_background(empty_shots(rng, wall), SilhouetteSettings(method=method))
    image, other = shot(rng, dressed(wall, figure())), shot(rng, 255 - wall)
    first = segmenter(image)
    for _ in range(30):
        segmenter(other)
    np.testing.assert_array_equal(segmenter(image), first)
    assert image.flags.writeable


@pytest.mark.parametrize("method", METHODS)
def test_pictures_are_left_as_they_are(rng, method):
    wall = scene(rng)
    images = empty_shots(rng, wall, 4)
    kept = [i.copy() for i in images]
    learn_background(images, SilhouetteSettings(method=method), film=images)(images[0])
    for image, copy in zip(images, kept):
        np.testing.assert_array_equal(image, copy)


def test_nobody_and_everything_are_no_errors(rng):
    wall = scene(rng)
    segmenter = learn_background(empty_shots(rng, wall))
    assert not segmenter(shot(rng, wall)).any()
    assert segmenter(np.zeros((*SIZE, 3), np.uint8)).mean() > 0.95


@pytest.mark.parametrize("method", ["brightness", "colour", "both", "mog2"])
def test_shadow_is_background_and_dark_clothes_are_not(rng, method):
    wall, mask = scene(rng, (190, 140, 90)), figure()
    picture = dressed(wall, mask, shirt=(25, 25, 25))
    shade = np.zeros(SIZE, bool)
    shade[90:118, 97:150] = True
    picture[shade & ~mask] *= 0.7
    images = empty_shots(rng, wall)
    found = {s: learn_background(images, SilhouetteSettings(method=method, shadow=s))(shot(rng, picture)) for s in (True, False)}
    assert overlap(found[True], mask) > 0.95
    assert found[True][shade].mean() < 0.05
    assert found[False][shade].mean() > 0.9


def test_specks_go_and_a_hand_that_nearly_touches_stays():
    mask = np.zeros((60, 60), np.uint8)
    mask[10:40, 10:40] = 1
    mask[20:26, 41:50] = 1  # a hand
    mask[50:53, 50:53] = 1  # a speck
    mask[1:9, 52:60] = 1  # something as large as a hand, far away
    kept = main_part(mask, mask > 0)
    assert kept[10:40, 10:50].sum() == mask[10:40, 10:50].sum()
    assert kept.sum() == kept[10:40, 10:50].sum()
    assert not main_part(mask, np.zeros(mask.shape, bool)).any()


def test_of_several_people_one_far_away_stays():
    """Three people who are seen as one part, and a fourth whose area is a thirtieth of theirs."""
    mask = np.zeros((120, 120), np.uint8)
    mask[10:100, 5:70] = 1
    mask[30:54, 90:98] = 1
    mask[110:113, 110:113] = 1  # a speck
    kept = main_part(mask, mask > 0, several=True)
    assert (kept == (mask & (np.arange(120) < 105))).all()
    assert not main_part(mask, mask > 0)[30:54, 90:98].any()


def test_small_holes_are_filled_and_gaps_and_notches_are_not():
    mask = np.zeros((80, 80), np.uint8)
    mask[10:80, 10:70] = 1
    mask[20:22, 20:22] = 0
    mask[40:50, 30:40] = 0
    mask[78:80, 50:52] = 0
    filled = fill_small_holes(mask)
    assert filled[20:22, 20:22].all()
    assert not filled[40:50, 30:40].any()
    assert not filled[78:80, 50:52].any()


@given(arrays(np.int32, (5, 7), elements=st.integers(0, 5)), arrays(np.bool_, (5, 7)), arrays(np.bool_, 6))
def test_parts_are_counted_and_chosen_as_by_numpy(parts, counted, chosen):
    sizes, out = np.zeros(6, np.int64), np.empty(parts.shape, np.uint8)
    part_sizes(parts, counted, sizes)
    some_parts(parts, chosen, out)
    assert (sizes == np.bincount(parts[counted], minlength=6)).all()
    assert (out == np.isin(parts, np.flatnonzero(chosen))).all()


def test_what_hangs_on_by_a_thread_goes_and_pinholes_are_filled():
    label, contrast = np.zeros((80, 120), np.uint8), np.zeros((80, 120), np.float32)
    label[10:70, 10:70] = 2
    label[40:43, 70:100] = 1  # noise that joins
    label[35:48, 100:110] = 2  # something else
    contrast[label == 2] = 60
    contrast[label == 1] = 4
    label[30:33, 30:33] = contrast[30:33, 30:33] = 0
    found = clean(label, lambda window, where: contrast[window] * where, EdgeProfile(SHARP_WIDTH, 6))
    assert overlap(found > 0, np.pad(np.ones((60, 60), bool), ((10, 10), (10, 50)))) > 0.99
    assert found[30:33, 30:33].all()
    assert not found[:, 75:].any()


def test_the_films_noise_counts_where_the_background_is_one_clean_picture(rng):
    wall = scene(rng)
    film = [shot(rng, wall, 9) for _ in range(6)]
    plate = wall.astype(np.uint8)
    assert learn_background([plate])(film[0]).any()
    assert not any(learn_background([plate], film=film)(image).any() for image in film)


def test_a_trembling_camera_makes_no_silhouette_of_edges(rng):
    wall = np.where(np.arange(SIZE[1])[:, None] // 20 % 2, (200, 190, 180), (60, 70, 80)) + np.zeros((*SIZE, 3))
    segmenter = learn_background(empty_shots(rng, wall))
    shifted = cv2.warpAffine(wall, np.array([[1, 0, 0.12], [0, 1, 0]]), SIZE[::-1], borderMode=cv2.BORDER_REPLICATE)
    assert not (segmenter.classifier(shot(rng, shifted)) == 2).any()


# ---------------------------------------------------------------- the key


def test_black_clothes_before_dark_blue_are_keyed_by_colour(rng):
    wall, mask = scene(rng, (185, 20, 5)), figure()
    picture = dressed(wall, mask, shirt=(8, 2, 2))
    segmenter = learn_background([shot(rng, wall)])
    assert segmenter.key == "colour"
    assert "% of ordinary clothes and skin" in segmenter.reason
    assert overlap(segmenter(shot(rng, picture)), mask) > 0.95


def test_a_grey_wall_needs_both(rng):
    segmenter = learn_background(empty_shots(rng, scene(rng, (128, 135, 130))))
    assert segmenter.key == "both"
    assert segmenter.reason.startswith("both: ")


@pytest.mark.parametrize("channels", [1, 3])
def test_films_without_colour_are_keyed_by_brightness(rng, channels):
    wall, mask = scene(rng), figure()

    def filmed(picture):
        return grey(shot(rng, picture)) if channels == 1 else np.repeat(grey(shot(rng, picture))[..., None], 3, 2)

    images, image = [filmed(wall) for _ in range(8)], filmed(dressed(wall, mask, skin=(60, 60, 60)))
    segmenter = learn_background(images)
    assert segmenter.key == "brightness"
    assert "no colour" in segmenter.reason
    assert overlap(segmenter(image), mask) > 0.95
    for method in ("colour", "both"):
        with pytest.raises(SettingsError, match=f"found {method} for a film without colour, expected one of auto, averaging"):
            learn_background(images, SilhouetteSettings(method=method))


def test_the_wardrobe_is_of_true_colours(rng):
    skin = learn_background(empty_shots(rng, scene(rng, (155, 180, 225)))).classifier
    other = learn_background(empty_shots(rng, scene(rng, (225, 180, 155)))).classifier
    assert isinstance(skin, ChannelClassifier)
    assert isinstance(other, ChannelClassifier)
    assert wardrobe_share(skin) < wardrobe_share(other) - 0.03


@pytest.mark.parametrize("method", METHODS[1:])
def test_a_method_that_is_set_is_kept(rng, method):
    segmenter = learn_background(empty_shots(rng, scene(rng)), SilhouetteSettings(method=method))
    assert segmenter.key == method
    assert segmenter.reason == f"{method}: as set"


# ---------------------------------------------------------------- bad input


def test_pictures_that_do_not_fit_are_refused(rng):
    images = empty_shots(rng, scene(rng), 3)
    segmenter = learn_background(images)
    for call in (segmenter, segmenter.raw):
        with pytest.raises(SilhouetteError, match="frame: found 80 x 60 colour, expected 160 x 120 colour"):
            call(np.zeros((60, 80, 3), np.uint8))
        with pytest.raises(SilhouetteError, match="found 160 x 120 grey, expected 160 x 120 colour"):
            call(np.zeros(SIZE, np.uint8))
        with pytest.raises(SilhouetteError, match="type float64, expected 8 bits"):
            call(np.full((*SIZE, 3), np.nan))
        with pytest.raises(SilhouetteError, match=r"shape \(120, 160, 4\)"):
            call(np.zeros((*SIZE, 4), np.uint8))
    with pytest.raises(SilhouetteError, match="film frame 0: found 80 x 60"):
        learn_background(images, film=[np.zeros((60, 80, 3), np.uint8)])
    with pytest.raises(SilhouetteError, match="background frame 1: found 80 x 60"):
        learn_background([images[0], np.zeros((60, 80, 3), np.uint8)])
    with pytest.raises(SilhouetteError, match="background frame 0: found list"):
        learn_background([[1, 2]])  # pyright: ignore[reportArgumentType]


def test_no_background_is_reported(rng):
    with pytest.raises(SilhouetteError, match=r"found no frame.*film itself"):
        learn_background([])


@pytest.mark.parametrize("values", [{"method": "magic"}, {"factor": 0}, {"factor": float("nan")}, {"noise_floor": -1}, {"k": 1}])
def test_settings_are_checked(values):
    with pytest.raises(SettingsError, match=f"SilhouetteSettings: .*{next(iter(values))}"):
        SilhouetteSettings(**values)


# ---------------------------------------------------------------- ready masks


def test_ready_masks_are_read(rng):
    mask = figure()
    picture = (255 * mask).astype(np.uint8)
    np.testing.assert_array_equal(ready_mask(picture), mask)
    np.testing.assert_array_equal(ready_mask(np.repeat(picture[..., None], 3, 2)), mask)
    np.testing.assert_array_equal(ready_mask(mask), mask)
    lossy = np.clip(picture + rng.normal(0, 8, SIZE), 0, 255).astype(np.uint8)
    np.testing.assert_array_equal(ready_mask(lossy), mask)
    for value in (127, 128):
        assert ready_mask(np.where(np.arange(200) < 5, value, 0).astype(np.uint8)[None]).sum() == 5 * (value == 128)
    assert not ready_mask(np.zeros(SIZE, np.uint8)).any()


def test_what_is_no_mask_is_refused(rng):
    photo = shot(rng, scene(rng))
    with pytest.raises(SilhouetteError, match=r"in colour.*under video"):
        ready_mask(photo)
    with pytest.raises(SilhouetteError, match="neither dark nor bright"):
        ready_mask(grey(photo))
    with pytest.raises(SilhouetteError, match="values 0 and 1"):
        ready_mask(figure().astype(np.uint8))
    with pytest.raises(SilhouetteError, match="type float64"):
        ready_mask(figure().astype(float))
    with pytest.raises(SilhouetteError, match=r"shape \(3,\)"):
        ready_mask(np.zeros(3, np.uint8))


def test_importing_it_is_cheap():
    code = "import sys, shadowpuppet.silhouette; print([m for m in ('cv2', 'numba', 'av') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"


# ---------------------------------------------------------------- recordings


def read(path: Path, every: int) -> Iterator[np.ndarray]:
    from shadowpuppet.video import open_frames

    return (frame.image for frame in islice(open_frames(path), 0, None, every))


@pytest.mark.shared
@pytest.mark.parametrize("name", ["upper_body", "reaching"])
def test_recordings_are_segmented(shared, name):
    folder = shared / "recordings" / name
    images, exact = list(read(folder / "video/cam.mp4", 12)), [ready_mask(m) for m in read(folder / "masks/cam.mkv", 12)]
    segmenter = learn_background(read(folder / "background/cam.mp4", 1), film=images)
    assert segmenter.key == "both"
    found = [segmenter(i) for i in images]
    assert np.mean([overlap(a, b) for a, b in zip(found, exact)]) > 0.98
    surplus = np.mean([np.count_nonzero(a) - np.count_nonzero(b) for a, b in zip(found, exact)])
    assert abs(surplus) < 0.01 * np.mean([np.count_nonzero(m) for m in exact])
    assert 0.55 < np.mean([overlap(segmenter.raw(a), b) for a, b in zip(images, exact)]) < 0.7


@pytest.mark.shared
def test_the_dancer_is_keyed_by_colour(shared):
    folder = shared / "real" / "dancer"
    if not folder.is_dir():
        pytest.skip("the dancer is not here")
    images = list(read(folder / "video/cam.mp4", 50))
    segmenter = learn_background(read(folder / "background/cam.png", 1), film=images)
    assert segmenter.key == "colour"
    # The wall is blue, so what is hardly blue is the dancer.
    blue = [i[..., 0].astype(int) - i[..., 1:].max(axis=2) for i in images]
    assert np.mean([overlap(segmenter(i), b < 85) for i, b in zip(images, blue)]) > 0.93


def test_what_is_always_covered_is_person_in_every_frame(rng):
    wall, mask = scene(rng), figure()
    covered = np.zeros(SIZE, bool)
    covered[50:110, 70:90] = True
    hidden = wall.copy()
    hidden[covered] = dressed(wall, mask)[covered]  # the scene there is unknown: it has the shirt's colour
    without, found = (learn_background(empty_shots(rng, hidden), covered=each)(shot(rng, dressed(wall, mask))) for each in (None, covered))
    assert overlap(without, mask) < 0.9
    assert overlap(found, mask) > 0.96
    assert found[covered].all()
