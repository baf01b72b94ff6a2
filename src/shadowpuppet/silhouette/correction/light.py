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
UNEVEN = 0.04
"""Log gain beyond the mean, anywhere in the picture, from which on light counts as uneven."""
SPARSE = 4
"""Step over the sampled pixels in the test whether light is uneven."""
ROUNDS = 6
"""Weighted fits of a surface to some of the sampled pixels; the weights of each are by the differences to the last."""
SPREAD, PERSON_SPREAD = 0.03, 0.15
"""Standard deviation of a background pixel's log gain about the surface: the least assumed, and the greatest."""
TILTED = 0.005
"""Share of the pixels by which a surface is held level: a corner without informative pixels is not bent away."""
BLOCKS, MISFIT = (8, 6), 0.07
"""Blocks across and down, and the greatest median of what a surface leaves of their log gain: above, it is no light that has changed."""
UNIT = 128
"""A factor of 1 in 8 bits."""
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
        return self._gains(self._pixels(image))

    def normalised(self, image: Image) -> Image:
        """The picture divided by its gains; the picture itself if they are negligible.

        Where the scene under this light would be clipped, the picture's difference from that is kept, not its ratio.
        """
        import cv2

        pixels = self._pixels(image)
        gains = self._gains(pixels)
        surface = self._surface(pixels, gains)
        if surface is None and np.abs(np.log(gains)).max() < NEGLIGIBLE:
            return image
        table = np.clip(np.rint(np.arange(256)[:, None] / gains), 0, 255).astype(np.uint8)
        out = np.asarray(cv2.LUT(image, table[None] if image.ndim == 3 else table[:, 0]), np.uint8)
        if surface is not None:
            return self._evened(out, gains, surface)
        if gains.max() > 1:
            clipped = cv2.subtract(self.scene, np.append(np.floor(CLIPPED / gains), np.zeros(4 - len(gains))))
            out = np.asarray(cv2.add(out, clipped), np.uint8)
        return out

    def surface(self, image: Image) -> NDArray[np.float64] | None:
        """Coefficients (6, C) of the log gain over the picture, beyond that of `gains`; None if light has changed evenly.

        The terms are 1, x, y, x^2, x y, y^2, with x and y from -1 to 1 across the picture's width and its height.
        """
        pixels = self._pixels(image)
        return self._surface(pixels, self._gains(pixels))

    def _pixels(self, image: Image) -> Image:
        """The sampled pixels (n, C) of a picture."""
        return image[:: self._step, :: self._step].reshape(self._sampled[0].shape)

    def _ratios(self, pixels: Image, some: slice = slice(None)) -> tuple[Floats, NDArray[np.bool_]]:
        """Log ratios of picture to scene at some of its sampled pixels (n, C), and whether each shows a gain (n, C)."""
        levels, informative = self._sampled
        after = pixels[some]
        return LOG[after] - levels[some], informative[some] & (after > DARK // 2) & (after < BRIGHT)

    def _gains(self, pixels: Image) -> NDArray[np.float64]:
        from shadowpuppet.silhouette.correction._kernels import modes

        logs, sums = np.empty(pixels.shape[1]), np.zeros((2, BINS + 1))
        modes(pixels, *self._sampled, LOG, (DARK // 2, BRIGHT), np.float32(BIN), MIN_SHARE, WINDOW, SHIFTS, sums, logs)
        known = np.isfinite(logs)
        return np.exp(np.where(known, BIN * logs, BIN * logs[known].mean() if known.any() else 0.0))

    def _surface(self, pixels: Image, gains: NDArray[np.float64]) -> NDArray[np.float64] | None:
        some, logs = slice(None, None, SPARSE), np.log(gains).astype(np.float32)
        (few, use), terms = self._ratios(pixels, some), self._terms
        few = few - logs
        if use.sum() < 50 * len(gains):
            return None
        quick = _fitted(terms[some], few, use, np.zeros(6), 1)
        if np.ptp(NODE_TERMS @ quick) < 2 * UNEVEN:
            return None
        ratios, informative = self._ratios(pixels)
        beyond = ratios - logs
        shared = _fitted(terms, beyond, informative, _fitted(terms[some], few, use, quick, ROUNDS), 2)
        beyond -= (terms @ shared.astype(np.float32))[:, None]
        own = np.column_stack([_fitted(terms, beyond[:, c : c + 1], informative[:, c : c + 1], np.zeros(6), 2) for c in range(len(gains))])
        return None if self._misfit(beyond - terms @ own.astype(np.float32), informative) > MISFIT else own + shared[:, None]

    def _evened(self, image: Image, gains: NDArray[np.float64], surface: NDArray[np.float64]) -> Image:
        """A picture, divided by its gains, divided by the gain of a surface (6, C)."""
        import cv2

        def over_picture(nodes: NDArray[np.float64]) -> Image:
            values = np.clip(np.rint(nodes), 0, 255).astype(np.uint8).reshape(NODES, NODES, -1)
            return np.asarray(cv2.resize(values, image.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.uint8).reshape(image.shape)

        factors = np.exp(-(NODE_TERMS @ surface))
        out = np.asarray(cv2.multiply(image, over_picture(UNIT * factors), scale=1 / UNIT), np.uint8)
        reached = CLIPPED * factors / gains
        if reached.min() < self.scene.max():
            out = np.asarray(cv2.add(out, cv2.subtract(self.scene, over_picture(reached))), np.uint8)
        return out

    def _misfit(self, beyond: NDArray[np.floating], informative: NDArray[np.bool_]) -> float:
        """Median, over blocks of the picture, of the mean log gain (n, C) that is left of informative pixels."""
        import cv2

        height, width = (-(-side // self._step) for side in self.scene.shape[:2])
        sums, counts = (cv2.resize(values.reshape(height, width, -1).astype(np.float32), BLOCKS, interpolation=cv2.INTER_AREA)
                        for values in (beyond * informative, informative))  # fmt: skip
        return float(np.median(np.abs(sums / np.maximum(counts, 1e-3))))

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


def _fitted(terms: Floats, beyond: Floats, informative: NDArray[np.bool_], start: NDArray[np.float64], rounds: int) -> NDArray[np.float64]:
    """Coefficients (6,) of the surface that most log gains (n, C) of informative pixels lie on, from those of `start`.

    The weights of each round are Geman and McClure's.
    """
    found = start
    held = TILTED * len(terms) * beyond.shape[1] * np.diag([0, 1, 1, 1, 1, 1])
    for _ in range(rounds):
        apart = np.abs(beyond - (terms @ found.astype(np.float32))[:, None])
        scale = np.clip(1.4826 * np.median(apart[informative]), SPREAD, PERSON_SPREAD)
        weight = informative / np.square(1 + np.square(apart / np.float32(2 * scale)))
        weight, moment = weight.sum(1), (weight * beyond).sum(1)
        found = np.linalg.solve((terms * weight[:, None]).T @ terms + held, terms.T @ moment)
    return found


LOG = np.log(np.maximum(np.arange(256), 1)).astype(np.float32)
"""Logarithm of each grey level."""
