"""XML of motion capture systems and OpenCV, read without entities, at limited depth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import cast
from xml.etree.ElementTree import Element, ParseError, XMLPullParser

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.draft import numbers_of, text_of

MAX_DEPTH = 40
"""Levels of elements; calibrations have seven."""


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
    """An element that numbers are read from; what is missing is said with the camera it belongs to."""

    def __init__(self, path: Path, camera: str, element: Element) -> None:
        """`camera`: as messages name it."""
        self.path, self.camera, self.element = path, camera, element

    def child(self, tag: str) -> Entry:
        """The first element below with this tag, or way of tags."""
        found = self.element.find(tag)
        if found is None:
            raise CalibrationError(f"{self.path}: camera {self.camera!r}: <{tag}>: missing")
        return Entry(self.path, self.camera, found)

    def numbers(self, key: str, counts: tuple[int, ...] = (1,), without: str | None = None) -> Array:
        """Numbers of an attribute; `without`: what is read where it is missing."""
        value = self.element.get(key, without)
        found = numbers_of(value, counts)
        if found is None:
            shown = "nothing" if value is None else repr(value[:60])
            raise CalibrationError(f"{self.path}: camera {self.camera!r}: {key}: found {shown}, expected "
                                   f"{' or '.join(map(str, counts))} finite numbers")
        return found

    def number(self, key: str, without: str | None = None) -> float:
        """One number."""
        return float(self.numbers(key, (1,), without)[0])


def entries(path: Path, root: Element, tag: str, name: str) -> Iterator[Entry]:
    """Elements of a tag as cameras, named by an attribute."""
    for n, element in enumerate(root.iterfind(tag)):
        yield Entry(path, element.get(name) or str(n + 1), element)
