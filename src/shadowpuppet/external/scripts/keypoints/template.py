# /// script
# requires-python = ">=3.11"
# dependencies = ["numpy>=1.26"]
# ///
"""A script to start from that finds keypoints: replace `find`, NAMES and DETECTOR, and name the packages that it needs above.

shadowpuppet runs it as `script.py FILM WIDTH HEIGHT`, once for each film, in an environment of its own. Frames come from standard input as
plain bytes, a line of JSON for each goes to standard output. A script is one file: it cannot import others beside it. With --masks it is
started with one more argument, `masks`, and is to write each frame's mask after its line: HEIGHT x WIDTH bytes, 255 is the person.
"""

import json
import os
import sys

out = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # what libraries print goes to standard error, not among the keypoints

import numpy as np  # noqa: E402

FILM, WIDTH, HEIGHT = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
SIZE = WIDTH * HEIGHT * 3
NAMES = ["mid_hip"]  # "-" for a landmark that shadowpuppet does not know
DETECTOR = "middle of what is dark"
ORIGIN = 0  # place of the first pixel's centre: 0.5 where the detector counts pixels' corners


def find(image: np.ndarray) -> list:
    """People in a frame (H, W, 3), blue green red: for each name x, y and a confidence from 0 to 1, or None. Here: one at most."""
    rows, columns = np.nonzero(image.mean(2) < 128)
    return [{"id": 0, "points": [[columns.mean(), rows.mean(), 1.0]]}] if len(rows) else []


def main() -> None:
    """Read frames and write lines, until there are no more."""
    out.write(json.dumps({"names": NAMES, "detector": DETECTOR, "origin": ORIGIN}).encode() + b"\n")
    while len(data := sys.stdin.buffer.read(SIZE)) == SIZE:
        image = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)
        out.write(json.dumps({"people": find(image)}).encode() + b"\n")
        out.flush()


main()
