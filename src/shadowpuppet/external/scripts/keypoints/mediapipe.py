# /// script
# requires-python = ">=3.9,<3.13"
# dependencies = ["mediapipe==0.10.21"]
# ///
"""MediaPipe Pose (BlazePose, Apache-2): a neural network of Google's finds one person's joints. Its weights lie in its wheel."""

import json
import os
import sys

out = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # what libraries print goes to standard error, not among the keypoints

import cv2  # noqa: E402
import mediapipe  # noqa: E402
import numpy as np  # noqa: E402

WIDTH, HEIGHT = int(sys.argv[2]), int(sys.argv[3])
MASKS = "masks" in sys.argv[4:]  # those of the same run are wanted too
SIZE = WIDTH * HEIGHT * 3
UNUSED = ("INNER", "OUTER", "MOUTH", "THUMB")
NAMES = ["-" if any(word in one.name for word in UNUSED) else one.name.lower() for one in mediapipe.solutions.pose.PoseLandmark]


def people(landmarks):
    """The person found, if any: MediaPipe's places are shares of the picture, which count pixels' corners."""
    if landmarks is None:
        return []
    return [{"points": [[one.x * WIDTH, one.y * HEIGHT, one.visibility] for one in landmarks.landmark]}]


def main() -> None:
    """Write the names of the landmarks, then a line for each frame, with an empty list of people where no person is found."""
    out.write(json.dumps({"names": NAMES, "detector": "MediaPipe", "origin": 0.5}).encode() + b"\n")
    # The second of three networks, which follows the person from frame to frame.
    with mediapipe.solutions.pose.Pose(model_complexity=1, enable_segmentation=MASKS, smooth_segmentation=False) as pose:
        while len(data := sys.stdin.buffer.read(SIZE)) == SIZE:
            image = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)
            found = pose.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
            out.write(json.dumps({"people": people(found.pose_landmarks)}).encode() + b"\n")
            if MASKS:
                mask = np.zeros((HEIGHT, WIDTH)) if found.segmentation_mask is None else found.segmentation_mask
                out.write(np.uint8(255 * (mask >= 0.5)).tobytes())
            out.flush()


main()
