"""The command `keypoints`: a script finds joints, and masks in the same pass; nothing is left where it fails or is stopped."""

from __future__ import annotations

import functools
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from waiting import until

from shadowpuppet.io.keypoints.film_keypoints import read_npz
from shadowpuppet.io.made import script_keypoints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.video import open_frames

pytestmark = pytest.mark.usefixtures("alone")

HEAD = '{"names": ["nose", "LShoulder", "-"], "detector": "grey", "origin": 0.5}'
SCRIPT = """import json, sys
size = int(sys.argv[2]) * int(sys.argv[3])
print('HEAD', flush=True)
n = 0
while len(data := sys.stdin.buffer.read(3 * size)) == 3 * size:
    people = PEOPLE
    print(json.dumps({"people": people}), flush=True)
    n += 1
"""
ONE = "[{'id': 7, 'points': [[n + 8.5, 4, 0.9], None, [1, 1, 1]]}] if n else []"
MASK = "    if sys.argv[4:] == ['masks']: sys.stdout.buffer.write(bytes([255 * (n % 2)]) * size); sys.stdout.flush()\n"
BOTH = SCRIPT.replace("    n += 1\n", f"{MASK}    n += 1\n")


@pytest.fixture
def script(home):
    """Writes a script that says a head, and some people of frame n."""
    def write(people=ONE, head=HEAD, more="", text=SCRIPT):
        (home / "mine.py").write_text(text.replace("PEOPLE", people).replace("HEAD", head) + more)
        return home / "mine.py"

    return write


def left(home):
    """Files and folders beside the recording and what the tests put there."""
    return sorted(path.name for path in home.iterdir() if path.name not in ("lab", "mine.py", "cache"))


def found(folder, camera="left"):
    return read_npz(folder / "keypoints" / f"{camera}.npz", (32, 24))


def mask_means(folder):
    return [frame.image.mean() for frame in open_frames(folder / "masks" / "left.mkv", grey=True)]


def test_a_script_s_keypoints_are_written_beside_linked_films(shell, two, script, home):
    done = shell("keypoints", two, "--with", script(), "--camera", "right")
    assert done.code == 0, done.err
    assert "by mine.py: 5 frames" in done.out
    assert "person found in 80 % of 5 frames" in done.out
    assert "shadowpuppet track lab-keypoints --overlay" in done.out
    new = home / "lab-keypoints"
    assert sorted(path.name for path in new.iterdir()) == ["calibration.toml", "keypoints", "video"]
    assert os.path.samefile(new / "video" / "right.mp4", two / "video" / "right.mp4")
    assert 'script = "mine.py"' in (new / "keypoints" / "made_by.toml").read_text()
    film = found(new, "right")
    assert (film.names, film.detector) == (("nose", "left_shoulder"), "grey")
    assert (film.frame.tolist(), film.person.tolist()) == ([1, 2, 3, 4], [7] * 4)
    np.testing.assert_array_equal(film.xy[:, 0], [[n + 8, 3.5] for n in range(1, 5)])  # half a pixel less, as the script counts corners
    np.testing.assert_array_equal(film.confidence, [[np.float32(0.9), 0]] * 4)
    assert np.isnan(film.xy[:, 1]).all()


def test_several_people_and_points_that_are_not_numbers(shell, two, script, home):
    people = "[{'points': [[9, 9, 1], [float('nan'), 3, 1], None]}, {'id': 1, 'points': [[3, 3, 0.5], [5, 4, 0.25], None]}]"
    assert shell("keypoints", two, "--with", script(people), "-o", "new", "--quiet") == (0, "", "")
    there = found(home / "new").at(2)
    assert there.person.tolist() == [-1, 1]
    np.testing.assert_array_equal(there.xy, [[[8.5, 8.5], [np.nan] * 2], [[2.5, 2.5], [4.5, 3.5]]])


def test_one_pass_makes_masks_too(shell, two, script, home):
    done = shell("keypoints", two, "--with", script(text=BOTH), "--masks", "-o", "new")
    assert done.code == 0, done.err
    assert "track new --masks" in done.out
    assert mask_means(home / "new") == [0, 255, 0, 255, 0]
    assert len(found(home / "new").frame) == 4
    assert (home / "new" / "masks" / "made_by.toml").exists()


@pytest.mark.parametrize(("text", "said"), [
    (SCRIPT, r"frame 0: found \d+ bytes after its line, expected its mask of 768, as the script was started with the argument masks"),
    (BOTH.replace("]) * size", "]) * (size - 1)"), "frame 1: found no JSON"),
    (BOTH.replace("255 *", "100 +"), "frame 0: mask: found 100 % of the pixels neither dark nor bright"),
])  # fmt: skip
def test_masks_that_are_none_are_refused(shell, two, script, home, text, said):
    done = shell("keypoints", two, "--with", script(text=text), "--masks", "-o", "new", "--quiet")
    assert done.code == 2
    assert re.search(f"^error: mine.py: .*left.mp4: {said}", done.err), done.err
    assert left(home) == []


