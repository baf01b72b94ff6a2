"""Several cameras from a recording to a run folder, as a user has it done: who is there, the prior, sizes used again, every option."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from pathlib import Path

import actor
import made
import made_rig
import numpy as np
import pytest

from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import HARMFUL, NOTED
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline import person_rig
from shadowpuppet.pipeline.findings.rig import survey_rig
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.tracking.doubt.variance import variance_model
from shadowpuppet.tracking.multiview.settings import for_smeared
from shadowpuppet.tracking.multiview.size_estimation import Front
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker
from shadowpuppet.tracking.smoothing.likelier_pass import likelier

pytestmark = pytest.mark.usefixtures("scale_unfitted")
FRAMES = 16
QUICK = {"masks": True, "multiview": {"particles": 16, "cycles": 1, "hull": {"rays": 600}}, "training": {"regions": 6, "starts": 1}}
FEW = {"masks": True, "multiview": {"particles": 4, "hull": {"rays": 300}}}
"""For laws that do not depend on how well a body fits."""
TRUE = actor.sizes(thigh_width=1.15, waist_depth=1.2, upper_arm_length=1.04)


def poses_at(rate: float, frames: int, begin: float = 0.0) -> np.ndarray:
    return actor.walk(anatomical(TRUE).skeleton, frames, rate, begin)


def views(frames: int) -> list[list[Mask]]:
    """Silhouettes of the walk by frame and camera."""
    body = anatomical(TRUE)
    return [actor.masks(body, pose) for pose in poses_at(made_rig.RATE, frames)]


def table(poses: np.ndarray, rate: float) -> JointTable:
    body = anatomical(TRUE)
    return JointTable(np.arange(len(poses)) / rate, body.landmark_names, body.points(poses))


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    """Somebody not quite average who walks among five cameras, and another take of it to learn from."""
    folder = made_rig.write(tmp_path_factory.mktemp("made") / "walk", actor.cameras(), views(FRAMES))
    write_joints(folder / "truth.csv", table(poses_at(made_rig.RATE, FRAMES), made_rig.RATE))
    write_joints(folder / "training.csv", table(poses_at(20.0, 60, 0.3), 20.0))
    return folder


@pytest.fixture(scope="module")
def untaught(recording, tmp_path_factory) -> Path:
    """The same without motion to learn from."""
    return made.copied(recording, tmp_path_factory.mktemp("made") / "untaught", ["training.csv"])


@pytest.fixture(scope="module")
def run(recording, tmp_path_factory) -> Run:
    folder = tmp_path_factory.mktemp("run") / "run"
    track_recording(recording, folder, make_options(QUICK))
    return read_run(folder)


def folder_of(run: Run) -> Path:
    return Path(run.folder)


def errors(run: Run) -> np.ndarray:
    """Mean distance of the limbs' joints from truth, by frame."""
    true = table(poses_at(made_rig.RATE, FRAMES), made_rig.RATE).select(actor.LIMBS).positions
    return np.linalg.norm(run.motion.table.select(actor.LIMBS).positions - true, axis=2).mean(1)


def tracked(shell, recording, *tokens) -> Run:
    few = ("--multiview.particles", 6, "--multiview.cycles", 1, "--multiview.hull.rays", 300, "--training.regions", 6)
    code, _, err = shell("track", recording, "-o", "run", "--quiet", "--force", "--masks", *few, *tokens)
    assert code == 0, err
    assert all(line.startswith("warning: camera") for line in err.splitlines()), err
    return read_run(Path("run"))


def refused(shell, recording, *tokens) -> str:
    code, _, err = shell("track", recording, "-o", "run", "--quiet", "--masks", *tokens)
    said = [line for line in err.splitlines() if not line.startswith("warning: camera")]
    assert (code, len(said)) == (2, 1), err
    assert said[0].startswith("error: ")
    assert not Path("run").exists()
    return said[0]


# The whole way --------------------------------------------------------------------------------------------------------


def test_a_recording_becomes_joints(run):
    assert set(run.motion.status) == {"tracked"}
    found = errors(run)
    assert found.mean() < 0.025
    assert found.max() < 0.06
    assert run.metrics["errors"]["mean_mm"] < 40
    assert run.metrics["errors"]["lost"] == 0
    assert run.info["body"] == "anatomical"
    assert run.info["settings"]["multiview"]["particles"] == 16


def test_who_was_there_is_reported_and_saved(run):
    person = json.loads((folder_of(run) / "look.json").read_text())["person"]
    assert person["source"] == "training motion, and the hulls of the first seconds"
    assert person["overlap"] > 0.85
    assert 0 < person["residual"] < 0.015
    assert person["frames"] >= 10
    saved = read_person(folder_of(run) / "person.toml", "anatomical").sizes
    assert dict(zip(saved.names(), saved.to_array().tolist())) == pytest.approx(person["sizes"])
    for bone in ("thigh_length", "upper_arm_length", "forearm_length", "hip_distance"):
        assert getattr(saved, bone) == pytest.approx(getattr(TRUE, bone), abs=0.006)
    average = actor.sizes()
    before, after = (sum(abs(getattr(sizes, name) - getattr(TRUE, name)) for name in ("thigh_width", "waist_depth"))
                     for sizes in (average, saved))
    assert after < before


