"""Words beside pictures, in a strip of their own: they hide nothing, and a line that is full goes on below."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from shadowpuppet.video import Image

Colour = tuple[int, int, int]
"""Blue, green, red."""
WHITE = (255, 255, 255)
Words = Sequence[tuple[str, Colour]]
"""Texts, and colours that they explain, each shown before its text; white for none."""
SMALLEST, GROWTH = 0.4, 2400
"""Least scale of the font (a capital is 9 pixels high), and the width of a picture, pixels, for which it is 1."""
LINE = 32
"""Distance of lines of text, pixels at a scale of 1."""


def strip(width: int, texts: Iterable[Words], height: int = 0) -> Image:
    """A black strip (H, width, 3) with texts, each begun on a line of its own; H is even and `height` at least. A text that is longer than
    the rest of its line stands on the next; what is longer than a line is broken at a blank, or else anywhere."""
    import cv2

    scale = max(SMALLEST, width / GROWTH)

    def wide(text: str) -> int:
        return cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0][0]

    lines = [line for words in texts for line in _lines(words, width - wide("nn"), wide)]
    high = max(height, round((LINE * len(lines) + LINE / 3) * scale))
    out = np.zeros((high + high % 2, width, 3), np.uint8)
    for n, line in enumerate(lines, 1):
        foot = round((LINE * n - LINE / 6) * scale)
        for x, text, colour in line:
            x += wide("n") // 2
            if colour != WHITE:
                cv2.rectangle(out, (x, foot - wide("n") + 2), (x + wide("n") - 3, foot), colour, -1)
                x += wide("n")
            cv2.putText(out, text, (x, foot), cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 1, cv2.LINE_AA)
    return out


def _lines(words: Words, most: int, wide: Callable[[str], int]) -> list[list[tuple[int, str, Colour]]]:
    """Lines no wider than `most` pixels: the left end, pixels, text and colour of each piece."""
    lines, x = [list[tuple[int, str, Colour]]()], 0
    for text, colour in words:
        while text:
            if x and x + wide(text) > most:
                lines, x = [*lines, []], 0
            fits = next((n for n in range(len(text), 1, -1) if x + wide(text[:n]) <= most), 1)
            if fits < len(text) and (blank := text.rfind(" ", 1, fits + 1)) > 0:
                fits = blank
            lines[-1].append((x, text[:fits], colour))
            x, text = x + wide(f"{text[:fits]}nnn"), text[fits:].lstrip()
    return lines
