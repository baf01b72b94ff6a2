"""Keypoints of a made film, and files of them as the programs write them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.io.files.table import csv_line
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints, film_keypoints, write_keypoints
from shadowpuppet.io.keypoints.models import MODELS

SIZE = (640, 480)
FRAMES = 4


def made_film(rng: np.random.Generator, model: str = "HALPE_26") -> FilmKeypoints:
    """Two persons in all frames but the third, which has none, with some landmarks missing."""
    names = [name for name in MODELS[model] if name != "-"]
    frame = np.array([0, 0, 1, 1, 3, 3])
    xy, confidence = rng.uniform(5, 470, (6, len(names), 2)), rng.uniform(0.1, 1, (6, len(names)))
    confidence[:, 1:] *= rng.random((6, len(names) - 1)) < 0.8
    return film_keypoints(names, frame, np.array([0, 1] * 3), xy, confidence, model, SIZE)


def persons(film: FilmKeypoints, missing: Any) -> Iterator[tuple[int, list[tuple[int, list[list[Any]]]]]]:
    """For each frame its number and, for each person, a number and points of all the model's landmarks, `missing` for some."""
    column = {name: n for n, name in enumerate(film.names)}
    for frame in range(FRAMES):
        seen = film.at(frame)
        everyone = []
        for number, xy, confidence in zip(seen.person.tolist(), seen.xy.tolist(), seen.confidence.tolist()):
            places = [column.get(name) for name in MODELS[film.detector]]
            points = [missing if k is None or not confidence[k] else [*xy[k], confidence[k]] for k in places]
            everyone.append((number, points))
        yield frame, everyone


def flat(points: list[list[Any]]) -> list[Any]:
    return [value for point in points for value in point]


def openpose(folder: Path, film: FilmKeypoints, name: str = "{:012d}_keypoints", missing: Any = (0, 0, 0), **more: Any) -> Path:
    folder.mkdir(parents=True)
    for frame, everyone in persons(film, missing):
        people = [{"person_id": [number], "pose_keypoints_2d": flat(points)} | more for number, points in everyone]
        (folder / f"cam_{name.format(frame)}.json").write_text(json.dumps({"version": 1.3, "people": people}))
    return folder


def mmpose(film: FilmKeypoints, first: int = 0) -> list[Any]:
    return [{"frame_id": frame + first, "instances": [
        {"keypoints": [point[:2] for point in points], "keypoint_scores": [point[2] for point in points], "track_id": number,
         "bbox": [[0, 0, 9, 9]], "bbox_score": 0.9} for number, points in everyone]} for frame, everyone in persons(film, [0, 0, 0])]


def mmpose_demo(film: FilmKeypoints) -> dict[str, Any]:
    names = {str(n): name for n, name in enumerate(MODELS[film.detector])}
    return {"meta_info": {"dataset_name": "made", "keypoint_id2name": names}, "instance_info": mmpose(film, 1)}


def alphapose(film: FilmKeypoints, image: str | None = "{}.jpg", empty: bool = False) -> list[Any]:
    """A list of persons; images are numbers from 1 on if they have no name, and then every frame must have a person, an `empty` one."""
    nobody = [(0, [[0, 0, 0]] * len(MODELS[film.detector]))] if empty else []
    return [{"image_id": frame + 1 if image is None else image.format(frame), "category_id": 1, "keypoints": flat(points), "score": 2.9,
             "idx": number} for frame, everyone in persons(film, [0, 0, 0]) for number, points in everyone or nobody]


def deeplabcut(film: FilmKeypoints, likelihood: str = "likelihood") -> str:
    keys = [(f"person{n}", name, part) for n in (0, 1) for name in film.names for part in ("x", "y", likelihood)]
    rows = [["scorer", *("DLC_made" for _ in keys)], *([word, *column] for word, column in zip(("individuals", "bodyparts", "coords"),
                                                                                              zip(*keys)))]
    for frame in range(FRAMES):
        seen = film.at(frame)
        values = {number: np.column_stack([xy, sure]).ravel() for number, xy, sure in zip(seen.person.tolist(), seen.xy, seen.confidence)}
        whole = np.concatenate([values.get(n, np.full(3 * len(film.names), np.nan)) for n in (0, 1)])
        rows.append([str(frame), *("" if np.isnan(value) else f"{value:.6f}" for value in whole)])
    return "".join(map(csv_line, rows))


def sleap(film: FilmKeypoints) -> str:
    rows = [["track", "frame_idx", "instance.score", *(f"{name}.{part}" for name in film.names for part in ("x", "y", "score"))]]
    for frame, number, xy, sure in zip(film.frame, film.person, film.xy, film.confidence):
        values = np.column_stack([xy, sure]).ravel()
        rows.append([f"track_{number}", str(frame), "0.9", *("" if np.isnan(value) else f"{value:.6f}" for value in values)])
    return "".join(map(csv_line, rows))


def script_output(film: FilmKeypoints, origin: float = 0.5) -> str:
    moved = film_keypoints(film.names, film.frame, film.person, film.xy, film.confidence, film.detector, film.size)
    rows: list[Any] = [{"names": MODELS[film.detector], "detector": film.detector, "origin": origin}]
    for _, everyone in persons(moved, None):
        rows.append({"people": [{"id": number, "points": [point and [point[0] + origin, point[1] + origin, point[2]] for point in points]}
                                for number, points in everyone]})
    return "".join(f"{json.dumps(row)}\n" for row in rows)


def write_all(folder: Path, film: FilmKeypoints) -> dict[str, Path]:
    """The film in every format that is read, by name."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {"own": folder / "own.npz", "openpose": openpose(folder / "openpose", film),
             "pose2sim": openpose(folder / "cam1_json", film, "{:06d}", [float("nan")] * 3)}
    write_keypoints(paths["own"], film)
    texts = {"script.jsonl": script_output(film), "inferencer.json": json.dumps(mmpose(film)), "demo.json": json.dumps(mmpose_demo(film)),
             "alphapose.json": json.dumps(alphapose(film)), "coco.json": json.dumps(alphapose(film, None, empty=True)),
             "deeplabcut.csv": deeplabcut(film), "sleap.csv": sleap(film)}
    for name, text in texts.items():
        paths[Path(name).stem] = folder / name
        (folder / name).write_text(text)
    return paths
