"""A ring of cameras in the format of every program, written by the rules of the formats and not by the package's writers."""

from __future__ import annotations

import json
import pickle
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from solids import ring

from shadowpuppet.camera.camera import Camera

SIZE = (640, 480)
LENS = (-0.08, 0.03, 0.0004, -0.0003, 0.01)


def cameras(count: int = 3, lens: Sequence[float] = LENS) -> list[Camera]:
    return ring(count, radius=3.0, height=1.4, size=SIZE, focal=520.0, distortion=lens)


def rotation(camera: Camera) -> Rotation:
    return Rotation.from_matrix(camera.T_camera_world[:3, :3])


def toml(made: Sequence[Camera], scale: float = 1.0, tail: str = "[metadata]\nadjusted = false\nerror = 0.0\n") -> str:
    """TOML as written by aniposelib and Pose2Sim."""
    parts = []
    for n, camera in enumerate(made):
        t = camera.T_camera_world[:3, 3] * scale
        parts.append(f'[cam_{n}]\nname = "{camera.name}"\nsize = [ {camera.size[0]}.0, {camera.size[1]}.0,]\n'
                     f"matrix = {camera.matrix.tolist()}\ndistortions = {camera.distortion[:5].tolist()}\n"
                     f"rotation = {rotation(camera).as_rotvec().tolist()}\ntranslation = {t.tolist()}\n")
    return "\n".join([*parts, tail])


def freemocap(made: Sequence[Camera]) -> str:
    return toml(made, 1000.0, '[metadata]\ncharuco_square_size = 58.0\npath_to_recorded_videos = "C:\\\\Users\\\\x"\n')


def caliscope(made: Sequence[Camera], rotated: str = "vector") -> str:
    """Caliscope's camera_array.toml with one ignored and one unposed camera."""
    parts = []
    for n, camera in enumerate(made):
        R = rotation(camera).as_rotvec() if rotated == "vector" else camera.T_camera_world[:3, :3]
        parts.append(f"[cameras.{n}]\ncam_id = {n}\nrotation_count = 0\nerror = 0.3\nsize = {list(camera.size)}\n"
                     f"matrix = {camera.matrix.tolist()}\ndistortions = [{camera.distortion[:5].tolist()}]\n"
                     f"rotation = {R.tolist()}\ntranslation = {camera.T_camera_world[:3, 3].tolist()}\nfisheye = false\n")
    lens = f"size = [640, 480]\nmatrix = {made[0].matrix.tolist()}\ndistortions = [0.0, 0.0, 0.0, 0.0, 0.0]\n"
    parts += [f"[cameras.8]\ncam_id = 8\n{lens}", f"[cameras.9]\ncam_id = 9\nignore = true\n{lens}"]
    return "\n".join(parts)


def _node(key: str, values: np.ndarray) -> str:
    """A matrix with the line breaks of cv::FileStorage."""
    numbers = [f"{value!r}" for value in np.ravel(values).tolist()]
    data = ",\n       ".join(", ".join(numbers[n : n + 4]) for n in range(0, len(numbers), 4))
    rows, cols = values.shape
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {data} ]\n"


def intri(made: Sequence[Camera], sizes: bool = True) -> str:
    text = "%YAML:1.0\n---\nnames:\n" + "".join(f'   - "{camera.name}"\n' for camera in made)
    for camera in made:
        text += _node(f"K_{camera.name}", camera.matrix) + _node(f"dist_{camera.name}", camera.distortion[None, :5])
        text += f"H_{camera.name}: {camera.size[1]}\nW_{camera.name}: {camera.size[0]}\n" if sizes else ""
    return text


def extri(made: Sequence[Camera]) -> str:
    text = "%YAML:1.0\n---\nnames:\n" + "".join(f'   - "{camera.name}"\n' for camera in made)
    for camera in made:
        T = camera.T_camera_world
        text += _node(f"R_{camera.name}", rotation(camera).as_rotvec()[:, None]) + _node(f"Rot_{camera.name}", T[:3, :3])
        text += _node(f"T_{camera.name}", T[:3, 3:])
    return text


def opencv(camera: Camera) -> str:
    """The calibration sample's names, one camera a file."""
    T = camera.T_camera_world
    return (f'%YAML:1.0\n---\ncalibration_time: "Tue 01 Jul 2025"\nnframes: 20\nimage_width: {camera.size[0]}\n'
            f"image_height: {camera.size[1]}\nflags: 0\n" + _node("camera_matrix", camera.matrix)
            + _node("distortion_coefficients", camera.distortion[:5, None]) + "avg_reprojection_error: 2.1e-01\n"
            + _node("rvec", rotation(camera).as_rotvec()[:, None]) + _node("tvec", T[:3, 3:]))  # fmt: skip


