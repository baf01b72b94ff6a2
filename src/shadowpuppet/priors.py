"""A motion prior learnt from files of motion, before any run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.motion_files import read_motion
from shadowpuppet.io.prior import write_prior
from shadowpuppet.settings import PriorSettings
from shadowpuppet.training import RATE, Trained, train_prior

CANDIDATES = (5, 10, 15, 20, 30, 40, 60, 80)
"""Numbers of regions that are tried where one is to be chosen (Ni 2008, Figs. 4 and 8)."""


def prior_from_files(motions: Sequence[str | Path], file: str | Path, settings: PriorSettings | None = None, *, seed: int = 0,
                     body: str = "anatomical", rate: float = RATE, choose: bool = False) -> Trained:
    """Learn a prior from files that `read_motion` reads, at `rate` frames/s, and save it (.npz).

    `choose`: find the number of regions among `CANDIDATES`. Raises `FormatError` or `ShadowPuppetError`, naming the file.
    """
    file, paths = Path(file), [Path(motion) for motion in motions]
    if file.suffix.lower() != ".npz":
        raise ShadowPuppetError(f"{file}: found the ending {file.suffix!r}, expected .npz")
    if not file.parent.is_dir():
        raise ShadowPuppetError(f"{file}: cannot be written (no such folder)")
    twice = [path for n, path in enumerate(paths) if path in paths[:n]]
    if twice:
        raise ShadowPuppetError(f"{twice[0]}: found it twice among the files to learn from, expected each once")
    tables = {str(path): read_motion(path) for path in paths}
    trained = train_prior(np.random.default_rng(seed), tables, settings, body=body, rate=rate, candidates=CANDIDATES if choose else ())
    write_prior(file, trained.prior)
    return trained
