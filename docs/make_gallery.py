"""Make docs/assets/example_*.webp, the pictures of the page of examples: python docs/make_gallery.py. Takes two minutes.

Each example of examples/ runs on a small made recording; its picture is one that it leaves, or the middle frame of a film that it leaves.
The tests of the examples make the same pictures (`picture_of`), of smaller recordings.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, synthesize
from shadowpuppet.video import Image, open_frames

ROOT = Path(__file__).resolve().parents[1]
ASSETS = Path(__file__).parent / "assets"
LEFT = {"01": "sample-run/overlay.mp4", "02": "one_picture.png", "04": "masks.mkv", "05": "ring-run/overlay.mp4", "06": "prior.png",
        "07": "refined.png"}  # fmt: skip
"""What an example leaves that can be shown, by its number."""
WIDEST, QUALITY = 1200, 80
"""Greatest width of a picture, pixels, and quality of its compression."""


def picture_of(number: str, folder: Path) -> Image:
    """The picture (H, W, 3) of an example that was run in the folder: the middle one of a film."""
    frames = [frame.image for frame in open_frames(folder / LEFT[number])]
    image = frames[len(frames) // 2]
    image = image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if image.shape[1] <= WIDEST:
        return image
    size = (WIDEST, round(image.shape[0] * WIDEST / image.shape[1]))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def made(folder: Path) -> dict[str, Path]:
    """Recordings for the examples that need one, by their numbers."""
    rng, scene = np.random.default_rng(1), Scene(empty_seconds=1.5)
    one = synthesize(Spec(motion=(Gesture(motion="wave_hands", seconds=5),), scene=scene), folder / "one", rng)
    ring = Spec(motion=(Gesture(motion="walk", seconds=3),), ring=Ring(count=4, radius=3.8, fov_deg=42), scene=scene, rate=25)
    return {"01": one, "04": one, "05": synthesize(ring, folder / "ring", rng)}


def main() -> None:
    """Run the examples, write the pictures."""
    with tempfile.TemporaryDirectory() as work:
        recordings = made(Path(work))
        for number in LEFT:
            (example,) = (ROOT / "examples").glob(f"{number}_*.py")
            folder = Path(work, number)
            folder.mkdir()
            given = [str(recordings[number])] if number in recordings else []
            subprocess.run([sys.executable, example, *given], cwd=folder, check=True)
            target = ASSETS / f"example_{number}.webp"
            cv2.imwrite(str(target), picture_of(number, folder), [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
            print(f"{target.name}: {target.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
