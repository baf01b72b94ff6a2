"""Messages are one line without control characters, of limited length."""

from __future__ import annotations

import shlex
import sys
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import LONGEST, FormatError, ShadowPuppetWarning, did_you_mean, extra_command, held_warnings, one_line, warn
from shadowpuppet.live.sources import known_person
from shadowpuppet.pipeline.options import Options


@given(st.text(st.characters()))
def test_messages_are_one_line_of_printable_characters(text):
    assert one_line(text).isprintable()
    assert str(FormatError(text)) == str(ShadowPuppetWarning(text)) == one_line(text)


@pytest.mark.parametrize(("text", "line"), [
    ("a b  c", "a b  c"), ("a\nb\tc", "a b c"), ("\x1b[31mred", "\ufffd[31mred"), ("\udcff", "\ufffd"), ("größer", "größer"),
])  # fmt: skip
def test_what_is_printable_stays(text, line):
    assert one_line(text) == line


def test_the_middle_of_a_long_message_is_left_out():
    line = one_line("a" * 10**6 + "b")
    assert len(line) < LONGEST + 10
    assert line.startswith("aaa")
    assert line.endswith("b")


def test_the_nearest_name_is_offered_and_none_that_is_far():
    assert did_you_mean("wlak", ["stand", "walk"]) == "; did you mean walk?"
    assert did_you_mean(3, ["stand", "walk"]) == did_you_mean("fly", []) == ""


@pytest.mark.parametrize(("found", "command"), [
    (Path(sys.executable).with_name("pip"), "pip install 'shadowpuppet[view]'"),
    ("/usr/bin/pip", f"{shlex.quote(sys.executable)} -m pip install 'shadowpuppet[view]'"),
    (None, f"{shlex.quote(sys.executable)} -m pip install 'shadowpuppet[view]'"),
])  # fmt: skip
def test_an_extra_is_installed_where_the_program_runs(monkeypatch, found, command):
    monkeypatch.setattr("shutil.which", lambda name: found and str(found))
    assert extra_command("view") == command


def test_a_warning_names_the_caller_s_line():
    """Through any number of functions of the package."""
    for called in (lambda: warn("a problem"), lambda: known_person(Options())):
        with pytest.warns(ShadowPuppetWarning) as caught:
            called()
        assert caught[0].filename == __file__
        assert caught[0].lineno == called.__code__.co_firstlineno


def test_warnings_that_are_held_back_are_given_if_the_work_fails():
    def fail() -> None:
        with held_warnings():
            warn("second")
            raise ValueError("work")

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with held_warnings() as held:
            warn("first")
        assert (held, said) == (["first"], [])
        with pytest.raises(ValueError, match="work"):
            fail()
    assert [str(each.message) for each in said] == ["second"]