def opencv_xml(camera: Camera) -> str:
    def node(key: str, values: np.ndarray) -> str:
        data = " ".join(map(repr, values.ravel().tolist()))
        return (f'<{key} type_id="opencv-matrix">\n  <rows>{values.shape[0]}</rows>\n  <cols>{values.shape[1]}</cols>\n  <dt>d</dt>\n'
                f"  <data>\n    {data}</data></{key}>\n")

    T = camera.T_camera_world
    return ('<?xml version="1.0"?>\n<opencv_storage>\n<calibration_time>"Tue 01 Jul"</calibration_time>\n'
            f"<image_size>\n  {camera.size[0]} {camera.size[1]}</image_size>\n" + node("camera_matrix", camera.matrix)
            + node("distortion_coefficients", camera.distortion[None, :5])
            + node("R", T[:3, :3]) + node("T", T[:3, 3:]) + "</opencv_storage>\n")


def qualisys(made: Sequence[Camera]) -> str:
    """QTM's export: 1/64 pixel, millimetres, y up and z backward; with a marker camera, and one that is switched off."""
    def camera_text(camera: Camera, model: str, active: int = 1) -> str:
        R, (x, y, z) = np.diag([1, -1, -1]) @ camera.T_camera_world[:3, :3], camera.centre * 1000
        turn = " ".join(f'r{i + 1}{j + 1}="{R[i, j]!r}"'.replace("np.float64(", "").replace(")", "") for i in range(3) for j in range(3))
        k1, k2, p1, p2, k3 = camera.distortion[:5]
        w, h = camera.size
        return (f'<camera active="{active}" avg-residual="0.4" serial="{camera.name}" model="{model}" viewrotation="0">\n'
                f'<fov_marker left="0" top="0" right="{w - 1}" bottom="{h - 1}"/>\n'
                f'<fov_video left="16" top="8" right="{16 + w - 1}" bottom="{8 + h - 1}"/>\n'
                f'<transform x="{x:.9f}" y="{y:.9f}" z="{z:.9f}" {turn}/>\n'
                f'<intrinsic focallength="9.3" sensorMinU="0" sensorMaxU="{64 * w}" sensorMinV="0" sensorMaxV="{64 * h}"\n'
                f' focalLengthU="{64 * camera.matrix[0, 0]}" focalLengthV="{64 * camera.matrix[1, 1]}" centerPointU="'
                f'{64 * (camera.matrix[0, 2] + 16)}" centerPointV="{64 * (camera.matrix[1, 2] + 8)}" skew="0" radialDistortion1="{k1}"\n'
                f' radialDistortion2="{k2}" radialDistortion3="{k3}" tangentalDistortion1="{p1}" tangentalDistortion2="{p2}"/>\n'
                "</camera>\n")

    body = "".join(camera_text(camera, "Miqus Video") for camera in made)
    body += camera_text(replace(made[0], name="marker"), "Oqus 400") + camera_text(replace(made[0], name="off"), "Miqus Video", 0)
    return ("<?xml version='1.0' encoding='ASCII'?>\n<calibration created=\"2024\" type=\"regular\" wandLength=\"601.1\">\n"
            f'<results std-dev="0.9" min-max-diff="3.2"/>\n<cameras>\n{body}</cameras>\n</calibration>\n')


VICON_K = (3e-7, -3.1e-13, 0.0)
"""Of r^2, r^4, r^6 in pixels: some 18 pixels at the corner of 640 x 480."""


