"""Names of landmarks in other programs' files, and values of files in few words."""

from __future__ import annotations

import re
from collections.abc import Sequence

from shadowpuppet.camera.keypoints import LANDMARKS
from shadowpuppet.errors import ShadowPuppetError, shown, warn
from shadowpuppet.io.files.table import shorten

UNUSED = "-"
"""Name of a landmark that is known, and not used."""
COMPACT = {landmark.replace("_", ""): landmark for landmark in LANDMARKS}
OTHERS = {"footindex": "bigtoe", "toe": "bigtoe", "littletoe": "smalltoe", "little": "pinky", "pelvis": "midhip", "tophead": "headtop"}
"""Other programs' names of landmarks, without side and underscores."""
WORDS = re.compile("[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}


def known_names(names: Sequence[str]) -> dict[str, int]:
    """Place of each landmark in a file's list, by its name here; warns of those that are not used. Raises `ShadowPuppetError` if none is
    known, or one is there twice."""
    found, left = dict[str, int](), list[str]()
    for n, name in enumerate(names):
        landmark = landmark_of(name)
        if landmark in found:
            raise ShadowPuppetError(f"names: found {names[found[landmark]]!r} and {name!r}, expected every landmark once")
        if landmark is not None:
            found[landmark] = n
        elif name != UNUSED:
            left.append(name)
    if not found:
        raise ShadowPuppetError(f"names: found {shorten(names)!r}, expected some of {', '.join(LANDMARKS)}")
    if left:
        warn(f"keypoints: landmarks that are not known are left out: {shorten(left)}; known: {', '.join(LANDMARKS)}")
    return found


def landmark_of(name: str) -> str | None:
    """A landmark's name here by another program's, such as `LShoulder` or `ankle_right`; None if it is not known."""
    words = [word.lower() for word in WORDS.findall(name[:80])]
    side = "".join(SIDES[word] for word in words if word in SIDES)
    part = "".join(word for word in words if word not in SIDES)
    return COMPACT.get(side + OTHERS.get(part, part))


def brief(value: object) -> str:
    """A value for a message, in few words: it may be nested deeply."""
    return f"a list of {len(value)}" if isinstance(value, list) else "a table" if isinstance(value, dict) else shown(value)[:80]
