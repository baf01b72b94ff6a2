"""Each paper's algorithm on one frame: the scripts run, show what their text says, and become pages with their pictures."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from papers.lectures.__main__ import NAMES, main
from papers.lectures.page import LECTURES, Result, cells, page, run

pytestmark = pytest.mark.whole


def script(name: str) -> str:
    return (LECTURES / f"{name}.py").read_text("utf-8")


@pytest.fixture(scope="module", params=NAMES)
def made(request, tmp_path_factory) -> tuple[str, Path]:
    """A lecture's name, and the folder with its page and pictures."""
    folder = tmp_path_factory.mktemp(request.param)
    assert main([request.param, "-o", str(folder), "--page"]) == 0
    return request.param, folder


def test_the_page_has_the_scripts_text_code_and_pictures(made):
    name, folder = made
    text = (folder / f"{name}_one_frame.md").read_text("utf-8")
    pictures = re.findall(r"\((assets/.*?\.png)\)", text)
    assert pictures
    assert [picture for picture in pictures if not (folder / picture).is_file()] == []
    said = re.sub(r"\n\n(```text\n.*?\n```|!\[.*?\)(?=\n))", "", text, flags=re.DOTALL)
    assert said == page(script(name), [Result()] * len(cells(script(name))))
    assert text.count("```text") > 5


def printed_by(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """What the cells print; each picture is written once."""
    monkeypatch.chdir(folder)
    results = run(script(name), name)
    pictures = [picture for result in results for picture in result.pictures]
    assert sorted(pictures) == sorted(path.name for path in folder.glob("*.png"))
    return "\n".join(result.printed for result in results)


def test_liu_drs_finds_the_pose_faster_than_srs(tmp_path, monkeypatch):
    said = printed_by("liu2011", tmp_path, monkeypatch)
    before, after = map(int, re.findall(r"cost of the pose: (\d+) pixels before, (\d+) after", said)[0])
    srs, drs = (re.findall(rf"{name} +after 1 cycle +(\d+) pixels, after 10 +(\d+), after 30 +(\d+)", said)[0]
                for name in ("stratified", "deterministic"))  # fmt: skip
    assert after < 0.6 * before
    assert all(int(d) < int(s) for d, s in zip(drs, srs))


def test_ni_forces_bring_the_particles_to_the_person(tmp_path, monkeypatch):
    said = printed_by("ni2008", tmp_path, monkeypatch)
    rows = re.findall(r"(\d+) iterations: D +(\d+) mm\^2, joints +([\d.]+) mm off, particles +([\d.]+) mm apart", said)
    cost, off, apart = ([float(row[n]) for row in rows] for n in (1, 2, 3))
    assert cost == sorted(cost, reverse=True)
    assert apart == sorted(apart, reverse=True)
    assert off[-2] < 0.6 * off[0]


def test_the_command_says_where_pictures_are(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("papers.lectures.__main__.run", lambda text, name: [Result("done", ())])
    assert main(["liu2011", "-o", str(tmp_path / "here")]) == 0
    assert capsys.readouterr().out.split("\n")[:2] == ["done", f"pictures: {(tmp_path / 'here').resolve()}"]
    with pytest.raises(SystemExit):
        main(["smith1999"])
