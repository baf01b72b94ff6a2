"""What is measured is the same thing on both sides, in turns; guards on the ratios; where figures go."""

from __future__ import annotations

import json
import math

import made
import numpy as np
import pytest
from people import random_poses

from shadowpuppet.camera import rasterize
from shadowpuppet.cli import app as cli
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.bench import chain, mono, multi, naive_mono, run
from shadowpuppet.evaluation.bench.mono_cases import MonoCase, MonoFollower
from shadowpuppet.evaluation.bench.multi_cases import MultiCase
from shadowpuppet.evaluation.bench.opencv import OpenCV
from shadowpuppet.evaluation.bench.run import check_writable, write_figures
from shadowpuppet.evaluation.bench.timing import Contender, Times, in_turns
from shadowpuppet.threads import one_opencv_thread
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs

ISSUED = ("particle_us", "arm_us", "ratio_opencv_full", "ratio_opencv_arm", "ratio_naive_frame", "ratio_boxes", "step_fps", "default_fps",
          "chain_fps", "peak_mb", "growth_mb")
ISSUED_MULTI = ("hull_ms", "points", "force_us", "gauss_newton_us", "forces_fps", "fps", "chain_fps", "ratio_naive", "peak_mb")
compiled = pytest.mark.skipif(not hasattr(rasterize._compare, "signatures"), reason="kernels are not compiled")


# The same on both sides -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", ["cardbox", "boxes"])
def test_the_naive_filter_has_the_kernels_costs(body, rng):
    case = MonoCase(body)
    poses = random_poses(rng, case.picture.body.skeleton, 8) * 0.5
    every = np.arange(len(case.picture.body.parts))
    found = [naive_mono.cost(case.picture, pose, every, case.mask) for pose in poses]
    np.testing.assert_array_equal(found, silhouette_costs(case.picture, Observation.of(case.mask), poses))


@pytest.mark.parametrize("name", ["torso", "left_arm"])
def test_the_naive_filter_draws_what_a_stage_draws(name, rng):
    case, settings = MonoCase(), make_settings("liu2011")
    stage = FilterStage(case.picture, settings, name)
    poses = np.repeat(case.pose[None], 5, axis=0)
    poses[:, stage.dofs] += 0.2 * rng.standard_normal((5, 4))
    shapes = np.concatenate([stage.partial.moving, stage.partial.still])
    found = [naive_mono.cost(case.picture, pose, shapes, case.mask) for pose in poses]
    np.testing.assert_array_equal(found, stage.partial.costs(Observation.of(case.mask), case.pose)(poses))


def test_the_naive_filter_follows(rng):
    case = MonoCase()
    pose = case.picture.body.skeleton.clamp(0.93 * case.pose[None])[0]
    before = naive_mono.cost(case.picture, pose, np.arange(15), case.picture.mask(case.pose))
    after = naive_mono.frame(rng, case.picture, make_settings("liu2011", {"torso_arms": "last"}), pose, case.picture.mask(case.pose), 12)
    assert naive_mono.cost(case.picture, after, np.arange(15), case.picture.mask(case.pose)) < before


@pytest.mark.parametrize("stage", ["full", "arm"])
@pytest.mark.parametrize("body", ["cardbox", "boxes", "rounded"])
def test_opencv_draws_the_same(body, stage):
    case = MonoCase(body, stage, particles=20)
    np.testing.assert_allclose(OpenCV(case).run(), case.run(), atol=900)  # corners at whole pixels, and all of the outline counted
    assert np.ptp(case.run()) > 300


def test_what_is_followed_is_not_lost():
    follower = MonoFollower("liu2011")
    follower.run(60)
    assert follower.state.status == "tracked"


# Times ----------------------------------------------------------------------------------------------------------------


def test_contenders_are_called_in_turns_and_once_before_each_time():
    called: list[str] = []
    found = in_turns({name: Contender(lambda name=name: called.append(name), 4) for name in "ab"}, 3)
    assert "".join(called) == "aabb" * 3
    assert {name: times.rounds for name, times in found.items()} == {"a": 3, "b": 3}
    assert all(0 < times.least <= times.median for times in found.values())


def test_ratios_are_of_the_least_times_and_all_else_of_medians():
    raw = {name: Times(2.0 * k, 1.0 / k, 3) for k, name in enumerate(mono.contenders(), 1)}
    found = mono.FIGURES.of(raw)
    assert found["mono.particle_us"] == 2e6
    assert found["mono.step_fps"] == pytest.approx(1 / 12)
    assert found["mono.ratio_opencv_arm"] == pytest.approx(2 / 5)
    assert found["mono.ratio_naive_frame"] == pytest.approx(6 / 8)


