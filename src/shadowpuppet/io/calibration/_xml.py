"""Reads XML of motion capture systems and OpenCV, without entities, with limited depth; which of a system's cameras make films."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import cast
from xml.etree.ElementTree import Element, ParseError, XMLPullParser

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.draft import numbers_of, text_of
from shadowpuppet.io.calibration.keys import unknown_keys
from shadowpuppet.names import composed
from shadowpuppet.video import FILM_SUFFIXES

MAX_DEPTH = 40
"""Greatest depth of nested elements; calibrations have seven levels."""


def tree_of(path: Path) -> Element:
    """The root of an XML file. Raises `CalibrationError`, also for a file with definitions (DOCTYPE, ENTITY)."""
    text = text_of(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise CalibrationError(f"{path}: found definitions of its own (DOCTYPE), expected plain XML, as calibrations are")
    parser, root, depth = XMLPullParser(("start", "end")), None, 0
    try:
        for start in range(0, len(text), 4096):
            parser.feed(text[start : start + 4096])
            for event, element in cast("Iterator[tuple[str, Element]]", parser.read_events()):
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                if depth > MAX_DEPTH:
                    raise CalibrationError(f"{path}: found more than {MAX_DEPTH} levels of XML, expected a calibration")
        parser.close()
    except (ParseError, ValueError) as error:
        raise CalibrationError(f"{path}: not valid XML: {error}") from None
    if root is None:
        raise CalibrationError(f"{path}: not valid XML: no element in it")
    return root


class Entry:
    """An XML element from which numbers are read; errors name its camera."""

    def __init__(self, path: Path, camera: str, element: Element) -> None:
        """`camera`: its name in messages."""
        self.path, self.camera, self.element = path, camera, element

    def child(self, tag: str) -> Entry:
        """The first child with this tag, or path of tags. Raises `CalibrationError` if it is missing."""
        found = self.element.find(tag)
        if found is None:
            raise CalibrationError(f"{self.path}: camera {self.camera!r}: <{tag}>: missing")
        return Entry(self.path, self.camera, found)

    def unknown(self, known: Iterable[str]) -> Iterator[str]:
        """Attributes of the element that are not known (`unknown_keys`). Raises `CalibrationError` for one that may move points."""
        values = {key: _value(text) for key, text in self.element.attrib.items()}
        return unknown_keys(f"{self.path}: camera {self.camera!r}: ", values, known)

    def numbers(self, key: str, counts: tuple[int, ...] = (1,), without: str | None = None) -> Array:
        """Numbers of attribute `key`, one of `counts` in number; `without`: text used if it is missing. Raises `CalibrationError`."""
        value = self.element.get(key, without)
        found = numbers_of(value, counts)
        if found is None:
            shown = "nothing" if value is None else repr(value[:60])
            raise CalibrationError(f"{self.path}: camera {self.camera!r}: {key}: found {shown}, expected "
                                   f"{' or '.join(map(str, counts))} finite numbers")
        return found

    def number(self, key: str, without: str | None = None) -> float:
        """The number of attribute `key`; `without`: text used if it is missing. Raises `CalibrationError`."""
        return float(self.numbers(key, (1,), without)[0])


def _value(text: str) -> str | float:
    """An attribute's number, or its text."""
    number = numbers_of(text, (1,))
    return text if number is None else float(number[0])


def entries(path: Path, root: Element, tag: str, name: str) -> Iterator[Entry]:
    """Elements with tag `tag`, one per camera, named by their attribute `name`, or numbered."""
    for n, element in enumerate(root.iterfind(tag)):
        yield Entry(path, element.get(name) or str(n + 1), element)


FOR_FILMS = re.compile("video|hybrid", re.IGNORECASE)
"""Kinds of cameras that make films; others do, too, if their program is set so."""


def of_films(path: Path, cameras: Sequence[Entry], kind: str) -> list[Entry]:
    """The cameras of a calibration file that have a film beside it or in the recording around it, and those made for films by their
    attribute `kind`; all if there is neither."""
    there = _filmed(path)
    return [entry for entry in cameras
            if composed(entry.camera) in there or FOR_FILMS.search(entry.element.get(kind, ""))] or list(cameras)


def _filmed(path: Path) -> set[str]:
    """Names of the films, and of folders of pictures, in the recording in which a calibration lies."""
    folder = path.parent.parent if path.parent.name.lower() == "calibration" else path.parent
    names = set[str]()
    for place in (folder, folder / "video", folder / "videos"):
        inside = list(place.iterdir()) if place.is_dir() else []
        names |= {each.stem for each in inside if each.suffix.lower() in FILM_SUFFIXES}
        names |= {each.name for each in inside if place != folder and each.is_dir()}
    return set(map(composed, names))
