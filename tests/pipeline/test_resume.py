"""A run that is killed goes on to the same result, bit by bit; what it cannot go on from is refused."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import made
import numpy as np
import pytest

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.checkpoint import FRAMES, STATE
from shadowpuppet.io.files.lock import LOCK
from shadowpuppet.io.run_writer import CompleteRun
from shadowpuppet.pipeline import progress
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.prepare import MONOCULAR, MULTIVIEW
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.stages import write as module
from shadowpuppet.pipeline.track import run
from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, synthesize

KILLS = 5
TABLES = ("joints.csv", "raw.csv", "angles.csv", "intervals.csv", "run.toml", "look.json", "person.toml", "calibration.toml")


class Kills(Listener):
    """Keeps the folder of a run as it is when a process is killed after some of its frames."""

    def __init__(self, folder: Path, after: list[int], phase: str = "tracking") -> None:
        self.folder, self.after, self.phase, self.now = folder, after, phase, ""

    def begin(self, what: str, total: int | None = None) -> None:
        self.now = what

    def advance(self, frames: int) -> None:
        if frames in self.after and self.now == self.phase:
            shutil.copytree(self.folder, killed(self.folder, frames))


def killed(folder: Path, frames: int) -> Path:
    return folder.with_name(f"{folder.name}-killed-{frames}")


def assert_equal_runs(one: Path, other: Path) -> None:
    for name in TABLES:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    ours, theirs = (np.load(folder / "motion.npz") for folder in (one, other))
    for name in ours.files:
        np.testing.assert_array_equal(ours[name], theirs[name])
    assert {path.name for path in one.iterdir()} == {path.name for path in other.iterdir()}


RING = Spec(name="ring", motion=(Gesture(motion="walk", seconds=2),), rate=8, scene=Scene(empty_seconds=0.5),
            ring=Ring(count=3, radius=3.6, fov_deg=42, size=(96, 72)))  # fmt: skip


@pytest.fixture(scope="module", params=["one camera", "several cameras"])
def film(request, recording, tmp_path_factory):
    """How to track a recording; it is surveyed and fitted once, as that takes most of the time and gives the same each time."""
    kind, options = MONOCULAR, make_options({"seed": 3, "overlay": True, "tracker": {"cycles": 1}})
    if request.param == "several cameras":
        kind, options = MULTIVIEW, make_options({"seed": 3, "overlay": True, "multiview": {"particles": 8}})
        synthesize(RING, recording := tmp_path_factory.mktemp("ring") / "made")
    rig = open_rig(recording, options)
    survey = kind.survey(rig, options)
    subject = replace(kind.fit(np.random.default_rng(1), survey, options), beside=())
    known = kind._replace(survey=lambda *_, **__: survey, fit=lambda *_: subject)

    def track(folder, listener=None, resume=False, place=None, **changed):
        seen = rig if place is None else replace(open_rig(place, options), footage=rig.footage)
        return run(seen, known, folder, replace(options, **changed), listener or Listener(), resume=resume)

    track.recording = rig.recording.path

    return track


@pytest.mark.whole
def test_a_run_killed_anywhere_goes_on_to_the_same_result(film, tmp_path, monkeypatch):
    monkeypatch.setattr(progress, "CHECKPOINT_SECONDS", 0.0)
    monkeypatch.setattr(progress, "CHECKPOINT_COST", 2.0)  # not after every frame: rows behind the checkpoint are cut
    folder = tmp_path / "run"
    after = sorted(np.random.default_rng(4).choice(np.arange(1, 15), KILLS, replace=False).tolist())
    whole = film(folder, Kills(folder, after))
    number = len(whole.motion)
    for frames in after:
        left = killed(folder, frames)
        assert (left / STATE).exists()
        with (left / "joints.csv").open("a") as rows:
            rows.write("0.5,0.1")  # a row that was being written
        found = film(left, resume=True)
        assert_equal_runs(left, folder)
        assert not (left / STATE).exists()
        assert found.metrics["status"] == whole.metrics["status"]
        assert len(made.images(left / "overlay.mp4")) == number


@pytest.mark.whole
def test_a_run_killed_on_its_way_back_goes_on_to_the_same_result(film, tmp_path, monkeypatch):
    monkeypatch.setattr(progress, "CHECKPOINT_SECONDS", 0.0)
    folder = tmp_path / "run"
    whole = film(folder, kills := Kills(folder, [6], "tracking backward"))
    left = killed(folder, 6)
    if whole.metrics.get("cameras", 2) != 1:
        assert kills.now == "drawing"
        assert not left.exists()  # several cameras see depth
        return
    film(left, resume=True)
    assert_equal_runs(left, folder)


def test_only_the_same_run_goes_on_and_a_complete_one_does_not(film, tmp_path, monkeypatch):
    monkeypatch.setattr(progress, "CHECKPOINT_SECONDS", 0.0)
    monkeypatch.setattr(progress, "CHECKPOINT_COST", 0.0)
    folder = tmp_path / "run"
    film(folder, Kills(folder, [4]))
    left = killed(folder, 4)
    copy = shutil.copytree(left, tmp_path / "copy")
    before = {path.name: path.read_bytes() for path in left.iterdir() if path.name != LOCK}
    with pytest.raises(CompleteRun, match="run: the run is complete: nothing is left to be done"):
        film(folder, resume=True)
    with pytest.raises(ShadowPuppetError, match=r"cannot go on as another one: settings\.seed was 3, and is 4"):
        film(left, resume=True, seed=4)
    with pytest.raises(ShadowPuppetError, match=r"settings\.end was not given, and is '1'"):
        film(left, resume=True, end="1")
    for name, said in (("calibration.toml", r"calibration\.toml"), ("video", r"video/\w+\.\w+")):
        other = made.copied(film.recording, tmp_path / name)
        one = other / name if name != "video" else sorted((other / name).iterdir())[0]
        one.write_bytes(one.read_bytes() + b"\n")
        with pytest.raises(ShadowPuppetError, match=f"the run there cannot go on: {said} has changed since; expected the files with which"):
            film(left, resume=True, place=other)
    look, changed = module.json_text, "{}"
    monkeypatch.setattr(module, "json_text", lambda value: changed)
    with pytest.raises(ShadowPuppetError, match=r"its look\.json differs from what the recording gives now"):
        film(left, resume=True)
    monkeypatch.setattr(module, "json_text", look)
    frames = (left / FRAMES).read_bytes()
    (left / FRAMES).write_bytes(frames[:-9])
    with pytest.raises(FormatError, match=r"checkpoint\.frames: found 3 frames, expected 4"):
        film(left, resume=True)
    (left / FRAMES).write_bytes(frames)
    assert {path.name: path.read_bytes() for path in left.iterdir()} == before  # what is refused is left as it was
    (left / STATE).write_bytes(before[STATE][:-100])
    with pytest.raises(FormatError, match=r"checkpoint\.npz: "):
        film(left, resume=True)
    (left / STATE).write_bytes(before[STATE])
    (left / "joints.csv").write_text("")  # killed while the smoothed tables were written
    (left / "raw.csv").write_text("")
    film(left, resume=True)
    assert_equal_runs(left, folder)
    shutil.rmtree(left)
    shutil.copytree(copy, left)
    found = film(left, resume=True, place=made.copied(film.recording, tmp_path / "elsewhere"))  # a copy holds the same
    assert (left / "motion.npz").read_bytes() == (folder / "motion.npz").read_bytes()
    assert tomllib.loads((left / "run.toml").read_text())["recording"] == str((tmp_path / "elsewhere").resolve())
    assert found.metrics["complete"]
    shutil.rmtree(left)
    shutil.copytree(copy, left)
    (left / STATE).unlink()  # killed before the first checkpoint: it begins at the start
    film(left, resume=True)
    assert_equal_runs(left, folder)
