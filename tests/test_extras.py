"""The Blender add-on of extras/: it knows the same joints, limbs and colours; in Blender itself where SHADOWPUPPET_BLENDER names a Python
with bpy (`python benchmarks/import_in_blender.py` makes one)."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import made
import numpy as np
import pytest
import runs

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.limbs import DOUBTFUL, limb_of
from shadowpuppet.motion.mesh import LEFT_COLOUR, MIDDLE_COLOUR, RIGHT_COLOUR
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording

ROOT = Path(__file__).resolve().parent.parent


class Vector(tuple):
    """In place of Blender's."""


def stub(monkeypatch, name: str, **names) -> None:
    module = ModuleType(name)
    vars(module).update(names)
    monkeypatch.setitem(sys.modules, name, module)


@pytest.fixture
def add_on(monkeypatch):
    """The add-on without Blender: what needs none of it."""
    types = {name: type(name, (), {}) for name in ("Operator", "Scene", "Mesh", "Collection", "Object", "Camera")}
    stub(monkeypatch, "bpy", types=SimpleNamespace(**types), props=SimpleNamespace(StringProperty=lambda **_: str))
    stub(monkeypatch, "bpy_extras")
    stub(monkeypatch, "bpy_extras.io_utils", ImportHelper=type("ImportHelper", (), {}))
    stub(monkeypatch, "mathutils", Matrix=tuple, Quaternion=tuple, Vector=Vector)
    spec = importlib.util.spec_from_file_location("add_on", ROOT / "extras" / "shadowpuppet_blender.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_add_on_knows_our_joints_limbs_and_colours(add_on):
    assert add_on.BONES == BONES
    for joint in {name for bone in BONES for name in bone}:
        assert add_on.limb_of(joint) == limb_of(joint)
    assert tuple(add_on.DOUBTFUL) == DOUBTFUL
    for theirs, ours in ((add_on.LEFT, LEFT_COLOUR), (add_on.RIGHT, RIGHT_COLOUR), (add_on.MIDDLE, MIDDLE_COLOUR)):
        assert theirs[:3] == pytest.approx(ours, abs=1e-3)


def test_the_add_on_reads_a_run_as_we_do(add_on, tmp_path):
    run = runs.make_run(tmp_path / "run", frames=5, lost=(2,), spread=True, doubtful={3: {"left_arm": "uncertain"}})
    times, joints, statuses = add_on.read_joints(run / "joints.csv")
    motion = read_run(run).motion
    assert times == pytest.approx(motion.times)
    assert tuple(joints) == motion.joint_names
    assert joints["left_hand"][2] is None
    assert joints["left_hand"][4] == pytest.approx(motion.joints[4, motion.joint_names.index("left_hand")], abs=1e-5)
    assert statuses[3]["left_arm"] == "uncertain"
    assert add_on.rate_of(times) == pytest.approx(25)


def test_the_add_on_finds_films_where_recordings_have_them(add_on, tmp_path):
    recording = made.make(tmp_path / "tiny")
    film, start = add_on.find_film(recording, "cam")
    assert (film.parent.name, film.stem, start) == ("video", "cam", 0.0)
    (recording / "recording.toml").write_text(f'[start]\ncam = 1.5\n[video]\ncam = "video/{film.name}"\n')
    assert add_on.find_film(recording, "cam") == (film, 1.5)
    assert add_on.find_film(film, "cam") == (film, 0.0)
    assert add_on.find_film(tmp_path / "gone", "cam") == (None, 0.0)
    assert add_on.find_film(recording, "other") == (None, 0.0)


def test_a_run_in_blender(tmp_path):
    """Imported joints, a character that follows, cameras, films and doubt, in Blender."""
    python = os.environ.get("SHADOWPUPPET_BLENDER")
    if not python:
        pytest.skip("SHADOWPUPPET_BLENDER names no Python with bpy; it is 400 MB: python benchmarks/import_in_blender.py RUN makes one")
    run = tmp_path / "run"
    track_recording(made.make(tmp_path / "tiny"), run, make_options({"seed": 1}))
    done = subprocess.run([sys.executable, ROOT / "benchmarks" / "import_in_blender.py", run, "--environment", Path(python).parent.parent],
                          capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT / "src")})  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    for kind in ("bvh", "glb", "usda"):
        assert float(re.search(rf"^{kind}: .* at most ([\d.]+) mm off", done.stdout, re.MULTILINE)[1]) < 1
        if kind != "usda":
            angles = re.search(rf"^{kind} --rest t .* at most (.*) degrees off", done.stdout, re.MULTILINE)[1]
            assert np.max([float(angle) for angle in re.findall(r"\d+\.\d+", angles)]) < 3
    bones, cameras = re.search(r"bones at most ([\d.]+) mm off, 1 cameras at most ([\d.]+) pixels off, 1 films", done.stdout).groups()
    assert (float(bones) < 0.1, float(cameras) < 0.1) == (True, True)
