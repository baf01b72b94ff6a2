"""Reads and writes motion priors as archives of arrays (.npz)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.npz import BrokenArchive, archive_bytes, read_arrays
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.prior.local_pca import Subspaces
from shadowpuppet.motion.prior.motion_prior import MotionPrior

FORMAT, VERSION = "shadowpuppet motion prior", 1
NUMBERS = ("centres", "bases", "variances", "noise", "transitions", "initial", "rate")
"""Numeric arrays of the file: fields of `Subspaces` and `MotionPrior`; `rate` is NaN if unknown."""


@np.errstate(all="ignore")  # impossible numbers are refused where they are checked
def read_prior(path: str | Path) -> MotionPrior:
    """Read a prior. Raises `FormatError`, naming file and array, if it is malformed."""
    try:
        return _prior(read_arrays(Path(path), ("format", "version", "names", *NUMBERS)))
    except BrokenArchive:
        problem = "not a whole archive of arrays"
    except ShadowPuppetError as error:
        problem = str(error)
    raise FormatError(f"{path}: cannot be read as a motion prior ({problem})")


def write_prior(path: str | Path, prior: MotionPrior) -> None:
    """Write a prior so that `read_prior` gives back the same numbers. Raises `ShadowPuppetError` if that fails."""
    subspaces, rate = prior.subspaces, np.nan if prior.rate is None else prior.rate
    content = archive_bytes(format=FORMAT, version=VERSION, names=np.array(prior.names, str), centres=subspaces.centres,
                            bases=subspaces.bases, variances=subspaces.variances, noise=subspaces.noise, transitions=prior.transitions,
                            initial=prior.initial, rate=rate)
    write_whole(Path(path), content)


def _prior(arrays: dict[str, Any]) -> MotionPrior:
    """The prior in a file's arrays. Raises `ShadowPuppetError`."""
    if str(arrays.get("format")) != FORMAT:
        raise ShadowPuppetError(f"format: found {str(arrays.get('format'))!r}, expected {FORMAT!r}")
    if str(arrays.get("version")) != str(VERSION):
        raise ShadowPuppetError(f"version: found {arrays.get('version')}, expected {VERSION}")
    for name in ("names", *NUMBERS):
        kinds = "U" if name == "names" else "fiu"
        if name not in arrays or arrays[name].dtype.kind not in kinds:
            found = f"an array of {arrays[name].dtype}" if name in arrays else "no such array"
            raise ShadowPuppetError(f"{name}: found {found}, expected one of {'text' if name == 'names' else 'numbers'}")
    for name, dimensions in (("names", 1), ("rate", 0)):
        if arrays[name].ndim != dimensions:
            raise ShadowPuppetError(f"{name}: found shape {arrays[name].shape}, expected {dimensions} dimensions")
    subspaces = Subspaces(arrays["centres"], arrays["bases"], arrays["variances"], arrays["noise"])
    rate = None if np.isnan(arrays["rate"]) else float(arrays["rate"])
    return MotionPrior(subspaces, arrays["transitions"], arrays["initial"], tuple(arrays["names"].tolist()), rate)
