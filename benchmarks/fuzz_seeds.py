"""Files of every format that the package reads, for `fuzz_readers.py`, made by its own writers and the tests'; and their readers."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "support"))

import acclaim
import biovision
import calibrations
import detections
import motions
import motive
import png
import runs
import vicon

from shadowpuppet.body.models import MODELS, average_sizes
from shadowpuppet.calibration.boards.board import board_from, board_text, read_board
from shadowpuppet.camera.camera import Camera
from shadowpuppet.io.calibration.calibration_files import examine_calibration, write_calibration
from shadowpuppet.io.calibration.formats import is_calibration
from shadowpuppet.io.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from shadowpuppet.io.export import export_run
from shadowpuppet.io.intervals import read_intervals
from shadowpuppet.io.keypoints.keypoint_files import read_keypoints
from shadowpuppet.io.masks.ready_masks import mask_kind, open_masks
from shadowpuppet.io.motion.amc import read_mocap
from shadowpuppet.io.motion.joint_names import read_names
from shadowpuppet.io.motion.motion_files import read_motion, read_truth
from shadowpuppet.io.motion.opensim.mot import read_mot
from shadowpuppet.io.motion.overview import look_at_motion
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.person import Person, read_person, write_person
from shadowpuppet.io.prior import read_prior, write_prior
from shadowpuppet.io.recording import read_recording
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.batch.grid import read_grid
from shadowpuppet.pipeline.options import make_options, options_text, read_options
from shadowpuppet.silhouette.external import script
from shadowpuppet.silhouette.external.script import read_script
from shadowpuppet.synthetic import demo_spec, read_spec, spec_text
from shadowpuppet.video import open_frames, read_image, write_frames, write_image

READERS: dict[str, Callable[[Path], object]] = {
    "calibration": examine_calibration,
    "pair": lambda path: examine_calibration(path.parent),
    "colmap": lambda path: examine_calibration(path.parent),
    "found": is_calibration,
    "board": read_board,
    "person": read_person,
    "prior": read_prior,
    "recording": lambda path: read_recording(path.parent),
    "project": lambda path: read_recording(path.parent),
    "run": lambda path: read_run(path.parent),
    "tables": lambda path: read_run(path.parent),
    "intervals": read_intervals,
    "keypoints": lambda path: read_keypoints(path, detections.SIZE),
    "poses": lambda path: read_keypoints(path.parent, detections.SIZE),
    "joints": read_joints,
    "motion": read_motion,
    "look": look_at_motion,
    "names": read_names,
    "truth": read_truth,
    "skeleton": lambda path: read_mocap(path.parent / "01_01.amc"),
    "mot": read_mot,
    "options": lambda path: make_options(read_options(path), str(path)),
    "grid": read_grid,
    "spec": read_spec,
    "script": lambda path: read_script(path, "made"),
    "checkpoint": lambda path: read_checkpoint(path.parent, [MotionFrame]),
    "image": read_image,
    "mask": lambda path: [list(open_masks(path, mask_kind(path, label))) for label in (None, 1)],
    "times": lambda path: open_frames(path.parent),
    "film": lambda path: next(iter(open_frames(path)), None),
}
"""By name; each reads one of the files in the folder of that name."""
GRID = """seeds = "0:3"
preset = "liu2011"
[grid]
"tracker.arm.particles" = [10, 20]
[case.drs]
tracker.resampling = "deterministic"
[case.srs]
tracker.resampling = "stratified"
"""
RECORDING = """rate = 25.0
duration = 0.1
unit = "m"
up = "z"
[subject]
height = 1.78
distance = 2.5
[start]
cam0 = 0.04
[video]
cam0 = "film"
"""


def of(name: str, folder: Path) -> list[Path]:
    """The files of a reader, of those that `write` wrote into a folder."""
    whole = {"tables": ("*.csv", "run.toml"), "recording": ("recording.toml",), "project": ("*.toml",), "checkpoint": ("*.npz",),
             "times": ("*.txt",)}
    return sorted(path for pattern in whole.get(name, ("*",)) for path in (folder / name).glob(pattern) if path.is_file())


def write(folder: Path) -> None:
    """Write all files into a folder, those of each reader into one of its name."""
    rng, made = np.random.default_rng(1), calibrations.cameras(2)
    for name in READERS:
        (folder / name).mkdir(parents=True)
    _calibrations(folder, made)
    for body in MODELS:
        write_person(folder / "person" / f"{body}.toml", Person(average_sizes(body, 1.78), 1.78, "made", "some text"))
    write_prior(folder / "prior" / "prior.npz", motions.prior(rng, names=tuple("abcdef"), rate=25.0))
    run = runs.make_run(folder / "made", frames=6, lost=(2,), spread=True)
    for name in ("run", "tables"):
        for path in run.iterdir():
            (folder / name / path.name).write_bytes(path.read_bytes())
    (folder / "tables" / "motion.npz").unlink()
    (folder / "intervals" / "intervals.csv").write_bytes((run / "intervals.csv").read_bytes())
    _motions(folder, run, rng)
    for path in (folder / "motion").iterdir():
        (folder / "look" / path.name).write_bytes(path.read_bytes())
    (folder / "names" / "names.toml").write_text('left_hip = "bone 1"\nleft_knee = "bone 2"\n"head" = "skull"\n')
    (folder / "options" / "all.toml").write_text(options_text(make_options({})))
    (folder / "options" / "some.toml").write_text('preset = "liu2011"\nheight = 1.8\n[tracker.arm]\nparticles = 30\n')
    (folder / "grid" / "grid.toml").write_text(GRID)
    (folder / "spec" / "spec.toml").write_text(spec_text(demo_spec()))
    scripts = Path(script.__file__).parent / "scripts"
    for path in scripts.glob("*.py"):
        (folder / "script" / path.name).write_bytes(path.read_bytes())
    frame = MotionFrame(0.1, "tracked", rng.random(4), np.asfortranarray(rng.random((3, 3))))
    write_checkpoint(folder / "checkpoint", Checkpoint(1, (frame, {"a": None, "b": True}, np.float64(2))))
    for ending in ("png", "jpg", "bmp", "tif", "webp"):
        write_image(folder / "image" / f"a.{ending}", rng.integers(0, 255, (12, 16, 3), np.uint8))
    _masks(folder / "mask")
    _keypoints(folder, rng)
    _project(folder / "project", made)
    _pictures(folder / "times", made[0].size)
    (folder / "times" / "timestamps.txt").write_text("0\n0.04\n0.08\n")
    _films(folder / "film", rng)


def _masks(folder: Path) -> None:
    """Masks of every kind: grey, with alpha, labels with a palette and of 16 bit."""
    mask = np.zeros((12, 16), np.uint8)
    mask[3:9, 5:10] = 1
    write_image(folder / "grey.png", 255 * mask)
    (folder / "palette.png").write_bytes(png.palette_png(mask, (0, 0, 0, 128, 0, 0)))
    (folder / "clear.png").write_bytes(png.palette_png(mask, (0, 0, 0, 128, 0, 0), (0, 255)))
    for name, image in (("alpha", np.dstack([mask] * 3 + [255 * mask])), ("deep", 7 * mask.astype(np.uint16))):
        (folder / f"{name}.png").write_bytes(cv2.imencode(".png", image)[1].tobytes())


def _keypoints(folder: Path, rng: np.random.Generator) -> None:
    """A film's keypoints in every format; of OpenPose's and Pose2Sim's, some frames."""
    for name, path in detections.write_all(folder / "detections", detections.made_film(rng)).items():
        if path.is_file():
            (folder / "keypoints" / path.name).write_bytes(path.read_bytes())
        else:
            frame = min(path.iterdir())
            (folder / "poses" / f"{name}_{len(name)}.json").write_bytes(frame.read_bytes())


