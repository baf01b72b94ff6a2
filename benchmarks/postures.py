"""People who sit, kneel, squat and lie, or walk: made films tracked with defaults, for docs/accuracy.md.

    python benchmarks/postures.py [--films "desk;sits, 3 cameras"] [--folder FOLDER] [--against FILE] [--json FILE] [--markdown FILE]

The films are made where they are missing, in build/postures. One camera knows the person's height only, has no reference pictures, and
tracks the upper body, or with `whole` the whole one; several cameras know nothing of the person. Each film is tracked as
`shadowpuppet track` does it. `--json` keeps the figures, `--against` shows such a file's beside those of now.
"""

from __future__ import annotations

import argparse
import json
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import smallest
from faults import into_page

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.motion.metrics import LOST_ERROR, joint_errors
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Obstacle, Ring, Scene, Spec, Viewpoint, read_spec, synthesize
from shadowpuppet.synthetic.spec_changes import parse_gestures

HERE = Path(__file__).resolve().parent.parent / "build" / "postures"
TABLE = "postures"
HEAD = """| film | mm | apart from the place, mm | knees, degrees | distance, % | height, m (true) | lost, % |
|---|---|---|---|---|---|---|"""
KNEES = tuple(tuple(f"{side}_{joint}" for joint in ("hip", "knee", "ankle")) for side in ("left", "right"))


class Film(NamedTuple):
    """A film, and the body it is tracked with (None: the default)."""

    name: str
    spec: Spec
    body: str | None = None


class Figures(NamedTuple):
    """A film's figures; not a number where there is none."""

    error: float
    """Mean joint error, mm; a missing joint counts 500."""
    aligned: float
    """The same after removing each frame's mean offset."""
    knees: float
    """Mean absolute error of the knees' angles in frames with joints, degrees."""
    distance: float
    """One camera: mean error of the depth of the joints, per cent of the truth; negative: too near."""
    height: float
    """Fitted height, metres."""
    true_height: float
    lost: float
    """Share of the frames without joints, per cent."""

    def line(self, name: str, before: Figures | None = None) -> str:
        """The row as Markdown, with the figures `before` in brackets."""
        def cell(key: str, digits: int) -> str:
            now, then = getattr(self, key), None if before is None else getattr(before, key)
            text = f"{now:.{digits}f}" if np.isfinite(now) else ""
            return text if then is None or not np.isfinite(then) else f"{text} ({then:.{digits}f})"

        height = f"{self.height:.2f} ({self.true_height:.2f})"
        cells = [name, cell("error", 0), cell("aligned", 0), cell("knees", 0), cell("distance", 0), height, cell("lost", 0)]
        return "| " + " | ".join(cells) + " |"


def _person(kind: Any, seed: int) -> Mannequin:
    return Mannequin.draw(np.random.default_rng(seed), kind)


def _one(name: str, body: Mannequin, posture: Any, gestures: str | tuple[Gesture, ...], *, seed: int, chair: str = "none",
         turn: float = 0.0, view: Viewpoint | None = None, whole: bool = False, **scene: Any) -> Film:
    """A film of one camera."""
    seat = Obstacle(kind="chair", seat=True, enters=0.0 if chair == "new" else None)
    height = {"seated": 0.62, "kneeling": 0.62, "lying": 0.6}.get(posture, 0.75) * body.stature
    whole_view = Viewpoint(height=1.1, distance=3.6, fov_deg=50)
    view = view or (whole_view if whole else Viewpoint(height=height, distance=2.1))
    look = {"clothing": seed, "room": seed, "empty_seconds": 2.0, "obstacles": (seat,)[: chair != "none"]} | scene
    motion = parse_gestures(gestures) if isinstance(gestures, str) else gestures
    spec = Spec(name=name.replace(" ", "_").replace(",", ""), body=body, posture=posture, motion=motion, scene=Scene(**look),
                cameras=(view,), turn_deg=turn, tells="height", seed=(19, seed))
    return Film(name, spec, "anatomical" if whole else None)


def _ring(name: str, body: Mannequin, posture: Any, gestures: str, *, seed: int, cameras: int, chair: str = "none") -> Film:
    """A film of several cameras."""
    seat = Obstacle(kind="chair", seat=True, enters=0.0 if chair == "new" else None)
    look = {"clothing": seed, "room": seed, "empty_seconds": 2.0, "obstacles": (seat,)[: chair != "none"]}
    ring = Ring(count=cameras, radius=3.6, height=1.7, start_deg=25, jitter=0.5, fov_deg=46, seed=seed)
    spec = Spec(name=name.replace(" ", "_").replace(",", ""), body=body, posture=posture, motion=parse_gestures(gestures), training=(),
                scene=Scene(**look), ring=ring, rate=8, tells="nothing", seed=(19, seed))
    return Film(name, spec)


