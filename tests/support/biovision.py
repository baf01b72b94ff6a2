"""Text of BVH files with synthetic skeletons."""

from __future__ import annotations

import numpy as np

# name, parent, offset in centimetres: a person standing in the pose of zero angles, Y up, facing Z, names as Mixamo has them
PERSON = [("Hips", None, (0, 0, 0)), ("Spine", "Hips", (0, 12, 0)), ("Neck", "Spine", (0, 38, -2)), ("Head", "Neck", (0, 10, 3))]
for _side, _x in (("Left", 1), ("Right", -1)):
    PERSON += [
        (f"{_side}Shoulder", "Spine", (4 * _x, 33, 0)), (f"{_side}Arm", f"{_side}Shoulder", (13 * _x, 0, 0)),
        (f"{_side}ForeArm", f"{_side}Arm", (29 * _x, 0, 0)), (f"{_side}Hand", f"{_side}ForeArm", (26 * _x, 0, 0)),
        (f"{_side}HandMiddle1", f"{_side}Hand", (9 * _x, 0, 0)),
        (f"{_side}UpLeg", "Hips", (9 * _x, -6, 0)), (f"{_side}Leg", f"{_side}UpLeg", (0, -42, 0)),
        (f"{_side}Foot", f"{_side}Leg", (0, -41, 0)), (f"{_side}ToeBase", f"{_side}Foot", (0, -6, 14)),
    ]  # fmt: skip


def bvh(nodes, channels: dict[str, list[str]], frames, step: float = 1 / 30, prefix: str = "", scale: float = 1.0) -> str:
    """A file's text; `nodes`: (name, parent, offset), parents first; `channels` by name; `frames`: rows of values.

    Joints without children get an end site.
    """
    lines = ["HIERARCHY"]

    def tell(name: str, offset, depth: int) -> None:
        pad = "  " * depth
        lines.append(f"{pad}{'JOINT' if depth else 'ROOT'} {prefix}{name}")
        lines.extend([f"{pad}{{", f"{pad}  OFFSET {' '.join(repr(scale * float(v)) for v in offset)}"])
        lines.append(f"{pad}  CHANNELS {len(channels[name])} {' '.join(channels[name])}".rstrip())
        children = [(n, o) for n, p, o in nodes if p == name]
        for child, where in children:
            tell(child, where, depth + 1)
        if not children:
            lines.extend([f"{pad}  End Site", f"{pad}  {{", f"{pad}    OFFSET 0 {scale * 5.0!r} 0", f"{pad}  }}"])
        lines.append(f"{pad}}}")

    tell(nodes[0][0], nodes[0][2], 0)
    lines += ["MOTION", f"Frames: {len(frames)}", f"Frame Time: {step!r}"]
    return "\n".join([*lines, *(" ".join(repr(float(v)) for v in row) for row in frames), ""])


def in_order(nodes) -> list[str]:
    """Names in the order of the file: depth first."""

    def below(name: str) -> list[str]:
        return [name, *(other for child, parent, _ in nodes if parent == name for other in below(child))]

    return below(nodes[0][0])


def person(frames: int = 5, prefix: str = "", scale: float = 1.0, rng: np.random.Generator | None = None, size: float = 10.0) -> str:
    """A standing person, swaying by some degrees: six channels for the root, ZXY rotations for the others."""
    rng = rng or np.random.default_rng(0)
    turns = ["Zrotation", "Xrotation", "Yrotation"]
    channels = {name: (["Xposition", "Yposition", "Zposition"] if parent is None else []) + turns for name, parent, _ in PERSON}
    rows = size * rng.standard_normal((frames, 3 + 3 * len(PERSON)))
    rows[:, :3] = scale * np.array([20.0, 95.0, -30.0])
    return bvh(PERSON, channels, rows, prefix=prefix, scale=scale)
