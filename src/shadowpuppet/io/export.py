"""Motion for other programs: a run's into files of many formats, and files of motion into one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from warnings import warn

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, ShadowPuppetWarning, choices, reason
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.npz import write_npz
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.c3d_writer import write_c3d
from shadowpuppet.io.motion.glb import write_glb
from shadowpuppet.io.motion.mot import write_mot
from shadowpuppet.io.motion.motion_files import ENDINGS, read_motion
from shadowpuppet.io.motion.motion_table import dof_unit, motion_columns, table_columns, write_columns_csv
from shadowpuppet.io.motion.opensim import coordinates, marker_names
from shadowpuppet.io.motion.parquet import write_parquet
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETONS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.motion.trc import METRES, write_trc
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run, motion_bytes, read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.mesh import Mesh, body_mesh, bone_mesh
from shadowpuppet.motion.motion import JointTable

STRAY = 1e-3
"""Metres by which a written skeleton's joints may lie off the run's before that is said."""
UNITS = {**METRES, "in": 0.0254}
"""Units of length that a BVH file may have, in metres."""


def export_run(folder: str | Path, formats: Sequence[str], out: str | Path | None = None, unit: str = "m") -> list[Path]:
    """Write a run's motion in each of `formats`, names of `EXPORTS`, as `<run>.<format>` in `out` (default: export/ in the run folder).

    unit: of BVH files, m, cm or mm. What a format cannot hold is said as a warning. A killed run is exported as far as it came. Raises a
    `ShadowPuppetError` for an unknown format, a run that cannot be read or has no frame, or has no person.toml where a format needs the
    body; files that were written before stay.
    """
    unknown = [name for name in formats if name not in EXPORTS]
    if unknown or not formats:
        raise SettingsError(f"formats: found {unknown[0] if unknown else 'none'!r}, expected some of {choices(EXPORTS)}")
    if unit not in METRES:
        raise SettingsError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    export = _Export(read_run(folder), unit)
    if not np.isfinite(export.run.motion.joints).all(2).any():
        raise ShadowPuppetError(f"{folder}: found no frame with a known joint, expected one at least")
    target = _made(Path(folder) / "export" if out is None else Path(out))
    written = []
    for name in dict.fromkeys(formats):
        written.append(target / f"{Path(folder).resolve().name}.{name}")
        EXPORTS[name](export, written[-1])
    return written


def convert_motion(source: str | Path, target: str | Path, *, own_names: bool = False, rate: float | None = None, unit: float | None = None,
                   target_unit: str = "m") -> str:
    """Write the motion of a file, of any kind that `read_motion` reads, as another, by its ending one of `CONVERSIONS`.

    Of .bvh and .amc files the skeleton is kept in .bvh and .glb files. Other files have joints alone: where the target holds a skeleton, a
    whole body's poses are fitted to them (`fit_poses`), and what that leaves is in the text that is returned. own_names: keep all points as
    they are called there, not our joints alone. rate: of .amc files, frames/s; unit: metres of a .bvh file's unit, where it is known.
    Raises a `ShadowPuppetError` where a file cannot be read or written, or joints are too few for a body.
    """
    source, target = Path(source), Path(target)
    kind = target.suffix.lower()
    if kind not in CONVERSIONS:
        raise FormatError(f"{target}: found the ending {target.suffix!r}, expected one of {choices(CONVERSIONS)}")
    if source.suffix.lower() not in ENDINGS:
        told = ", a run's folder by `shadowpuppet export`" if source.is_dir() else ""
        raise FormatError(f"{source}: found the ending {source.suffix!r}, expected one of {choices(ENDINGS)}{told}")
    if source.exists() and target.exists() and source.samefile(target):
        raise ShadowPuppetError(f"{target}: found the file that is to be read, expected another to be written")
    _made(target.parent)
    if kind in (".bvh", ".glb") and source.suffix.lower() in SKELETONS:
        animation = read_animation(source, rate, unit)
        _write_skeleton(target, animation, bone_mesh(animation), target_unit)
        return f"a skeleton of {len(animation.names)} joints, {len(animation.times)} frames"
    table = read_motion(source, rate, own_names, unit)
    if kind in TABLES:
        TABLES[kind](target, table)
        return f"{len(table.names)} joints, {len(table.times)} frames"
    return _fitted(source, target, table, target_unit)


def _fitted(source: Path, target: Path, table: JointTable, unit: str) -> str:
    """Write a body's poses that stand for joints."""
    try:
        found = fit_poses(table, source=str(source))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{target}: needs a skeleton, and none can be fitted: {error}") from None
    animation = BodyTree(found.body).animation(found.times, found.poses, np.eye(4))
    if target.suffix.lower() == ".mot":
        write_mot(target, animation.times, coordinates(animation))
    else:
        _write_skeleton(target, animation, body_mesh(found.body), unit)
    off = f"{1000 * found.residual:.1f} mm beside them (rms)"
    return f"a body's poses fitted to {len(table.names)} joints, {len(table.times)} frames, {off}"


