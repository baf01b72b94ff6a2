"""Recordings made, tracked and measured, of one camera and of several, with nothing but what is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.errors import VideoError
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.synthesize import Drawing
from shadowpuppet.pipeline.track import Listener, Summary, track_recording
from shadowpuppet.synthetic import Spec, demo_ring_spec, demo_spec, synthesize
from shadowpuppet.video import open_frames, write_image

SHOWN, SHOWN_SEVERAL = 6, (4, 2)
"""Frames on the contact sheet of one camera; with several, where each frame is a grid, how many and how many side by side."""


def run_demo(folder: str | Path, options: Options, listener: Listener | None = None) -> tuple[Summary, Summary]:
    """Make two sample recordings and track them: one camera's, `folder`/recording into `folder`/run, and several cameras',
    `folder`/recording-ring into `folder`/run-ring; each run gets overlay.mp4 and overlay.png.

    Raises a `ShadowPuppetError` where something cannot be written.
    """
    folder, listener = Path(folder), listener or Listener()
    one = _made_and_tracked(demo_spec(), folder / "recording", folder / "run", options, listener)
    several = _made_and_tracked(demo_ring_spec(), folder / "recording-ring", folder / "run-ring", options, listener)
    return one, several


def _made_and_tracked(spec: Spec, recording: Path, run: Path, options: Options, listener: Listener) -> Summary:
    listener.begin("drawing")
    made = synthesize(spec, recording, np.random.default_rng(options.seed), Drawing(listener))
    summary = track_recording(made, run, options, listener)
    count, columns = (SHOWN, SHOWN) if len(spec.views()) == 1 else SHOWN_SEVERAL
    write_image(run / "overlay.png", contact_sheet(run / "overlay.mp4", count, columns))
    return summary


def contact_sheet(film: str | Path, count: int = SHOWN, columns: int = SHOWN) -> np.ndarray:
    """Some frames of a film, spread over it, so many side by side: (count / columns H, columns W, 3). Raises `VideoError`."""
    frames = open_frames(film)
    length = frames.count or sum(1 for _ in frames)
    wanted = set(np.linspace(0, length - 1, 2 * count + 1).astype(int)[1::2].tolist())
    images = [frame.image for n, frame in enumerate(frames) if n in wanted]
    if not images:
        raise VideoError(f"{film}: no frames in it")
    images += [np.zeros_like(images[0])] * (-len(images) % min(columns, len(images)))
    return np.concatenate([np.concatenate(images[n : n + columns], axis=1) for n in range(0, len(images), columns)])
