"""Whether a tag may become a release: python .ci/check_release.py v1.2.3. Its number is a final one, and CHANGELOG.md has its changes."""

from __future__ import annotations

import re
import sys
from pathlib import Path


def problems(tag: str, changelog: str) -> list[str]:
    """What keeps a tag from being a release."""
    if not re.fullmatch(r"v\d+\.\d+\.\d+", tag):
        return [f"tag: found {tag!r}, expected v and three numbers, such as v0.1.0"]
    titles = re.findall(r"^## (.*)$", changelog, re.MULTILINE)
    found, version = [], re.escape(tag[1:])
    if not any(re.fullmatch(rf"\[{version}\] - \d{{4}}-\d\d-\d\d", title) for title in titles):
        found.append(f"CHANGELOG.md: found no line '## [{tag[1:]}] - YEAR-MONTH-DAY' among {', '.join(titles)}")
    waiting = re.search(r"^## \[Unreleased\]\n(.*?)(?=^## |\Z)", changelog, re.MULTILINE | re.DOTALL)
    if waiting and waiting[1].strip():
        found.append("CHANGELOG.md: found changes under Unreleased; they belong to the release")
    return found


if __name__ == "__main__":
    if found := problems(sys.argv[1], Path(__file__).resolve().parents[1].joinpath("CHANGELOG.md").read_text("utf-8")):
        sys.exit("\n".join(found))
    print(f"{sys.argv[1]} may be released")
