"""The manual says of all that is public which shapes its arrays have; its pages, pictures and examples are where they are said to be."""

from __future__ import annotations

import ast
import inspect
import re
import runpy
from functools import cache
from pathlib import Path

import pytest

import shadowpuppet
from shadowpuppet.cli.app import app

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
ARRAY = re.compile(r"\b(Array|NDArray|ArrayLike|Mask|Image|Bits)\b")
SHAPE = re.compile(r"\(([A-Z]\w*|\d+|\.\.\.|number|ceil\(W / 64\))(, ?[\w.* +]+)*,?\)|of shape")
"""(N, D), (frames, 3), (..., 3)."""
EXPLAINED = sorted(set(shadowpuppet.__all__) - {"__version__"})
LARGEST = {"": 300_000, ".webp": 1_000_000}
"""Bytes of a picture, by its ending."""


@cache
def parsed(path: str) -> ast.Module:
    return ast.parse(Path(path).read_text("utf-8"))


def untold(name: str, node: ast.stmt) -> list[str]:
    """What has arrays and does not say of which shapes: of a function, or a class' fields and methods."""
    if isinstance(node, ast.FunctionDef):
        signature = ast.unparse(node.args) + " -> " + (ast.unparse(node.returns) if node.returns else "")
        told = SHAPE.search(ast.get_docstring(node) or "") or not ARRAY.search(signature)
        return [] if told or node.name.startswith("_") else [name]
    if not isinstance(node, ast.ClassDef):
        return []
    out = []
    for part, following in zip(node.body, [*node.body[1:], ast.Pass()]):
        if isinstance(part, ast.AnnAssign) and ARRAY.search(ast.unparse(part.annotation)):
            words = following.value.value if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant) else ""
            out += [] if SHAPE.search(str(words)) else [f"{name}.{ast.unparse(part.target)}"]
        out += untold(f"{name}.{getattr(part, 'name', '')}", part)
    return out


@pytest.mark.parametrize("name", EXPLAINED)
def test_what_is_public_tells_the_shapes_of_its_arrays(name):
    value = getattr(shadowpuppet, name)
    assert inspect.getdoc(value), f"{name} is not explained"
    source = inspect.getsourcefile(inspect.unwrap(value))
    assert source is not None
    found = [node for node in parsed(source).body if getattr(node, "name", None) == name]
    assert len(found) == 1
    assert untold(name, found[0]) == []


def test_an_array_without_a_shape_would_be_noticed():
    bare = 'class A:\n    x: Array\n    """Places, metres."""\n    def f(self, poses: Array) -> int:\n        """Of poses."""\n'
    assert untold("A", ast.parse(bare).body[0]) == ["A.x", "A.f"]
    good = bare.replace("Places", "Places (N, 3)").replace("Of poses", "Of poses (N, D)")
    assert untold("A", ast.parse(good).body[0]) == []


def shown(page: Path) -> set[str]:
    text = page.read_text("utf-8")
    text = hooks()["on_page_markdown"](text) if "<!-- gallery -->" in text else text
    return set(re.findall(r"!\[[^]]*\]\((?:docs/)?(assets/[^)]+)\)", text))


PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]


def test_every_picture_is_shown_somewhere_and_none_is_large():
    """What a page shows and is not there fails the manual's build; the README is not in it."""
    named, there = set().union(*map(shown, PAGES)), {path.relative_to(DOCS).as_posix() for path in (DOCS / "assets").iterdir()}
    assert there - named == {"assets/extra.css", "assets/search_from_disk.js"}
    assert shown(PAGES[0]) <= there
    sizes = {name: (DOCS / name).stat().st_size for name in there}
    assert [name for name, size in sizes.items() if size > LARGEST.get(Path(name).suffix, LARGEST[""])] == []


def test_no_text_of_the_project_was_left_half_merged():
    marks = re.compile(r"^(<{7} |>{7} |={7}$)", re.MULTILINE)
    folders = (ROOT, *(ROOT / name for name in ("docs", "benchmarks", "src", "tests", "examples", "packaging", ".ci", ".github")))
    texts = [path for folder in folders for ending in ("md", "py", "toml", "sh", "yml", "js", "css", "html", "cff", "bib")
             for path in (folder.glob if folder == ROOT else folder.rglob)(f"*.{ending}")]
    assert ROOT / "docs" / "several_cameras.md" in texts
    assert [str(path) for path in texts if marks.search(path.read_text("utf-8"))] == []


def test_every_picture_says_what_it_shows():
    bare = [(page.name, path) for page in PAGES for text, path in re.findall(r"!\[([^]]*)\]\(([^)]+)\)", page.read_text("utf-8"))
            if len(text) < 8]  # fmt: skip
    assert bare == []


