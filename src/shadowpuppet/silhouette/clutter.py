"""Static clutter in silhouettes: what is no part of the person: it stays at the same pixels and is thin, or stays behind.

Masks of other programs, and the film of a room that changed since its empty scene was filmed, show cables, chair legs and things beside
the person. `find_clutter` finds them in a sample of masks; `Clutter.removed` takes them out of each.

1. A line: pixels that are silhouette in nearly every mask, where the silhouette is thinner than half a forearm (4 cm) and longer than a
   forearm with its hand (40 cm). No part of a person is that thin and that long.
2. A thing: a part of its own that is in nearly every mask at the same pixels, and that the person has stood well aside of.

Thick things that the person never leaves, such as the seat below a person who sits, cannot be distinguished from the person by this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask, Window, bounding_window

THIN, LONG = 0.06, 0.55
"""Greatest width and least length of a line, over the square root of the person's area (some 0.7 m)."""
MAX_ABSENT = 0.1
"""Greatest share of masks in which a pixel of the clutter is not silhouette."""
MIN_SEEN = 0.3
"""Least share of masks in which the clutter is seen free of the person."""
MIN_SEEN_ON = 0.05
"""The same where a line goes on."""
MAX_BESIDE = 0.3
"""Greatest mean share of masks in which the pixels beside a line are silhouette: a strip of the person has more person on one side."""
ASIDE = 0.1
"""Distance across the picture from which on the person stands aside of a thing, over the person's height."""
MIN_THING = 0.01
"""Least area of a thing, over the person's."""
MIN_PERSON = 0.5
"""Least area of the person, over the median, in a mask in which they stand aside."""
MIN_MASKS = 8
"""Least number of masks in which clutter is looked for."""
MIN_MOVED = 0.1
"""Least median share of the silhouette that is not the same in nearly every mask: nothing is known of a person who holds still."""

Bits = NDArray[np.uint8]
"""A mask (H, W) of 0 and 1."""


class Part(NamedTuple):
    """One part of the clutter."""

    kind: str
    """`line` or `thing`."""
    box: tuple[int, int, int, int]
    """Left, top, width and height, pixels."""
    share: float
    """Share of the masks in which it is seen free of the person, or the person before it."""

    def moved(self, x: int, y: int) -> Part:
        """The part at pixels that are greater by x and y."""
        left, top, width, height = self.box
        return self._replace(box=(left + x, top + y, width, height))

    def described(self, scale: tuple[float, float]) -> str:
        """What and where it is, in words; `scale`: the film's pixels over the masks', across and down."""
        x, y, width, height = (round(value * scale[n % 2]) for n, value in enumerate(self.box))
        share = f"in {100 * self.share:.0f} % of the frames"
        if self.kind == "thing":
            return f"something that stays at x {x} to {x + width}, y {y} to {y + height} while the person goes elsewhere, {share}"
        if height >= 3 * width:
            return f"a thin upright line at x = {x + width // 2}, from y = {y} to {y + height}, {share}"
        if width >= 3 * height:
            return f"a thin level line at y = {y + height // 2}, from x = {x} to {x + width}, {share}"
        return f"a thin line within x {x} to {x + width}, y {y} to {y + height}, {share}"


@dataclass(frozen=True, eq=False)
class Clutter:
    """Pixels of one camera's silhouettes that are not the person's."""

    lines: Bits
    """Pixels (H, W) of lines, with a margin of a pixel."""
    things: Bits
    """Pixels (H, W) of things."""
    width: int
    """Least width of the gaps that lines leave in the person and that are not closed, pixels; odd."""
    parts: tuple[Part, ...] = field(default=())

    def removed(self, mask: Mask) -> Mask:
        """A copy of a mask (H, W) without the clutter; the person behind a line stays whole, and a thing that they touch is kept."""
        out = np.array(mask)
        if self.lines.any():
            self._remove_lines(out.view(np.uint8))
        if self.things.any():
            self._remove_things(out.view(np.uint8))
        return out

    @cached_property
    def _window(self) -> Window:
        return bounding_window(self.lines, self.width)

    def _remove_lines(self, bits: Bits) -> None:
        """Remove lines in place, except where silhouette lies on both of their sides."""
        import cv2

        window = self._window
        before, lines = bits[window].copy(), self.lines[window]
        bits[window][lines > 0] = 0
        rest = np.ascontiguousarray(bits[window])
        for element in _directions(self.width):
            bits[window] |= np.asarray(cv2.morphologyEx(rest, cv2.MORPH_CLOSE, element), np.uint8) & lines & before

    def _remove_things(self, bits: Bits) -> None:
        """Remove in place the connected parts that are nothing but a thing."""
        import cv2

        number, labels = cv2.connectedComponents(bits, connectivity=8)
        parts = np.asarray(labels, np.intp)
        sizes, inside = (np.bincount(parts[chosen], minlength=number) for chosen in (bits > 0, (bits > 0) & (self.things > 0)))
        alone = inside > 0.5 * sizes
        alone[0] = False
        bits[alone[parts]] = 0


def _directions(length: int) -> list[Bits]:
    """Lines of odd length, level, upright and both ways aslant, as structuring elements."""
    aslant = np.eye(length, dtype=np.uint8)
    return [np.ones((1, length), np.uint8), np.ones((length, 1), np.uint8), aslant, np.ascontiguousarray(aslant[::-1])]


