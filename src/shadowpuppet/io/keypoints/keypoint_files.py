"""Keypoints of a camera's film, in whatever format a detector wrote them: the reader is chosen by the file's ending and content."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.io.keypoints.alphapose import read_alphapose
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints, read_npz
from shadowpuppet.io.keypoints.gathering import json_file
from shadowpuppet.io.keypoints.mmpose import read_mmpose
from shadowpuppet.io.keypoints.models import Model, stated_model
from shadowpuppet.io.keypoints.names import brief
from shadowpuppet.io.keypoints.openpose import read_openpose
from shadowpuppet.io.keypoints.script_output import read_jsonl
from shadowpuppet.io.keypoints.tables import read_keypoint_table
from shadowpuppet.io.projects import sources_in

NEVER = (".h5", ".hdf5", ".slp", ".pickle", ".pkl")
"""Endings of files that are not opened."""
SUFFIXES = (".npz", ".jsonl", ".json", ".csv", *NEVER)
"""Endings of keypoints' files; OpenPose's are a folder."""
ADDED = re.compile("(.+?)(_json|DLC_.*)")
"""A film's name, and what programs add to it."""


@dataclass(frozen=True)
class KeypointSource:
    """Where a camera's keypoints are; nothing is read before it is asked for."""

    path: Path
    """File, or OpenPose's folder."""
    model: Any = None
    """The detector's model, if it is stated beside the file: its name, or Pose2Sim's tree of landmarks."""

    def read(self, size: tuple[int, int]) -> FilmKeypoints:
        """The keypoints of a film of a `size` (width, height). Raises `FormatError`."""
        with errors_named(self.path):
            return read_keypoints(self.path, size, None if self.model is None else stated_model(self.model))


def read_keypoints(path: Path, size: tuple[int, int], model: Model | None = None) -> FilmKeypoints:
    """Keypoints of a film of a `size` (width, height); `model`: what the numbers of a network stand for, if that is stated. Raises
    `FormatError`, naming the file."""
    ending = path.suffix.lower()
    if path.is_dir():
        return read_openpose(path, size, model)
    if ending == ".npz":
        return read_npz(path, size)
    if ending == ".jsonl":
        return read_jsonl(path, size)
    if ending == ".csv":
        return read_keypoint_table(path, size)
    if ending != ".json":
        pickled = ", as such files may hold pickles, which run code when they are read: export a table" if ending in NEVER else ""
        raise FormatError(f"{path}: found no keypoints, expected .npz, .jsonl, .json, .csv or OpenPose's folder{pickled}")
    with errors_named(path):
        values = json_file(path)
        if isinstance(values, dict) and isinstance(values.get("instance_info"), list):
            return read_mmpose(path, values, size, model)
        if isinstance(values, list):
            of_mmpose = any(isinstance(each, dict) and "instances" in each for each in values[:1])
            return (read_mmpose if of_mmpose else read_alphapose)(path, values, size, model)
        raise ShadowPuppetError(f"found {brief(values)}, expected MMPose's or AlphaPose's list, or a folder of OpenPose's")


def keypoints_in(folder: Path) -> dict[str, list[Path]]:
    """Files and folders of keypoints in a folder, by camera: by their names, without what programs add to a film's."""
    found = dict[str, list[Path]]()
    for name, paths in sources_in(folder, SUFFIXES).items():
        added = ADDED.fullmatch(name)
        found.setdefault(added[1] if added else name, []).extend(paths)
    return found
