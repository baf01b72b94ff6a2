"""Changes of light: the gain of a frame's colour channels over the empty scene, and the frame as it would be without it.

The gain is one for the picture while that is enough (exposure, white balance, flicker, sunset). Where light changes unevenly (a lamp,
vignetting by another aperture) it is a smooth surface over the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats, Image

SAMPLED = 5000
"""Number of pixels, on a grid, from which a gain is estimated."""
DARK, BRIGHT = 40, 245
"""Grey levels between which a pixel shows the gain: below, it is noise; above, it may be clipped."""
MIN_SHARE = 0.25
"""Least share of such pixels in a channel whose own gain is estimated."""
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
LEVELS = 128
"""Number of bins for the median distance of log gains from a surface."""
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
        return self._gains(self._pixels(image).reshape(self._sampled[0].shape))

    def normalised(self, image: Image) -> tuple[Image, NDArray[np.float64]]:
        """The picture divided by its gains, and the gain (C,) of each channel; the picture itself, and gains of 1, if they are negligible.

        Where the scene under this light would be clipped, the picture's difference from that is kept, not its ratio.
        """
        quick = self._ratios(image, self._few)
        if self._negligible(quick):
            return image, np.ones(self._channels)
        gains = self.gains(image)
        surface = self._surface(image, quick, gains)
        if surface is None and np.abs(np.log(gains)).max() < NEGLIGIBLE:
            return image, np.ones(self._channels)
        return self._divided(image, gains, surface), gains

    def surface(self, image: Image) -> NDArray[np.float64] | None:
        """Coefficients (6, C) of the log gain over the picture, beyond that of `gains`; None if light has changed evenly.

        The terms are 1, x, y, x^2, x y, y^2, with x and y from -1 to 1 across the picture's width and its height.
        """
        return self._surface(image, self._ratios(image, self._few), self.gains(image))

    def _pixels(self, image: Image) -> Image:
        """The sampled pixels (h, w, C) of a picture."""
        view = image[:: self._step, :: self._step]
        return view if image.ndim == 3 else view[..., None]

    def _ratios(self, image: Image, pixels: _Sampled) -> _Ratios:
        """Log ratios of picture to scene at sampled pixels."""
        from shadowpuppet.silhouette.correction._kernels import log_ratios

        rows, columns, levels, informative, terms = pixels
        beyond, use = np.empty(levels.shape, np.float32), np.empty(levels.shape, np.float32)
        log_ratios(self._pixels(image), rows, columns, levels, informative, LOG, (DARK // 2, BRIGHT), beyond, use)
        return _Ratios(terms, beyond, use)

    def _negligible(self, few: _Ratios) -> bool:
        """Whether some log ratios certainly show no change of light: less than half of what would be corrected."""
        if few.use.sum() < MIN_SHARE * few.use.size:
            return False
        found, weights = _fit(few, np.zeros(6), 1)
        own = np.einsum("cn,cn->c", weights, few.beyond) / np.maximum(weights.sum(1), 1e-6)
        return bool(np.abs(own).max() < NEGLIGIBLE / 2 and np.ptp(NODE_TERMS @ found) < UNEVEN)

    def _gains(self, pixels: Image) -> NDArray[np.float64]:
        from shadowpuppet.silhouette.correction._kernels import modes

        logs, sums = np.empty(pixels.shape[1]), np.zeros((2, BINS + 1))
        modes(pixels, *self._sampled, LOG, (DARK // 2, BRIGHT), np.float32(BIN), MIN_SHARE, WINDOW, SHIFTS, sums, logs)
        known = np.isfinite(logs)
        return np.exp(np.where(known, BIN * logs, BIN * logs[known].mean() if known.any() else 0.0))

    def _surface(self, image: Image, few: _Ratios, gains: NDArray[np.float64]) -> NDArray[np.float64] | None:
        few = few.less(np.log(gains))
        if few.use.sum() < 50 * len(gains):
            return None
        shared, _ = _fit(few, np.zeros(6), 1)
        if np.ptp(NODE_TERMS @ shared) < 2 * UNEVEN:
            return None
        shared, _ = _fit(few, shared, ROUNDS)
        terms, beyond, use = every = self._ratios(image, self._all).less(np.log(gains))
        shared, _ = _fit(every, shared, 2)
        beyond = np.asarray(beyond - shared.astype(np.float32) @ terms, np.float32)
        own = np.column_stack([_fit(_Ratios(terms, beyond[c : c + 1], use[c : c + 1]), np.zeros(6), 2)[0] for c in range(len(gains))])
        left = np.asarray(beyond - own.T.astype(np.float32) @ terms, np.float32)
        return None if self._misfit(left, use) > MISFIT else own + shared[:, None]

    def _divided(self, image: Image, gains: NDArray[np.float64], surface: NDArray[np.float64] | None) -> Image:
        """A picture divided by its gains, and by the gain of a surface (6, C) if there is one."""
        import cv2

        from shadowpuppet.silhouette.correction._kernels import divided

        factors = (1 / gains)[None, None].repeat(image.shape[1], 1).astype(np.float32)
        if surface is not None:
            nodes = (np.exp(-(NODE_TERMS @ surface)) / gains).astype(np.float32).reshape(NODES, NODES, -1)
            factors = np.asarray(cv2.resize(nodes, (image.shape[1], NODES), interpolation=cv2.INTER_LINEAR), np.float32)
        clips, out = bool(255 * factors.min() < self.scene.max()), np.empty(image.shape, np.uint8)
        before, scene, factors, after = (each.reshape(len(each), -1) for each in (np.ascontiguousarray(image), self.scene, factors, out))
        divided(before, scene, factors, clips, after)
        return out

    def _misfit(self, beyond: Floats, use: Floats) -> float:
        """Median, over blocks of the picture, of the mean log gain (C, n) that is left of pixels that count."""
        import cv2

        height, width = (-(-side // self._step) for side in self.scene.shape[:2])
        sums, counts = (cv2.resize(values.T.reshape(height, width, -1), BLOCKS, interpolation=cv2.INTER_AREA)
                        for values in (beyond * use, use))  # fmt: skip
        return float(np.median(np.abs(sums / np.maximum(counts, 1e-3))))

    @property
    def _channels(self) -> int:
        return self.scene.shape[2] if self.scene.ndim == 3 else 1

    @property
    def _step(self) -> int:
        return max(1, int(np.sqrt(self.scene.shape[0] * self.scene.shape[1] / SAMPLED)))

    @cached_property
    def _sampled(self) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Log levels of the scene's sampled pixels (n, C), and whether each can show a gain (n, C)."""
        pixels = self.scene[:: self._step, :: self._step].reshape(-1, self.scene.shape[2] if self.scene.ndim == 3 else 1)
        return LOG[pixels], (pixels > DARK) & (pixels < BRIGHT)

    @cached_property
    def _all(self) -> _Sampled:
        height, width = (-(-side // self._step) for side in self.scene.shape[:2])
        rows, columns = np.mgrid[:height, :width].reshape(2, -1)
        x, y = (2 * self._step * each / max(side - 1, 1) - 1 for each, side in zip((columns, rows), self.scene.shape[1::-1]))
        levels, informative = self._sampled
        return _Sampled(rows, columns, levels.T.copy(), informative.T.copy(), _terms(x, y).T.copy())

    @cached_property
    def _few(self) -> _Sampled:
        """A regular share of them: every n-th."""
        rows, columns, levels, informative, terms = self._all
        return _Sampled(rows[::SPARSE].copy(), columns[::SPARSE].copy(), levels[:, ::SPARSE].copy(), informative[:, ::SPARSE].copy(),
                        terms[:, ::SPARSE].copy())


class _Sampled(NamedTuple):
    """Sampled pixels of the scene."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    """Of shape (n,), among the rows and columns that are sampled."""
    levels: Floats
    """Log levels (C, n)."""
    informative: NDArray[np.bool_]
    """Whether each can show a gain (C, n)."""
    terms: Floats
    """The surface's terms (6, n)."""


class _Ratios(NamedTuple):
    """Log ratios of a picture to the scene at sampled pixels."""

    terms: Floats
    """The surface's terms (6, n) at the pixels."""
    beyond: Floats
    """Log ratios (C, n)."""
    use: Floats
    """1 where picture and scene show a gain (C, n), else 0."""

    def less(self, logs: NDArray[np.float64]) -> _Ratios:
        """The ratios less log gains (C,)."""
        return self._replace(beyond=self.beyond - logs.astype(np.float32)[:, None])


def _terms(x: NDArray[np.float64], y: NDArray[np.float64]) -> Floats:
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y]).astype(np.float32)


