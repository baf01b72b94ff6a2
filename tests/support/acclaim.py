"""Text of an Acclaim skeleton with the CMU laboratory's bones, and of motions of it."""

from __future__ import annotations

import numpy as np

SPINE = [("lowerback", "root"), ("upperback", "lowerback"), ("thorax", "upperback"), ("lowerneck", "thorax"),
         ("upperneck", "lowerneck"), ("head", "upperneck")]


def bones():
    """Name, parent, direction, length, axis (degrees), degrees of freedom: a person at rest, arms level, facing z, y up."""
    table = [(name, parent, (0.0, 1.0, -0.03 * n), 2.0, (0, 0, 0), "rx ry rz") for n, (name, parent) in enumerate(SPINE)]
    for s, x in (("l", 1.0), ("r", -1.0)):
        arm, leg = (0, -30 * x, -90 * x), (0, 0, 20 * x)
        table += [
            (f"{s}clavicle", "thorax", (x, 0.2, 0), 3.4, (0, 0, 0), "ry rz"),
            (f"{s}humerus", f"{s}clavicle", (x, 0, 0), 4.9, arm, "rx ry rz"),
            (f"{s}radius", f"{s}humerus", (x, 0, 0), 3.3, arm, "rx"), (f"{s}wrist", f"{s}radius", (x, 0, 0), 1.6, (0, 90, 90 * x), "ry"),
            (f"{s}hand", f"{s}wrist", (x, 0, 0), 0.7, (0, 90, 90 * x), "rx rz"),
            (f"{s}thumb", f"{s}wrist", (0.7 * x, 0, 0.7), 0.8, (-90, 45 * x, 0), "rx rz"),
            (f"{s}hipjoint", "root", (0.65 * x, -0.7, 0.25), 2.5, (0, 0, 0), ""),
            (f"{s}femur", f"{s}hipjoint", (0.34202 * x, -0.93969, 0), 7.4, leg, "rx ry rz"),
            (f"{s}tibia", f"{s}femur", (0.34202 * x, -0.93969, 0), 7.3, leg, "rx"),
            (f"{s}foot", f"{s}tibia", (0.09 * x, -0.25, 0.96), 2.2, (-90, 0, 20 * x), "rx rz"),
            (f"{s}toes", f"{s}foot", (0, 0, 1.0), 1.1, (-90, 0, 20 * x), "rx"),
        ]  # fmt: skip
    return table


def asf() -> str:
    """Text of the .asf file."""
    lines = [":version 1.10", ":name TEST", ":units", "  mass 1.0", "  length 0.45", "  angle deg", ":documentation", "  made",
             ":root", "  order TX TY TZ RX RY RZ", "  axis XYZ", "  position 0 0 0", "  orientation 0 0 0", ":bonedata"]
    for n, (name, _, direction, length, axis, dofs) in enumerate(bones(), 1):
        lines += ["  begin", f"    id {n}", f"    name {name}", f"    direction {' '.join(map(str, direction))}", f"    length {length}",
                  f"    axis {' '.join(map(str, axis))} XYZ"]
        if dofs:
            lines += [f"    dof {dofs}"]
            lines += [f"    {'limits' if not k else '      '} (-160.0 20.0)" for k in range(len(dofs.split()))]
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    parents = ["root", *(name for name, *_ in bones())]
    for parent in parents:
        children = [name for name, above, *_ in bones() if above == parent]
        if children:
            lines.append(f"    {parent} {' '.join(children)}")
    return "\n".join([*lines, "  end", ""])


def poses(count: int, rng: np.random.Generator, size: float = 25.0):
    """Frames of {name: values}, degrees; the root's place in the file's units."""
    frames = []
    for n in range(count):
        frame = {"root": [*rng.normal(0, 3, 2), 17 + rng.normal(), *rng.normal(0, size / 2, 3)]}
        frame["root"][1], frame["root"][2] = 17 + 0.1 * n, float(rng.normal())
        for name, *_, dofs in bones():
            if dofs:
                frame[name] = list(rng.normal(0, size, len(dofs.split())))
        frames.append(frame)
    return frames


def amc(frames) -> str:
    """Text of the .amc file."""
    lines = ["#!OML:ASF made", ":FULLY-SPECIFIED", ":DEGREES"]
    for n, frame in enumerate(frames, 1):
        lines += [str(n), *(f"{name} {' '.join(f'{v:.6f}' for v in values)}" for name, values in frame.items())]
    return "\n".join([*lines, ""])


def write(folder, count: int = 3, rng: np.random.Generator | None = None, size: float = 25.0):
    """Write `01.asf` and `01_01.amc` into a folder; returns the motion's path and its frames."""
    frames = poses(count, rng or np.random.default_rng(1), size)
    (folder / "01.asf").write_text(asf(), "utf-8")
    (folder / "01_01.amc").write_text(amc(frames), "utf-8")
    return folder / "01_01.amc", frames
