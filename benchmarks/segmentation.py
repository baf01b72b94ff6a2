"""Overlap of the silhouettes of each method with the exact ones of recordings, and what they cost.

    python benchmarks/segmentation.py RECORDING... [--methods auto,averaging] [--every 5]

A recording is a folder with video/<camera>.*, background/<camera>.* and, for all but time and key, masks/<camera>.*.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
import smallest
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.silhouette import Segmenter, SilhouetteSettings, learn_background, ready_mask
from shadowpuppet.silhouette.settings import Method
from shadowpuppet.video import open_frames

Mask = NDArray[np.bool_]
NEAR = 3.0
"""Pixels from the exact outline within which an error is one of the outline."""
COLUMNS = ("recording", "camera", "method", "key", "IoU", "least", "outline px", "far false %", "far missed %", "ms/frame")


def overlap(mask: Mask, exact: Mask) -> float:
    """Intersection over union; 1 where both are empty."""
    union = np.count_nonzero(mask | exact)
    return np.count_nonzero(mask & exact) / union if union else 1.0


def outline_errors(mask: Mask, exact: Mask) -> tuple[float, float, float]:
    """By how many pixels the outline lies outside the exact one; what is wrongly seen and missed away from it, over the area."""
    pixels = exact.astype(np.uint8)
    near = (cv2.distanceTransform(pixels, cv2.DIST_L2, 5) <= NEAR) & (cv2.distanceTransform(1 - pixels, cv2.DIST_L2, 5) <= NEAR)
    false, missed, area = mask & ~exact, exact & ~mask, max(np.count_nonzero(exact), 1)
    # A digital outline crosses 4 / pi as many pixel sides as it is long.
    length = np.pi / 4 * (np.count_nonzero(pixels[1:] != pixels[:-1]) + np.count_nonzero(pixels[:, 1:] != pixels[:, :-1]))
    offset = (np.count_nonzero(false & near) - np.count_nonzero(missed & near)) / max(length, 1)
    return offset, np.count_nonzero(false & ~near) / area, np.count_nonzero(missed & ~near) / area


def pictures(path: Path, every: int = 1) -> Iterator[NDArray[np.uint8]]:
    return (frame.image for frame in islice(open_frames(path), 0, None, every))


def measure(segmenter: Segmenter, film: Path, exact: Path | None, every: int) -> list[str]:
    segmenter(next(pictures(film)))  # compiles
    spent, frames, errors = 0.0, 0, []
    truths = pictures(exact, every) if exact else None
    for image in pictures(film, every):
        start = time.perf_counter()
        mask = segmenter(image)
        spent, frames = spent + time.perf_counter() - start, frames + 1
        truth = ready_mask(next(truths)) if truths else None
        if truth is not None and truth.any():
            errors.append((overlap(mask, truth), *outline_errors(mask, truth)))
    speed = f"{1e3 * spent / frames:.2f}"
    if not errors:
        return [""] * 5 + [speed]
    iou, offset, false, missed = np.mean(errors, axis=0)
    least = min(e[0] for e in errors)
    return [f"{iou:.4f}", f"{least:.3f}", f"{offset:+.3f}", f"{100 * false:.2f}", f"{100 * missed:.2f}", speed]


def rows(recording: Path, methods: list[str], every: int) -> Iterator[list[str]]:
    for film in sorted((recording / "video").iterdir()):
        found = (sorted((recording / kind).glob(f"{film.stem}.*")) for kind in ("background", "masks"))
        background, exact = (paths[0] if paths else None for paths in found)
        for method in methods:
            name = [recording.name, film.stem, method]
            try:
                settings = SilhouetteSettings(method=method)  # pyright: ignore[reportArgumentType]
                scene = pictures(background) if background else iter(())
                segmenter = learn_background(scene, settings, film=pictures(film, every))
                yield [*name, segmenter.key, *measure(segmenter, film, exact, every)]
            except ShadowPuppetError as error:
                yield [*name, str(error).split(";")[0], *[""] * 6]


def _smallest(folder: Path) -> list[object]:
    return [smallest.make(folder / "tiny"), "--methods", "auto,averaging", "--every", 5]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", type=Path)
    parser.add_argument("--methods", default=",".join(get_args(Method)), help="separated by commas")
    parser.add_argument("--every", type=int, default=1, help="take every n-th frame")
    arguments = smallest.parse(parser, _smallest)
    table = Table(*COLUMNS)
    for recording in arguments.recordings:
        for row in rows(recording, arguments.methods.split(","), arguments.every):
            table.add_row(*row)
    Console(width=160).print(table)


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
