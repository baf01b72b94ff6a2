"""Make docs/assets/live.png, the page of a live session: python docs/make_live_picture.py. Needs Chromium, and a minute."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from shadowpuppet.synthetic import Gesture, Viewpoint, demo_spec, synthesize
from shadowpuppet.video import open_frames, read_image, write_frames, write_image

TARGET = Path(__file__).parent / "assets" / "live.png"
SHOWN_AFTER = 21.0
"""Time of the screenshot (s): the person is waving."""
STAND = 18.0
"""Seconds for which the person stands first, to be measured."""
SIZE, GREYS, LARGEST = (1280, 760), 6, 300_000
"""Pixels, the step of the grey levels, bytes."""


def film(folder: Path) -> Path:
    """Film of the empty scene, then of a person who stands and then waves."""
    spec = demo_spec()
    motion = (Gesture(motion="stand", seconds=STAND), *[Gesture(motion="wave_hands", seconds=4)] * 6)
    spec = replace(spec, motion=motion, cameras=(Viewpoint(size=(640, 480), distance=2.4),), scene=replace(spec.scene, empty_seconds=6))
    recording = synthesize(spec, folder / "made", np.random.default_rng(1))
    with write_frames(folder / "film.mp4", spec.rate) as written:
        for part in ("background", "video"):
            for frame in open_frames(recording / part / "cam.mp4"):
                written.write(frame.image)
    return folder / "film.mp4"


def photographed(address: str, seconds: float) -> bytes:
    """Screenshot (PNG) of the page at an address, after some seconds in Chromium."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("found no Chromium, which takes the picture of the page")
    (for_it, to_it), (from_it, for_us) = os.pipe(), os.pipe()
    # Chromium takes orders from its descriptor 3 and answers on 4.
    command = ["bash", "-c", f'exec "$0" "$@" 3<&{for_it} 4>&{for_us}', browser, "--headless", "--no-sandbox", "--disable-gpu",
               "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1]}", "--remote-debugging-pipe", address]
    with subprocess.Popen(command, pass_fds=[for_it, for_us], stderr=subprocess.DEVNULL) as child, open(to_it, "wb") as orders, \
            open(from_it, "rb") as answers:
        os.close(for_it)
        os.close(for_us)

        def order(method: str, session: str | None = None, **values: object) -> dict:
            message = {"id": 1, "method": method, "params": values} | ({"sessionId": session} if session else {})
            orders.write(json.dumps(message).encode() + b"\0")
            orders.flush()
            while True:
                text = b"".join(iter(lambda: answers.read(1), b"\0"))
                if (answer := json.loads(text)).get("id") == 1:
                    return answer["result"]

        time.sleep(seconds)
        pages = [target for target in order("Target.getTargets")["targetInfos"] if target["url"].startswith(address)]
        session = order("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]
        order("Emulation.setDeviceMetricsOverride", session, width=SIZE[0], height=SIZE[1], deviceScaleFactor=1, mobile=False)
        time.sleep(0.5)
        picture = order("Page.captureScreenshot", session)["data"]
        child.terminate()
    return base64.b64decode(picture)


def main() -> None:
    """Play the film as if live, and save a screenshot of the page."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        command = [sys.executable, "-m", "shadowpuppet", "live", "--camera", str(film(folder)), "--height", "1.78", "--fov", "60",
                   "--countdown", "1", "--show", "browser", "--port", "0", "-o", str(folder / "run")]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as session:
            assert session.stderr is not None
            address = ""
            for line in session.stderr:
                address = (re.search(r"http://\S+", line) or [address])[0]
                if line.startswith("tracking"):
                    break
            (folder / "page.png").write_bytes(photographed(address, SHOWN_AFTER))
            session.terminate()
        shown = read_image(folder / "page.png")
    calm = cv2.bilateralFilter(shown[:, : SIZE[0] * 2 // 3], 7, 25, 5)  # the picture's noise would not compress
    TARGET.parent.mkdir(exist_ok=True)
    write_image(TARGET, np.asarray(np.concatenate([calm, shown[:, calm.shape[1] :]], axis=1) // GREYS * GREYS, np.uint8))
    size = TARGET.stat().st_size
    print(f"{TARGET}: {size} bytes")
    if size > LARGEST:
        sys.exit(f"{TARGET}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
