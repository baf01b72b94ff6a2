"""Scripts make masks of a film's frames: one a frame, of its size; everything else is an error that names script, film and frame."""

from __future__ import annotations

import sys
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from shadowpuppet.errors import SilhouetteError, VideoError
from shadowpuppet.external.pipes import FilmScript
from shadowpuppet.silhouette.external.masks import external_masks

SIZE = (12, 8)
FILM = Path("film.mp4")
FRAMES = [np.full((8, 12, 3), 20 * n, np.uint8) for n in range(6)]
READ = "import sys\nwidth, height = int(sys.argv[2]), int(sys.argv[3])\nread, out = sys.stdin.buffer.read, sys.stdout.buffer\n"
LOOP = READ + "while len(data := read(3 * width * height)) == 3 * width * height:\n    "
BRIGHT = LOOP + "out.write(bytes(255 * (value >= 60) for value in data[::3]))\n"


def masks(tmp_path, text, frames=FRAMES):
    (tmp_path / "mine.py").write_text(text)
    return external_masks(FilmScript([sys.executable, "-S", str(tmp_path / "mine.py")], "mine.py", FILM, SIZE), frames)


def refused(tmp_path, text, frames=FRAMES):
    with pytest.raises(SilhouetteError) as caught:
        list(masks(tmp_path, text, frames))
    return str(caught.value)


def test_a_mask_for_each_frame(tmp_path):
    made = list(masks(tmp_path, BRIGHT))
    assert [mask.shape for mask in made] == [(8, 12)] * 6
    assert [mask.dtype for mask in made] == [bool] * 6
    assert [mask.mean() for mask in made] == [0, 0, 0, 1, 1, 1]


def test_a_script_may_read_all_before_it_writes(tmp_path):
    text = READ + "data = read()\nfor n in range(0, len(data), 3 * width * height):\n    out.write(bytes(width * height))\n"
    big = [np.zeros((8, 12, 3), np.uint8)] * 3000  # more than fits into a pipe
    assert len(list(masks(tmp_path, text, big))) == 3000


def test_too_few_masks_are_counted_and_the_last_words_quoted(tmp_path):
    said = refused(tmp_path, BRIGHT.replace("out.w", "sys.stderr.write('no person\\n'); data[0] < 90 and out.w"))
    assert said == ("mine.py: film.mp4: found 5 masks, expected 6, one for each frame; the script's last words: "
                    + " | ".join(6 * ["no person"]))


def test_a_script_that_stops_reading_is_no_success(tmp_path):
    frames = [np.zeros((8, 12, 3), np.uint8)] * 5000
    assert "found 1 masks, expected" in refused(tmp_path, READ + "read(3 * width * height); out.write(bytes(width * height))\n", frames)


def test_more_masks_than_frames(tmp_path):
    assert "found more masks than the film's 6 frames of 12 x 8 pixels" in refused(tmp_path, BRIGHT + "out.write(data * 0 + bytes(500))\n")


def test_part_of_a_mask(tmp_path):
    assert "frame 6: found 10 bytes, expected the frame's width x height = 96 bytes" in refused(tmp_path, BRIGHT + "out.write(bytes(10))\n")


def test_wide_numbers_are_no_masks(tmp_path):
    floats = BRIGHT.replace("bytes(255", "__import__('array').array('f', (1.0").replace("[::3])", "[::3]))").replace(">= 60", ">= 0")
    said = refused(tmp_path, floats)
    assert said.startswith("mine.py: film.mp4: frame 0: mask: found 25 % of the pixels neither dark nor bright")


def test_ones_instead_of_255(tmp_path):
    assert "frame 3: mask: found the values 0 and 1" in refused(tmp_path, BRIGHT.replace("255 * ", ""))


def test_a_failing_script_is_quoted(tmp_path):
    said = refused(tmp_path, BRIGHT.replace("out.w", "if data[0] > 40: raise MemoryError('no room')\n    out.w"))
    assert said.startswith("mine.py: film.mp4: the script failed after 3 masks (exit code 1); its last words: Traceback")
    assert said.endswith("MemoryError: no room")


def test_a_program_that_is_not_there():
    with pytest.raises(SilhouetteError, match=r"mine.py: gone/python cannot be started \(no such file"):
        next(external_masks(FilmScript(["gone/python", "mine.py"], "mine.py", FILM, SIZE), FRAMES))


def test_the_film_s_errors_are_raised_as_they_are(tmp_path):
    def broken():
        yield from FRAMES[:2]
        raise VideoError("film.mp4: broken")

    with pytest.raises(VideoError, match=r"film\.mp4: broken"):
        list(masks(tmp_path, BRIGHT, broken()))


def test_the_script_ends_when_no_more_masks_are_wanted(tmp_path):
    made = masks(tmp_path, BRIGHT + "    out.flush()\n", ([*FRAMES] * 10_000))
    assert len(list(islice(made, 3))) == 3
    made.close()