def _walk(seconds: float) -> tuple[Gesture, ...]:
    """A walk along a line of two metres, there and back."""
    return (Gesture(motion="walk", seconds=seconds, path="line", size=2.0),)


def films() -> tuple[Film, ...]:
    """All films, some 3 to 6 s each."""
    man, woman, tall, small = _person("man", 81), _person("woman", 82), _person("man", 83), _person("woman", 84)
    child = _person("child", 85)
    desk = Viewpoint(height=0.7 * man.stature, distance=1.3, fov_deg=65)
    home = (Gesture(motion="sit_down", seconds=3.5), Gesture(motion="sit_down", seconds=3.5))
    far = Viewpoint(height=1.4, distance=5.0, fov_deg=55)
    return (
        _one("stands", man, "standing", "reach 3, wave_hands 2", seed=81, view=Viewpoint(height=1.5, distance=2.3)),
        _one("a child stands", child, "standing", "reach 3, wave_hands 2", seed=85),
        _one("at a desk", man, "seated", "forearms_up 2.5, reach 2.5", seed=86, chair="known", view=desk),
        _one("at a desk, new chair", woman, "seated", "forearms_up 2.5, reach 2.5", seed=87, chair="new", view=desk),
        _one("at a desk, tall", tall, "seated", "reach 2.5, wave_hands 2.5", seed=88, chair="known", view=desk),
        _one("sits, new chair", small, "seated", "wave_hands 2.5, reach 2.5", seed=89, chair="new"),
        _one("sits, turned by 60 degrees", woman, "seated", "forearms_up 2.5, reach 2.5", seed=90, chair="known", turn=60),
        _one("sits down", woman, "standing", home, seed=91, chair="known"),
        _one("kneels", man, "kneeling", "wave_hands 2.5, forearms_up 2.5", seed=92),
        _one("stands, whole", tall, "standing", "reach 3, wave_hands 2", seed=94, whole=True),
        _one("sits, whole", man, "seated", "reach 2.5, wave_hands 2.5", seed=95, chair="known", whole=True),
        _one("sits, turned by 60 degrees, whole", woman, "seated", "reach 2.5, wave_hands 2.5", seed=96, chair="known", turn=60,
             whole=True),
        _one("squats, whole", woman, "standing", "squat 4", seed=97, whole=True),
        _one("kneels, whole", small, "kneeling", "wave_hands 2.5, reach 2.5", seed=98, whole=True),
        _one("walks across, whole", man, "standing", _walk(4.0), seed=99, turn=90, whole=True, view=far),
        _one("walks there and back, whole", small, "standing", _walk(5.0), seed=100, whole=True, view=far),
        _ring("sits, 3 cameras", man, "seated", "reach 2.5", seed=101, cameras=3, chair="known"),
        _ring("sits, new chair, 3 cameras", tall, "seated", "reach 2.5", seed=102, cameras=3, chair="new"),
        _ring("sits down, 3 cameras", small, "standing", "sit_down 3", seed=104, cameras=3, chair="known"),
        _ring("squats, 3 cameras", tall, "standing", "squat 3", seed=106, cameras=3),
        _ring("kneels, 3 cameras", woman, "kneeling", "reach 2.5", seed=107, cameras=3),
        _ring("lies, 4 cameras", small, "lying", "reach 2.5", seed=110, cameras=4),
    )


