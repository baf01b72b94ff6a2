"""Blender add-on: opens a run of shadowpuppet, with its cameras, their films as backgrounds, and doubt as colour.

Edit > Preferences > Add-ons > Install from Disk, choose this file, enable it; then File > Import > shadowpuppet run. Blender 4.2 or later.
Nothing of shadowpuppet needs to be installed: the run's joints.csv, calibration.toml and run.toml are read.
"""

import csv
import itertools
import math
import tomllib
from pathlib import Path

import bpy
from bpy_extras.io_utils import ImportHelper
from mathutils import Matrix, Quaternion, Vector

bl_info = {
    "name": "shadowpuppet run", "author": "shadowpuppet", "version": (1, 0, 0), "blender": (4, 2, 0), "category": "Import-Export",
    "location": "File > Import", "description": "Opens a motion capture run with its cameras, films and doubt",
}  # fmt: skip

BONES = (
    ("pelvis", "neck"), ("neck", "head"),
    ("neck", "left_shoulder"), ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("left_wrist", "left_hand"),
    ("neck", "right_shoulder"), ("right_shoulder", "right_elbow"), ("right_elbow", "right_wrist"), ("right_wrist", "right_hand"),
    ("pelvis", "left_hip"), ("left_hip", "left_knee"), ("left_knee", "left_ankle"),
    ("pelvis", "right_hip"), ("right_hip", "right_knee"), ("right_knee", "right_ankle"),
    ("left_ankle", "left_heel"), ("left_ankle", "left_toe"), ("right_ankle", "right_heel"), ("right_ankle", "right_toe"),
)  # fmt: skip
LEFT, RIGHT, MIDDLE = (0.0, 0.342, 0.171, 1.0), (0.604, 0.191, 0.386, 1.0), (0.871, 0.776, 0.054, 1.0)
"""The overlay's colours, linear."""
DOUBTFUL = {"uncertain": (0.791, 0.347, 0.0, 1.0), "predicted": (0.665, 0.112, 0.0, 1.0)}
"""Colours of limbs that are not vouched for."""
FILMS = (".mp4", ".mov", ".mkv", ".avi", ".webm", ".m4v", ".mpg")
ARM, LEG = ("shoulder", "elbow", "wrist", "hand"), ("hip", "knee", "ankle", "heel", "toe")
THICKNESS = 0.06
"""Metres."""


def limb_of(joint: str) -> str:
    """The limb whose status a joint has."""
    side, _, part = joint.partition("_")
    return f"{side}_arm" if part in ARM else f"{side}_leg" if part in LEG else "trunk"


def read_joints(path: Path) -> tuple[list[float], dict[str, list[Vector | None]], list[dict[str, str]]]:
    """Times in seconds, places of each joint by name (None where unknown), and statuses of the limbs by frame."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError(f"{path}: no frame in it")
    head = rows[0].keys()
    names = [name.removesuffix("_x") for name in head if name.endswith("_x") and not name.endswith("_sd_x")]

    def place(row: dict[str, str], name: str) -> Vector | None:
        texts = [row[f"{name}_{axis}"] for axis in "xyz"]
        return Vector(map(float, texts)) if all(texts) else None

    statuses = [{key.removesuffix("_status"): value for key, value in row.items() if key.endswith("_status")} for row in rows]
    return [float(row["time"]) for row in rows], {name: [place(row, name) for row in rows] for name in names}, statuses


def rate_of(times: list[float]) -> float:
    """Frames per second: by the median step."""
    steps = sorted(b - a for a, b in itertools.pairwise(times))
    return 1 / steps[len(steps) // 2] if steps else 25.0


def set_rate(scene: bpy.types.Scene, rate: float) -> None:
    """Set a scene's frame rate."""
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate


def bone_mesh() -> bpy.types.Mesh:
    """A double cone along z of length 1, whose material shows the object's colour."""
    ring = [(0.5 * math.cos(k * math.pi / 4), 0.5 * math.sin(k * math.pi / 4), 0.2) for k in range(8)]
    points = [(0.0, 0.0, 0.0), *ring, (0.0, 0.0, 1.0)]
    faces = [face for k in range(8) for face in ((0, 1 + (k + 1) % 8, 1 + k), (9, 1 + k, 1 + (k + 1) % 8))]
    mesh = bpy.data.meshes.new("shadowpuppet bone")
    mesh.from_pydata(points, [], faces)
    material = bpy.data.materials.new("shadowpuppet doubt")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    info = nodes.new("ShaderNodeObjectInfo")
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    links.new(info.outputs["Color"], shader.inputs["Base Color"])
    mesh.materials.append(material)
    return mesh


