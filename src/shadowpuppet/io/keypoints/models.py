"""Models of detectors: which landmark each number of a network stands for. A dash is a point that is not used here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.io.keypoints.names import UNUSED, brief, landmark_of

BODY = ("nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist left_hip "
        "right_hip left_knee right_knee left_ankle right_ankle")  # fmt: skip
HAND = "- - - - - {0}_index - - - - - - - - - - - {0}_pinky - - -"
TABLES = {
    "COCO_17": BODY,
    "HALPE_26": f"{BODY} head_top neck mid_hip left_big_toe right_big_toe left_small_toe right_small_toe left_heel right_heel",
    "COCO_133": f"{BODY} left_big_toe left_small_toe left_heel right_big_toe right_small_toe right_heel {'- ' * 68}"
                f"{HAND.format('left')} {HAND.format('right')}",
    "BODY_25": "nose neck right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist mid_hip right_hip right_knee "
               "right_ankle left_hip left_knee left_ankle right_eye left_eye right_ear left_ear left_big_toe left_small_toe left_heel "
               "right_big_toe right_small_toe right_heel",
    "BODY_25B": f"{BODY} neck head_top left_big_toe left_small_toe left_heel right_big_toe right_small_toe right_heel",
    "OPENPOSE_18": "nose neck right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist right_hip right_knee right_ankle "
                   "left_hip left_knee left_ankle right_eye left_eye right_ear left_ear",
    "MEDIAPIPE_33": "nose - left_eye - - right_eye - left_ear right_ear - - left_shoulder right_shoulder left_elbow right_elbow left_wrist "
                    "right_wrist left_pinky right_pinky left_index right_index - - left_hip right_hip left_knee right_knee left_ankle "
                    "right_ankle left_heel right_heel left_big_toe right_big_toe",
}  # fmt: skip
"""Landmarks by number, of each model. BODY_25, which is the more common, comes before BODY_25B."""
MODELS = {name: tuple(table.split()) for name, table in TABLES.items()}
ORIGINS = {"MEDIAPIPE_33": 0.5}
"""Place of the first pixel's centre, where it is not 0."""
OTHER_NAMES = {"body_with_feet": "HALPE_26", "lower_body": "HALPE_26", "body": "COCO_17", "whole_body": "COCO_133",
               "whole_body_wrist": "COCO_133", "coco_133_wrist": "COCO_133", "coco": "OPENPOSE_18", "blazepose": "MEDIAPIPE_33"}
"""Pose2Sim's names of the models."""


class Model(NamedTuple):
    """What the numbers of a network stand for."""

    name: str
    landmarks: tuple[str, ...]
    """By number, K of them; `UNUSED` for what is not used."""

    @property
    def origin(self) -> float:
        """Place of the first pixel's centre."""
        return ORIGINS.get(self.name, 0.0)


def stated_model(stated: Any) -> Model:
    """The model that a name states, or a tree of landmarks with names and ids (Pose2Sim's CUSTOM). Raises `ShadowPuppetError`."""
    if isinstance(stated, str):
        known = {name.lower(): name for name in MODELS} | OTHER_NAMES
        name = known.get(stated.lower())
        if name is None:
            raise ShadowPuppetError(f"model: found {brief(stated)}, expected one of {choices(MODELS)}")
        return Model(name, MODELS[name])
    by_id = dict(_branches(stated, 0))
    if not by_id:
        raise ShadowPuppetError(f"model: found {brief(stated)}, expected its name, or a tree of tables with name, id and children")
    return Model("CUSTOM", tuple(by_id.get(n, UNUSED) for n in range(max(by_id) + 1)))


def _branches(tree: Any, depth: int) -> Iterator[tuple[int, str]]:
    """Ids and names in a tree; the nodes without a number are points that Pose2Sim computes."""
    for node in tree if isinstance(tree, list) else [tree]:
        if isinstance(node, dict) and depth < len(MODELS["COCO_17"]):
            name, number = node.get("name"), node.get("id")
            if isinstance(name, str) and isinstance(number, int) and 0 <= number < len(MODELS["COCO_133"]):
                yield number, "mid_hip" if name.lower() == "hip" else name
            yield from _branches(node.get("children", []), depth + 1)


def model_by_count(count: int, names: Sequence[str] = ()) -> Model:
    """The model with a number of landmarks; `names`: those that the file states for them, if it does. Raises `ShadowPuppetError`."""
    found = next((Model(name, table) for name, table in MODELS.items() if len(table) == count), None)
    stated = [landmark_of(name) for name in names]
    if len(names) == count and (found is None or any(name not in (None, known) for name, known in zip(stated, found.landmarks))):
        return Model("CUSTOM", tuple(names))
    if found is None:
        raise ShadowPuppetError(f"found {count} landmarks a person, expected a model of {choices(MODELS)}, with "
                                f"{', '.join(str(len(table)) for table in MODELS.values())}")
    return found
