"""Exports a run's motion to files of other programs, and converts motion files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple
from warnings import warn

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, ShadowPuppetWarning, choices, reason
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion import EXPORTS, READABLE
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.c3d_writer import MAX_RESIDUAL, MM, write_c3d
from shadowpuppet.io.motion.glb import write_glb
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.npz import write_motion_npz, write_npz
from shadowpuppet.io.motion.opensim import coordinates, marker_names, write_mot
from shadowpuppet.io.motion.parquet import write_parquet
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETON_ENDINGS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.io.motion.table import dof_unit, motion_columns, table_columns, write_columns, write_joints
from shadowpuppet.io.motion.trc import METRES, write_trc
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.limbs import DOUBTFUL, limb_of
from shadowpuppet.motion.mesh import Mesh, body_mesh, bone_mesh
from shadowpuppet.motion.motion import JointTable

TOLERANCE = 1e-3
"""Distance, metres, between the exported skeleton's joints and the run's above which a warning is given."""
BVH_UNITS = {**METRES, "in": 0.0254}
"""Units of length that a BVH file may have, in metres."""


def export_run(folder: str | Path, formats: Sequence[str], out: str | Path | None = None, unit: str = "m") -> list[Path]:
    """Write a run's motion as `<run>.<format>` for each of `formats`; returns the files' paths.

    A killed run is exported up to its last frame. Warns of data that a format cannot hold. Raises a `ShadowPuppetError` for an
    unknown format, or a run that cannot be read, has no frame, or has no person.toml although a format needs the body; files already
    written stay.

    Args:
        folder: the run.
        formats: names of `EXPORTS`.
        out: folder of the files (default: export/ in the run's).
        unit: of BVH files: m, cm or mm.
    """
    unknown = [name for name in formats if name not in EXPORTS]
    if unknown or not formats:
        raise SettingsError(f"formats: found {unknown[0] if unknown else 'none'!r}, expected some of {choices(EXPORTS)}")
    if unit not in METRES:
        raise SettingsError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    export = _RunExport(read_run(folder), unit)
    if not np.isfinite(export.run.motion.joints).all(2).any():
        raise ShadowPuppetError(f"{folder}: found no frame with a known joint, expected one at least")
    target = _made(Path(folder) / "export" if out is None else Path(out))
    written = []
    for name in dict.fromkeys(formats):
        written.append(target / f"{Path(folder).resolve().name}.{name}")
        FORMATS[name].write_run(export, written[-1])
    return written


def convert_motion(source: str | Path, target: str | Path, *, own_names: bool = False, rate: float | None = None, unit: float | None = None,
                   target_unit: str = "m") -> str:
    """Convert a motion file (ending in `READABLE`) to another format (ending in `EXPORTS`); returns a summary of what was written.

    Skeletons of .bvh and .amc files are kept in .bvh and .glb files. Otherwise, if the target holds a skeleton, the poses of a whole body
    are fitted to the joints (`fit_poses`), and the summary states the residual. Raises a `ShadowPuppetError` if a file cannot be
    read or written, or the joints are too few for a body.

    Args:
        source: file to read.
        target: file to write.
        own_names: keep all points under the file's names; else keep only our joints.
        rate: frames/s of an .amc file.
        unit: metres of a .bvh source's unit, if known.
        target_unit: of a .bvh target: m, cm or mm.
    """
    source, target = Path(source), Path(target)
    kind = target.suffix.lower()
    if kind[1:] not in EXPORTS or not kind:
        raise FormatError(f"{target}: found the ending {target.suffix!r}, expected one of {choices(f'.{name}' for name in EXPORTS)}")
    if source.suffix.lower() not in READABLE:
        hint = ", a run's folder by `shadowpuppet export`" if source.is_dir() else ""
        raise FormatError(f"{source}: found the ending {source.suffix!r}, expected one of {choices(READABLE)}{hint}")
    if source.exists() and target.exists() and source.samefile(target):
        raise ShadowPuppetError(f"{target}: found the file that is to be read, expected another to be written")
    _made(target.parent)
    written = FORMATS[kind[1:]]
    if written.any_skeleton and source.suffix.lower() in SKELETON_ENDINGS:
        animation = read_animation(source, rate, unit)
        written.write_skeleton(target, animation, bone_mesh(animation), target_unit)
        return f"a skeleton of {len(animation.names)} joints, {len(animation.times)} frames"
    table = read_motion(source, rate, own_names, unit)
    if written.joints is not None:
        written.joints(target, table)
        return f"{len(table.names)} joints, {len(table.times)} frames"
    return _fitted(source, target, table, written, target_unit)


def _fitted(source: Path, target: Path, table: JointTable, written: Format, unit: str) -> str:
    """Fit a body's poses to joints and write them; returns a summary."""
    try:
        fit = fit_poses(table, source=str(source))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{target}: needs a skeleton, and none can be fitted: {error}") from None
    written.write_skeleton(target, BodyTree(fit.body).animation(fit.times, fit.poses, np.eye(4)), body_mesh(fit.body), unit)
    off = f"{1000 * fit.residual:.1f} mm beside them (rms)"
    return f"a body's poses fitted to {len(table.names)} joints, {len(table.times)} frames, {off}"


@dataclass(frozen=True, eq=False)
class _RunExport:
    """A run, and the data that formats need, each computed on first use."""

    run: Run
    unit: str

    @cached_property
    def body(self) -> Body:
        """The body with the sizes in person.toml."""
        path, name = self.run.folder / "person.toml", self.run.motion.body_name
        if not path.exists():
            raise FormatError(f"{path}: found no such file, expected the person's sizes, which BVH, GLB and MOT need; other formats do not")
        return make_body(name, read_person(path, name).sizes)

    @cached_property
    def animation(self) -> Animation:
        """The run's poses as an animated skeleton."""
        if self.run.motion.dof_names != self.body.skeleton.dof_names:
            raise FormatError(f"{self.run.folder}: found degrees of freedom that are not those of the body {self.body.name!r}")
        animation, off = motion_animation(self.body, self.run.motion)
        if off > TOLERANCE:
            warn(f"{self.run.folder}: the joints of the body in person.toml lie up to {1000 * off:.0f} mm off the run's: the person was "
                 "measured anew while it was made", ShadowPuppetWarning, stacklevel=3)  # fmt: skip
        return animation

    @property
    def spread(self) -> Array:
        """Standard deviations of the joints (T, J), metres: root mean square over the axes; of limbs that are not vouched for the greatest
        that a C3D file holds, so that programs which drop points of large residuals drop them."""
        motion = self.run.motion
        doubtful = np.isin(motion.limb_status, DOUBTFUL)[:, [motion.limbs.index(limb_of(name)) for name in motion.joint_names]]
        return np.where(doubtful, MAX_RESIDUAL / MM, np.sqrt((motion.joint_sd**2).mean(2)))

    @property
    def smoothing(self) -> str:
        """How the motion was smoothed, in words; empty if unknown."""
        return smoothing_text(self.run.info.get("smoothing"))

    @property
    def angles(self) -> dict[str, tuple[str, Array]]:
        """Unit, deg or m, and values (T,) of each degree of freedom."""
        columns = zip(self.run.motion.dof_names, self.run.motion.poses.T)
        return {name: ("m", column) if dof_unit(name) == "m" else ("deg", np.degrees(column)) for name, column in columns}


def smoothing_text(info: object) -> str:
    """The table [smoothing] of a run.toml in words; empty if there is none."""
    if not isinstance(info, dict) or "method" not in info:
        return ""
    if info["method"] == "butterworth":
        return f"Butterworth, {info.get('cutoff_hz')} Hz, order {info.get('order')}, zero lag"
    return "none" if info["method"] == "off" else "fixed-interval, over poses"


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be made ({reason(error)})") from None
    return folder


class Format(NamedTuple):
    """The writers of a format: of a run, of joints alone, or of a skeleton; None if there is none."""

    run: Callable[[_RunExport, Path], None] | None = None
    joints: Callable[[Path, JointTable], None] | None = None
    skeleton: Callable[[Path, Animation, Mesh, str], None] | None = None
    """Writes an animated skeleton with its mesh; the last argument is the unit of length."""
    any_skeleton: bool = False
    """Whether `skeleton` accepts any joint names, not only those of our bodies."""

    def write_run(self, export: _RunExport, path: Path) -> None:
        """Write a run."""
        if self.run is not None:
            self.run(export, path)
        else:
            self.write_skeleton(path, export.animation, body_mesh(export.body), export.unit)

    def write_skeleton(self, path: Path, animation: Animation, mesh: Mesh, unit: str) -> None:
        """Write an animated skeleton."""
        assert self.skeleton is not None
        self.skeleton(path, animation, mesh, unit)


def _write_markers(path: Path, table: JointTable) -> None:
    write_trc(path, marker_names(table))


FORMATS = {
    "c3d": Format(lambda export, path: write_c3d(path, export.run.motion.table, export.spread, export.angles, export.smoothing),
                  write_c3d),
    "trc": Format(lambda export, path: _write_markers(path, export.run.motion.table), _write_markers),
    "csv": Format(lambda export, path: write_columns(path, motion_columns(export.run.motion)), write_joints),
    "npz": Format(lambda export, path: write_motion_npz(path, export.run.motion), write_npz),
    "bvh": Format(skeleton=lambda path, animation, mesh, unit: write_bvh(path, animation, unit), any_skeleton=True),
    "glb": Format(lambda export, path: write_glb(path, export.animation, body_mesh(export.body), export.smoothing),
                  skeleton=lambda path, animation, mesh, unit: write_glb(path, animation, mesh), any_skeleton=True),
    "mot": Format(lambda export, path: write_mot(path, export.animation.times, coordinates(export.animation), export.smoothing),
                  skeleton=lambda path, animation, mesh, unit: write_mot(path, animation.times, coordinates(animation))),
    "parquet": Format(lambda export, path: write_parquet(path, motion_columns(export.run.motion), export.smoothing),
                      lambda path, table: write_parquet(path, table_columns(table))),
}
"""The writers of each of `EXPORTS`."""
