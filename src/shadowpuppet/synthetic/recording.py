"""Write a synthetic recording: films, exact masks, truth and reference pictures in the recording layout."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, SettingsError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.faults.camera_faults import CameraFaults
from shadowpuppet.synthetic.movement.gestures import HANGING_ARMS, LEVEL, PAUSE_SECONDS, posture, trunk
from shadowpuppet.synthetic.person.kinematics import PosedBody, pose
from shadowpuppet.synthetic.scene_renderer import SceneRenderer, bystander_body
from shadowpuppet.synthetic.spec import Bystander, Scene, Spec
from shadowpuppet.synthetic.spec_file import SPEC_FILE, seed_of, write_spec
from shadowpuppet.synthetic.truth import SPEED_STEP, Soles, soles, write_lines, write_truth

REFERENCES = {"front_t_pose": LEVEL, "side_arms_hanging": HANGING_ARMS | trunk(turn=90), "front_arms_t_pose": LEVEL}
"""The postures of Liu 2011's initialisation (Algorithm 1): O1, O2, O3."""
MIDDLE_RATE = 4.0
"""Moments a second by which the floor that people cover is measured."""
FAR_BELOW = 1e5
"""Place of an absent person, metres below the floor: less than a pixel, and no shadow."""


def synthesize(spec: Spec, folder: str | Path, rng: np.random.Generator | None = None,
               tell: Callable[[int, int], None] | None = None) -> Path:
    """Write the recording that `spec` describes into `folder`, created if missing, and return its path.

    rng: by default a generator of the spec's seed. tell: called after each frame with the numbers of frames done and in all. The same
    spec and seed give the same frames, masks and truth, whatever the number of threads; `spec.toml` keeps both. After Ctrl-C the frames
    made so far are a valid recording. Raises `RecordingError` if the folder cannot be written, `SettingsError` if
    the motion is too short or a fault is impossible; warns if obstacles hide nothing, and if a
    camera never sees the person.
    """
    folder, rng, tell = Path(folder), np.random.default_rng(spec.seed) if rng is None else rng, tell or (lambda *_: None)
    cameras = [view.camera() for view in spec.views()]
    _folders(folder, "video", *["background"][: spec.scene.empty_seconds > 0], "masks", *["people"][: len(spec.scene.bystanders)])
    seed = seed_of(rng)
    for_motion, for_noise, for_training, for_others, for_faults = rng.spawn(5)
    write_spec(folder / SPEC_FILE, spec, seed)
    same_motion = deepcopy(for_motion)
    times, figure = perform(spec, for_motion)
    feet = feet_of(spec, times, figure, same_motion)
    company = spec.scene.bystanders
    others = [_bystander(spec, someone, len(times), own, figure) for someone, own in zip(company, for_others.spawn(len(company)))]
    wrong = [CameraFaults(spec.faults, camera, len(times), spec.rate, own, spec.scene.flicker_hz)
             for camera, own in zip(cameras, for_faults.spawn(len(cameras)))]
    absent = wrong[0].absent()
    for name in ("truth", *["truth_1"][: len(others)]):
        write_truth(folder / name, times, figure.joints, spec.rate, feet, absent)
    gone = [_gone(someone, times) for someone in company]
    for n, (other, left) in enumerate(zip(others, gone), 2):
        write_truth(folder / f"truth_{n}", times, other.joints, spec.rate, absent=left)
    wall = _wall(figure, others)
    figure, others = _away(figure, absent), [_away(other, left) for other, left in zip(others, gone)]
    _write_given(folder, spec, cameras, for_training)
    hidden = 0
    for n, (camera, noise, faults) in enumerate(zip(cameras, for_noise.spawn(len(cameras)), wrong)):
        studio = SceneRenderer(spec, camera, noise, others, wall, faults)
        hides, seen = _shoot(folder, spec, studio, figure, lambda done, n=n: tell(n * len(times) + done, len(cameras) * len(times)))
        hidden += hides
        if not seen:
            warn(f"{folder}: camera {camera.name!r}: sees nothing of the person in any picture")
        if len(cameras) == 1:
            _write_references(folder / "references", spec, studio)
    if not (hidden or all(thing.seat for thing in spec.scene.obstacles)):
        warn(f"{folder}: obstacles: nothing of the person is hidden by them in any picture")
    return folder


