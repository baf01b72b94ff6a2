# /// script
# requires-python = ">=3.9,<3.13"
# dependencies = ["mediapipe==0.10.21"]
# ///
"""MediaPipe Pose (BlazePose, Apache-2): a neural network of Google's finds one person and outlines them. Its weights lie in its wheel."""

import os
import sys

mask_pipe = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # what libraries print goes to standard error, not among the masks

import cv2  # noqa: E402
import mediapipe  # noqa: E402
import numpy as np  # noqa: E402

WIDTH, HEIGHT = int(sys.argv[2]), int(sys.argv[3])
SIZE = WIDTH * HEIGHT * 3


def main() -> None:
    """Write a mask for each frame; black where no person is found."""
    # The second of three networks, which follows the person from frame to frame.
    with mediapipe.solutions.pose.Pose(model_complexity=1, enable_segmentation=True, smooth_segmentation=False) as pose:
        while len(data := sys.stdin.buffer.read(SIZE)) == SIZE:
            image = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)
            found = pose.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB)).segmentation_mask
            mask = np.zeros((HEIGHT, WIDTH)) if found is None else found
            mask_pipe.write(np.uint8(255 * (mask >= 0.5)).tobytes())
            mask_pipe.flush()


main()
