"""What faults of the pictures do to the joints, and whether they are noticed: a fixed set of faults on made films, for docs/faults.md.

    python benchmarks/faults.py [--rows "crf 32;nudged by 5 pixels"] [--cameras one|several|both] [--seeds 1] [--markdown FILE]

`fault_rows.py` has films and faults. The films are made where they are missing, or of another spec, in build/faults (--again: all of them);
each is tracked as `shadowpuppet track` does it, always with this code, with several seeds: a film with one camera may be off by half more
with one seed than with the next. A row's figures are over all its films and seeds. Frames in which the person cannot be seen by any
camera are in no error; a frame without joints counts 500 mm for each. Without films half an hour on two cores.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import groupby
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import smallest
from fault_rows import CLEAN, ONE, SEVERAL, Row, films_of_one, films_of_several, tiny
from speed.chain import ONE_THREAD_EACH

from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.people import person_folder
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.metrics import FAR_ERROR, LOST_ERROR, joint_errors, overlap
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.pipeline.findings.verdict import expected_error
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.silhouette_cache import SilhouetteCache
from shadowpuppet.pipeline.track import Summary, track_recording
from shadowpuppet.synthetic import Spec, read_spec, synthesize
from shadowpuppet.synthetic.faults.kinds import KINDS
from shadowpuppet.video import open_frames

HERE = Path(__file__).resolve().parent.parent / "build" / "faults"
PLACE = r"(<!-- table: {} -->\n).*?(<!-- end of table -->)"
NEAR = 0.1
"""Joint error (m) below which a doubtful limb is a false alarm."""
WRONG = 2.0
"""Ratio to the clean film's error above which a run is to be called bad."""
SURE = 3
"""Number of good frames after which a person is recovered."""
ONE_CAMERA, FOUR_CAMERAS = "one camera", "four cameras"
SEEDS = {ONE_CAMERA: 5, FOUR_CAMERAS: 3}
"""Number of runs of each film, with the seeds 0, 1, ..."""


class Measures(NamedTuple):
    """A film's run, frame by frame."""

    times: Array
    """Seconds, of shape (T,)."""
    mean: Array
    """Mean joint error, of shape (T,), metres; not a number where the person cannot be seen."""
    worst: Array
    """Greatest joint error of the frame, of shape (T,), metres; not a number where the person cannot be seen, or no joint is known."""
    status: np.ndarray
    """Of shape (T,)."""
    vouched: np.ndarray
    """Whether any limb is vouched for, of shape (T,)."""
    judged: Array
    """Number of joints (T, 5): all, far off, those of them in limbs that are `tracked`, near the truth, and those of them in others."""
    overlap: Array
    """Intersection over union of silhouettes and exact masks of the cameras as calibrated, mean of the cameras, of shape (T,); not a number
    where the person cannot be seen."""
    aside: tuple[str, ...] = ()
    """Cameras that are set aside, and why, of each frame; empty where none is."""
    refused: str = ""
    """Why the film could not be tracked."""
    verdict: str = "bad"
    """The run's verdict on itself."""
    expected: float = np.nan
    """Mean joint error, metres, that the stated standard deviations lead one to expect."""


def place_of(film: Spec, row: Row, folder: Path) -> Path:
    """Folder of the recording with the fault."""
    return folder / f"{film.name} {row.name}".replace(" ", "_").replace(":", "")


