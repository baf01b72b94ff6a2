"""Words beside pictures: whole at any width, in their colours, in strips of one height."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.camera.captions import WHITE, _lines, strip
from shadowpuppet.camera.drawing import CROSS, LEGEND, MATCHED

SAID = "12.34 s: tracked, trunk, both arms, both legs doubtful, overlap 0.81"


def wide(text: str) -> int:
    return cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)[0][0]


@given(st.integers(60, 1600), st.lists(st.text("abc mMiW-", min_size=1, max_size=90), min_size=1, max_size=6))
def test_nothing_is_cut_off_and_no_word_is_lost(width, texts):
    lines = _lines([(text, WHITE) for text in texts], width, wide)
    said = "".join(piece for line in lines for _, piece, _ in line)
    assert said.replace(" ", "") == "".join(texts).replace(" ", "")
    for line in lines:
        ends = [(x, x + wide(piece)) for x, piece, _ in line]
        assert all(end <= width for _, end in ends)
        assert all(end <= x for (_, end), (x, _) in itertools.pairwise(ends))


@pytest.mark.parametrize(("width", "most"), [(320, 6), (640, 4), (1600, 3), (160, 14)])
def test_legend_and_status_are_whole_and_within_the_strip(width, most):
    out = strip(width, [[*LEGEND, *MATCHED, *CROSS], [(SAID, WHITE)]])
    assert out.shape[1:] == (width, 3)
    assert len(out) % 2 == 0
    assert len(out) <= most * max(13, width / 75) + 8
    inked = out.any(2)
    assert not inked[:, -1].any()
    assert not inked[[0, -1]].any()
    for name, colour in (*LEGEND, *MATCHED):
        assert colour == WHITE or (out == colour).all(2).sum() > 12, name


def test_a_letter_is_legible_in_narrow_strips():
    """A capital is 9 pixels high, whatever the width."""
    for width in (160, 320, 640, 900):
        rows = strip(width, [[("H", WHITE)]]).any((1, 2)).nonzero()[0]
        assert np.ptp(rows) + 1 >= 9


def test_strips_of_one_height_differ_by_their_words_only():
    short, long = (strip(320, [[(text, WHITE)]]) for text in ("tracked", SAID))
    assert len(long) > len(short)
    filled = strip(320, [[("tracked", WHITE)]], len(long))
    assert filled.shape == long.shape
    np.testing.assert_array_equal(filled[: len(short)], short)
    assert not filled[len(short) :].any()
