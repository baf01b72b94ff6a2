"""Silhouettes without tracking: python examples/04_silhouettes_of_a_film.py FILM BACKGROUND; without arguments, of a rendered film."""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.synthetic import Spec, synthesize

if len(sys.argv) == 3:
    film, background = sys.argv[1:]
else:
    folder = sys.argv[1] if len(sys.argv) > 1 else synthesize(Spec(), "sample", np.random.default_rng(1))
    film, background = f"{folder}/video/cam.mp4", f"{folder}/background/cam.mp4"

frames = sp.open_frames(film)
segment = sp.learn_background((frame.image for frame in sp.open_frames(background)), film=(frame.image for frame in frames))
print(segment.reason)

with sp.write_frames("masks.mkv", frames.rate, lossless=True) as masks:
    for frame in frames:
        masks.write(segment(frame.image).astype(np.uint8) * 255)
print(f"{masks.count} masks in masks.mkv; to track with them, save them as masks/<camera>.mkv in a recording and use --masks")
