"""Writes what `check` found for certain into a recording: delays of films, directions of cameras, the scale. Old files are kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from shadowpuppet.calibration.agreement import compare_cameras
from shadowpuppet.calibration.results import keep_old, replace_calibration
from shadowpuppet.calibration.silhouettes import aligned_sets
from shadowpuppet.errors import RecordingError, reason
from shadowpuppet.io.files.text import read_toml, write_whole
from shadowpuppet.pipeline.repair.films import Checked
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.tracking.multiview.seen_stature import scaled


@dataclass(frozen=True, kw_only=True)
class Fix:
    """What was changed; plain values."""

    done: tuple[str, ...]
    """A sentence on each change; empty if nothing was certain enough."""
    files: tuple[str, ...]
    """Files written, and the old ones' copies."""
    pixels: tuple[tuple[str, float | None, float | None], ...]
    """Name and disagreement with the others, pixels, before and after, of each camera; None if unknown."""


def fix_recording(rig: Rig, checked: Checked) -> Fix:
    """Write certain delays into [start] of recording.toml, and certain rotations, and the scale of a person of known height, into a new
    calibration.toml. Changes nothing that leaves the cameras more apart than before. Raises `RecordingError` if the recording is no folder
    or a file cannot be written."""
    folder, found = rig.recording.path, checked.check
    factor = found.scale.factor if found.scale is not None and found.scale.is_known else 1.0
    if factor == 1 and (found.agreement.remedy is not None or not (found.starts or found.turns)):
        return Fix(done=(), files=(), pixels=())
    if not folder.is_dir():
        raise RecordingError(f"{folder}: expected a folder, as [start] and calibration.toml are written into it")
    before = compare_cameras(rig.cameras, aligned_sets(checked.before.rows, [0.0] * len(rig.cameras)), remedies=False)
    turned = tuple(found.turns[camera.name].turn.of(camera) if camera.name in found.turns else camera for camera in rig.cameras)
    after = compare_cameras(turned, aligned_sets(checked.sets.rows, _shifts(rig, checked)), remedies=False)
    pixels = tuple(zip(rig.names, before.apart, after.apart))
    if sum(apart or 0.0 for apart in after.apart) > sum(apart or 0.0 for apart in before.apart) + 0.1 * len(rig.cameras):
        return Fix(done=(), files=(), pixels=pixels)
    done, files = list[str](), list[Path]()
    notes: dict[str, Any] = {}
    if found.starts:
        notes["start"] = found.starts
        done.append("recording.toml: [start] " + ", ".join(f"{name} = {value:.4g}" for name, value in found.starts.items()))
    if found.turns or factor != 1:
        files += replace_calibration(folder / "calibration.toml", [
            scaled(found.turns[view.camera.name].turn.of(view.camera) if view.camera.name in found.turns else view.camera, 1 / factor)
            for view in rig.recording.views])
        done += [f"calibration.toml: all lengths divided by {factor:.3f}"] if factor != 1 else []
        done += [f"calibration.toml: {name} turned back by {fix.turn.degrees:.2f} degrees"
                 + (f" and moved back by {100 * fix.turn.distance:.1f} cm" if fix.turn.distance else "")
                 for name, fix in found.turns.items()]
        notes["calibration"] = None
    files += write_notes(folder / "recording.toml", notes)
    return Fix(done=tuple(done), files=tuple(map(str, files)), pixels=pixels)


def _shifts(rig: Rig, checked: Checked) -> list[float]:
    """Sets by which each film is late in the sets compared, of those that are late for certain."""
    found, sets = checked.check, checked.sets
    frames = dict(zip(found.lateness.names, found.lateness.frames)) if found.lateness is not None else {}
    gone = dict(zip(found.clock.names, found.clock.seconds)) if found.clock is not None and found.by_clock else {}
    return [((frames.get(name) or 0.0) - (gone.get(name) or 0.0) * rig.rate) / sets.every if name in found.late else 0.0
            for name in rig.names]


def write_notes(path: Path, changes: Mapping[str, Any]) -> list[Path]:
    """Change recording.toml; returns the files written. `calibration`: the recording's own calibration.toml counts from now on, which is in
    metres with z up, so that what was said of another's unit and up direction goes."""
    values = dict(read_toml(path, RecordingError)) if path.exists() else {}
    old = dict(values)
    if "start" in changes:
        values["start"] = dict(changes["start"])
    if "calibration" in changes:
        for key in ("calibration", "unit", "up"):
            values.pop(key, None)
    if values == old:
        return []
    kept = keep_old(path)
    try:
        write_whole(path, tomli_w.dumps(values))
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({reason(error)})") from None
    return [path, *([kept] if kept is not None else [])]
