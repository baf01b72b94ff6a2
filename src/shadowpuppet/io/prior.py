"""Motion priors as archives of arrays (.npz): nothing in them is executed."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason
from shadowpuppet.io.files.npz import BROKEN
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.prior.local_pca import Subspaces
from shadowpuppet.motion.prior.motion_prior import MotionPrior

FORMAT, VERSION = "shadowpuppet motion prior", 1
NUMBERS = ("centres", "bases", "variances", "noise", "transitions", "initial", "rate")
"""Arrays of numbers in the file, as `Subspaces` and `MotionPrior` have them; `rate` is not a number where it is not known."""


def read_prior(path: str | Path) -> MotionPrior:
    """A prior from a file. Raises `FormatError`, naming file and array, where it cannot be read or is none."""
    path = Path(path)
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return _prior({name: data[name] for name in ("format", "version", "names", *NUMBERS) if name in data})
    except OSError as error:
        problem = reason(error)
    except ShadowPuppetError as error:
        problem = str(error)
    except BROKEN:
        problem = "not a whole archive of arrays"
    raise FormatError(f"{path}: cannot be read as a motion prior ({problem})")


def write_prior(path: str | Path, prior: MotionPrior) -> None:
    """Write a prior so that `read_prior` gives it back to the last bit. Raises `ShadowPuppetError` where that fails."""
    subspaces, out = prior.subspaces, io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, format=np.array(FORMAT), version=np.array(VERSION), names=np.array(prior.names, str),
                        centres=subspaces.centres, bases=subspaces.bases, variances=subspaces.variances, noise=subspaces.noise,
                        transitions=prior.transitions, initial=prior.initial, rate=np.array(np.nan if prior.rate is None else prior.rate))
    write_whole(Path(path), out.getvalue())


def _prior(arrays: dict[str, Any]) -> MotionPrior:
    """The prior of a file's arrays. Raises `ShadowPuppetError`."""
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
