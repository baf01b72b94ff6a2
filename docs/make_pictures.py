"""Make docs/assets/demo.png from the demo: python docs/make_pictures.py [DEMO_FOLDER]; without a folder, the demo runs first."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from shadowpuppet.demo import run_demo
from shadowpuppet.options import Options
from shadowpuppet.video import open_frames, write_image

TARGET = Path(__file__).parent / "assets" / "demo.png"
TIMES = (1.9, 7.3, 9.9, 11.6)
"""Seconds: waving, bending aside, bowing, reaching."""
HEIGHT, GREYS = 560, 6
"""Pixels, and the step of the grey levels: a picture of noise would not compress."""
LARGEST = 300_000
"""Bytes."""


def shown(film: Path) -> np.ndarray:
    """Some frames of an overlay film, side by side."""
    frames = list(open_frames(film))
    images = [min(frames, key=lambda frame: abs(frame.time - time)).image for time in TIMES]
    sheet = np.concatenate(images, axis=1)
    calm = cv2.bilateralFilter(sheet, 5, 25, 3)
    small = cv2.resize(calm, (round(sheet.shape[1] * HEIGHT / sheet.shape[0]), HEIGHT), interpolation=cv2.INTER_AREA)
    return np.asarray(small // GREYS * GREYS, np.uint8)


def main() -> None:
    """Write the picture, from a demo that was made or is made now."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else made)
        if len(sys.argv) < 2:
            run_demo(folder, Options(overlay=True))
        TARGET.parent.mkdir(exist_ok=True)
        write_image(TARGET, shown(folder / "run" / "overlay.mp4"))
    size = TARGET.stat().st_size
    print(f"{TARGET}: {size} bytes")
    if size > LARGEST:
        sys.exit(f"{TARGET}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
