"""What the experiments are done on: recordings that are made, or given; read, segmented and measured once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from papers.common.experiment import Request
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.plain import plain
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.metrics import match
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.options import Options, make_options, plain_options
from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.pipeline.prepare import MONOCULAR, prepare
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.synthesize import make_recording
from shadowpuppet.synthetic import Mannequin, Scene, Spec, Viewpoint, read_spec
from shadowpuppet.synthetic.movement.gestures import PAUSE_SECONDS
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.synthetic.spec_file import SPEC_FILE
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.monocular.initialization import PersonEstimate
from shadowpuppet.tracking.monocular.settings import MonocularSettings, make_settings
from shadowpuppet.video import Image

MADE = {
    "three_motions": ("wave_hands 7.4, bend_aside 7.5, bow_forward 7.5", "wave_hands 2.4, bend_aside 2.4, bow_forward 2.4"),
    "toward_camera": ("reach 11.2, box 11.2", "reach 2.4, box 2.4"),
}
"""Gestures (s) of the made recordings, 24 s each: the paper's three motions; arms toward the camera, and fists before the trunk. Beside
them, those of the short versions."""
SILHOUETTES = {"practical": {}, "averaging": {"silhouette": {"method": "averaging"}}, "exact": {"masks": True}}
"""How the person is told from the background: as `track` does, by the paper's eq. 1 alone, or by ready silhouettes."""
QUICK = {"hypotheses": 60, "rounds": 8, "patience": 4, "sweeps": 1}
"""Of the sizes' search, in short versions."""


class Part(NamedTuple):
    """A motion in a film."""

    name: str
    start: float
    """Seconds."""
    end: float


@dataclass(frozen=True, eq=False)
class Case:
    """A recording with its silhouettes and the person in it, measured."""

    folder: Path
    footage: Footage
    silhouettes: Silhouettes
    subject: MonocularSubject
    options: Options
    times: Array
    """Of the frames, seconds, (T,)."""
    masks: NDArray[np.bool_]
    """Silhouettes, (T, H, W)."""
    truth: JointTable | None
    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """The recording's folder."""
        return self.footage.recording.path.name

    @property
    def camera(self) -> Camera:
        """Of pictures of the size that is worked on."""
        return self.footage.camera

    @property
    def guess(self) -> PersonEstimate:
        """The person's sizes and place."""
        return self.subject.fit.guess

    @cached_property
    def picture(self) -> Picture:
        """How the camera sees the person."""
        return self.guess.picture(self.camera, self.options.tracker.body)

    @property
    def tracker(self) -> MonocularSettings:
        """The paper's settings (Table I), by `DRS`."""
        return self.options.tracker

    def frames(self, wanted: Sequence[int]) -> list[Image]:
        """Some of the film's pictures, read again: a film is not kept in memory."""
        last = max(wanted)
        found = {n: shot.image for n, shot in zip(range(last + 1), self.footage.frames(False)) if n in wanted}
        return [found[n] for n in wanted]

    def true_places(self, names: tuple[str, ...]) -> Array:
        """Where joints are (T, J, 3), metres, in the world; not a number where that is not known. Raises `ShadowPuppetError`."""
        if self.truth is None:
            raise ShadowPuppetError(f"{self.name}: found no truth, expected truth.csv or truth.trc in the recording: without it there is "
                                    "no 3D error")
        index, matched = match(self.truth.times, self.times)
        places = self.truth.select(names).positions[index]
        places[~matched] = np.nan
        return places


def cases(request: Request, made: str = "three_motions", **changes) -> list[Case]:
    """The recordings that were given, or the `made` one; `changes` are those of the tracker's settings beside the paper's."""
    folders = request.recordings or (made_recording(request, made),)
    return [case(request, folder, tuple(changes.items())) for folder in folders]


def case(request: Request, folder: Path, changes: tuple[tuple[str, str], ...] = ()) -> Case:
    """A recording, looked at once however often it is asked for. Raises a `ShadowPuppetError` where it cannot be used."""
    values = SILHOUETTES[request.more.get("silhouettes", "practical")] | {"preset": "liu2011", "tracker": dict(changes)}
    return seen(folder, make_options(values | ({"initialization": QUICK} if request.short else {})))


def seen(folder: Path, options: Options) -> Case:
    """A recording's silhouettes and person, which depend neither on the seed nor on what filter is to be tried."""
    measuring = replace(options, seed=0, every=1, tracker=make_settings("liu2011", {"body": options.tracker.body}))
    return replace(_seen(folder, json.dumps(plain(plain_options(measuring), "options"), sort_keys=True)), options=options)


def made_recording(request: Request, name: str) -> Path:
    """The folder of one of `MADE`, made where it is not there as it should be. Raises `RecordingError`."""
    spec = spec_of(name, request.short)
    folder = request.output / "recordings" / (f"{name}_short" if request.short else name)
    if not _is_made(spec, folder):
        request.tell(f"making {folder} (once)")
        make_recording(spec, folder)
    return folder


def spec_of(name: str, short: bool) -> Spec:
    """What a made recording is made of: 320 x 240 pixels at 15 Hz, as the paper's."""
    spec = Spec(name=name, body=Mannequin(stature=1.78), motion=parse_gestures(MADE[name][short]), scene=Scene(clothing=7, room=2), seed=6)
    if not short:
        return spec
    return replace(spec, cameras=(Viewpoint(size=(160, 120)),), rate=8, scene=replace(spec.scene, empty_seconds=1))


def _is_made(spec: Spec, folder: Path) -> bool:
    """Whether a recording of just this spec is in a folder, whole."""
    try:
        return read_spec(folder / SPEC_FILE) == spec and (folder / "video" / "cam.mp4").exists()
    except SettingsError:
        return False


@lru_cache(maxsize=6)
def _seen(folder: Path, told: str) -> Case:
    """`told`: options as JSON."""
    options = make_options(json.loads(told))
    with one_blas_thread():
        prepared = prepare(np.random.default_rng(options.seed), open_rig(folder, options), options, MONOCULAR)
        subject = prepared.check()
        assert isinstance(subject, MonocularSubject)
        (footage,), (silhouettes,) = prepared.survey.rig.footage, prepared.survey.silhouettes
        frames = [(frame.time, silhouettes(frame)) for frame in footage.frames(options.masks)]
    times, masks, truth = np.array([time for time, _ in frames]), np.array([mask for _, mask in frames]), footage.recording.truth
    if not masks[0].any():
        raise ShadowPuppetError(f"{folder}: found nobody in the first frame, expected the person there: the paper's filter begins with it")
    motion = read_joints(truth) if truth is not None else None
    return Case(folder, footage, silhouettes, subject, options, times, masks, motion, _parts(folder, times))


def _parts(folder: Path, times: Array) -> tuple[Part, ...]:
    """The motions of a made recording; of another one, its thirds."""
    try:
        gestures = read_spec(folder / SPEC_FILE).motion
    except SettingsError:
        ends = np.linspace(times[0], times[-1], 4).tolist()
        return tuple(Part(f"{nth} third", *span) for nth, span in zip(("first", "second", "last"), pairwise(ends)))
    ends = (PAUSE_SECONDS + np.cumsum([0, *(gesture.seconds for gesture in gestures)])).tolist()
    names = [gesture.motion.replace("_", " ") for gesture in gestures]
    return tuple(Part(name, start, end) for name, start, end in zip(names, [times[0], *ends[1:]], [*ends[1:-1], times[-1]]))
