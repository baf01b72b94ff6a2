"""What works on this machine: told as it is, whatever is broken."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from shadowpuppet.cli import app as cli
from shadowpuppet.cli import doctor
from shadowpuppet.cli.doctor import Examined, examine, works
from shadowpuppet.errors import extra_command


@pytest.fixture
def told(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")

    def run(*tokens):
        code = cli.run(["doctor", *tokens])
        said = capsys.readouterr()
        assert said.err == ""
        return code, said.out

    return run


def named(found: list[Examined]) -> dict[str, Examined]:
    return {finding.name: finding for finding in found}


def test_where_the_tests_run_the_core_works(told):
    code, out = told()
    assert code == 0
    assert out.rstrip().endswith("tracking works here")
    assert "\x1b" not in out
    assert max(map(len, out.splitlines())) <= 80
    for name, _, needed in doctor.CHECKS:
        if needed:
            assert f"\n{name}  " in "\n" + out


def test_warming_up_tracks_one_camera_and_four_and_leaves_nothing(monkeypatch, tmp_path, capsys):
    from shadowpuppet.pipeline import track

    tracked = []

    def noted(recording, run, options):
        tracked.append((len(list((recording / "video").iterdir())), options.anyway))

    monkeypatch.setattr(track, "track_recording", noted)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert cli.run(["doctor", "--warm"]) == 0
    assert tracked == [(1, True), (4, True)]
    assert list(tmp_path.iterdir()) == []
    assert "compiling everything, once" in capsys.readouterr().err


def test_json_has_everything(told):
    code, out = told("--json")
    read = json.loads(out)
    assert (code, read["works"]) == (0, True)
    names = [finding["name"] for finding in read["findings"]]
    assert {"Python", "libraries", "kernels", "films", "codecs", "processor", "browser", "cameras"} <= set(names)
    assert {f"extra {extra}" for extra in doctor.EXTRAS} <= set(names)
    assert all(finding["remedy"] for finding in read["findings"] if finding["state"] == "missing")


def test_every_extra_is_known():
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8")
    assert {extra for extra, needs in tomllib.loads(text)["project"]["optional-dependencies"].items() if needs} == set(doctor.EXTRAS)


@pytest.mark.parametrize("name", ["av", "tomli_w", "cv2"])
def test_a_library_that_cannot_be_loaded_breaks_the_core(name, told, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    code, out = told()
    assert code == 1
    assert "tracking does not work here: libraries" in out
    assert doctor.REPAIR in out
    assert f"import of {name} halted" in " ".join(out.split())


def test_films_that_cannot_be_written_break_the_core(monkeypatch):
    def fail(*_, **__):
        raise OSError("no encoder\nfor H.264")

    monkeypatch.setattr("shadowpuppet.video.write_frames", fail)
    found = named(examine())["films"]
    assert (found.state, found.told, found.needed) == ("broken", "OSError: no encoder for H.264", True)
    assert not works([found])


def test_films_that_come_back_wrong_break_the_core(monkeypatch):
    from shadowpuppet import video

    original = video.open_frames

    def spoilt(path):
        for frame in original(path):
            yield frame._replace(image=255 - frame.image)

    monkeypatch.setattr("shadowpuppet.video.open_frames", spoilt)
    found = named(list(doctor._films()))["films"]
    assert found.state == "broken"
    assert "film.mp4: 8 of 8 frames came back, off by" in found.told


def test_kernels_that_are_wrong_break_the_core(monkeypatch):
    from shadowpuppet.body.shapes import Body

    monkeypatch.setattr(Body, "points", lambda *_, **__: np.array([[[0, 0, 7.0]]]))
    found = named(list(doctor._kernels()))["kernels"]
    assert (found.state, found.needed) == ("broken", True)


def test_what_is_not_there_is_reported_with_what_would_bring_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr(doctor, "CODECS", {"Nonsense": "no_such_codec", "H.264": "h264"})
    monkeypatch.setattr(doctor, "_writable", lambda _: False)
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    found = examine()
    assert works(found)
    assert named(found)["extra report"].remedy == extra_command("report")
    assert named(found)["codecs"].told == "H.264 can be read; not Nonsense"
    assert "NUMBA_CACHE_DIR" in named(found)["compiled code"].remedy


def test_an_old_python_breaks_the_core(monkeypatch):
    monkeypatch.setattr(doctor, "OLDEST_PYTHON", (9, 0))
    (found,) = doctor._python()
    assert (found.state, found.remedy) == ("broken", "install Python 9.0 or later")


@pytest.mark.parametrize(("system", "found", "state"), [("Darwin", None, "works"), ("Linux", None, "missing"),
                                                         ("Linux", "/usr/bin/chromium", "works")])
def test_a_browser_is_missed_only_where_the_system_has_none_of_its_own(monkeypatch, system, found, state):
    monkeypatch.setattr("shutil.which", lambda name: found)
    monkeypatch.setattr("platform.system", lambda: system)
    (said,) = doctor._browser()
    assert said.state == state


@pytest.mark.parametrize(("rights", "state"), [(os.R_OK | os.W_OK, "works"), (os.R_OK, "broken"), (os.W_OK, "broken"), (0, "broken")])
def test_a_camera_must_be_readable_and_writable(monkeypatch, rights, state):
    monkeypatch.setattr("platform.system", lambda: "Linux")
    monkeypatch.setattr(Path, "glob", lambda self, pattern: [Path("/dev/video7")])
    monkeypatch.setattr(os, "access", lambda path, wanted: (rights & wanted) == wanted)
    (found,) = doctor._cameras()
    assert found.state == state
    assert "video7" in found.told