def vicon(made: Sequence[Camera], k: Sequence[float] = VICON_K, radial: int = 2) -> str:
    """Nexus' .xcp: quaternions x y z w, millimetres, distortion from the seen pixel to the straight one; beside an infrared camera."""
    body = ""
    for n, camera in enumerate([*made, made[0]]):
        kind = "VideoCamera" if n < len(made) else "ViconCamera"
        q = " ".join(f"{value:.12f}" for value in rotation(camera).as_quat())
        place = " ".join(f"{value:.9f}" for value in camera.centre * 1000)
        cx, cy = camera.matrix[:2, 2]
        bend = (f'VICON_RADIAL2="ViconRadial2 {cx} {cy} {k[0]} {k[1]} {k[2]}"' if radial == 2 else f'VICON_RADIAL="{k[0]} {k[1]}"')
        body += (f'<Camera ACTIVE_THRESHOLD="1" DEVICEID="{camera.name if n < len(made) else 999}" DISPLAY_TYPE="Vue" NAME="" '
                 f'PIXEL_ASPECT_RATIO="1" SENSOR="x" SENSOR_SIZE="{camera.size[0]} {camera.size[1]}" SKEW="0" TYPE="{kind}" USERID="{n}">\n'
                 f'<ThresholdGrid BIT_DEPTH="1" DATA=""/>\n<KeyFrames>\n<KeyFrame FOCAL_LENGTH="{camera.matrix[0, 0]}" FRAME="0" '
                 f'IMAGE_ERROR="0.1" ORIENTATION="{q}" POSITION="{place}" PRINCIPAL_POINT="{cx} {cy}" {bend} WORLD_ERROR="0.3"/>\n'
                 "</KeyFrames>\n</Camera>\n")
    body += '<Camera DEVICEID="77" TYPE="VideoCamera" SENSOR_SIZE="640 480"><KeyFrames/></Camera>\n'
    return f'<?xml version="1.0" encoding="UTF-8" standalone="no" ?>\n<Cameras NAME="" VERSION="1.0">\n{body}</Cameras>\n'


def panoptic(made: Sequence[Camera]) -> str:
    """JSON as written by CMU Panoptic: centimetres."""
    return json.dumps({"calibDataSource": "x", "cameras": [
        {"name": camera.name, "type": "hd", "resolution": list(camera.size), "panel": 0, "node": n, "K": camera.matrix.tolist(),
         "distCoef": camera.distortion[:5].tolist(), "R": camera.T_camera_world[:3, :3].tolist(),
         "t": (100 * camera.T_camera_world[:3, 3:]).tolist()} for n, camera in enumerate(made)]})  # fmt: skip


def colmap(made: Sequence[Camera]) -> tuple[str, str]:
    """COLMAP's cameras.txt and images.txt: pixel centres at halves, no k3."""
    lenses, pictures = ["# Camera list"], ["# Image list"]
    for n, camera in enumerate(made, 1):
        K, (x, y, z, w) = camera.matrix, rotation(camera).as_quat()
        lens = [K[0, 0], K[1, 1], K[0, 2] + 0.5, K[1, 2] + 0.5, *camera.distortion[:4]]
        lenses.append(f"{n} OPENCV {camera.size[0]} {camera.size[1]} {' '.join(map(repr, map(float, lens)))}")
        pose = [w, x, y, z, *camera.T_camera_world[:3, 3]]
        pictures += [f"{n} {' '.join(map(repr, map(float, pose)))} {n} {camera.name}/0001.jpg", "10.5 20.5 -1 30 40 7"]
    return "\n".join(lenses), "\n".join(pictures)


def krt(made: Sequence[Camera]) -> str:
    """Rows without names, a blank line after each camera."""
    def row(values: np.ndarray) -> str:
        return " ".join(repr(value) for value in values.tolist())

    parts = [[camera.name, *map(row, camera.matrix), row(camera.distortion[:5]), *map(row, camera.T_camera_world[:3]), ""]
             for camera in made]
    return "\n".join(line for part in parts for line in part) + "\n"


def biocv(camera: Camera) -> str:
    """BioCV's .calib: blank lines between its parts, millimetres."""
    T = camera.T_camera_world.copy()
    T[:3, 3] *= 1000
    parts = [np.array([[camera.size[0]], [camera.size[1]]]), camera.matrix, T, camera.distortion[None, :5]]
    return "\n\n".join("\n".join(" ".join(map(repr, row)) for row in part.tolist()) for part in parts) + "\n"


def kalibr(made: Sequence[Camera], model: str = "pinhole", distortion: str = "radtan") -> str:
    """Kalibr's camchain.yaml; each camera's place is relative to the one before."""
    parts = []
    for n, camera in enumerate(made):
        parts.append(f"cam{n}:\n")
        if n:
            rows = (camera.T_camera_world @ np.linalg.inv(made[n - 1].T_camera_world)).tolist()
            parts.append("  T_cn_cnm1:\n" + "".join(f"  - {row}\n" for row in rows))
        K = camera.matrix.tolist()
        parts.append(f"  cam_overlaps: [{(n + 1) % len(made)}]\n  camera_model: {model}\n"
                     f"  distortion_coeffs: {camera.distortion[:4].tolist()}\n  distortion_model: {distortion}\n"
                     f"  intrinsics: {[K[0][0], K[1][1], K[0][2], K[1][2]]}\n  resolution: {list(camera.size)}\n"
                     f"  rostopic: /cam{n}/image\n")
    return "".join(parts)


