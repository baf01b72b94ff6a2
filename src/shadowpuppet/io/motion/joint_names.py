"""Our joint names, and their names in other programs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.errors import FormatError
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.names import composed

JOINTS = tuple(dict.fromkeys(joint for bone in BONES for joint in bone))
"""Our names."""
CENTRAL = {
    "pelvis": ("pelvis", "hips", "midhip", "chip", "spinebase", "hip", "pelo", "torsodistal"),
    "neck": ("neck", "necktwist01", "necklower", "neck01", "trxo", "thorax", "torsoproximal"),
    "head": ("head", "hedo", "headbase", "headproximal"),
}
"""Other names of joints without a side, in order of preference; lower case, letters and digits only.

`pelo`, `trxo`, ... are virtual markers of Vicon's gait model, as HumanEva's motion files have them, and `torsodistal`, ... the same in
its own programs; `hips`, `upleg`, `forearm` are Mixamo's and the CMU database's in BVH; `shldr`, `shin` Poser's, `shldrbend`,
... its later figures' (DAZ); `uarm`, `farm` Motive's; `necktwist01`, `calf`, `mid1` iClone's, after `CC_Base_`. COCO, HALPE_26 and BODY_25
call joints as we do, with `midhip` (OpenPose), `chip` (Pose2Sim) or `hip` (HALPE_26) for the pelvis.
"""
SIDED = {
    # beside `arm`, `shoulder` is a collar bone's
    "shoulder": ("sjc", "arm", "upperarm", "uparm", "uarm", "shldr", "shldrbend", "shoulder", "clo", "upperarmproximal"),
    "elbow": ("ejc", "elbow", "forearm", "farm", "forearmbend", "lowerarm", "lowarm", "huo", "lowerarmproximal"),
    "wrist": ("wjc", "wrist", "hand", "rao", "lowerarmdistal"),
    "hand": ("handmiddle1", "hand", "fingerbase", "middle1", "mid1", "hno"),
    "hip": ("hjc", "upleg", "upperleg", "thigh", "thighbend", "hip", "fep", "upperlegproximal"),
    "knee": ("kjc", "knee", "leg", "lowerleg", "lowleg", "shin", "calf", "feo", "lowerlegproximal"),
    "ankle": ("ajc", "ankle", "foot", "tio", "lowerlegdistal"),
    "heel": ("heel",),
    "toe": ("bigtoe",),  # `toe`, `toebase`: other points of other programs
}
"""The same for joints with a side. `hand` is the wrist if there is no other name for it; `hjc`, ... are OpenSim's joint centres."""
EITHER_SIDE = {
    "elbow": (("lelbow", "melbow"), ("elbowlat", "elbowmed"), ("lel", "mel")),
    "wrist": (("lwrist", "mwrist"), ("wristlat", "wristmed"), ("faradius", "faulna")),
    "knee": (("knee", "mknee"), ("kneelat", "kneemed"), ("lfc", "mfc")),
    "ankle": (("ankle", "mankle"), ("anklelat", "anklemed"), ("lmal", "mmal")),
}
"""Pairs of markers on the skin, lateral and medial, with the joint midway: OpenCap's, OpenSim's Gait2392's and Rajagopal2015's. A complete
pair is preferred to other names of the joint."""
STEMS = {stem for stems in SIDED.values() for stem in stems} | {stem for pairs in EITHER_SIDE.values() for pair in pairs for stem in pair}
SUFFIX = re.compile(r"_study$")
"""Suffix of OpenCap's markers."""
HUMANEVA = re.compile(r"^(upper|lower)([LR])(Arm|Leg)(Proximal|Distal)$")
"""HumanEva's names have the side in the middle."""
PREFIXES = re.compile(r"^(?:.*[:|]|mixamorig\d*_|bip0*1[ _]|character1_|cc_base_|rl_)", re.IGNORECASE)
"""Prefixes of joint names: of the person, or the program."""
WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
"""Matches the words of a name like LeftUpLeg, left_up_leg, L UpLeg."""
LETTERS = {"l": "left", "r": "right", "left": "left", "right": "right"}


def read_names(path: str | Path) -> dict[str, str]:
    """A file's names of our joints, by ours, from a TOML file with lines like `left_shoulder = "Bone_17"`. Raises `FormatError`."""
    path = Path(path)
    found = read_toml(path, FormatError)
    for ours, theirs in found.items():
        if ours not in JOINTS:
            raise FormatError(f"{path}: found the joint {shorten([ours], 60)!r}, expected some of {', '.join(JOINTS)}")
        if not isinstance(theirs, str) or not theirs:
            raise FormatError(f"{path}: {ours}: found {shorten([repr(theirs)], 60)}, expected the name of a joint, in quotes")
        if list(found.values()).count(theirs) > 1:
            raise FormatError(f"{path}: {ours}: found {shorten([theirs], 60)!r}, which another joint has, too")
    if not found:
        raise FormatError(f"{path}: found no names, expected lines such as left_shoulder = \"Bone_17\"")
    return found


