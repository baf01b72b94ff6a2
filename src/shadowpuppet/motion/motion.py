"""Motion: a tracker's estimates over time as arrays; and joints over time, from any source."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.names import composed

STATUSES = ("tracked", "uncertain", "predicted", "lost", "absent")
"""Statuses of a frame: tracked; tracked but doubtful; extrapolated without a picture; position unknown; no person visible."""
BLANK = ("lost", "absent")
"""Statuses of frames without pose and joints."""
ROUNDING = 1e-6
"""Rounding error of a time, seconds."""
SCALARS: Mapping[str, int] = {"cost": 2, "overlap": 6}
"""What a frame states beside its pose and statuses: a field of `MotionFrame`, of `Motion` and of each tracker's state; and the decimals of
its column in joints.csv. A field of `Motion` with a default, NaN, is one that older runs lack."""
PER_FRAME = ("times", "poses", "pose_sd", "joints", "joint_sd", *SCALARS, "status", "limb_status")
"""Fields of a `Motion` with one row a frame."""


@dataclass(frozen=True, eq=False)
class JointTable:
    """Joints over time. Raises `ShadowPuppetError` for wrong shapes or times that do not increase."""

    times: Array
    """Seconds, of shape (T,)."""
    names: tuple[str, ...]
    """Joint names, J of them."""
    positions: Array
    """World, metres, of shape (T, J, 3); not a number where unknown."""

    def __post_init__(self) -> None:
        """Check."""
        _set(self, names=_names("joints", self.names), times=_times(self.times), positions=np.asarray(self.positions, float))
        _check_shape("positions", self.positions, (len(self.times), len(self.names), 3))

    def select(self, names: Sequence[str]) -> JointTable:
        """The table with these joints only. Raises `ShadowPuppetError` with the names that exist."""
        places = {composed(name): n for n, name in enumerate(self.names)}
        missing = [name for name in names if composed(name) not in places]
        if missing:
            raise ShadowPuppetError(f"unknown joint {missing[0]!r}; there are: {choices(self.names)}")
        return JointTable(self.times, tuple(names), self.positions[:, [places[composed(name)] for name in names]])

    def between(self, begin: float, end: float) -> JointTable:
        """The frames from `begin` on and before `end`, seconds."""
        chosen = (self.times > begin - ROUNDING) & (self.times < end - ROUNDING)
        return JointTable(self.times[chosen], self.names, self.positions[chosen])


class Mode(NamedTuple):
    """Another place where a limb may be: one that the pictures allow, too."""

    limb: str
    """Such as `left_arm`."""
    weight: float
    """Probability that it is the right one."""
    joints: Array
    """World, metres, of shape (J, 3); not a number for joints that have no other place."""


class MotionFrame(NamedTuple):
    """One frame of a motion; fields that are left out are unknown."""

    time: float
    """Seconds."""
    status: str
    """One of `STATUSES`."""
    pose: ArrayLike | None = None
    """Degrees of freedom, of shape (D,), rad or m."""
    joints: ArrayLike | None = None
    """World, metres, of shape (J, 3)."""
    pose_sd: ArrayLike | None = None
    """Standard deviations of the pose, of shape (D,)."""
    joint_sd: ArrayLike | None = None
    """Standard deviations of the joints, of shape (J, 3), metres."""
    cost: float = np.nan
    """Pixels with one camera, m^2 with several."""
    overlap: float = np.nan
    """Intersection over union of model and silhouette, 0..1."""
    limb_status: Sequence[str] | None = None
    """Of `STATUSES`, one for each of the K limbs that the joints belong to (`motion.limbs`); without: as the frame's."""
    modes: Sequence[Mode] = ()
    """Other places of limbs; of one limb's they and the estimate are alternatives. They go to intervals.csv only."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """A tracked motion; `motion[10:20]` is a part of it. Unknown values are not a number, and so are all poses and joints of lost
    and absent frames. Raises `ShadowPuppetError` for wrong shapes, times that do not increase, or an unknown status."""

    body_name: str
    dof_names: tuple[str, ...]
    """Degrees of freedom, D of them."""
    joint_names: tuple[str, ...]
    """Joints, J of them."""
    times: Array
    """Seconds, of shape (T,)."""
    poses: Array
    """Of shape (T, D), rad or m."""
    pose_sd: Array
    """Standard deviations, of shape (T, D), rad or m."""
    joints: Array
    """World, metres, of shape (T, J, 3)."""
    joint_sd: Array
    """Standard deviations, of shape (T, J, 3), metres."""
    cost: Array
    """With one camera pixels in which model and silhouette differ, with several m^2, of shape (T,)."""
    overlap: Array
    """Intersection over union of model and silhouette, of shape (T,)."""
    status: NDArray[np.str_]
    """Of `STATUSES`, of shape (T,): `uncertain` where a frame is given as `tracked`, but none of its limbs is."""
    limb_status: NDArray[np.str_] = field(default_factory=lambda: np.empty((0, 0), str))
    """Of `STATUSES`, of shape (T, K), for each of `limbs`; without: as the frames'."""

    def __post_init__(self) -> None:
        """Check every field and convert it to its type."""
        _set(self, dof_names=_names("degrees of freedom", self.dof_names), joint_names=_names("joints", self.joint_names),
             times=_times(self.times), status=_statuses(self.status))
        T, D, J = len(self.times), len(self.dof_names), len(self.joint_names)
        shapes = {"poses": (T, D), "pose_sd": (T, D), "joints": (T, J, 3), "joint_sd": (T, J, 3), **dict.fromkeys(SCALARS, (T,))}
        _check_shape("status", self.status, (T,))
        stated = np.size(self.limb_status) > 0
        _set(self, limb_status=_statuses(self.limb_status if stated else np.repeat(self.status[:, None], len(self.limbs), axis=1)))
        _check_shape("limb_status", self.limb_status, (T, len(self.limbs)))
        unvouched = (self.status == "tracked") & ~(self.limb_status == "tracked").any(1) & (len(self.limbs) > 0)
        _set(self, status=np.where(unvouched, "uncertain", self.status))
        for name, shape in shapes.items():
            value = np.asarray(getattr(self, name), float)
            _set(self, **{name: np.full(T, value) if name in SCALARS and not value.ndim else value})
            _check_shape(name, getattr(self, name), shape)
        self._check_blank()

    def __len__(self) -> int:
        """Number of frames, T."""
        return len(self.times)

    def __getitem__(self, frames: slice | NDArray[np.bool_]) -> Motion:
        """Some frames: a slice, or a mask (T,)."""
        return replace(self, **{name: getattr(self, name)[frames] for name in PER_FRAME})

    def _check_blank(self) -> None:
        blank = np.flatnonzero(np.isin(self.status, BLANK))
        for name in ("poses", "pose_sd", "joints", "joint_sd"):
            values = getattr(self, name)[blank]
            known = blank[np.isfinite(values).any(tuple(range(1, values.ndim)))]
            if len(known):
                status = self.status[known[0]]
                raise ShadowPuppetError(f"{name}: found values in frame {known[0]}, which is {status}, expected none")

    @property
    def limbs(self) -> tuple[str, ...]:
        """The limbs that the joints belong to, K of them, such as `left_arm`."""
        return limbs_of(self.joint_names)

    @property
    def status_counts(self) -> dict[str, int]:
        """Number of frames of each status that occurs."""
        return _counts(self.status)

    @property
    def limb_status_counts(self) -> dict[str, dict[str, int]]:
        """Number of frames of each status that occurs, by limb."""
        return {limb: _counts(column) for limb, column in zip(self.limbs, self.limb_status.T)}

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether pose and joints are known in a frame, of shape (T,)."""
        return np.asarray(np.isfinite(self.poses).all(1) & np.isfinite(self.joints).all((1, 2)))

    @property
    def table(self) -> JointTable:
        """The joints as a table."""
        return JointTable(self.times, self.joint_names, self.joints)

    def frames(self) -> Iterator[MotionFrame]:
        """Its frames, one after another."""
        scalars = [dict(zip(SCALARS, row)) for row in np.stack([getattr(self, name) for name in SCALARS], 1).tolist()]
        columns = (self.times.tolist(), self.status.tolist(), self.poses, self.joints, self.pose_sd, self.joint_sd)
        for each, limbs, own in zip(zip(*columns), self.limb_status.tolist(), scalars):
            yield MotionFrame(*each, limb_status=limbs, **own)


OF_LATER_RUNS = tuple(each.name for each in fields(Motion) if each.default is not MISSING or each.default_factory is not MISSING)
"""Fields that runs made before lack."""


class MotionBuilder:
    """Collects a motion frame by frame in compact arrays."""

    def __init__(self, body_name: str, dof_names: Iterable[str], joint_names: Iterable[str]) -> None:
        """Names as in `Motion`."""
        self.body_name = body_name
        self.dof_names, self.joint_names = _names("degrees of freedom", dof_names), _names("joints", joint_names)
        self.limbs = limbs_of(self.joint_names)
        self._rows, self._status, self._limb_status = array("d"), bytearray(), bytearray()
        self._last = -np.inf

    def __len__(self) -> int:
        """Number of frames so far."""
        return len(self._status)

    def append(self, frame: MotionFrame) -> MotionFrame:
        """Add a frame, later than those before; returns it as stored: all arrays, blank if lost or absent. Raises `ShadowPuppetError`,
        and adds nothing, for a wrong shape, time or status."""
        kept = self._checked(frame)
        self._rows.extend([kept.time, *(getattr(kept, name) for name in SCALARS)])
        for values in (kept.pose, kept.pose_sd, kept.joints, kept.joint_sd):
            self._rows.frombytes(np.asarray(values).tobytes())
        self._limb_status.extend(map(STATUSES.index, kept.limb_status or ()))
        self._status.append(STATUSES.index(kept.status))
        self._last = kept.time
        return kept

    def build(self) -> Motion:
        """The motion so far."""
        D, J, T = len(self.dof_names), len(self.joint_names), len(self)
        scalars = 1 + len(SCALARS)
        width = scalars + 2 * D + 6 * J
        rows = np.array(self._rows)[: T * width].reshape(T, width)  # an interrupt may have left a part of a row
        limbs = np.frombuffer(bytes(self._limb_status), np.uint8)[: T * len(self.limbs)].reshape(T, len(self.limbs))
        poses, pose_sd, joints, joint_sd = np.split(rows[:, scalars:], np.cumsum([D, D, 3 * J]), axis=1)
        return Motion(body_name=self.body_name, dof_names=self.dof_names, joint_names=self.joint_names, times=rows[:, 0],
                      poses=poses, pose_sd=pose_sd, joints=joints.reshape(T, J, 3), joint_sd=joint_sd.reshape(T, J, 3),
                      status=np.array(STATUSES)[np.frombuffer(bytes(self._status), np.uint8)], limb_status=np.array(STATUSES)[limbs],
                      **dict(zip(SCALARS, rows[:, 1:scalars].T)))

    def _checked(self, frame: MotionFrame) -> MotionFrame:
        _statuses([frame.status])
        if not self._last < frame.time < np.inf:
            raise ShadowPuppetError(f"motion: frame {len(self)}: time: found {frame.time} s, expected more than {self._last} s")
        D, J = (len(self.dof_names),), (len(self.joint_names), 3)
        arrays = {}
        for name, shape in {"pose": D, "pose_sd": D, "joints": J, "joint_sd": J}.items():
            value = getattr(frame, name)
            arrays[name] = np.full(shape, np.nan) if value is None or frame.status in BLANK else np.array(value, float)
            _check_shape(name, arrays[name], shape)
        for name in SCALARS:
            _check_shape(name, np.asarray(getattr(frame, name), float), ())
        arrays |= {name: float(getattr(frame, name)) for name in SCALARS}
        stated = None if frame.status in BLANK else frame.limb_status
        limbs = (frame.status,) * len(self.limbs) if stated is None else tuple(stated)
        _check_shape("limb_status", _statuses(limbs), (len(self.limbs),))
        status = "uncertain" if frame.status == "tracked" and limbs and "tracked" not in limbs else frame.status
        return frame._replace(time=float(frame.time), status=status, limb_status=limbs, **arrays)


def _set(target: object, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(target, name, value)


def _names(what: str, names: Iterable[str]) -> tuple[str, ...]:
    """Checked names of table columns."""
    names = tuple(str(name) for name in names)
    forms = [*map(composed, names)]
    bad = [name for i, name in enumerate(names) if name != name.strip() or not name or name.endswith("_sd") or forms[i] in forms[:i]]
    if bad:
        raise ShadowPuppetError(f"names of {what}: found {bad[0]!r}, expected words, each once, none ending in _sd (that is for "
                                "standard deviations)")
    return names


def _times(times: ArrayLike) -> Array:
    times = np.asarray(times, float)
    bad = np.flatnonzero(~np.isfinite(times) | (np.diff(times, prepend=-np.inf) <= 0)) if times.ndim == 1 else [0]
    if len(bad):
        raise ShadowPuppetError(f"times: found {times.ravel()[bad[:1]]} s at frame {bad[0]} of an array {times.shape}, expected "
                                "finite and increasing seconds (T,)")
    return times


def _statuses(status: ArrayLike) -> NDArray[np.str_]:
    status = np.asarray(status, str)
    unknown = status[~np.isin(status, STATUSES)]
    if len(unknown):
        raise ShadowPuppetError(f"status: found {str(unknown[0])!r}, expected one of {choices(STATUSES)}")
    return status.astype(np.array(STATUSES).dtype)


def _counts(status: NDArray[np.str_]) -> dict[str, int]:
    """Number of each status that occurs in some (T,)."""
    return {each: int(count) for each in STATUSES if (count := (status == each).sum())}


def _check_shape(what: str, values: NDArray, shape: tuple[int, ...]) -> None:
    if values.shape != shape:
        raise ShadowPuppetError(f"{what}: found shape {values.shape}, expected {shape}")
    if values.dtype.kind == "f" and np.isinf(values).any():
        raise ShadowPuppetError(f"{what}: found infinity, expected finite values, or none (not a number) where unknown")
