"""Exports a run's motion to files of other programs, and converts motion files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from scipy.constants import inch

from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, choices, reason, warn
from shadowpuppet.io.export_formats import FORMATS, ExportFormat, Layout, Puppet, RunExport
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.motion import EXPORTS, READABLE
from shadowpuppet.io.motion.c3d import read_header
from shadowpuppet.io.motion.joint_names import read_names
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETON_ENDINGS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.io.motion.trc import METRES
from shadowpuppet.io.people import person_folders
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.mesh import body_mesh, bone_mesh
from shadowpuppet.motion.motion import JointTable

BVH_UNITS = {**METRES, "in": inch}
"""Units of length that a BVH file may have, in metres."""


def export_run(folder: str | Path, formats: Sequence[str], out: str | Path | None = None, unit: str | None = None,
               missing: str = "nan", model: str | None = None, weight: float | None = None, rest: str = "hang",
               names: str | None = None) -> list[Path]:
    """Write a run's motion as `<run>.<format>` for each of `formats`; returns the files' paths. Of several people a file each,
    `<run>-person-1.<format>`, ...

    The floor is at 0: a run whose world has it elsewhere (`Run.floor`) is raised. A killed run is exported up to its last frame. Warns of
    data that a format cannot hold. Raises a `ShadowPuppetError` for an unknown format, or a run that cannot be read, has no frame, or has
    no person.toml although a format needs the body; files already written stay.

    Args:
        folder: the run.
        formats: names of `EXPORTS`.
        out: folder of the files (default: export/ in the run's).
        unit: of BVH and TRC files: m, cm or mm (default: m in BVH, mm in TRC).
        missing: what TRC files have for unknown positions: nan, drop or fill, as in `write_trc`.
        model: of `MODELS`, whose coordinates MOT files have, by default own
            if `formats` has osim, so that the two files fit, else rajagopal.
        weight: of the person, kilograms, for .osim files (default: average build).
        rest: rest pose of skeletons (BVH, GLB, USDA), of `RAISED`.
        names: program whose names their bones have, of `OF_PROGRAMS` (default: ours).
    """
    unknown = [name for name in formats if name not in EXPORTS]
    if unknown or not formats:
        raise SettingsError(f"formats: found {unknown[0] if unknown else 'none'!r}, expected some of {choices(EXPORTS)}")
    model = model or ("own" if "osim" in formats else "rajagopal")
    layout, whole = Layout.checked(unit, missing, model, weight, rest, names), Path(folder).resolve().name
    people = {f"{whole}-{path.name}": path for path in person_folders(folder).values()} or {whole: Path(folder)}
    exports = {name: RunExport(_on_floor(read_run(path)), layout) for name, path in people.items()}
    known = {name: export for name, export in exports.items() if np.isfinite(export.run.motion.joints).all(2).any()}
    if not known:
        raise ShadowPuppetError(f"{folder}: found no frame with a known joint, expected one at least")
    for name in exports.keys() - known.keys():
        warn(f"{name} is left out: it has no frame with a known joint")
    target, written = _made(Path(folder) / "export" if out is None else Path(out)), []
    for kind, (name, export) in product(dict.fromkeys(formats), known.items()):
        written.append(target / f"{name}.{kind}")
        FORMATS[kind].write_run(export, written[-1])
    return written


def _on_floor(run: Run) -> Run:
    """A run with its joints in a world whose floor is at 0."""
    motion = run.motion
    return replace(run, motion=replace(motion, joints=motion.joints - [0, 0, run.floor])) if run.floor else run


def convert_motion(source: str | Path, target: str | Path, *, own_names: bool = False, rate: float | None = None, unit: float | None = None,
                   target_unit: str | None = None, missing: str = "nan", names: str | Path | None = None) -> str:
    """Convert a motion file (ending in `READABLE`) to another format (ending in `EXPORTS`); returns a summary of what was written.

    Skeletons of .bvh and .amc files are kept in .bvh, .glb and .usda files. Otherwise, if the target holds a skeleton, the poses of a
    whole body are fitted to the joints (`fit_poses`), and the summary states the residual. Raises a `ShadowPuppetError` if a file cannot be
    read or written, or the joints are too few for a body.

    Args:
        source: file to read.
        target: file to write.
        own_names: keep all points under the file's names; else keep only our joints.
        rate: frames/s of an .amc file.
        unit: metres of a .bvh source's unit, if known.
        target_unit: of a .bvh or .trc target: m, cm or mm (default: m in BVH, mm in TRC).
        missing: what a .trc target has for unknown positions: nan, drop or fill, as in `write_trc`.
        names: TOML file with the source's names of our joints, as in `read_names`.
    """
    layout = Layout.checked(target_unit, missing)
    source, target = Path(source), Path(target)
    kind = target.suffix.lower()
    if kind[1:] not in EXPORTS or not kind:
        raise FormatError(f"{target}: found the ending {target.suffix!r}, expected one of {choices(f'.{name}' for name in EXPORTS)}")
    if source.suffix.lower() not in READABLE:
        hint = ", a run's folder by `shadowpuppet export`" if source.is_dir() else ""
        raise FormatError(f"{source}: found the ending {source.suffix!r}, expected one of {choices(READABLE)}{hint}")
    if source.exists() and target.exists() and source.samefile(target):
        raise ShadowPuppetError(f"{target}: found the file that is to be read, expected another to be written")
    given = None if names is None else read_names(names)
    _made(target.parent)
    written = FORMATS[kind[1:]]
    if written.any_skeleton and source.suffix.lower() in SKELETON_ENDINGS:
        animation = read_animation(source, rate, unit, given)
        written.write_skeleton(target, Puppet(animation, bone_mesh(animation)), layout)
        return f"a skeleton of {len(animation.names)} joints, {len(animation.times)} frames"
    table = read_motion(source, rate, own_names, unit, given)
    _warn_of_channels(source)
    if written.joints is not None:
        written.joints(target, table, layout)
        return f"{len(table.names)} joints, {len(table.times)} frames"
    return _fitted(source, target, table, written, layout)


def _warn_of_channels(source: Path) -> None:
    """Warn of the analog channels of a .c3d file, which are not converted."""
    channels = read_header(source).channels if source.suffix.lower() == ".c3d" else []
    if channels:
        warn(f"{source}: its {len(channels)} analog channels ({shorten(channels, 60)}) are left out: only points are converted")


def _fitted(source: Path, target: Path, table: JointTable, written: ExportFormat, layout: Layout) -> str:
    """Fit a body's poses to joints and write them; returns a summary."""
    try:
        fit = fit_poses(table, source=str(source))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{target}: needs a skeleton, and none can be fitted: {error}") from None
    puppet = Puppet(BodyTree(fit.body).animation(fit.times, fit.poses, np.eye(4)), body_mesh(fit.body), fit.body)
    written.write_skeleton(target, puppet, layout)
    off = f"{1000 * fit.residual:.1f} mm beside them (rms)"
    return f"a body's poses fitted to {len(table.names)} joints, {len(table.times)} frames, {off}"


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be made ({reason(error)})") from None
    return folder
