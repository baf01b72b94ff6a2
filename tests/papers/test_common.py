"""What the papers' experiments share."""

from __future__ import annotations

import json
import math
import os
import re
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from papers.common import fingerprint, plotting, reproduction, sources
from papers.common.claims import DEPENDS, Share, Verdict, all_of, by_reading, difference, opposite
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.many import run_all
from papers.common.plotting import label, new_figure, save_picture
from papers.common.runner import main, run
from papers.common.writing import claims_table, csv_text, markdown
from shadowpuppet.errors import ShadowPuppetError


def twice(job: int) -> int:
    return 2 * job


def whoami(job: int) -> int:
    return os.getpid()


def killed(job: int) -> int:
    if job == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return job


def refused(job: int) -> int:
    raise ShadowPuppetError(f"job {job}: found nothing")


def made(request: Request) -> Outcome:
    """An experiment with everything in it."""
    figure, panels = new_figure()
    panels[0, 0].plot(range(request.runs + 1), label="runs")
    label(panels[0, 0], "x", "y", "title")
    verdicts = [Verdict("nobody knows", "V", "nothing", None),
                Verdict("one is less than two", "Table I", str(request.runs), request.runs < 2)]  # fmt: skip
    table = Table(("a", "b", "c"), [(1, 2.5, None), ("x|y", math.nan, 1 / 3)], shown=True)
    hidden = Table(("only_in_the_file",), [(7,)])
    return Outcome({"runs": request.runs}, {"tried": figure}, {"tried": table, "tried_more": hidden}, verdicts, ["Said."])


EXPERIMENTS = (Experiment("tried", "A try", "no time", made, runs=5, short_runs=2), Experiment("again", "Another", "no time", made))


# Claims


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20), st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20))
def test_differences_are_antisymmetric(first, second):
    there, back = difference(first, second), difference(second, first)
    assert there.value == -back.value
    assert there.error == pytest.approx(back.error)
    assert there.greater is (None if back.greater is None else not back.greater)


def test_a_difference_counts_beyond_two_standard_errors():
    spread = np.array([-1.0, 1.0] * 8)  # its mean has a standard error of 1.0328 / 4
    error = spread.std(ddof=1) / 4 * np.sqrt(2)
    assert difference(spread + 2.01 * error, spread).greater is True
    assert difference(spread - 2.01 * error, spread).greater is False
    assert difference(spread + 1.99 * error, spread).greater is None


def test_single_runs_tell_nothing():
    assert difference([5.0], [1.0, 1.1]).greater is None
    assert difference([math.nan, 1.0], [1.0, 2.0]).greater is None


@pytest.mark.parametrize(("answers", "expected"), [
    ((True, True), True), ((True, None), None), ((None, False), False), ((), True), ((None, DEPENDS, True), DEPENDS),
    ((DEPENDS, False), False)])  # fmt: skip
def test_all_of(answers, expected):
    assert all_of(answers) is expected


@pytest.mark.parametrize(("answers", "expected"), [
    ((True, True), True), ((False, False), False), ((None, None), None), ((True, None), None), ((False, None), None),
    ((True, False), DEPENDS), ((True, None, False), DEPENDS)])  # fmt: skip
def test_an_answer_depends_on_the_reading_where_one_says_yes_and_another_no(answers, expected):
    assert by_reading(dict(enumerate(answers))) == expected


def test_shares_have_the_intervals_of_wilson():
    # scipy.stats.binomtest(k, n).proportion_ci(0.9, "wilson")
    for number, of, low, high in ((0, 10, 0.0, 0.2129), (5, 10, 0.2693, 0.7307), (1, 1, 0.2699, 1.0), (3, 3, 0.5258, 1.0)):
        np.testing.assert_allclose(Share(number, of).interval, (low, high), atol=2e-4)
    assert [Share(number, 3).usual for number in (0, 1, 2, 3)] == [False, None, None, True]
    assert opposite(Share(0, 3).usual) is True
    assert opposite(Share(1, 2).usual) is None


def test_a_limit_counts_by_two_standard_errors():
    apart = difference([10.0, 10.2], [8.0, 8.2])  # 2 with an error of 0.141
    assert (apart.under(2.3), apart.under(2.2), apart.under(1.7)) == (True, None, False)


def test_the_claims_table_says_yes_no_and_inconclusive():
    rows = [Verdict("c", "V", "1 mm", same) for same in (True, False, None, DEPENDS)]
    lines = claims_table(rows).splitlines()
    assert lines[0] == "| paper said | where | we got | same conclusion? |"
    assert [line.split("|")[4].strip() for line in lines[2:]] == ["yes", "**no**", "inconclusive", "depends on the reading"]


# Tables and pictures