@compiled
@pytest.mark.parametrize(("stage", "margin"), [("full", 5.0), ("arm", 8.0)])
def test_particles_are_many_times_faster_than_by_opencv(stage, margin):
    """Poses to costs, beside OpenCV with its polygons ready-made: 12 and 20 times where AVX-512 is; the guard leaves a margin of two."""
    case = MonoCase(stage=stage)
    with one_opencv_thread():
        spent = in_turns({"bits": Contender(case.run), "OpenCV": Contender(OpenCV(case).run)}, 15)
    assert spent["OpenCV"].least > margin * spent["bits"].least, spent


@compiled
def test_a_frame_is_hundreds_of_times_faster_than_the_naive_one():
    case, paper, settings = MonoCase(), MonoFollower("liu2011"), make_settings("liu2011")
    spent = in_turns({
        "step": Contender(paper.run, 10),
        "naive": Contender(lambda: naive_mono.frame(np.random.default_rng(0), case.picture, settings, case.pose, case.mask, 2), 2 / 200),
    }, 5)  # fmt: skip
    assert spent["naive"].least > 75 * spent["step"].least, spent


# The command ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def tiny(monkeypatch):
    """All that `bench` does, in small."""
    for module in (mono, multi):
        monkeypatch.setattr(module, "QUICK_ROUNDS", 1)
    monkeypatch.setattr(multi, "MultiCase", lambda **said: MultiCase(**{"points": 100, "particles": 3} | said, size=(160, 120)))
    monkeypatch.setattr(multi, "walking", lambda: chain.walking((160, 120), 5))
    monkeypatch.setattr(multi, "QUICK_FRAMES", 24)
    monkeypatch.setattr(mono, "WAVING", made.SPEC)
    monkeypatch.setattr(mono, "QUICK_FRAMES", made.FRAMES)


@pytest.fixture
def forbidden(monkeypatch):
    """No work is begun."""

    def begun(*_):
        raise AssertionError("the work has begun")

    monkeypatch.setattr(run, "run_bench", begun)


def test_the_command_writes_all_figures(tiny, tmp_path, monkeypatch, capsys):
    file = tmp_path / "bench.json"
    for name in ("numpy.py", "coverage.py"):  # what a user's folder holds is not imported by the processes that are started
        (tmp_path / name).write_text("raise SystemExit('a module of the current folder was imported')\n")
    monkeypatch.chdir(tmp_path)
    assert cli.run(["bench", "--quick", "--json", str(file)]) == 0
    found = json.loads(file.read_text())
    for key in ISSUED:
        assert math.isfinite(found[f"mono.{key}"]), key
    for key in ISSUED_MULTI:
        assert math.isfinite(found[f"multi.{key}"]), key
    assert found["mono.chain_frames"] == made.FRAMES
    assert found["multi.chain_frames"] == 24
    assert 20 < found["mono.peak_mb"] < 3000
    assert 20 < found["multi.peak_mb"] < 3000
    assert found["raw"]["particle"]["rounds"] == 1
    assert {"cpu", "cores", "vectors", "numba"} <= set(found["environment"])
    out = capsys.readouterr().out
    for said in ("OpenCV, its polygons ready-made", "frames/s at Table I", "film to pose", "grown by", "seven cameras", "from seven films",
                 "Gauss-Newton, a particle and iteration"):
        assert said in out


@pytest.mark.parametrize(("flag", "name", "said"), [
    ("--json", "none/b.json", "cannot be written (no such file or directory)"), ("--json", ".", "cannot be written (is a directory)"),
])  # fmt: skip
def test_what_cannot_be_written_is_said_before_the_work(forbidden, tmp_path, monkeypatch, capsys, flag, name, said):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["bench", "--quick", flag, name]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"error: {name}: ")
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_is_kept_until_the_new_one_is_whole(tmp_path):
    file = tmp_path / "b.json"
    file.write_text("old")
    check_writable(file)
    assert file.read_text() == "old"
    write_figures(file, {"mono.growth_mb": None})
    assert json.loads(file.read_text()) == {"mono.growth_mb": None}


def test_a_child_that_fails_is_a_sentence(monkeypatch, tmp_path):
    monkeypatch.setattr(chain, "long_recording", lambda spec, folder, frames: tmp_path / "nothing")
    with pytest.raises(ShadowPuppetError, match=r"bench: tracking the made film failed: .*no such recording"):
        chain.measure_chain(chain.WAVING, 5)


# The film ------------------------------------------------------------------------------------------------------------


def test_the_long_film_goes_on_and_on(tmp_path):
    recording = chain.long_recording(chain.WAVING, tmp_path, 75)
    film = next((recording / "video").iterdir())
    assert len(made.images(film)) == 75
    assert not (recording / "masks").exists()
