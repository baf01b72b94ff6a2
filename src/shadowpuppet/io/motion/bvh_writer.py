"""Writes BVH files (read by `bvh.py`): Y up, as Blender's importer expects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, choices, warn
from shadowpuppet.geometry import Array, clear_order, continuous_angles
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.characters.bone_names import with_bone_names
from shadowpuppet.io.motion.trc import METRES
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.constant_bones import STILL, constant_bones
from shadowpuppet.motion.interpolation import uniform_sampling

POSITIONS = "Xposition Yposition Zposition"
UNKNOWN_END = (0.0, 0.0, 0.0)
"""End site of a leaf joint if its end is unknown."""


def write_bvh(path: str | Path, animation: Animation, unit: str = "m", names: str | None = None) -> None:
    """Write an animated skeleton: constant offsets, Euler angles in degrees, Y up.

    The format has neither gaps nor times: unknown frames are interpolated, and frames at a varying rate are resampled, each with a
    warning. All joints rotate in one order: about Z, X, Y if these stay away from their singularity, else the order that stays farthest
    from it. Only the root has position channels: other joints that move hang on joints of their own, see `constant_bones`. Many readers
    take the first joint's channels for all, and ignore or refuse positions below the root. `unit`: m (as Blender expects), cm or mm.
    `names`: of the program, of `OF_PROGRAMS`, whose names our joints get. Raises `ShadowPuppetError` if no frame is known or the file
    cannot be written.
    """
    path = Path(path)
    if unit not in METRES:
        raise ShadowPuppetError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    bad = [name for name in animation.names if len(name.split()) != 1 or set(name) & set("{}")]
    if bad:
        raise ShadowPuppetError(f"{path}: joint name: found {shorten(bad[:1])!r}, expected one without blanks and braces")
    rate, animation = at_constant_rate(path, animation)
    animation, off = constant_bones(animation)
    if off > STILL:
        warn(f"{path}: joints lie up to {1000 * off:.1f} mm off, as bones keep their lengths in this format")
    animation = with_bone_names(animation, names)
    turns = animation.rotations.copy()
    turns[:, 0] = Y_UP @ turns[:, 0]
    order, axes = _depth_first(animation), clear_order(turns.reshape(-1, 3, 3))
    columns = [column for n in order for column in _columns(animation, n, continuous_angles(turns[:, n], axes), METRES[unit])]
    head = ["HIERARCHY", *_hierarchy(animation, axes, 1 / METRES[unit]), "MOTION", f"Frames: {len(animation.times)}",
            f"Frame Time: {1 / rate:.10g}"]  # fmt: skip
    rows = (" ".join(f"{value + 0.0:.6f}" for value in row) for row in np.stack(columns, 1).round(6).tolist())
    write_whole(path, "\n".join([*head, *rows, ""]))


def at_constant_rate(path: Path, animation: Animation) -> tuple[float, Animation]:
    """Frames/s, and the animation resampled at that constant rate, without unknown frames. Warns of interpolated frames."""
    try:
        grid = uniform_sampling(animation.times)
        made = animation.at(grid.times if grid.frames is None else _own_times(animation, grid.times, grid.frames))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{path}: {error}") from None
    if grid.frames is None:
        warn(f"{path}: the frames do not come at a constant rate, which this format needs; they were resampled at {grid.rate:g} frames/s")
    unknown = int((~animation.known).sum()) + (0 if grid.frames is None else int((grid.frames < 0).sum()))
    if unknown:
        warn(f"{path}: {unknown} of {len(grid.times)} frames are not known, which this format cannot tell: the person is moved on evenly "
             "from the frame before to the one after")  # fmt: skip
    return grid.rate, made


def _own_times(animation: Animation, times: Array, frames: NDArray[np.int64]) -> Array:
    """Times of the grid, replaced by the exact times of existing frames, so that these are not interpolated."""
    return np.where(frames >= 0, animation.times[np.maximum(frames, 0)], times)


def _depth_first(animation: Animation) -> list[int]:
    """Indices of the joints depth first, the order of the file."""

    def below(n: int) -> Iterator[int]:
        yield n
        for child, parent in enumerate(animation.parents):
            if parent == n:
                yield from below(child)

    return list(below(0))


def _columns(animation: Animation, n: int, angles: Array, metres: float) -> list[Array]:
    """The values of a joint's channels, each (T,)."""
    places = [] if n else list((animation.shifts[:, 0] @ Y_UP.T / metres).T)
    return [*places, *np.degrees(angles).T]


def _hierarchy(animation: Animation, axes: str, scale: float) -> list[str]:
    lines, turns = list[str](), " ".join(f"{axis}rotation" for axis in axes)

    def add(n: int, depth: int) -> None:
        pad = "\t" * depth
        lines.extend([f"{pad}{'JOINT' if depth else 'ROOT'} {animation.names[n]}", f"{pad}{{",
                      f"{pad}\tOFFSET {_three(scale * (animation.offsets[n] if n else np.zeros(3)))}",
                      f"{pad}\tCHANNELS {'3' if n else '6 ' + POSITIONS} {turns}"])  # fmt: skip
        children = [child for child, parent in enumerate(animation.parents) if parent == n]
        for child in children:
            add(child, depth + 1)
        if not children:
            end = _three(scale * np.array(animation.ends.get(n, UNKNOWN_END)))
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {end}", f"{pad}\t}}"])
        lines.append(f"{pad}}}")

    add(0, 0)
    return lines


def _three(values: Array) -> str:
    return " ".join(f"{value + 0.0:.6f}" for value in np.round(values, 6).tolist())