def add_body(collection: bpy.types.Collection, folder: Path, scene: bpy.types.Scene) -> tuple[list[bpy.types.Object], float]:
    """A cone along each bone, with keys in every frame: place, direction, length; colour by side, or by doubt; hidden where unknown. Also
    the time of the first frame, seconds."""
    times, joints, statuses = read_joints(folder / "joints.csv")
    rate, mesh, made = rate_of(times), bone_mesh(), []
    set_rate(scene, rate)
    scene.frame_start, scene.frame_end = 1, 1 + round((times[-1] - times[0]) * rate)
    for a, b in BONES:
        if a not in joints or b not in joints:
            continue
        bone = bpy.data.objects.new(f"{a} to {b}", mesh)
        bone.rotation_mode = "QUATERNION"
        collection.objects.link(bone)
        plain = LEFT if b.startswith("left_") else RIGHT if b.startswith("right_") else MIDDLE
        last, turn, colour = None, Quaternion(), None
        for time, start, end, status in zip(times, joints[a], joints[b], statuses):
            frame, known = 1 + (time - times[0]) * rate, start is not None and end is not None
            if known != last:
                bone.hide_viewport = bone.hide_render = not known
                bone.keyframe_insert("hide_viewport", frame=frame)
                bone.keyframe_insert("hide_render", frame=frame)
                last = known
            if not known:
                continue
            along = end - start
            nearest = Vector((0, 0, 1)).rotation_difference(along)
            turn = nearest if turn.dot(nearest) >= 0 else -nearest
            bone.location, bone.rotation_quaternion = start, turn
            bone.scale = (THICKNESS, THICKNESS, max(along.length, 1e-6))
            for path in ("location", "rotation_quaternion", "scale"):
                bone.keyframe_insert(path, frame=frame)
            now = DOUBTFUL.get(status.get(limb_of(b), ""), plain)
            if now != colour:
                bone.color = colour = now
                bone.keyframe_insert("color", frame=frame)
        for curve in curves_of(bone):  # colours and visibility do not blend
            if curve.data_path in ("color", "hide_viewport", "hide_render"):
                for key in curve.keyframe_points:
                    key.interpolation = "CONSTANT"
        made.append(bone)
    return made, times[0]


def curves_of(thing: bpy.types.Object) -> list:
    """The animation curves of an object, in Blender before and after layered actions."""
    action = thing.animation_data.action if thing.animation_data else None
    if action is None:
        return []
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags for curve in bag.fcurves]


def add_cameras(collection: bpy.types.Collection, folder: Path, recording: Path | None, begin: float) -> list[bpy.types.Object]:
    """The run's cameras, as pinhole cameras without distortion, with their films as backgrounds where these are found. `begin`: time of the
    run's first frame in the recording, seconds."""
    path = folder / "calibration.toml"
    sections = tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    made = []
    for section in sections.values():
        if not isinstance(section, dict) or "matrix" not in section:
            continue
        (fx, _, cx), (_, fy, cy), _ = section["matrix"]
        width, height = section["size"]
        data = bpy.data.cameras.new(section["name"])
        data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
        data.lens = 36.0 * fx / width
        data.shift_x, data.shift_y = ((width - 1) / 2 - cx) / width, (cy - (height - 1) / 2) / width * fx / fy
        data.display_size = 0.3
        camera = bpy.data.objects.new(section["name"], data)
        camera.matrix_world = world_matrix(section["rotation"], section["translation"])
        camera["size"], camera["focal"] = (width, height), (fx, fy)
        collection.objects.link(camera)
        film, start = find_film(recording, section["name"])
        if film is not None:
            add_film(data, film, start + begin)
        made.append(camera)
    return made


