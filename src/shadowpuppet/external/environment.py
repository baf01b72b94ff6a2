"""The environment in which a script runs: uv's, or a virtual environment made once and kept."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from shadowpuppet.errors import SilhouetteError, reason
from shadowpuppet.external.script import Script, accepts

OTHERS = tuple(f"python3.{minor}" for minor in range(14, 8, -1))
"""Interpreters that are looked for if the running one does not suit a script."""
UNWANTED = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV")
"""Environment variables that would mix other packages into the script's."""
LAST_LINES, LINE = 8, 300
"""Number of a program's last lines that a message quotes, and the greatest length of each."""


def command_for(script: Script, say: Callable[[str], None] = lambda message: None) -> list[str]:
    """The beginning of the command line that runs a script; its environment is made first if there is none yet.

    With uv on the path uv makes the environment and brings a suitable Python. Otherwise it is a virtual environment in `cache_folder()`,
    named by a hash of the requirements and the version of Python. `say` is called before something that takes long. Raises
    `SilhouetteError` if no suitable Python is there or a package cannot be installed.
    """
    if (uv := uv_path()) is not None:
        return [uv, "run", "--no-project", "--script", str(script.path)]
    python, version = _suitable_python(script)
    folder = cache_folder() / _key(script, version)
    if not _works(python_in(folder)):
        say(f"making the environment of {script.name} (once; its packages are downloaded)" if script.requirements else
            f"making the environment of {script.name}")
        _make(folder, python, script)
    return [str(python_in(folder)), str(script.path)]


def uv_path() -> str | None:
    """The program uv on the path; None if it is not there."""
    return shutil.which("uv")


def variables(environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """Environment variables for a script, by default from those of this process: nothing of another environment is imported."""
    given = os.environ if environment is None else environment
    return {name: value for name, value in given.items() if name not in UNWANTED} | {"PYTHONSAFEPATH": "1", "PYTHONUTF8": "1"}


def cache_folder() -> Path:
    """Folder of the kept environments: shadowpuppet/environments in the user's cache folder."""
    given = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else None)
    try:
        return Path(given or Path.home() / ".cache") / "shadowpuppet" / "environments"
    except RuntimeError as error:
        raise SilhouetteError(f"no folder for environments: {error}; set XDG_CACHE_HOME to one that can be written") from None


def python_in(folder: Path) -> Path:
    """The interpreter of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def last_words(lines: list[str]) -> str:
    """The last lines that a program printed, for a message; `nothing` if there are none."""
    clean = ["".join(c if c.isprintable() else " " for c in line).strip()[:LINE] for line in lines]
    return " | ".join([line for line in clean if line][-LAST_LINES:]) or "nothing"


# Which Python


def _suitable_python(script: Script) -> tuple[str, str]:
    """An interpreter that the script's `requires-python` accepts, the running one if it does, and its version."""
    found = dict[str, None]()
    for python, version in _pythons():
        if accepts(script.pythons, tuple(map(int, version.split(".")))):
            return python, version
        found[version] = None
    raise SilhouetteError(f"{script.name}: it runs on Python {script.pythons}, found {', '.join(found)}; install such a Python (it need "
                          "not be the one that runs shadowpuppet), or uv, which brings one: pip install uv")


def _pythons() -> Iterator[tuple[str, str]]:
    """Interpreters on this machine with their versions, such as 3.12.1."""
    yield sys.executable, ".".join(map(str, sys.version_info[:3]))
    for name in OTHERS:
        path = shutil.which(name)
        answer = path and _run([path, "-I", "-c", "import sys; print('.'.join(map(str, sys.version_info[:3])))"])
        if path and answer and answer.returncode == 0:  # pyenv has launchers of versions that it does not start
            yield path, answer.stdout.strip()


def _key(script: Script, version: str) -> str:
    values = [sorted(script.requirements), version, platform.python_implementation(), sys.platform, platform.machine()]
    return hashlib.sha256(json.dumps(values).encode()).hexdigest()[:20]


# Virtual environments


def _make(folder: Path, python: str, script: Script) -> None:
    """Make a virtual environment; it gets its name when it is complete, so that an interrupted one is never used."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise SilhouetteError(f"{folder.parent}: no environment of {script.name} can be made there ({reason(error)}); set XDG_CACHE_HOME "
                              "to a folder that can be written") from None
    try:
        _done([python, "-m", "venv", *([] if script.requirements else ["--without-pip"]), str(part)], script, "make a virtual environment",
              "on Debian and Ubuntu: apt install python3-venv; or install uv")
        if script.requirements:
            pip = [str(python_in(part)), "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet"]
            _done([*pip, *script.requirements], script, f"install {', '.join(script.requirements)}",
                  "is the package registry reached, and is there room on the disk?")
        if folder.exists() and not _works(python_in(folder)):
            shutil.rmtree(folder, ignore_errors=True)
        try:
            part.rename(folder)
        except OSError as error:  # another process was faster
            if not _works(python_in(folder)):
                raise SilhouetteError(f"{folder}: cannot be made ({reason(error)})") from None
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _done(command: list[str], script: Script, what: str, remedy: str) -> None:
    answer = _run(command)
    if answer is None or answer.returncode != 0:
        said = last_words((answer.stdout + answer.stderr).splitlines()) if answer else "it could not be started"
        raise SilhouetteError(f"{script.name}: could not {what} with {command[0]}: {said} ({remedy})")


def _works(python: Path) -> bool:
    answer = _run([str(python), "-I", "-c", ""]) if python.exists() else None
    return answer is not None and answer.returncode == 0


def _run(command: list[str]) -> subprocess.CompletedProcess[str] | None:
    """The result of a command; None if it cannot be started."""
    try:
        return subprocess.run(command, env=variables(), stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                              check=False)  # fmt: skip
    except OSError:
        return None
