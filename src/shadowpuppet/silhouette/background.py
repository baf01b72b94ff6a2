"""Statistics of the empty scene, and the noise of a film."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import SilhouetteError

Image = NDArray[np.uint8]
Floats = NDArray[np.float32]
SMOOTHING = 0.7
"""Standard deviation (pixels) of the smoothing before classification: it halves the noise. The outline is drawn without it."""
NOISY, NOISY_SMOOTHING = 3.0, 1.5
"""Noise of a film after that, grey levels of brightness, from which on it is smoothed by more; a camera in good light and web video have
less."""
EXACT = 256
"""Number of pictures whose squares' sum a float32 holds exactly: accumulating takes half the time of float64."""
UNLIKE = 8.0
"""Median difference of a frame from the empty scene, over that of the film's better frames, from which on it does not show the scene."""


@dataclass(frozen=True, eq=False)
class Background:
    """Statistics of an empty scene."""

    frames: int
    """Number of pictures they were learnt from."""
    colour: bool
    """Whether the pictures have colour channels."""
    brightness: NDArray[np.float64]
    """Mean brightness, of shape (H, W), grey levels."""
    sigma: NDArray[np.float64]
    """Standard deviation of brightness, of shape (H, W), grey levels."""
    mean: Floats
    """Mean Y, Cr, Cb, of shape (H, W, 3)."""
    smooth_sigma: Floats
    """Standard deviation of the smoothed Y, Cr, Cb, of shape (H, W, 3)."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width, pixels."""
        return self.brightness.shape[0], self.brightness.shape[1]

    @property
    def image_shape(self) -> tuple[int, ...]:
        """The shape of its pictures: (H, W, 3) or (H, W)."""
        return (*self.shape, 3) if self.colour else self.shape


def learn_statistics(images: Iterable[Image], observe: Callable[[Image], object] = lambda image: None) -> Background:
    """Means and standard deviations of pictures (H, W, 3) or (H, W); `observe` is called with each.

    Raises `SilhouetteError` for invalid pictures, pictures of different sizes or kinds, and none at all.
    """
    sums = None
    for n, image in enumerate(images):
        check_image(image, f"background frame {n}")
        if sums is None:
            sums = _Sums(image)
        check_alike(image, sums.shape, f"background frame {n}")
        sums.add(image)
        observe(image)
    if sums is None:
        raise SilhouetteError("background: found no frame, expected a picture or film of the empty scene; "
                              "without one, it is recovered from the film itself (recover_scene)")
    return sums.statistics()


