"""A run in Blender as it comes: how far imported bones lie off, how well a character follows, what the add-on of extras/ shows.

    python benchmarks/import_in_blender.py RUN [--environment FOLDER]

Exports the run, and judges it with Blender as a module (bpy), in an environment of its own that is made if it is not there (some 400 MB
from the package registry). What runs there uses nothing of this package: Blender's importers with their default settings, and NumPy.

- Import: joints of .bvh, .glb and .usda files against the run's.
- Retarget: .bvh and .glb with `--rest t --names vrm` onto a made skeleton of VRM 1.0's bones in T pose, of other proportions and bone axes;
  each bone turns from its rest pose as the run's does. Angles between the limbs of both; with hanging arms at rest, for comparison.
- Add-on: bones against the run's joints, joints in the cameras' images against OpenCV's formula, films found, colours of doubtful limbs.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path
from typing import Any

import numpy as np

ADD_ON = Path(__file__).resolve().parent.parent / "extras" / "shadowpuppet_blender.py"
ENVIRONMENT = Path.home() / ".cache" / "shadowpuppet" / "blender"
LIMBS = {f"{side} {limb}": tuple(f"{side}_{joint}" for joint in joints) for side in ("left", "right") for limb, joints in {
    "upper arm": ("shoulder", "elbow"), "forearm": ("elbow", "wrist"), "thigh": ("hip", "knee"), "shank": ("knee", "ankle")}.items()}
"""Joints at the ends of the limbs."""
VRM = {"pelvis": "hips", "chest": "spine", "torso": "spine", "neck": "neck", "head": "head"} | {
    f"{side}_{ours}": f"{side}{theirs}" for side in ("left", "right") for ours, theirs in {
        "shoulder": "UpperArm", "elbow": "LowerArm", "wrist": "Hand", "hip": "UpperLeg", "knee": "LowerLeg", "ankle": "Foot"}.items()}
MADE = (("hips", None, (0, 0, 1.0), (0, 0, 1.1)), ("spine", "hips", (0, 0, 1.1), (0, 0, 1.5)), ("neck", "spine", (0, 0, 1.5), (0, 0, 1.6)),
        ("head", "neck", (0, 0, 1.6), (0, 0, 1.9)))
MADE_SIDE = (("UpperArm", "spine", (0.15, 0, 1.47), (0.48, 0, 1.47)), ("LowerArm", "UpperArm", (0.48, 0, 1.47), (0.70, 0, 1.47)),
             ("Hand", "LowerArm", (0.70, 0, 1.47), (0.82, 0, 1.47)), ("UpperLeg", "hips", (0.12, 0, 0.95), (0.12, 0, 0.52)),
             ("LowerLeg", "UpperLeg", (0.12, 0, 0.52), (0.12, 0, 0.10)), ("Foot", "LowerLeg", (0.12, 0, 0.10), (0.12, -0.15, 0.02)))
"""A character of VRM's bones in T pose, facing -Y as in Blender: name, parent, head, tail of the left ones; metres."""


def judge(bpy: Any, folder: Path, run: Path) -> None:
    """Print all that is measured of a run's exports in `folder`."""
    times, names, wanted = joints(folder / "run.csv")
    rate = round((len(times) - 1) / (times[-1] - times[0]), 3)
    for kind in ("bvh", "glb", "usda"):
        armature, first = imported(bpy, folder / f"run.{kind}", rate)
        if armature is None:
            print(f"{kind}: this Blender has no importer")
            continue
        worst, known = 0.0, [name for name in names if name in armature.pose.bones]
        for frame in range(len(times)):
            bpy.context.scene.frame_set(frame + first)
            for name in known:
                at = np.array((armature.matrix_world @ armature.pose.bones[name].matrix).translation)
                worst = max(worst, float(np.nanmax(np.abs(at - wanted[frame, names.index(name)]), initial=0.0)))
        print(f"{kind}: {len(known)} of {len(names)} joints, {len(times)} frames, at most {1000 * worst:.4f} mm off")
    for rest in ("t", "hang"):
        for kind in ("bvh", "glb"):
            angles = retargeted(bpy, folder / rest / f"run.{kind}", rate, names, wanted)
            print(f"{kind} --rest {rest} on the made VRM skeleton: limbs at most " +
                  ", ".join(f"{limb} {angle:.2f}" for limb, angle in angles.items()) + " degrees off")  # fmt: skip
    add_on(bpy, run, times, names, wanted)