def made(film: Spec, row: Row, folder: Path, again: bool) -> Path:
    """Folder of the recording with the fault; made if it is missing or of another spec."""
    spec, path = row.of(film), place_of(film, row, folder)
    done = path / "made"
    if again or not done.exists() or read_spec(path / "spec.toml") != spec:
        shutil.rmtree(path, ignore_errors=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a camera that is black sees nothing of the person
            synthesize(spec, path)
        done.touch()
    return path


def measured(film: Spec, row: Row, folder: Path, again: bool, seeds: int) -> list[Measures]:
    """Track the film with the fault, with each seed, and compare it with the truth."""
    path = made(film, row, folder, again)
    exact = _exact_masks(path)
    truth, seen = read_truth(path / "truth.csv"), _seen(exact)
    if any(KINDS[fault.kind].displacement for fault in row.of(film).faults):  # silhouettes belong where the calibrated camera sees them
        exact = _exact_masks(made(film, ONE[0], folder, False))
    return [_measured(path, seed, truth, seen, exact, film.rate) for seed in range(seeds)]


def _measured(path: Path, seed: int, truth: JointTable, seen: Sequence[bool], exact: Sequence[Sequence[np.ndarray]],
              rate: float) -> Measures:
    """One run of a film. seen: whether a camera sees the person, by frame."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            cache, options = SilhouetteCache(), make_options({"seed": seed})
            run = track_recording(path, path / "run", options, cache=cache)
            motion, metrics = nearest_person(path / "run", run, truth)
    except ShadowPuppetError as error:
        count = len(truth.times)
        return Measures(truth.times, np.where(_upto(seen, count), LOST_ERROR, np.nan), np.full(count, np.nan), np.full(count, "lost"),
                        np.zeros(count, bool), np.zeros((count, 5)), np.full(count, np.nan), ("",) * count, str(error))
    mean, worst, judged = _errors(motion, truth)
    shown = _upto(seen, len(motion))
    mean, worst, judged = np.where(shown, mean, np.nan), np.where(shown, worst, np.nan), judged * shown[:, None]
    alike = np.full(len(motion), np.nan)
    for frames in cache.frames(one for one in ()):
        n, at = int(np.abs(motion.times - frames.time).argmin()), round(frames.time * rate)
        values = [overlap(mask, own[at]) for mask, own in zip(frames.seen.masks, exact) if mask is not None and at < len(own)]
        alike[n] = np.nanmean(values) if np.isfinite(values).any() else np.nan
    shutil.rmtree(path / "run")
    vouched = (motion.limb_status == "tracked").any(1)
    return Measures(motion.times, mean, worst, motion.status, vouched, judged, np.where(shown, alike, np.nan),
                    _aside(run, motion), verdict=metrics["verdict"]["word"], expected=expected_error(motion))


def _aside(run: Summary, motion: Motion) -> tuple[str, ...]:
    """For each frame the cameras that are set aside, and why."""
    found = run.metrics.get("set_aside", ())
    return tuple(", ".join(f"{one['camera']} {one['why']}" for one in found if one["from_s"] - 1e-3 <= time <= one["to_s"] + 1e-3)
                 for time in motion.times.tolist())


def nearest_person(folder: Path, run: Summary, truth: JointTable) -> tuple[Motion, dict[str, Any]]:
    """Motion and metrics of a run; of several people those of the one who is nearest to the truth."""
    if "people" not in run.metrics:
        return run.motion, run.metrics
    people = [read_run(person_folder(folder, number)) for number in run.metrics["people"]]
    best = min(people, key=lambda each: float(np.nanmean(_errors(each.motion, truth)[0])))
    return best.motion, best.metrics


def _errors(motion: Motion, truth: JointTable) -> tuple[Array, Array, Array]:
    """Mean and greatest joint error of each frame of the run, (T,) each, metres, and `Measures.judged` (T, 5); a missing joint counts
    0.5 m in the mean, and is neither far off nor near."""
    nearest = np.abs(truth.times[None] - motion.times[:, None]).argmin(1)
    there = JointTable(motion.times, truth.names, truth.positions[nearest])
    found = joint_errors(motion.table, there)
    distance = np.where(found.known, found.distance, np.nan)
    vouched = motion.limb_status[:, [motion.limbs.index(limb_of(name)) for name in found.names]] == "tracked"
    given = found.known & ~found.lost
    far, near = given & (distance > FAR_ERROR), given & (distance < NEAR)
    judged = np.stack([found.known, far, far & vouched, near, near & ~vouched], 2).sum(1)
    blank = ~np.isfinite(distance).any(1)
    distance[blank] = LOST_ERROR
    return np.nanmean(distance, 1), np.where(blank | found.lost.any(1), np.nan, np.nanmax(distance, 1)), judged


def _exact_masks(path: Path) -> list[list[np.ndarray]]:
    """Exact masks (H, W), true or false, by camera in the calibration's order, and frame."""
    return [[frame.image > 0 if frame.image.ndim == 2 else frame.image[..., 0] > 0 for frame in open_frames(film)]
            for film in sorted((path / "masks").iterdir())]


def _seen(exact: Sequence[Sequence[np.ndarray]]) -> list[bool]:
    return [any(bool(camera[n].any()) for camera in exact if n < len(camera)) for n in range(max(map(len, exact)))]


def _upto(seen: Sequence[bool], count: int) -> np.ndarray:
    return np.array([*seen, *[False] * count][:count])


class Figures(NamedTuple):
    """A row of a table: of each film and seed the measures with the fault and of the clean one."""

    row: Row
    runs: list[tuple[Measures, Measures]]
    usual: list[Array]
    """For each run the error of its clean film by frame, (T,), metres, the mean over all seeds: with one seed it may be half as large as
    with the next."""

    def spans(self, one: Measures) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which frames are before, in and after the fault, of shape (T,) each, true or false."""
        before = one.times < self.row.begin - 1e-6
        after = one.times >= self.row.end - 1e-6
        return before, ~before & ~after, after

    def pooled(self, part: int, values: Callable[[Measures], np.ndarray], clean: bool = False) -> np.ndarray:
        """Values of all films' frames in a part: before, in or after the fault; of the clean films in the frames that the others have."""
        parts = []
        for faulty, plain in self.runs:
            of = plain if clean else faulty
            here = self.spans(of)[part]
            if clean:
                shared = min(len(faulty.times), len(plain.times))
                here[shared:] = False
                here[:shared] &= np.isfinite(faulty.mean[:shared])  # where the person can be seen
            parts.append(values(of)[here])
        return np.concatenate(parts)

    def error(self, part: int) -> str:
        """Millimetres, and the clean films' in the same frames in brackets."""
        ours, plain = (1000 * self.pooled(part, lambda one: one.mean, clean) for clean in (False, True))
        if not np.isfinite(ours).any():
            return "-" if ours.size else ""
        return f"{np.nanmean(ours):.0f} ({np.nanmean(plain):.0f})" if self.row.name != CLEAN else f"{np.nanmean(ours):.0f}"

    def masks(self) -> str:
        """Intersection over union in the fault, and the clean films' in brackets."""
        ours, plain = (self.pooled(1, lambda one: one.overlap, clean) for clean in (False, True))
        if not np.isfinite(ours).any():
            return "-"
        return f"{np.nanmean(ours):.3f} ({np.nanmean(plain):.3f})" if self.row.name != CLEAN else f"{np.nanmean(ours):.3f}"

    def status(self) -> str:
        """Per cent of the frames in the fault by status."""
        status = self.pooled(1, lambda one: one.status)
        return "/".join(f"{100 * (status == name).mean():.0f}" for name in ("tracked", "uncertain", "lost", "absent"))

    def judged(self) -> list[str]:
        """In and after the fault, in per cent: joints far off, those of them that are vouched for, of all joints; and doubtful ones of
        those near the truth."""
        joints, far, silent, near, doubted = np.concatenate([self.pooled(part, lambda one: one.judged) for part in (1, 2)]).sum(0)
        shares = far / max(joints, 1), silent / max(joints, 1), doubted / max(near, 1)
        return [f"{100 * share:.{digits}f}" for share, digits in zip(shares, (1, 1, 0))]

    def noticed(self) -> str:
        """Mean time in seconds from its beginning to the first frame that is not `tracked`, has no limb that is, or in which a camera is
        set aside; and which ones are."""
        def said(one: Measures, n: int) -> bool:
            return one.status[n] != "tracked" or not one.vouched[n] or bool(one.aside[n])

        cameras = dict.fromkeys(why for one, _ in self.runs for why in one.aside if why)
        return self._after(self.row.begin, said) + "".join(f"; {why}" for why in cameras) if self.row.begin else "; ".join(cameras)

    def recovered(self) -> str:
        """Mean time in seconds from its end to the first of some good frames."""
        def good(one: Measures, n: int) -> bool:
            these = slice(n, n + SURE)
            return bool((one.status[these] == "tracked").all() and (one.worst[these] <= FAR_ERROR).all())

        return self._after(self.row.end, good) if np.isfinite(self.row.end) else ""

    def _after(self, moment: float, is_so: Callable[[Measures, int], bool]) -> str:
        found = []
        for one, _ in self.runs:
            first = int(np.searchsorted(one.times, moment - 1e-6))
            found.append(next((one.times[n] - moment for n in range(first, len(one.times)) if is_so(one, n)), None))
        known = [max(value, 0.0) for value in found if value is not None]
        of = f" ({len(known)} of {len(found)})" if 0 < len(known) < len(found) else ""
        return f"{np.mean(known):.1f}{of}" if known else "never"

    def line(self) -> str:
        """The row as Markdown."""
        name = self.row.name + (" (refused)" if any(one.refused for one, _ in self.runs) else "")
        verdicts = Counter(one.verdict for one, _ in self.runs)
        cells = [name, *(self.error(part) for part in range(3)), self.masks(), self.status(), *self.judged(), self.noticed(),
                 self.recovered(), ", ".join(f"{word} {verdicts[word]}" for word in ("good", "doubtful", "bad") if verdicts[word])]
        return "| " + " | ".join(cells) + " |"

    def verdicts(self) -> Iterator[tuple[bool, bool]]:
        """For each run whether its error is over twice the clean film's, and whether it is called bad."""
        for (one, _), plain in zip(self.runs, self.usual):
            shared = min(len(one.mean), len(plain))
            known = np.isfinite(one.mean[:shared]) & np.isfinite(plain[:shared])
            yield bool(one.mean[:shared][known].mean() > WRONG * plain[:shared][known].mean()), one.verdict == "bad"


def usual_error(runs: Sequence[Measures]) -> Array:
    """Mean error (T,) of a film's runs by frame, metres; not a number where it is not one in every run."""
    return np.stack([one.mean for one in runs]).mean(0)


HEAD = """| fault | before | in | after | masks | tracked/uncertain/lost/absent | far | silent | doubted | noticed | recovered | verdict |
|---|---|---|---|---|---|---|---|---|---|---|---|"""


def summed_up(runs: Iterable[tuple[bool, bool]]) -> str:
    """The verdicts of a table's runs, in a sentence."""
    told = list(runs)
    wrong, right = [bad for off, bad in told if off], [bad for off, bad in told if not off]
    return (f"Of {len(wrong)} runs with over {WRONG:g} times the clean film's error {sum(wrong)} are called bad, of the {len(right)} "
            f"others {sum(right)}.")


def tables(jobs: Sequence[tuple[str, Spec, Row]], folder: Path, workers: int, again: bool,
           seeds: int | None = None) -> Iterator[tuple[str, Figures]]:
    """The rows of all tables by its name, in order, each as soon as it is measured. seeds: runs of each film; `SEEDS` if left out."""
    os.environ |= ONE_THREAD_EACH
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        clean_films = list({film.name: film for _, film, _ in jobs}.values())
        list(pool.map(made, clean_films, *zip(*[(ONE[0], folder, again)] * len(clean_films))))  # before others need their masks
        results = pool.map(measured, *zip(*[(film, row, folder, again, seeds or SEEDS[table]) for table, film, row in jobs]))
        clean: dict[str, list[Measures]] = {}
        for (table, row), some in groupby(zip(jobs, results), lambda one: (one[0][0], one[0][2])):
            runs, usual = list[tuple[Measures, Measures]](), list[Array]()
            for (_, film, _), found in some:
                plain = clean.setdefault(film.name, found)
                runs += zip(found, plain)
                usual += [usual_error(plain)] * len(found)
            yield table, Figures(row, runs, usual)


def into_page(page: Path, name: str, table: str) -> None:
    """Write a table between its markers in a page, or at the end of a file without markers; a page without this table's leaves it out."""
    text = page.read_text("utf-8") if page.exists() else ""
    place = PLACE.format(name)
    if re.search(place, text, re.DOTALL):
        text = re.sub(place, lambda found: f"{found[1]}{table}\n{found[2]}", text, flags=re.DOTALL)
    elif "<!-- table: " not in text:
        text += f"{name}\n\n{table}\n\n"
    page.write_text(text, encoding="utf-8")


def chosen(text: str, cameras: str, films: int, small: bool) -> list[tuple[str, Spec, Row]]:
    """Table, film and fault of each run; each film's clean run first. Raises `SettingsError` for an unknown name."""
    wanted = [name.strip() for name in text.split(";") if name.strip()]
    known = {row.name for row in (*ONE, *SEVERAL)}
    if unknown := next((name for name in wanted if name not in known), None):
        raise SettingsError(f"rows: found {unknown!r}; there are: {'; '.join(sorted(known))}")
    jobs = []
    for name, rows, made_films in ((ONE_CAMERA, ONE, films_of_one()), (FOUR_CAMERAS, SEVERAL, films_of_several())):
        if cameras not in ("both", {ONE_CAMERA: "one"}.get(name, "several")):
            continue
        for row in rows:
            if not wanted or row.name in wanted or row.name == CLEAN:
                jobs += [(name, tiny(film) if small else film, row) for film in made_films[:films]]
    return jobs


def _smallest(folder: Path) -> list[object]:
    page = smallest.copy(HERE.parents[1] / "docs" / "faults.md", folder)
    return ["--rows", "gain 0.6 for 1.5 s;frozen for 1 s", "--cameras", "one", "--films", 1, "--seeds", 1, "--small", "--workers", 1,
            "--folder", folder, "--markdown", page]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", default="", help="names, with ; between them; all without")
    parser.add_argument("--cameras", choices=("one", "several", "both"), default="both")
    parser.add_argument("--films", type=int, default=9, help="so many of each at most")
    parser.add_argument("--seeds", type=int, help="runs of each film (default: 5 with one camera, 3 with four)")
    parser.add_argument("--small", action="store_true", help="films of few and small pictures")
    parser.add_argument("--folder", type=Path, default=HERE, help="where the films are, or are made")
    parser.add_argument("--again", action="store_true", help="make all films again")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--markdown", type=Path, help="write the tables there too, at their places in docs/faults.md")
    parser.add_argument("--json", type=Path, help="write all frames' measures there")
    args = smallest.parse(parser, _smallest)
    lines, runs, everything = dict[str, list[str]](), dict[str, list[tuple[bool, bool]]](), []
    try:
        jobs = chosen(args.rows, args.cameras, args.films, args.small)
    except SettingsError as error:
        parser.error(str(error))
    for table, figures in tables(jobs, args.folder, args.workers, args.again, args.seeds):
        if table not in lines:
            print(f"\n{table}\n\n{HEAD}", flush=True)
        lines.setdefault(table, [HEAD]).append(figures.line())
        runs.setdefault(table, []).extend(figures.verdicts())
        everything.append(_plain(table, figures))
        print(lines[table][-1], flush=True)
    for table, rows in lines.items():
        print(f"{table}: {summed_up(runs[table])}")
        if args.markdown:
            into_page(args.markdown, table, "\n".join([*rows, "", summed_up(runs[table])]))
    if args.json:
        args.json.write_text(json.dumps(everything) + "\n", encoding="utf-8")


def _plain(table: str, figures: Figures) -> dict[str, Any]:
    runs = [{name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in one._asdict().items()}
            for one, _ in figures.runs]
    return {"table": table, "row": figures.row.name, "runs": runs}


if __name__ == "__main__":
    main()
