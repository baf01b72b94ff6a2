"""Exports of a run imported by Blender as it comes: how far the bones lie off the run's joints.

    shadowpuppet export RUN --to bvh,glb,csv -o OUT
    python benchmarks/import_in_blender.py OUT/RUN       # with a Python that has bpy (Blender as a module)

Nothing of this package is used. Blender's importers have their default settings; its world must be the run's.
"""

from __future__ import annotations

import csv
import sys
from typing import Any

import numpy as np


def joints(path: str) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Times (T,), names, and places (T, J, 3) of the joints in an exported CSV."""
    with open(path, encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    columns = [n for n, name in enumerate(head) if name.endswith("_x") and not name.endswith("_sd_x")]
    values = [[[float(row[n + axis] or "nan") for axis in range(3)] for n in columns] for row in rows]
    return np.array([float(row[0]) for row in rows]), [head[n].removesuffix("_x") for n in columns], np.array(values)


def imported(bpy: Any, path: str, rate: float) -> tuple[Any, int]:
    """The armature of a file in an empty scene, and the frame at which it begins."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(rate)
    bpy.context.scene.render.fps_base = round(rate) / rate
    if path.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=path)
    else:
        bpy.ops.import_scene.gltf(filepath=path)
    return next(thing for thing in bpy.data.objects if thing.type == "ARMATURE"), int(path.endswith(".bvh"))


def main(stem: str) -> None:
    """Import both files, and print how far the joints are off; `--smallest` needs no files and only says whether Blender is there."""
    try:
        import bpy
    except ImportError:
        print("skipped: there is no bpy here (Blender as a module)")
        return
    if stem == "--smallest":
        return
    times, names, wanted = joints(f"{stem}.csv")
    rate = round((len(times) - 1) / (times[-1] - times[0]), 3)
    for kind in ("bvh", "glb"):
        armature, first = imported(bpy, f"{stem}.{kind}", rate)
        worst = 0.0
        for frame in range(len(times)):
            bpy.context.scene.frame_set(frame + first)
            for n, name in enumerate(names):
                at = np.array((armature.matrix_world @ armature.pose.bones[name].matrix).translation)
                worst = max(worst, float(np.nanmax(np.abs(at - wanted[frame, n]), initial=0.0)))
        print(f"{kind}: {len(names)} joints, {len(times)} frames, at most {1000 * worst:.4f} mm off")


if __name__ == "__main__":
    main(sys.argv[1])
