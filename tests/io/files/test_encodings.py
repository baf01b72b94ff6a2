"""Text is UTF-8, or UTF-16 with its mark, as PowerShell writes it; other encodings are named."""

from __future__ import annotations

import codecs

import numpy as np
import pytest
from memory import memory_of

from shadowpuppet.errors import CalibrationError, FormatError
from shadowpuppet.io.files.text import read_limited, read_text, read_toml
from shadowpuppet.io.motion.motion_files import read_motion

TABLE = "time,neck_x,neck_y,neck_z\r\n0,1,2,3\r\n0.5,1,2,3\r\n"
UTF16 = {"little": (codecs.BOM_UTF16_LE, "utf-16-le"), "big": (codecs.BOM_UTF16_BE, "utf-16-be")}


@pytest.mark.parametrize("order", UTF16)
def test_utf16_with_its_mark_is_read_by_every_reader(tmp_path, order):
    mark, name = UTF16[order]
    (tmp_path / "a.txt").write_bytes(mark + "größe\r\n😀".encode(name))
    (tmp_path / "a.toml").write_bytes(mark + 'name = "größe"\r\n'.encode(name))
    (tmp_path / "a.csv").write_bytes(mark + TABLE.encode(name))
    assert read_text(tmp_path / "a.txt") == "größe\n😀"
    assert read_toml(tmp_path / "a.toml", FormatError) == {"name": "größe"}
    np.testing.assert_array_equal(read_motion(tmp_path / "a.csv").positions, [[[1, 2, 3]], [[1, 2, 3]]])


@pytest.mark.parametrize(("data", "said"), [
    (codecs.BOM_UTF32_LE + "a = 1".encode("utf-32-le"), "found text in UTF-32, expected a TOML file in UTF-8"),
    (codecs.BOM_UTF32_BE + "a = 1".encode("utf-32-be"), "found text in UTF-32, expected a TOML file in UTF-8"),
    *((f"{text}".encode(name), "found text in UTF-16 or UTF-32 without its mark, expected a TOML file in UTF-8")
      for name in ("utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be") for text in ("a = 1", "# größe")),
    (codecs.BOM_UTF16_LE + b"a\0=", "found bytes that are no UTF-16 at position"),
    (codecs.BOM_UTF16_BE + b"\xd8\0\0a", "found bytes that are no UTF-16 at position"),
    ("größe = 1".encode("latin-1"), "found bytes that are no text at position 2"),
])  # fmt: skip
def test_other_encodings_are_named(tmp_path, data, said):
    (tmp_path / "a.toml").write_bytes(data)
    with pytest.raises(FormatError, match=rf"a\.toml: {said}"):
        read_toml(tmp_path / "a.toml", FormatError)


def test_the_limit_counts_the_bytes_of_the_file(tmp_path):
    (tmp_path / "a.txt").write_text("a" * 50, "utf-16")
    assert len(read_limited(tmp_path / "a.txt", 102, CalibrationError, "a text")) == 50
    with pytest.raises(CalibrationError, match="found 102 bytes, expected a text of at most 101"):
        read_limited(tmp_path / "a.txt", 101, CalibrationError, "a text")


def test_utf16_takes_the_memory_that_a_table_may_take(tmp_path):
    for count in (10, 300_000):
        (tmp_path / f"{count}.csv").write_text("time,a_x,a_y,a_z\n" + "".join(f"{n},1,2,3\n" for n in range(count)), "utf-16")
    large = tmp_path / "300000.csv"
    found = memory_of("from shadowpuppet.io.motion.motion_files import read_motion", "read_motion", large, tmp_path / "10.csv")
    assert found < 10 * large.stat().st_size
