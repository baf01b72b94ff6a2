"""Make docs/reproduction.md from the files of experiments.

    python -m papers.common.reproduction FOLDER...

Folders are those that `python -m papers.liu2011 all -o FOLDER` and `python -m papers.ni2008 all -o FOLDER` wrote. A paper's first folder
gives its pictures, figures and tables; further ones of the same paper, such as of another recording, add their answers to the table of
claims. Answers to questions of our own stay in the results, and so do tables of more than `LONGEST` rows that the paper does not have. The
part of a paper without a folder stays as it is.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from papers.common.claims import ANSWERS, DEPENDS, all_of
from papers.common.fingerprint import comment, differences
from papers.common.plotting import LARGEST
from papers.common.writing import markdown
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.text import read_text, write_whole

DOCS = Path(__file__).parents[2] / "docs"
PAGE = "reproduction.md"
KEYS = ("paper", "number", "name", "title", "command", "short", "recordings", "runs", "seconds", "environment", "said", "claims", "tables",
        "pictures")  # fmt: skip

LONGEST = 8
"""Rows of a table in the page, unless it is one of the paper's."""

Summary = dict[str, Any]
"""Contents of an experiment's NAME.json."""


def main(argv: Sequence[str] | None = None) -> int:
    """Parse and build; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m papers.common.reproduction", description="Make docs/reproduction.md of results.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--docs", type=Path, default=DOCS, help="the folder of the page, with assets/ in it")
    args = parser.parse_args(argv)
    try:
        build(args.folders, args.docs)
    except ShadowPuppetError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


def build(folders: Sequence[Path], docs: Path) -> None:
    """Replace the parts of the papers whose results are in the folders. Raises `ShadowPuppetError`."""
    results = [(folder, read_results(folder)) for folder in folders]
    page = read_text(docs / PAGE)
    for paper in dict.fromkeys(result["paper"] for _, found in results for result in found):
        own = [(folder, [each for each in found if each["paper"] == paper]) for folder, found in results]
        own = [(folder, found) for folder, found in own if found]
        place = re.compile(rf"(<!-- {paper} -->\n).*?(<!-- end of {paper} -->)", re.DOTALL)
        if not place.search(page):
            raise ShadowPuppetError(f"{docs / PAGE}: found no place for the results of {paper}, expected a line <!-- {paper} -->")
        text = section([found for _, found in own])
        page = place.sub(lambda match, text=text: f"{match[1]}\n{text}\n{match[2]}", page)
        copy_pictures(*own[0], docs / "assets")
    write_whole(docs / PAGE, page)


def read_results(folder: Path) -> list[Summary]:
    """All experiments' summaries in a folder, in the paper's order. Raises `ShadowPuppetError` where there is none."""
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            result = json.loads(read_text(path))
        except json.JSONDecodeError as error:
            raise ShadowPuppetError(f"{path}: found no JSON in line {error.lineno} ({error.msg.lower()})") from None
        if not isinstance(result, dict) or any(key not in result for key in KEYS):
            raise ShadowPuppetError(f"{path}: found no experiment's summary, expected a table with {', '.join(KEYS)}")
        found.append(result)
    if not found:
        raise ShadowPuppetError(f"{folder}: found no NAME.json of an experiment in it")
    return sorted(found, key=lambda result: result["number"])


def section(folders: Sequence[Sequence[Summary]]) -> str:
    """A paper's part of the page. Raises `ShadowPuppetError` for results of different films or programs."""
    first = folders[0]
    machine = first[0]["environment"]
    paper, made_by = first[0]["paper"], first[0].get("fingerprint", {})
    other = [result["name"] for result in first if differences(made_by, result.get("fingerprint", {}))]
    if other:
        raise ShadowPuppetError(f"{other[0]}: its results are of another film or program than those of {first[0]['name']}; make them "
                                f"again: python -m papers.{paper} all")
    where = f"On {machine['cpu']}, {machine['cores']} cores, {machine['vectors']}; Python {machine['python']}, NumPy {machine['numpy']}."
    parts = [comment(paper, made_by) if made_by else "", where + short_warning(first), "### What the paper says, and what we got",
             count(first), claims(folders), contradictions(first)]
    return "\n\n".join([part for part in parts if part] + [experiment(result) for result in first]) + "\n"


