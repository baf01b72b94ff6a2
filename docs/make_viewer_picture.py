"""Make docs/assets/viewer*.png, the page of `view`: python docs/make_viewer_picture.py [DEMO]. Needs Chromium, Playwright, and minutes.

DEMO is a folder that `shadowpuppet demo` made; without one it is made again.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from shadowpuppet.pipeline.options import Options
from shadowpuppet.viewer.scene.open_any import open_scene
from shadowpuppet.viewer.scene.scene import Stage
from shadowpuppet.viewer.web.serve import serving

ASSETS = Path(__file__).parent / "assets"
SIZE, COLOURS, LARGEST = (1280, 760), (255, 160, 96, 64), 150_000
"""Pixels; numbers of colours to try until the file is small enough; maximum size in bytes."""
FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage")
PHONE = (390, 844)
ELBOW = "page.choose({figure: page.stage.figures[0], joint: page.stage.figures[0].jointNames.indexOf('right elbow')})"
"""Chooses a joint, as a click on it does."""
PARTICLES = "page.frameAll(false); [...document.querySelectorAll('#show label')].find(each => each.innerText.trim() == 'particles').click()"
SETTLED = 6000
"""Milliseconds until everything is drawn."""


def photographed(browser: Browser, scene: Stage, name: str, second: float, then: str = "", size: tuple[int, int] = SIZE,
                 scheme: Literal["light", "dark"] = "light") -> None:
    """A picture of the page at a second of the scene, after some script."""
    with serving(scene, port=0) as address:
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
        page.goto(address)
        page.wait_for_timeout(SETTLED)
        page.evaluate(f"page.seek({int(abs(scene.times - second).argmin())})")
        page.evaluate(then or "0")
        page.wait_for_timeout(SETTLED)
        shot = Image.open(io.BytesIO(page.screenshot(timeout=120_000))).convert("RGB")
        page.close()
    path = ASSETS / f"{name}.png"
    for colours in COLOURS:
        shot.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size < LARGEST:
            break
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main() -> None:
    """Make the named pictures, or all."""
    arguments = [argument for argument in sys.argv[1:] if not argument.startswith("viewer")]
    wanted = [argument for argument in sys.argv[1:] if argument.startswith("viewer")]
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("found no Chromium, which takes the pictures")
    with tempfile.TemporaryDirectory() as made, sync_playwright() as tool:
        demo = Path(arguments[0]) if arguments else Path(made) / "demo"
        if not demo.exists():
            subprocess.run([sys.executable, "-m", "shadowpuppet", "demo", "-o", str(demo), "--quiet"], check=True)
        opened = tool.chromium.launch(executable_path=browser, args=[*FLAGS])
        several, one = open_scene(demo / "run-ring"), open_scene(demo / "run")
        ring = Path(several.facts["recording"])
        pictures: dict[str, Callable[[str], None]] = {
            "viewer": lambda name: photographed(opened, several, name, 2.0, ELBOW),
            "viewer_phone": lambda name: photographed(opened, several, name, 2.0, size=PHONE, scheme="dark"),
            "viewer_hull": lambda name: photographed(opened, open_scene(ring, Options()), name, 2.0, "page.frameAll(false)"),
            "viewer_through": lambda name: photographed(opened, several, name, 2.0, "page.look(0)"),
            "viewer_particles": lambda name: photographed(opened, one, name, 4.0, PARTICLES),
        }
        for name in wanted or pictures:
            pictures[name](name)
        opened.close()


if __name__ == "__main__":
    main()