def with_names(names: Sequence[str], given: Mapping[str, str]) -> tuple[str, ...]:
    """A file's names, with ours where `given` (by ours) has them; another joint of that name gets a number. Raises `FormatError` if a name
    that is given is not there."""
    there = set(map(composed, names))
    missing = [theirs for theirs in given.values() if composed(theirs) not in there]
    if missing:
        raise FormatError(f"names: found {shorten(missing[:1], 60)!r}, which is no joint of the file; there are: {shorten(names, 400)}")
    ours = {composed(theirs): name for name, theirs in given.items()}
    taken = {name for name in given if given[name] != name}
    return tuple(ours.get(composed(name), f"{name}#2" if name in taken else name) for name in names)


def renamed(table: JointTable) -> JointTable:
    """Our joints in a table, by our names and in our order.

    A joint with a pair of markers is their midpoint. A missing `pelvis` is the midpoint of the hips. If there is also a nose, the head is
    taken for the crown, as in 2D detectors, and left out. Raises `FormatError` if no joint is known.
    """
    columns, pairs = columns_of(table.names), pairs_of(table.names)
    if not columns and not pairs:
        raise FormatError(f"found no joint of a known name among {shorten(table.names)!r}, expected such as {', '.join(JOINTS[:5])}; or "
                          "LeftArm, LeftForeArm, LeftUpLeg, ...; or LCLO, LHUO, LFEP, ... (Vicon)")
    places = {joint: table.positions[:, column] for joint, column in columns.items()}
    places |= {joint: table.positions[:, pair].mean(1) for joint, pair in pairs.items()}
    if "pelvis" not in places and {"left_hip", "right_hip"} <= set(places):
        places["pelvis"] = (places["left_hip"] + places["right_hip"]) / 2
    names = tuple(joint for joint in JOINTS if joint in places)
    return JointTable(table.times, names, np.stack([places[name] for name in names], 1))


def columns_of(names: Sequence[str]) -> dict[str, int]:
    """For each of our joints that is in `names`, its index there."""
    found = {name.lower(): n for n, name in enumerate(names) if name.lower() in JOINTS}
    stems: dict[tuple[str, str], int] = {stem: n for n, stem in reversed([*enumerate(map(side_and_stem, names))])}
    taken = set(found.values())
    wanted = [(joint, "", others) for joint, others in CENTRAL.items()]
    wanted += [(f"{side}_{joint}", side, others) for side in ("left", "right") for joint, others in SIDED.items()]
    for name, side, others in wanted:
        column = next((stems[side, stem] for stem in others if stems.get((side, stem), -1) not in {-1, *taken}), None)
        if name not in found and column is not None:
            found[name] = column
            taken.add(column)
    if ("", "nose") in stems:
        found.pop("head", None)
    return found


def pairs_of(names: Sequence[str]) -> dict[str, list[int]]:
    """For each of our joints that is not in `names` but has a pair of markers there, the indices of the pair."""
    stems = {stem: n for n, stem in reversed([*enumerate(map(side_and_stem, names))])}
    ours = {name.lower() for name in names}
    found = {}
    for side in ("left", "right"):
        for joint, pairs in EITHER_SIDE.items():
            there = [pair for pair in pairs if {(side, stem) for stem in pair} <= stems.keys()]
            if there and f"{side}_{joint}" not in ours:
                found[f"{side}_{joint}"] = [stems[side, stem] for stem in there[0]]
    return found


def side_and_stem(name: str) -> tuple[str, str]:
    """A name's side (`left`, `right` or empty), and the rest in lower case without separators."""
    bare = SUFFIX.sub("", PREFIXES.sub("", name))
    if limb := HUMANEVA.match(bare):
        level, side, part, end = limb.groups()
        return LETTERS[side.lower()], f"{level}{part}{end}".lower()
    words = [word.lower() for word in WORDS.findall(bare)]
    if len(words) > 1 and words[0] in LETTERS:
        return LETTERS[words[0]], "".join(words[1:])
    if len(words) > 1 and words[-1] in LETTERS:
        return LETTERS[words[-1]], "".join(words[:-1])
    whole = "".join(words)
    for start, side in (("left", "left"), ("right", "right"), ("l", "left"), ("r", "right")):
        if whole.startswith(start) and whole.removeprefix(start) in STEMS:
            return side, whole.removeprefix(start)
    return "", whole