def test_the_other_kind_is_kept_and_what_is_there_is_replaced_only_if_asked(shell, two, script, home):
    (home / "black.py").write_text("import sys\nsys.stdout.buffer.write(bytes(len(sys.stdin.buffer.read()) // 3))\n")
    assert shell("keypoints", two, "--with", script(), "-o", two, "--quiet").code == 0
    said = shell("keypoints", two, "--with", script(), "-o", two, "--quiet").err
    assert "keypoints: found keypoints there already; choose another folder with -o, or replace them with --force" in said
    assert shell("keypoints", two, "--with", script("[]"), "-o", two, "--quiet", "--force").code == 0
    assert not len(found(two).frame)
    (two / "recording.toml").write_text('[keypoints]\nmodel = "COCO_17"\n')
    assert shell("masks", two, "--with", home / "black.py", "-o", "kept", "--quiet").code == 0
    assert os.path.samefile(home / "kept" / "keypoints" / "left.npz", two / "keypoints" / "left.npz")
    assert read_recording(home / "kept").views[0].keypoints.model == "COCO_17"
    (two / "masks").mkdir()
    (two / "masks" / "left.mkv").write_bytes((two / "video" / "left.mp4").read_bytes())
    assert shell("keypoints", two, "--with", script(), "-o", "new", "--quiet").code == 0
    assert os.path.samefile(home / "new" / "masks" / "left.mkv", two / "masks" / "left.mkv")
    assert shell("keypoints", two, "--with", script(text=BOTH), "--masks", "-o", "newer", "--quiet").code == 0
    assert mask_means(home / "newer") == [0, 255, 0, 255, 0]


@pytest.mark.parametrize(("people", "head", "more", "said"), [
    (ONE, HEAD, "sys.exit('no room')\n", r"the script failed after 5 lines of keypoints \(exit code 1\); its last words: no room"),
    ("1 / 0", HEAD, "", r"the script failed after 0 lines of keypoints \(exit code 1\); its last words: Traceback.*ZeroDivisionError"),
    (f"{ONE}\n    if n == 3: break", HEAD, "", "found 3 lines of keypoints, expected .*, one for each frame; the script's last words"),
    (ONE, HEAD, "print('{\"people\": []}')\n", "found more lines of keypoints than the film's 5 frames of 32 x 24 pixels; expected one"),
    (ONE, HEAD, "print('{\"people', end='')\n", "frame 5: found a line that ends after 8 bytes"),
    (ONE, "Loading weights", "", "first line: found no JSON .*, expected keypoints"),
    (ONE, HEAD.replace("nose", "beak").replace("LShoulder", "wing"), "", "first line: names: found .*beak.*, expected some of nose"),
    (ONE, HEAD.replace('"nose", ', ""), "", r"frame 1: people\[0\].points: found a list of 3, expected a list of 2, one for each name"),
    (ONE, HEAD.replace("0.5", "7"), "", "first line: origin: found 7, expected the place of the first pixel's centre"),
    ("[{'points': [[1, 2]] * 3}]", HEAD, "", r"frame 0: people\[0\].points: found a list of 3, expected 3 x 3 numbers"),
    ("[{'points': [[9, 9, 37]] * 3}]", HEAD, "", "confidence: found .*37.*, expected 0 to 1"),
    ("[{'points': [[0.5, 0.2, 1]] * 3}]", HEAD, "", "points: found none beyond 1, expected pixels, no shares of the picture"),
    (f"{ONE}\n    print('frame', n)", HEAD, "", "frame 0: found no JSON"),
])  # fmt: skip
def test_what_a_script_does_wrong_is_said_and_nothing_is_left(shell, two, script, home, people, head, more, said):
    done = shell("keypoints", two, "--with", script(people, head, more), "-o", "new", "--quiet")
    assert done.code == 2
    assert done.err.startswith("error: mine.py: "), done.err
    assert len(done.err.splitlines()) == 1
    assert re.search(said, done.err), done.err
    assert left(home) == []


def test_a_line_without_an_end_is_no_endless_one(shell, two, script, home, monkeypatch):
    monkeypatch.setattr(script_keypoints, "FILE_MEMORY", 1000)
    done = shell("keypoints", two, "--with", script(f"{ONE}; print(' ' * 5000, end='', flush=True)"), "-o", "new", "--quiet")
    assert "found 1000 bytes without a line's end, expected lines of keypoints" in done.err
    assert left(home) == []


def test_control_c_stops_the_script_and_leaves_nothing(two, script, home):
    slow = script(more="open('pid', 'w').write(str(__import__('os').getpid())); __import__('time').sleep(600)\n")
    heeding = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # tests begun in the background do not
    command = [sys.executable, "-m", "shadowpuppet", "keypoints", two, "--with", slow, "-o", "new"]
    child = subprocess.Popen(command, cwd=home, stderr=subprocess.PIPE, text=True, preexec_fn=heeding)
    until(lambda: child.poll() is not None or ((home / "pid").exists() and (home / "pid").read_text() != ""))
    child.send_signal(signal.SIGINT)
    assert "interrupted" in child.communicate()[1].splitlines()[-1]
    assert child.returncode == 130
    with pytest.raises(ProcessLookupError):
        os.kill(int((home / "pid").read_text()), 0)
    assert left(home) == ["pid"]


def test_the_template_is_a_script_that_works(shell, two, home):
    (home / "bin").mkdir()
    uv = home / "bin" / "uv"
    uv.write_text(f'#!/bin/sh\nshift 3\nexec "{sys.executable}" "$@"\n')
    uv.chmod(0o755)
    assert "mediapipe" in shell("keypoints", "--list").out
    assert shell("keypoints", "--template", "mine.py").code == 0
    assert shell("keypoints", two, "--with", "mine.py", "-o", "new", "--quiet").code == 0
    film = found(home / "new")
    assert (film.names, film.frame.tolist(), film.xy.tolist()) == (("mid_hip",), [0, 1, 2, 3], [[[15.5, 11.5]]] * 4)
    assert "found no recording" in shell("keypoints").err
