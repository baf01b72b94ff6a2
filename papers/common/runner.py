"""The command line of a paper's experiments."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from papers.common.experiment import Experiment, Outcome, Request
from papers.common.fingerprint import Fingerprint
from papers.common.writing import claims_table, markdown, write_outcome
from shadowpuppet.errors import ShadowPuppetError, reason


def main(paper: str, about: str, experiments: Sequence[Experiment], argv: Sequence[str] | None = None,
         add: Callable[[argparse.ArgumentParser], object] | None = None,
         fingerprint: Callable[[Request], Fingerprint] | None = None) -> int:
    """Run the named experiments, or list them all; the exit code, 2 for input that cannot be used.

    `add` adds the paper's own options to the parser; their values are in `Request.more`. `fingerprint`: of what results on made recordings
    depend on.
    """
    parser = _parser(paper, about, experiments)
    own = set(vars(parser.parse_args([])))
    if add is not None:
        add(parser)
    args = parser.parse_args(argv)
    if not args.names:
        print(_listed(about, experiments))
        return 0
    known = {experiment.name: experiment for experiment in experiments}
    if wrong := [name for name in args.names if name not in (*known, "all")]:
        parser.error(f"found {wrong[0]!r}, expected one of {', '.join([*known, 'all'])}")
    more = {name: value for name, value in vars(args).items() if name not in own}
    flags = tuple(_flag(name, value) for name, value in more.items() if value != parser.get_default(name))
    request = Request(args.output, tuple(args.recording), 1, args.seed, args.short, args.workers, _tell, more, flags)
    try:
        _make_folder(request.output)
        if fingerprint is not None and not (args.short or request.recordings):  # the page is of made recordings
            request = replace(request, fingerprint=fingerprint(request))
        for name in dict.fromkeys(known if "all" in args.names else args.names):
            run(paper, known[name], replace(request, runs=args.runs or _runs(known[name], args.short)), list(known).index(name))
    except ShadowPuppetError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"interrupted: what was finished is in {request.output}", file=sys.stderr)
        return 130
    return 0


def run(paper: str, experiment: Experiment, request: Request, number: int = 0) -> Outcome:
    """Run the `number`-th experiment, and print seeds and results. Raises `ShadowPuppetError`."""
    takes = "some seconds" if request.short else experiment.takes
    repeated = "" if request.runs == 1 else f" to {request.seeds[-1]}"
    print(f"{experiment.name}: {experiment.title}\nseed {request.seed}{repeated}; takes {takes}", flush=True)
    start = time.perf_counter()
    outcome = experiment.make(request)
    seconds = time.perf_counter() - start
    write_outcome(paper, experiment, request, outcome, seconds, number)
    print(text(experiment, request, outcome, seconds), flush=True)
    return outcome


def text(experiment: Experiment, request: Request, outcome: Outcome, seconds: float) -> str:
    """The report printed at the end: short tables, sentences, files, claims."""
    tables = [markdown(table.columns, table.rows) for table in outcome.tables.values() if table.shown]
    names = [*(f"{name}.png" for name in outcome.pictures), *(f"{name}.csv" for name in outcome.tables), f"{experiment.name}.json"]
    parts = [*tables, *outcome.said, f"{seconds:.0f} s; in {request.output}: {', '.join(names)}"]
    return "\n\n".join(["", *parts, *([claims_table(outcome.verdicts)] if outcome.verdicts else [])]) + "\n"


def _parser(paper: str, about: str, experiments: Sequence[Experiment]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m papers.{paper}", description=about, epilog=_listed("", experiments),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which of those below, or all; none: they are listed")
    parser.add_argument("--recording", nargs="+", type=Path, default=[], metavar="FOLDER", help="recordings in place of made ones")
    parser.add_argument("--runs", type=_positive, help="repetitions; left out, as many as in the paper")
    parser.add_argument("--seed", type=_natural, default=0, help="of the first run; the next has the next")
    parser.add_argument("--short", action="store_true", help="a small version that takes some seconds, and whose figures mean little")
    parser.add_argument("--workers", type=_positive, default=os.cpu_count() or 1, help="processes (default: one a core)")
    parser.add_argument("-o", "--output", type=Path, default=Path(f"{paper}-results"), help="folder for all that is written")
    return parser


def _listed(about: str, experiments: Sequence[Experiment]) -> str:
    wide = max(len(experiment.name) for experiment in experiments)
    lines = [f"  {experiment.name:{wide}}  {experiment.title} ({experiment.takes})" for experiment in experiments]
    return "\n".join([*([about, ""] if about else []), *lines])


def _runs(experiment: Experiment, short: bool) -> int:
    return experiment.short_runs if short else experiment.runs


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be made ({reason(error)})") from None


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _flag(name: str, value: object) -> str:
    """An option of the paper as on the command line; of a folder the name alone."""
    said = f"--{name.replace('_', '-')}"
    return said if value is True else f"{said} {value.name if isinstance(value, Path) else value}"


def _positive(text: str) -> int:
    return _whole(text, 1)


def _natural(text: str) -> int:
    return _whole(text, 0)


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number from {least}")
    return value
