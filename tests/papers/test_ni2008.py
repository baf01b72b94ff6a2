"""The experiments of Ni 2008: the short version of each, as a reader types it; and that what they conclude is computed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from results import read_rows, read_summary

from papers.common import runner
from papers.common.experiment import Request
from papers.ni2008 import figure_4, figure_6, figure_7, figure_8, inputs, measures, models, particles, table_2, tracks
from papers.ni2008.__main__ import EXPERIMENTS, main
from shadowpuppet.synthetic import Ring, Scene, Spec, humaneva, synthesize
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.tracking.multiview.settings import make_multiview_settings

SEED = 3
"""Of all runs here: not the default."""
CLAIMS = {
    "figure_4": ["already quite low", "reconstruction error is flat"],
    "figure_5": ["closely matches"],
    "figure_6": ["accurately follow"],
    "figure_7": ["greater in the jogging and boxing"],
    "figure_8": ["falls with M", "tracking error is flat", "10 to 20"],
    "table_1": ["100 frames to learn from"],
    "table_2": ["most accurate", "image force loses", "well on walking", "hybrid loses no", "particle filter loses no", "fastest"],
    "particles": ["1000 particles are not adequate", "perhaps 10,000"],
}
"""What must be judged: all that the paper claims (the design's method.md, and what Figs. 5 to 7 are said to show)."""


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    """All of them, small, in one process."""
    folder = tmp_path_factory.mktemp("papers") / "ni2008"
    assert main(["all", "--short", "--workers", "1", "--seed", str(SEED), "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def asked(out) -> Request:
    """What was asked, once more."""
    return Request(out, seed=SEED, short=True)


@pytest.fixture(scope="module")
def case(asked) -> inputs.Case:
    """One of the recordings."""
    return inputs.load(asked, inputs.sources(asked)[2])


# As a reader types it


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.name)
def test_each_leaves_pictures_data_and_claims(out, experiment):
    told = read_summary(out, experiment.name)
    assert told["short"]
    assert told["seed"] == SEED
    assert told["takes"] == experiment.takes
    for name in told["pictures"]:
        with Image.open(out / name) as picture:
            assert min(picture.size) > 150
            assert len(picture.convert("RGB").getcolors(1 << 20)) > 5  # something is drawn
    for name in told["data"]:
        assert read_rows(out, Path(name).stem)
    claims = [claim["claim"] for claim in told["claims"]]
    wanted = CLAIMS.get(experiment.name, [])
    assert len(claims) == len(wanted)
    assert all(any(words in claim for claim in claims) for words in wanted)
    for claim in told["claims"]:
        assert claim["shown"] in (*told["pictures"], *told["data"])
        assert claim["got"]


def test_a_second_command_uses_the_runs_of_the_first(out, capsys):
    files = {path: path.stat().st_mtime_ns for path in out.rglob("*.npz")}
    assert files
    before = read_summary(out, "table_2")["claims"]
    assert main(["table_2", "--short", "--workers", "1", "--seed", str(SEED), "-o", str(out)]) == 0
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.npz")} == files
    said = capsys.readouterr()
    assert "| paper said | where | we got | same conclusion? |" in said.out
    assert "reading" not in said.err
    assert [claim["same"] for claim in read_summary(out, "table_2")["claims"]] == [claim["same"] for claim in before]


def test_a_run_is_kept_under_all_that_it_depends_on(case, asked, monkeypatch):
    jobs = [tracks._job(asked, case, way, seed).file for way in (tracks.HYBRID, tracks.hybrid(5), tracks.particle_filter(100))
            for seed in (0, 1)]
    assert len(set(jobs)) == len(jobs)
    source = inputs.sources(asked)[2]
    key = source.key
    assert source._replace(masks=True).key != key
    monkeypatch.setattr(inputs, "digest", lambda *modules: "of other code")
    assert source.key != key
    assert tracks._job(asked, case, tracks.HYBRID, 0).file not in jobs


def test_a_given_recording_is_read_from_its_films(tmp_path, capsys):
    spec = Spec(name="boxer", motion=parse_gestures("box 3"), begin=1.2, frames=5, training_frames=40, rate=30, seed=4, tells="height",
                ring=Ring(count=4, radius=3.6, fov_deg=42, size=(160, 120)), scene=Scene(empty_seconds=0.3))
    folder, into = synthesize(spec, tmp_path / "boxer"), tmp_path / "out"
    assert main(["table_1", "figure_5", "--recording", str(folder), "--workers", "1", "-o", str(into)]) == 0
    assert [row["testing size, frames"] for row in read_rows(into, "table_1")] == ["5"]
    assert read_summary(into, "figure_5")["command"] == "python -m papers.ni2008 figure_5 --recording boxer"
    assert float(read_rows(into, "figure_5")[0]["rmse_mm"]) < 150
    with Image.open(into / "figure_5.png") as picture:
        seen = np.asarray(picture.convert("RGB")).astype(int)
    lower = seen[seen.shape[0] // 2 :].reshape(-1, 3)
    assert ((lower[:, 1] > lower[:, 0] + 40) & (lower[:, 1] > lower[:, 2] + 40)).any()  # green: the estimate
    upper = seen[: seen.shape[0] // 2]
    assert upper.std() > 10  # the film's picture
    (folder / "training.csv").unlink()
    (folder / "training.trc").unlink()
    capsys.readouterr()
    assert main(["figure_4", "--recording", str(folder), "-o", str(into)]) == 2
    assert "found no training motion" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "told"), [
    (["--recording", "nowhere"], "nowhere: no such recording"),
    (["--humaneva", "nowhere"], "nowhere"),
])
def test_what_cannot_be_used_is_reported(tmp_path, capsys, words, told):
    assert main(["table_1", *words, "-o", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert "Traceback" not in said


@pytest.mark.parametrize(("name", "value", "said"), [
    ("drawn", True, "--drawn"), ("made", Path("some", "place", "made"), "--made made"), ("subject", "S3", "--subject S3"),
])
def test_a_command_is_reported_without_the_readers_folders(name, value, said):
    assert runner._flag(name, value) == said


def test_humaneva_is_asked_for_the_papers_trials(tmp_path, monkeypatch):
    asked = []

    def read(folder, subject, action):
        asked.append((folder, subject, action))
        return SimpleNamespace(recording=SimpleNamespace(name=f"{subject}_{action}_1"))

    monkeypatch.setattr("shadowpuppet.io.humaneva.read_humaneva", read)
    monkeypatch.setattr("shadowpuppet.io.humaneva.write_humaneva", lambda found, folder: folder.mkdir(parents=True))
    found = inputs.sources(Request(tmp_path, more={"humaneva": tmp_path / "data", "subject": "S2"}))
    assert asked == [(tmp_path / "data", "S2", action) for action in ("Walking", "Jog", "Box")]
    assert [inputs.motion_of(source.name) for source in found] == ["walking", "jogging", "boxing"]


def test_made_recordings_are_made_where_they_are_missing(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(inputs, "synthesize", lambda spec, folder: made.append((spec.name, folder)))
    inputs.sources(Request(tmp_path, tell=lambda line: None))
    assert made == [(spec.name, tmp_path / "made" / spec.name) for spec in humaneva()]
    for spec in humaneva()[:2]:
        folder = tmp_path / "made" / spec.name
        (folder / "masks").mkdir(parents=True)
        (folder / "truth.csv").touch()
        for view in spec.views():
            (folder / "masks" / f"{view.name}.mkv").touch()
    made.clear()
    inputs.sources(Request(tmp_path, tell=lambda line: None))
    assert [name for name, _ in made] == ["humaneva_boxing"]


# Errors


def still(case: inputs.Case, poses: np.ndarray) -> tracks.Track:
    return tracks.Track(poses, np.full(len(poses), 0.01), np.ones(len(poses)))


def test_the_true_poses_have_the_skeletons_error_and_no_other(case):
    found = measures.errors(case, still(case, case.true_poses))
    assert 0 < found.rmse < 25
    assert found.angles == found.firm == found.off == 0
    assert not found.lost
    assert found.rmse == pytest.approx(np.sqrt((found.by_frame**2).mean()))


def test_whole_turns_are_none_and_shifts_are_lost(case):
    poses, skeleton = case.true_poses.copy(), case.body.skeleton
    poses[:, skeleton.dof_indices(["left_shoulder_twist"])] += 2 * np.pi
    assert measures.errors(case, still(case, poses)).angles == pytest.approx(0, abs=1e-9)
    poses = case.true_poses.copy()
    poses[:, skeleton.dof_indices(["right_knee_flexion"])] += np.radians(8)
    turned = measures.errors(case, still(case, poses))
    assert turned.angles == pytest.approx(8 / np.sqrt(len(measures.ANGLES)))
    assert turned.firm > turned.angles  # twists are fewer than all
    frames = len(poses)
    poses[: frames // 4, skeleton.dof_indices(["root_x"])] += 0.5
    away = measures.errors(case, still(case, poses))
    assert away.lost
    assert away.off == pytest.approx(frames // 4 / frames)


def test_exchanged_legs_are_reported(case):
    poses, skeleton = case.true_poses.copy(), case.body.skeleton
    left, right = (skeleton.dof_indices([name for name in skeleton.dof_names if name.startswith((f"{side}_hip", f"{side}_knee"))])
                   for side in ("left", "right"))
    assert measures.errors(case, still(case, poses)).exchanged == 0
    poses[2:5, left], poses[2:5, right] = np.array([-1.2, 0, 0, 0]), np.array([1.2, 0, 0, 0])
    names = [name for name in case.truth.names if name in case.body.landmark_names]  # its feet are one point
    strides = replace(case, arrays=case.arrays | {"truth": case.body.points(poses, names=names), "joint_names": np.array(names)})
    again = poses.copy()
    again[2:4, left], again[2:4, right] = poses[2:4, right], poses[2:4, left]
    assert measures.errors(strides, still(strides, again)).exchanged == pytest.approx(2 / len(poses))


def test_frames_without_a_truth_do_not_count(case):
    truth = case.arrays["truth"].copy()
    truth[3, case.truth.names.index("left_elbow")] = np.nan
    gap = replace(case, arrays=case.arrays | {"truth": truth})
    found = measures.errors(gap, still(gap, case.true_poses))
    assert np.isnan(found.by_frame[3])
    assert np.isfinite([found.rmse, found.off]).all()
    poses = case.true_poses + 1.0 * np.array([name == "root_x" for name in case.body.skeleton.dof_names])
    assert measures.errors(gap, still(gap, poses)).off == 1  # of the frames whose truth is known


# Methods


def test_the_methods_are_those_of_table_ii():
    values = {way.name: make_multiview_settings("ni2008", way.settings) for way in (tracks.HYBRID, tracks.IMAGE_FORCE, tracks.ALONE)}
    values["particle filter"] = make_multiview_settings("ni2008", tracks.particle_filter().settings)
    assert [each.method for each in values.values()] == ["hybrid", "image_force", "image_force", "particle_filter"]
    assert (values["hybrid"].particles, values["particle filter"].particles) == (40, 1000)
    force = values["image force"].forces
    assert not force.modulated
    assert not force.robust
    assert force.hierarchical
    assert not values[tracks.ALONE.name].forces.hierarchical
    assert tracks.REGIONS == 20
    assert tracks.DIMENSIONS == 3


def test_all_methods_begin_alike_and_again_the_same(case):
    short = replace(case, arrays=case.arrays | {"times": case.times[:2], "ends": case.arrays["ends"][:3]})
    ways = (tracks.HYBRID, tracks.IMAGE_FORCE, tracks.particle_filter(50))
    found = [tracks.follow(short, way, 1) for way in ways]
    for one in found[1:]:
        np.testing.assert_array_equal(one.poses[0], found[0].poses[0])
    np.testing.assert_array_equal(tracks.follow(short, ways[0], 1).poses, found[0].poses)
    assert not np.array_equal(tracks.follow(short, ways[0], 2).poses[1], found[0].poses[1])


# Claims are computed


def errors(rmse: float, off: float = 0.0) -> measures.Errors:
    return measures.Errors(rmse, np.full(4, rmse), rmse / 5, rmse / 5, off)


def answers(verdicts) -> list[bool | None]:
    return [verdict.same for verdict in verdicts]


def runs(way: tracks.Way, values: list[float], off: float = 0.0, pace: float = 0.01) -> table_2.Runs:
    track = tracks.Track(np.zeros((4, 1)), np.full(4, pace), np.ones(4))
    return table_2.Runs(SimpleNamespace(), way, [track] * len(values), [errors(value, off) for value in values])


def paper_like() -> dict[tuple[str, str], table_2.Runs]:
    """Runs that agree with the paper throughout."""
    found = {}
    for motion, lost in (("walking", 0.0), ("jogging", 0.9), ("boxing", 0.9)):
        found[motion, "hybrid"] = runs(tracks.HYBRID, [10.0, 10.5, 11.0], pace=0.015)
        found[motion, "image force"] = runs(tracks.IMAGE_FORCE, [600.0, 601.0, 602.0] if lost else [15.0, 15.5, 16.0], lost, pace=0.003)
        found[motion, tracks.ALONE.name] = runs(tracks.ALONE, [500.0] * 3, 1.0)
        found[motion, "particle filter"] = runs(tracks.particle_filter(), [40.0, 41.0, 42.0], pace=0.25)
    return found


@pytest.mark.parametrize(("key", "other", "which", "expected"), [
    (None, None, None, None),
    (("boxing", "hybrid"), runs(tracks.HYBRID, [40.0, 41.0, 42.5]), 0, None),  # as good as the particle filter: not told apart
    (("boxing", "hybrid"), runs(tracks.HYBRID, [80.0, 81.0, 82.0]), 0, False),
    (("jogging", "image force"), runs(tracks.IMAGE_FORCE, [30.0, 31.0, 32.0], pace=0.003), 1, False),
    (("walking", "image force"), runs(tracks.IMAGE_FORCE, [50.0, 51.0, 52.0], pace=0.003), 2, False),
    (("walking", "hybrid"), runs(tracks.HYBRID, [9.0, 9.5, 9.7], off=0.3, pace=0.015), 3, False),
    (("boxing", "particle filter"), runs(tracks.particle_filter(), [40.0, 41.0, 42.0], off=0.3, pace=0.25), 4, False),
    (("boxing", "particle filter"), runs(tracks.particle_filter(), [40.0, 41.0, 42.0], pace=0.01), 5, False),
])
def test_table_ii_is_judged_by_its_runs(key, other, which, expected):
    found = paper_like()
    if key is None:
        assert answers(table_2.verdicts(found)) == [True] * 6
        return
    found[key] = other
    assert answers(table_2.verdicts(found))[which] is expected


@pytest.mark.parametrize(("values", "expected"), [
    ({5: (30, 31), 10: (20, 21), 20: (20, 21), 80: (20, 21)}, [True, True, True]),
    ({5: (20, 21), 10: (20, 21), 20: (20, 21), 80: (20, 21)}, [None, True, True]),
    ({5: (15, 15.1), 10: (20, 21), 20: (20, 21), 80: (20, 21)}, [False, True, False]),
    ({5: (30, 31), 10: (20, 21), 20: (20, 21), 80: (10, 11)}, [True, False, False]),
    ({5: (30, 31), 40: (20, 21)}, [None, None, None]),
    ({5: (30, 31), 10: (20, 21), 20: (20, 21), 40: (20, 60), 80: (20, 21)}, [True, False, True]),
])
def test_fig_8_is_judged_by_its_curve(values, expected):
    curve = {M: [errors(value) for value in each] for M, each in values.items()}
    assert answers(figure_8.verdicts({"walking": curve})) == expected


@pytest.mark.parametrize(("training", "expected"), [
    ([4.0, 0.4, 0.1], [True, True]),
    ([4.0, 2.0, 0.1], [False, False]),
    ([1.5, 0.9, 0.0], [True, False]),
])
def test_fig_4_is_judged_by_its_curve(training, expected):
    curve = figure_4.Curve([5, 20, 80], np.array([training] * 2), np.array([[5.0, 3.0, 4.0]] * 2), 10.0)
    assert answers(figure_4.verdicts({"walking": curve})) == expected
    assert "least with M = 20 (3.0°)" in figure_4.said("walking", curve)


def test_figs_6_and_7_and_the_particles_are_judged():
    true = np.sin(np.linspace(0, 6, 50)) * 30
    good, turned = figure_6.Angle("walking", "a", true, true + 3), figure_6.Angle("walking", "a", true, true[::-1])
    assert figure_6.follows([good]).same
    assert not figure_6.follows([good, turned]).same
    level = {motion: [errors(20), errors(21)] for motion in ("walking", "jogging", "boxing")}
    assert figure_7.harder(level).same is None
    assert figure_7.harder(level | {"jogging": [errors(30), errors(31)], "boxing": [errors(40), errors(41)]}).same
    assert figure_7.harder(level | {"jogging": [errors(30), errors(31)], "boxing": [errors(10), errors(11)]}).same is False
    curve = {("hybrid", 40): [errors(10)], ("particle filter", 1000): [errors(40)], ("particle filter", 10_000): [errors(11)]}
    assert answers(particles.verdicts({"walking": curve}, 10_000)) == [True, True]
    assert answers(particles.verdicts({"walking": curve | {("particle filter", 10_000): [errors(30)]}}, 10_000)) == [True, False]
    assert answers(particles.verdicts({"walking": curve | {("particle filter", 1000): [errors(9)]}}, 1000)) == [False, None]


# The model


def test_the_model_is_the_papers(out):
    parts = read_rows(out, "figure_1")
    assert [row["part"] for row in parts] == list(models.PARTS)
    assert sum(len(row["degrees_of_freedom"].split()) for row in parts) == 25
    assert float(parts[0]["radius_x_m"]) != float(parts[0]["radius_y_m"])  # the torso is elliptic
    assert all(row["radius_x_m"] == row["radius_y_m"] for row in parts[1:])
    feels = {row["part"]: row["feels_forces_on"] for row in read_rows(out, "figure_3")}
    assert feels["torso"] == "all"
    assert feels["right_upper_arm"] == "1 + 2"  # eq. 40
    assert feels["left_lower_leg"] == "8"


def test_the_force_points_at_the_scene_point_and_is_bounded(out):
    P, foot, c, F, M = (np.array([float(row[axis]) for axis in "xyz"]) for row in read_rows(out, "figure_2"))
    away = (P - foot) / np.linalg.norm(P - foot)
    np.testing.assert_allclose(F, away * make_multiview_settings("ni2008").surface.tau, atol=1e-3)
    np.testing.assert_allclose(M, np.cross(foot - c, F), atol=1e-3)
