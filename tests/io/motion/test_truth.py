"""Truth from any file: the same joints by our names, in the world of the file; and what is said where there are none."""

from __future__ import annotations

import warnings
from dataclasses import replace
from importlib.util import find_spec

import biovision
import numpy as np
import pytest
from damage import told_or_read
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from measured import moved, person
from vicon import c3d

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.motion_files import check_unit, names_in, read_truth
from shadowpuppet.io.motion.npz import write_npz
from shadowpuppet.io.motion.parquet import write_parquet
from shadowpuppet.io.motion.table import table_columns, write_joints
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.motion.motion import JointTable

VICON = {"pelvis": "PELO", "neck": "TRXO", "head": "HEDO",
         **{f"{side}_{joint}": side[0].upper() + marker for side in ("left", "right") for joint, marker in
            (("shoulder", "CLO"), ("elbow", "HUO"), ("wrist", "RAO"), ("hip", "FEP"), ("knee", "FEO"), ("ankle", "TIO"))}}  # fmt: skip


def test_the_same_comes_of_every_table_of_joints(tmp_path):
    table = person(0.5).select(list(VICON))
    write_joints(tmp_path / "truth.csv", table)
    write_joints(tmp_path / "truth.trc", moved(table, names=[name.replace("_", " ").title().replace(" ", "") for name in table.names]))
    (tmp_path / "truth.c3d").write_bytes(c3d(list(VICON.values()), 1000 * table.positions, rate=30.0))
    write_npz(tmp_path / "truth.npz", table)
    endings = ["csv", "trc", "c3d", "npz"]
    if find_spec("pyarrow"):
        write_parquet(tmp_path / "truth.parquet", table_columns(table))
        endings.append("parquet")
    for ending in endings:
        read = read_truth(tmp_path / f"truth.{ending}")
        assert set(read.names) == set(table.names)
        np.testing.assert_allclose(read.select(table.names).positions, table.positions, atol=2e-6)
        np.testing.assert_allclose(read.times, table.times, atol=1e-6)


def test_a_world_with_y_up_is_left_as_it_is(tmp_path):
    """Other than motion to learn from, a truth must be in the cameras' world: turning it would hide that it is not."""
    table = person(0.5)
    lying = moved(table)
    lying.positions[:] = lying.positions[..., [0, 2, 1]]
    write_joints(tmp_path / "truth.csv", lying)
    np.testing.assert_allclose(read_truth(tmp_path / "truth.csv").select(table.names).positions, lying.positions, atol=1e-6)


def test_bvh_is_read_with_its_unit(tmp_path):
    (tmp_path / "truth.bvh").write_text(biovision.person(6), "utf-8")
    with pytest.warns(ShadowPuppetWarning, match="centimetres"), pytest.warns(ShadowPuppetWarning, match=r"\+Y points up"):
        table = read_truth(tmp_path / "truth.bvh")
    assert {*LIMB_JOINTS} <= {*table.names}


def test_joints_that_only_the_run_knows_by_that_name_are_kept(tmp_path):
    table = moved(person(0.2, names=("left_knee", "right_knee")), names=("left_knee", "left_thumb"))
    write_joints(tmp_path / "truth.csv", table)
    assert read_truth(tmp_path / "truth.csv").names == ("left_knee",)
    assert read_truth(tmp_path / "truth.csv", ("left_thumb",)).names == ("left_knee", "left_thumb")
    write_joints(tmp_path / "alone.csv", moved(table, names=("left_thumb", "odd")))
    assert read_truth(tmp_path / "alone.csv", ("left_thumb",)).names == ("left_thumb",)


def test_names_that_are_not_known_are_reported_with_what_there_is(tmp_path):
    write_joints(tmp_path / "markers.trc", moved(person(0.2, names=("neck", "head")), names=("LASI", "C7")))
    with pytest.raises(FormatError, match=r"markers\.trc: found no joint of a known name, but LASI, C7; known are ours .* COCO, HALPE_26"):
        read_truth(tmp_path / "markers.trc")
    assert names_in(tmp_path / "markers.trc") == "LASI, C7"
    with pytest.raises(FormatError, match=r"found the ending '\.mp4', expected one of \.amc, \.bvh, \.c3d, \.csv, \.npz, \.parquet, \.trc"):
        read_truth(tmp_path / "film.mp4")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 10**6), what=st.binary(min_size=0, max_size=6), ending=st.sampled_from(["csv", "trc", "c3d"]))
def test_a_damaged_file_is_read_or_refused_in_a_sentence(tmp_path, place, what, ending):
    table = person(0.2).select(list(VICON))
    path = tmp_path / f"truth.{ending}"
    if ending == "c3d":
        path.write_bytes(c3d(list(VICON.values()), 1000 * table.positions, rate=30.0))
    else:
        write_joints(path, table)
    data = path.read_bytes()
    place %= len(data)
    path.write_bytes(data[:place] + what + data[place + max(1, len(what)) :])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)
        assert told_or_read(lambda: read_truth(path), path.name)


@pytest.mark.parametrize(("scale", "match"), [
    (1000, "found a person 1,000 times .* are these mm\\? divide them by 1000"), (100, "found a person 100 times .* are these cm\\?"),
    (0.01, "found a person 0.01 times"),
])  # fmt: skip
def test_a_truth_of_another_unit_is_told_by_the_joints_that_both_have(tmp_path, scale, match):
    names = ("left_shoulder", "left_elbow", "left_wrist", "left_ankle")
    truth = JointTable(np.arange(3.0), names, np.random.default_rng(0).normal(size=(3, 4, 3)))
    run = truth.select(names[:3])
    check_unit(run, truth, tmp_path / "truth.csv")
    with pytest.raises(FormatError, match=match):
        check_unit(run, replace(truth, positions=scale * truth.positions), tmp_path / "truth.csv")
