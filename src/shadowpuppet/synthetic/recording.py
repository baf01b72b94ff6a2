"""A made recording as a folder: films, exact masks, truth and reference pictures in the recording layout."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from shadowpuppet.camera import Camera
from shadowpuppet.errors import RecordingError
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic import motions
from shadowpuppet.synthetic.clothes import Clothes
from shadowpuppet.synthetic.kinematics import Figure, pose
from shadowpuppet.synthetic.mannequin import JOINTS
from shadowpuppet.synthetic.parts import dressed
from shadowpuppet.synthetic.renderer import Renderer
from shadowpuppet.synthetic.scene import Room, exposed
from shadowpuppet.synthetic.spec import Spec

REFERENCES = {
    "front_t_pose": motions.LEVEL,
    "side_arms_hanging": motions.HANGING_ARMS | motions.trunk(turn=90),
    "front_arms_t_pose": motions.LEVEL,
}
"""The postures of Liu 2011's initialisation (Algorithm 1): O1, O2, O3."""


def synthesize(spec: Spec, folder: str | Path, rng: np.random.Generator, tell: Callable[[int, int], None] | None = None) -> Path:
    """Write the recording that `spec` describes into `folder`, made where missing, and return its path.

    tell: called after each picture with how many are done and how many there will be.
    The same spec and seed give the same pictures, masks and truth. Raises `RecordingError` where the folder cannot be written.
    """
    from shadowpuppet.io.calibration import write_calibration
    from shadowpuppet.video import write_frames

    folder = Path(folder)
    cameras = [view.camera() for view in spec.cameras]
    _folders(folder, references=len(cameras) == 1)
    for_motion, for_noise = rng.spawn(2)
    times, figure = perform(spec, for_motion)
    write_calibration(folder / "calibration.toml", cameras)
    _write_subject(folder / "recording.toml", spec)
    write_truth(folder / "truth", times, figure.joints, spec.rate)
    done = 0
    for camera, noise in zip(cameras, for_noise.spawn(len(cameras))):
        studio = Studio(spec, camera, noise)
        with write_frames(folder / "background" / f"{camera.name}.mp4", spec.rate) as film:
            for _ in range(max(1, round(spec.scene.empty_seconds * spec.rate))):
                film.write(studio.empty())
        with (
            write_frames(folder / "video" / f"{camera.name}.mp4", spec.rate) as film,
            write_frames(folder / "masks" / f"{camera.name}.mkv", spec.rate, lossless=True) as masks,
        ):
            for image, mask in studio.film(figure):
                film.write(image)
                masks.write(mask)
                done += 1
                if tell is not None:
                    tell(done, len(times) * len(cameras))
        if len(cameras) == 1:
            _write_references(folder / "references", spec, studio)
    return folder


def perform(spec: Spec, rng: np.random.Generator) -> tuple[Array, Figure]:
    """Times (T,), seconds, and the figure of `spec` in its motion at those times."""
    from shadowpuppet.synthetic.performance import perform, seconds_of

    times = np.arange(int(seconds_of(spec.motion) * spec.rate + 1e-6) + 1) / spec.rate
    return times, perform(spec.body, spec.motion, times, rng, spec.still, np.radians(spec.turn_deg))


