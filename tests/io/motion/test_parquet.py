"""Joints in columns and arrays, Parquet and NPZ: round trips, an independent reading, files that are damaged or of another kind."""

from __future__ import annotations

import io
import sys

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import runs
from damage import told_or_read

from shadowpuppet.body.models import MODELS
from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.motion.npz import read_npz, write_npz
from shadowpuppet.io.motion.parquet import read_parquet, write_parquet
from shadowpuppet.io.motion.table import TRANSLATIONS, motion_columns, read_joints, table_columns, write_columns
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.motion import JointTable, Motion

ENDINGS = ("parquet", "npz")


@pytest.fixture
def motion(tmp_path) -> Motion:
    return read_run(runs.make_run(tmp_path / "run", "rounded", lost=(2, 3), spread=True, doubtful={5: {"left_arm": "predicted"}})).motion


def table(rng) -> JointTable:
    made = JointTable(np.arange(9) / 30, ("neck", "left hand, base"), rng.uniform(-2, 2, (9, 2, 3)))
    made.positions[4, 1] = np.nan
    return made


def write(path, joints: JointTable) -> None:
    write_npz(path, joints) if path.suffix == ".npz" else write_parquet(path, table_columns(joints))


def read(path) -> JointTable:
    return read_npz(path) if path.suffix == ".npz" else read_parquet(path)


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_written_is_read(tmp_path, ending, rng):
    path = tmp_path / f"a.{ending}"
    for joints in (table(rng), JointTable(np.zeros(0), ("neck",), np.zeros((0, 1, 3)))):
        write(path, joints)
        found = read(path)
        assert found.names == joints.names
        np.testing.assert_array_equal(found.times, joints.times)
        np.testing.assert_array_equal(found.positions, joints.positions)


def test_a_run_as_columns_has_everything_with_units_in_the_names_and_nulls_in_gaps(tmp_path, motion):
    write_parquet(tmp_path / "a.parquet", motion_columns(motion))
    found = pyarrow.parquet.read_table(tmp_path / "a.parquet")
    assert found.column("status").to_pylist() == motion.status.tolist()
    for limb, status in zip(motion.limbs, motion.limb_status.T):
        assert found.column(f"{limb}_status").to_pylist() == status.tolist()
    assert found.column("left_arm_status").to_pylist()[2:6] == ["lost", "lost", "tracked", "predicted"]
    assert found.column("neck_x").null_count == 2
    np.testing.assert_array_equal(found.column("neck_sd_z").to_numpy(), motion.joint_sd[:, motion.joint_names.index("neck"), 2])
    np.testing.assert_array_equal(found.column("torso_y [m]").to_numpy(), motion.poses[:, motion.dof_names.index("torso_y")])
    assert "left_elbow_flexion [rad]" in found.column_names
    assert "left_elbow_flexion_sd [rad]" not in found.column_names  # none is known
    assert b"metres in the world" in found.schema.metadata[b"units"]
    np.testing.assert_array_equal(read_parquet(tmp_path / "a.parquet").positions, motion.joints)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_degrees_of_freedom_that_are_places_are_known_as_such(name):
    dofs = runs.body_of(name).skeleton.dofs
    assert {dof.name for dof in dofs if dof.kind == "translation"} == {dof.name for dof in dofs} & set(TRANSLATIONS)


@pytest.mark.parametrize("name", ["rounded", "anatomical"])
def test_the_same_columns_as_a_csv_are_a_table_of_joints(tmp_path, name):
    motion = read_run(runs.make_run(tmp_path / "run", name, lost=(2,), spread=True)).motion
    write_columns(tmp_path / "a.csv", motion_columns(motion))
    found = read_joints(tmp_path / "a.csv")
    assert found.names == motion.joint_names
    np.testing.assert_allclose(found.positions, motion.joints, atol=6e-7)


def test_a_runs_own_archive_is_read(tmp_path, motion):
    np.testing.assert_array_equal(read_npz(tmp_path / "run" / "motion.npz").positions, motion.joints)


def test_without_pyarrow_a_sentence_says_what_to_install(tmp_path, monkeypatch, rng):
    write(tmp_path / "a.parquet", table(rng))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for call in (lambda: read(tmp_path / "a.parquet"), lambda: write(tmp_path / "b.parquet", table(rng))):
        with pytest.raises(ShadowPuppetError, match=r"\.parquet: Parquet needs pyarrow, which is not installed: .*pip install"):
            call()


@pytest.mark.parametrize("ending", ENDINGS)
def test_damaged_files_are_read_or_told(tmp_path, ending, rng):
    write(tmp_path / f"whole.{ending}", table(rng))
    whole = (tmp_path / f"whole.{ending}").read_bytes()
    path = tmp_path / f"a.{ending}"
    for n in range(60):
        data = bytearray(whole)
        if n % 3 == 0:
            data = data[: rng.integers(0, len(data))]
        for place in rng.integers(0, len(data), 4) if len(data) and n % 3 else ():
            data[place] = rng.integers(256)
        path.write_bytes(bytes(data))
        assert told_or_read(lambda: read(path), f"a.{ending}"), n


def columns(**arrays) -> bytes:
    out = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(arrays), out)
    return out.getvalue()


@pytest.mark.parametrize(("content", "said"), [
    (columns(neck_x=[0.0], neck_y=[0.0], neck_z=[0.0]), "no column 'time'"),
    (columns(time=[0.0], neck_x=[0.0], neck_y=[0.0]), "no column 'neck_z'"),
    (columns(time=[0.0], words=["a"]), "no joints"),
    (columns(time=[0.0], neck_x=["a"], neck_y=[0.0], neck_z=[0.0]), "no Parquet table of joints"),
    (columns(time=[0.1, 0.1], neck_x=[0.0] * 2, neck_y=[0.0] * 2, neck_z=[0.0] * 2), "times: found"),
    (b"", "no Parquet table of joints"),
    (b"time,neck_x\n", "no Parquet table of joints"),
])
def test_parquet_of_another_kind_is_said(tmp_path, content, said):
    (tmp_path / "a.parquet").write_bytes(content)
    with pytest.raises(FormatError, match=rf"a\.parquet: {said}"):
        read_parquet(tmp_path / "a.parquet")


@pytest.mark.parametrize(("arrays", "said"), [
    ({"times": [0.0]}, "no array 'joint_names'"),
    ({"times": [0.0], "joint_names": ["neck"], "joints": np.zeros((1, 2, 3))}, "positions: found shape"),
    ({"times": [[0.0]], "joint_names": ["neck"], "joints": np.zeros((1, 1, 3))}, "times: found"),
    ({"times": [0.0], "joint_names": [object()], "joints": np.zeros((1, 1, 3))}, "found python objects in an array"),
])
def test_archives_of_another_kind_are_said(tmp_path, arrays, said):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(FormatError, match=rf"a\.npz: no joints \({said}"):
        read_npz(tmp_path / "a.npz")
    with pytest.raises(FormatError, match=r"b\.npz: no joints"):
        read_npz(tmp_path / "b.npz")
