"""BVH files written: Y up, as Blender's importer takes them, whose reading is in `bvh.py`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning, choices
from shadowpuppet.geometry import Array, clear_order, continuous_angles
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.trc import METRES
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.interpolation import uniform_sampling

PLACES = "Xposition Yposition Zposition"
LEAST_END = (0.0, 0.0, 0.0)
"""The end of a leaf of which nothing is known."""


def write_bvh(path: str | Path, animation: Animation, unit: str = "m") -> None:
    """Write an animated skeleton: constant offsets, Euler angles in degrees, Y up.

    The format has no gaps and no times: frames that are not known are bridged from those before and after them, and where frames do not
    come at a constant rate they are found anew at one; either is said as a warning. A joint turns about Z, X, Y where these stay away from
    the posture in which they are singular, and in another order where they do not; it has places only where they change. `unit`: m (as
    Blender takes it), cm or mm. Raises `ShadowPuppetError` where no frame is known or the file cannot be written.
    """
    path = Path(path)
    if unit not in METRES:
        raise ShadowPuppetError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    bad = [name for name in animation.names if len(name.split()) != 1 or set(name) & set("{}")]
    if bad:
        raise ShadowPuppetError(f"{path}: joint name: found {shorten(bad[:1])!r}, expected one without blanks and braces")
    rate, animation = in_step(path, animation)
    order = _depth_first(animation)
    turned = {n: _turned(animation, n) for n in order}
    columns = [column for n in order for column in _columns(animation, n, turned[n][1], METRES[unit])]
    head = ["HIERARCHY", *_hierarchy(animation, turned, 1 / METRES[unit]), "MOTION", f"Frames: {len(animation.times)}",
            f"Frame Time: {1 / rate:.10g}"]  # fmt: skip
    rows = (" ".join(f"{value + 0.0:.6f}" for value in row) for row in np.stack(columns, 1).round(6).tolist())
    write_whole(path, "\n".join([*head, *rows, ""]))


def in_step(path: Path, animation: Animation) -> tuple[float, Animation]:
    """Frames/s, and the animation at that rate with every frame known. Warns of what was made up."""
    try:
        grid = uniform_sampling(animation.times)
        made = animation.at(grid.times if grid.frames is None else _own_times(animation, grid.times, grid.frames))
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{path}: {error}") from None
    if grid.frames is None:
        warn(f"{path}: the frames do not come at a constant rate, which this format needs; they were found anew at {grid.rate:g} frames/s",
             ShadowPuppetWarning, stacklevel=3)  # fmt: skip
    unknown = int((~animation.known).sum()) + (0 if grid.frames is None else int((grid.frames < 0).sum()))
    if unknown:
        warn(f"{path}: {unknown} of {len(grid.times)} frames are not known, which this format cannot tell: the person is moved on evenly "
             "from the frame before to the one after", ShadowPuppetWarning, stacklevel=3)  # fmt: skip
    return grid.rate, made


def _own_times(animation: Animation, times: Array, frames: NDArray[np.int64]) -> Array:
    """The frames' own times where there is one, so that nothing is interpolated that is known."""
    return np.where(frames >= 0, animation.times[np.maximum(frames, 0)], times)


def _depth_first(animation: Animation) -> list[int]:
    """Indices of the joints in the order of the file: each before its children, which follow at once."""

    def below(n: int) -> Iterator[int]:
        yield n
        for child, parent in enumerate(animation.parents):
            if parent == n:
                yield from below(child)

    return list(below(0))


def _turned(animation: Animation, n: int) -> tuple[str, Array]:
    """The order of a joint's turns, and its angles (T, 3), rad."""
    rotations = animation.rotations[:, n]
    if animation.parents[n] < 0:
        rotations = Y_UP @ rotations
    order = clear_order(rotations)
    return order, continuous_angles(rotations, order)


def _columns(animation: Animation, n: int, angles: Array, metres: float) -> list[Array]:
    """Values of a joint's channels, each (T,)."""
    shifts = animation.shifts[:, n] @ Y_UP.T if n == 0 else animation.shifts[:, n]
    places = list((shifts / metres).T) if n == 0 or n in animation.moving else []
    return [*places, *np.degrees(angles).T]


def _hierarchy(animation: Animation, turned: dict[int, tuple[str, Array]], scale: float) -> list[str]:
    lines = list[str]()

    def tell(n: int, depth: int) -> None:
        pad, moves = "\t" * depth, n == 0 or n in animation.moving
        turns = " ".join(f"{axis}rotation" for axis in turned[n][0])
        lines.extend([f"{pad}{'JOINT' if depth else 'ROOT'} {animation.names[n]}", f"{pad}{{",
                      f"{pad}\tOFFSET {_three(scale * (animation.offsets[n] if n else np.zeros(3)))}",
                      f"{pad}\tCHANNELS {'6 ' + PLACES if moves else '3'} {turns}"])  # fmt: skip
        children = [child for child, parent in enumerate(animation.parents) if parent == n]
        for child in children:
            tell(child, depth + 1)
        if not children:
            end = _three(scale * np.array(animation.ends.get(n, LEAST_END)))
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {end}", f"{pad}\t}}"])
        lines.append(f"{pad}}}")

    tell(0, 0)
    return lines


def _three(values: Array) -> str:
    return " ".join(f"{value + 0.0:.6f}" for value in np.round(values, 6).tolist())
