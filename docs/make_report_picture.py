"""Make docs/assets/report.png, the page of `evaluate --report`: python docs/make_report_picture.py [DEMO]. Needs Chromium, and a minute.

DEMO is a folder that `shadowpuppet demo` made; without one it is made again.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from PIL import Image  # which Matplotlib brings

from shadowpuppet.evaluation.evaluation import measure_run
from shadowpuppet.evaluation.report.page import write_report
from shadowpuppet.video import read_image

TARGET = Path(__file__).parent / "assets" / "report.png"
WIDTH, HEIGHT, SCALE, COLOURS, LARGEST = 1120, 1240, 0.52, 200, 150_000
"""Pixels of the page's two parts, downscaling factor, number of colours, and maximum size in bytes."""


def photographed(page: Path, picture: Path, height: int) -> np.ndarray:
    """Screenshot of the page in Chromium, of a given height in pixels."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("found no Chromium, which takes the picture of the page")
    subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
                    "--hide-scrollbars", f"--user-data-dir={picture.parent / 'profile'}", f"--window-size={WIDTH},{height}",
                    f"--screenshot={picture}", page.resolve().as_uri()], check=True, stderr=subprocess.DEVNULL)  # fmt: skip
    return read_image(picture)


def main() -> None:
    """Write the picture."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        demo = Path(sys.argv[1]) if len(sys.argv) > 1 else folder / "demo"
        if not demo.exists():
            subprocess.run([sys.executable, "-m", "shadowpuppet", "demo", "-o", str(demo), "--quiet"], check=True)
        write_report(folder / "page.html", measure_run(demo / "run-ring"))
        image = photographed(folder / "page.html", folder / "page.png", 2 * HEIGHT)
    both = np.concatenate([image[:HEIGHT], image[HEIGHT : 2 * HEIGHT]], axis=1)
    small = cv2.resize(both, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA)
    few = Image.fromarray(small[..., ::-1].copy()).quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    few.save(TARGET, optimize=True)
    size = TARGET.stat().st_size
    print(f"{TARGET}: {size} bytes")
    if size > LARGEST:
        sys.exit(f"{TARGET}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
