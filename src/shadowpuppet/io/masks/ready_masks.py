"""Reads a camera's ready silhouettes, however the other program wrote them: white on black or black on white, as alpha, or as labels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import count, islice
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import SilhouetteError, choices
from shadowpuppet.silhouette.external.ready_mask import THRESHOLD
from shadowpuppet.video import IMAGE_SUFFIXES, Image, open_frames, open_untimed
from shadowpuppet.video.frames import ASSUMED_RATE, Frame, FrameSource, Wanted, check_size
from shadowpuppet.video.images import Layers, in_folder, is_coloured, read_layers

LOOKED_AT = 12
"""Number of masks, spread over the film, by which the kind of all is known."""
AROUND = 0.75
"""Share of the picture's border that the background fills at least, in half of the masks."""
SOME = 0.001
"""Least share of the picture that some mask leaves to the person."""
DARK, DEEP, MOST = 64, 256, 32
"""Grey values of 8 and of 16 bit, all of them less, and the greatest number of places in a palette, that are labels."""


@dataclass(frozen=True)
class MaskKind:
    """How the masks of one camera are written."""

    layer: Literal["grey", "alpha", "labels"] = "grey"
    """Part of the pictures that shows the person."""
    person: int = 1
    """The person's label."""
    inverted: bool = False
    """Whether grey masks are black on white."""

    @property
    def words(self) -> str:
        """What is unusual about them, in words; empty if nothing is."""
        if self.layer == "alpha":
            return ", from their alpha"
        if self.layer == "labels":
            return f", label {self.person}"
        return ", black on white" if self.inverted else ""


def mask_kind(source: Path, label: int | None = None) -> MaskKind:
    """The kind of the masks in a film, picture or folder of pictures; `label`: the person's, where masks are labels.

    Raises `SilhouetteError` for several labels without a choice, for a label that no mask has, and for a label of a film; `VideoError`.
    """
    if not are_pictures(source):
        if label is not None:
            raise SilhouetteError(f"{source}: label: found {label} for masks that are a film, expected a folder of label images")
        return MaskKind(inverted=_film_is_inverted(source))
    paths = _paths(source)
    spread = np.unique(np.linspace(0, len(paths) - 1, LOOKED_AT).round().astype(int))
    layers = [read_layers(paths[n]) for n in spread]
    alphas = [each.alpha for each in layers if each.alpha is not None]
    if label is None and alphas and min(alpha.min() for alpha in alphas) < max(alpha.max() for alpha in alphas):
        return MaskKind("alpha")
    if label is not None or _are_labels(layers):
        return _label_kind(source, paths, [_numbers(each, source) for each in layers], label)
    return MaskKind(inverted=_surrounds([_grey(each.image) >= THRESHOLD for each in layers]))


def open_masks(source: Path, kind: MaskKind) -> FrameSource:
    """The masks of a kind as a source of frames (H, W) or (H, W, 3), bright inside the person; those of a folder are numbered, and need no
    rate."""
    if not are_pictures(source):
        film = open_frames(source)
        return replace(film, read=lambda wanted: _changed(film.read(wanted), np.invert)) if kind.inverted else film
    frames, paths = open_untimed(source), _paths(source)

    def read(wanted: Wanted) -> Iterator[Frame]:
        for n, path in enumerate(paths):
            if wanted(n / ASSUMED_RATE):
                image = read_mask(path, kind)
                check_size(path, n, n / ASSUMED_RATE, image, frames.size)
                yield Frame(n / ASSUMED_RATE, image)

    return replace(frames, read=read)


def read_mask(path: Path, kind: MaskKind) -> Image:
    """One mask (H, W) or (H, W, 3), bright inside the person. Raises `SilhouetteError` if it is not of the kind, `VideoError`."""
    layers = read_layers(path)
    if kind.layer == "grey":
        return np.invert(layers.image) if kind.inverted else layers.image
    if kind.layer == "labels":
        return np.multiply(_numbers(layers, path) == kind.person, 255, dtype=np.uint8)
    if layers.alpha is None:
        raise SilhouetteError(f"{path}: found a mask without alpha among masks that have it, expected all of one kind")
    return layers.alpha


