"""A person's file: what is written is read to the last bit, and what cannot be is said."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.body.models import WHOLE, average_sizes
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.person import Person, read_person, write_person

SIZES = CardboxSizes.from_array(np.linspace(0.05, 0.6, 18))
text = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(0.005, 2.0), min_size=18, max_size=18), st.none() | st.floats(0.5, 2.5), text, text)
def test_what_is_written_is_read(tmp_path, sizes, height, source, notes):
    person = Person(CardboxSizes.from_array(sizes), height, source, notes.replace("\r", ""))
    write_person(tmp_path / "person.toml", person)
    assert read_person(tmp_path / "person.toml") == person


@pytest.mark.parametrize("body", WHOLE)
def test_whole_people_are_written_and_read_too(tmp_path, body):
    person = Person(average_sizes(body, 1.81), 1.81, "training joints", "")
    write_person(tmp_path / "person.toml", person)
    assert f'body = "{body}"' in (tmp_path / "person.toml").read_text()
    assert read_person(tmp_path / "person.toml") == person


def test_upper_bodies_share_their_sizes_and_others_do_not(tmp_path):
    upper, whole = Person(SIZES), Person(average_sizes("anatomical", 1.7))
    write_person(tmp_path / "upper.toml", upper)
    write_person(tmp_path / "whole.toml", whole)
    for body in ("rounded", "cardbox", "boxes"):
        assert read_person(tmp_path / "upper.toml", body) == upper
    assert read_person(tmp_path / "whole.toml", "anatomical") == whole
    for file, body, other in (("upper", "anatomical", "rounded"), ("whole", "cylinders", "anatomical"), ("whole", "boxes", "anatomical")):
        with pytest.raises(FormatError, match=rf"{file}.toml: sizes: found those of the body '{other}', expected those of '{body}'"):
            read_person(tmp_path / f"{file}.toml", body)


def test_files_from_before_there_were_whole_bodies_are_read(tmp_path):
    write_person(tmp_path / "person.toml", Person(SIZES, 1.8))
    text = (tmp_path / "person.toml").read_text()
    assert "body" not in text
    (tmp_path / "person.toml").write_text('body = "cardbox"\n' + text)
    assert read_person(tmp_path / "person.toml") == Person(SIZES, 1.8)


def lines(**changes: str | None) -> str:
    values = {name: str(value) for name, value in zip(SIZES.names(), SIZES.to_array())} | changes
    return "".join(f"{name} = {value}\n" for name, value in values.items() if value is not None)


def test_a_file_written_by_hand_needs_the_sizes_only(tmp_path):
    (tmp_path / "person.toml").write_text("[sizes]\n" + lines())
    assert read_person(tmp_path / "person.toml") == Person(SIZES)


@pytest.mark.parametrize(("content", "said"), [
    ("", "sizes: found None, expected a table \\[sizes\\] with elbow_width, "),
    ("sizes = 3", "sizes: found 3, expected a table"),
    ("[sizes]\n" + lines(neck_gap=None), "sizes: missing neck_gap; the sizes are: elbow_width"),
    ("[sizes]\n" + lines(leg_length="1.0"), "sizes: unknown leg_length; the sizes are"),
    ("[sizes]\n" + lines(head_width='"wide"'), "sizes: head_width: found 'wide', expected a number of metres"),
    ("[sizes]\n" + lines(head_width="230"), "size head_width: found 230.0, expected 0.005 to 2.0 metres"),
    ("[sizes]\n" + lines(head_width="nan"), "size head_width: found nan"),
    ("[sizes]\n" + lines(head_width="9" * 400), "sizes: head_width: found 999+, expected a number of metres"),
    ("height = " + "9" * 400 + "\n[sizes]\n" + lines(), "height: found 999+, expected 0.5 to 2.5 metres"),
    ("weight = 70\n[sizes]\n" + lines(), "found the key 'weight'; keys known: body, height, notes, sizes, source"),
    ("height = 183\n[sizes]\n" + lines(), r"height: found 183, expected 0.5 to 2.5 metres \(183 cm are 1.83\)"),
    ("height = true\n[sizes]\n" + lines(), "height: found True"),
    ("source = 7\n[sizes]\n" + lines(), "source: found 7, expected text in quotes"),
    ("height = \n", "not valid TOML"),
    ('body = "ball"\n[sizes]\n' + lines(), "body: found 'ball', expected one of anatomical, boxes, cardbox, cardbox_bends"),
    ("body = 3\n[sizes]\n" + lines(), "body: found 3, expected one of"),
    ('body = "anatomical"\n[sizes]\n' + lines(), "sizes: unknown .*; the sizes are: ankle_height"),
    ('body = "cylinders"\n', "sizes: found None, expected a table \\[sizes\\] with ankle_height"),
])
def test_what_cannot_be_is_said(tmp_path, content, said):
    (tmp_path / "person.toml").write_text(content)
    with pytest.raises(FormatError, match=rf"person\.toml: {said}"):
        read_person(tmp_path / "person.toml")


def test_files_that_cannot_be_opened_are_said(tmp_path):
    with pytest.raises(FormatError, match=r"person.toml: cannot be read \(no such file"):
        read_person(tmp_path / "person.toml")
    with pytest.raises(ShadowPuppetError, match=r"person.toml: cannot be written \(no such file"):
        write_person(tmp_path / "no" / "person.toml", Person(SIZES))
    with pytest.raises(ShadowPuppetError, match=r"height: found 5, expected 0.5 to 2.5 metres"):
        Person(SIZES, 5)
