"""Changes of light: the gain of a frame's colour channels over the empty scene, and the frame as it would be without it.

The gain is one for the picture while that is enough (exposure, white balance, flicker, sunset). Where light changes unevenly (a lamp,
vignetting by another aperture) it is a smooth surface over the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats, Image

SAMPLED = 5000
"""Number of pixels, on a grid, from which a gain is estimated."""
DARK, BRIGHT = 40, 245
"""Grey levels between which a pixel shows the gain: below, it is noise; above, it may be clipped."""
MIN_SHARE = 0.25
"""Least share of such pixels in a channel whose own gain is estimated."""
CLIPPED = 255
"""Grey level at which a camera's pixels are clipped."""
BINS, BIN = 512, 0.008
"""Histogram of log gains: number and width of bins, the middle one at a gain of 1."""
WINDOW = 15
"""Half width, in bins, of the window that the mean shift moves onto the background's pixels."""
SHIFTS = 5
"""Steps of the mean shift."""
NEGLIGIBLE = 0.02
"""Log gain up to which a frame is left unchanged: rounding and codecs alone cause as much."""
UNEVEN = 0.03
"""Log gain beyond the mean, anywhere in the picture, from which on light counts as uneven."""
SPARSE = 4
"""Of so many sampled pixels one is used to find out whether light is uneven."""
ROUNDS = 8
"""Weighted fits of a surface; the weights of each are by the differences to the last."""
SPREAD, PERSON_SPREAD = 0.03, 0.15
"""Standard deviation of a background pixel's log gain about the surface: the least assumed, and the greatest."""
TILTED = 0.02
"""Share of the pixels by which a surface is held level: a corner without informative pixels is not bent away."""
BLOCKS, MISFIT = (8, 6), 0.07
"""Blocks across and down, and the greatest median of what a surface leaves of their log gain: above, it is no light that has changed."""
NODES = 24
"""Number of the surface's nodes across the picture, between which it is interpolated."""


@dataclass(frozen=True, eq=False)
class Light:
    """Estimates, and removes from a frame, changes of light since the empty scene."""

    scene: Image
    """Mean picture of the empty scene, of shape (H, W, 3), blue green red, or (H, W)."""

    def gains(self, image: Image) -> NDArray[np.float64]:
        """Gain of each channel (C,) of a picture like the scene: the mode of the ratio picture to scene over pixels.

        The mode is the background's even if the person covers nearly half of the picture. A channel in which too few pixels
        show a gain, such as red in a blue room, has the mean of the others; all have 1 if no channel shows one.
        """
        levels, informative = self._sampled
        step = self._step
        after = image[::step, ::step].reshape(levels.shape)
        informative = informative & (after > DARK // 2) & (after < BRIGHT)
        bins = np.rint((LOG[after] - levels) / BIN).astype(np.intp) + BINS // 2
        logs = np.array([_mode(bins[use, c]) if use.mean() >= MIN_SHARE else np.nan for c, use in enumerate(informative.T)])
        known = np.isfinite(logs)
        return np.exp(np.where(known, logs, logs[known].mean() if known.any() else 0.0))

    def normalised(self, image: Image) -> Image:
        """The picture divided by its gains; the picture itself if they are negligible.

        Where the scene under this light would be clipped, the picture's difference from that is kept, not its ratio.
        """
        import cv2

        gains = self.gains(image)
        surface = self.surface(image, gains)
        if surface is not None:
            return self._evened(image, surface)
        if np.abs(np.log(gains)).max() < NEGLIGIBLE:
            return image
        table = np.clip(np.rint(np.arange(256)[:, None] / gains), 0, 255).astype(np.uint8)
        out = np.asarray(cv2.LUT(image, table[None] if image.ndim == 3 else table[:, 0]), np.uint8)
        if gains.max() > 1:
            clipped = cv2.subtract(self.scene, np.append(np.floor(CLIPPED / gains), np.zeros(4 - len(gains))))
            out = np.asarray(cv2.add(out, clipped), np.uint8)
        return out

    def surface(self, image: Image, gains: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Coefficients (6, C) of the log gain over the picture, of `gains` and what differs from them; None if they are even.

        The terms are 1, x, y, x^2, x y, y^2, with x and y from -1 to 1 across the picture's width and its height.
        """
        levels, informative = self._sampled
        step = self._step
        after = image[::step, ::step].reshape(levels.shape)
        informative = informative & (after > DARK // 2) & (after < BRIGHT)
        terms = self._terms
        some = slice(None, None, SPARSE)
        if informative[some].sum() < 50 * len(gains):
            return None
        logs = np.log(gains)
        beyond = (LOG[after] - levels - logs.astype(np.float32)) * informative
        quick = _surface(terms[some], beyond[some], informative[some], 1)
        if np.ptp(NODE_TERMS @ quick) < 2 * UNEVEN:
            return None
        shared = _surface(terms, beyond, informative, ROUNDS)
        beyond -= informative * (terms @ shared)[:, None]
        own = np.column_stack([_surface(terms, beyond[:, c : c + 1], informative[:, c : c + 1], 3) for c in range(len(gains))])
        if self._misfit(beyond - terms @ own, informative) > MISFIT:
            return None
        own += shared[:, None]
        own[0] += logs
        return own

    def _misfit(self, beyond: Floats, informative: NDArray[np.bool_]) -> float:
        """Median, over blocks of the picture, of the mean log gain (n, C) that is left of informative pixels."""
        import cv2

        height, width = (-(-side // self._step) for side in self.scene.shape[:2])
        sums, counts = (cv2.resize(values.reshape(height, width, -1).astype(np.float32), BLOCKS, interpolation=cv2.INTER_AREA)
                        for values in (beyond * informative, informative))  # fmt: skip
        return float(np.median(np.abs(sums / np.maximum(counts, 1e-3))))

    def _evened(self, image: Image, surface: NDArray[np.float64]) -> Image:
        """A picture divided by the gain of a surface (6, C)."""
        import cv2

        height, width = image.shape[:2]
        nodes = np.exp(-(NODE_TERMS @ surface)).reshape(NODES, NODES, -1).astype(np.float32)
        factor = cv2.resize(nodes, (width, height), interpolation=cv2.INTER_LINEAR).reshape(image.shape)
        out = cv2.multiply(image, factor, dtype=cv2.CV_8U)
        clipped = cv2.subtract(self.scene, CLIPPED * factor, dtype=cv2.CV_8U)
        return np.asarray(cv2.add(out, clipped), np.uint8)

    @property
    def _step(self) -> int:
        return max(1, int(np.sqrt(self.scene.shape[0] * self.scene.shape[1] / SAMPLED)))

    @cached_property
    def _sampled(self) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Log levels of the scene's sampled pixels (n, C), and whether each can show a gain (n, C)."""
        pixels = self.scene[:: self._step, :: self._step].reshape(-1, self.scene.shape[2] if self.scene.ndim == 3 else 1)
        return LOG[pixels], (pixels > DARK) & (pixels < BRIGHT)

    @cached_property
    def _terms(self) -> Floats:
        """The surface's terms (n, 6) at the sampled pixels."""
        height, width = self.scene.shape[:2]
        y, x = np.mgrid[: height : self._step, : width : self._step].reshape(2, -1)
        return _terms(2 * x / max(width - 1, 1) - 1, 2 * y / max(height - 1, 1) - 1)


def _terms(x: NDArray[np.float64], y: NDArray[np.float64]) -> Floats:
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y]).astype(np.float32)


