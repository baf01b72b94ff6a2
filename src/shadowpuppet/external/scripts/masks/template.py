# /// script
# requires-python = ">=3.11"
# dependencies = ["numpy>=1.26"]
# ///
"""A segmentation script to start from: replace `segment`, and name the packages that it needs above.

shadowpuppet runs it as `script.py FILM WIDTH HEIGHT`, once for each film, in an environment of its own. Frames come from standard input,
a mask for each goes to standard output, both as plain bytes. A script is one file: it cannot import others beside it.
"""

import os
import sys

mask_pipe = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # what libraries print goes to standard error, not among the masks

import numpy as np  # noqa: E402

FILM, WIDTH, HEIGHT = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
SIZE = WIDTH * HEIGHT * 3


def segment(image: np.ndarray) -> np.ndarray:
    """The person's mask (H, W), true and false, in a frame (H, W, 3), blue green red, 0 to 255. Here: what is darker than grey."""
    return image.mean(2) < 128


def main() -> None:
    """Read frames and write masks, until there are no more."""
    while len(data := sys.stdin.buffer.read(SIZE)) == SIZE:
        image = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)
        mask_pipe.write(np.uint8(255 * segment(image)).tobytes())
        mask_pipe.flush()


main()