def joints(path: Path) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Times (T,), names, and places (T, J, 3) of the joints in an exported CSV."""
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    columns = [n for n, name in enumerate(head) if name.endswith("_x") and not name.endswith("_sd_x")]
    values = [[[float(row[n + axis] or "nan") for axis in range(3)] for n in columns if head[n + 1].endswith("_y")] for row in rows]
    kept = [n for n in columns if head[n + 1].endswith("_y")]
    return np.array([float(row[0]) for row in rows]), [head[n].removesuffix("_x") for n in kept], np.array(values)


def imported(bpy: Any, path: Path, rate: float) -> tuple[Any, int]:
    """The armature of a file in an empty scene, None if it cannot be imported here, and the frame at which it begins."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(rate)
    bpy.context.scene.render.fps_base = round(rate) / rate
    if path.suffix == ".bvh":
        bpy.ops.import_anim.bvh(filepath=str(path))
    elif path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    elif "FINISHED" not in bpy.ops.wm.usd_import(filepath=str(path)):
        return None, 0
    return next(thing for thing in bpy.data.objects if thing.type == "ARMATURE"), int(path.suffix == ".bvh")


def retargeted(bpy: Any, path: Path, rate: float, names: list[str], wanted: np.ndarray) -> dict[str, float]:
    """Greatest angle, degrees, between each limb of a made character that follows a file and the run's. A bone turns in the world from
    the rest pose as the bone of its name does, as retargeting does."""
    source, first = imported(bpy, path, rate)
    target = character(bpy)
    world = source.matrix_world.to_3x3()
    kept = {bone.name: (world @ bone.matrix_local.to_3x3()) for bone in source.data.bones}
    rests = {bone.name: bone.matrix_local.to_3x3() for bone in target.data.bones}
    worst = {limb: 0.0 for limb, ends in LIMBS.items() if {VRM[end] for end in ends[:1]} <= kept.keys() and set(ends) <= set(names)}
    for frame in range(len(wanted)):
        bpy.context.scene.frame_set(frame + first)
        for bone in target.pose.bones:  # parents first
            if bone.name not in kept:
                continue
            turn = (world @ source.pose.bones[bone.name].matrix.to_3x3()) @ kept[bone.name].inverted()
            placed = (turn @ rests[bone.name]).to_4x4()
            placed.translation = bone.matrix.translation
            bone.matrix = placed
            bpy.context.view_layer.update()
        for limb in worst:
            start, end = (names.index(each) for each in LIMBS[limb])
            own = np.array((target.pose.bones[VRM[LIMBS[limb][0]]].vector).normalized())
            along = wanted[frame, end] - wanted[frame, start]
            if np.isfinite(along).all():
                cosine = own @ along / np.linalg.norm(along)
                worst[limb] = max(worst[limb], float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))))
    return worst


def character(bpy: Any) -> Any:
    """A made armature of VRM's bones, with rolls of its own."""
    data = bpy.data.armatures.new("made")
    made = bpy.data.objects.new("made", data)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    bpy.ops.object.mode_set(mode="EDIT")
    rows: list[tuple] = [*MADE]
    for side in ("left", "right"):
        rows += [(f"{side}{name}", parent if parent in ("spine", "hips") else f"{side}{parent}", mirrored(head, side), mirrored(tail, side))
                 for name, parent, head, tail in MADE_SIDE]  # fmt: skip
    for n, (name, parent, head, tail) in enumerate(rows):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail, bone.roll = head, tail, 0.3 * n
        bone.parent = data.edit_bones[parent] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    return made


def mirrored(place: tuple[float, float, float], side: str) -> tuple[float, float, float]:
    """A place of the left side, on a side."""
    return (place[0] if side == "left" else -place[0], *place[1:])


