"""Tables as Motive (OptiTrack) exports them."""

from __future__ import annotations

PARTS = {"Hip": (0, 1, 0), "Neck": (0, 1.5, 0), "Head": (0, 1.7, 0), "LUArm": (0.2, 1.45, 0), "LFArm": (0.5, 1.45, 0),
         "LHand": (0.75, 1.45, 0), "LThigh": (0.1, 0.95, 0), "LShin": (0.1, 0.5, 0), "LFoot": (0.1, 0.1, 0)}  # fmt: skip


def export(kind="Bone", names=None, unit="Meters", scale=1.0, space="Global", parents=True, labels=True, more=""):
    """The text of a table with two frames; `parents` and `labels`: rows and cells that some versions lack."""
    names = [f"Anna:{name}" for name in PARTS] if names is None else names
    columns = [("Rotation", "XYZW"), ("Position", "XYZ")] if kind != "Marker" else [("Position", "XYZ")]
    axes = [(what, axis) for what, letters in columns for axis in letters]

    def row(label, cells):
        return ",".join(["", label if labels else "", *(cell for each in cells for cell in [each] * len(axes))])

    head = [f"Format Version,1.23,Take Name,walk,Capture Frame Rate,119.99,Export Frame Rate,119.99,Rotation Type,Quaternion,"
            f"Length Units,{unit},Coordinate Space,{space}", "", row("Type", [kind] * len(names)), row("Name", names),
            row("ID", [f"ID{n}" for n in range(len(names))])]
    head += [row("Parent", ["Root"] * len(names))] if parents else []
    head += [",".join(["", "", *[what for what, _ in axes] * len(names)]),
             ",".join(["Frame", "Time (Seconds)", *[axis for _, axis in axes] * len(names)])]
    rows = []
    for n in range(2):
        turn = ["0", "0", "0", "1"] if kind != "Marker" else []
        cells = [cell for place in PARTS.values() for cell in (*turn, *(f"{(value + 0.1 * n) * scale:.6f}" for value in place))]
        rows.append(",".join([str(n), f"{n / 120:.6f}", *cells[: len(axes) * len(names)]]))
    return "\r\n".join([*head, *rows, more])