_MIDDLES = 2 * (np.arange(NODES) + 0.5) / NODES - 1
NODE_TERMS = _terms(np.tile(_MIDDLES, NODES), np.repeat(_MIDDLES, NODES))
"""The terms (NODES * NODES, 6) at the nodes, row by row."""


def _fit(ratios: _Ratios, found: NDArray[np.float64], rounds: int) -> tuple[NDArray[np.float64], Floats]:
    """Coefficients (6,) of the surface that most log ratios lie on, by weighted fits that begin with those in `found`, and the last one's
    weights (C, n)."""
    from shadowpuppet.silhouette.correction._kernels import surface_weights

    terms, beyond, use = ratios
    held, weights = TILTED * beyond.size * HELD, np.empty_like(beyond)
    histogram, (total, moment) = np.empty(LEVELS, np.float32), np.empty((2, terms.shape[1]), np.float32)
    for _ in range(rounds):
        surface_weights(beyond, use, found.astype(np.float32) @ terms, (SPREAD, PERSON_SPREAD), histogram, weights, total, moment)
        found = np.asarray(np.linalg.solve((terms * total) @ terms.T + held, terms @ moment), float)
    return found, weights


HELD = np.diag([0.0, 1, 1, 1, 1, 1])
"""Coefficients that are held."""
LOG = np.log(np.maximum(np.arange(256), 1)).astype(np.float32)
"""Logarithm of each grey level."""
