"""Run a paper's algorithm on one frame: `python -m papers.lectures liu2011`, with --page also writing it as a page with its pictures."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Sequence
from pathlib import Path

from papers.lectures.page import LECTURES, page, run

NAMES = ("liu2011", "ni2008")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one lecture; prints what its cells print."""
    parser = argparse.ArgumentParser(prog="python -m papers.lectures", description=__doc__)
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("-o", "--output", type=Path, default=Path("lecture-out"), metavar="FOLDER", help="where pictures are written")
    parser.add_argument("--page", action="store_true", help="write NAME_one_frame.md there, with text, code, output and pictures")
    asked = parser.parse_args(argv)
    script = (LECTURES / f"{asked.name}.py").read_text("utf-8")
    folder = asked.output / "assets" if asked.page else asked.output
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.chdir(folder):
        results = run(script, asked.name)
    if asked.page:
        (asked.output / f"{asked.name}_one_frame.md").write_text(page(script, results), "utf-8")
    print(*(result.printed for result in results if result.printed), f"pictures: {folder.resolve()}", sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