def add_on(bpy: Any, run: Path, times: np.ndarray, names: list[str], wanted: np.ndarray) -> None:
    """Print what the add-on shows of the run; through its operator, as a user opens it."""
    import importlib.util

    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    spec = importlib.util.spec_from_file_location("shadowpuppet_blender", ADD_ON)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    module.register()
    assert bpy.ops.import_scene.shadowpuppet(filepath=str(run / "run.toml")) == {"FINISHED"}
    scene, things = bpy.context.scene, list(bpy.data.objects)
    bones = [thing for thing in things if thing.type == "MESH"]
    cameras = [thing for thing in things if thing.type == "CAMERA"]
    rate, worst = module.rate_of(times.tolist()), 0.0
    frames = sorted({0, len(times) // 3, len(times) - 1})
    for n in frames:
        at = 1 + (times[n] - times[0]) * rate
        scene.frame_set(int(at), subframe=at % 1)
        for bone in bones:
            start, end = (wanted[n, names.index(name)] for name in bone.name.split(" to "))
            if np.isfinite([start, end]).all():
                found = [np.array(bone.matrix_world @ Vector((0, 0, z))) for z in (0, 1)]
                worst = max(worst, float(np.abs(found - np.array([start, end])).max()))
    off = 0.0
    calibration = tomllib.loads((run / "calibration.toml").read_text())
    sections = {section["name"]: section for section in calibration.values() if isinstance(section, dict) and "matrix" in section}
    for camera in cameras:
        section = sections[camera.name]
        scene.render.resolution_x, scene.render.resolution_y = section["size"]
        bpy.context.view_layer.update()
        points = wanted[frames[-1]][np.isfinite(wanted[frames[-1]]).all(1)]
        pixels = seen(section, points)
        for point, pixel in zip(points, pixels):
            x, y, _ = world_to_camera_view(scene, camera, Vector(point))
            shown = np.array([x * section["size"][0] - 0.5, (1 - y) * section["size"][1] - 0.5])
            off = max(off, float(np.abs(shown - pixel).max()))
    films = [ground.image for camera in cameras for ground in camera.data.background_images]
    colours = {tuple(round(value, 2) for value in colour) for colour in module.DOUBTFUL.values()}
    shown = 0
    for bone in bones:
        curves = [curve for curve in module.curves_of(bone) if curve.data_path == "color"]
        keys = zip(*[[key.co[1] for key in curve.keyframe_points] for curve in sorted(curves, key=lambda curve: curve.array_index)])
        shown += sum(tuple(round(value, 2) for value in key) in colours for key in keys)
    lengths = sorted({film.frame_duration for film in films})
    print(f"add-on: {len(bones)} bones at most {1000 * worst:.3f} mm off, {len(cameras)} cameras at most {off:.3f} pixels off, "
          f"{len(films)} films of {lengths} frames, {shown} changes to a colour of doubt")
    module.unregister()


def seen(section: dict, points: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) of world points (N, 3) in a camera without distortion, by OpenCV's formula."""
    axis = np.array(section["rotation"], float)
    angle = np.linalg.norm(axis)
    K = np.cross(np.eye(3), axis / max(angle, 1e-12))
    R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    placed = points @ R.T + section["translation"]
    pixels = placed @ np.array(section["matrix"]).T
    return pixels[:, :2] / pixels[:, 2:]


def exported(run: Path, folder: Path) -> None:
    """Write a run's files for `judge`."""
    from shadowpuppet.io.export import export_run

    for name, formats, more in (("", ["bvh", "glb", "usda", "csv"], {}), ("t", ["bvh", "glb"], {"rest": "t", "names": "vrm"}),
                                ("hang", ["bvh", "glb"], {"rest": "hang", "names": "vrm"})):  # fmt: skip
        for path in export_run(run, formats, folder / name, **more):
            path.rename(path.with_name(f"run{path.suffix}"))


def python_with_blender(environment: Path) -> Path:
    """The Python of an environment with bpy; makes it if it is not there."""
    python = environment / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.exists() or subprocess.run([python, "-c", "import bpy"], capture_output=True).returncode:
        print(f"making an environment with Blender in {environment}", file=sys.stderr, flush=True)
        venv.create(environment, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "bpy"], check=True)
    return python


def main() -> None:
    """Export and judge; `--smallest` says only that it is skipped: bpy is no part of the tests' environment, and large."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, nargs="?", help="folder of a run")
    parser.add_argument("--environment", type=Path, default=ENVIRONMENT, help=f"with bpy [{ENVIRONMENT}]")
    parser.add_argument("--judge", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--smallest", nargs="?", const="", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.smallest is not None:
        print("skipped: Blender as a module is 400 MB, in an environment of its own")
        return
    if given.run is None:
        parser.error("the folder of a run is missing")
    if given.judge is not None:
        import bpy

        judge(bpy, given.judge, given.run)
        return
    with tempfile.TemporaryDirectory() as folder:
        exported(given.run, Path(folder))
        python = python_with_blender(given.environment)
        subprocess.run([python, __file__, given.run.resolve(), "--judge", folder], check=True)


if __name__ == "__main__":
    main()
