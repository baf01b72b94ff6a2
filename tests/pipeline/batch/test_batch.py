"""Many runs: what is done, what is done again, what goes wrong meanwhile."""

from __future__ import annotations

import csv
import errno
import functools
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from types import SimpleNamespace

import made
import pytest
from rich.console import Console

from shadowpuppet.cli import app as cli
from shadowpuppet.cli.batch_terminal import LINES, BatchTerminal, _pace
from shadowpuppet.cli.terminal import Terminal
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter, write_metrics
from shadowpuppet.pipeline.batch import Batch, BatchListener, make_grid, run_batch
from shadowpuppet.pipeline.batch import workers as pools
from shadowpuppet.pipeline.batch.run import _claimed
from shadowpuppet.pipeline.batch.task import _put, do
from shadowpuppet.pipeline.batch.tasks import make_tasks, named
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording

pytestmark = pytest.mark.whole

SETTINGS = {"masks": True, "tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}}
QUICK = make_grid(SETTINGS)
FLAGS = ["--masks", "--tracker.explore", "20", "--initialization.rounds", "20", "--initialization.patience", "5",
         "--initialization.sweeps", "2"]


class Notes(BatchListener):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.done, self.failed, self.again, self.notes = [], [], [], []

    def ended(self, task, outcome, again):
        (self.done if outcome["status"] == "done" else self.again if again else self.failed).append((task.name, task.seed))

    def note(self, message):
        self.notes.append(message)


def folders(batch: Batch | Path) -> set[str]:
    return {path.name for path in ((batch if isinstance(batch, Path) else batch.folder) / "runs").iterdir()}


def table(out: Path) -> list[dict[str, str]]:
    with (out / "summary.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def two(recording, tmp_path_factory) -> tuple[Batch, Notes]:
    """Two workers: a recording that is there and one that is not, two settings, three seeds."""
    grid, notes = make_grid(SETTINGS, cases={"drs": {}, "srs": {"tracker": {"resampling": "stratified"}}}), Notes()
    out = tmp_path_factory.mktemp("batch") / "out"
    return run_batch([recording, recording.parent / "gone"], out, grid, range(3), workers=2, listener=notes), notes


# What comes out


def test_the_bad_do_not_stop_the_good_and_are_named(two, recording):
    batch, notes = two
    assert [run.status for run in batch.runs] == ["done"] * 6 + ["failed"] * 6
    assert {run.message for run in batch.failed} == {f"{recording.parent / 'gone'}: no such recording, expected a folder with video/ and "
                                                     "calibration.toml, or a film"}
    assert notes.again == []  # it would fail again
    assert len(notes.done) == len(notes.failed) == 6
    assert len(folders(batch)) == 6
    assert not any(name.startswith(".") for name in folders(batch))
    assert not (batch.folder / "failed").exists()  # no bug


def test_a_run_of_a_batch_is_the_run_that_track_makes(two, recording, tmp_path):
    batch, _ = two
    *_, run = batch.of(case="srs")
    tracker = SETTINGS["tracker"] | {"resampling": "stratified"}
    alone = track_recording(recording, tmp_path / "alone", make_options(SETTINGS | {"seed": run.task.seed, "tracker": tracker}))
    assert (alone.folder / "joints.csv").read_bytes() == (run.folder / "joints.csv").read_bytes()
    assert read_run(run.folder).settings == read_run(alone.folder).settings
    assert any(run.metrics.get("kept_silhouettes") for run in batch.runs)


def test_every_run_is_complete_and_another_seed_or_case_is_another_run(two):
    runs = [run for run in two[0].runs if run.status == "done"]
    assert all(read_run(run.folder).complete for run in runs)
    assert len({(run.folder / "joints.csv").read_bytes() for run in runs}) == len(runs) == 6


def test_the_summary_has_a_row_a_run(two):
    batch, _ = two
    rows = table(batch.folder)
    assert [(row["recording"], row["case"], row["seed"]) for row in rows[:6]] == [("tiny", case, str(n)) for case in ("drs", "srs")
                                                                                for n in range(3)]
    assert [row["tracker.resampling"] for row in rows[:6]] == ["deterministic"] * 3 + ["stratified"] * 3
    assert [row["status"] for row in rows] == ["done"] * 6 + ["failed"] * 6
    for row, run in zip(rows[:6], batch.runs):
        metrics = json.loads((batch.folder / row["folder"] / "metrics.json").read_text())
        assert float(row["errors.mean_mm"]) == metrics["errors"]["mean_mm"] == run.metrics["errors"]["mean_mm"]
        assert float(row["overlap.mean"]) == metrics["overlap"]["mean"]
        assert float(row["seconds"]) > 0
    assert all("no such recording" in row["message"] and not row["overlap.mean"] for row in rows[6:])


def test_the_runs_of_a_choice_are_found(two):
    batch, _ = two
    assert [run.task.seed for run in batch.of(case="drs")] == [0, 1, 2]
    assert len(batch.of(resampling="stratified")) == 3
    assert batch.of(recording="gone") == []


def test_what_was_asked_for_is_kept_for_people(two, recording):
    plan = tomllib.loads((two[0].folder / "batch.toml").read_text())
    assert plan["recordings"][0] == str(recording)
    assert plan["seeds"] == [0, 1, 2]
    assert [choice["settings"] for choice in plan["choices"]] == [{"tracker.resampling": name} for name in ("deterministic", "stratified")]


# Something else that makes the runs


def noted(recording, folder, options, listener=None, repeats=None) -> None:
    """In place of `track_recording`: seed and recording, no film."""
    folder.mkdir()
    (folder / "joints.csv").touch()
    write_metrics(folder, {"seed": options.seed, "of": Path(recording).name, "process": os.getpid()})


def measured(recording, folder, options, *_: object) -> None:
    """As `noted`, but not of each seed."""
    if options.seed == 2:
        raise ShadowPuppetError("no twos")
    noted(recording, folder, options)


@pytest.mark.parametrize("workers", [0, 2])
def test_another_function_may_make_the_runs(recording, tmp_path, workers):
    batch = run_batch([recording], tmp_path / "out", QUICK, range(4), workers=workers, track=measured)
    assert [run.message for run in batch.runs] == ["", "", "no twos", ""]
    assert [run.metrics.get("seed") for run in batch.runs] == [0, 1, None, 3]
    assert batch.runs[0].metrics["of"] == "tiny"
    assert (batch.runs[0].metrics["process"] == os.getpid()) == (workers == 0)
    if workers == 0:
        ours = run_batch([recording], tmp_path / "out", QUICK, [0], workers=0)  # another run than that of the other function
        assert "errors" in ours.runs[0].metrics


@pytest.mark.parametrize("track", [lambda *_: None, functools.partial(measured), Notes().note])
def test_a_function_that_workers_cannot_find_is_refused(recording, tmp_path, track):
    with pytest.raises(ShadowPuppetError, match="expected a function of a module that workers can import"):
        run_batch([recording], tmp_path / "out", QUICK, [0], workers=0, track=track)


def test_a_function_that_a_worker_does_not_have_is_reported():
    for name in ("no.such:thing", "shadowpuppet.pipeline.track:no_such"):
        with pytest.raises(ShadowPuppetError, match=r"cannot be imported .* expected a function of a module that every worker has"):
            named(name)


# Again


def test_a_second_start_does_what_is_missing(recording, tmp_path):
    out, first = tmp_path / "out", Notes()
    batch = run_batch([recording], out, QUICK, range(4), workers=0, track=noted, listener=first)
    assert first.done == [("tiny", n) for n in range(4)]
    kept = {run.folder: (run.folder / "joints.csv").stat().st_mtime_ns for run in batch.runs[::2]}
    (batch.runs[1].folder / "task.json").unlink()
    (batch.runs[3].folder / "task.json").write_text('{"id": ')
    broken = out / "runs" / f".{batch.runs[3].folder.name}.0123abcd.part"
    broken.mkdir()
    second = Notes()
    again = run_batch([recording], out, QUICK, range(5), workers=0, track=noted, listener=second)
    assert second.done == [("tiny", 1), ("tiny", 3), ("tiny", 4)]
    assert second.notes == []
    assert {folder: (folder / "joints.csv").stat().st_mtime_ns for folder in kept} == kept
    assert not broken.exists()
    assert [run.status for run in again.runs] == ["done"] * 5
    assert [run.tries for run in again.runs] == [None, 1, None, 1, 1]
    assert again.runs[0].metrics == batch.runs[0].metrics


def test_other_settings_are_other_runs_and_it_is_said(recording, tmp_path):
    run_batch([recording], tmp_path / "out", QUICK, [0, 1], workers=0, track=noted)
    notes, flat = Notes(), make_grid(SETTINGS, cases={"flat": {"tracker": {"motion_weight": 0.0}}})
    other = run_batch([recording], tmp_path / "out", flat, [0], workers=0, track=noted, listener=notes)
    assert notes.notes == [f"{tmp_path / 'out'}: 2 of its runs are of other recordings, settings or seeds than now: they stay, and are not "
                           "in the summary"]
    assert len(other.runs) == len(table(tmp_path / "out")) == 1
    assert len(folders(other)) == 3


def test_a_changed_recording_is_tracked_again(recording, tmp_path):
    copy, notes = made.copied(recording, tmp_path / "copy"), Notes()
    run_batch([copy], tmp_path / "out", QUICK, workers=0, track=noted)
    (copy / "truth.csv").unlink()
    run_batch([copy], tmp_path / "out", QUICK, workers=0, track=noted, listener=notes)
    assert notes.done == [("copy", 0)]


def test_runs_of_another_version_are_reported(recording, tmp_path):
    batch, notes = run_batch([recording], tmp_path / "out", QUICK, workers=0, track=noted), Notes()
    made.replace_text(batch.runs[0].folder / "task.json", '"version": "', '"version": "9.')
    run_batch([recording], tmp_path / "out", QUICK, workers=0, track=noted, listener=notes)
    assert "some of its runs were made by shadowpuppet 9." in notes.notes[0]


# What goes wrong


def test_a_full_disk_fails_the_runs_that_it_hits(recording, tmp_path, monkeypatch):
    """As the writer meets it: no room for a row. Seed 1 finds room at its second try; seed 2 never does."""
    hit, write = [], RunWriter.write

    def full(self, frame):
        seed = self.info["settings"]["seed"]
        if len(self._motion) == 3 and (seed == 2 or (seed == 1 and 1 not in hit)):
            hit.append(seed)
            with self._system_errors():
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(self, frame)

    monkeypatch.setattr(RunWriter, "write", full)
    notes = Notes()
    batch = run_batch([recording], tmp_path / "out", QUICK, range(4), workers=0, retries=2, listener=notes)
    assert [run.status for run in batch.runs] == ["done", "done", "failed", "done"]
    assert [run.tries for run in batch.runs] == [1, 2, 3, 1]
    assert hit == [1, 2, 2, 2]
    assert "the run cannot be written (no space left on device)" in batch.runs[2].message
    assert len(folders(batch)) == 3  # what a full disk needs least are halves of runs
    monkeypatch.undo()
    assert run_batch([recording], tmp_path / "out", QUICK, range(4), workers=0, listener=notes).failed == []
    assert notes.done[-1] == ("tiny", 2)


@pytest.mark.parametrize(("error", "again"), [
    (OSError(errno.ENOSPC, "full"), True), (OSError(errno.EIO, "broken"), True), (OSError(errno.EACCES, "not yours"), False),
    (ShadowPuppetError("bad"), False), (MemoryError(), True), (KeyError("bug"), True),
], ids=repr)  # fmt: skip
def test_nothing_is_left_of_a_run_that_failed_and_what_may_go_well_next_time_is_known(recording, tmp_path, monkeypatch, error, again):
    def fails(self, frame):
        with self._system_errors():
            raise error

    (tmp_path / "batch.toml").touch()
    (tmp_path / "runs").mkdir()
    monkeypatch.setattr(RunWriter, "write", fails)
    (task,) = make_tasks([recording], QUICK.cases, [0])
    outcome = do(task.wire(), tmp_path)
    assert (outcome["status"], outcome["again"]) == ("failed", again)
    assert ("trace" in outcome) == isinstance(error, (MemoryError, KeyError))
    assert folders(tmp_path) == set()


def test_a_run_that_another_machine_has_done_meanwhile_stays(recording, tmp_path):
    batch = run_batch([recording], tmp_path / "out", QUICK, workers=0, track=noted)
    (folder,), task = (tmp_path / "out" / "runs").iterdir(), batch.runs[0].task.wire()
    written = (folder / "joints.csv").stat().st_mtime_ns
    assert do(task, tmp_path / "out")["status"] == "done"
    copy = made.copied(folder, folder.with_name(".copy"))
    _put(copy, folder)
    assert (folder / "joints.csv").stat().st_mtime_ns == written
    (folder / "task.json").unlink()
    _put(copy, folder)
    assert (folder / "task.json").exists()


def test_a_summary_that_cannot_be_written_is_said_after_the_runs(recording, tmp_path):
    (tmp_path / "out" / "summary.csv").mkdir(parents=True)
    (tmp_path / "out" / "batch.toml").touch()
    with pytest.raises(ShadowPuppetError, match=r"summary.csv: cannot be written"):
        run_batch([recording], tmp_path / "out", QUICK, workers=0, track=noted)
    assert len(folders(tmp_path / "out")) == 1


def test_a_bug_is_a_sentence_and_a_file_for_its_finder(recording, tmp_path, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr("shadowpuppet.pipeline.track.motion_frame", broken)
    batch = run_batch([recording], tmp_path / "out", QUICK, workers=0, retries=0)
    assert batch.runs[0].message.startswith("ZeroDivisionError in test_batch.py:")
    trace = (tmp_path / "out" / "failed" / f"{batch.runs[0].task.folder}.txt").read_text()
    assert trace.startswith("Traceback")
    monkeypatch.undo()
    run_batch([recording], tmp_path / "out", QUICK, workers=0)
    assert not (tmp_path / "out" / "failed").exists()


class Kills(Notes):
    """Kills the worker that is at a seed, so many times."""

    def __init__(self, times: dict[int, int], hired: list[subprocess.Popen]) -> None:
        super().__init__()
        self.left, self.hired = times, hired

    def working(self, worker, task, doing, frames, total):
        alive = [process for process in self.hired if process.poll() is None]
        if self.left.get(task.seed) and alive:  # a killed worker's last message may come after its end
            self.left[task.seed] -= 1
            alive[0].kill()
            alive[0].wait()


@pytest.fixture
def hired(monkeypatch) -> list[subprocess.Popen]:
    """The worker processes, as they are begun."""
    begun, popen = [], subprocess.Popen
    monkeypatch.setattr(pools.subprocess, "Popen", lambda *args, **more: begun.append(popen(*args, **more)) or begun[-1])
    return begun


def test_a_killed_worker_is_replaced_and_its_run_tried_again(recording, tmp_path, hired):
    kills = Kills({1: 1, 2: 9}, hired)
    batch = run_batch([recording], tmp_path / "out", QUICK, range(4), workers=1, listener=kills)
    assert [run.status for run in batch.runs] == ["done", "done", "failed", "done"]
    assert kills.again == [("tiny", 1), ("tiny", 2)]
    assert [run.tries for run in batch.runs] == [1, 2, 2, 1]
    assert not any(name.startswith(".") for name in folders(batch))
    assert batch.runs[2].message == "its worker was killed (SIGKILL, as by a machine that ran out of memory)"
    assert all(process.poll() is not None for process in hired)


def test_workers_that_cannot_begin_are_said(recording, tmp_path, monkeypatch):
    (tmp_path / "python").write_text("#!/bin/sh\necho 'no module here' >&2\nexit 3\n")
    (tmp_path / "python").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with pytest.raises(ShadowPuppetError, match=r"batch: no worker can be started: its worker ended with code 3: no module here"):
        run_batch([recording], tmp_path / "out", QUICK, range(3), workers=2)


def test_a_workers_threads_are_limited(tmp_path, monkeypatch):
    """By the variables that libraries read as they are loaded."""
    seen = tmp_path / "seen"
    (tmp_path / "python").write_text(f"#!/bin/sh\nenv > {seen}\nexit 1\n")
    (tmp_path / "python").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with pytest.raises(ShadowPuppetError):
        run_batch([tmp_path / "gone"], tmp_path / "out", QUICK, workers=1, threads=3)
    found = dict(line.split("=", 1) for line in seen.read_text().splitlines() if "=" in line)
    assert {found[name] for name in pools.THREAD_VARIABLES} == {"3"}


def test_a_folder_with_other_things_in_it_is_refused(recording, tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ShadowPuppetError, match=r"found thesis.tex in it but no batch.toml, expected a new or empty folder"):
        run_batch([recording], tmp_path, QUICK)


def test_two_batches_do_not_share_a_folder(recording, tmp_path):
    with _claimed(tmp_path / "out"), pytest.raises(ShadowPuppetError, match="found another batch at work in it"):
        run_batch([recording], tmp_path / "out", QUICK)


@pytest.mark.parametrize(("more", "said"), [
    ({"workers": -1}, "workers: found -1, expected 0 to 1000"), ({"retries": -1}, "retries: found -1"),
    ({"threads": 0}, "threads: found 0"), ({"table": "xls"}, "table: found 'xls', expected one of csv, parquet"),
])  # fmt: skip
def test_what_cannot_be_asked_for_is_said(recording, tmp_path, more, said):
    with pytest.raises(ShadowPuppetError, match=said):
        run_batch([recording], tmp_path / "out", QUICK, **more)
    assert not (tmp_path / "out").exists()


def test_parquet_needs_pyarrow(recording, tmp_path):
    if find_spec("pyarrow") is None:
        with pytest.raises(ShadowPuppetError, match="parquet needs pyarrow"):
            run_batch([recording], tmp_path / "out", QUICK, table="parquet")
        return
    import pyarrow.parquet

    batch = run_batch([recording, tmp_path / "gone"], tmp_path / "out", QUICK, workers=0, table="parquet")
    rows = pyarrow.parquet.read_table(tmp_path / "out" / "summary.parquet").to_pylist()
    assert [row["status"] for row in rows] == ["done", "failed"]
    assert rows[0]["overlap.mean"] == batch.runs[0].metrics["overlap"]["mean"]
    assert rows[1]["overlap.mean"] is None


# As typed


@pytest.fixture
def columns() -> int:
    return 100


def test_batch_tells_what_came_of_it(shell, recording, tmp_path):
    (tmp_path / "grid.toml").write_text('seeds = "0"\n[case.drs]\n[case.srs]\ntracker.resampling = "stratified"\n')
    command = ["batch", recording, "gone", "-o", "out", "--config", "grid.toml", "--workers", 0, *FLAGS]
    code, out, err = shell(*command)
    assert code == 3
    assert "\x1b" not in out
    assert [line.split()[:3] for line in out.splitlines()[1:5]] == [["tiny", "drs", "1"], ["tiny", "srs", "1"], ["gone", "drs", "0"],
                                                                   ["gone", "srs", "0"]]
    assert "failed: gone, drs, seed 0 and 1 more: " in err
    assert "2 of 4 runs failed; the same command tries them again" in err
    assert (tmp_path / "out" / "summary.png").stat().st_size > 5000
    assert len(table(tmp_path / "out")) == 4
    made.copied(recording, tmp_path / "gone")
    code, out, err = shell(*command)
    assert (code, err) == (0, "2 of 4 runs are done already\n")


def test_figures_stay_whole_however_long_a_name_is(recording, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    long = made.copied(recording, tmp_path / "a_recording_with_a_rather_long_name_indeed_and_a_half")
    assert cli.run(["batch", str(recording), str(long), "-o", str(tmp_path / "out"), "--seeds", "0:2", "--workers", "0", *FLAGS]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert sum(line.count(" ± ") for line in lines) == 4
    assert not any("…" in line for line in lines)


@pytest.mark.parametrize("width", [60, 80, 200])
def test_what_goes_on_is_shown_in_a_line_each(width):
    shown = Terminal()
    shown.console = Console(width=width, force_terminal=True, color_system=None)
    told = BatchTerminal(shown)

    def lines():
        with shown.console.capture() as seen:
            shown.console.print(told._table())
        return [line.rstrip() for line in seen.get().splitlines()]

    told.begin(4321, 0)
    told.stop()
    assert [line.strip() for line in lines()] == ["workers are starting", "0 of 4321 runs done"]
    tasks = [SimpleNamespace(name="bad", label=f"a recording with a name of many words, seed {n}") for n in range(20)]
    for worker, task in enumerate(tasks):
        told.working(worker, task, "tracking", 1234, 5000)
    told.done, told.failed, told._began = 3000, 21, monotonic() - 3021 * 7200
    found = lines()
    assert len(found) == LINES + 2
    assert max(map(len, found)) <= width
    assert all(line.startswith(f"{n + 1:3}  a recording") and "tracking 1234/5000" in line for n, line in enumerate(found[:LINES]))
    assert found[LINES].strip() == "and 4 more"
    assert "3000 of 4321 runs done, 21 failed" in found[-1]
    assert width == 60 or "0.5 runs/h, 2600:00:00 left" in found[-1]


@pytest.mark.parametrize(("pace", "told"), [(26.3, "26 runs/s"), (0.5, "0.5 runs/s"), (0.4, "24 runs/min"), (1 / 7200, "0.5 runs/h")])
def test_a_pace_is_reported_in_a_unit_that_suits_it(pace, told):
    assert _pace(pace) == told


def test_quiet_is_quiet(shell, recording):
    assert shell("batch", recording, "-o", "out", "--workers", 0, "--quiet", *FLAGS) == (0, "", "")


@pytest.mark.parametrize(("tokens", "said"), [
    (["batch"], "batch: found no RECORDINGS; `shadowpuppet batch --help` has examples"),
    (["batch", "here"], "batch: found no --output; `shadowpuppet batch --help` has examples"),
    (["batch", "here", "-o", "out", "--seeds", "many"], "flags: seeds: found 'many', expected numbers from 0 on"),
    (["batch", "here", "-o", "out", "--config", "none.toml"], "none.toml: cannot be read"),
    (["batch", "here", "here", "-o", "out"], "recordings: found here twice"),
    (["batch", "here", "-o", "out", "--workers", "-2"], "workers: found -2"),
    (["batch", "here", "-o", "out", "--height", "180"], "flags: height: found 180.0"),
])  # fmt: skip
def test_what_cannot_be_meant_is_said_in_a_line(shell, tokens, said, tmp_path):
    code, _, err = shell(*tokens)
    assert code == 2
    assert said in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def batch_process(*tokens: object) -> subprocess.Popen:
    heeding = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # tests begun in the background do not
    return subprocess.Popen([sys.executable, "-m", "shadowpuppet", "batch", *map(str, tokens)], stdout=subprocess.PIPE, text=True,
                            stderr=subprocess.PIPE, preexec_fn=heeding, start_new_session=True)


def wait_for(condition, seconds: float = 90) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)


def group(leader: int) -> list[int]:
    """Processes of a session, by Linux's own list."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == leader and fields[0] != "Z":
            found.append(int(path.parent.name))
    return found


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")


@needs_proc
def test_control_c_keeps_what_is_done_and_leaves_nobody_at_work(recording, tmp_path):
    out = tmp_path / "out"
    child = batch_process(recording, "-o", out, "--seeds", "0:500", "--workers", 1, *FLAGS)
    wait_for(lambda: child.poll() is not None or ((out / "runs").is_dir() and any(not name.startswith(".") for name in folders(out))))
    child.send_signal(signal.SIGINT)
    _, err = child.communicate(timeout=60)
    assert child.returncode == 130
    assert group(child.pid) == []
    done = folders(out)
    assert 1 <= len(done) < 500
    assert all(read_run(out / "runs" / name).complete for name in done)
    assert err.splitlines()[-1] == f"interrupted: {len(done)} of 500 runs are done and in {out}; the same command does the rest"
    assert [row["status"] for row in table(out)].count("done") == len(done)


@needs_proc
def test_workers_end_with_who_began_them(recording, tmp_path):
    """In the middle of a run that would take hours."""
    out = tmp_path / "out"
    child = batch_process(recording, "-o", out, "--workers", 1, *FLAGS, "--tracker.cycles", "100", "--tracker.arm.particles", "1000000")
    wait_for(lambda: child.poll() is not None or any((out / "runs").glob(".*.part/run.toml")))
    assert len(group(child.pid)) == 2
    child.kill()
    child.communicate(timeout=60)
    wait_for(lambda: not group(child.pid), 60)


def test_nothing_of_the_current_folder_is_executed(recording, tmp_path):
    for name in ("sitecustomize", "usercustomize", "numpy", "signal", "multiprocessing", "shadowpuppet"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / f'executed-{name}')!r}, 'w').close()\n")
    command = [sys.executable, "-P", "-m", "shadowpuppet", "batch", recording, "-o", "out", "--seeds", "0:2", "--workers", "2", *FLAGS]
    done = subprocess.run([*map(str, command)], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob("executed-*"))
