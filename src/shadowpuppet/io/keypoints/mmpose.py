"""Reads MMPose's predictions of a film: of its inferencer, which counts frames from 0, and of its demo, which counts them from 1.

    [{"frame_id": 0, "instances": [{"keypoints": [[x, y], ...], "keypoint_scores": [...]}]}]
    {"meta_info": {"keypoint_id2name": {...}}, "instance_info": [{"frame_id": 1, "instances": [...]}]}
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Numbered
from shadowpuppet.io.keypoints.models import Model
from shadowpuppet.io.keypoints.names import brief
from shadowpuppet.io.keypoints.openpose import person_id

FRAME_KEYS = ("frame_id", "instances")
PERSON_KEYS = ("keypoints", "keypoint_scores", "track_id", "instance_id", "bbox", "bbox_score", "bbox_scores", "keypoints_visible")
"""Keys that are known; of a person's, the first four are used."""


def read_mmpose(path: Path, values: Any, size: tuple[int, int], model: Model | None = None) -> FilmKeypoints:
    """Keypoints in the values of a file. Raises `ShadowPuppetError`, with only the reason."""
    demo = isinstance(values, dict)
    gathered = Numbered(size, model, _names(values.get("meta_info")) if demo else ())
    if demo:
        gathered.note_keys(values, ("meta_info", "instance_info"))
    for entry in values["instance_info"] if demo else values:
        frame, people = (entry.get(key) for key in FRAME_KEYS) if isinstance(entry, dict) else (None, None)
        if not isinstance(frame, int) or not isinstance(people, list):
            raise ShadowPuppetError(f"found {brief(entry)} with frame_id {brief(frame)} and instances {brief(people)}, expected a whole "
                                    "number and a list")
        gathered.note_keys(entry, FRAME_KEYS)
        for person in people:
            if not isinstance(person, dict) or not isinstance(person.get("keypoint_scores"), list):
                raise ShadowPuppetError(f"instances: found {brief(person)}, expected keypoints and keypoint_scores")
            gathered.note_keys(person, PERSON_KEYS)
            gathered.add(frame - demo, person_id(person.get("track_id", person.get("instance_id"))), person.get("keypoints"),
                         person["keypoint_scores"])
    return gathered.film(path)


def _names(meta: Any) -> list[str]:
    """The landmarks' names by number, where the file states them."""
    names = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if not isinstance(names, dict):
        return []
    return [str(names[key]) for n in range(len(names)) if (key := str(n)) in names]