class _Sums:
    """Running sums of `EXACT` pictures at a time, and of all before; exact, since pixels are integers."""

    def __init__(self, image: Image) -> None:
        self.shape, self.frames = image.shape, 0
        flat, deep = image.shape[:2], (*image.shape[:2], 3)
        self.now, self.sums = ([np.zeros(shape, kind) for shape in (flat, flat, deep, deep, deep)] for kind in (np.float32, np.float64))

    def add(self, image: Image) -> None:
        import cv2

        self.frames += 1
        grey, planes = to_brightness(image), to_planes(image)
        smooth = smoothed(planes)
        for values, first in ((grey, self.now[0]), (planes, self.now[2]), (smooth, self.now[3])):
            cv2.accumulate(values, first)
        for values, second in ((grey, self.now[1]), (smooth, self.now[4])):
            cv2.accumulateSquare(values, second)
        if self.frames % EXACT == 0:
            self._flush()

    def _flush(self) -> None:
        for total, now in zip(self.sums, self.now):
            total += now
            now[:] = 0

    def statistics(self) -> Background:
        self._flush()
        grey, grey_squares, planes, smooth, smooth_squares = self.sums

        def deviation(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            return np.sqrt(np.maximum(self.frames * second - first**2, 0) / self.frames**2)

        return Background(self.frames, len(self.shape) == 3, grey / self.frames, deviation(grey, grey_squares),
                          (planes / self.frames).astype(np.float32), deviation(smooth, smooth_squares).astype(np.float32))


class FrameSampler:
    """Keeps copies of `count` to 2 * `count` of the added frames, evenly spread; all of them if there are fewer."""

    def __init__(self, count: int) -> None:
        """A sampler without frames."""
        self.kept: list[Image] = []
        self._count, self._step, self._seen = count, 1, 0

    def add(self, image: Image) -> None:
        """Add the next frame."""
        if self._seen % self._step == 0:
            self.kept.append(np.array(image))
            if len(self.kept) == 2 * self._count:
                self.kept, self._step = self.kept[::2], 2 * self._step
        self._seen += 1


def sample_frames(images: Iterable[Image], count: int) -> list[Image]:
    """The frames that a `FrameSampler` keeps of a sequence."""
    kept = FrameSampler(count)
    for image in images:
        kept.add(image)
    return kept.kept


def film_noise(frames: list[Image], mean: Floats, smooth: Callable[[np.ndarray], np.ndarray] | None = None) -> NDArray[np.float64]:
    """Noise of a film: standard deviation (3,) of its Y, Cr, Cb, grey levels, smoothed, about the smoothed background `mean` (H, W, 3).

    smooth: what smooths them; `smoothed` by default.

    It is the 68th percentile of the differences of all pixels (one standard deviation of a normal distribution): a person covering less
    than a third of the picture hardly changes it. Frames that do not show the scene, black ones for example, are left out.
    """
    smooth = smooth or smoothed
    differences = [np.abs(smooth(to_planes(f).astype(np.float32)) - mean)[::2, ::2].reshape(-1, 3) for f in frames]
    typical = np.array([np.median(each[:, 0]) for each in differences])
    shown = typical <= UNLIKE * max(float(np.percentile(typical, 25)), 1.0)
    return np.percentile(np.concatenate([each for each, use in zip(differences, shown) if use]), 68, axis=0)


class FilmNoise(NamedTuple):
    """Noise of a film, and the smoothing that it asks for."""

    smoothing: float
    """Standard deviation of the smoothing before classification, pixels."""
    sigma: NDArray[np.float64]
    """Standard deviation (3,) of the smoothed Y, Cr, Cb about the empty scene, grey levels."""
    share: NDArray[np.float64]
    """The same (3,) over that after the least smoothing."""
    least: NDArray[np.float64]
    """The same (3,) after the least smoothing."""


def measured_noise(frames: list[Image], mean: Floats) -> FilmNoise:
    """The noise of a film's frames about the background `mean` (H, W, 3); none without frames."""
    if not frames:
        return FilmNoise(SMOOTHING, np.zeros(3), np.ones(3), np.zeros(3))
    least = film_noise(frames, smoothed(mean))
    if least[0] < NOISY:
        return FilmNoise(SMOOTHING, least, np.ones(3), least)
    more = film_noise(frames, smoothed(mean, NOISY_SMOOTHING), partial(smoothed, smoothing=NOISY_SMOOTHING))
    return FilmNoise(NOISY_SMOOTHING, more, np.minimum(more / np.maximum(least, 1e-3), 1), least)


def picture_of(background: Background) -> Image:
    """The empty scene as a picture (H, W, 3), blue green red, or (H, W) grey."""
    import cv2

    if not background.colour:
        return np.clip(np.rint(background.brightness), 0, 255).astype(np.uint8)
    planes = np.clip(np.rint(background.mean), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(planes, cv2.COLOR_YCrCb2BGR), np.uint8)


def to_planes(image: Image) -> Image:
    """Y, Cr, Cb (H, W, 3) of a picture (H, W, 3), blue green red, or (H, W), grey: neutral Cr and Cb."""
    import cv2

    if image.ndim == 3:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb), np.uint8)
    neutral = np.full_like(image, 128)
    return np.asarray(cv2.merge([image, neutral, neutral]), np.uint8)


def to_brightness(image: Image) -> Image:
    """Brightness (H, W) of a picture (H, W, 3) or (H, W)."""
    import cv2

    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def smoothed(planes: np.ndarray, smoothing: float = SMOOTHING) -> np.ndarray:
    """Planes (H, W, 3) smoothed by a small Gaussian, standard deviation `smoothing` (pixels), against pixel noise."""
    import cv2

    side = 2 * max(1, round(2 * smoothing - 0.4)) + 1
    return np.asarray(cv2.GaussianBlur(planes, (side, side), smoothing), planes.dtype)


def check_image(image: np.ndarray, name: str) -> None:
    """Raise `SilhouetteError` if `image` is no 8-bit picture (H, W) or (H, W, 3)."""
    shape = getattr(image, "shape", ())
    if len(shape) not in (2, 3) or shape[2:] not in ((), (3,)) or not image.size:
        found = f"an array of shape {shape}" if shape else type(image).__name__
        raise SilhouetteError(f"{name}: found {found}, expected a picture of shape (H, W, 3), blue green red, or (H, W), grey")
    if image.dtype != np.uint8:
        raise SilhouetteError(f"{name}: found values of type {image.dtype}, expected 8 bits, 0 to 255 (uint8)")


def check_alike(image: np.ndarray, shape: tuple[int, ...], name: str) -> None:
    """Raise `SilhouetteError` if a picture has another size or number of channels than `shape`."""
    if image.shape != shape:
        found, expected = (f"{s[1]} x {s[0]} {'grey' if len(s) == 2 else 'colour'}" for s in (image.shape, shape))
        raise SilhouetteError(f"{name}: found {found}, expected {expected} as the background; "
                              "film and background must come from one camera at one setting")
