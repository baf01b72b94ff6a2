"""Make docs/assets/demo.png and scenes.png: python docs/make_pictures.py [DEMO_FOLDER]; without a folder, the demo runs first."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.synthesize import run_demo
from shadowpuppet.synthetic import spec_from, synthesize
from shadowpuppet.video import open_frames, write_image

ASSETS = Path(__file__).parent / "assets"
TIMES = (1.9, 7.3, 9.9, 11.6)
"""Seconds: waving, bending aside, bowing, reaching."""
HEIGHT, GREYS = 560, 6
"""Height in pixels, and quantisation step of the grey levels (image noise would not compress)."""
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


SCENES: dict[str, dict[str, Any]] = {
    "ring": {"ring": {"count": 4, "radius": 3.2, "jitter": 0.5, "start_deg": -25}, "scene": {"background": "cluttered", "room": 4}},
    "fisheye": {"cameras": [{"fisheye": True, "fov_deg": 125, "distance": 1.2}], "scene": {"background": "textured", "clothing": 5}},
    "pillar": {"scene": {"obstacles": [{"kind": "pillar", "ahead": 0.9, "left": 0.2}], "clothing": 7, "room": 2}},
    "second": {"cameras": [{"distance": 2.6}], "scene": {"bystanders": [{"ahead": 0.5, "left": 0.33, "kind": "child"}], "room": 6}},
    "camouflage": {"scene": {"camouflage": 0.9, "background": "plain", "room": 3, "shadow": 0.4}},
}
"""Specs of the second picture."""
SHOWN, WIDTH = 7, 240
"""Index of the frame, and its width in pixels."""


def scenes(folder: Path) -> np.ndarray:
    """Films of `SCENES`, each with the exact silhouette's outline, four in a row."""
    tiles = []
    for name, values in SCENES.items():
        gesture, calm = {"motion": "wave_hands", "seconds": 3}, {"noise": 0.0, "crf": 8}
        spec = spec_from({"motion": [gesture], "rate": 4} | values | {"scene": values["scene"] | calm})
        made = synthesize(spec, folder / name)
        for film in sorted((made / "video").iterdir()):
            image, mask = (list(open_frames(path))[SHOWN].image for path in (film, made / "masks" / f"{film.stem}.mkv"))
            large = cv2.resize(image, (WIDTH, WIDTH * 3 // 4), interpolation=cv2.INTER_AREA)
            outline = cv2.resize(mask.max(-1) if mask.ndim == 3 else mask, (WIDTH, WIDTH * 3 // 4), interpolation=cv2.INTER_LINEAR)
            edges, _ = cv2.findContours((outline > 127).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            tiles.append(cv2.drawContours(large, edges, -1, (60, 220, 60), 1))
    sheet = np.concatenate([np.concatenate(tiles[n : n + 4], 1) for n in (0, 4)])
    return np.asarray(sheet // GREYS * GREYS, np.uint8)


def main() -> None:
    """Write the pictures, from an existing or a new demo."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else made)
        if len(sys.argv) < 2:
            run_demo(folder, Options(overlay=True))
        ASSETS.mkdir(exist_ok=True)
        _write("demo.png", shown(folder / "run" / "overlay.mp4"))
        _write("scenes.png", scenes(Path(made) / "scenes"))


def _write(name: str, image: np.ndarray) -> None:
    write_image(ASSETS / name, image)
    size = (ASSETS / name).stat().st_size
    print(f"{ASSETS / name}: {size} bytes")
    if size > LARGEST:
        sys.exit(f"{ASSETS / name}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
