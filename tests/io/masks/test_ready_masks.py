"""Masks as other programs write them: white on black, black on white, alpha, palettes, labels."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from png import palette_png

from shadowpuppet.errors import SilhouetteError, VideoError
from shadowpuppet.io.masks.ready_masks import mask_kind, open_masks
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.video import write_frames, write_image

NUMBER, SIZE = 15, (50, 40)
DAVIS, GREYS = (0, 0, 0, 128, 0, 0, 0, 128, 0), tuple(value for value in range(256) for _ in range(3))


def person(n: int, top: int = 8) -> np.ndarray:
    """A mask (H, W) that moves; nobody in the first three frames."""
    out = np.zeros(SIZE[::-1], bool)
    if n > 2:
        out[top : top + 20, 10 + n : 20 + n] = True
    return out


def png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def photo(mask: np.ndarray) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (*mask.shape, 3), np.uint8)


def white(mask: np.ndarray) -> np.ndarray:
    return np.where(mask, 255, 0).astype(np.uint8)


KINDS = {
    "white on black": (lambda m: png(white(m)), ""),
    "black on white": (lambda m: png(white(~m)), ", black on white"),
    "16 bit": (lambda m: png(white(m).astype(np.uint16) * 257), ""),
    "a cut-out": (lambda m: png(np.dstack([photo(m), white(m)])), ", from their alpha"),
    "white with alpha": (lambda m: png(np.dstack([np.full((*m.shape, 3), 255, np.uint8), white(m)])), ", from their alpha"),
    "opaque": (lambda m: png(np.dstack([white(m)] * 3 + [np.full_like(white(m), 255)])), ""),
    "a palette": (lambda m: palette_png(m, DAVIS), ", label 1"),
    "a clear palette": (lambda m: palette_png(m, DAVIS, (0, 255, 255)), ", from their alpha"),
    "a palette of greys": (lambda m: palette_png(white(m), GREYS), ""),
    "label 7, places of greys": (lambda m: palette_png(7 * m, GREYS), ", label 7"),
    "ones": (lambda m: png(m.astype(np.uint8)), ", label 1"),
    "ones of 16 bit": (lambda m: png(m.astype(np.uint16)), ", label 1"),
    "200 of 16 bit": (lambda m: png(200 * m.astype(np.uint16)), ", label 200"),
    "label 0 in 5": (lambda m: palette_png(np.where(m, 0, 5), (*DAVIS, *DAVIS)), ", label 0"),
}


@pytest.mark.parametrize("name", KINDS)
def test_masks_of_every_kind_are_the_person(tmp_path, name):
    written, words = KINDS[name]
    for n in range(NUMBER):
        (tmp_path / f"{n:05d}.png").write_bytes(written(person(n)))
    kind = mask_kind(tmp_path)
    frames = list(open_masks(tmp_path, kind))
    assert (kind.words, len(frames)) == (words, NUMBER)
    for n, frame in enumerate(frames):
        np.testing.assert_array_equal(ready_mask(frame.image), person(n), str(n))


@pytest.mark.parametrize("form", [lambda labels: palette_png(labels, DAVIS), lambda labels: png(labels.astype(np.uint8))])
def test_of_several_labels_one_is_chosen(tmp_path, form):
    for n in range(NUMBER):
        (tmp_path / f"{n}.png").write_bytes(form(np.where(person(n), 2, np.roll(person(n), -9, 1))))
    with pytest.raises(SilhouetteError, match=r"found masks with the labels 1 \(\d\S* %\), 2 \(\d\S* %\) of the picture, expected one, the "
                                              "person's: choose it with --label N"):
        mask_kind(tmp_path)
    for n, frame in enumerate(open_masks(tmp_path, mask_kind(tmp_path, 2))):
        np.testing.assert_array_equal(frame.image > 0, person(n))


def test_a_label_that_no_mask_has_is_named(tmp_path):
    for n in range(NUMBER):
        (tmp_path / f"{n:02d}.png").write_bytes(png(3 * person(n).astype(np.uint8) + 2 * (n == 7) * np.roll(person(n), -9, 1)))
    assert mask_kind(tmp_path, 3).person == 3
    with pytest.raises(SilhouetteError, match="label: found 9, which is in no mask, expected "):
        mask_kind(tmp_path, 9)
    with pytest.raises(SilhouetteError, match="label: found 0, which is the background, expected "):
        mask_kind(tmp_path, 0)


def test_a_label_that_few_masks_have_is_found(tmp_path):
    for n in range(60):
        (tmp_path / f"{n:02d}.png").write_bytes(png((1 + 3 * (n == 31)) * person(9).astype(np.uint8)))
    assert mask_kind(tmp_path, 4).person == 4


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("number", [NUMBER, 60])
def test_films_of_masks_may_be_black_on_white(tmp_path, inverted, number):
    with write_frames(tmp_path / "cam.mkv", 25, lossless=True) as film:
        for n in range(number):
            film.write(white(person(max(n - number + NUMBER, 0)) ^ inverted))
    kind = mask_kind(tmp_path / "cam.mkv")
    assert kind.inverted == inverted
    for n, frame in enumerate(open_masks(tmp_path / "cam.mkv", kind)):
        np.testing.assert_array_equal(ready_mask(frame.image), person(max(n - number + NUMBER, 0)))
    with pytest.raises(SilhouetteError, match="label: found 1 for masks that are a film"):
        mask_kind(tmp_path / "cam.mkv", 1)


def test_a_person_at_the_border_is_no_background(tmp_path):
    for n in range(NUMBER):
        near = np.zeros(SIZE[::-1], bool)
        near[4:, 2:-2] = True  # fills the bottom and most of the picture
        write_image(tmp_path / f"{n}.png", white(near))
    assert not mask_kind(tmp_path).inverted


def test_masks_that_cover_all_stay_so(tmp_path):
    write_image(tmp_path / "0.png", np.full(SIZE[::-1], 255, np.uint8))
    (frame,) = open_masks(tmp_path, mask_kind(tmp_path))
    assert ready_mask(frame.image).all()


def test_folders_of_masks_need_no_rate_and_cut_outs_no_other_kind(tmp_path):
    for n in range(NUMBER):
        (tmp_path / f"{n:05d}.png").write_bytes(KINDS["a cut-out"][0](person(n)))
    (tmp_path / f"{NUMBER - 2:05d}.png").write_bytes(png(white(person(9))))
    with pytest.raises(SilhouetteError, match=r"00013.png: found a mask without alpha among masks that have it"):  # no warning before
        list(open_masks(tmp_path, mask_kind(tmp_path)))
    (tmp_path / "00000.png").write_bytes(KINDS["a palette"][0](person(3))[:60])
    with pytest.raises(VideoError, match=r"00000.png: not a picture that can be read"):
        mask_kind(tmp_path)


def test_photographs_are_no_masks(tmp_path):
    (tmp_path / "0.png").write_bytes(png(photo(person(3))))
    (frame,) = open_masks(tmp_path, mask_kind(tmp_path))
    with pytest.raises(SilhouetteError, match="found a picture in colour"):
        ready_mask(frame.image)
    with pytest.raises(SilhouetteError, match="found masks in colour without a palette, expected label images"):
        mask_kind(tmp_path, 1)
