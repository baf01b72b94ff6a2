"""Sizes that files state are checked before they are believed; what is no file is refused; locks."""

from __future__ import annotations

import contextlib
import os
import re
import tracemalloc
import zipfile

import acclaim
import numpy as np
import pytest
from memory import memory_of

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.files import npz
from shadowpuppet.io.files.lock import LOCK, locked
from shadowpuppet.io.files.npz import BrokenArchive, read_arrays
from shadowpuppet.io.files.table import read_table
from shadowpuppet.io.files.text import DEEPEST, read_toml
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.person import read_person
from shadowpuppet.video import open_frames, read_image


def test_an_archive_that_would_unpack_to_too_much_is_not_unpacked(tmp_path, monkeypatch):
    np.savez_compressed(tmp_path / "a.npz", times=np.zeros(10**6), other=np.arange(9))
    monkeypatch.setattr(npz, "UNPACKED", 10**6)
    assert read_arrays(tmp_path / "a.npz", ("other",))["other"].tolist() == list(range(9))
    monkeypatch.setattr(zipfile.ZipFile, "read", lambda *_: pytest.fail("unpacked"))
    with pytest.raises(BrokenArchive, match=r"found 8000128 bytes when unpacked, expected at most 1000000"):
        read_arrays(tmp_path / "a.npz", ("times",))


@pytest.mark.parametrize("shape", [(10**12,), (-1,), (3,), (2**63, 2**63)])
def test_an_array_has_the_size_that_its_header_says(tmp_path, shape):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive, archive.open("times.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": shape})
        member.write(bytes(16))
    with pytest.raises(BrokenArchive, match="found 16 bytes of an array"):
        read_arrays(tmp_path / "a.npz", ("times",))


def test_a_text_has_characters(tmp_path):
    np.savez(tmp_path / "a.npz", names=np.array([0x110000], "<u4").view("<U1"))
    with pytest.raises(BrokenArchive, match="impossible characters"):
        read_arrays(tmp_path / "a.npz", ("names",))


@pytest.mark.parametrize("text", ["a{} = 1", "x = {{a{} = 1}}", "[a{}]", "[[ a{} ]]", "\n\n'b'{} = 1"])
def test_keys_of_toml_are_not_deep(tmp_path, text):
    (tmp_path / "a.toml").write_text(text.format(" . 'a' .\"b\"" * 300))
    with pytest.raises(FormatError, match=rf"a\.toml: line \d: found a key of more than {DEEPEST} parts"):
        read_toml(tmp_path / "a.toml", FormatError)


def test_numbers_and_paths_are_no_keys(tmp_path):
    (tmp_path / "a.toml").write_text(f"a = [{'1.5, ' * 300}]\nb = \"{'../' * 100}\"\n[c.d.e]\n")
    assert len(read_toml(tmp_path / "a.toml", FormatError)["a"]) == 300


def test_joints_without_channels_are_no_way_to_fill_the_memory(tmp_path):
    names = "".join(f"JOINT a{n}\n{{\nOFFSET 0 0 1\nCHANNELS 0\n" for n in range(500))
    head = f"HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n{names}{'}' * 501}\nMOTION\n"
    (tmp_path / "a.bvh").write_text(f"{head}Frames: 9000\nFrame Time: 0.1\n" + "0\n" * 9000)
    with pytest.raises(FormatError, match="found 501 joints in 9000 frames of 1 channels"):
        read_bvh(tmp_path / "a.bvh")


