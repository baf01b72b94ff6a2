"""The command `masks`: a script makes silhouettes in an environment of its own, or a fake uv starts it."""

from __future__ import annotations

import os
import sys

import pytest

from shadowpuppet.io.keypoints.film_keypoints import read_npz
from shadowpuppet.video import open_frames

DARK = '''# /// script
# requires-python = ">=3.11"
# ///
import sys
size = int(sys.argv[2]) * int(sys.argv[3])
while len(data := sys.stdin.buffer.read(3 * size)) == 3 * size:
    sys.stdout.buffer.write(bytes(255 * (value < 60) for value in data[::3]))
'''


pytestmark = pytest.mark.usefixtures("alone")


@pytest.fixture
def dark(home):
    (home / "dark.py").write_text(DARK)
    return home / "dark.py"


def test_the_command_runs_a_script_in_an_environment_and_says_how_to_go_on(shell, two, dark, home):
    done = shell("masks", two, "--with", dark, "--camera", "right")
    assert done.code == 0, done.err
    assert "by dark.py: 5 frames" in done.out
    assert "shadowpuppet track lab-masks --masks --overlay" in done.out
    assert "making the environment of dark.py" in done.err
    masks = [frame.image.mean() for frame in open_frames(home / "lab-masks" / "masks" / "right.mkv", grey=True)]
    assert masks == [255, 255, 0, 0, 0]
    assert not (home / "lab-masks" / "masks" / "left.mkv").exists()


def test_the_command_ends_with_2_if_the_script_fails(shell, two, dark, home):
    dark.write_text(DARK + "sys.exit('too dark')\n")
    done = shell("masks", two, "--with", dark, "-o", "new", "--quiet")
    assert done.code == 2
    assert done.err.startswith("error: dark.py: ")
    assert "failed after 5 masks (exit code 1); its last words: too dark" in done.err
    assert not (home / "new").exists()


def test_the_command_uses_uv_where_it_is(shell, two, dark, home):
    (home / "bin").mkdir()
    uv = home / "bin" / "uv"
    uv.write_text(f'#!/bin/sh\n[ "$1 $2 $3" = "run --no-project --script" ] || exit 9\nshift 3\nexec "{sys.executable}" "$@"\n')
    uv.chmod(0o755)
    done = shell("masks", two, "--with", dark, "-o", two, "--quiet")
    assert done.code == 0, done.err
    assert (two / "masks" / "left.mkv").exists()
    assert not (home / "cache").exists()


def test_the_command_lists_scripts_and_writes_the_template(shell, home):
    assert "mediapipe" in shell("masks", "--list").out
    assert shell("masks", "--template", "mine.py").code == 0
    assert (home / "mine.py").read_text().startswith("# /// script")
    assert "found a file there" in shell("masks", "--template", "mine.py").err
    assert "found no recording" in shell("masks").err


@pytest.mark.skipif("SHADOWPUPPET_TRY_MEDIAPIPE" not in os.environ, reason="downloads a gigabyte: set SHADOWPUPPET_TRY_MEDIAPIPE")
def test_mediapipe_finds_nobody_in_grey_pictures(shell, two, home, monkeypatch):
    monkeypatch.setenv("PATH", os.environ["SHADOWPUPPET_TRY_MEDIAPIPE"])  # where to look for Python 3.12 or uv
    done = shell("masks", two, "-o", home / "new", "--quiet")
    assert done.code == 0, done.err
    assert not max(frame.image.max() for frame in open_frames(home / "new" / "masks" / "left.mkv", grey=True))
    done = shell("keypoints", two, "--masks", "-o", home / "both", "--quiet")
    assert done.code == 0, done.err
    assert not len(read_npz(home / "both" / "keypoints" / "left.npz", (32, 24)).frame)
    assert not max(frame.image.max() for frame in open_frames(home / "both" / "masks" / "left.mkv", grey=True))
