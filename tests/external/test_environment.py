"""Environments of segmentation scripts: uv's where it is on the path, else a virtual environment that is made once and kept."""

from __future__ import annotations

import os
import stat
import subprocess
import sys

import pytest

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.external import environment
from shadowpuppet.external.environment import cache_folder, command_for, last_words, variables
from shadowpuppet.external.script import Script

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the programs on the path are shell scripts here")


@pytest.fixture(autouse=True)
def alone(monkeypatch, tmp_path):
    """No uv and no other Python on the path, and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    (tmp_path / "bin").mkdir()
    return tmp_path


def program(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IEXEC)
    return path


def mine(tmp_path, *requirements, pythons=""):
    (tmp_path / "mine.py").write_text("import sys; print(sys.prefix, sys.flags.safe_path)\n")
    return Script("mine.py", tmp_path / "mine.py", requirements, pythons)


def test_uv_runs_the_script_if_it_is_there(alone):
    uv = program(alone / "bin" / "uv", "exit 0")
    assert command_for(mine(alone)) == [str(uv), "run", "--no-project", "--script", str(alone / "mine.py")]
    assert not cache_folder().exists()


def test_an_environment_is_made_once_without_other_packages_and_kept(alone, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "elsewhere")
    said = []
    command = command_for(mine(alone), said.append)
    prefix, safe = subprocess.run(command, env=variables(), capture_output=True, text=True, check=True).stdout.split()
    assert said == ["making the environment of mine.py"]
    assert os.path.dirname(prefix) == str(cache_folder())
    assert safe == "True"
    assert "PYTHONPATH" not in variables()
    assert not list(cache_folder().glob("*/lib/*/site-packages/numpy"))
    assert command_for(mine(alone), said.append) == command
    assert len(said) == 1
    assert len(list(cache_folder().iterdir())) == 1


def test_a_broken_environment_is_made_again(alone):
    python = command_for(mine(alone))[0]
    os.remove(python)
    os.symlink(alone / "gone", python)
    assert subprocess.run([command_for(mine(alone))[0], "-c", ""], check=False).returncode == 0


def test_nothing_is_left_if_a_package_cannot_be_installed(alone, monkeypatch):
    def fails(command):
        return subprocess.CompletedProcess(command, "pip" in command, "", "looking\nNo matching distribution\n")

    monkeypatch.setattr(environment, "_run", fails)
    with pytest.raises(SilhouetteError, match=r"mine.py: could not install nothing-like-this .*No matching distribution \(is the package"):
        command_for(mine(alone, "nothing-like-this"))
    assert list(cache_folder().iterdir()) == []


def test_requirements_and_version_name_the_environment(alone):
    asked = ((), ("a",), ("a", "b"), ("b", "a"))
    keys = {environment._key(mine(alone, *some), version) for some in asked for version in ("3.11.1", "3.12.1")}
    assert len(keys) == 6


def test_another_python_of_the_path_is_taken_if_the_running_one_does_not_suit(alone):
    program(alone / "bin" / "python3.14", "exit 127")
    program(alone / "bin" / "python3.10", "echo 3.10.99")
    assert environment._suitable_python(mine(alone, pythons="<3.11")) == (str(alone / "bin" / "python3.10"), "3.10.99")
    assert environment._suitable_python(mine(alone, pythons=">=3.11"))[0] == sys.executable


def test_without_a_suitable_python_the_versions_are_said(alone):
    with pytest.raises(SilhouetteError, match=r"mine.py: it runs on Python >=2.7,<2.8, found 3\.\d+\.\d+; install such a Python .* or uv"):
        command_for(mine(alone, pythons=">=2.7,<2.8"))


def test_an_unwritable_cache_is_said(alone):
    (alone / "cache").write_text("a file")
    with pytest.raises(SilhouetteError, match=r"no environment of mine.py can be made there \(.*\); set XDG_CACHE_HOME"):
        command_for(mine(alone))


def test_last_words_are_short_and_plain():
    assert last_words([]) == "nothing"
    assert last_words(["", *(f"line {n}\n" for n in range(99))]).startswith("line 91 | line 92")
    assert last_words(["\x1b[31mred\x07 " + 1000 * "a"]) == "[31mred  " + 291 * "a"
