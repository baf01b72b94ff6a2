"""Make docs/assets/report.png, the page of `evaluate --report`: python docs/make_report_picture.py [DEMO]. Needs Chromium, and a minute.

DEMO is a folder that `shadowpuppet demo` made; without one it is made anew.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from shadowpuppet.evaluation import measure_run
from shadowpuppet.report.page import write_report
from shadowpuppet.video import read_image, write_image

TARGET = Path(__file__).parent / "assets" / "report.png"
WIDTH, HEIGHT, SCALE, GREYS = 1120, 1240, 0.52, 8
"""Pixels of the page's two parts, by what they are made smaller, and the step of the grey levels."""


def photographed(page: Path, picture: Path, height: int) -> np.ndarray:
    """The page as Chromium shows it, so many pixels of it."""
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
    write_image(TARGET, np.minimum((small.astype(int) + GREYS // 2) // GREYS * GREYS, 255).astype(np.uint8))


if __name__ == "__main__":
    main()
