"""Whole people before one camera or two: made films of people who walk, turn, sit down, squat, kneel and stand, tracked whole.

    python benchmarks/whole_people.py [--pairs] [--films "walk across;squat"] [--body rounded] [--against FILE] [--json FILE]
                                     [--markdown docs/accuracy.md]

The films are made where they are missing, in build/whole_people. One camera's lens and the person's height are known, the camera's place
over the floor in every other film; `calibrate_doubt.py` chooses the factors of doubt of a whole body by them. With `--pairs` two calibrated
cameras stand 60 to 120 degrees apart, and the height is known in every other film.
"""

from __future__ import annotations

import argparse
import json
import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import postures
import smallest
from faults import into_page
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.motion.limbs import joints_of_limbs, limb_of
from shadowpuppet.motion.metrics import FAR_ERROR, joint_errors
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Obstacle, Scene, Spec, Viewpoint
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.person.mannequin import PersonKind

HERE = Path(__file__).resolve().parent.parent / "build" / "whole_people"
TABLES = ("whole people", "pairs")
NEAR = 0.1
"""Error (m) below which a doubtful joint is a false alarm."""
WALK, LINE, ROUND = Gesture(motion="walk", seconds=5.0), {"path": "line", "size": 2.2}, {"path": "circle", "size": 1.0}


def _motion(name: str) -> tuple[Gesture, ...]:
    """A motion of five seconds: `line` and `round` are walks."""
    if name in ("line", "round"):
        return (replace(WALK, **(LINE if name == "line" else ROUND)),)
    return tuple(Gesture(motion=part, seconds=5.0 / len(name.split("+"))) for part in name.split("+"))  # pyright: ignore[reportArgumentType]


FILMS: tuple[tuple[str, PersonKind, str, float, float, float, float], ...] = (
    # name, kind of the body, motions, turn of the person (degrees), the camera's distance and height (m) and field of view (degrees)
    ("walk across", "man", "line", 90, 5.0, 1.4, 55),
    ("walk toward", "woman", "line", 0, 5.0, 1.1, 50),
    ("walk aslant", "child", "line", 45, 4.2, 1.3, 52),
    ("walk away", "woman", "line", -150, 4.6, 1.6, 55),
    ("circle", "man", "round", 20, 5.0, 1.5, 52),
    ("circle, high", "woman", "round", -60, 5.2, 2.3, 50),
    ("circle, child", "child", "round", 120, 4.4, 1.0, 50),
    ("jog across", "man", "jog", 60, 6.0, 1.2, 55),
    ("sit down", "woman", "sit_down", 0, 3.6, 1.1, 52),
    ("sit down, aslant", "man", "sit_down", 40, 4.0, 1.5, 50),
    ("sit down, from the side", "child", "sit_down", 80, 3.4, 1.2, 50),
    ("sits and reaches", "man", "reach+wave_hands", 25, 3.6, 1.2, 50),
    ("sits, from the side", "woman", "forearms_up+reach", -70, 3.8, 1.4, 50),
    ("squat", "woman", "squat", 0, 3.6, 1.1, 52),
    ("squat, aslant", "man", "squat", 50, 4.2, 1.7, 50),
    ("kneel", "man", "kneel", -30, 4.0, 1.2, 52),
    ("lift", "woman", "lift", 35, 3.8, 1.3, 52),
    ("turn around", "man", "turn_around", 0, 3.8, 1.2, 52),
    ("reach", "woman", "reach+overhead", 15, 3.6, 1.2, 52),
    ("box", "man", "box", -20, 3.8, 1.3, 52),
    ("march", "child", "march", 30, 3.4, 1.0, 50),
    ("any motion", "woman", "random_body", 0, 4.0, 1.5, 52),
)


PAIRS: tuple[tuple[str, PersonKind, str, float, float, float, float], ...] = (
    # name, kind of the body, motions, turn of the person, angle between the cameras (degrees), their distance and height (m)
    ("walk toward", "man", "line", 0, 75, 4.2, 1.6),
    ("walk toward, aslant", "woman", "line", 20, 60, 4.4, 1.4),
    ("walk across", "man", "line", 90, 90, 4.8, 1.3),
    ("circle", "woman", "round", 0, 100, 4.4, 1.6),
    ("circle, child", "child", "round", 90, 70, 3.8, 1.2),
    ("jog", "man", "jog", 40, 110, 4.4, 1.5),
    ("reach", "woman", "reach+wave_hands", 0, 115, 3.8, 1.5),
    ("box", "man", "box", 15, 65, 3.8, 1.4),
    ("squat", "woman", "squat", -20, 80, 3.8, 1.7),
    ("lift", "man", "lift", 30, 120, 4.0, 1.4),
    ("turn around", "woman", "turn_around", 0, 95, 4.0, 1.5),
    ("any motion", "child", "random_body", 10, 85, 3.6, 1.2),
)


