"""The manual's table of what is used of motion files is that of the readers."""

from __future__ import annotations

import re
from pathlib import Path

from shadowpuppet.io.motion import asf, motion_files, npz, trc

PAGE = (Path(__file__).parents[3] / "docs" / "formats.md").read_text("utf-8")
ROWS = {cells[1].strip(): [re.findall("`:?([^`]+)`", cell) for cell in cells[2:4]]
        for cells in (line.split("|") for line in PAGE.partition("What of a file is used")[2].partition("- **")[0].splitlines())
        if len(cells) > 3 and not cells[1].startswith("-")}  # fmt: skip


def test_every_format_and_masks_have_a_row():
    named = " ".join(ROWS).replace(",", "").lower().split()
    assert {suffix.removeprefix(".") for suffix in motion_files.READERS} | {"bvh", "asf", "amc", "masks"} <= set(named)


def test_the_keys_of_headers_are_listed_once():
    used, unused = ROWS["TRC"]
    assert {*used, *unused} == {*trc.KEYS}
    assert set(used) & set(unused) == set()
    used, unused = ROWS["ASF, AMC"]
    assert {*asf.SECTIONS} <= {*used, *unused}
    assert set(npz.JOINT_ARRAYS) <= set(ROWS["CSV, Parquet, NPZ"][0])