def relative(made: Sequence[Camera], n: int) -> np.ndarray:
    """First camera to camera n (4, 4)."""
    return made[n].T_camera_world @ np.linalg.inv(made[0].T_camera_world)


def multical(made: Sequence[Camera]) -> str:
    """multical's calibration.json: lenses, and poses in a section of their own, relative to the first camera."""
    first = made[0].name
    lenses = {camera.name: {"model": "standard", "image_size": list(camera.size), "K": camera.matrix.tolist(),
                            "dist": [camera.distortion[:5].tolist()]} for camera in made}  # fmt: skip
    keys = [first, *(f"{camera.name}_to_{first}" for camera in made[1:])]
    poses = {key: {"R": relative(made, n)[:3, :3].tolist(), "T": relative(made, n)[:3, 3].tolist()} for n, key in enumerate(keys)}
    return json.dumps({"cameras": lenses, "camera_poses": poses, "image_sets": {"rgb": []}})


def mc_calib(made: Sequence[Camera], distortion: int = 0) -> str:
    """MC-Calib's calibrated_cameras_data.yml: a table a camera, with the pose from the camera to the reference camera."""
    text = f"%YAML:1.0\n---\nnb_camera: {len(made)}\n"
    for n, camera in enumerate(made):
        parts = (_node("camera_matrix", camera.matrix) + _node("distortion_vector", camera.distortion[None, :5])
                 + f"distortion_type: {distortion}\ncamera_group: 0\nimg_width: {camera.size[0]}\nimg_height: {camera.size[1]}\n"
                 + _node("camera_pose_matrix", np.linalg.inv(relative(made, n))))  # fmt: skip
        text += f"camera_{n}:\n" + "".join(f"   {line}\n" for line in parts.splitlines())
    return text


def jarvis(camera: Camera) -> str:
    """JARVIS' YAML: K and R transposed, millimetres."""
    T = camera.T_camera_world
    return ("%YAML:1.0\n---\n" + _node("intrinsicMatrix", camera.matrix.T) + _node("distortionCoefficients", camera.distortion[None, :5])
            + _node("R", T[:3, :3].T) + _node("T", 1000 * T[None, :3, 3]))  # fmt: skip


def transforms(made: Sequence[Camera]) -> str:
    """nerfstudio's transforms.json: camera to world, y up and z backward, pixel centres at halves."""
    frames = []
    for camera in made:
        K, lens = camera.matrix, camera.distortion.tolist()
        pose = np.linalg.inv(camera.T_camera_world) @ np.diag([1, -1, -1, 1])
        frames.append({"file_path": f"images/{camera.name}.png", "transform_matrix": pose.tolist(), "fl_x": K[0, 0], "fl_y": K[1, 1],
                       "cx": K[0, 2] + 0.5, "cy": K[1, 2] + 0.5, "w": camera.size[0], "h": camera.size[1],
                       **dict(zip(("k1", "k2", "p1", "p2", "k3"), lens))})  # fmt: skip
    return json.dumps({"camera_model": "OPENCV", "applied_scale": 0.5, "aabb_scale": 16, "frames": frames})


def write_all(folder: Path, made: Sequence[Camera]) -> dict[str, Path]:
    """Write a file of every kind; returns the path of each by its name."""
    texts = {"anipose.toml": toml(made), "freemocap.toml": freemocap(made), "camera_array.toml": caliscope(made),
             "panoptic.json": panoptic(made), "colmap/cameras.txt": colmap(made)[0], "colmap/images.txt": colmap(made)[1],
             "Calib.qca.txt": qualisys(made), "KRT": krt(made), "camchain.yaml": kalibr(made),
             "multical.json": multical(made), "calibrated_cameras_data.yml": mc_calib(made), "transforms.json": transforms(made),
             "session.xcp": vicon(made), "easy/intri.yml": intri(made), "easy/extri.yml": extri(made)}
    for camera in made:
        texts |= {f"yaml/{camera.name}.yml": opencv(camera), f"jarvis/{camera.name}.yaml": jarvis(camera)}
        texts |= {f"xml/{camera.name}.xml": opencv_xml(camera), f"biocv/{camera.name}.mp4.calib": biocv(camera)}
    for name, text in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    (folder / "cameraIntrinsicsExtrinsics.pickle").write_bytes(pickle.dumps({"intrinsicMat": [1]}))
    whole = {name: folder / name for name in ("easy", "colmap", "yaml", "jarvis", "xml", "biocv")}
    return whole | {name: folder / name for name in texts if "/" not in name}