def test_one_long_word_is_not_the_length_of_all(tmp_path):
    acclaim.write(tmp_path)
    path = tmp_path / "01_01.amc"
    path.write_text(re.sub(r"root \S+", f"root {'1' * 100_000}", path.read_text(), count=1))
    tracemalloc.start()
    with contextlib.suppress(FormatError):
        read_motion(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 30 * path.stat().st_size


def test_a_table_of_very_many_columns_is_read_in_a_moment(tmp_path):
    (tmp_path / "a.csv").write_text(f"time,{','.join(f'a{n}' for n in range(300_000))},a7\n")  # minutes, if each is sought in all before
    with pytest.raises(FormatError, match="column 'a7': found it twice"):
        read_table(tmp_path / "a.csv")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in files")
@pytest.mark.parametrize(("name", "read"), [
    ("a.toml", read_person), ("a.toml", read_calibration), ("a.yml", read_calibration), ("a.npz", read_motion), ("a.bvh", read_motion),
    ("a.c3d", read_motion), ("a.csv", read_motion), ("a.mp4", open_frames), ("a.png", open_frames), ("a.png", read_image),
])  # fmt: skip
def test_pipes_and_devices_are_refused(tmp_path, name, read):
    os.mkfifo(tmp_path / name)
    with pytest.raises(ShadowPuppetError, match="is a pipe or a device, expected a file"):
        read(tmp_path / name)


def test_a_parquet_file_of_too_many_rows_is_not_read(tmp_path, monkeypatch):
    arrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    column = arrow.array(np.zeros(10**6))
    parquet.write_table(arrow.table(dict.fromkeys(("time", "a_x", "a_y", "a_z"), column)), tmp_path / "a.parquet", compression="zstd")
    monkeypatch.setattr(npz, "UNPACKED", 10**6)
    monkeypatch.setattr(parquet.ParquetFile, "read", lambda *_: pytest.fail("read"))
    with pytest.raises(FormatError, match=r"found 1000000 rows of 4 columns"):
        read_motion(tmp_path / "a.parquet")


def packed(path, rows, column):
    """A Parquet table of a joint whose columns are alike; its times are counted."""
    arrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    columns = {"time": np.arange(rows, dtype="i4"), **dict.fromkeys(("a_x", "a_y", "a_z"), arrow.array(column))}
    parquet.write_table(arrow.table(columns), path, compression="zstd", use_dictionary=["a_x", "a_y", "a_z"],
                        column_encoding={"time": "DELTA_BINARY_PACKED"})
    return path


@pytest.mark.parametrize("column", [["1" * 9] * 1000, [[1.0] * 9] * 1000])
def test_texts_and_lists_are_no_columns_of_joints_however_often_they_repeat(tmp_path, column):
    with pytest.raises(FormatError, match=r"column 'a_x': found (string|list<.*>), expected numbers"):
        read_motion(packed(tmp_path / "a.parquet", 1000, column))


@pytest.mark.parametrize("rows", [3_900_000, 16_000_000])
def test_a_packed_table_takes_the_memory_that_is_promised(tmp_path, rows):
    """About the most rows that are read, and too many."""
    small, large = (packed(tmp_path / f"{n}.parquet", n, np.zeros(n, "i1")) for n in (10, rows))
    assert large.stat().st_size < 4e6
    found = memory_of("from shadowpuppet.io.motion.motion_files import read_motion", "read_motion", large, small)
    assert found < 500e6 if rows < 4e6 else found < 30e6


def test_few_bytes_a_number_are_no_way_to_fill_the_memory(tmp_path):
    """Joints of one byte a number become eight times as large."""
    for count in (1, 12_000_000):
        arrays = {"times": np.arange(count, dtype="u4"), "joint_names": ["a"], "joints": np.zeros((count, 1, 3), "i1")}
        np.savez_compressed(tmp_path / f"{count}.npz", **arrays)
    with pytest.raises(FormatError, match="found 48000001 numbers, expected at most "):
        read_motion(tmp_path / "12000000.npz")
    imports = "from shadowpuppet.io.motion.motion_files import read_motion"
    assert memory_of(imports, "read_motion", tmp_path / "12000000.npz", tmp_path / "1.npz") < 300e6


def test_a_table_of_many_short_cells_takes_little_memory(tmp_path):
    """As a text of its own every cell would take forty times its place in the file."""
    for count in (10, 1_000_000):
        (tmp_path / f"{count}.csv").write_text("time,a_x,a_y,a_z\n" + "".join(f"{n},1,2,3\n" for n in range(count)))
    large = tmp_path / "1000000.csv"
    found = memory_of("from shadowpuppet.io.motion.motion_files import read_motion", "read_motion", large, tmp_path / "10.csv")
    assert found < 10 * large.stat().st_size


def test_a_lock_is_held_by_one_and_names_it(tmp_path):
    with locked(tmp_path, "run"):
        with pytest.raises(ShadowPuppetError, match=rf"another run at work in it \(process {os.getpid()} on "), locked(tmp_path, "run"):
            pytest.fail("two hold it")
        assert (tmp_path / LOCK).exists()
    assert not (tmp_path / LOCK).exists()
    (tmp_path / LOCK).write_text("process 1 on elsewhere")  # of a process that was killed
    with locked(tmp_path, "run"):
        pass
