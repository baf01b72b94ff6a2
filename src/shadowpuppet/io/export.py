"""Exports a run's motion to files of other programs, and converts motion files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, choices, reason, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.motion import EXPORTS, READABLE
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.c3d import read_header
from shadowpuppet.io.motion.c3d_writer import MAX_RESIDUAL, MM, write_c3d
from shadowpuppet.io.motion.characters.bone_names import bone_names, with_bone_names
from shadowpuppet.io.motion.characters.usd import write_usda
from shadowpuppet.io.motion.glb import write_glb
from shadowpuppet.io.motion.joint_names import read_names
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.npz import write_motion_npz, write_npz
from shadowpuppet.io.motion.opensim.coordinates import MODELS, coordinates
from shadowpuppet.io.motion.opensim.markers import marker_names
from shadowpuppet.io.motion.opensim.model_writer import write_osim
from shadowpuppet.io.motion.opensim.mot import write_mot
from shadowpuppet.io.motion.parquet import write_parquet
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETON_ENDINGS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.io.motion.table import dof_unit, motion_columns, table_columns, write_columns, write_joints
from shadowpuppet.io.motion.trc import METRES, MISSING, write_trc
from shadowpuppet.io.people import person_folders
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation
from shadowpuppet.motion.contact.contact import FootEvent, contacts_of
from shadowpuppet.motion.contact.stances import find_stances, stance_events
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.limbs import DOUBTFUL, limb_of
from shadowpuppet.motion.mesh import Mesh, body_mesh, bone_mesh
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.rest_pose import RAISED, with_rest

TOLERANCE = 1e-3
"""Distance, metres, between the exported skeleton's joints and the run's above which a warning is given."""
BVH_UNITS = {**METRES, "in": 0.0254}
"""Units of length that a BVH file may have, in metres."""


class Layout(NamedTuple):
    """Choices of the user that some formats have."""

    unit: str | None = None
    """Unit of length of BVH and TRC files; None for the format's own."""
    missing: str = "nan"
    """What TRC files have for unknown positions, of `MISSING`."""
    model: str = "rajagopal"
    """Model, of `MODELS`, whose coordinates MOT files have."""
    weight: float | None = None
    """Of the person, kilograms, for .osim files; None: of average build."""
    rest: str = "hang"
    """Rest pose, of `RAISED`, of skeletons."""
    names: str | None = None
    """Program, of `OF_PROGRAMS`, whose names their bones have; None: ours."""

    @classmethod
    def checked(cls, unit: str | None, missing: str, model: str = "rajagopal", weight: float | None = None, rest: str = "hang",
                names: str | None = None) -> Layout:
        """A layout. Raises `SettingsError` if a choice is unknown."""
        if unit is not None and unit not in METRES:
            raise SettingsError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
        if missing not in MISSING:
            raise SettingsError(f"missing: found {missing!r}, expected one of {choices(MISSING)}")
        if model not in MODELS:
            raise SettingsError(f"model: found {model!r}, expected one of {choices(MODELS)}")
        if weight is not None and not 1 <= weight <= 500:
            raise SettingsError(f"weight: found {weight}, expected kilograms from 1 to 500")
        if rest not in RAISED:
            raise SettingsError(f"rest: found {rest!r}, expected one of {choices(RAISED)}")
        if names is not None:
            bone_names(names)
        return cls(unit, missing, model, weight, rest, names)

    def posed(self, puppet: Puppet) -> Puppet:
        """A puppet with this rest pose."""
        if self.rest == "hang":
            return puppet
        animation, mesh = with_rest(puppet.animation, puppet.mesh, self.rest)
        return puppet._replace(animation=animation, mesh=mesh)

    def character(self, puppet: Puppet) -> Puppet:
        """A puppet with this rest pose and these names."""
        posed = self.posed(puppet)
        return posed._replace(animation=with_bone_names(posed.animation, self.names))


class Puppet(NamedTuple):
    """A moving body or skeleton."""

    animation: Animation
    mesh: Mesh
    body: Body | None = None
    """None for a skeleton of a file."""