def test_tables_leave_cells_empty_where_there_is_no_number():
    table = Table(("a", "b"), [(1, math.nan), (None, 1 / 3), ("x", math.inf)])
    assert csv_text(table) == "a,b\n1,\n,0.3333\nx,\n"
    assert markdown(table.columns, [("x|y", None)]).splitlines()[-1] == "| x\\|y |  |"


def test_pictures_keep_the_colours_of_thin_lines(tmp_path):
    image = np.full((300, 400, 3), 250, np.uint8)
    image[10, :], image[20, :] = (200, 30, 30), (30, 30, 200)
    image[100:] = np.random.default_rng(0).integers(0, 60, (200, 400, 1), np.uint8) + 120  # too much for all colours
    save_picture(image, tmp_path / "picture.png")
    read = np.asarray(Image.open(tmp_path / "picture.png").convert("RGB")).astype(int)
    assert (tmp_path / "picture.png").stat().st_size <= plotting.LARGEST
    for row, colour in ((10, (30, 30, 200)), (20, (200, 30, 30))):
        assert np.abs(read[row] - colour).max() < 60


def test_pictures_grow_no_larger_than_the_documentation_takes(tmp_path, monkeypatch):
    image = np.random.default_rng(0).integers(0, 255, (200, 300, 3), np.uint8)
    monkeypatch.setattr(plotting, "LARGEST", 10**7)
    save_picture(image, tmp_path / "whole.png")
    assert np.array_equal(np.asarray(Image.open(tmp_path / "whole.png"))[..., ::-1], image)
    monkeypatch.setattr(plotting, "LARGEST", 40_000)
    save_picture(image, tmp_path / "small.png")
    assert (tmp_path / "small.png").stat().st_size <= 40_000


def test_a_picture_that_cannot_be_written_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    for folder, why in (("nowhere", "no such file or directory"), ("file", "not a directory")):
        with pytest.raises(ShadowPuppetError, match=rf"{folder}.*cannot be written \({why}\)"):
            save_picture(np.zeros((4, 4, 3), np.uint8), tmp_path / folder / "a.png")


# Many runs


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_come_back_in_their_order(workers):
    assert run_all("jobs", twice, range(6), workers) == [0, 2, 4, 6, 8, 10]


def test_a_task_that_refuses_is_reported_as_it_is():
    with pytest.raises(ShadowPuppetError, match=r"job [01]: found nothing"):
        run_all("jobs", refused, range(2), 2)


def test_a_killed_process_is_reported_in_a_sentence():
    with pytest.raises(ShadowPuppetError, match="jobs: a process was killed"):
        run_all("jobs", killed, range(5), 2)
    assert run_all("jobs", twice, range(2), 2) == [0, 2]  # others are started


def test_a_process_killed_while_jobs_are_still_handed_over_is_reported_too():
    run_all("jobs", twice, range(2), 2)  # processes that are there already
    with pytest.raises(ShadowPuppetError, match="jobs: a process was killed"):
        run_all("jobs", killed, range(3, 20_000), 2)


def test_processes_stay_for_the_next_time():
    assert len(set(run_all("jobs", whoami, range(4), 2)) | set(run_all("jobs", whoami, range(4), 2))) <= 2


# The command line


def test_without_a_name_all_are_listed(capsys):
    assert main("tests", "About.", EXPERIMENTS, []) == 0
    shown = capsys.readouterr().out
    assert re.search(r"tried +A try \(no time\)", shown)
    assert re.search(r"again +Another", shown)


