"""From pictures of the empty scene, and some of the film, to a segmenter."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from shadowpuppet.errors import SettingsError
from shadowpuppet.silhouette import background as scene
from shadowpuppet.silhouette.background import Background, Image
from shadowpuppet.silhouette.boundary import SHARP, Outline, disc, outline_width
from shadowpuppet.silhouette.channels import Choice, choose_key
from shadowpuppet.silhouette.classifiers import SAMPLES, KeyRule, MixtureRule, NeighbourRule, PlainRule
from shadowpuppet.silhouette.cleanup import coarse_person
from shadowpuppet.silhouette.light import Light
from shadowpuppet.silhouette.segmenter import Segmenter, plain_rule
from shadowpuppet.silhouette.settings import SilhouetteSettings

DARKEST_SHADOW = 0.5
"""Least share of its light that a background keeps in a shadow; dark clothes are darker."""
COLOUR_FLOOR = 0.75
"""Floor under the standard deviation of colours over that of brightness: codecs average colours over four pixels."""
LONG_TAIL = 1.8
"""Standard deviation assumed over the film's own: errors of compression have longer tails than a normal distribution."""
FILM_SAMPLE = 12
"""Frames (to twice as many) of the film in which its noise and the blur of its outlines are measured."""
LEAST_CONTRAST = 1.5
"""Contrast on an outline, over that of a pixel that may be foreground."""
EDGES = 0.05
"""Standard deviation added at the background's own edges, over the change of its value across a pixel: cameras tremble."""
NEUTRAL_WITHIN = 2
"""Grey levels by which colours may stray in a film without colour."""
Rule = KeyRule | PlainRule | MixtureRule | NeighbourRule


def learn_background(images: Iterable[Image], settings: SilhouetteSettings | None = None, *,
                     film: Iterable[Image] | None = None) -> Segmenter:
    """Learn the empty scene from its pictures (H, W, 3) or (H, W): a film, a single picture, or `background_from_film`.

    `film`: the pictures to be segmented, or some spread over it. They tell its noise and how blurred its outlines are; without
    them the noise is that of `images`, and outlines count as sharp. Raises `SilhouetteError` for pictures that do not fit, and
    `SettingsError` for a method that this background does not allow.
    """
    settings = settings or SilhouetteSettings()
    mixture, samples = MixtureRule(settings.shadow), scene.Spread(SAMPLES)
    see = {"mog2": mixture.learn, "knn": samples.add}.get(settings.method, lambda image: None)
    background = scene.learn_statistics(images, see)
    light = Light(scene.picture_of(background))
    frames = [light.normalised(frame) for frame in _sample(film, background)]
    basis = _key_rule(background, frames, settings)
    choice = _choose(background, frames, basis, settings)
    rules: dict[str, Callable[[], Rule]] = {
        "averaging": lambda: plain_rule(background, settings.factor),
        "mog2": lambda: mixture,
        "knn": lambda: _neighbours(samples, basis),
    }
    rule = rules.get(choice.key, lambda: replace(basis, key=choice.key))()
    least = LEAST_CONTRAST * settings.factor / float(basis.inverse_sigma[..., 0].max())
    segmenter = Segmenter(background, settings, *choice, Outline(SHARP, least), rule, light)
    return replace(segmenter, outline=Outline(_outline_width(segmenter, frames), least))


def _neighbours(samples: scene.Spread, basis: KeyRule) -> NeighbourRule:
    pictures = np.stack(samples.kept)
    return NeighbourRule(pictures.reshape(*pictures.shape[:3], -1), basis if basis.darkest < 1 else None)


def _sample(film: Iterable[Image] | None, background: Background) -> list[Image]:
    frames = [] if film is None else scene.spread(film, FILM_SAMPLE)
    for n, frame in enumerate(frames):
        scene.check_image(frame, f"film frame {n}")
        scene.check_alike(frame, background.image_shape, f"film frame {n}")
    return frames


def _key_rule(background: Background, frames: list[Image], settings: SilhouetteSettings) -> KeyRule:
    import cv2

    mean = scene.smoothed(background.mean)
    floor = settings.noise_floor * np.array([1, COLOUR_FLOOR, COLOUR_FLOOR])
    if frames:
        floor = np.maximum(floor, LONG_TAIL * scene.film_noise(frames, mean))
    across = cv2.dilate(mean, disc(1)) - cv2.erode(mean, disc(1))
    sigma = np.hypot(np.maximum(background.smooth_sigma, np.maximum(floor, 1e-3)), EDGES * across)
    # Without colour, dark grey clothes and a shadow are the same.
    darkest = DARKEST_SHADOW if settings.shadow and _coloured(background, frames) else 1.0
    return KeyRule("both", mean, (1 / sigma).astype(np.float32), settings.factor, darkest)


def _choose(background: Background, frames: list[Image], basis: KeyRule, settings: SilhouetteSettings) -> Choice:
    if settings.method not in ("auto", "colour", "both"):
        return Choice(settings.method, f"{settings.method}: as set")
    if not _coloured(background, frames):
        if settings.method == "auto":
            return Choice("brightness", "brightness: the film has no colour")
        raise SettingsError(f"silhouette method: found {settings.method} for a film without colour, "
                            "expected one of auto, averaging, brightness, knn, mog2")
    return choose_key(basis) if settings.method == "auto" else Choice(settings.method, f"{settings.method}: as set")


def _coloured(background: Background, frames: list[Image]) -> bool:
    """Whether any colour is seen anywhere; pictures of three equal channels are grey."""
    if not background.colour:
        return False
    seen = [background.mean, *(scene.to_planes(f) for f in frames)]
    return any(np.abs(planes[::2, ::2, 1:].astype(np.float32) - 128).max() > NEUTRAL_WITHIN for planes in seen)


def _outline_width(segmenter: Segmenter, frames: list[Image]) -> int:
    people = ((coarse_person(segmenter.rule(frame)), segmenter.contrast(frame)) for frame in frames)
    return outline_width((mask, contrast) for mask, contrast in people if mask.any())
