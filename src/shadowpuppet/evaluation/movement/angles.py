"""Joint angles of a run as movement science names them, over the gait cycle, and their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.models import WHOLE, make_body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array, wrapped
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.opensim.coordinates import coordinates
from shadowpuppet.io.motion.table import dof_unit
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run
from shadowpuppet.motion.body_animation import BodyTree, base_in_world
from shadowpuppet.motion.contact.steps import MOST_DOUBT, Gait, Stride
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.motion import Motion

PERCENT = np.arange(101.0)
"""Of the gait cycle."""
STEP = 1e-5
"""Step of finite differences, rad."""
HEADING = "pelvis rotation"
"""The angle that turns with the way; of each cycle its mean and drift are removed."""
PELVIS = {"pelvis tilt": "root_bow", "pelvis list": "root_tilt", HEADING: "root_heading"}
"""The pelvis' angles, in the order rotation, tilt, list, which holds whichever way people walk (Baker 2001); OpenSim's tilt is about an
axis of the world."""


class Angle(NamedTuple):
    """A joint's angle over time."""

    name: str
    """Without the side, such as `hip flexion`."""
    side: str
    """`left`, `right`, or empty in the middle of the body."""
    degrees: Array
    """Of shape (T,); NaN where unknown."""
    sd: Array
    """Its stated deviation, degrees, of shape (T,)."""
    sure: NDArray[np.bool_]
    """Whether its limb is vouched for, of shape (T,)."""


class Cycle(NamedTuple):
    """An angle over the gait cycle of a foot, at each of `PERCENT`, degrees."""

    name: str
    side: str
    """Of the foot."""
    number: int
    """Strides of it in which the angle is known throughout, and vouched for in all but `MOST_DOUBT` of the frames."""
    mean: Array
    sd: Array
    """Over the strides; NaN for one."""
    stated: Array
    """Half width of the 90 % interval, by the run's own statement."""


class Range(NamedTuple):
    """Range of motion of an angle, degrees, over the frames in which it is vouched for."""

    name: str
    side: str
    low: float
    high: float
    speed: float
    """Greatest angular speed, degrees/s."""
    stated: float
    """Half width of the 90 % interval of the angle, in the mean."""
    frames: int
    left_out: int
    """Numbers of frames."""


def joint_angles(run: Run) -> list[Angle]:
    """Angles of a run. Of a whole body with person.toml: the coordinates of `export --model own`, but for `PELVIS`; else the degrees of
    freedom."""
    motion, path = run.motion, run.folder / "person.toml"
    if motion.body_name in WHOLE and path.exists() and motion.known.any():
        body = make_body(motion.body_name, read_person(path, motion.body_name).sizes)
        if motion.dof_names == body.skeleton.dof_names:
            return _coordinates(BodyTree(body), motion)
    kept = [d for d, name in enumerate(motion.dof_names) if dof_unit(name) == "rad"]
    sides = [name.split("_")[0] if name.split("_")[0] in SIDES else "" for name in motion.dof_names]
    names = [name.removeprefix("left_").removeprefix("right_") for name in motion.dof_names]
    limbs = [limb_of("_".join(name.split("_")[:2])) for name in motion.dof_names]
    return [_angle(motion, names[d], sides[d], limbs[d], motion.poses[:, d], motion.pose_sd[:, d]) for d in kept]


def cycles(times: Array, angles: Sequence[Angle], gait: Gait) -> list[Cycle]:
    """Angles over the cycles of a gait at `times` (T,), seconds: a limb's over those of the foot on its side, others over both."""
    found = []
    for angle in angles:
        for side in (angle.side,) if angle.side else SIDES:
            own = [over for stride in gait.strides if stride.side == side and (over := _over(times, angle, stride)) is not None]
            if own:
                values, sd = np.stack(own).swapaxes(0, 1)
                spread = values.std(0, ddof=1) if len(own) > 1 else np.full(len(PERCENT), np.nan)
                found.append(Cycle(angle.name, side, len(own), values.mean(0), spread, HALF_WIDTH * np.sqrt((sd**2).mean(0))))
    return found