_MIDDLES = 2 * (np.arange(NODES) + 0.5) / NODES - 1
NODE_TERMS = _terms(np.tile(_MIDDLES, NODES), np.repeat(_MIDDLES, NODES))
"""The terms (NODES * NODES, 6) at the nodes, row by row."""


def _surface(terms: Floats, beyond: Floats, informative: NDArray[np.bool_], rounds: int) -> NDArray[np.float64]:
    """Coefficients (6,) of the surface that most log gains (n, C) of informative pixels lie on; weights are Geman and McClure's."""
    found = np.zeros(terms.shape[1])
    held = TILTED * len(terms) * beyond.shape[1] * np.diag([0, 1, 1, 1, 1, 1])
    for _ in range(rounds):
        apart = np.abs(beyond - (terms @ found.astype(np.float32))[:, None])
        scale = np.clip(1.4826 * np.median(apart[informative]), SPREAD, PERSON_SPREAD)
        weight = informative / np.square(1 + np.square(apart / (2 * scale)))
        weight, moment = weight.sum(1), (weight * beyond).sum(1)
        found = np.linalg.solve((terms * weight[:, None]).T @ terms + held, terms.T @ moment)
    return found


LOG = np.log(np.maximum(np.arange(256), 1)).astype(np.float32)
"""Logarithm of each grey level."""


def _mode(bins: NDArray[np.intp]) -> float:
    """The mode of log gains, given as histogram bins; by mean shift from the fullest part of the histogram."""
    counts = np.bincount(np.clip(bins, 0, BINS - 1), minlength=BINS).astype(float)
    total, moment = (np.concatenate([[0], np.cumsum(values)]) for values in (counts, counts * np.arange(BINS)))
    narrow = WINDOW // 3
    middle = float(np.argmax(total[2 * narrow + 1 :] - total[: -2 * narrow - 1]) + narrow)
    for _ in range(SHIFTS):
        first, last = max(0, round(middle) - WINDOW), min(BINS, round(middle) + WINDOW + 1)
        middle = (moment[last] - moment[first]) / (total[last] - total[first])
    return (middle - BINS // 2) * BIN