def test_the_same_seed_is_the_same_run(recording, run, tmp_path):
    track_recording(recording, tmp_path / "again", make_options(QUICK))
    assert (tmp_path / "again" / "joints.csv").read_bytes() == (folder_of(run) / "joints.csv").read_bytes()


def test_films_of_two_cameras_are_tracked_both_ways_unless_keypoints_show_the_front(untaught, tmp_path, monkeypatch):
    passes = []
    monkeypatch.setattr(person_rig, "likelier", lambda *given, **more: passes.append(given[:2]) or likelier(*given, **more))
    pair = QUICK | {"camera": "cam1,cam3"}
    found = track_recording(untaught, tmp_path / "run", make_options(pair))
    ((forward, backward),) = passes
    assert len(forward) == len(backward) == len(found.motion) == FRAMES
    assert found.metrics["backward_s"] > 0
    assert "backward_s" not in track_recording(untaught, tmp_path / "off", make_options(pair | {"smooth": "off"})).metrics
    subject = person_rig.known_person(np.random.default_rng(0), actor.cameras()[:2], make_options(FEW), made_rig.RATE,
                                      Person(TRUE, 1.75, "known"), {}, True)
    assert not subject.both_ways
    assert dataclasses.replace(subject, silhouettes_alone=True).both_ways


def test_deviations_are_restated_of_silhouettes_of_three_cameras_or_more():
    def limits(cameras: int, alone: bool):
        subject = person_rig.known_person(np.random.default_rng(0), actor.cameras()[:cameras], make_options(FEW), made_rig.RATE,
                                          Person(TRUE, 1.75, "known"), {}, True)
        return dataclasses.replace(subject, silhouettes_alone=alone).limits

    assert limits(3, True) == variance_model("multiview").limits
    assert limits(2, True) is limits(3, False) is None


@pytest.mark.parametrize(("smeared", "emptiness", "silhouettes"), [(False, 2.0, 0.1), (True, 0.5, 0.05)])
def test_silhouettes_of_films_that_have_lost_detail_hold_the_body_less(untaught, monkeypatch, smeared, emptiness, silhouettes):
    monkeypatch.setattr(Silhouettes, "smeared", property(lambda self: smeared))
    used, options = [], make_options(QUICK)
    monkeypatch.setattr(person_rig, "fit_in_views", lambda rng, cameras, views, options, *rest, **more: used.append(options.multiview))
    person_rig.fit_multiview(np.random.default_rng(0), survey_rig(open_rig(untaught, options), options), options)
    assert (used[0].gauss_newton.emptiness, used[0].silhouettes) == pytest.approx((emptiness, silhouettes))
    assert for_smeared(options.multiview, 0.0) is options.multiview


def test_an_estimated_height_is_doubted_where_the_body_fits_badly():
    assert person_rig._doubts(1.8, 0.85) == person_rig._doubts(1.9, 0.85) == ()
    (said,) = person_rig._doubts(1.83, 0.72)
    assert "height, 1.83 m, may be off by 20 cm: the body overlaps the silhouettes by 0.72 only" in said
    assert (said.short, said.severity) == ("height is uncertain: give --height", NOTED)
    assert len(said.short.split()) <= 10


@pytest.mark.parametrize("overlap", [0.72, 0.9, np.nan])
def test_a_height_that_hardly_anybody_has_is_doubted_however_well_it_fits(overlap):
    (said,) = person_rig._doubts(2.02, overlap)
    assert (said.short, said.severity) == ("a height of 2.02 m is unlikely: give --height", HARMFUL)


def test_a_front_that_hardly_fits_better_is_doubted():
    assert person_rig._front_doubts(None) == ()
    assert person_rig._front_doubts(Front(0.0, np.zeros(3), 0.05)) == ()
    (said,) = person_rig._front_doubts(Front(0.0, np.zeros(3), 0.012))
    assert "which way the person faces is uncertain" in said
    assert "about as well (1 % worse)" in said
    assert said.severity == HARMFUL
    assert len(said.short.split()) <= 10


def test_the_first_search_is_about_a_doubted_front(monkeypatch):
    rng, told = np.random.default_rng(0), []
    subject = person_rig.known_person(rng, actor.cameras(), make_options(FEW), made_rig.RATE, Person(TRUE, 1.75, "known"), {}, True)
    start = MultiviewTracker.start

    def watched(self, *given, facing, keypoints):
        told.append(facing)
        return start(self, *given, facing=facing, keypoints=keypoints)

    monkeypatch.setattr(MultiviewTracker, "start", watched)
    seen = [subject.observe(Seen(masks)) for masks in views(2)]
    doubted = dataclasses.replace(subject, front=Front(0.3, seen[0].points.points.mean(0), 0.1))
    for person, observation in ((subject, seen[0]), (doubted, seen[0]), (doubted, seen[1])):
        person.next_state(np.random.default_rng(0), None, observation)
    assert told == [None, 0.3, None]