def find_clutter(masks: Sequence[Mask]) -> Clutter | None:
    """Clutter in masks (H, W) that are spread over a film; None if there is none, or the masks are too few."""
    shown = [mask.view(np.uint8) for mask in masks if mask.any()]
    if len(shown) < MIN_MASKS:
        return None
    area = float(np.median([np.count_nonzero(mask) for mask in shown]))
    scale = area**0.5
    size = max(3, int(THIN * scale) + 1)
    rows, columns = bounding_window(np.maximum.reduce(shown), size + 1)
    window, corner = (rows, columns), (columns.start, rows.start)
    cut = [np.ascontiguousarray(mask[window]) for mask in shown]
    constant = np.mean(cut, axis=0) >= 1 - MAX_ABSENT
    if np.median([np.count_nonzero(mask[~constant]) for mask in cut]) < MIN_MOVED * area:
        return None
    lines, found = _lines(cut, constant, size, LONG * scale)
    things, more = _things([mask & (1 - lines) for mask in cut], constant & (lines == 0), area)
    if not found and not more:
        return None
    parts = tuple(part.moved(*corner) for part in (*found, *more))
    return Clutter(_embedded(lines, window, masks[0].shape), _embedded(things, window, masks[0].shape), 2 * (size // 2) + 5, parts)


def _embedded(bits: Bits, window: Window, shape: tuple[int, ...]) -> Bits:
    out = np.zeros(shape, np.uint8)
    out[window] = bits
    return out


def _lines(masks: Sequence[Bits], constant: Mask, size: int, length: float) -> tuple[Bits, list[Part]]:
    """Pixels of lines with a margin (H, W), and the lines: thinner than `size` pixels, at least `length` long."""
    import cv2

    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    thin, shares = np.zeros(constant.shape), np.mean(masks, axis=0)
    for mask in masks:
        thick = cv2.dilate(cv2.morphologyEx(mask, cv2.MORPH_OPEN, disk), np.ones((5, 5), np.uint8))
        thin += mask & (1 - thick)  # without the teeth that an opening leaves along every outline
    certain, possible = ((constant & (thin >= share * len(masks))).astype(np.uint8) for share in (MIN_SEEN, MIN_SEEN_ON))
    number, labels, boxes, _ = cv2.connectedComponentsWithStats(certain, connectivity=8)
    _, whole = cv2.connectedComponents(possible, connectivity=8)
    out, parts = np.zeros_like(certain), list[Part]()
    for n in range(1, number):
        if np.hypot(*boxes[n, 2:4]) >= length and _stands_free(labels == n, shares, size):
            line = whole == whole[labels == n][0]
            if not out[line].any():
                x, y, width, height = cv2.boundingRect(line.astype(np.uint8))
                parts.append(Part("line", (x, y, width, height), float(np.mean([mask[line].mean() for mask in masks]))))
            out[line] = 1
    return np.asarray(cv2.dilate(out, np.ones((3, 3), np.uint8)), np.uint8), parts


def _stands_free(line: Mask, shares: NDArray[np.float64], size: int) -> bool:
    """Whether a line has background on both sides; `shares` (H, W): share of the masks in which each pixel is silhouette."""
    import cv2

    bits = line.astype(np.uint8)
    inner, outer = (cv2.dilate(bits, np.ones((2 * reach + 1,) * 2, np.uint8)) for reach in (2, 2 + size))
    return bool(np.mean(shares[(outer > 0) & (inner == 0)]) <= MAX_BESIDE)


def _things(masks: Sequence[Bits], constant: Mask, area: float) -> tuple[Bits, list[Part]]:
    """Pixels of things (H, W), and the things; `area`: the person's, pixels."""
    import cv2

    number, labels, boxes, _ = cv2.connectedComponentsWithStats(constant.astype(np.uint8), connectivity=8)
    out, parts = np.zeros(constant.shape, np.uint8), list[Part]()
    for n in range(1, number):
        if boxes[n, cv2.CC_STAT_AREA] < MIN_THING * area:
            continue
        alone = [part for mask in masks if (part := _alone(mask, labels == n, area)) is not None]
        if len(alone) >= MIN_SEEN * len(masks):
            out |= (np.mean(alone, axis=0) >= MIN_SEEN).astype(np.uint8)
            x, y, width, height, _ = map(int, boxes[n])
            parts.append(Part("thing", (x, y, width, height), float(np.mean([mask[labels == n].mean() for mask in masks]))))
    return out, parts


def _alone(mask: Bits, thing: Mask, area: float) -> Mask | None:
    """The connected part (H, W) of a mask that has the thing, if the person stands aside of it; None otherwise."""
    import cv2

    number, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    here = int(np.bincount(labels[thing], minlength=number)[1:].argmax()) + 1 if number > 1 else 0
    others = [n for n in range(1, number) if n != here]
    if not others:
        return None
    person = max(others, key=lambda n: boxes[n, cv2.CC_STAT_AREA])
    gap = max(boxes[person, 0] - boxes[here, 0] - boxes[here, 2], boxes[here, 0] - boxes[person, 0] - boxes[person, 2])
    large, aside = boxes[person, cv2.CC_STAT_AREA] >= MIN_PERSON * area, gap >= ASIDE * boxes[person, 3]
    return labels == here if large and aside else None