def made(film: Film, folder: Path) -> Path:
    """Folder of the recording; made if it is missing or of another spec."""
    path = folder / film.spec.name
    if not (path / "made").exists() or read_spec(path / "spec.toml") != film.spec:
        shutil.rmtree(path, ignore_errors=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            synthesize(film.spec, path)
        shutil.rmtree(path / "references", ignore_errors=True)
        (path / "made").touch()
    return path


def measured(film: Film, folder: Path, out: Path | None = None, overlay: bool = False) -> Figures:
    """Track the film with defaults, and compare it with the truth."""
    path = made(film, folder)
    truth, stature = read_truth(path / "truth.csv"), float(film.spec.body.stature)
    options = make_options({"overlay": overlay} | ({"body": film.body} if film.body else {}))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = track_recording(path, out or path / "run", options)
    except ShadowPuppetError as error:
        print(f"{film.name}: {error}")
        nan = float("nan")
        return Figures(1000 * LOST_ERROR, nan, nan, nan, nan, stature, 100.0)
    rig = open_rig(path, options)
    errors = joint_errors(run.motion.table, truth, camera=None if rig.is_multiview else rig.cameras[0])
    summary = errors.summary()
    blank = np.isin(run.motion.status, ("lost", "absent"))
    person = getattr(run.look, "person", None) or {}
    height = person.get("height") or run.metrics.get("height") or _stature(person.get("sizes", {}))
    depth = float("nan") if rig.is_multiview else _depth(run.motion.table, truth, rig.cameras[0])
    return Figures(summary["mean_mm"], summary["aligned_mean_mm"], _knees(run.motion, truth), depth, height, stature,
                   100 * float(blank.mean()))


def _stature(sizes: Mapping[str, float]) -> float:
    from shadowpuppet.body.anthropometry import SOLE, stature_of

    return float(stature_of(dict(sizes)) + SOLE) if "thigh_length" in sizes else float("nan")


def _depth(run: JointTable, truth: JointTable, camera: Any) -> float:
    """Median error of the depth of neck and shoulders along the camera's axis, per cent."""
    names = ["neck", "left_shoulder", "right_shoulder"]
    count = min(len(run.times), len(truth.times))
    T = camera.T_camera_world
    ours, theirs = ((table.select(names).positions[:count] @ T[:3, :3].T + T[:3, 3])[..., 2].mean(1) for table in (run, truth))
    return 100 * float(np.nanmedian(ours / theirs - 1)) if np.isfinite(ours).any() else float("nan")


def _knees(motion: Motion, truth: JointTable) -> float:
    """Mean absolute error of the knees' angles, degrees; not a number without legs."""
    if "left_knee" not in motion.table.names:
        return float("nan")
    count = min(len(motion.times), len(truth.times))
    off = [knee_angles(motion.table, names)[:count] - knee_angles(truth, names)[:count] for names in KNEES]
    return float(np.nanmean(np.abs(off))) if np.isfinite(off).any() else float("nan")


def knee_angles(table: JointTable, names: Sequence[str]) -> Array:
    """Angles (T,) at the middle one of three joints, degrees; 180 for a straight leg."""
    hip, knee, ankle = (table.select([name]).positions[:, 0] for name in names)
    up, down = hip - knee, ankle - knee
    cosine = (up * down).sum(1) / (np.linalg.norm(up, axis=1) * np.linalg.norm(down, axis=1))
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def tiny(film: Film) -> Film:
    """The film in few and small pictures, for `--smallest`."""
    views = tuple(replace(view, size=(160, 120)) for view in film.spec.cameras)
    return film._replace(spec=replace(film.spec, cameras=views, rate=5, scene=replace(film.spec.scene, empty_seconds=1)))


def chosen(text: str, small: bool, films: Sequence[Film]) -> Iterator[Film]:
    """Those of the films that are named, with ; between them; all without."""
    wanted = [name.strip() for name in text.split(";") if name.strip()]
    known = {film.name: film for film in films}
    if unknown := next((name for name in wanted if name not in known), None):
        raise SystemExit(f"films: found {unknown!r}; there are: {'; '.join(known)}")
    for name in wanted or known:
        yield tiny(known[name]) if small else known[name]


def _smallest(folder: Path) -> list[object]:
    page = smallest.copy(HERE.parents[1] / "docs" / "accuracy.md", folder)
    return ["--films", "at a desk", "--small", "--folder", folder, "--markdown", page, "--json", folder / "figures.json"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--films", default="", help="names, with ; between them; all without")
    parser.add_argument("--folder", type=Path, default=HERE, help="where the films are, or are made")
    parser.add_argument("--small", action="store_true", help="films of few and small pictures")
    parser.add_argument("--runs", type=Path, help="keep the runs there")
    parser.add_argument("--overlay", action="store_true", help="the runs get overlay.mp4")
    parser.add_argument("--against", type=Path, help="figures of an earlier run, shown in brackets")
    parser.add_argument("--json", type=Path, help="write the figures there")
    parser.add_argument("--markdown", type=Path, help="write the table there too, at its place in docs/accuracy.md")
    args = smallest.parse(parser, _smallest)
    before = {} if args.against is None else {name: Figures(**values) for name, values in json.loads(args.against.read_text()).items()}
    found, lines = dict[str, Figures](), [HEAD]
    print(HEAD)
    for film in chosen(args.films, args.small, films()):
        out = None if args.runs is None else args.runs / film.spec.name
        found[film.name] = measured(film, args.folder, out, args.overlay)
        lines.append(found[film.name].line(film.name, before.get(film.name)))
        print(lines[-1], flush=True)
        if args.json is not None:
            args.json.write_text(json.dumps({name: each._asdict() for name, each in found.items()}, indent=1), encoding="utf-8")
    if args.markdown is not None:
        into_page(args.markdown, TABLE, "\n".join(lines))


if __name__ == "__main__":
    main()