def world_matrix(rotation: list, translation: list) -> Matrix:
    """A camera's matrix in Blender (which looks along -z, y up) from one of OpenCV: X_camera = R X_world + t."""
    if isinstance(rotation[0], list):
        R = Matrix(rotation)
    else:
        axis = Vector(rotation)
        R = Matrix.Rotation(axis.length, 3, axis.normalized()) if axis.length > 1e-12 else Matrix.Identity(3)
    back = R.transposed()
    return Matrix.Translation(back @ -Vector(translation)) @ (back @ Matrix.Diagonal((1, -1, -1))).to_4x4()


def find_film(recording: Path | None, camera: str) -> tuple[Path | None, float]:
    """The film of a camera in a recording, and the seconds in it at which the recording begins."""
    if recording is None or not recording.exists():
        return None, 0.0
    if recording.is_file():
        return recording, 0.0
    path = recording / "recording.toml"
    settings = tomllib.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    start = float(settings.get("start", {}).get(camera, 0.0))
    named = settings.get("video", {}).get(camera)
    places = [recording / named] if named else [recording / place / f"{camera}{end}" for place in ("video", ".") for end in FILMS]
    return next((place for place in places if place.is_file()), None), start


def add_film(camera: bpy.types.Camera, film: Path, start: float) -> None:
    """Show a film behind a camera's view; its frame at `start`, seconds, is frame 1."""
    image = bpy.data.images.load(str(film), check_existing=True)
    image.source = "MOVIE"
    ground = camera.background_images.new()
    ground.image, ground.alpha, ground.display_depth = image, 1.0, "BACK"
    ground.frame_method = "FIT"
    user, scene = ground.image_user, bpy.context.scene
    user.frame_start, user.frame_duration = 1, max(image.frame_duration, 1)
    user.frame_offset = round(start * scene.render.fps / scene.render.fps_base)
    user.use_auto_refresh = True
    camera.show_background_images = True


def open_run(folder: Path, recording: Path | None = None) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Add a run to the scene; returns the bones and the cameras. Raises `OSError` or `ValueError` if the folder is no run."""
    info = tomllib.loads((folder / "run.toml").read_text(encoding="utf-8"))
    named = info.get("recording")
    if recording is None and isinstance(named, str):
        recording = folder / named  # an absolute path stays one
    scene = bpy.context.scene
    collection = bpy.data.collections.new(folder.resolve().name)
    scene.collection.children.link(collection)
    bones, begin = add_body(collection, folder, scene)
    cameras = add_cameras(collection, folder, recording, begin)
    if cameras:
        scene.camera = cameras[0]
        scene.render.resolution_x, scene.render.resolution_y = (int(side) for side in cameras[0]["size"])
        fx, fy = cameras[0]["focal"]
        scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(1.0, fy / fx), max(1.0, fx / fy)
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    space.shading.color_type = "OBJECT"
    scene.frame_set(1)
    return bones, cameras


class ImportRun(bpy.types.Operator, ImportHelper):
    """Open a run of shadowpuppet: choose its run.toml."""

    # Blender reads these annotations: no `from __future__ import annotations` here.
    bl_idname, bl_label = "import_scene.shadowpuppet", "Import shadowpuppet run"
    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="run.toml", options={"HIDDEN"})
    recording: bpy.props.StringProperty(name="Recording", description="Folder of the films, if it was moved", subtype="DIR_PATH")

    def execute(self, context):
        """Open it, or say in a sentence why not."""
        try:
            bones, cameras = open_run(Path(self.filepath).parent, Path(self.recording) if self.recording else None)
        except (OSError, ValueError, KeyError) as error:
            self.report({"ERROR"}, f"{self.filepath}: cannot be opened ({error})")
            return {"CANCELLED"}
        films = sum(bool(camera.data.background_images) for camera in cameras)
        self.report({"INFO"}, f"{len(bones)} bones, {len(cameras)} cameras, {films} films")
        return {"FINISHED"}


def _menu(self, context):
    self.layout.operator(ImportRun.bl_idname, text="shadowpuppet run (run.toml)")


def register() -> None:
    """Add the operator and its menu entry."""
    bpy.utils.register_class(ImportRun)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    """Remove them."""
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    bpy.utils.unregister_class(ImportRun)


if __name__ == "__main__":
    register()