def pairs(shift: int = 0) -> tuple[postures.Film, ...]:
    """The films of two cameras, five seconds each; with a `shift` of other people, clothes and rooms."""
    out = list[postures.Film]()
    for n, (name, kind, motion, turn, apart, distance, height) in enumerate(PAIRS):
        seed = 300 + n + shift
        body = Mannequin.draw(np.random.default_rng(seed), kind)
        pitch = float(np.degrees(np.arctan((height - 0.52 * body.stature) / distance)))
        view = Viewpoint(distance=distance, height=height, fov_deg=52, pitch_deg=pitch)
        cameras = tuple(replace(view, name=f"cam{k}", azimuth_deg=side * apart / 2) for k, side in enumerate((-1, 1), 1))
        scene = Scene(clothing=seed, room=seed, empty_seconds=2.0, noise=(2.5, 4.0, 6.0)[n % 3])
        spec = Spec(name="pair_" + re.sub(r"\W+", "_", name), body=body, motion=_motion(motion), scene=scene, cameras=cameras,
                    turn_deg=turn, training=(), tells=("nothing", "height")[n % 2], seed=(24, seed))
        out.append(postures.Film(name, spec))
    return tuple(out)


def films(shift: int = 0) -> tuple[postures.Film, ...]:
    """The films, five seconds each; with a `shift` of other people, clothes and rooms."""
    out = list[postures.Film]()
    for n, (name, kind, motion, turn, distance, height, fov) in enumerate(FILMS):
        seed = 200 + n + shift
        body, seated = Mannequin.draw(np.random.default_rng(seed), kind), name.startswith("sits")
        posture: PostureName = "seated" if seated else "standing"
        pitch = float(np.degrees(np.arctan((height - 0.52 * body.stature) / distance))) if height > 1.45 else 0.0
        view = Viewpoint(height=height, distance=distance, fov_deg=fov, pitch_deg=pitch)
        chair = (Obstacle(kind="chair", seat=True),) if seated or motion == "sit_down" else ()
        scene = Scene(clothing=seed, room=seed, empty_seconds=2.0, noise=(2.5, 4.0, 6.0)[n % 3], obstacles=chair)
        spec = Spec(name=re.sub(r"\W+", "_", name), body=body, posture=posture, motion=_motion(motion), scene=scene, cameras=(view,),
                    turn_deg=turn, tells="height", seed=(23, seed))
        out.append(postures.Film(name, spec, "anatomical"))
    return tuple(out)


def made(film: postures.Film, folder: Path) -> Path:
    """Folder of the recording; made if it is missing. Every other film's camera has no known place."""
    path = postures.made(film, folder)
    if len(film.spec.cameras) > 1:
        return path
    calibration = path / "calibration.toml"
    text = calibration.read_text("utf-8")
    if not is_placed(film) and "oriented" not in text:
        calibration.write_text(re.sub(r"(?m)^(rotation *=)", r"oriented = false\n\1", text, count=1), encoding="utf-8")
    return path


def is_placed(film: postures.Film) -> bool:
    """Whether the camera's place over the floor is known."""
    seed = film.spec.seed
    return isinstance(seed, int) or seed[-1] % 2 == 0


class Figures(NamedTuple):
    """A film's figures."""

    upper: float
    """Mean error of neck, shoulders and arms, mm; a missing joint counts 500."""
    legs: float
    """The same of the legs; not a number without."""
    far: float
    """Share of the joints that are over 300 mm off, per cent."""
    silent: float
    """Share of the joints that are, and vouched for, per cent."""
    alarms: float
    """Share of the joints under 100 mm off whose limb is called doubtful, per cent."""
    exchanged: float
    """Share of the frames whose mean error is less by half with left and right exchanged, per cent."""

    def line(self, name: str, before: Figures | None = None) -> str:
        """The row as Markdown, with the figures `before` in brackets."""
        def cell(key: str) -> str:
            now, then = getattr(self, key), None if before is None else getattr(before, key)
            text = "" if np.isnan(now) else f"{now:.0f}" if key in ("upper", "legs") else f"{now:.1f}"
            return text if then is None else f"{text} ({then:.0f})"

        return f"| {name} | " + " | ".join(map(cell, self._fields)) + " |"


