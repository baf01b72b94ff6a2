"""The experiments of Liu 2011: the short version of each, as a reader types it; and that what they conclude is computed."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from results import read_rows, read_summary

from papers.common.claims import DEPENDS
from papers.common.experiment import Request
from papers.common.fingerprint import differences, stale
from papers.liu2011 import (
    cardbox_cost,
    figure_5,
    figure_6_7,
    figure_8,
    figure_9,
    frame_rate,
    material,
    particles_sweep,
    repeats,
    selectivity,
    survival_sweep,
    table_1,
    toward_camera,
    true_poses,
)
from papers.liu2011.__main__ import EXPERIMENTS, fingerprint, run
from papers.liu2011.sweeps import Measured
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.tracking.monocular.settings import make_settings

pytestmark = pytest.mark.whole

PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"
SEED = 5
"""Of all runs here: not the default."""


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    """All of them, small, in one process."""
    folder = tmp_path_factory.mktemp("papers") / "liu2011"
    assert run(["all", "--short", "--workers", "1", "--seed", str(SEED), "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def request_(out) -> Request:
    """What was asked, once more."""
    return Request(out, runs=4, seed=SEED, short=True, more={"silhouettes": "practical"})


# As a reader types it


def test_the_page_s_results_are_those_of_today_s_films_and_code(request_):
    assert stale(PAGE, "liu2011", fingerprint(request_)) == ""


def test_a_change_of_the_filter_or_of_the_person_is_another_fingerprint(request_, monkeypatch):
    today = fingerprint(request_)
    seeds = np.random.default_rng
    monkeypatch.setattr(repeats.np.random, "default_rng", lambda seed=None: seeds([2012, 0] if seed == [2011, 0] else seed))
    other = differences(today, fingerprint(request_))
    assert set(other) == {f"{name}: {method}" for name in material.MADE for method in repeats.METHODS}


@pytest.mark.parametrize("name", [experiment.name for experiment in EXPERIMENTS])
def test_each_leaves_pictures_and_data(out, name):
    summary = read_summary(out, name)
    assert summary["command"] == f"python -m papers.liu2011 {name} --short --seed {SEED}"
    assert summary["pictures"] or name in ("table_1", "elbows")
    for picture in summary["pictures"]:
        pixels = np.asarray(Image.open(out / picture).convert("L"), float)
        assert (out / picture).stat().st_size <= 150_000
        assert pixels.std() > 5
    assert all(len(read_rows(out, Path(file).stem)) > 0 for file in summary["data"])


def test_the_claims_that_method_md_lists_are_all_judged(out):
    said = " ".join(claim["claim"] for experiment in EXPERIMENTS for claim in read_summary(out, experiment.name)["claims"])
    for part in ("3D: elbows", "3D: hands", "hand is tracked worse", "10 cm", "stably", "2D error", "varies less", "each of the 12",
                 "throughout", "bow toward", "Arms' motion toward", "e near 0", "e = 1", "15 frames/s", "fewer planes"):  # fmt: skip
        assert part in said


def test_means_are_those_of_the_curves(out):
    rows = read_rows(out, "figure_6_7")
    for side, joint, row in (("left", "elbow", 1), ("right", "fist", 7)):
        curve = np.array([float(each[f"{side}_{joint}_DRS_mm"]) for each in rows])
        assert float(read_rows(out, "figure_6_7_means")[row]["DRS mean, mm"]) == pytest.approx(curve.mean(), abs=0.1)


def test_the_truth_is_far_from_itself_by_nothing(request_):
    case = material.cases(request_)[0]
    truth = case.true_places(("left_hand", "left_wrist"))
    assert truth.shape == (len(case.times), 2, 3)
    assert np.isfinite(truth).all()
    assert 0.02 < np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).mean() < 0.15


def test_runs_are_kept_and_made_again_where_anything_changes(request_):
    case = material.cases(request_)[0]
    first, before = repeats.repeat(request_, case, case.tracker), kept(request_)
    again = repeats.repeat(request_, case, case.tracker)
    assert kept(request_) == before
    assert np.array_equal(first.poses, again.poses)
    other = repeats.repeat(request_, case, replace(case.tracker, explore=7), runs=1)
    assert other.poses.shape[0] == 1
    assert not np.array_equal(other.poses[0], first.poses[0])
    (new,) = kept(request_) - before
    (new / repeats.ESTIMATES).write_bytes(b"PK spoilt")
    with pytest.raises(ShadowPuppetError, match=r"estimates\.npz: cannot be read; remove its folder"):
        repeats.repeat(request_, case, replace(case.tracker, explore=7), runs=1)
    shutil.rmtree(new)
    assert np.array_equal(repeats.repeat(request_, case, replace(case.tracker, explore=7), runs=1).poses, other.poses)


def kept(asked: Request) -> set[Path]:
    """The runs that are there."""
    return set((asked.output / "runs").glob("*/runs/[!.]*"))


def test_runs_do_not_depend_on_workers(request_, tmp_path):
    case = material.cases(request_)[0]
    alone, two = (repeats.repeat(replace(request_, workers=workers, output=tmp_path / str(workers)), case, case.tracker, every=5)
                  for workers in (1, 2))  # fmt: skip
    assert np.array_equal(alone.poses, two.poses)
    assert len(alone.times) == alone.poses.shape[1] == -(-len(case.times) // 5)
    assert len(np.unique(alone.costs.sum(1))) == 4


def test_who_is_lost_is_not_searched_for(request_, monkeypatch):
    """As the paper's filter, and unlike `track`: only the first frame's pose is searched for."""
    case, started = material.cases(request_)[0], []
    start = repeats.MonocularTracker.start
    monkeypatch.setattr(repeats.MonocularTracker, "start", lambda self, rng, mask: (started.append(1), start(self, rng, mask))[1])
    masks = case.masks[:8].copy()
    masks[3:] = np.roll(masks[3:], 60, axis=2)  # far from where the person was
    found = repeats.estimates(replace(case, masks=masks), case.tracker, seed=0)
    assert len(started) == 1
    assert found["overlaps"].min() < repeats.LOST


def test_given_recordings_are_taken_and_need_a_truth_for_3d_errors(out, tmp_path, capsys):
    given = tmp_path / "lab"
    given.symlink_to(out / "recordings" / "three_motions_short", target_is_directory=True)
    assert run(["figure_8", "--short", "--recording", str(given), "-o", str(tmp_path / "out")]) == 0
    assert read_summary(tmp_path / "out", "figure_8")["recordings"] == ["lab"]
    bare = tmp_path / "bare"
    bare.mkdir()
    for path in given.iterdir():
        if not path.name.startswith("truth"):
            (bare / path.name).symlink_to(path)
    assert run(["figure_6_7", "--short", "--runs", "1", "--recording", str(bare), "-o", str(tmp_path / "out")]) == 2
    assert "bare: found no truth, expected truth.csv or truth.trc" in capsys.readouterr().err


@pytest.mark.parametrize(("arguments", "said"), [(["figure_13"], "'figure_13', expected one of figure_1_2, figure_3_4"),
                                                 (["figure_8", "--silhouettes", "best"], "invalid choice: 'best'")])
def test_mistakes_are_reported(arguments, said, capsys):
    with pytest.raises(SystemExit) as ended:
        run(arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


def test_a_recording_that_is_none_is_reported(tmp_path, capsys):
    assert run(["figure_8", "--recording", str(tmp_path / "none"), "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("error: ")


# What is concluded follows from the figures


def errors(drs: float, srs: float, hand: float = 1.5, fist: float = 0.1, runs: int = 6) -> dict[str, np.ndarray]:
    """Errors of elbows so large (m), of hands `hand` times that, of fists `fist` m more; a little other in every run."""
    drawn = 1 + 0.01 * np.linspace(-1, 1, runs)[:, None, None]
    return {name: np.stack([drawn * each * np.ones((runs, 4, 2)) for each in (0.02, value, hand * value, hand * value + fist)], -1)
            for name, value in (("DRS", drs), ("SRS", srs))}  # fmt: skip


def judged(of: dict[str, np.ndarray], overlap: float = 0.9) -> list[bool | None]:
    runs: Any = {"DRS": SimpleNamespace(overlaps=np.full((6, 4), overlap))}
    return [verdict.same for verdict in figure_6_7.verdicts(of, runs, "")]


def test_3d_errors_decide_on_elbows_hands_and_their_order():
    assert judged(errors(0.06, 0.1)) == [True, True, True, True, True]
    assert judged(errors(0.1, 0.06)) == [False, False, True, True, True]
    assert judged(errors(0.1, 0.1))[:2] == [None, None]
    assert judged(errors(0.06, 0.1, hand=0.5)) == [True, True, False, True, True]
    assert judged(errors(0.06, 0.1, fist=0.3))[3] is False
    assert judged(errors(0.25, 0.3))[4] is False
    assert judged(errors(0.06, 0.1), overlap=0.4)[4] is False


def test_gains_are_reported_motion_by_motion():
    case: Any = SimpleNamespace(name="lab", times=np.arange(4.0), parts=(material.Part("wave", 0, 1), material.Part("bow", 2, 3)))
    of = errors(0.06, 0.1)
    of["DRS"][:, 2:] += 0.09
    said = figure_6_7.by_motion(case, of)
    assert said == "Improvement of DRS over SRS for each motion (lab): wave: elbow +40, hand +60 mm; bow: elbow -50, hand -30 mm."


@pytest.mark.parametrize(("drs", "srs", "same"), [(100, 200, True), (200, 100, False), (100, 100, None)])
def test_2d_errors_decide(drs, srs, same):
    costs = 1 + 0.01 * np.linspace(-1, 1, 6)[:, None] * np.ones((6, 5))
    runs: Any = {name: SimpleNamespace(costs=value * costs) for name, value in (("DRS", drs), ("SRS", srs))}
    assert figure_8.verdict(runs, "").same is same


def spread(request: Request, **scales: float) -> list[bool | None]:
    """Verdicts of Fig. 9 where DRS varies half as much as SRS, but for some degrees of freedom, `scales` times as much."""
    case = material.cases(request)[0]
    names = figure_9.names_of(case)
    drawn = np.random.default_rng(0).standard_normal((50, 40, len(names)))
    scale = np.array([scales.get(name, 0.5) for name in names])
    runs: Any = {"DRS": SimpleNamespace(poses=0.1 * drawn * scale), "SRS": SimpleNamespace(poses=0.1 * drawn)}
    return [verdict.same for verdict in figure_9.verdicts(case, runs, "")]


def test_spreads_decide(request_):
    assert spread(request_) == [True, True, True, True]
    assert spread(request_, right_elbow_flexion=2.0) == [True, False, False, True]
    assert spread(request_, left_elbow_flexion=2.0) == [DEPENDS, False, False, True]


def test_frames_in_which_nothing_varies_say_nothing():
    sd = {"DRS": np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]), "SRS": np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.0]])}
    assert figure_9.smaller(sd).tolist() == [0.5, 1.0]


def runs_of(error: float = 50, cost: float = 500, far: float = 1) -> Measured:
    drawn = np.linspace(-1, 1, 6)
    return Measured(error + 0.1 * drawn, cost + drawn, far + 0.05 * drawn, 0 * drawn)


def test_the_survival_sweep_decides():
    def answers(none: Measured, some: Measured, every: Measured) -> list[bool | None]:
        found = {(speed, e): each for speed in (1, 3) for e, each in ((0.0, none), (0.4, runs_of()), (1.0, every), ("Table I", some))}
        return [verdict.same for verdict in survival_sweep.verdicts(found, (0.0, 0.4, 1.0), (1, 3), "")]

    assert answers(runs_of(60, far=9), runs_of(), runs_of(90, 900)) == [True, True, True]
    assert answers(runs_of(40, far=0.1), runs_of(), runs_of(90, 300)) == [False, False, False]
    assert answers(runs_of(), runs_of(), runs_of(90)) == [None, None, None]


def test_the_particles_sweep_decides():
    def answers(most: float, srs: float) -> list[bool | None]:
        found = {("DRS", 200): runs_of(), ("DRS", 3200): runs_of(most), ("SRS", 200): runs_of(cost=srs), ("SRS", 3200): runs_of(cost=400)}
        return [verdict.same for verdict in particles_sweep.verdicts(found, (200, 3200), "")]

    assert answers(45, 700) == [True, True]
    assert answers(30, 450) == [False, False]
    assert answers(45, 500) == [True, None]


def test_selectivity_decides():
    def answers(tuned: float, kept: float, worst: float) -> list[bool | None]:
        readings = {(name, method): runs_of(80 if method == "SRS" else 50) for name in selectivity.READINGS for method in ("DRS", "SRS")}
        readings["no joint limits", "SRS"] = runs_of(worst)
        return [verdict.same for verdict in selectivity.verdicts({"DRS": runs_of(), 1.0: runs_of(80), 0.1: runs_of(tuned)}, readings,
                                                                 (1.0, 0.1), kept, "")]  # fmt: skip

    assert answers(70, 0.9, 80) == [True, True, True]
    assert answers(40, 0.2, 40) == [False, False, False]
    assert answers(50, 0.9, 50) == [True, None, None]


def test_the_frame_rate_decides(request_):
    case = material.cases(request_)[0]
    stages = {"decode": 1.0, "silhouette, eq. 1": 1.0, "filter, 600 particles": 8.0}
    assert frame_rate.verdict(case, stages, "").same is True
    assert "100 frames/s at 160 x 120 from film to pose" in frame_rate.verdict(case, stages, "").got
    assert frame_rate.verdict(case, stages | {"filter, 600 particles": 70.0}, "").same is False


def test_what_is_drawn_faster_decides():
    times = {(body, who, (320, 240)): us for body, us in (("cardbox", 1.0), ("boxes", 2.0)) for who in ("ours", "OpenCV")}
    found = {"cardbox": runs_of(), "boxes": runs_of()}
    assert [verdict.same for verdict in cardbox_cost.verdicts(times, found)] == [True, True]
    times["boxes", "OpenCV", (320, 240)] = 0.9
    assert [verdict.same for verdict in cardbox_cost.verdicts(times, found | {"boxes": runs_of(40)})] == [False, False]
    assert (cardbox_cost.planes("cardbox"), cardbox_cost.planes("boxes")) == (15, 42)


def test_table_1_is_compared(request_, monkeypatch):
    assert [verdict.same for verdict in table_1.make(request_).verdicts] == [True]
    monkeypatch.setattr(table_1, "PAPER", table_1.PAPER | {"e": (0.2, 0.4, 0.3)})
    assert [(verdict.same, verdict.got) for verdict in table_1.make(request_).verdicts] == [(False, "the preset's are others: e")]


def moved(case: material.Case, share: float, noise: float = 0.0) -> Any:
    """Runs in which everything moves `share` times as far toward the camera as in truth."""
    true = case.true_places(toward_camera.joints_of())
    toward = -case.camera.T_camera_world[2, :3]
    depth = (true - true.mean(0)) @ toward
    off = (share - 1) * depth[..., None] * toward
    drawn = noise * np.random.default_rng(0).standard_normal((3, *depth.shape))[..., None] * toward
    return SimpleNamespace(places=lambda names: true + off + drawn)


def test_what_comes_toward_the_camera_is_measured_in_the_cameras_direction(request_):
    bow, reach = material.cases(request_)[0], material.cases(request_, "toward_camera")[0]
    followed = toward_camera.followed(bow, moved(bow, 0.8))
    assert list(followed) == ["neck"]
    assert (followed["neck"].share, followed["neck"].correlation) == pytest.approx((0.8, 1.0))
    assert 0.15 < followed["neck"].reach < 0.6
    both = toward_camera.followed(reach, moved(reach, 1.0))
    assert set(both) == {"left hand", "right hand"}
    assert both["left hand"].error == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("share", "noise", "same"), [(0.8, 0.0, True), (0.3, 0.0, False), (1.8, 0.0, False), (1.0, 0.5, False)])
def test_following_decides(request_, share, noise, same):
    case = material.cases(request_)[0]
    assert [verdict.same for verdict in toward_camera.verdicts(case, moved(case, share, noise), "")] == [same]


def test_the_diagram_of_drs_is_algorithm_4(out):
    ranks = [int(row["drawn_from_rank"]) for row in read_rows(out, "figure_5")]
    survivors = int(figure_5.SURVIVAL * figure_5.NUMBER)
    assert ranks == [*range(1, survivors + 1), *[1] * (figure_5.NUMBER - survivors)]


# Material


def test_made_recordings_have_the_papers_shape():
    spec = material.spec_of("three_motions", short=False)
    assert (spec.views()[0].size, spec.rate) == ((320, 240), 15)
    assert [gesture.motion for gesture in spec.motion] == ["wave_hands", "bend_aside", "bow_forward"]


def test_a_made_recording_is_made_once_and_again_where_the_spec_is_another(request_, monkeypatch):
    made = []
    monkeypatch.setattr(material, "make_recording", lambda spec, folder: made.append(folder))
    quiet = replace(request_, tell=lambda line: None)
    material.made_recording(quiet, "three_motions")
    assert not made
    monkeypatch.setitem(material.MADE, "three_motions", ("wave_hands 5", "wave_hands 2"))
    material.made_recording(quiet, "three_motions")
    assert len(made) == 1


def test_motions_are_named_by_the_spec_else_by_thirds(request_, tmp_path):
    case = material.cases(request_)[0]
    assert [part.name for part in case.parts] == ["wave hands", "bend aside", "bow forward"]
    assert [part.start for part in case.parts] == pytest.approx([0, 3.2, 5.6])
    thirds = material._parts(tmp_path, np.arange(10.0))
    assert [(part.name, part.start, part.end) for part in thirds] == [("first third", 0, 3), ("second third", 3, 6), ("last third", 6, 9)]


def test_methods_change_only_what_they_name():
    settings = make_settings("liu2011")
    assert repeats.with_method(settings, "DRS") == settings
    other = repeats.with_method(settings, "SRS", particles=50)
    assert (other.resampling, other.torso.particles, other.arm.particles, other.arm.survival) == ("stratified", 50, 50, 0.4)
    shared = selectivity.with_share(settings, 0.5)
    assert (shared.torso.sigma_cost, shared.arm.sigma_cost, shared.resampling) == (4000, 2000, "stratified")


def test_a_folder_that_runs_cannot_be_kept_in_is_reported(request_, tmp_path):
    case = material.cases(request_)[0]
    (tmp_path / "runs").write_text("")
    with pytest.raises(ShadowPuppetError, match=r"cannot be written"):
        repeats.repeat(replace(request_, output=tmp_path), case, case.tracker, runs=1)


def test_the_body_at_the_true_joints_is_near_them_and_costs_are_eq_2(request_):
    (case,) = material.cases(request_)
    poses = true_poses.fitted(case)
    names = ("neck", "left_elbow", "right_elbow")
    places = case.picture.points_world(poses)[:, [case.picture.body.landmark_names.index(name) for name in names]]
    assert np.median(np.linalg.norm(places - case.true_places(names), axis=2)) < 0.06
    low, high = case.picture.body.skeleton.limits
    assert ((poses > low - 1e-6) & (poses < high + 1e-6)).all()
    costs = true_poses.costs_at(case, poses)
    differ = case.picture.mask(poses[3]) ^ case.masks[3]
    assert costs[3] == (differ & ~(case.masks[3] & case.picture.legs(poses[3]))).sum()


@pytest.mark.parametrize(("true", "same"), [(400.0, True), (600.0, False)])
def test_costs_of_true_poses_tell_a_poor_search_from_a_poor_shape(true, same):
    runs: Any = SimpleNamespace(costs=np.full((2, 5), 500.0), errors=lambda _: np.full((2, 5, 6), 0.4))
    case: Any = SimpleNamespace(name="lab")
    assert true_poses.verdict(case, runs, np.full(5, true), "").same is same
    near: Any = SimpleNamespace(costs=runs.costs, errors=lambda _: np.full((2, 5, 6), 0.1))
    assert true_poses.verdict(case, near, np.full(5, true), "").same is None
