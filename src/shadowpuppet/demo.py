"""A recording made, tracked and measured, with nothing but what is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.errors import VideoError
from shadowpuppet.making import Drawing
from shadowpuppet.options import Options
from shadowpuppet.pipeline import Listener, Summary, track_recording
from shadowpuppet.synthetic import demo_spec, synthesize
from shadowpuppet.video import open_frames, write_image

SHOWN = 6
"""Frames on the contact sheet."""


def run_demo(folder: str | Path, options: Options, listener: Listener | None = None) -> Summary:
    """Make the sample recording in `folder`/recording and track it into `folder`/run, with overlay.mp4 and overlay.png.

    Raises a `ShadowPuppetError` where something cannot be written.
    """
    folder, listener = Path(folder), listener or Listener()
    listener.begin("drawing")
    tell = Drawing(listener)
    recording = synthesize(demo_spec(), folder / "recording", np.random.default_rng(options.seed), tell)
    summary = track_recording(recording, folder / "run", options, listener)
    write_image(folder / "run" / "overlay.png", contact_sheet(folder / "run" / "overlay.mp4"))
    return summary


def contact_sheet(film: str | Path, count: int = SHOWN) -> np.ndarray:
    """Some frames of a film, spread over it, side by side: (H, count W, 3). Raises `VideoError`."""
    frames = open_frames(film)
    length = frames.count or sum(1 for _ in frames)
    wanted = set(np.linspace(0, length - 1, 2 * count + 1).astype(int)[1::2].tolist())
    images = [frame.image for n, frame in enumerate(frames) if n in wanted]
    if not images:
        raise VideoError(f"{film}: no frames in it")
    return np.concatenate(images, axis=1)