def test_only_a_height_that_was_estimated_is_doubted(monkeypatch):
    monkeypatch.setattr(person_rig, "SURE_OVERLAP", 2.0)
    for options, number in ((FEW | {"height": 1.75}, 0), (FEW, 1)):
        fitted = person_rig.fit_in_views(np.random.default_rng(0), actor.cameras(), views(2), make_options(options), made_rig.RATE)
        assert len(fitted.doubts) == number


# Options as a user types them -----------------------------------------------------------------------------------------


def test_sizes_of_an_earlier_run_are_used_again(untaught, run, shell):
    again = tracked(shell, untaught, "--person", folder_of(run) / "person.toml")
    assert read_person("run/person.toml", "anatomical").sizes == read_person(folder_of(run) / "person.toml", "anatomical").sizes
    person = json.loads(Path("run/look.json").read_text())["person"]
    assert person["source"] == str(folder_of(run) / "person.toml")
    assert person["residual"] is None
    assert errors(again).mean() < 0.04


@pytest.mark.whole
def test_without_training_sizes_come_from_the_height_or_from_what_is_seen(untaught, shell, monkeypatch):
    monkeypatch.setattr(person_rig, "AVERAGE_HEIGHT", 1.0)  # which is for those of whom nothing is seen
    found = tracked(shell, untaught, "--height", 1.75)
    assert json.loads(Path("run/look.json").read_text())["person"]["source"] == "the height, and the hulls of the first seconds"
    assert errors(found).mean() < 0.06
    tracked(shell, untaught, "--multiview.method", "image_force", "--multiview.surface.tau", 0.08)
    assert read_run(Path("run")).info["settings"]["multiview"]["surface"]["tau"] == 0.08
    said = json.loads(Path("run/look.json").read_text())["person"]["source"]
    assert said.startswith("a height of 1.")
    assert float(said.split()[3]) == pytest.approx(1.75, abs=0.12)


def test_the_paper_s_preset_runs(recording, shell):
    found = tracked(shell, recording, "--preset", "ni2008")
    assert found.info["method"].startswith("Ni 2008, ")
    assert found.info["body"] == "cylinders"
    settings = found.info["settings"]["multiview"]
    assert (settings["refinement"], settings["defensive"], settings["particles"]) == ("forces", 0.0, 6)
    assert errors(found).mean() < 0.1
    assert tomllib.loads(Path("run/person.toml").read_text())["body"] == "cylinders"


@pytest.mark.whole
def test_a_prior_is_learnt_once_and_taken_from_its_file(recording, untaught, shell):
    assert shell("fit-prior", recording / "training.csv", "-o", "walk.npz", "--regions", 6, "--rate", 20)[0] == 0
    assert errors(tracked(shell, untaught, "--prior", "walk.npz", "--height", 1.75)).mean() < 0.06
    assert shell("fit-prior", recording / "training.csv", "-o", "other.npz", "--regions", 6, "--body", "cylinders")[0] == 0
    Path("run").rename("first")
    assert "other.npz: prior: found" in refused(shell, untaught, "--prior", "other.npz")


def test_what_does_not_fit_is_refused_in_a_sentence(recording, run, shell):
    person = folder_of(run) / "person.toml"
    said = refused(shell, recording, "--person", person, "--body", "cylinders")
    assert f"{person}: sizes: found those of the body 'anatomical', expected those of 'cylinders'" in said
    assert "body: found 'rounded', an upper body, for several cameras; expected one of" in refused(shell, recording, "--body", "rounded")
    assert "found 0; input should be greater than or equal to 1" in refused(shell, recording, "--multiview.particles", 0)
    assert "unknown preset 'ni'; there are: default, liu2011, liu2011_printed, ni2008" in refused(shell, recording, "--preset", "ni")
    assert "person.toml: cannot be read" in refused(shell, recording, "--person", "person.toml")
    made.replace_text(made.copied(person.parent, Path("spoilt")) / "person.toml", "thigh_length", "thigh_size")
    assert "spoilt/person.toml: " in refused(shell, recording, "--person", "spoilt/person.toml")


@pytest.mark.parametrize(("flag", "value"), [
    ("--multiview.method", "magic"), ("--multiview.body", "rounded"), ("--multiview.refinement", "luck"),
    ("--multiview.resampling", "deterministic"), ("--multiview.estimate", "worst")])  # fmt: skip
def test_unknown_choices_are_refused_with_those_there_are(recording, flag, value, shell):
    said = refused(shell, recording, flag, value)
    assert value in said
    assert flag.removeprefix("--") in said or flag.split(".")[1] in said