def test_the_build_fails_where_a_link_leads_nowhere():
    """`mkdocs build --strict --quiet` builds anything: what is not said is not counted."""
    (line,) = [line.split("#")[0] for line in (ROOT / "run").read_text("utf-8").splitlines() if "mkdocs\" build" in line]
    assert "--strict" in line
    assert "-q" not in line


def test_every_page_can_be_reached():
    assert {page.name for page in DOCS.glob("*.md")} == set(re.findall(r": (\w+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.M))


@cache
def hooks() -> dict:
    return runpy.run_path(str(DOCS / "hooks.py"))


@pytest.mark.parametrize("number", ["01", "03", "05", "08", "09"])
def test_every_example_that_is_there_to_be_copied_from_is_in_the_manual_and_whole(number):
    (path,) = (ROOT / "examples").glob(f"{number}_*.py")
    pages = [page for page in PAGES if (marker := f"<!-- example: {path.name} -->") in page.read_text("utf-8")]
    assert pages
    code = hooks()["on_page_markdown"](marker).removeprefix("```python\n").removesuffix("\n```")
    told, written = ast.parse(code).body, ast.parse(path.read_text("utf-8")).body[1:]
    assert [ast.unparse(node) for node in told] == [ast.unparse(node) for node in written]


def test_how_to_cite_names_both_papers_wherever_it_is_said():
    cited = re.findall(r'^    title: "(.+)"$', (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    assert len(cited) == 2
    for page in (ROOT / "README.md", DOCS / "index.md"):
        text = " ".join(page.read_text("utf-8").split())
        for title in cited:
            assert title in text


def test_the_paper_has_the_parts_that_joss_asks_for_and_cites_what_it_lists():
    text, listed = (ROOT / "paper.md").read_text("utf-8"), (ROOT / "paper.bib").read_text("utf-8")
    _, head, body = text.split("---\n", 2)
    assert re.findall(r"^# (.+)$", body, re.MULTILINE) == ["Summary", "Statement of need", "State of the field", "Acknowledgements",
                                                          "References"]
    assert all(re.search(rf"^{key}:", head, re.MULTILINE) for key in ("title", "tags", "authors", "affiliations", "date", "bibliography"))
    people = re.findall(r"^  - name: (.+)$", head.split("affiliations:")[0], re.MULTILINE)
    cited = (ROOT / "CITATION.cff").read_text("utf-8").split("references:")[0]
    assert people == re.findall(r'^  - name: "(.+)"$', cited, re.MULTILINE)
    assert set(re.findall(r"@(\w+)", body)) == set(re.findall(r"^@\w+\{(\w+),$", listed, re.MULTILINE))
    assert 250 <= len(body.split()) <= 1750


def test_the_gallery_has_every_example_with_what_it_leaves():
    text = hooks()["on_page_markdown"]("<!-- gallery -->")
    assert text.count("\n\n??? note") == len(list((ROOT / "examples").glob("*.py")))
    pictures = runpy.run_path(str(DOCS / "make_gallery.py"))["LEFT"]
    assert [f"assets/example_{number}.webp" for number in pictures] == re.findall(r"\((assets/.+)\)", text)


def test_the_commands_of_the_recipes_are_understood():
    lines = re.findall(r"^    shadowpuppet (.+?)(?:  .*)?$", (DOCS / "start.md").read_text("utf-8"), re.MULTILINE)
    assert len(lines) > 15
    for line in lines:
        command, *_ = app.parse_args(line, exit_on_error=False, print_error=False)
        assert command.__name__.strip("_") == line.split()[0]


def promised_tests() -> list[tuple[str, str]]:
    """Files and functions of the tests that SECURITY.md names; "::name" is of the file before it."""
    found, path = list[tuple[str, str]](), ""
    for file, name in re.findall(r"`(tests/[\w/]+\.py)?(?:::(\w+))?`", (ROOT / "SECURITY.md").read_text("utf-8")):
        path = file or path
        found += [(path, name)] if name else []
    return found


@pytest.mark.parametrize(("path", "name"), promised_tests())
def test_a_promise_of_security_names_a_test_that_is_there(path, name):
    assert any(isinstance(node, ast.FunctionDef) and node.name == name for node in parsed(str(ROOT / path)).body)


def test_every_promise_of_security_names_a_test():
    rows = re.findall(r"^\| .+ \| (.+) \|$", (ROOT / "SECURITY.md").read_text("utf-8"), re.MULTILINE)[1:]
    assert len(rows) > 10
    assert all("::" in tests for tests in rows)