def _changed(frames: Iterator[Frame], change: Callable[[Image], Image]) -> Iterator[Frame]:
    return (Frame(time, change(image)) for time, image in frames)


def are_pictures(source: Path) -> bool:
    """Whether a source is a picture, or a folder of them."""
    return source.is_dir() or source.suffix.lower() in IMAGE_SUFFIXES


def _paths(source: Path) -> list[Path]:
    return in_folder(source, ASSUMED_RATE)[0] if source.is_dir() else [source]


def _grey(image: Image) -> Image:
    return image if image.ndim == 2 else image[..., 1]


def _numbers(layers: Layers, source: Path) -> NDArray[np.uint16]:
    """Labels (H, W) of a picture. Raises `SilhouetteError` for a picture in colour."""
    if layers.numbers is not None:
        return layers.numbers
    if is_coloured(layers.image):
        raise SilhouetteError(f"{source}: found masks in colour without a palette, expected label images, the label in each pixel")
    return _grey(layers.image).astype(np.uint16)


def _are_labels(layers: list[Layers]) -> bool:
    """Whether pictures hold small numbers in place of black and white."""
    if all(each.palette for each in layers) and any(each.coloured for each in layers):
        return len(np.unique(np.concatenate([np.unique(each.numbers) for each in layers if each.numbers is not None]))) <= MOST
    if any(is_coloured(each.image) for each in layers):
        return False
    deep = all(each.numbers is not None and not each.palette for each in layers)
    greatest = max(int((each.numbers if deep and each.numbers is not None else _grey(each.image)).max()) for each in layers)
    return 0 < greatest < (DEEP if deep else DARK)


def _label_kind(source: Path, paths: list[Path], pictures: list[NDArray[np.uint16]], label: int | None) -> MaskKind:
    """The kind of label images; `pictures`: some of those at `paths`, in which a label may be missing."""
    found = _values(pictures)
    around = next((each for each in found if _surrounds([picture == each for picture in pictures])), 0)
    others = [each for each in found if each != around]
    if label is None and len(others) > 1:
        parts = ", ".join(f"{each} ({100 * np.mean([np.mean(picture == each) for picture in pictures]):.2g} %)" for each in others[:MOST])
        raise SilhouetteError(f"{source}: found masks with the labels {parts} of the picture, expected one, the person's: choose it with "
                              "--label N")
    if label is not None and label not in others:
        others = [each for each in _values(_numbers(read_layers(path), path) for path in paths) if each != around]
        if label not in others:
            raise SilhouetteError(f"{source}: label: found {label}, which is {'the background' if label == around else 'in no mask'}, "
                                  f"expected {choices(map(str, others[:MOST])) or 'masks of a person'}")
    return MaskKind("labels", label if label is not None else others[0] if others else around + 1)


def _values(pictures: Iterable[NDArray[np.uint16]]) -> list[int]:
    return sorted(set[int]().union(*(np.unique(each).tolist() for each in pictures)))


def _surrounds(masks: list[Mask]) -> bool:
    """Whether masks (H, W) show the background: they fill the border, and not the whole picture."""
    borders = [np.concatenate([mask[0], mask[-1], mask[1:-1, 0], mask[1:-1, -1]]).mean() for mask in masks]
    return bool(borders) and float(np.median(borders)) >= AROUND and min(float(mask.mean()) for mask in masks) < 1 - SOME


def _film_is_inverted(source: Path) -> bool:
    """Whether a film's masks are black on white: by the first ones, or by all if the border of these is white."""
    film = open_frames(source, grey=True)

    def bright(frame: Frame) -> Mask:
        return np.asarray(frame.image >= THRESHOLD)

    first = [bright(frame) for frame in islice(film, LOOKED_AT)]
    if not first or any(not mask[0].any() for mask in first):
        return False
    length = film.count or (film.duration * film.rate if np.isfinite(film.duration * film.rate) else 0)
    step, number = max(int(length) // LOOKED_AT, 1), count()
    return _surrounds(list(map(bright, film.read(lambda _: next(number) % step == 0))))
