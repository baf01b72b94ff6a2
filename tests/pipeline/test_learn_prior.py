"""`shadowpuppet fit-prior` as a user types it."""

from __future__ import annotations

import numpy as np
import pytest
from movers import walk
from vicon import c3d

from shadowpuppet.cli.app import run
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.prior import read_prior, write_prior
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.learn_prior import familiar
from shadowpuppet.pipeline.options import make_options, plain_options, read_options


@pytest.fixture(scope="module")
def motions(tmp_path_factory):
    """Two files of a walk, of other formats and rates."""
    folder = tmp_path_factory.mktemp("motions")
    table, _ = walk(50)
    write_joints(folder / "walk.csv", table)
    other, _ = walk(30, 30.0, height=1.6)
    (folder / "walk.c3d").write_bytes(c3d(other.names, 1000 * other.positions, rate=30.0))
    return folder


def refused(capsys, *words) -> str:
    assert run([str(word) for word in words]) == 2
    said = capsys.readouterr().err
    assert "\n" not in said.strip()
    return said


def test_a_prior_is_learnt_from_several_files(motions, tmp_path, capsys):
    file = tmp_path / "walk.npz"
    assert run(["fit-prior", *map(str, (motions / "walk.csv", motions / "walk.c3d")), "-o", str(file), "--regions", "5", "--mirrored",
                "--dimensions", "2", "--rate", "50"]) == 0
    shown = capsys.readouterr().out
    prior = read_prior(file)
    assert (len(prior.subspaces), prior.subspaces.dimensions, prior.rate, len(prior.names)) == (5, 2, 50.0, 28)
    assert "walk.c3d, mirrored" in shown
    assert "5 regions of 2 dimensions; 28 degrees of freedom, 50 frames/s" in shown
    assert "mm at the joints" in shown
    assert f"--prior{file}" in "".join(shown.split())  # long paths are broken


def test_the_number_of_regions_can_be_chosen(motions, tmp_path, capsys):
    assert run(["fit-prior", str(motions / "walk.csv"), "-o", str(tmp_path / "a.npz"), "--regions", "choose", "--starts", "1"]) == 0
    shown = capsys.readouterr().out
    assert "left out" in shown
    assert f"{len(read_prior(tmp_path / 'a.npz').subspaces)} regions" in shown


def test_mistakes_are_said(motions, tmp_path, capsys):
    walk_csv, out = motions / "walk.csv", tmp_path / "p.npz"
    assert "expected .npz" in refused(capsys, "fit-prior", walk_csv, "-o", tmp_path / "p.pkl")
    assert "no such folder" in refused(capsys, "fit-prior", walk_csv, "-o", tmp_path / "nowhere" / "p.npz")
    assert "found it twice" in refused(capsys, "fit-prior", walk_csv, walk_csv, "-o", out)
    assert "regions: found 'many', expected a number or choose" in refused(capsys, "fit-prior", walk_csv, "--regions", "many", "-o", out)
    assert "regions: found 0" in refused(capsys, "fit-prior", walk_csv, "--regions", "0", "-o", out)
    assert "expected 300 or more for 300 regions" in refused(capsys, "fit-prior", walk_csv, "--regions", "300", "-o", out)
    assert "found the ending '.mp4'" in refused(capsys, "fit-prior", tmp_path / "film.mp4", "-o", out)
    assert "rate: found 0" in refused(capsys, "fit-prior", walk_csv, "--rate", "0", "-o", out)
    table, _ = walk(30)
    write_joints(tmp_path / "arms.trc", table.select(["left_shoulder", "left_elbow"]))
    assert "arms.trc: no joint" in refused(capsys, "fit-prior", tmp_path / "arms.trc", "-o", out)
    swapped = tuple(name.replace("left", "x").replace("right", "left").replace("x", "right") for name in table.names)
    write_joints(tmp_path / "swapped.trc", JointTable(table.times, swapped, table.positions))
    assert "swapped.trc: " in refused(capsys, "fit-prior", tmp_path / "swapped.trc", "-o", out)
    write_joints(tmp_path / "gaps.trc", JointTable(table.times, table.names, np.full_like(table.positions, np.nan)))
    assert "gaps.trc: " in refused(capsys, "fit-prior", tmp_path / "gaps.trc", "-o", out)
    assert not out.exists()


def test_a_run_is_reported_of_a_prior_and_how_to_learn(tmp_path):
    (tmp_path / "mine.toml").write_text('prior = "walk.npz"\n[training]\nregions = 7\nmirrored = true\n')
    options = make_options(read_options(tmp_path / "mine.toml"))
    assert options.prior == tmp_path / "walk.npz"
    assert (options.training.regions, options.training.mirrored, options.training.dofs) == (7, True, "articulation")
    assert make_options(plain_options(options)) == options


def test_a_run_takes_the_prior_that_is_given_or_learns_one(motions, tmp_path):
    training = read_motion(motions / "walk.csv")
    learnt = familiar(np.random.default_rng(0), make_options({"training": {"regions": 8}}), training, "anatomical", 30.0)
    assert learnt.prior is not None
    assert (len(learnt.prior.subspaces), learnt.prior.rate, learnt.poses.shape) == (8, 30.0, (25, 32))
    write_prior(tmp_path / "walk.npz", learnt.prior)
    options = make_options({"prior": str(tmp_path / "walk.npz")})
    given = familiar(np.random.default_rng(0), options, training, "anatomical", 60.0)
    assert given.prior is not None
    assert given.prior.rate == 60.0
    assert given.poses.shape == (50, 32)
    assert given.sizes.thigh_length == pytest.approx(learnt.sizes.thigh_length, abs=1e-3)
    alone = familiar(np.random.default_rng(0), options, None, "anatomical", 60.0)
    np.testing.assert_array_equal(alone.prior.transitions, given.prior.transitions)
    assert (alone.sizes, alone.poses.shape) == (None, (0, 32))
    assert familiar(np.random.default_rng(0), make_options({}), None, "cylinders", 60.0).prior is None
    with pytest.raises(ShadowPuppetError, match=r"walk\.npz: prior: found 'chest_x' among what it models"):
        familiar(np.random.default_rng(0), options, None, "cylinders", 60.0)
    with pytest.raises(ShadowPuppetError, match=r"training\.csv: no joint left_shoulder"):
        familiar(np.random.default_rng(0), make_options({}), training.select(["pelvis"]), "anatomical", 60.0, "training.csv")


@pytest.mark.shared
def test_motion_capture_of_another_person(shared, tmp_path, capsys):
    assert run(["fit-prior", str(shared / "mocap" / "03_01.amc"), str(shared / "recordings" / "walking" / "training.trc"), "-o",
                str(tmp_path / "p.npz")]) == 0
    assert "2 dimensions" not in capsys.readouterr().out
    assert read_prior(tmp_path / "p.npz").rate == 60.0
