"""Recordings whose exact silhouettes are spoiled, as segmentation spoils them: for `ablations.py`."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from shadowpuppet.video import open_frames, write_frames

Mask = NDArray[np.bool_]
Spoil = Callable[[np.random.Generator, Mask], Mask]

THICK = 1 / 120
"""How much of the picture's height outlines are moved by: 2 pixels of 240."""
HOLES, HOLE = 6, 0.04
"""So many discs a frame, with radii of this share of the person's height."""
FLICKER = 0.1
"""Share of the frames, of each camera by itself, in which half the person is missing."""


def grown(_: np.random.Generator, mask: Mask) -> Mask:
    """Wider on all sides."""
    return cv2.dilate(mask.astype(np.uint8), _disc(THICK * len(mask))) > 0


def eroded(_: np.random.Generator, mask: Mask) -> Mask:
    """Thinner on all sides."""
    return cv2.erode(mask.astype(np.uint8), _disc(THICK * len(mask))) > 0


def holes(rng: np.random.Generator, mask: Mask) -> Mask:
    """Discs that are missing, others in every frame."""
    return mask & ~_discs(rng, mask, mask)


def specks(rng: np.random.Generator, mask: Mask) -> Mask:
    """Discs beside the person, others in every frame."""
    return mask | _discs(rng, mask, np.ones_like(mask))


def flicker(rng: np.random.Generator, mask: Mask) -> Mask:
    """Now and then the upper or the lower half is missing."""
    rows = np.flatnonzero(mask.any(1))
    if rng.random() >= FLICKER or not len(rows):
        return mask
    out, middle = mask.copy(), (rows[0] + rows[-1]) // 2
    out[slice(None, middle) if rng.random() < 0.5 else slice(middle, None)] = False
    return out


SPOILS: dict[str, Spoil] = {"grown": grown, "eroded": eroded, "holes": holes, "specks": specks, "flicker": flicker}


def spoiled(recording: Path, name: str, folder: Path) -> Path:
    """A recording like another one, its ready silhouettes spoiled in one of the ways `SPOILS`; made where it is missing."""
    out = folder / f"{recording.name}_{name}"
    if (out / "made").exists():
        return out
    (out / "masks").mkdir(parents=True, exist_ok=True)
    for path in recording.iterdir():
        if path.name not in ("masks", "made") and not (out / path.name).exists():
            (out / path.name).symlink_to(path.resolve())
    for path in sorted((recording / "masks").iterdir()):
        frames = open_frames(path)
        rng = np.random.default_rng(list(hashlib.sha256(f"{recording.name} {name} {path.stem}".encode()).digest()))
        with write_frames(out / "masks" / path.name, frames.rate, lossless=True) as film:
            for frame in frames:
                mask = SPOILS[name](rng, frame.image[..., 0] > 127)
                film.write(np.uint8(255) * mask)
    (out / "made").touch()
    return out


def _disc(radius: float) -> NDArray[np.uint8]:
    size = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)).astype(np.uint8)


def _discs(rng: np.random.Generator, mask: Mask, where: Mask) -> Mask:
    """Discs of the size of holes, their middles where they may be."""
    out, places = np.zeros(mask.shape, np.uint8), np.argwhere(where)
    if not mask.any():
        return out > 0
    radius = max(1, round(HOLE * np.ptp(np.flatnonzero(mask.any(1)))))
    for y, x in places[rng.integers(len(places), size=HOLES)].tolist():
        cv2.circle(out, (x, y), radius, 1, -1)
    return out > 0
