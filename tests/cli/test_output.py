"""What the program prints: no control characters whatever things are named, and no traceback whatever becomes of its streams."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import av
import av.error
import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rich.text import Text

from shadowpuppet.cli.tables import pairs, show, show_json, show_next, table
from shadowpuppet.cli.terminal import Terminal
from shadowpuppet.errors import VideoError
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.output import say, say_text
from shadowpuppet.video import read_image, write_image
from shadowpuppet.video.film import decoded, opened

BAD = "[red]a\x1b[2J\x1b]0;title\x07\u202eb\u2066\x9b31m\x85\u2028\r\x7f[/red]:smile:\nc\tend"
"""A name with markup of rich, escapes of a terminal, controls of direction, C1 controls and line ends."""


def is_clean(text: str) -> bool:
    return all(line.isprintable() for line in text.split("\n"))


# Names


@given(st.text(st.characters()))
@example(BAD)
def test_whatever_door_a_name_is_printed_through_it_is_clean(name):
    def printed(function, *values: object) -> str:
        import contextlib
        import io

        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
            function(*values)
        return out.getvalue()

    assert is_clean(said := printed(say, name))
    assert said.count("\n") == 1
    assert is_clean(printed(say_text, name.replace("\t", " ")))
    assert is_clean(printed(show_next, name))
    shown = pairs([(name, name), ("lines", [name, name])]), table(name, (name, "b"), [(name, name)]), name, Text(name)
    assert is_clean(printed(show, *shown))
    assert is_clean(text := printed(show_json, {name: [name]}))
    try:
        name.encode()
    except UnicodeEncodeError:
        return  # JSON has no such names
    assert json.loads(text) == {name: [name]}


def test_a_name_has_one_line_in_a_table_and_no_markup(printed):
    said = printed(pairs([("name", BAD), ("made", [BAD, "d"])]), table("", ("camera", "b"), [(BAD, "2")]), "x\ny")
    name = "[red]a\ufffd[2J\ufffd]0;title\ufffd\ufffdb\ufffd\ufffd31m \ufffd[/red]:smile: c end"
    assert [line.replace("  ", " ") for line in said] == [f"name {name}", f"made {name}", "d", "", "camera b", f"{name} 2", "", "x y"]


@pytest.mark.parametrize("printing", [Terminal.warn, Terminal.note, Terminal.trouble])
def test_warnings_and_notes_are_clean(printing, capsys):
    terminal = Terminal()
    printing(terminal, BAD)
    terminal.stop()
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "[red]a" in err
    assert ":smile:" in err
    assert is_clean(err)


def run(*tokens: object, **more) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "shadowpuppet", *map(str, tokens)], capture_output=True, text=True, check=False, **more)


@pytest.fixture
def joints(tmp_path) -> Path:
    """A file of motion with a joint of a bad name, in a folder of one."""
    folder = tmp_path / "\x1b[31m[red]\u202e\n=cmd"
    folder.mkdir()
    return write_motion(folder / "walk.csv", BAD)


def write_motion(path: Path, name: str) -> Path:
    write_joints(path, JointTable(np.arange(3.0), ("head", name), np.zeros((3, 2, 3))))
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="its names have no such characters")
def test_info_is_clean_of_what_a_file_and_its_joints_are_named(joints):
    for tokens in (["info", joints], ["info", joints, "--json"], ["convert", joints, joints.with_suffix(".bvh")],
                   ["info", joints.with_name("none\x1b[2J")]):
        done = run(*tokens)
        assert is_clean(done.stdout)
        assert is_clean(done.stderr)
        assert "[red]" in done.stdout + done.stderr
    assert BAD.split("\x1b")[0] in run("info", joints).stdout


@pytest.mark.skipif(sys.platform == "win32", reason="its names have no such characters")
def test_a_look_at_a_recording_is_clean_of_its_name(recording, tmp_path):
    bad = tmp_path / "lab\x1b[31m[bold]\u202e\x9b\ntracked"
    shutil.copytree(recording, bad)
    for more in ([], ["--json"]):
        done = run("info", bad, *more)
        assert done.returncode == 0, done.stderr
        assert "[bold]" in done.stdout
        assert is_clean(done.stdout)
        assert is_clean(done.stderr)
        assert not any(line.startswith("tracked") for line in done.stdout.splitlines())
    assert json.loads(done.stdout)["recording"] == str(bad)


# Streams

NO_PIPES = pytest.mark.skipif(sys.platform == "win32", reason="a shell of POSIX")


def in_shell(line: str, *tokens: object) -> tuple[int, str, str]:
    """Exit code of the program, standard output and standard error of a shell's line, in which "$@" is the program."""
    command = [sys.executable, "-m", "shadowpuppet", *map(str, tokens)]
    done = subprocess.run(["sh", "-c", line, "sh", *command], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


@NO_PIPES
@pytest.mark.parametrize("tokens", [["--help"], ["info", "FILE"]])
@pytest.mark.parametrize(("line", "code", "said"), [
    ('"$@" >&-', 0, ""), ('"$@" >&- 2>&- <&-', 0, ""), ('"$@" 2>&-', 0, ""),
    ('"$@" >/dev/full', 2, "error: standard output: cannot be written (no space left on device)\n"), ('"$@" 2>/dev/full', 0, ""),
    ('{ "$@"; echo $? >&2; } | true', 0, "0\n"), ('{ "$@"; echo $? >&2; } | head -n 1', 0, "0\n"),
])  # fmt: skip
def test_streams_that_are_closed_full_or_read_in_part_are_no_traceback(tokens, line, code, said, tmp_path):
    if "/dev/full" in line and not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    file = write_motion(tmp_path / "walk.csv", "spine")
    assert in_shell(line, *(file if token == "FILE" else token for token in tokens))[::2] == (code, said)


@NO_PIPES
@pytest.mark.parametrize("line", ['"$@" 2>&-', '"$@" 2>/dev/full', '"$@" >&- 2>&-', '"$@" >/dev/full 2>/dev/full'])
def test_a_mistake_is_a_mistake_where_it_cannot_be_said(line):
    assert in_shell(line, "info", "nowhere") == (2, "", "")


@NO_PIPES
def test_what_is_written_to_files_is_not_lost_with_the_output(tmp_path):
    """A file that is opened does not get the number of a closed stream, and the work goes on where nothing can be printed."""
    source = write_motion(tmp_path / "walk.csv", "spine")
    made = {}
    for n, line in enumerate(('"$@"', '"$@" >&- 2>&- <&-', '"$@" >/dev/full', '{ "$@"; } | true')):
        target = tmp_path / f"{n}.trc"
        in_shell(line, "convert", source, target)
        made[line] = target.read_text().replace(target.name, "")
    assert len(set(made.values())) == 1


@NO_PIPES
def test_a_letter_that_the_terminal_lacks_is_written_as_an_escape(tmp_path):
    file = write_motion(tmp_path / "gehen.csv", "größer")
    done = run("info", file, env=os.environ | {"PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert "gr\\xf6\\xdfer" in done.stdout


# Memory


@pytest.mark.parametrize("error", ["cv2", MemoryError(), MemoryError("Unable to allocate 3.00 GiB for an array"), "av"])
def test_too_little_memory_is_said_in_a_sentence_that_names_the_file(error, shell, recording, tmp_path, monkeypatch):
    raised, said = out_of_memory(error)
    monkeypatch.setattr("shadowpuppet.video.film.converter", lambda grey: raised)
    code, out, err = shell("info", recording)
    assert (code, out) == (2, "")
    assert re.fullmatch(rf"error: \S+\.\w+: too large for the memory of this machine \({said}\)\n", err)
    monkeypatch.setattr("shadowpuppet.cli.recordings.validate", raised)
    code, out, err = shell("synthesize", "-o", tmp_path / "made")
    assert (code, out) == (2, "")
    assert re.fullmatch(rf"error: the memory of this machine does not suffice \({said}\); a lower --max-size, .*\n", err)


def out_of_memory(error: object):
    """A function that raises an error, and what is said of it."""
    if error == "cv2":
        return lambda *_, **__: cv2.resize(np.zeros((1, 1), np.uint8), (2**25, 2**25)), r".*insufficient memory.*"
    if error == "av":
        error = av.error.MemoryError(12, "Cannot allocate memory", "film.mp4")
    assert isinstance(error, MemoryError)

    def raised(*_, **__):
        raise error

    return raised, {"": "out of memory"}.get(str(error), "(cannot allocate memory|unable to allocate .*)")


def test_a_decoder_without_memory_is_no_damaged_film(monkeypatch):
    raised, _ = out_of_memory("av")
    packet = SimpleNamespace(is_corrupt=False, decode=raised)
    with pytest.raises(MemoryError):
        next(decoded(SimpleNamespace(demux=lambda _: iter([packet])), SimpleNamespace()))  # pyright: ignore[reportArgumentType]


def test_pictures_and_films_that_are_too_large_are_named(tmp_path, monkeypatch):
    path = tmp_path / "room.png"
    write_image(path, np.zeros((4, 4), np.uint8))
    large, _ = out_of_memory("cv2")
    monkeypatch.setattr(cv2, "imdecode", large)
    with pytest.raises(VideoError, match=r"room\.png: too large for the memory of this machine \(.*insufficient memory"):
        read_image(path)
    monkeypatch.setattr(av, "open", out_of_memory("av")[0])
    with pytest.raises(VideoError, match=r"room\.png: too large for the memory of this machine \(cannot allocate memory"), opened(path):
        pass


def test_frames_that_are_not_later_are_one_line_for_all_films(capsys):
    listener = Terminal()
    for film in ("a.mp4", "b.mp4"):
        listener.warn(f"{film}: the frame at 0.200 s is followed by one that is not later; times are moved so that they increase")
        listener.warn(f"{film}: the film breaks off")
    assert [line.split(":")[1] for line in capsys.readouterr().err.splitlines()] == [" a.mp4", " a.mp4", " b.mp4"]