HEAD = ("| film | arms and neck, mm | legs, mm | over 300 mm, % | and vouched for, % | under 100 mm, doubtful, % | exchanged, % |\n"
        "|---|" + "---:|" * 6)


def measured(film: postures.Film, folder: Path, body: str | None, out: Path | None = None) -> Figures:
    """Track the film, and compare it with the truth."""
    path = made(film, folder)
    truth, options = read_truth(path / "truth.csv"), make_options({"body": body} if body else {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return figures_of(track_recording(path, out or path / "run", options).motion, truth)


def figures_of(motion: Motion, truth: JointTable) -> Figures:
    """A run's motion compared with the truth."""
    names = [name for name in motion.table.names if name in truth.names]
    errors = joint_errors(motion.table, truth, names)
    mirrored = JointTable(truth.times, tuple(map(_other, truth.names)), truth.positions)
    exchanged = joint_errors(motion.table, mirrored, names).distance.mean(1) < errors.distance.mean(1) / 2
    leg = np.array([limb_of(name).endswith("leg") for name in errors.names])
    upper = ~leg & np.array([name not in ("pelvis", "head") for name in errors.names])
    doubtful = _doubtful(motion, errors.names)[: len(errors.distance)]
    far, near = errors.known & (errors.distance > FAR_ERROR), errors.known & (errors.distance < NEAR)
    means = [1000 * float(errors.distance[:, part][errors.known[:, part]].mean()) if part.any() else np.nan for part in (upper, leg)]
    return Figures(*means, *(100 * float(part.sum() / max(of.sum(), 1)) for part, of in
                             ((far, errors.known), (far & ~doubtful, errors.known), (near & doubtful, near))),
                   100 * float(exchanged.mean()))


def _other(name: str) -> str:
    """The joint of the other side."""
    side, _, joint = name.partition("_")
    return f"{SIDES[1 - SIDES.index(side)]}_{joint}" if side in SIDES else name


def _doubtful(motion: Motion, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """Whether each joint's limb (T, J) is doubtful, or the frame has no joints."""
    limbs = list(joints_of_limbs(motion.table.names))
    columns = [limbs.index(limb_of(name)) for name in names]
    return np.array([[status[column] != "tracked" for column in columns] for status in motion.limb_status])


def mean_of(figures: Sequence[Figures]) -> Figures:
    """Means of several films."""
    return Figures(*np.nanmean(np.array(figures), axis=0).tolist())


def _smallest(folder: Path) -> list[object]:
    page = smallest.copy(HERE.parents[1] / "docs" / "accuracy.md", folder)
    return ["--films", "box", "--small", "--folder", folder, "--markdown", page, "--json", folder / "figures.json"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--films", default="", help="names, with ; between them; all without")
    parser.add_argument("--pairs", action="store_true", help="the films of two cameras")
    parser.add_argument("--body", default="anatomical", help="body to track with; empty: the default")
    parser.add_argument("--shift", type=int, default=0, help="other people, clothes and rooms")
    parser.add_argument("--folder", type=Path, default=HERE, help="where the films are, or are made")
    parser.add_argument("--small", action="store_true", help="films of few and small pictures")
    parser.add_argument("--runs", type=Path, help="keep the runs there")
    parser.add_argument("--against", type=Path, help="figures of an earlier run, shown in brackets")
    parser.add_argument("--json", type=Path, help="write the figures there")
    parser.add_argument("--markdown", type=Path, help="write the table there too, at its place in docs/accuracy.md")
    args = smallest.parse(parser, _smallest)
    before = {} if args.against is None else {name: Figures(**values) for name, values in json.loads(args.against.read_text()).items()}
    found, lines = dict[str, Figures](), [HEAD]
    print(HEAD)
    for film in postures.chosen(args.films, args.small, (pairs if args.pairs else films)(args.shift)):
        found[film.name] = measured(film, args.folder, args.body, None if args.runs is None else args.runs / film.spec.name)
        lines.append(found[film.name].line(film.name, before.get(film.name)))
        print(lines[-1], flush=True)
    then = [before[name] for name in found if name in before]
    lines.append(mean_of(list(found.values())).line("mean", mean_of(then) if then else None))
    print(lines[-1])
    if args.markdown is not None:
        into_page(args.markdown, TABLES[args.pairs], "\n".join(lines))
    if args.json is not None:
        args.json.write_text(json.dumps({name: each._asdict() for name, each in found.items()}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
