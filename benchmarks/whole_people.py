"""Whole people before one camera: made films of people who walk, turn, sit down, squat, kneel and stand, tracked with the whole body.

    python benchmarks/whole_people.py [--films "walk across;squat"] [--body rounded] [--against FILE] [--json FILE]
                                     [--markdown docs/accuracy.md]

The films are made where they are missing, in build/whole_people. The camera's lens and the person's height are known; its place over the
floor in every other film. `calibrate_doubt.py` chooses the factors of doubt of a whole body by them.
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

from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.motion.limbs import joints_of_limbs, limb_of
from shadowpuppet.motion.metrics import FAR_ERROR, joint_errors
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Obstacle, Scene, Spec, Viewpoint
from shadowpuppet.synthetic.movement.resting import PostureName
from shadowpuppet.synthetic.person.mannequin import PersonKind

HERE = Path(__file__).resolve().parent.parent / "build" / "whole_people"
TABLE = "whole people"
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

    def line(self, name: str, before: Figures | None = None) -> str:
        """The row as Markdown, with the figures `before` in brackets."""
        def cell(key: str) -> str:
            now, then = getattr(self, key), None if before is None else getattr(before, key)
            text = f"{now:.0f}" if key in ("upper", "legs") else f"{now:.1f}"
            return text if then is None else f"{text} ({then:.0f})"

        return f"| {name} | " + " | ".join(map(cell, self._fields)) + " |"


HEAD = "| film | arms and neck, mm | legs, mm | over 300 mm, % | and vouched for, % | under 100 mm, doubtful, % |\n|---|" + "---:|" * 5


def measured(film: postures.Film, folder: Path, body: str | None, out: Path | None = None) -> Figures:
    """Track the film, and compare it with the truth."""
    path = made(film, folder)
    truth, options = read_truth(path / "truth.csv"), make_options({"body": body} if body else {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = track_recording(path, out or path / "run", options).motion
    errors = joint_errors(motion.table, truth, [name for name in motion.table.names if name in truth.names],
                          camera=open_rig(path, options).cameras[0])
    leg = np.array([limb_of(name).endswith("leg") for name in errors.names])
    upper = ~leg & np.array([name not in ("pelvis", "head") for name in errors.names])
    doubtful = _doubtful(motion, errors.names)[: len(errors.distance)]
    far, near = errors.known & (errors.distance > FAR_ERROR), errors.known & (errors.distance < NEAR)
    means = [1000 * float(errors.distance[:, part][errors.known[:, part]].mean()) if part.any() else np.nan for part in (upper, leg)]
    return Figures(*means, *(100 * float(part.sum() / max(of.sum(), 1)) for part, of in
                             ((far, errors.known), (far & ~doubtful, errors.known), (near & doubtful, near))))


def _doubtful(motion: Motion, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """Whether each joint's limb (T, J) is doubtful, or the frame has no joints."""
    limbs = list(joints_of_limbs(motion.table.names))
    columns = [limbs.index(limb_of(name)) for name in names]
    return np.array([[status[column] != "tracked" for column in columns] for status in motion.limb_status])


def _mean(figures: Sequence[Figures]) -> Figures:
    return Figures(*np.nanmean(np.array(figures), axis=0).tolist())


def _smallest(folder: Path) -> list[object]:
    page = smallest.copy(HERE.parents[1] / "docs" / "accuracy.md", folder)
    return ["--films", "box", "--small", "--folder", folder, "--markdown", page, "--json", folder / "figures.json"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--films", default="", help="names, with ; between them; all without")
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
    for film in postures.chosen(args.films, args.small, films(args.shift)):
        found[film.name] = measured(film, args.folder, args.body, None if args.runs is None else args.runs / film.spec.name)
        lines.append(found[film.name].line(film.name, before.get(film.name)))
        print(lines[-1], flush=True)
    then = [before[name] for name in found if name in before]
    lines.append(_mean(list(found.values())).line("mean", _mean(then) if then else None))
    print(lines[-1])
    if args.markdown is not None:
        into_page(args.markdown, TABLE, "\n".join(lines))
    if args.json is not None:
        args.json.write_text(json.dumps({name: each._asdict() for name, each in found.items()}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