def short_warning(results: Sequence[Summary]) -> str:
    """Says so where results are of short versions."""
    return " **These are results of the short versions, and mean little.**" if any(result["short"] for result in results) else ""


def count(results: Sequence[Summary]) -> str:
    """A sentence on how many claims hold."""
    same = [claim["same"] for result in results for claim in result["claims"] if not claim.get("own")]
    depends = f"{n} depend{'s' * (n == 1)} on how the paper is read, " if (n := same.count(DEPENDS)) else ""
    return (f"Of {len(same)} conclusions {same.count(True)} are the same here, {same.count(False)} are not, {depends}and for "
            f"{same.count(None)} the runs are inconclusive. The criterion for 'the same' is stated in each row, and the answer is "
            "computed.")


def claims(folders: Sequence[Sequence[Summary]]) -> str:
    """The table of the paper's claims: results and answers of the first folder, answers of the further ones."""
    rows: dict[tuple[str, str], list[list[Summary]]] = {}
    for k, results in enumerate(folders):
        for claim in (claim for result in results for claim in result["claims"] if not claim.get("own")):
            rows.setdefault((claim["claim"], claim["where"]), [[] for _ in folders])[k].append(claim)
    named = [recordings(results) for results in folders]
    answer = "same conclusion?" if len(folders) == 1 else "same?"
    columns = ["paper said", "where", "we got" if len(folders) == 1 else f"we got: {named[0]}", answer,
               *(f"{name}: {answer}" for name in named[1:])]  # fmt: skip
    return markdown(columns, [[*key, *judged(row[0]), *(judged(each)[1] for each in row[1:])] for key, row in rows.items()])


def judged(found: Sequence[Summary]) -> tuple[str, str]:
    """Our results for a claim, and whether it holds for all of them."""
    if not found:
        return "", ""
    return "; ".join(claim["got"] for claim in found), ANSWERS[all_of([claim["same"] for claim in found])]


def recordings(results: Sequence[Summary]) -> str:
    """Names of the recordings."""
    return ", ".join(dict.fromkeys(name for result in results for name in result["recordings"]))


def contradictions(results: Sequence[Summary]) -> str:
    """Lists of the claims that our runs contradict, and of those whose answer depends on the reading."""
    parts = []
    for answer, title in ((False, "Where our runs contradict the paper"), (DEPENDS, "Where the answer depends on how the paper is read")):
        lines = [f"- *{claim['claim']}* ({claim['where']}): see [`{result['name']}`](#{anchor(result)})."
                 for result in results for claim in result["claims"] if claim["same"] == answer and not claim.get("own")]  # fmt: skip
        parts += [f"**{title}:**", "\n".join(lines)] if lines else []
    return "\n\n".join(parts)


def anchor(result: Summary) -> str:
    """Anchor of an experiment in the page."""
    return f"{result['paper']}-{result['name']}".replace("_", "-")


def experiment(result: Summary) -> str:
    """An experiment's section: command, pictures, sentences, tables."""
    runs = f", {result['runs']} runs" if result["runs"] > 1 else ""
    parts = [f"### {result['title']} {{ #{anchor(result)} }}", f"`{result['command']}`{runs}, {result['seconds']:.0f} s."]
    pictures = [f"![{Path(name).stem.replace('_', ' ')}](assets/{result['paper']}_{name})" for name in result["pictures"]]
    whole = result["name"].startswith("table_")
    tables = [markdown(table["columns"], table["rows"]) for table in result["tables"].values() if whole or len(table["rows"]) <= LONGEST]
    return "\n\n".join([*parts, *pictures, *(["\n".join(f"- {line}" for line in result["said"])] if result["said"] else []), *tables])


def copy_pictures(folder: Path, results: Sequence[Summary], assets: Path) -> None:
    """Copy the pictures, named after the paper. Raises `ShadowPuppetError` where one is missing or too large."""
    for result in results:
        for name in result["pictures"]:
            source, goal = folder / name, assets / f"{result['paper']}_{name}"
            if not source.is_file():
                raise ShadowPuppetError(f"{source}: not there, expected a picture of the experiment {result['name']}")
            if source.stat().st_size > LARGEST:
                raise ShadowPuppetError(f"{source}: found {source.stat().st_size} bytes, expected at most {LARGEST}")
            shutil.copyfile(source, goal)


if __name__ == "__main__":
    sys.exit(main())