def perform(spec: Spec, rng: np.random.Generator) -> tuple[Array, PosedBody]:
    """Times (T,), seconds from the first frame, and the moving figure of `spec` at those times.

    Raises `SettingsError` if the motion is shorter than the film.
    """
    from shadowpuppet.synthetic.movement.sequence import sequence_seconds

    there = int((sequence_seconds(spec.motion) - spec.begin) * spec.rate + 1e-6) + 1
    if there < max(spec.frames or 1, 1):
        raise SettingsError(f"frames: found {spec.frames or 1} pictures at {spec.rate:g} a second after {spec.begin:g} s, expected at most "
                            f"{max(there, 0)}: then the motion is over")
    times = np.arange(spec.frames or there) / spec.rate
    return times, _figure(spec, times + spec.begin, rng)


def covered_places(spec: Spec) -> Array:
    """The places (T, 2) on the floor of all people, from time to time, world, metres: the person's first place is its origin."""
    slow, rng = replace(spec, rate=MIDDLE_RATE, frames=None), np.random.default_rng(spec.seed)
    times, figure = perform(slow, rng)
    figures = [figure, *(_bystander(slow, someone, len(times), rng, figure) for someone in spec.scene.bystanders)]
    return np.concatenate([each.joints[:, 0, :2] for each in figures])


def feet_of(spec: Spec, times: Array, figure: PosedBody, rng: np.random.Generator) -> Soles:
    """The soles of `spec`'s figure at times (T,), seconds; rng: in the state before `perform`, so that the motion is the same."""
    from shadowpuppet.synthetic.movement.sequence import sequence_seconds

    before, after = (np.clip(times + spec.begin + step, 0.0, sequence_seconds(spec.motion)) for step in (-SPEED_STEP, SPEED_STEP))
    moving = _figure(spec, np.concatenate([before, after]), rng)
    return soles(spec.body, figure, moving, after - before)


def _figure(spec: Spec, t: Array, rng: np.random.Generator) -> PosedBody:
    """The figure of `spec` at times `t` (T,) of its motion, seconds."""
    from shadowpuppet.synthetic.movement.sequence import animate

    return animate(spec.body, spec.motion, t, rng, spec.still, np.radians(spec.turn_deg), spec.posture)


def _bystander(spec: Spec, someone: Bystander, count: int, rng: np.random.Generator, person: PosedBody | None = None) -> PosedBody:
    """The figure of a bystander in `count` frames, at the bystander's place beside the `person`; None: beside the origin."""
    again = int(np.ceil(count / spec.rate / 3600))  # a gesture takes an hour at most
    length = count / spec.rate - (2 * PAUSE_SECONDS if someone.from_start else 0.0)  # they begin and end together
    gestures = (replace(someone.motion, seconds=max(2.0, length / again)),) * again
    always = replace(spec, body=bystander_body(someone), motion=gestures, turn_deg=someone.turn_deg, begin=0.0, frames=None,
                     posture="standing", scene=Scene())
    _, figure = perform(always, rng)
    place = np.array([someone.left, -someone.ahead, 0])
    if someone.from_start:
        begin, own = (np.zeros(2) if one is None else one.joints[0, 0, :2] for one in (person, figure))
        place[:2] += begin - own
    parts = [part[np.minimum(np.arange(count), len(part) - 1)] for part in figure]  # a file may be shorter than the film
    return figure._replace(joints=parts[0] + place, rotation=parts[1], origin=parts[2] + place, curl=parts[3])


def _away(figure: PosedBody, absent: np.ndarray) -> PosedBody:
    """The figure out of all cameras' sight in the frames, of shape (T,), in which it is `absent`."""
    if not absent.any():
        return figure
    place = np.where(absent, FAR_BELOW, 0.0)[:, None, None] * np.array([0.0, 0, -1])
    return figure._replace(joints=figure.joints + place, origin=figure.origin + place)


def _gone(someone: Bystander, times: Array) -> np.ndarray:
    """The frames, of shape (T,), in which a bystander is away."""
    begin, end = someone.away or (0.0, 0.0)
    return (begin <= times) & (times < end)


def _wall(figure: PosedBody, others: list[PosedBody]) -> float:
    """Least distance of the wall behind the origin, metres; 0 if all people stay in place: every wall is far enough for that."""
    people = [one.joints[..., :2] for one in (figure, *others)]
    behind, aside = max(float(one[..., 1].max()) for one in people), max(float(np.abs(one).max()) for one in people)
    return max(behind if others or behind > 1.15 else -0.4, aside if aside > 5.6 else -0.4) + 0.4


