"""Messages are one line without control characters, of limited length."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import LONGEST, FormatError, ShadowPuppetWarning, one_line


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
