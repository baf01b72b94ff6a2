"""How tests run beside each other: what is made once, compiled once, and left out."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import workers

TESTS = Path(__file__).parent
TWO_KERNELS = """
import sys
from pathlib import Path
import workers
from numba.core import event
from shadowpuppet.jit import kernel

class Told(event.Listener):
    def on_start(self, event): print("compiled", event.data["dispatcher"].py_func.__name__)
    def on_end(self, event): pass

event.register("numba:compile", Told())
workers.compile_one_at_a_time()
sys.path.insert(0, sys.argv[1])
import made_kernels
print(made_kernels.outer(3))
"""
KERNELS = """
from shadowpuppet.jit import kernel

@kernel
def inner(x):
    return x if x < 2 else x * inner(x - 1)

@kernel
def outer(x):
    return inner(x) + 1
"""
MARKED = """
import pytest

@pytest.mark.whole
def test_long():
    pass

def test_short():
    pass
"""


def started(folder: Path, *command: object) -> subprocess.Popen:
    path = os.pathsep.join([str(TESTS / "support"), str(TESTS.parent / "src")])
    return subprocess.Popen([sys.executable, *map(str, command)], cwd=folder, env=os.environ | {"PYTHONPATH": path}, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip


def test_processes_side_by_side_compile_each_kernel_once(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    (tmp_path / "made_kernels.py").write_text(KERNELS, "utf-8")
    both = [started(tmp_path, "-c", TWO_KERNELS, tmp_path) for _ in range(2)]
    said = [process.communicate() for process in both]
    assert [out.splitlines()[-1] for out, _ in said] == ["7", "7"], said
    lines = "".join(out for out, _ in said).splitlines()
    assert sorted(line for line in lines if line.startswith("compiled")) == ["compiled inner", "compiled outer"]


def test_a_folder_is_made_once_and_not_used_after_a_failure(tmp_path):
    calls = []

    def make(folder):
        calls.append(folder)
        folder.mkdir(exist_ok=True)
        if len(calls) == 1:
            raise ValueError

    with pytest.raises(ValueError):
        workers.made_once(tmp_path / "film", make)
    first, second = (workers.made_once(tmp_path / "film", make) for _ in range(2))
    assert first == second
    assert first.name == "film"
    assert len(calls) == 2


def test_a_folder_that_another_process_makes_is_waited_for(tmp_path):
    code = """
import sys, time
from pathlib import Path
import workers
def make(folder):
    print("made", flush=True)
    time.sleep(0.3)
    folder.mkdir()
print((workers.made_once(Path("film"), make)).is_dir())
"""
    both = [started(tmp_path, "-c", code) for _ in range(3)]
    out = "".join(process.communicate()[0] for process in both)
    assert sorted(out.split()) == ["True", "True", "True", "made"]


@pytest.mark.parametrize(("arguments", "passed"), [(["tests"], 1), (["tests", "--whole"], 2), (["tests/test_it.py"], 2),
                                                   (["tests/test_it.py::test_long"], 1)])  # fmt: skip
def test_what_is_marked_whole_runs_where_it_is_asked_for(tmp_path, arguments, passed):
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "conftest.py").write_text((TESTS / "conftest.py").read_text("utf-8"), "utf-8")
    (tmp_path / "tests" / "test_it.py").write_text(MARKED, "utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = whole: x\naddopts = -ra\n", "utf-8")
    out, err = started(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments).communicate()
    assert f"{passed} passed" in out, out + err
    assert ("conftest.py" in out and ": whole" in out) == (arguments == ["tests"])
