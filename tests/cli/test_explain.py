"""A calibration in words and as a top view, for made figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.calibration.overview import MAP_COLUMNS, CalibrationLook, CameraPlacement
from shadowpuppet.cli.calibration.explain import ARROWS, calibration_table, top_view

CAMERA = CameraPlacement(name="left", size=(640, 480), fov=(55.4, 42.0), lens="distorted", bend=-12.4, place=(-1.5, 2.25, 1.0), facing=0.0,
                         down=10.2, roll=-3.4, away=2.5, placed=True)  # fmt: skip
EMPTY = tuple((0,) * MAP_COLUMNS for _ in range(MAP_COLUMNS // 2))


def look(*cameras: CameraPlacement, **more) -> CalibrationLook:
    plain = CalibrationLook(path="lab.toml", format="pose2sim", unit="m", unit_told=True, cameras=cameras, apart=(1.0, 2.5),
                            middle=(0.0, 0.1, 0.9), corners=(-4.0, -4.0, 4.0, 4.0), seen=EMPTY, notes=(), doubts=())  # fmt: skip
    return replace(plain, **more)


def test_a_calibration_in_words(printed):
    other = replace(CAMERA, name="right", lens="fisheye", bend=float("inf"), down=-0.6, roll=0.6, away=3.0, place=(1.5, 2.0, 1.0))
    level = replace(CAMERA, name="top", lens="pinhole", bend=0.0, down=0.4, away=None, placed=False)
    seen = ((0,) * 47 + (2,), (3,) * 2 + (0,) * 46, *EMPTY[2:])
    lines = printed(calibration_table(look(CAMERA, other, level, seen=seen, notes=("a remark", "another"))))
    assert lines[:4] == ["calibration lab.toml", "format pose2sim; lengths in m", "cameras 3 cameras, 1.00 to 2.50 m apart",
                         "they look at 0.00 0.10 0.90 m, from 2.50 to 3.00 m away"]
    assert [line for line in lines if "640x480" in line] == [
        "A left 640x480 55° -1.50 2.25 1.00 10° down -3° 2.50 m -12 px",
        "B right 640x480 55° 1.50 2.00 1.00 1° up 1° 3.00 m beyond telling, fisheye",
        "C top 640x480 55° not known level -3° not at all",
    ]
    assert lines[-5:] == [
        "from above 8.0 m to a side, x to the right from -4.0 to 4.0, y up from -4.0 to 4.0; letters are cameras with arrows the way they "
        "look, × the place they look at",
        "figures how many cameras see a person of 1.80 m whole who stands there: 3 over 0.1 m²", "", "read a remark", "another",
    ]
    one = printed(calibration_table(look(replace(CAMERA, placed=False), apart=None, middle=None, unit_told=False)))
    assert one[1:3] == ["format pose2sim; lengths in m, as the file does not say otherwise", "cameras 1 camera"]
    assert not any("from above" in line or "they look at" in line for line in one)
    assert any("no camera sees a person" in line for line in printed(calibration_table(look(CAMERA))))


@pytest.mark.parametrize("facing", [0.0, 22.0, 23.0, 44.0, 90.0, 180.0, -90.0, -22.0, 359.0, 337.0])
def test_arrows_show_where_cameras_look(facing):
    text = top_view(look(replace(CAMERA, facing=facing), middle=None)).plain
    (arrow,) = [character for character in text if character in ARROWS]
    x, y = {"→": (1, 0), "↗": (1, 1), "↑": (0, 1), "↖": (-1, 1), "←": (-1, 0), "↙": (-1, -1), "↓": (0, -1), "↘": (1, -1)}[arrow]
    off = (np.degrees(np.arctan2(y, x)) - facing + 180) % 360 - 180
    assert abs(off) <= 22.5


def test_the_top_view():
    seen = tuple(tuple(row) for row in np.zeros((24, 48), int))
    seen = ((1, 9, 10, *seen[0][3:]), *seen[1:])
    lines = top_view(look(CAMERA, replace(CAMERA, place=(3.99, -3.99, 0.0)), replace(CAMERA, place=(9.0, 0, 0)),
                          replace(CAMERA, place=(0, 0, 0), placed=False), seen=seen)).plain.split("\n")  # fmt: skip
    assert [len(line) for line in lines] == [50] * 24
    assert lines[0].startswith("  19#··")
    assert lines[5][2 + 15 :][:2] == "A→"  # 2.5 of 8 m from the left, 1.75 of 8 from above
    assert lines[11][2 + 24] == "×"
    assert lines[23].endswith("B")
    assert not any("C" in line or "D" in line for line in lines)
