"""The scene of a run of several people: all puppets in one world, their truths, the cameras' films, overlaps and angles over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.people import known_truths
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.viewer.scene.figures import joint_figure
from shadowpuppet.viewer.scene.of_run import run_scene
from shadowpuppet.viewer.scene.scene import Chart, Stage

TINTS = ((40, 50, 70), (150, 60, 190), (20, 130, 90), (190, 120, 10), (190, 40, 70), (30, 110, 190))
"""Colours mixed into the people's, in order; the seventh person has the first's again."""


def people_scene(folder: str | Path, folders: Mapping[int, Path], recording: str | Path | None = None) -> Stage:
    """The scene of a run of several people, whose runs are in `folders` by number; `recording` replaces the one that it names. Raises a
    `ShadowPuppetError`.

    Truths are truth_1.csv, truth_2.csv, ... of the recording. The run with the lowest number gives films and hull points.
    """
    scenes = {number: run_scene(path, None, recording, films=number == min(folders)) for number, path in folders.items()}
    first, problems = scenes[min(scenes)], [problem for scene in scenes.values() for problem in scene.problems]
    figures = [replace(figure, name=f"person {number}", tint=TINTS[(number - 1) % len(TINTS)])
               for number, scene in scenes.items() for figure in scene.figures if figure.kind == "estimate"]
    try:
        figures += [joint_figure(f"truth {n}", read_truth(path), "truth") for n, path in enumerate(known_truths(folder), 1)]
    except ShadowPuppetError as error:
        problems.append(f"no truth is shown: {error}")
    times = np.unique(np.concatenate([scene.times for scene in scenes.values()]).round(6))
    counts = {f"person {number}": scene.facts["frames"] for number, scene in scenes.items()}
    facts = {"run": str(folder), **{key: value for key, value in first.facts.items() if key not in ("run", "frames")}, **counts}
    return replace(first, title=Path(folder).resolve().name, times=times, figures=tuple(figures),
                   charts=(*_overlaps(scenes), *_others(scenes)), cloud=None, facts=facts,
                   notes=tuple(dict.fromkeys(note for scene in scenes.values() for note in scene.notes)),
                   problems=tuple(dict.fromkeys(problems)))


def _overlaps(scenes: Mapping[int, Stage]) -> list[Chart]:
    """One chart of all people's overlaps, at the times of the first person with one."""
    own = {number: chart for number, scene in scenes.items() for chart in scene.charts if chart.name == "overlap"}
    if not own:
        return []
    base = next(iter(own.values()))
    curves = {f"person {number}": np.interp(base.times, chart.times, chart.curves["overlap"], left=np.nan, right=np.nan)
              for number, chart in own.items()}
    return [replace(base, curves=curves)]


def _others(scenes: Mapping[int, Stage]) -> list[Chart]:
    return [replace(chart, name=f"person {number}, {chart.name}")
            for number, scene in scenes.items() for chart in scene.charts if chart.name != "overlap"]
