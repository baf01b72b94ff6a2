"""What a run or a motion is written as in each format of other programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError, SettingsError, choices, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.c3d_writer import MAX_BYTE, write_c3d
from shadowpuppet.io.motion.characters.bone_names import bone_names, with_bone_names
from shadowpuppet.io.motion.characters.usd import write_usda
from shadowpuppet.io.motion.glb import write_glb
from shadowpuppet.io.motion.npz import write_motion_npz, write_npz
from shadowpuppet.io.motion.opensim.coordinates import MODELS, coordinates
from shadowpuppet.io.motion.opensim.model_writer import marker_names, write_osim
from shadowpuppet.io.motion.opensim.mot import write_mot
from shadowpuppet.io.motion.parquet import write_parquet
from shadowpuppet.io.motion.table import dof_unit, motion_columns, table_columns, write_columns, write_joints
from shadowpuppet.io.motion.trc import METRES, MISSING, write_trc
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import motion_animation
from shadowpuppet.motion.contact.contact import FootEvent, contacts_of
from shadowpuppet.motion.contact.stances import find_stances, stance_events
from shadowpuppet.motion.limbs import DOUBTFUL, limb_of
from shadowpuppet.motion.mesh import Mesh, body_mesh
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.rest_pose import RAISED, with_rest

TOLERANCE = 1e-3
"""Distance, metres, between the exported skeleton's joints and the run's above which a warning is given."""


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
        for what, value, known in (("unit", unit, METRES), ("missing", missing, MISSING), ("model", model, MODELS), ("rest", rest, RAISED)):
            if value not in known and not (what == "unit" and value is None):
                raise SettingsError(f"{what}: found {value!r}, expected one of {choices(known)}")
        if weight is not None and not 1 <= weight <= 500:
            raise SettingsError(f"weight: found {weight}, expected kilograms from 1 to 500")
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


@dataclass(frozen=True, eq=False)
class RunExport:
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
        return np.where(doubtful, MAX_BYTE / 1000, np.sqrt((motion.joint_sd**2).mean(2)))

    @property
    def smoothing(self) -> str:
        """Smoothing of the motion, in words; empty if unknown."""
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


class ExportFormat(NamedTuple):
    """The writers of a format: of a run, of joints alone, or of a skeleton; None if there is none."""

    run: Callable[[RunExport, Path], None] | None = None
    joints: Callable[[Path, JointTable, Layout], None] | None = None
    skeleton: Callable[[Path, Puppet, Layout], None] | None = None
    any_skeleton: bool = False
    """Whether `skeleton` accepts any joint names, not only those of our bodies."""

    def write_run(self, export: RunExport, path: Path) -> None:
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
    "c3d": ExportFormat(lambda export, path: write_c3d(path, export.run.motion.table, export.spread, export.angles, export.smoothing,
                                                 export.events),
                  lambda path, table, layout: write_c3d(path, table)),
    "trc": ExportFormat(lambda export, path: _write_markers(path, export.run.motion.table, export.layout), _write_markers),
    "csv": ExportFormat(lambda export, path: write_columns(path, motion_columns(export.run.motion)),
                  lambda path, table, layout: write_joints(path, table)),
    "npz": ExportFormat(lambda export, path: write_motion_npz(path, export.run.motion), lambda path, table, layout: write_npz(path, table)),
    "bvh": ExportFormat(skeleton=_write_bvh, any_skeleton=True),
    "glb": ExportFormat(lambda export, path: _write_glb(path, export.puppet, export.layout, export.smoothing), skeleton=_write_glb,
                  any_skeleton=True),
    "usda": ExportFormat(lambda export, path: _write_usda(path, export.puppet, export.layout, export.smoothing), skeleton=_write_usda,
                   any_skeleton=True),
    "mot": ExportFormat(lambda export, path: _write_coordinates(path, export.puppet, export.layout, export.smoothing),
                  skeleton=_write_coordinates),
    "osim": ExportFormat(skeleton=_write_model),
    "parquet": ExportFormat(lambda export, path: write_parquet(path, motion_columns(export.run.motion), export.smoothing),
                      lambda path, table, layout: write_parquet(path, table_columns(table))),
}
"""The writers of each of `EXPORTS`."""