def ranges(times: Array, angles: Sequence[Angle]) -> list[Range]:
    """Ranges of angles at `times` (T,), seconds, without angles that are never vouched for."""
    found = []
    for angle in angles:
        known = angle.sure & np.isfinite(angle.degrees)
        if known.sum() > 2:
            speed = np.abs(np.gradient(np.where(known, angle.degrees, np.nan), times))
            peak = float(np.nanmax(speed)) if np.isfinite(speed).any() else np.nan
            values, sd = angle.degrees[known], angle.sd[known]
            found.append(Range(angle.name, angle.side, float(values.min()), float(values.max()), peak,
                               float(HALF_WIDTH * np.sqrt((sd**2).mean())), int(known.sum()), int((~known).sum())))
    return found


def _over(times: Array, angle: Angle, stride: Stride) -> Array | None:
    """An angle and its deviation (2, 101) over a stride; None if a `Cycle` does not count it."""
    within = (times >= stride.begin - 1e-9) & (times <= stride.end + 1e-9)
    if not np.isfinite(angle.degrees[within]).all() or angle.sure[within].mean() < 1 - MOST_DOUBT:
        return None
    at = stride.begin + PERCENT / 100 * stride.seconds
    values, sd = (np.interp(at, times[within], series[within]) for series in (angle.degrees, angle.sd))
    if angle.name == HEADING:
        values = values - np.linspace(values[0], values[-1], len(values))
        values = values - values.mean()
    return np.stack([values, sd])


def _coordinates(tree: BodyTree, motion: Motion) -> list[Angle]:
    """Coordinates of the own model, with deviations from those of the degrees of freedom, taken to be independent. Each coordinate depends
    on the degrees of freedom of one joint, so that the first of every joint are moved at once, then the second, then the third."""
    known = motion.known
    root, _ = base_in_world(tree.body, motion)
    poses = np.where(known[:, None], motion.poses, np.nan)

    def at(moved: Array) -> dict[str, Array]:
        return coordinates(tree.animation(motion.times, moved, root), "own")

    middle = at(poses)
    owners = [dof.joint if dof.kind != "translation" else None for dof in tree.body.skeleton.dofs]
    rank = np.array([-1 if owner is None else owners[:d].count(owner) for d, owner in enumerate(owners)])
    variance = {name: np.zeros(len(motion)) for name in middle}
    for n in range(rank.max() + 1):
        above = at(poses + STEP * np.where(rank == n, np.nan_to_num(motion.pose_sd), 0.0))
        for name, values in middle.items():
            variance[name] += (wrapped(above[name] - values) / STEP) ** 2
    stated = np.isfinite(motion.pose_sd).all(1)
    own = [(name, motion.dof_names.index(dof)) for name, dof in PELVIS.items()]
    return ([_angle(motion, name, "", "trunk", motion.poses[:, d], motion.pose_sd[:, d]) for name, d in own]
            + [_angle(motion, *_named(name), values, np.where(stated, np.sqrt(variance[name]), np.nan)) for name, values in middle.items()
               if not name.startswith("pelvis_")])


def _named(coordinate: str) -> tuple[str, str, str]:
    """Name, side and limb of a coordinate such as `hip_flexion_l`."""
    side = {"_l": "left", "_r": "right"}.get(coordinate[-2:], "")
    name = (coordinate[:-2] if side else coordinate).replace("_", " ")
    part = "leg" if name.split()[0] in ("hip", "knee", "ankle", "subtalar") else "arm"
    return name, side, f"{side}_{part}" if side else "trunk"


def _angle(motion: Motion, name: str, side: str, limb: str, values: Array, sd: Array) -> Angle:
    sure = motion.limb_status[:, motion.limbs.index(limb)] == "tracked" if limb in motion.limbs else motion.status == "tracked"
    return Angle(name.replace("_", " "), side, np.degrees(values), np.degrees(sd), sure)
