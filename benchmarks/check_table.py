"""How well `shadowpuppet check` finds what is wrong with a calibration: faults are made in a good recording, and what is found is written
beside what is true, as a table for docs/calibration.md.

    python benchmarks/check_table.py RECORDING [--masks]

Silhouettes are made from the films, once; --masks takes the recording's ready ones. Some minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.repair.check import CalibrationCheck, SilhouetteSets, gather_silhouettes, judge_calibration
from shadowpuppet.pipeline.rig import Rig, open_rig

MARGIN = 12
"""Sets at both ends that films are shifted into."""


@dataclass(frozen=True)
class Fault:
    """What is made wrong; by camera where there are several numbers."""

    name: str
    turn: tuple[int, tuple[float, float, float]] | None = None
    """A camera, and by how many degrees it was turned right, down and clockwise since it was calibrated."""
    moved: tuple[int, float] | None = None
    """A camera, and by how many metres it was carried to its right."""
    late: tuple[int, ...] = ()
    swapped: tuple[int, int] | None = None
    mirrored: int | None = None


def faults() -> Iterator[Fault]:
    yield Fault("nothing")
    for degrees in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0):
        yield Fault(f"third camera turned {degrees:g}° right", turn=(2, (degrees, 0, 0)))
    yield Fault("second turned 2° down", turn=(1, (0, 2, 0)))
    yield Fault("first rolled 3° clockwise", turn=(0, (0, 0, 3)))
    yield Fault("third carried 10 cm", moved=(2, 0.1))
    for sets in (1, 3, 8):
        yield Fault("second late", late=(0, sets))
    yield Fault("first early", late=(-4,))
    yield Fault("second late, fourth early", late=(0, 3, 0, -2))
    yield Fault("third turned 2° right, and late", turn=(2, (2, 0, 0)), late=(0, 0, 3))
    yield Fault("first and second swapped", swapped=(0, 1))
    yield Fault("third mirrored", mirrored=2)


def with_fault(rig: Rig, sets: SilhouetteSets, fault: Fault) -> tuple[Rig, SilhouetteSets]:
    """The rig as it would be calibrated, and what its cameras would have seen."""
    cameras, order = list(rig.cameras), list(range(len(rig.cameras)))
    if fault.turn is not None or fault.moved is not None:
        n, vector = (fault.turn[0], fault.turn[1]) if fault.turn is not None else ((fault.moved or (0, 0.0))[0], (0, 0, 0))
        right, down, clockwise = vector
        back = -np.radians([down, -right, -clockwise])
        carried = [fault.moved[1] if fault.moved is not None else 0.0, 0, 0]
        cameras[n] = replace(cameras[n], T_camera_world=rigid(rotation_from_vector(back), carried) @ cameras[n].T_camera_world)
    if fault.swapped is not None:
        a, b = fault.swapped
        order[a], order[b] = b, a
    late = [*fault.late, *[0] * (len(cameras) - len(fault.late))]
    rows = []
    for f in range(MARGIN, len(sets.rows) - MARGIN):
        row = [sets.rows[f - late[k]][k] for k in order]
        rows.append([one.mirrored() if n == fault.mirrored and one is not None else one for n, one in enumerate(row)])
    footage = tuple(replace(each, camera=camera) for each, camera in zip(rig.footage, cameras))
    return Rig(rig.recording, footage), SilhouetteSets(rows, sets.every)


def row(fault: Fault, found: CalibrationCheck) -> Sequence[str]:
    apart = {name: value for name, value in zip(found.agreement.names, found.agreement.apart) if value is not None}
    worst = max(apart, key=lambda name: apart[name])
    pixels = f"{worst} {apart[worst]:.1f}, others up to {max(v for n, v in apart.items() if n != worst):.1f}"
    frames = dict(zip(found.lateness.names, found.lateness.frames)) if found.lateness is not None else {}
    late = ", ".join(f"{name} {value:+.1f}" for name, value in frames.items() if name in found.late and value is not None)
    turns = ", ".join(f"{name} {turn.right:+.1f} {turn.down:+.1f} {turn.clockwise:+.1f}"
                      + (f", {100 * turn.distance:.0f} cm" if turn.distance else "") for name, (turn, _) in found.turns.items())
    true = ", ".join(f"{steps * round(found.frame_rate / found.rate):+d}" for steps in fault.late if steps)
    remedy = next((doubt.split(", it seems")[0] for doubt in found.doubts if "it seems" in doubt), "")
    return fault.name + (f" ({true} frames)" if true else ""), pixels, turns, late, remedy or ("" if found.doubts else "all agree")


def _smallest(folder: Path) -> list[object]:
    return [smallest.make(folder / "ring", smallest.RING), "--masks", "--faults", 3]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording")
    parser.add_argument("--masks", action="store_true")
    parser.add_argument("--faults", type=int, help="how many are made, from the first on; all without")
    given = smallest.parse(parser, _smallest)
    options = Options(masks=given.masks)
    rig = open_rig(given.recording, options)
    seen = gather_silhouettes(rig, options, Listener())
    print("| what is wrong | pixels | turned right, down, clockwise, °, and moved | late, frames | said |\n|---|---|---|---|---|")
    for fault in islice(faults(), given.faults):
        print("| " + " | ".join(row(fault, judge_calibration(*with_fault(rig, seen, fault)))) + " |", flush=True)


if __name__ == "__main__":
    main()
