"""Learning of a segmenter from pictures of the empty scene and some frames of the film."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Window, bounding_window
from shadowpuppet.errors import SettingsError
from shadowpuppet.silhouette import background as scene
from shadowpuppet.silhouette.background import Background, FilmNoise, Floats, Image
from shadowpuppet.silhouette.boundary import SHARP_WIDTH, Contrast, EdgeProfile, Labels, outline_width
from shadowpuppet.silhouette.channels import KeyChoice, choose_key
from shadowpuppet.silhouette.classifiers import METHODS, ChannelClassifier, EmptyScene, edge_jitter
from shadowpuppet.silhouette.cleanup import coarse_person
from shadowpuppet.silhouette.correction.detail import lost_detail
from shadowpuppet.silhouette.correction.frame_correction import Correction
from shadowpuppet.silhouette.segmenter import Segmenter
from shadowpuppet.silhouette.settings import SilhouetteSettings

DARKEST_SHADOW = 0.5
"""Least share of its brightness that the background keeps in shadow; dark clothes are darker."""
COLOUR_FLOOR = 0.75
"""Noise floor of colours over that of brightness: codecs average colours over four pixels."""
NOISE_TAIL_FACTOR = 1.8
"""Factor on the film's measured noise: compression errors have longer tails than a normal distribution."""
FILM_SAMPLE = 12
"""Number of frames in which the film's noise and the blur of its outlines are measured; at most twice as many are used."""
MIN_EDGE_CONTRAST = 1.5
"""Least contrast on an outline, over that of a pixel that may be foreground."""
MAX_GREY_CHROMA = 2
"""Greatest deviation of colours from neutral in a film without colour, grey levels."""


def learn_background(images: Iterable[Image], settings: SilhouetteSettings | None = None, *,
                     film: Iterable[Image] | None = None, region: Window | None = None,
                     covered: NDArray[np.bool_] | None = None) -> Segmenter:
    """The `Segmenter` learnt from pictures (H, W, 3) or (H, W) of the empty scene: a film, one picture, or that of `recover_scene`.

    film: the frames to be segmented, or some spread over them: their noise and the blur of their outlines are measured. Without them the
    noise is that of `images`, and outlines count as sharp. region: rows and columns outside which nothing is a person. covered: pixels
    (H, W) that the person covers in every frame, as `recover_scene` finds them. Raises `SilhouetteError` for pictures that do not fit, and
    `SettingsError` for a method that this background does not allow.
    """
    settings = settings or SilhouetteSettings()
    observer = METHODS[settings.method].observer(settings) if settings.method in METHODS else None
    background = scene.learn_statistics(images, observer.add if observer is not None else lambda image: None)
    correction = Correction.of(scene.picture_of(background), settings, region)
    frames = plain = [correction(frame).image for frame in _sample(film, background)]
    if settings.method != "averaging" and (detail := lost_detail(correction.scene, plain)) is not None:
        correction, frames = replace(correction, detail=detail), [detail(frame) for frame in plain]
    noise = scene.measured_noise(frames, background.mean)
    channels = _channel_classifier(background, frames, settings, plain, noise)
    choice = _choose(background, frames, channels, settings)
    classifier = METHODS[choice.key].build(EmptyScene(background, channels, settings, observer))
    least = MIN_EDGE_CONTRAST * settings.factor / float(channels.inverse_sigma[..., 0].max())
    about = noise.least if frames is plain else _noise_of(plain, background, scene.SMOOTHING)
    segmenter = Segmenter(background, settings, *choice, EdgeProfile(SHARP_WIDTH, least), classifier, correction, covered,
                          noise=float(about[0]))
    return replace(segmenter, edge=EdgeProfile(_outline_width(segmenter, frames), least))


def _sample(film: Iterable[Image] | None, background: Background) -> list[Image]:
    frames = [] if film is None else scene.sample_frames(film, FILM_SAMPLE)
    for n, frame in enumerate(frames):
        scene.check_image(frame, f"film frame {n}")
        scene.check_alike(frame, background.image_shape, f"film frame {n}")
    return frames


def _channel_classifier(background: Background, frames: list[Image], settings: SilhouetteSettings,
                        plain: list[Image], noise: FilmNoise) -> ChannelClassifier:
    """The classifier of all channels; `plain`: the `frames` before lost detail was restored, or they themselves; `noise`: theirs."""
    # Without colour, dark grey clothes and a shadow are the same.
    darkest = DARKEST_SHADOW if settings.shadow and _coloured(background, frames) else 1.0
    if plain is not frames:  # what restoring leaves has long tails: blocks of wrong colours
        noise = noise._replace(sigma=_noise_of(plain, background, noise.smoothing))
    mean = scene.smoothed(background.mean, noise.smoothing)
    sigma = assumed_sigma(background, noise, settings.noise_floor, mean)
    return ChannelClassifier("both", mean, (1 / sigma).astype(np.float32), settings.factor, darkest, noise.smoothing)


def _noise_of(frames: list[Image], background: Background, smoothing: float) -> NDArray[np.float64]:
    """Noise (3,) of frames after a smoothing (pixels)."""
    return scene.film_noise(frames, scene.smoothed(background.mean, smoothing), partial(scene.smoothed, smoothing=smoothing))


def assumed_sigma(background: Background, noise: FilmNoise, noise_floor: float, mean: Floats) -> np.ndarray:
    """Standard deviation (H, W, 3) of Y, Cr, Cb assumed for the empty scene: the greatest of the learnt one, the film's noise and
    the floor, increased at the edges of the background's smoothed `mean` (H, W, 3)."""
    floor = np.maximum(noise_floor * np.array([1, COLOUR_FLOOR, COLOUR_FLOOR]), NOISE_TAIL_FACTOR * noise.sigma)
    return np.hypot(np.maximum(background.smooth_sigma * noise.share, np.maximum(floor, 1e-3)), edge_jitter(mean))


def _choose(background: Background, frames: list[Image], channels: ChannelClassifier, settings: SilhouetteSettings) -> KeyChoice:
    method = settings.method
    if method != "auto" and not METHODS[method].needs_colour:
        return KeyChoice(method, f"{method}: as set")
    if not _coloured(background, frames):
        if method == "auto":
            return KeyChoice("brightness", "brightness: the film has no colour")
        others = sorted(["auto", *(name for name, each in METHODS.items() if not each.needs_colour)])
        raise SettingsError(f"silhouette method: found {method} for a film without colour, expected one of {', '.join(others)}")
    return choose_key(channels) if method == "auto" else KeyChoice(method, f"{method}: as set")


def _coloured(background: Background, frames: list[Image]) -> bool:
    """Whether there is colour anywhere; pictures of three equal channels are grey."""
    if not background.colour:
        return False
    samples = [background.mean, *(scene.to_planes(f) for f in frames)]
    return any(np.abs(planes[::2, ::2, 1:].astype(np.float32) - 128).max() > MAX_GREY_CHROMA for planes in samples)


def _outline_width(segmenter: Segmenter, frames: list[Image]) -> int:
    def cut(frame: Image) -> tuple[Labels, Contrast]:
        """The person and the contrast in the rows and columns around them: what is beyond says nothing about the outline."""
        mask = coarse_person(segmenter.classifier(frame))
        window = bounding_window(mask, 1)
        return mask[window], segmenter.contrast(frame, window, mask[window])

    return outline_width(person for person in map(cut, frames) if person[0].any())
