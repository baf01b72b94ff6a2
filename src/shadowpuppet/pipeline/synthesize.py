"""Writes synthetic recordings to folders, without overwriting other files unless forced; and makes the demo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import RecordingError, SettingsError, VideoError
from shadowpuppet.io.recording import POSTURES, Recording, read_recording
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.track import Listener, Summary, track_recording
from shadowpuppet.synthetic import Spec, demo_ring_spec, demo_spec, synthesize
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.spec_file import SPEC_FILE, SPEC_HEADER, read_spec
from shadowpuppet.video import open_frames, write_image


def make_recording(spec: Spec, folder: str | Path, listener: Listener | None = None, force: bool = False) -> Recording:
    """Make the synthetic recording of `spec`, with its seed, in `folder`, and read it back.

    An earlier recording of the same spec in `folder` is made again. Any other non-empty folder is only written to with `force`, which
    replaces a made recording, or files of the same names, and keeps the rest. Raises `RecordingError` otherwise, or if something cannot be
    written, and a `ShadowPuppetError` if a motion file cannot be used.
    """
    folder, listener = Path(folder), listener or Listener()
    for gesture in (*spec.motion, *(spec.training or ()), *(other.motion for other in spec.scene.bystanders)):
        if gesture.file is not None:  # raises for a file that cannot be used, before anything is removed
            perform(replace(spec, motion=(gesture,)), np.random.default_rng(0))
    clear(folder, spec, force)
    listener.begin("drawing")
    synthesize(spec, folder, tell=Drawing(listener))
    return read_recording(folder)


def clear(folder: Path, spec: Spec, force: bool = False) -> None:
    """Remove the files of an earlier synthetic recording of the same spec, or with `force` of any, from `folder`, and no others.

    Raises `RecordingError` if `folder` is a file, holds files but no such recording (unless `force`), or a file cannot be removed.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    if not folder.is_dir():
        raise RecordingError(f"{folder}: found a file, expected a folder to be made")
    old = _made(folder / SPEC_FILE)
    if old is None and not force:
        raise RecordingError(
            f"{folder}: found files in it that are no made recording; choose another folder, or write among them with --force"
        )
    if old is not None and old != spec and not force:
        raise RecordingError(f"{folder}: found a made recording of another spec; choose another folder, or replace it with --force")
    for path in files_of(old, folder) if old is not None else ():
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be replaced ({(error.strerror or str(error)).lower()})") from None


def files_of(spec: Spec, folder: Path) -> list[Path]:
    """All files that a recording of `spec` can have in `folder`, including partly written films."""
    ends = {"video": "mp4", "background": "mp4", "masks": "mkv", "people": "mkv"}
    films = [folder / kind / f"{view.name}{part}.{end}" for kind, end in ends.items() for view in spec.views() for part in ("", ".part")]
    postures = [folder / "references" / f"{name}{end}" for name in POSTURES for end in (".png", "_mask.png", ".csv", ".trc")]
    truths = [f"truth_{n}" for n in range(1, 2 + len(spec.scene.bystanders))] if spec.scene.bystanders else []
    tables = [folder / f"{name}.{end}" for name in ("truth", "training", *truths) for end in ("csv", "trc")]
    return [*films, *postures, *tables, *(folder / name for name in ("calibration.toml", "recording.toml", SPEC_FILE))]


def _made(path: Path) -> Spec | None:
    """The spec of a synthetic recording; None if it is not one. A spec written by hand has another first line."""
    try:
        with path.open(encoding="utf-8") as file:
            return read_spec(path) if file.readline() == SPEC_HEADER else None
    except (OSError, UnicodeDecodeError, SettingsError):
        return None


class Drawing:
    """Reports rendered pictures to a listener."""

    def __init__(self, listener: Listener) -> None:
        """`listener`: receives the progress."""
        self.listener, self.total = listener, 0

    def __call__(self, done: int, total: int) -> None:
        """Report that `done` of `total` pictures are rendered."""
        if total != self.total:
            self.total = total
            self.listener.begin("drawing", total)
        self.listener.advance(done)


SHOWN, SHOWN_SEVERAL = 6, (4, 2)
"""Number of frames on the contact sheet of one camera; numbers of frames and columns with several cameras, where each frame is a grid."""


def run_demo(folder: str | Path, options: Options, listener: Listener | None = None) -> tuple[Summary, Summary]:
    """Make two sample recordings and track them: one camera's, `folder`/recording into `folder`/run, and several cameras',
    `folder`/recording-ring into `folder`/run-ring; each run gets overlay.mp4 and overlay.png.

    Raises a `ShadowPuppetError` if something cannot be written.
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
    """`count` frames spread evenly over a film, in `columns` columns: (count / columns H, columns W, 3). Raises `VideoError`."""
    frames = open_frames(film)
    length = frames.count or sum(1 for _ in frames)
    wanted = set(np.linspace(0, length - 1, 2 * count + 1).astype(int)[1::2].tolist())
    images = [frame.image for n, frame in enumerate(frames) if n in wanted]
    if not images:
        raise VideoError(f"{film}: no frames in it")
    images += [np.zeros_like(images[0])] * (-len(images) % min(columns, len(images)))
    return np.concatenate([np.concatenate(images[n : n + columns], axis=1) for n in range(0, len(images), columns)])