def export_run(folder: str | Path, formats: Sequence[str], out: str | Path | None = None, unit: str | None = None,
               missing: str = "nan", model: str = "rajagopal", weight: float | None = None, rest: str = "hang",
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
        model: of `MODELS`, whose coordinates MOT files have.
        weight: of the person, kilograms, for .osim files (default: average build).
        rest: rest pose of skeletons (BVH, GLB, USDA), of `RAISED`.
        names: program whose names their bones have, of `OF_PROGRAMS` (default: ours).
    """
    unknown = [name for name in formats if name not in EXPORTS]
    if unknown or not formats:
        raise SettingsError(f"formats: found {unknown[0] if unknown else 'none'!r}, expected some of {choices(EXPORTS)}")
    layout, whole = Layout.checked(unit, missing, model, weight, rest, names), Path(folder).resolve().name
    people = {f"{whole}-{path.name}": path for path in person_folders(folder).values()} or {whole: Path(folder)}
    exports = {name: _RunExport(_on_floor(read_run(path)), layout) for name, path in people.items()}
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


def _fitted(source: Path, target: Path, table: JointTable, written: Format, layout: Layout) -> str:
    """Fit a body's poses to joints and write them; returns a summary."""
    try:
        fit = fit_poses(table, source=str(source))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{target}: needs a skeleton, and none can be fitted: {error}") from None
    puppet = Puppet(BodyTree(fit.body).animation(fit.times, fit.poses, np.eye(4)), body_mesh(fit.body), fit.body)
    written.write_skeleton(target, puppet, layout)
    off = f"{1000 * fit.residual:.1f} mm beside them (rms)"
    return f"a body's poses fitted to {len(table.names)} joints, {len(table.times)} frames, {off}"


@dataclass(frozen=True, eq=False)
class _RunExport:
    """A run, and the data that formats need, each computed on first use."""

    run: Run
    layout: Layout

    @cached_property
    def body(self) -> Body:
        """The body with the sizes in person.toml."""
        path, name = self.run.folder / "person.toml", self.run.motion.body_name
        if not path.exists():
            raise FormatError(f"{path}: found no such file, expected the person's sizes, which BVH, GLB, USDA and MOT need; others "
                              "do not")
        return make_body(name, read_person(path, name).sizes)

    @cached_property
    def animation(self) -> Animation:
        """The run's poses as an animated skeleton."""
        if self.run.motion.dof_names != self.body.skeleton.dof_names:
            raise FormatError(f"{self.run.folder}: found degrees of freedom that are not those of the body {self.body.name!r}")
        animation, off = motion_animation(self.body, self.run.motion)
        if off > TOLERANCE:
            warn(f"{self.run.folder}: the joints of the body in person.toml lie up to {1000 * off:.0f} mm off the run's: the person was "
                 "measured again while it was made")  # fmt: skip
        return animation

    @cached_property
    def puppet(self) -> Puppet:
        """The run's body, moving as in the run."""
        return Puppet(self.animation, body_mesh(self.body), self.body)

    @property
    def events(self) -> list[FootEvent]:
        """When the feet meet the floor and leave it, as the movement report has it; empty for a run without soles."""
        motion = self.run.motion
        contacts = contacts_of(motion.table)
        if contacts is None:
            return []
        return stance_events(find_stances(motion.times, contacts, motion.joint_names, motion.joints, motion.joint_sd))

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
    joints: Callable[[Path, JointTable, Layout], None] | None = None
    skeleton: Callable[[Path, Puppet, Layout], None] | None = None
    any_skeleton: bool = False
    """Whether `skeleton` accepts any joint names, not only those of our bodies."""

    def write_run(self, export: _RunExport, path: Path) -> None:
        """Write a run."""
        if self.run is not None:
            self.run(export, path)
        else:
            self.write_skeleton(path, export.puppet, export.layout)

    def write_skeleton(self, path: Path, puppet: Puppet, layout: Layout) -> None:
        """Write a moving body or skeleton."""
        assert self.skeleton is not None
        self.skeleton(path, puppet, layout)


def _write_markers(path: Path, table: JointTable, layout: Layout) -> None:
    write_trc(path, marker_names(table), layout.unit or "mm", layout.missing)


def _write_coordinates(path: Path, puppet: Puppet, layout: Layout, smoothing: str = "") -> None:
    write_mot(path, puppet.animation.times, coordinates(puppet.animation, layout.model), smoothing)


def _write_model(path: Path, puppet: Puppet, layout: Layout) -> None:
    assert puppet.body is not None
    write_osim(path, puppet.body, puppet.animation, layout.weight)


def _write_bvh(path: Path, puppet: Puppet, layout: Layout) -> None:
    write_bvh(path, layout.posed(puppet).animation, layout.unit or "m", layout.names)


def _write_glb(path: Path, puppet: Puppet, layout: Layout, smoothing: str = "") -> None:
    moved = layout.character(puppet)
    write_glb(path, moved.animation, moved.mesh, smoothing, at_rest=layout.rest != "hang")


def _write_usda(path: Path, puppet: Puppet, layout: Layout, smoothing: str = "") -> None:
    moved = layout.character(puppet)
    write_usda(path, moved.animation, moved.mesh, smoothing)


FORMATS = {
    "c3d": Format(lambda export, path: write_c3d(path, export.run.motion.table, export.spread, export.angles, export.smoothing,
                                                 export.events),
                  lambda path, table, layout: write_c3d(path, table)),
    "trc": Format(lambda export, path: _write_markers(path, export.run.motion.table, export.layout), _write_markers),
    "csv": Format(lambda export, path: write_columns(path, motion_columns(export.run.motion)),
                  lambda path, table, layout: write_joints(path, table)),
    "npz": Format(lambda export, path: write_motion_npz(path, export.run.motion), lambda path, table, layout: write_npz(path, table)),
    "bvh": Format(skeleton=_write_bvh, any_skeleton=True),
    "glb": Format(lambda export, path: _write_glb(path, export.puppet, export.layout, export.smoothing), skeleton=_write_glb,
                  any_skeleton=True),
    "usda": Format(lambda export, path: _write_usda(path, export.puppet, export.layout, export.smoothing), skeleton=_write_usda,
                   any_skeleton=True),
    "mot": Format(lambda export, path: _write_coordinates(path, export.puppet, export.layout, export.smoothing),
                  skeleton=_write_coordinates),
    "osim": Format(skeleton=_write_model),
    "parquet": Format(lambda export, path: write_parquet(path, motion_columns(export.run.motion), export.smoothing),
                      lambda path, table, layout: write_parquet(path, table_columns(table))),
}
"""The writers of each of `EXPORTS`."""