def _shoot(folder: Path, spec: Spec, studio: SceneRenderer, figure: PosedBody, tell: Callable[[int], None]) -> tuple[int, int]:
    """Write a camera's films; returns the numbers of the person's hidden and visible pixels. tell: called with the frames done.

    After Ctrl-C the films end with the last frame made and can be used.
    """
    from shadowpuppet.video import write_frames

    name, hidden, seen = studio.room.camera.name, 0, 0
    crf = studio.faults.crf(spec.scene.crf, empty=False)
    _shoot_empty(folder, spec, studio)
    interrupted = False
    with contextlib.ExitStack() as stack:
        film = stack.enter_context(write_frames(folder / "video" / f"{name}.mp4", spec.rate, crf=crf, threads=1))
        kinds = ["masks", *["people"][: len(spec.scene.bystanders)]]
        exact = [stack.enter_context(write_frames(folder / kind / f"{name}.mkv", spec.rate, lossless=True)) for kind in kinds]
        try:
            for picture in studio.film(figure):
                for masks, mask in zip(exact, (picture.mask, picture.people)):
                    masks.write(mask)
                film.write(picture.image)
                hidden, seen = hidden + picture.hidden, seen + int((picture.mask > 0).sum())
                tell(film.count)
        except KeyboardInterrupt:
            if not film.count:
                raise
            interrupted = True
    if interrupted:
        raise KeyboardInterrupt
    return hidden, seen


def _shoot_empty(folder: Path, spec: Spec, studio: SceneRenderer) -> None:
    """Write a camera's film of the empty scene, if the spec has one."""
    from shadowpuppet.video import write_frames

    if spec.scene.empty_seconds == 0:
        return
    crf, path = studio.faults.crf(spec.scene.crf, empty=True), folder / "background" / f"{studio.room.camera.name}.mp4"
    with write_frames(path, spec.rate, crf=crf, threads=1) as film:
        count = max(1, round(spec.scene.empty_seconds * spec.rate))
        for index in range(count):
            film.write(studio.empty(index, count))


def _write_given(folder: Path, spec: Spec, cameras: list[Camera], rng: np.random.Generator) -> None:
    """Write what a user knows of a recording: calibration, the subject's data, and for several cameras a training motion.

    The training motion is another performance, with other random numbers, of the same or of other gestures by the same body.
    """
    from shadowpuppet.io.calibration.calibration_files import write_calibration

    write_calibration(folder / "calibration.toml", cameras)
    _write_subject(folder / "recording.toml", spec)
    own = spec.motion if spec.training is None else spec.training
    if len(cameras) > 1 and own and not (own == spec.motion and any(gesture.file for gesture in own)):  # a file plays the same every time
        again, rehearsal = perform(replace(spec, motion=own, frames=spec.training_frames), rng)
        write_truth(folder / "training", again, rehearsal.joints, spec.rate)


def _write_references(folder: Path, spec: Spec, studio: SceneRenderer) -> None:
    """Write reference pictures with masks and joints; none if an obstacle hides a part, as sizes are fitted to whole silhouettes, or if the
    person never stands.
    """
    from shadowpuppet.video import write_image

    figures = {name: pose(spec.body, posture(**named)) for name, named in REFERENCES.items()}
    if spec.posture != "standing" or any(studio.hides(figure) for figure in figures.values()):
        return
    _folders(folder)
    for name, figure in figures.items():
        image, mask = studio.take(figure, 0)
        write_image(folder / f"{name}.png", image)
        write_image(folder / f"{name}_mask.png", mask)
        write_truth(folder / name, np.zeros(1), figure.joints, 1.0)


def _write_subject(path: Path, spec: Spec) -> None:
    """Write recording.toml with the subject's data."""
    lines = ["[subject]"]
    if "height" in spec.tells:
        lines.append(f"height = {spec.body.stature:.3f}     # metres, shoes on")
    views = spec.views()
    stays = not any(gesture.motion in ("walk", "jog", "mocap") for gesture in spec.motion)
    if "distance" in spec.tells and len(views) == 1 and stays:  # who walks has no one distance
        distance = views[0].distance
        lines.append(f"distance = {distance:.3f}   # metres, camera to the middle of the body, before the first movement")
    if spec.scene.bystanders and len(views) > 1:
        lines += ["", "[masks]          # of all people", *(f'{view.name} = "people/{view.name}.mkv"' for view in views)]
    write_lines(path, lines)


def _folders(folder: Path, *names: str) -> None:
    try:
        for name in names or ("",):
            (folder / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: the recording cannot be written there ({(error.strerror or str(error)).lower()})") from None