class Studio:
    """One camera of a recording with the person, their clothes and the room: takes pictures."""

    def __init__(self, spec: Spec, camera: Camera, rng: np.random.Generator) -> None:
        """rng: of the noise; clothes and room have their own seeds in the spec."""
        clothes = Clothes.draw(np.random.default_rng(spec.scene.clothing))
        least = max((view.distance + 1 for view in spec.cameras if abs(view.azimuth_deg) > 60), default=0.0)
        self.room = Room(camera, np.random.default_rng(spec.scene.room), spec.scene.shadow, least)
        self.renderer = Renderer(camera, dressed(spec.body, clothes), clothes, self.room.lights)
        self.noise, self.rng = spec.scene.noise, rng

    def empty(self) -> np.ndarray:
        """A picture without the person, (H, W, 3) BGR."""
        return exposed(self.room.picture, self.noise, self.rng)[..., ::-1]

    def take(self, figure: Figure, index: int) -> tuple[np.ndarray, np.ndarray]:
        """A picture (H, W, 3) BGR of the figure's posture `index`, and its exact mask (H, W), 0 or 255."""
        return self._exposed(*self._lit(figure, index))

    def film(self, figure: Figure, workers: int = 2) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """`take` of all postures, one after another; `workers` threads draw ahead, the noise is drawn in order."""
        from concurrent.futures import ThreadPoolExecutor

        count = len(figure.joints)
        with ThreadPoolExecutor(workers) as pool:
            ahead = deque(pool.submit(self._lit, figure, index) for index in range(min(2 * workers, count)))
            for index in range(count):
                light, mask = ahead.popleft().result()
                if index + 2 * workers < count:
                    ahead.append(pool.submit(self._lit, figure, index + 2 * workers))
                yield self._exposed(light, mask)

    def _lit(self, figure: Figure, index: int) -> tuple[Array, np.ndarray]:
        shot = self.renderer.draw(figure, index)
        return shot.picture + (1 - shot.alpha[..., None]) * self.room.shaded(figure, index), shot.mask

    def _exposed(self, light: Array, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return exposed(light, self.noise, self.rng)[..., ::-1], mask


def write_truth(path: Path, times: Array, joints: Array, rate: float) -> None:
    """Write `<path>.csv` (metres) and `<path>.trc` (millimetres) of joints (T, 17, 3) at times (T,), seconds."""
    names = [f"{joint}_{axis}" for joint in JOINTS for axis in "xyz"]
    rows = joints.reshape(len(joints), -1)
    lines = [",".join(f"{value:.5f}" for value in (t, *row)) for t, row in zip(times, rows)]
    _write(path.with_suffix(".csv"), [",".join(["time", *names]), *lines])
    count, trc = len(joints), path.with_suffix(".trc")
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{trc.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:g}\t{rate:g}\t{count}\t{len(JOINTS)}\tmm\t{rate:g}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(JOINTS),
        "\t\t" + "\t".join(f"{axis}{n}" for n in range(1, len(JOINTS) + 1) for axis in "XYZ"),
        "",
    ]
    lines = [
        "\t".join([str(n), f"{t:.5f}", *(f"{1000 * value:.2f}" for value in row)])
        for n, (t, row) in enumerate(zip(times, rows), 1)
    ]
    _write(trc, [*head, *lines])


def _write_references(folder: Path, spec: Spec, studio: Studio) -> None:
    from shadowpuppet.video import write_image

    for name, named in REFERENCES.items():
        figure = pose(spec.body, motions.posture(**named))
        image, mask = studio.take(figure, 0)
        write_image(folder / f"{name}.png", image)
        write_image(folder / f"{name}_mask.png", mask)
        write_truth(folder / name, np.zeros(1), figure.joints, 1.0)


def _write_subject(path: Path, spec: Spec) -> None:
    """recording.toml: what is told of the subject."""
    lines = ["[subject]"]
    if "height" in spec.tells:
        lines.append(f"height = {spec.body.stature:.3f}     # metres, shoes on")
    if "distance" in spec.tells and len(spec.cameras) == 1:
        distance = spec.cameras[0].distance
        lines.append(f"distance = {distance:.3f}   # metres, camera to the middle of the body, before the first movement")
    _write(path, lines)


def _write(path: Path, lines: list[str]) -> None:
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({(error.strerror or str(error)).lower()})") from None


def _folders(folder: Path, references: bool) -> None:
    try:
        for name in ("video", "background", "masks", *(["references"] if references else [])):
            (folder / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"{folder}: the recording cannot be written there ({(error.strerror or str(error)).lower()})"
        ) from None
