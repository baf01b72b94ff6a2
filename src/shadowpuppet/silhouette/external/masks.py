"""Masks that a segmentation script makes of a film's frames."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from contextlib import closing
from typing import IO

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import SilhouetteError
from shadowpuppet.external.pipes import FilmScript, Output
from shadowpuppet.silhouette.external.ready_mask import ready_mask
from shadowpuppet.video import Image, Size


def external_masks(script: FilmScript, frames: Iterable[Image]) -> Generator[Mask]:
    """Masks (H, W) that a script makes of a film's frames (H, W, 3), one after another; exactly one for each frame.

    Raises the errors of `FilmScript.outputs`, and `SilhouetteError`, which names script, film and frame, for what is no mask of their size.
    """
    size = script.size[0] * script.size[1]

    def read(pipe: IO[bytes]) -> tuple[bytes, str]:
        data = pipe.read(size)
        fault = f"found {len(data)} bytes, expected the frame's width x height = {size} bytes, one a pixel"
        return data, "" if len(data) == size else fault

    output = Output("masks", "one byte a pixel and one mask a frame: has the script printed to standard output, or written numbers of more "
                    "than 8 bits?", read)
    with closing(script.outputs(frames, output)) as made:
        for n, data in enumerate(made):
            yield checked_mask(data, script.size, f"{script.where}: frame {n}")


def checked_mask(data: bytes, size: Size, where: str) -> Mask:
    """The mask (H, W) in the bytes that a script wrote. Raises `SilhouetteError`, which names `where`, if they are none."""
    try:
        return ready_mask(np.frombuffer(data, np.uint8).reshape(size[::-1]))
    except SilhouetteError as error:
        raise SilhouetteError(f"{where}: {error}") from None
