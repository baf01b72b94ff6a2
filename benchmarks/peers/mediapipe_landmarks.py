# /// script
# requires-python = ">=3.9,<3.13"
# dependencies = ["mediapipe==0.10.21"]
# ///
"""MediaPipe Pose on films, for `compare.py`: PYTHON mediapipe_landmarks.py OUT.npz NAME=FILM ...

It runs in the environment of `shadowpuppet masks --with mediapipe`, with the settings that are MediaPipe's defaults. OUT.npz has of each
film, in F frames, NAME.pixels (F, 33, 2), NAME.visibility (F, 33), NAME.world (F, 33, 3), metres about the hips, x to the right, y down, z
away from the camera; not a number in frames in which nobody is found; NAME.rate, frames/s; and NAME.seconds: processor time, wall time.
"""

import os
import sys
import time

import cv2
import mediapipe
import numpy as np

POINTS = 33


def read(landmarks, fields):
    """Fields of the landmarks (33, len(fields)); not a number without any."""
    if landmarks is None:
        return np.full((POINTS, len(fields)), np.nan)
    return np.array([[getattr(one, field) for field in fields] for one in landmarks.landmark])


def film(path):
    """Landmarks of a film in pixels and in metres, their visibility, and the time that it took."""
    frames = cv2.VideoCapture(path)
    size = [frames.get(cv2.CAP_PROP_FRAME_WIDTH), frames.get(cv2.CAP_PROP_FRAME_HEIGHT)]
    pixels, visibility, world = [], [], []
    with mediapipe.solutions.pose.Pose() as pose:
        began = time.process_time(), time.perf_counter()
        while True:
            there, image = frames.read()
            if not there:
                break
            found = pose.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
            in_picture = read(found.pose_landmarks, ("x", "y", "visibility"))
            pixels.append(in_picture[:, :2] * size - 0.5)  # from shares of the picture to pixels whose centres are whole numbers
            visibility.append(np.nan_to_num(in_picture[:, 2]))
            world.append(read(found.pose_world_landmarks, "xyz"))
        ended = time.process_time(), time.perf_counter()
    return {"pixels": pixels, "visibility": visibility, "world": world, "rate": frames.get(cv2.CAP_PROP_FPS),
            "seconds": np.subtract(ended, began)}  # fmt: skip


def main():
    """Every film, one after another; the file gets its name when it is complete."""
    target, found = sys.argv[1], {}
    for argument in sys.argv[2:]:
        name, path = argument.split("=", 1)
        found.update({f"{name}.{key}": np.asarray(value) for key, value in film(path).items()})
    with open(f"{target}.part", "wb") as file:
        np.savez_compressed(file, **found)
    os.replace(f"{target}.part", target)


if __name__ == "__main__":
    main()
