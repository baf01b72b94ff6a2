"""Segmentation scripts: found by name or path, their inline metadata read; what is wrong is said."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.external.script import accepts, find_script, read_script, shipped_scripts, template

HEAD = '# /// script\n# requires-python = "{}"\n# dependencies = {}\n# ///\n'
VERSIONS = st.tuples(st.just(3), st.integers(0, 20), st.integers(0, 30))


def script(path, text):
    path.write_text(text, "utf-8")
    return read_script(path, path.name)


KINDS = ("masks", "keypoints")


@pytest.mark.parametrize("kind", KINDS)
def test_mediapipe_is_shipped_with_its_versions(kind):
    found = find_script("mediapipe", kind)
    assert found.requirements == ("mediapipe==0.10.21",)
    assert accepts(found.pythons, (3, 12, 1))
    assert not accepts(found.pythons, (3, 13, 0))
    assert "Apache-2" in shipped_scripts(kind)["mediapipe"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_template_is_a_script_of_its_own_and_not_listed(kind):
    assert template(kind).stem not in shipped_scripts(kind)
    assert read_script(template(kind), "template").requirements == ("numpy>=1.26",)


def test_a_script_may_ask_for_nothing(tmp_path):
    found = script(tmp_path / "mine.py", "print()\n")
    assert (found.requirements, found.pythons) == ((), "")
    assert found == find_script(str(tmp_path / "mine.py"), "masks")


def test_a_block_at_the_very_end_of_a_file_counts(tmp_path):
    assert script(tmp_path / "mine.py", HEAD.format(">=3.11", '["a"]').rstrip()).requirements == ("a",)


def test_lines_of_other_systems_end_likewise(tmp_path):
    (tmp_path / "mine.py").write_bytes(HEAD.format(">=3.11", '["a", "b>2"]').replace("\n", "\r\n").encode())
    assert read_script(tmp_path / "mine.py", "mine.py").requirements == ("a", "b>2")


@pytest.mark.parametrize(("text", "found"), [
    (HEAD.format(">=3.11", "[1]"), r"dependencies: found \[1\], expected a list of packages"),
    (HEAD.format(">=3.11", '"numpy"'), "dependencies: found 'numpy'"),
    (HEAD.format(">=3.11", '["--index=x"]'), "dependencies: found"),
    (HEAD.format("new", "[]"), "requires-python: found 'new', expected versions such as"),
    (HEAD.format(">=3.11", "[").replace("[", "[,"), "not valid TOML"),
    (2 * (HEAD.format(">=3.11", "[]") + "\n"), "found 2 blocks"),
])  # fmt: skip
def test_wrong_metadata_are_refused(tmp_path, text, found):
    with pytest.raises(SilhouetteError, match=found):
        script(tmp_path / "mine.py", text)


def test_an_unknown_name_lists_those_that_there_are(tmp_path):
    with pytest.raises(SilhouetteError, match=r"found 'sam', .* or one of mediapipe"):
        find_script("sam", "masks")
    (tmp_path / "mask.png").write_bytes(b"\x89PNG\xff")
    with pytest.raises(SilhouetteError, match="no text at position 0"):
        find_script(str(tmp_path / "mask.png"), "masks")


@given(VERSIONS, VERSIONS)
def test_relations_of_versions_are_those_of_tuples(wanted, found):
    text = ".".join(map(str, wanted))
    assert accepts(f">={text}", found) == (found >= wanted)
    assert accepts(f"<{text}", found) == (found < wanted)
    assert accepts(f"== {text}", found) == (found == wanted) != accepts(f"!={text}", found)
    assert accepts(f">{text},<={text}", found) is False
    assert accepts(f"~={text}", found) == (found >= wanted and found[:2] == wanted[:2])
    assert accepts(f"==3.{wanted[1]}.*", found) == (found[1] == wanted[1])


def test_short_versions_count_as_zeros_at_the_end():
    assert accepts(">=3.11", (3, 11, 0))
    assert not accepts(">3.11", (3, 11, 0))
    assert accepts("<3.13", (3, 12, 9))
    assert not accepts("<3.13", (3, 13, 0))
    assert accepts("", (2, 7, 18))
