"""What rules are worth: how often the code behind thresholds runs on a set of films, and what films lose when a rule is switched off.

    python benchmarks/rules.py [--count] [--switch SWITCH]... [--films "ground;rings/rings_jog"] [--seeds 5] [--silhouettes]
        [--shared ../shared] [--out build/rules]

`rule_films.py` has the films: the proving grounds, faults, postures, people, whole people before one camera and two, five made people, and
real films where they are.

`--count` tracks each film once, with one seed, and lists the lines of `ROOMS` that never ran, or in few films only, with the named
constants in them and in the conditions around them. Lines of compiled kernels are not counted, nor are values that arrays select.

`--switch` tracks each film with the package as it is and with rules switched off: a name in `rule_switches.SWITCHES`, or edits with ` + `
between them. Each switch has a process and, where the rule is in compiled code, kernels of its own. A film refused counts as lost. `se` is
the standard error of the difference in pairs of film and seed: differences within two of them are not significant; `noise` is the standard
error of the mean that seeds alone make.

`--silhouettes` tracks nothing and needs no seeds: the error is that of the silhouettes against exact ones, thousandths of their area.

Every finished run is a JSON line in `--out`; another start does the missing ones.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rule_films
import smallest
from counted_lines import COMPILED, called, is_text
from rule_films import LOST_MM, films
from rule_switches import PACKAGE, ROOT, SWITCHES, copied, fingerprint, parsed
from speed.chain import ONE_THREAD_EACH

ROOMS = ("tracking", "silhouette", "motion", "body", "calibration", "pipeline/person.py", "pipeline/person_rig.py", "pipeline/rig.py",
         "pipeline/subject.py")  # fmt: skip
FEW = 1
"""Number of films up to which a line counts as one of few films."""
SHOWN = ("error", "silent", "false", "tracked", "overlap", "ms")


class Statement(NamedTuple):
    """A statement, or the head of one that holds others."""

    first: int
    last: int
    constants: tuple[str, ...]
    """Named in it, and in the conditions around it."""


class Piece(NamedTuple):
    """Statements of a function, one after another, that ran in the same number of films."""

    file: str
    first: int
    last: int
    ran: int
    """Number of films."""
    films: tuple[str, ...]
    constants: tuple[str, ...]
    """Named in the statements, and in the conditions around them."""


def runs(switch: str, labels: Sequence[str], args: argparse.Namespace, lines: bool = False) -> list[dict[str, Any]]:
    """The runs of films by their labels with a switch: those that are missing are made in a process of their own."""
    edits = [parsed(text) for text in SWITCHES.get(switch) or ([] if switch == "base" else switch.split(" + "))]
    args.out.mkdir(parents=True, exist_ok=True)
    environment = copied(edits, args.out / "packages", counted=lines) | ONE_THREAD_EACH
    state = fingerprint({path.relative_to(PACKAGE): path.read_text("utf-8") for path in sorted(PACKAGE.rglob("*.py"))})
    name, flags = hashlib.sha256(f"{state} {switch}".encode()).hexdigest()[:12], ["--lines"] * lines
    flags += ["--silhouettes"] * (args.silhouettes and not lines)
    out, seeds = args.out / f"{name}{''.join(flags)}.jsonl", 1 if flags else args.seeds
    command = [sys.executable, rule_films.__file__, args.out / "films", out, args.shared, str(seeds), *labels]
    subprocess.run([*map(str, command), *flags], env=environment, check=True)
    found = [json.loads(line) for line in out.read_text("utf-8").splitlines()]
    return [each for each in found if each["film"] in labels and each["seed"] < seeds]


def pieces(found: Sequence[Mapping[str, Any]], package: Path = PACKAGE) -> Iterator[Piece]:
    """Parts of functions in `ROOMS` that ran in `FEW` of the runs or none; without compiled functions."""
    for path in sorted(package.rglob("*.py")):
        file = path.relative_to(package).as_posix()
        if not file.startswith(ROOMS):
            continue
        ran: dict[int, list[str]] = {}
        for each in found:
            for line in each.get("lines", {}).get(file, ()):
                ran.setdefault(line, []).append(each["film"])
        last: Piece | None = None
        for first, end, names in statements(ast.parse(path.read_text("utf-8"))):
            there = tuple(dict.fromkeys(film for line in range(first, end + 1) for film in ran.get(line, ())))
            if len(there) > FEW:
                continue
            if last is not None and last.films == there and first <= last.last + 2:
                last = last._replace(last=max(end, last.last), constants=tuple(dict.fromkeys([*last.constants, *names])))
                continue
            if last is not None:
                yield last
            last = Piece(file, first, end, len(there), there, names)
        if last is not None:
            yield last


def statements(tree: ast.AST, around: tuple[str, ...] = (), within: bool = False) -> list[Statement]:
    """The statements of functions that are not compiled, in order. `around`: constants in the conditions around the tree; `within`: the
    tree is part of a function."""
    out = list[Statement]()
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.FunctionDef) and any(called(each) in COMPILED for each in child.decorator_list):
            continue
        head = [part for part in (getattr(child, name, None) for name in ("test", "iter")) if isinstance(part, ast.AST)]
        guarded = _joined(around, *head)
        defines = isinstance(child, (ast.FunctionDef, ast.ClassDef))
        if within and isinstance(child, ast.stmt) and not defines and not is_text(child):
            body = getattr(child, "body", None)
            last = max(child.lineno, body[0].lineno - 1 if body else child.end_lineno or 0)
            out.append(Statement(child.lineno, last, guarded if body else _joined(around, child)))
        out += statements(child, guarded, within or isinstance(child, ast.FunctionDef))
    return sorted(out)


def constants(node: ast.AST) -> list[str]:
    """Names in upper case in a part of the code."""
    return [each.id for each in ast.walk(node) if isinstance(each, ast.Name) and each.id.isupper() and len(each.id) > 1]


def _joined(names: tuple[str, ...], *parts: ast.AST) -> tuple[str, ...]:
    return tuple(dict.fromkeys([*names, *(name for part in parts for name in constants(part))]))


def count_table(found: Iterable[Piece], number: int) -> str:
    """A line a piece, as Markdown."""
    lines = [f"| lines | films of {number} | constants |", "|---|---|---|"]
    lines += [f"| {each.file}:{each.first}-{each.last} | {', '.join(each.films) or 0} | {', '.join(each.constants)} |" for each in found]
    return "\n".join(lines)


def compared(base: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> list[str]:
    """The cells of a switch: each of `SHOWN` as it is and as it becomes, with the standard error of the error's difference and the noise of
    seeds."""
    ours, theirs = ({(each["film"], each["seed"]): each for each in some} for some in (base, other))
    keys = [key for key in ours if key in theirs]
    cells = []
    for name in SHOWN:
        before, after = (np.array([_value(some[key], name) for key in keys]) for some in (ours, theirs))
        known = np.isfinite(before) & np.isfinite(after)
        if not known.any():
            cells += [""] * (3 if name == "error" else 1)
            continue
        digits = 3 if name == "overlap" else 1
        cells.append(f"{before[known].mean():.{digits}f} -> {after[known].mean():.{digits}f}")
        if name == "error":
            apart = (after - before)[known]
            se = apart.std(ddof=1) / np.sqrt(len(apart)) if len(apart) > 1 else np.nan
            cells += [f"{se:.2f}", f"{noise({key: value for key, value, there in zip(keys, before, known) if there}):.2f}"]
    return cells


def noise(values: Mapping[tuple[str, int], float]) -> float:
    """Standard error of the mean of values by film and seed that the seeds alone make; not a number with one seed."""
    of_films = [[value for (film, _), value in values.items() if film == name] for name in dict.fromkeys(film for film, _ in values)]
    spread = [np.var(some, ddof=1) / len(some) for some in of_films if len(some) > 1]
    return float(np.sqrt(np.sum(spread)) / len(spread)) if spread else float("nan")


def _value(found: Mapping[str, Any], name: str) -> float:
    """A measure of a run; of a film that was refused its error is that of a lost one."""
    lost = {"error": LOST_MM, "tracked": 0.0, "overlap": 0.0} if "refused" in found else {}
    return float(found.get(name, lost.get(name, np.nan)))


def switch_table(rows: Mapping[str, list[str]]) -> str:
    """A line a switch, as Markdown; errors are millimetres, or thousandths with `--silhouettes`."""
    heads = ["error", "se", "noise", "silent, %", "false alarms, %", "tracked, %", "overlap", "ms"]
    lines = ["| switched off | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    return "\n".join([*lines, *(f"| {name} | " + " | ".join(cells) + " |" for name, cells in rows.items())])


def chosen(text: str, shared: Path) -> list[str]:
    """Labels of the films of groups, or of films, with ; between them; all without. Raises `SystemExit` for an unknown one."""
    labels, wanted = [film.label for film in films(shared)], [each.strip() for each in text.split(";") if each.strip()]
    if wanted == ["tiny"]:
        return wanted
    for each in wanted:
        if not any(label == each or label.startswith(each + "/") for label in labels):
            raise SystemExit(f"films: found {each!r}; there are the groups {', '.join(rule_films.GROUPS)} and: {'; '.join(labels)}")
    return [label for label in labels if not wanted or any(label == each or label.startswith(each + "/") for each in wanted)]


def _smallest(folder: Path) -> list[object]:
    return ["--count", "--films", "tiny", "--seeds", 1, "--out", folder, "--shared", folder,
            "--switch", "tracking/status.py:UNCERTAIN_OVERLAP=0.0"]  # fmt: skip


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", action="store_true", help="list the lines that never ran")
    parser.add_argument("--switch", action="append", default=[], help="a rule to switch off; again for more")
    parser.add_argument("--films", default="", help="groups or films, with ; between them; all without")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--silhouettes", action="store_true", help="compare silhouettes alone")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with real/ and recordings/")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "rules", help="where films and runs are, or are made")
    args = smallest.parse(parser, _smallest)
    labels = chosen(args.films, args.shared)
    if args.count:
        found = runs("base", labels, args, lines=True)
        print(count_table(pieces(found), len(found)))
    if args.switch:
        base = runs("base", labels, args)
        rows = dict[str, list[str]]()
        for switch in args.switch:
            rows[switch] = compared(base, runs(switch, labels, args))
        print(switch_table(rows))


if __name__ == "__main__":
    main()
