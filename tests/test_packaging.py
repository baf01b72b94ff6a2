"""What the project's own files promise: light imports, documentation that is true to the code, versions that agree."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from pkgutil import resolve_name
from runpy import run_path

import pytest

import shadowpuppet
from shadowpuppet.pipeline.options import Options
from shadowpuppet.settings import settings_of

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "shadowpuppet"
HEAVY = ("numpy", "scipy", "numba", "cv2", "av", "pydantic", "cyclopts", "rich", "matplotlib", "websockets", "pylsl",
         "distributed", "pyarrow", "asyncio")  # fmt: skip
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def loaded_after(code: str) -> set[str]:
    """Modules that a new interpreter has loaded after some code."""
    code = f"{code}\nimport sys, json; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


# Imports


def test_importing_the_package_loads_nothing_heavy():
    assert not loaded_after("import shadowpuppet; dir(shadowpuppet); shadowpuppet.__version__") & set(HEAVY)


def test_help_and_reading_files_load_no_compiler_codec_or_plots():
    for code in ("from shadowpuppet.cli.app import app; app.help_print",
                 "from shadowpuppet import read_run, read_recording, read_joints, read_motion, read_prior"):
        assert not loaded_after(code) & {"numba", "cv2", "av", "matplotlib"}


def test_tracking_loads_no_files_films_or_terminal():
    loaded = loaded_after("import shadowpuppet.tracking.monocular.tracker, shadowpuppet.tracking.monocular.initialization")
    assert not loaded & {"cv2", "av", "matplotlib", "rich", "cyclopts", "shadowpuppet.io", "shadowpuppet.video", "shadowpuppet.cli.app"}


@pytest.mark.parametrize("name", shadowpuppet.__all__)
def test_every_public_name_is_there(name):
    assert getattr(shadowpuppet, name) is not None
    assert name in dir(shadowpuppet)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_thing"):
        _ = shadowpuppet.no_such_thing


# Versions and files


def test_the_version_is_that_of_the_last_tag():
    assert PROJECT["dynamic"] == ["version"]
    assert "version" not in PROJECT
    assert re.match(r"\d+\.\d+(\.\d+)?(\.dev\d+)?($|\+)", shadowpuppet.__version__)
    assert not re.search(r"^version:", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize(("tag", "title", "waiting", "wrong"), [
    ("v1.2.3", "[1.2.3] - 2026-11-23", "", None),
    ("1.2.3", "[1.2.3] - 2026-11-23", "", "tag: found '1.2.3'"),
    ("v1.2.3rc1", "[1.2.3rc1] - 2026-11-23", "", "tag: found"),
    ("v1.2.3", "[1.2.4] - 2026-11-23", "", "found no line"),
    ("v1.2.3", "[1.2.3]", "", "found no line"),
    ("v1.2.3", "[1.2.3] - 2026-11-23", "- Something.", "changes under Unreleased"),
])  # fmt: skip
def test_a_tag_is_released_with_its_changes_only(tag, title, waiting, wrong):
    log = f"# Changelog\n\n## [Unreleased]\n\n{waiting}\n\n## {title}\n\n- Something else.\n"
    found = run_path(str(ROOT / ".ci" / "check_release.py"))["problems"](tag, log)
    assert (not found) if wrong is None else any(wrong in line for line in found)


def test_the_conda_recipe_needs_what_the_package_needs():
    names = {"py-opencv": "opencv-python-headless"}
    recipe = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text("utf-8")
    run = re.search(r"^  run:\n((?:    - .*\n)+)", recipe, re.MULTILINE)
    assert run is not None
    needed = [line.removeprefix("    - ") for line in run[1].splitlines()]
    assert needed[0] == f"python {PROJECT['requires-python']}"
    wanted = [re.sub(r"^[\w-]+", lambda name: names.get(name[0], name[0]), line).replace(" ", "") for line in needed[1:]]
    assert wanted == PROJECT["dependencies"]


def test_the_licence_is_the_one_that_is_reported():
    assert PROJECT["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text("utf-8").startswith("BSD 3-Clause License")


def test_changes_of_this_version_are_reported():
    assert "## [Unreleased]" in (ROOT / "CHANGELOG.md").read_text("utf-8")


# Documentation


def docs(name: str) -> str:
    return (ROOT / "docs" / name).read_text("utf-8")


def test_the_architecture_names_every_room():
    rooms = {str(path.parent.relative_to(PACKAGE)) for path in PACKAGE.rglob("__init__.py")} - {"."}
    listed = docs("architecture.md").partition("| room | holds |")[2].partition("\n\n")[0]
    named = [name.rstrip("/") for line in listed.splitlines()[2:] for name in re.findall(r"`([\w/]+)`", line.split("|")[1])]
    assert sorted(rooms) == sorted(set(named) - {"root"})
    assert len(named) == len(set(named))


MOST_FILES = 16
"""Modules in a folder, `__init__` not counted, above which it wants rooms of its own."""


def test_no_room_is_a_hall():
    crowded = {str(path.parent): len(list(path.parent.glob("*.py"))) - 1 for path in PACKAGE.rglob("__init__.py")}
    assert {room: count for room, count in crowded.items() if count > MOST_FILES} == {}


EXTRAS = {"distributed", "ezc3d", "matplotlib", "pyarrow", "pygltflib", "pylsl", "websockets"}
"""Packages that no plain installation has."""


def test_what_only_an_extra_installs_is_imported_where_it_is_used():
    found = []
    for path in PACKAGE.rglob("*.py"):
        if path.name == "websocket.py":
            continue
        for node in ast.parse(path.read_text("utf-8")).body:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found += [f"{path.name}: {name}" for name in names if name.split(".")[0] in EXTRAS]
    assert found == []


def test_the_manual_documents_every_public_name():
    told = {entry.rsplit(".", 1)[-1] for entry in re.findall(r"^::: (\S+)$", docs("api.md"), re.MULTILINE)}
    assert set(shadowpuppet.__all__) - told - {"__version__"} == set()


@pytest.mark.parametrize("page", ["method.md", "architecture.md"])
def test_pages_name_what_is_in_the_code(page):
    names = [name for name in re.findall(r"`(\w+(?:\.\w+)+)(?:\[.*?\])?`", docs(page)) if not name.endswith((".py", ".md"))]
    assert len(names) > 20
    for name in names:
        resolve_name(f"shadowpuppet.{name}")


def test_every_setting_is_explained():
    def unexplained(kind, place):
        for name, _, _, told in settings_of(kind):
            default = getattr(kind(), name)
            if hasattr(default, "__dataclass_fields__"):
                yield from unexplained(type(default), f"{place}{name}.")
            elif not told.endswith((".", ").")):
                yield place + name

    assert list(unexplained(Options, "")) == []


def test_every_table_of_settings_is_in_the_manual():
    of = {"tracker": ("", "torso", "arm"), "multiview": ("", "surface", "gauss_newton", "forces", "hull"), "silhouette": ("",),
          "initialization": ("",), "training": ("",)}  # fmt: skip
    tables = {f"{table}{'.' + part if part else ''}" for table, parts in of.items() for part in parts}
    assert tables <= set(re.findall(r"<!-- settings: (\S+) -->", docs("commands.md")))


def said() -> str:
    """All text in the code, each f-string's with … for what is filled in."""
    parts = []
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts.append("".join(str(v.value) if isinstance(v, ast.Constant) else "…" for v in node.values))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                parts.append(node.value)
    return "\n".join(parts)


def test_the_messages_that_the_manual_explains_are_those_of_the_code():
    messages, text = re.findall(r"^\| \*(.+?)\* \|", docs("troubleshooting.md"), re.MULTILINE), said()
    assert len(messages) > 20
    missing = [message for message in messages if not all(part.strip() in text for part in message.split("…"))]
    assert missing == []


def test_every_command_is_in_the_manual():
    from shadowpuppet.cli.app import app

    commands = {name for name in app if not name.startswith("-")}
    assert commands == set(re.findall(r"<!-- help: (\S+) -->", docs("commands.md")))


def test_nothing_tells_of_this_machine():
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    if not tracked:
        pytest.skip("not a checkout")
    texts = {name: (ROOT / name).read_text("utf-8") for name in tracked
             if not name.endswith((".png", ".webp", ".npz")) and (ROOT / name).exists()}
    machine = re.compile("/" + r"(work|root|home|Users)/\w|index" + "-url")
    assert [name for name, text in texts.items() if machine.search(text)] == []