def _write_skeleton(target: Path, animation: Animation, mesh: Mesh, unit: str) -> None:
    if target.suffix.lower() == ".glb":
        write_glb(target, animation, mesh)
    else:
        write_bvh(target, animation, unit)


@dataclass(frozen=True, eq=False)
class _Export:
    """A run, and what formats need of it."""

    run: Run
    unit: str

    @cached_property
    def body(self) -> Body:
        """Of the sizes in person.toml."""
        path, name = self.run.folder / "person.toml", self.run.motion.body_name
        if not path.exists():
            raise FormatError(f"{path}: found no such file, expected the person's sizes, which BVH, GLB and MOT need; other formats do not")
        return make_body(name, read_person(path, name).sizes)

    @cached_property
    def animation(self) -> Animation:
        """The run's poses as a skeleton that moves."""
        if self.run.motion.dof_names != self.body.skeleton.dof_names:
            raise FormatError(f"{self.run.folder}: found degrees of freedom that are not those of the body {self.body.name!r}")
        animation, off = motion_animation(self.body, self.run.motion)
        if off > STRAY:
            warn(f"{self.run.folder}: the joints of the body in person.toml lie up to {1000 * off:.0f} mm off the run's: the person was "
                 "measured anew while it was made", ShadowPuppetWarning, stacklevel=3)  # fmt: skip
        return animation

    @property
    def spread(self) -> Array:
        """Standard deviations of the joints' places (T, J), metres: root of the mean variance of an axis."""
        return np.sqrt((self.run.motion.joint_sd**2).mean(2))

    @property
    def angles(self) -> dict[str, tuple[str, Array]]:
        """Degrees of freedom as files for people have them: unit and values (T,)."""
        columns = zip(self.run.motion.dof_names, self.run.motion.poses.T)
        return {name: ("m", column) if dof_unit(name) == "m" else ("deg", np.degrees(column)) for name, column in columns}


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be made ({reason(error)})") from None
    return folder


EXPORTS: dict[str, Callable[[_Export, Path], None]] = {
    "c3d": lambda export, path: write_c3d(path, export.run.motion.table, export.spread, export.angles),
    "trc": lambda export, path: write_trc(path, marker_names(export.run.motion.table)),
    "csv": lambda export, path: write_columns_csv(path, motion_columns(export.run.motion)),
    "npz": lambda export, path: write_whole(path, motion_bytes(export.run.motion)),
    "bvh": lambda export, path: write_bvh(path, export.animation, export.unit),
    "glb": lambda export, path: write_glb(path, export.animation, body_mesh(export.body)),
    "mot": lambda export, path: write_mot(path, export.run.motion.times, coordinates(export.animation)),
    "parquet": lambda export, path: write_parquet(path, motion_columns(export.run.motion)),
}
"""How a run is written in each format; those that need person.toml come later, and pyarrow last."""
TABLES: dict[str, Callable[[Path, JointTable], None]] = {
    ".c3d": write_c3d, ".csv": write_joints, ".npz": write_npz, ".parquet": lambda path, table: write_parquet(path, table_columns(table)),
    ".trc": lambda path, table: write_trc(path, marker_names(table)),
}  # fmt: skip
"""How joints alone are written."""
CONVERSIONS = (*TABLES, ".bvh", ".glb", ".mot")
"""What files can be made of others."""
