"""Performs one task of a batch; its run folder is either complete or does not exist."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import time
import traceback
import uuid
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.files.text import read_text, write_whole
from shadowpuppet.io.run_writer import versions
from shadowpuppet.pipeline.batch.tasks import named
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache

MARK, PART, PLAN, RUNS = "task.json", ".part", "batch.toml", "runs"
"""File with the task's id in a run folder, written last; ending of unfinished run folders; file with the settings of a batch, which every
batch's folder contains; folder of the runs in it."""
PERMANENT = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EACCES, errno.EPERM, errno.EEXIST, errno.EINVAL, errno.ENAMETOOLONG}
"""System errors that another try would meet again."""


def do(task: Mapping[str, Any], out: str | Path, cache: SilhouetteCache | None = None,
       listener: Listener | None = None) -> dict[str, Any]:
    """Run a task (`Task.wire`) into its folder in `out`, unless that is complete. Returns the outcome as plain values.

    Keys: `status`, done or failed; `seconds`; for a failure also `message`, a sentence, `again`, whether a further try may succeed, and,
    for a bug, `trace`. A failed run leaves no folder. `KeyboardInterrupt` is not caught.
    """
    began = time.perf_counter()
    try:
        _run(task, Path(out), cache, listener)
    except Exception as error:
        if cache is not None:
            cache.forget()
        return {"status": "failed", "seconds": round(time.perf_counter() - began, 3), **_failure(error)}
    return {"status": "done", "seconds": round(time.perf_counter() - began, 3)}


def _run(task: Mapping[str, Any], out: Path, cache: SilhouetteCache | None, listener: Listener | None) -> None:
    folder = out / RUNS / task["folder"]
    if not (out / PLAN).exists():
        raise ShadowPuppetError(f"{out}: found no {PLAN} in it, expected the batch's folder, which all machines that work on it must see")
    if read_mark(folder) is not None:
        return
    part = folder.with_name(f".{folder.name}.{uuid.uuid4().hex[:8]}{PART}")
    began = time.perf_counter()
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", ShadowPuppetWarning)
            named(task["track"])(task["recording"], part, make_options(task["settings"]), listener, cache)
        mark = {key: task[key] for key in ("id", "recording", "name", "case", "seed")}
        mark |= {"seconds": round(time.perf_counter() - began, 3), "version": versions().get("shadowpuppet"),
                 "warnings": list(dict.fromkeys(" ".join(str(w.message).split()) for w in said))}
        write_whole(part / MARK, json.dumps(mark, indent=1, ensure_ascii=False) + "\n")
        _put(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _put(part: Path, folder: Path) -> None:
    """Rename a complete run to its final name. If another machine was first, its run, which is equal, is kept."""
    with contextlib.suppress(OSError):
        os.rename(part, folder)
        return
    if read_mark(folder) is None:  # a folder without its mark
        shutil.rmtree(folder, ignore_errors=True)
        os.rename(part, folder)


def read_mark(folder: Path) -> dict[str, Any] | None:
    """The contents of the file `MARK` in a run folder; None if the run is not complete."""
    try:
        mark = json.loads(read_text(folder / MARK)) if (folder / MARK).exists() else None
    except (FormatError, ValueError, RecursionError):
        return None
    return mark if isinstance(mark, dict) and isinstance(mark.get("id"), str) else None


def _failure(error: Exception) -> dict[str, Any]:
    """The outcome's `message`, `again` and `trace` for an error."""
    system = _system(error)
    if isinstance(error, ShadowPuppetError):
        return {"message": str(error), "again": system is not None and system.errno not in PERMANENT}
    last = traceback.extract_tb(error.__traceback__)[-1:]
    where = f" in {Path(last[0].filename).name}:{last[0].lineno}" if last else ""
    said = " ".join(str(error).split())[:300]
    return {"message": f"{type(error).__name__}{where}: {said}", "again": True, "trace": "".join(traceback.format_exception(error))}


def _system(error: BaseException | None) -> OSError | None:
    """The `OSError` that caused an error; None if there is none."""
    while error is not None and not isinstance(error, OSError):
        error = error.__cause__ or error.__context__
    return error