def _films(folder: Path, rng: np.random.Generator) -> None:
    """Films, and lists that name one."""
    for name in ("a.mp4", "a.mkv"):
        with write_frames(folder / name, 25.0) as film:
            for _ in range(3):
                film.write(rng.integers(0, 255, (12, 16, 3), np.uint8))
    (folder / "list.m3u8").write_text("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\na.mp4\n#EXT-X-ENDLIST\n")
    (folder / "list.mp4").write_text("ffconcat version 1.0\nfile a.mp4\n")
    (folder / "a.y4m").write_bytes(b"YUV4MPEG2 W16 H12 F25:1 C420jpeg\nFRAME\n" + bytes(16 * 12 * 3 // 2))


def _calibrations(folder: Path, made: list[Camera]) -> None:
    for name, path in calibrations.write_all(folder, made).items():
        file = next(path.iterdir()) if path.is_dir() and name not in ("easy", "colmap") else path
        if file.is_file():
            (folder / "calibration" / file.name).write_bytes(file.read_bytes())
    fish = calibrations.cameras(2, calibrations.LENS[:4])
    texts = {"fisheye.yaml": calibrations.kalibr(made, distortion="equidistant"), "types.yml": calibrations.mc_calib(fish, 1),
             "plain.json": json.dumps({camera.name: camera_table(camera) for camera in made}),
             "turned.toml": calibrations.caliscope(made).replace("rotation_count = 0", "rotation_count = 1"),
             "matrix.toml": calibrations.caliscope(made, "matrix"), "radial.xcp": calibrations.vicon(made, radial=1)}
    for name, text in texts.items():
        (folder / "calibration" / name).write_text(text)
    (folder / "calibration" / "utf16.toml").write_text(calibrations.toml(made), "utf-16")
    for path in (folder / "calibration").iterdir():
        (folder / "found" / path.name).write_bytes(path.read_bytes())
    (folder / "calibration" / "rough.toml").write_text("[a]\nat = [3, 0, 1.5]\ntoward = [0, 0, 1]\nfov = 65\nsize = [640, 480]\n")
    for name in ("intri.yml", "extri.yml"):
        (folder / "pair" / name).write_bytes((folder / "easy" / name).read_bytes())
    (folder / "board" / "board.toml").write_text(board_text(board_from("charuco 7x5", 0.04)))
    place = folder / "recording"
    write_calibration(place / "calibration.toml", made)
    _pictures(place / "film", made[0].size)
    (place / "recording.toml").write_text(RECORDING.replace("cam0", made[0].name))


def camera_table(camera: Camera) -> dict[str, object]:
    T = camera.T_camera_world
    return {"K": camera.matrix.tolist(), "rvec": calibrations.rotation(camera).as_rotvec().tolist(), "t": T[:3, 3].tolist(),
            "D": camera.distortion[:4].tolist(), "size": list(camera.size), "fisheye": True, "units": "m"}  # fmt: skip


def _pictures(folder: Path, size: tuple[int, int]) -> None:
    folder.mkdir(exist_ok=True)
    for n in range(3):
        write_image(folder / f"{n}.png", np.full(size[::-1], 9 * n, np.uint8))


def _project(folder: Path, made: list[Camera]) -> None:
    """Pose2Sim's: settings, and a calibration that is not in the recording's folder."""
    (folder / "Config.toml").write_text("[project]\nparticipant_height = 1.78\nframe_rate = 25\nframe_range = [0, 2]\n")
    for name in ("calibration", "videos"):
        (folder / name).mkdir()
    (folder / "calibration" / "Calib.toml").write_text(calibrations.toml(made))
    for camera in made:
        with write_frames(folder / "videos" / f"{camera.name}.mp4", 25.0) as film:
            film.write(np.zeros((*camera.size[::-1], 3), np.uint8))


def _motions(folder: Path, run: Path, rng: np.random.Generator) -> None:
    for path in export_run(run, ["c3d", "trc", "csv", "npz", "bvh", "mot", "parquet"], folder / "exported"):
        goal = "mot" if path.suffix == ".mot" else "motion"
        (folder / goal / path.name).write_bytes(path.read_bytes())
        if path.suffix in (".trc", ".csv"):
            (folder / "joints" / path.name).write_bytes(path.read_bytes())
            (folder / "truth" / path.name).write_bytes(path.read_bytes())
    (folder / "motion" / "other.bvh").write_text(biovision.person())
    for path in [path for path in (folder / "motion").iterdir() if path.suffix in (".csv", ".trc", ".bvh")]:
        (folder / "motion" / f"utf16{path.name}").write_text(path.read_text(), "utf-16")
    for name, kind in (("bones", "Bone"), ("markers", "Marker")):
        (folder / "motion" / f"{name}.csv").write_text(motive.export(kind))
        (folder / "joints" / f"{name}.csv").write_text(motive.export(kind))
    labels, places = ("LFEP", "LTIO", "LCLO", "C7"), rng.random((5, 4, 3)) * 1000
    for processor in (vicon.INTEL, vicon.DEC, vicon.MIPS):
        for scale in (-1.0, 0.1):
            (folder / "motion" / f"{processor}{scale}.c3d").write_bytes(vicon.c3d(labels, places, processor=processor, scale=scale))
    acclaim.write(folder / "skeleton")
    acclaim.write(folder / "motion")