def test_an_experiment_says_what_it_does_and_leaves_everything(tmp_path, capsys):
    assert main("tests", "About.", EXPERIMENTS, ["tried", "--seed", "3", "-o", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("tried: A try\nseed 3 to 7; takes no time\n")
    assert shown.rstrip().endswith("| one is less than two | Table I | 5 | **no** |")
    assert "only_in_the_file" not in shown
    told = json.loads((tmp_path / "out" / "tried.json").read_text("utf-8"))
    assert (told["command"], told["runs"], told["number"]) == ("python -m papers.tests tried --seed 3", 5, 0)
    assert told["tables"]["tried"]["rows"][1] == ["x|y", None, 1 / 3]
    assert [claim["same"] for claim in told["claims"]] == [None, False]
    assert (tmp_path / "out" / "tried_more.csv").read_text("utf-8") == "only_in_the_file\n7\n"
    assert (tmp_path / "out" / "tried.png").stat().st_size > 1000


def test_all_runs_each_once_with_its_own_runs(tmp_path):
    assert main("tests", "About.", EXPERIMENTS, ["again", "all", "--short", "-o", str(tmp_path)]) == 0
    told = [json.loads((tmp_path / f"{name}.json").read_text("utf-8")) for name in ("tried", "again")]
    assert [(each["runs"], each["number"], each["command"]) for each in told] == [
        (2, 0, "python -m papers.tests tried --short"), (1, 1, "python -m papers.tests again --short")]  # fmt: skip


def test_the_command_names_the_papers_own_options(tmp_path):
    arguments = ["tried", "--runs", "1", "--silhouettes", "exact", "--recording", "a/lab", "-o", str(tmp_path)]
    assert main("tests", "About.", EXPERIMENTS, arguments, lambda parser: parser.add_argument("--silhouettes", default="practical")) == 0
    told = json.loads((tmp_path / "tried.json").read_text("utf-8"))
    assert told["command"] == "python -m papers.tests tried --recording lab --runs 1 --silhouettes exact"


@pytest.mark.parametrize(("arguments", "said"), [
    (["nothing"], "found 'nothing', expected one of tried, again, all"),
    (["tried", "--runs", "0"], "found '0', expected a whole number from 1"),
    (["tried", "--seed", "-1"], "found '-1', expected a whole number from 0"),
    (["tried", "--workers", "x"], "found 'x', expected a whole number from 1"),
])  # fmt: skip
def test_mistakes_end_with_code_2_and_a_sentence(arguments, said, capsys):
    with pytest.raises(SystemExit) as ended:
        main("tests", "About.", EXPERIMENTS, arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_reported(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main("tests", "About.", EXPERIMENTS, ["tried", "-o", str(tmp_path / "file" / "out")]) == 2
    assert "cannot be made" in capsys.readouterr().err


# The page


PAGE = "# Page\n\n<!-- tests -->\nas it was\n<!-- end of tests -->\n\n<!-- others -->\nkept\n<!-- end of others -->\n"


@pytest.fixture
def docs(tmp_path) -> Path:
    (tmp_path / "docs" / "assets").mkdir(parents=True)
    (tmp_path / "docs" / "reproduction.md").write_text(PAGE)
    return tmp_path / "docs"


def results(folder: Path, runs: int, **changes) -> Path:
    folder.mkdir(parents=True)
    for number, experiment in enumerate(EXPERIMENTS[:1]):
        run("tests", experiment, replace(Request(folder), runs=runs, **changes), number)
    return folder


def test_the_page_is_built_of_results_and_keeps_what_is_not_named(tmp_path, docs):
    assert reproduction.main([str(results(tmp_path / "a", 3)), str(results(tmp_path / "b", 1, recordings=(Path("lab"),))),
                              "--docs", str(docs)]) == 0  # fmt: skip
    page = (docs / "reproduction.md").read_text("utf-8")
    assert "as it was" not in page
    assert page.endswith("<!-- others -->\nkept\n<!-- end of others -->\n")
    assert "| paper said | where | we got: made | same? | lab: same? |" in page
    assert "| one is less than two | Table I | 3 | **no** | yes |" in page
    assert "Of 2 conclusions 0 are the same here, 1 are not, and for 1 the runs are inconclusive" in page
    assert [line for line in page.splitlines() if line.startswith("- *")] == [
        "- *one is less than two* (Table I): see [`tried`](#tests-tried)."]
    assert "![tried](assets/tests_tried.png)" in page
    assert (docs / "assets" / "tests_tried.png").read_bytes() == (tmp_path / "a" / "tried.png").read_bytes()
    assert "mean little" not in page


def test_long_tables_stay_in_the_results_unless_the_paper_has_them(tmp_path):
    (found,) = reproduction.read_results(results(tmp_path / "a", 1))
    found["tables"] = {"long": {"columns": ["n"], "rows": [[n] for n in range(reproduction.LONGEST + 1)]}}
    assert "| n |" not in reproduction.experiment(found)
    assert "| n |" in reproduction.experiment(found | {"name": "table_2"})


def test_a_page_names_the_film_and_program_that_it_is_of_and_is_refused_when_these_are_others(tmp_path, docs):
    page, made_by = docs / "reproduction.md", {"film": [0.25, 3.0], "DRS": [1.5]}
    assert "no fingerprint, and no warning" in fingerprint.stale(page, "tests", made_by)
    assert reproduction.main([str(results(tmp_path / "a", 1, fingerprint=made_by)), "--docs", str(docs)]) == 0
    assert fingerprint.of_page(page, "tests") == made_by
    assert fingerprint.stale(page, "tests", {"film": [0.25, 3.0 + 1e-6], "DRS": [1.5]}) == ""
    said = fingerprint.stale(page, "tests", {"film": [0.25, 3.1], "DRS": [1.5], "SRS": [0.0]})
    assert "of other films or programs (film, SRS); make them again: python -m papers.tests all -o FOLDER" in said
    page.write_text(PAGE.replace("as it was", f"{fingerprint.WARNING}."), "utf-8")
    assert fingerprint.stale(page, "tests", made_by) == ""


def test_results_of_different_films_are_no_page(tmp_path, docs, capsys):
    folder = results(tmp_path / "a", 1, fingerprint={"film": [1.0]})
    run("tests", EXPERIMENTS[1], Request(folder, fingerprint={"film": [2.0]}), 1)
    assert reproduction.main([str(folder), "--docs", str(docs)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "again: its results are of another film or program than those of tried; make them again: python -m papers.tests all" in said
    assert (docs / "reproduction.md").read_text("utf-8") == PAGE


def test_a_full_run_takes_the_fingerprint_and_a_short_one_does_not(tmp_path):
    for flags, wanted in (([], {"film": [1.0]}), (["--short"], {}), (["--recording", "lab", "hall"], {})):
        folder = tmp_path / f"out{len(flags)}"
        assert main("tests", "About.", EXPERIMENTS, ["tried", *flags, "-o", str(folder)], fingerprint=lambda _: {"film": [1.0]}) == 0
        assert json.loads((folder / "tried.json").read_text("utf-8"))["fingerprint"] == wanted


def test_sums_tell_apart_what_differs(rng):
    values = rng.normal(size=(20, 12))
    assert fingerprint.sums(values) == fingerprint.sums(values + 1e-12)
    assert fingerprint.differences({"a": fingerprint.sums(values)}, {"a": fingerprint.sums(values + 0.01)}) == ["a"]


def test_short_results_are_reported_as_such(tmp_path, docs):
    assert reproduction.main([str(results(tmp_path / "a", 1, short=True)), "--docs", str(docs)]) == 0
    assert "mean little" in (docs / "reproduction.md").read_text("utf-8")


@pytest.mark.parametrize(("spoil", "said"), [
    (lambda folder: (folder / "tried.json").write_text("{"), "tried.json: found no JSON in line 1"),
    (lambda folder: (folder / "tried.json").write_text("{}"), "tried.json: found no experiment's summary, expected a table with"),
    (lambda folder: (folder / "tried.json").unlink(), "found no NAME.json of an experiment"),
    (lambda folder: (folder / "tried.png").unlink(), "tried.png: not there, expected a picture of the experiment tried"),
    (lambda folder: (folder / "tried.png").write_bytes(bytes(200_000)), "found 200000 bytes, expected at most 150000"),
])  # fmt: skip
def test_spoilt_results_leave_the_page_alone(tmp_path, docs, spoil, said, capsys):
    folder = results(tmp_path / "a", 1)
    spoil(folder)
    assert reproduction.main([str(folder), "--docs", str(docs)]) == 2
    assert said in capsys.readouterr().err
    assert (docs / "reproduction.md").read_text("utf-8") == PAGE


def test_a_page_without_a_place_is_reported(tmp_path, docs, capsys):
    (docs / "reproduction.md").write_text("# Page\n")
    assert reproduction.main([str(results(tmp_path / "a", 1)), "--docs", str(docs)]) == 2
    assert "expected a line <!-- tests -->" in capsys.readouterr().err


def test_the_digest_of_sources_changes_with_what_is_imported_and_with_nothing_else(tmp_path, monkeypatch):
    texts = {"track": "from shadowpuppet.cost import weigh\n", "cost": "def weigh():\n    import shadowpuppet.camera.lens\n",
             "camera/lens": "import numpy\n", "camera/__init__": "", "viewer": "import shadowpuppet.track\n"}  # fmt: skip
    for name, text in texts.items():
        (tmp_path / f"{name}.py").parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.py").write_text(text, "utf-8")
    monkeypatch.setitem(sources.PACKAGES, "shadowpuppet", tmp_path)

    def digest() -> str:
        return sources.digest.__wrapped__("shadowpuppet.track")

    first = digest()
    for name, counts in (("viewer", False), ("camera/__init__", False), ("camera/lens", True), ("cost", True), ("track", True)):
        with (tmp_path / f"{name}.py").open("a", encoding="utf-8") as file:
            file.write("# changed\n")
        assert (digest() != first) == counts, name
        first = digest()


def test_a_figure_does_not_depend_on_the_viewer():
    from papers.liu2011 import repeats
    from papers.ni2008 import tracks

    for modules in ((repeats.__name__,), tracks.METHODS):
        assert {f"shadowpuppet.{room}" for room in ("viewer", "live", "cli")}.isdisjoint(
            name.rpartition(".")[0] for name in sources.sources(*modules))
        assert any("resampling" in name for name in sources.sources(*modules))
