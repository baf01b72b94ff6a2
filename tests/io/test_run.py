"""Run folders: what is written is read, however the run ended; other people's folders stay; what is malformed is said."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import FormatError, ShadowPuppetError, VideoError
from shadowpuppet.io.files.lock import LOCK
from shadowpuppet.io.inputs.inputs import Resuming, inputs_of
from shadowpuppet.io.intervals import IntervalWriter, read_intervals
from shadowpuppet.io.motion.table import read_joints, read_raw
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter, write_metrics
from shadowpuppet.motion.motion import STATUSES, Mode, Motion, MotionFrame

DOFS, JOINTS = ("torso_y", "torso_bow"), ("neck", "left_hand")
INFO = {"recording": Path("recordings/demo"), "method": "monocular", "preset": None, "seed": 3,
        "sizes": {"head_width": np.float64(0.17)}}
PLACES = [f"{joint}{kind}_{axis}" for joint in JOINTS for kind in ("", "_sd") for axis in "xyz"]


def a_frame(i: int, status: str = "tracked") -> MotionFrame:
    rng = np.random.default_rng(i)
    sd = {"pose_sd": rng.random(2), "joint_sd": rng.random((2, 3))} if i % 2 else {}
    limbs = {"limb_status": ("tracked", "predicted")} if i % 3 else {}
    return MotionFrame(i / 15, status, rng.normal(size=2), rng.normal(size=(2, 3)), cost=900.5, overlap=rng.random(), **sd, **limbs)


FIELDS = [field.name for field in dataclasses.fields(Motion)]


def writer(folder: Path, **info) -> RunWriter:
    return RunWriter(folder, "cardbox", DOFS, JOINTS, INFO | info)


def write(folder: Path, statuses=("tracked", "lost", "uncertain", "absent", "predicted")) -> Path:
    with writer(folder) as run:
        for i, status in enumerate(statuses):
            run.write(a_frame(i, status))
        run.metrics["timings"] = {"silhouette_s": 0.25, "unknown": np.nan}
    return folder


def assert_same(a: Motion, b: Motion, atol: float = 0.0) -> None:
    for field in dataclasses.fields(Motion):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if isinstance(left, np.ndarray) and left.dtype.kind == "f":
            np.testing.assert_allclose(left, right, rtol=0, atol=0.0051 if field.name == "cost" and atol else atol)
        else:
            np.testing.assert_array_equal(left, right)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.sampled_from(STATUSES), max_size=5))
def test_what_is_written_is_read_exactly_and_from_the_tables_nearly(tmp_path, statuses):
    run = read_run(write(tmp_path / "run", statuses))
    assert run.complete
    assert run.motion.status.tolist() == statuses
    for i, status in enumerate(statuses):
        frame = a_frame(i)
        kept = status not in ("lost", "absent")
        np.testing.assert_array_equal(run.motion.joints[i], frame.joints if kept else np.full((2, 3), np.nan))
        np.testing.assert_array_equal(run.motion.pose_sd[i], frame.pose_sd if kept and i % 2 else [np.nan] * 2)
        assert tuple(run.motion.limb_status[i]) == ((frame.limb_status if kept else None) or (status, status))
    (tmp_path / "run" / "motion.npz").unlink()
    assert_same(read_run(tmp_path / "run").motion, run.motion, atol=5.1e-7)


def test_the_files_are_as_documented(tmp_path):
    folder = write(tmp_path / "new" / "run")
    assert {path.name for path in folder.iterdir()} == {"angles.csv", "intervals.csv", "joints.csv", "metrics.json", "motion.npz",
                                                              "run.toml"}
    joints, angles = ((folder / name).read_text().splitlines() for name in ("joints.csv", "angles.csv"))
    assert joints[0].split(",") == ["time", *PLACES, "status", "cost", "overlap", "trunk_status", "left_arm_status"]
    assert angles[0] == "time,torso_y,torso_bow,torso_y_sd,torso_bow_sd"
    assert joints[2].split(",")[:13] == ["0.066667", *[""] * 12]
    assert joints[2].split(",")[13] == "lost"
    assert [line.split(",")[-2:] for line in joints[1:4]] == [["tracked"] * 2, ["lost"] * 2, ["tracked", "predicted"]]
    assert joints[1].split(",")[4:7] == ["", "", ""]
    info = tomllib.loads((folder / "run.toml").read_text())
    assert info["versions"].keys() >= {"python", "numpy", "shadowpuppet"}
    versions = info.pop("versions")
    assert versions["numpy"] == np.__version__
    assert info == {"complete": True, "frames": 5, "recording": "recordings/demo", "method": "monocular", "seed": 3,
                    "body": "cardbox", "sizes": {"head_width": 0.17}}
    assert json.loads((folder / "metrics.json").read_text()) == {
        "complete": True, "frames": 5, "status": dict.fromkeys(STATUSES, 1),
        "limb_status": {"trunk": {"tracked": 3, "lost": 1, "absent": 1},
                        "left_arm": {"tracked": 1, "predicted": 2, "lost": 1, "absent": 1}},
        "timings": {"silhouette_s": 0.25, "unknown": None}}
    with np.load(folder / "motion.npz", allow_pickle=False) as arrays:
        assert {f.name for f in dataclasses.fields(Motion)} == set(arrays)


@dataclasses.dataclass
class Settings:
    arm: dict | Settings
    stages: tuple[str, ...] = ("torso", "left_arm")
    limits: bool = True
    seed: np.integer = dataclasses.field(default_factory=lambda: np.int64(7))
    region: Path | None = None


def test_every_setting_is_kept(tmp_path):
    with writer(tmp_path / "run", settings=Settings(Settings({"sigma": 0.1}))):
        pass
    plain = {"stages": ["torso", "left_arm"], "limits": True, "seed": 7}
    assert read_run(tmp_path / "run").settings == {"arm": {"arm": {"sigma": 0.1}, **plain}, **plain}


def test_what_no_file_can_hold_and_what_the_writer_says_itself_is_refused(tmp_path):
    with pytest.raises(ShadowPuppetError, match=r"info\.settings\.body: found <object"):
        writer(tmp_path / "run", settings={"body": object()})
    with pytest.raises(ShadowPuppetError, match="info: found 'complete', which the run's writer fills in itself"):
        writer(tmp_path / "run", complete=True)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_run_has_all_its_frames(tmp_path, error):
    def work() -> None:
        with writer(tmp_path / "run") as run:
            for i in range(4):
                run.write(a_frame(i))
            run.metrics["timings"] = {"tracking_s": 1.0}
            raise error

    with pytest.raises(error):
        work()
    found = read_run(tmp_path / "run")
    assert not found.complete
    assert len(found.motion) == 4
    assert (found.metrics["complete"], found.metrics["timings"]) == (False, {"tracking_s": 1.0})


def test_a_frame_that_does_not_fit_ends_the_run_but_keeps_it(tmp_path):
    def work() -> None:
        with writer(tmp_path / "run") as run:
            run.write(a_frame(0))
            run.write(a_frame(1)._replace(pose=[1.0]))

    with pytest.raises(ShadowPuppetError, match="pose: found shape"):
        work()
    assert len(read_run(tmp_path / "run").motion) == 1
    assert len((tmp_path / "run" / "joints.csv").read_text().splitlines()) == 2


CHILD = """
import importlib.util, os, signal, sys
spec = importlib.util.spec_from_file_location("run_tests", {tests!r})
run_tests = sys.modules["run_tests"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(run_tests)
a_frame, writer = run_tests.a_frame, run_tests.writer
{before}
with writer({folder!r}) as run:
    for i in range({frames}):
        run.write(a_frame(i))
    {after}
"""


def child(folder: Path, frames: int, before: str = "", after: str = "") -> subprocess.CompletedProcess:
    code = CHILD.format(tests=__file__, folder=str(folder), frames=frames, before=before, after=after)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill")
def test_a_killed_run_is_read_from_its_tables(tmp_path):
    folder = write(tmp_path / "run")  # an earlier one, of which nothing must come through
    assert child(folder, 7, after="os.kill(os.getpid(), signal.SIGKILL)").returncode == -signal.SIGKILL
    assert sorted(path.name for path in folder.iterdir()) == [".lock", "angles.csv", "intervals.csv", "joints.csv", "run.toml"]
    whole = read_run(write(tmp_path / "whole", ["tracked"] * 7))
    found = read_run(folder)
    assert not found.complete
    assert found.metrics == {}
    assert_same(found.motion, whole.motion, atol=5.1e-7)


@pytest.mark.parametrize(("joints_cut", "angles_cut"), [(0, 0), (1, 0), (0, 9), (30, 0), (400, 0), (0, 60), (60, 9)])
def test_tables_that_break_off_give_the_frames_before(tmp_path, joints_cut, angles_cut):
    folder = write(tmp_path / "run", ["tracked"] * 7)
    (folder / "motion.npz").unlink()
    left = []
    for name, cut in (("joints.csv", joints_cut), ("angles.csv", angles_cut)):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: len(data) - cut])
        left.append(data[: len(data) - cut].count(b"\n") - 1)
    if left[0] != left[1] and max(joints_cut, angles_cut) > 9:
        with pytest.raises(FormatError, match=r"line \d: found \d+ cells|found other times"):
            read_run(folder)  # a complete run must be whole
    info = (folder / "run.toml").read_text()
    (folder / "run.toml").write_text(info.replace("complete = true", "complete = false"))
    assert len(read_run(folder).motion) == min(left) > 1


def test_a_full_disk_is_said_and_nothing_lost(tmp_path):
    resource = pytest.importorskip("resource")
    del resource
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))"
    ended = child(tmp_path / "run", 1000, before=limit)
    assert ended.returncode == 1
    said = ended.stderr.strip().splitlines()[-1]
    assert "run: the run cannot be written (file too large); the " in said
    frames = int(said.split("; the ")[1].split()[0])
    assert frames > 20
    assert len(read_run(tmp_path / "run").motion) in (frames, frames - 1)


def test_a_folder_that_is_no_run_is_left_alone(tmp_path):
    (tmp_path / "holidays.jpg").touch()
    with pytest.raises(ShadowPuppetError, match=r"found holidays.jpg in it but no run.toml of a run, expected a new or e"), \
            writer(tmp_path) as run:
        run.write(a_frame(0))
    (tmp_path / "run.toml").write_text("[race]\nmiles = 3\n")
    with pytest.raises(ShadowPuppetError, match=r"but no run.toml of a run"), writer(tmp_path):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["holidays.jpg", "run.toml"]


def test_an_earlier_run_is_replaced_by_the_first_frame_and_other_files_stay(tmp_path):
    folder = write(tmp_path / "run")
    before = read_run(folder)
    for name in ("notes.txt", "overlay.mp4"):
        (folder / name).touch()
    with pytest.raises(ValueError, match="no silhouette"), writer(folder):
        raise ValueError("no silhouette")
    assert_same(read_run(folder).motion, before.motion)
    write(folder, ["tracked"])
    assert len(read_run(folder).motion) == 1
    assert (folder / "notes.txt").exists()
    assert not (folder / "overlay.mp4").exists()


def test_a_second_writer_is_refused_by_name_and_the_first_goes_on(tmp_path):
    folder = tmp_path / "run"
    with writer(folder) as run:
        run.write(a_frame(0))
        said = rf"run: found another run at work in it \(process {os.getpid()} on .+\), expected its end first"
        with pytest.raises(ShadowPuppetError, match=said), writer(folder):
            pass
        other = child(folder, 1)
        assert "found another run at work in it" in other.stderr
        run.write(a_frame(1))
    assert read_run(folder).complete
    assert len(read_run(folder).motion) == 2
    assert not (folder / ".lock").exists()


def test_a_lock_ends_with_its_process(tmp_path):
    folder = tmp_path / "run"
    assert child(folder, 2, after="os.kill(os.getpid(), signal.SIGKILL)").returncode == -signal.SIGKILL
    assert (folder / ".lock").exists()
    write(folder)
    assert read_run(folder).complete


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def another_run(folder: Path) -> None:
    """What someone does who removes a lock by hand, and forces another run into the folder."""
    (folder / LOCK).unlink()
    write(folder, ["lost", "tracked"])
    (folder / "person.toml").write_text("of the other run")


def no_lock(folder: Path) -> None:
    (folder / LOCK).unlink()


def another_lock(folder: Path) -> None:
    (folder / LOCK).replace(folder / "kept")
    shutil.copy(folder / "kept", folder / LOCK)


def renamed(folder: Path) -> None:
    folder.rename(folder.with_name("away"))


def removed(folder: Path) -> None:
    shutil.rmtree(folder)


def exchanged(folder: Path) -> None:
    renamed(folder)
    write(folder, ["lost", "tracked"])


def exchanged_by_a_copy(folder: Path) -> None:
    shutil.copytree(folder, folder.with_name("copy"))
    renamed(folder)
    folder.with_name("copy").rename(folder)


LOST = {another_run: r"\.lock, which keeps others out, was removed while the run went on, so that another one may have written here",
        no_lock: r"\.lock, which keeps others out, was removed", another_lock: r"\.lock, which keeps others out, was removed",
        renamed: "the folder was removed or renamed while the run went on", removed: "the folder was removed or renamed",
        exchanged: "another folder was put in the place of that in which the run went on",
        exchanged_by_a_copy: "another folder was put in the place"}


@pytest.mark.skipif(os.name == "nt", reason="Windows removes and renames nothing that is open")
@pytest.mark.parametrize("when", ["before the first frame", "before another frame", "at the end", "after an error"])
@pytest.mark.parametrize("lose", LOST, ids=lambda lose: lose.__name__)
def test_a_run_whose_folder_or_lock_is_taken_away_says_so_and_writes_nothing_more(tmp_path, lose, when):
    folder, after = tmp_path / "run", []

    def run() -> None:
        with writer(folder) as run:
            for n in range(0 if when == "before the first frame" else 3):
                run.write(a_frame(n))
            lose(folder)
            after.append(contents(folder) if folder.exists() else None)
            if when == "after an error":
                raise ShadowPuppetError("no silhouette")
            if when != "at the end":
                run.write(a_frame(3))

    with pytest.raises(ShadowPuppetError, match=f"{LOST[lose]}.*; the run ends here, is not complete, and writes nothing more"):
        run()
    assert after == [contents(folder) if folder.exists() else None]
    if lose in (another_run, exchanged):
        found = read_run(folder)
        assert found.complete
        assert found.motion.status.tolist() == ["lost", "tracked"]
    if lose in (renamed, exchanged, exchanged_by_a_copy):
        assert not tomllib.loads((tmp_path / "away" / "run.toml").read_text())["complete"]


@pytest.mark.skipif(os.name == "nt", reason="Windows removes nothing that is open")
def test_a_run_that_was_forced_into_a_folder_keeps_its_lock_when_the_other_ends(tmp_path):
    folder = tmp_path / "run"
    first, second = writer(folder), writer(folder)
    first.__enter__()
    first.write(a_frame(0))
    (folder / LOCK).unlink()
    with second:
        second.write(a_frame(1))
        with pytest.raises(ShadowPuppetError, match="was removed while the run went on"):
            first.__exit__(None)
        with pytest.raises(ShadowPuppetError, match="found another run at work in it"):
            writer(folder).__enter__()
        second.write(a_frame(2))
    assert read_run(folder).complete
    assert len(read_run(folder).motion) == 2


def resumable(folder: Path, film: Path, goes_on: bool = False) -> RunWriter:
    return RunWriter(folder, "cardbox", DOFS, JOINTS, INFO, Resuming(goes_on, inputs_of(film, {})))


@pytest.fixture
def film(tmp_path) -> Path:
    (tmp_path / "film.mp4").write_text("film")
    return tmp_path / "film.mp4"


def test_a_run_is_not_complete_if_an_input_changes_while_it_goes_on(tmp_path, film):
    folder = tmp_path / "run"

    def work() -> None:
        with resumable(folder, film) as run:
            for n in range(3):
                run.write(a_frame(n))
            film.write_text("another film")

    with pytest.raises(ShadowPuppetError, match=r"run: film\.mp4 has changed while the run went on: it is not complete"):
        work()
    found = read_run(folder)
    assert not found.complete
    assert not found.metrics["complete"]
    assert len(found.motion) == 3


def test_no_checkpoint_is_of_two_recordings(tmp_path, film):
    folder = tmp_path / "run"

    def work() -> None:
        with resumable(folder, film) as run:
            for n, text in enumerate(("film", "another film")):
                run.write(a_frame(n))
                if n:
                    film.write_text(text)
                run.checkpoint((n,))

    with pytest.raises(ShadowPuppetError, match=r"film\.mp4 has changed while the run went on"):
        work()
    with pytest.raises(ShadowPuppetError, match=r"the run there cannot go on: film\.mp4 has changed since"), \
            resumable(folder, film, goes_on=True):
        pass
    film.write_text("film")
    with resumable(folder, film, goes_on=True) as run:
        state, frames = run.resumed(())
        assert (state, len(frames)) == ((0,), 1)
        run.write(a_frame(1))
    assert read_run(folder).complete
    assert not {"checkpoint.npz", "checkpoint.frames", "checkpoint.json"} & contents(folder).keys()


def test_a_film_that_cannot_be_read_because_it_changed_is_said_to_have_changed(tmp_path, film):
    def work() -> None:
        with resumable(tmp_path / "run", film) as run:
            run.write(a_frame(0))
            film.write_text("")
            raise VideoError("film.mp4: no film")

    with pytest.raises(ShadowPuppetError, match=r"film\.mp4 has changed while the run went on"):
        work()


def test_a_checkpoint_of_a_version_that_kept_no_inputs_is_refused(tmp_path, film):
    folder = tmp_path / "run"

    def work() -> None:
        with resumable(folder, film) as run:
            run.write(a_frame(0))
            run.checkpoint((1,))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    (folder / "checkpoint.json").unlink()
    before = contents(folder)
    with pytest.raises(FormatError, match=r"found a checkpoint without checkpoint\.json, as earlier versions wrote it.*--force"), \
            resumable(folder, film, goes_on=True):
        pass
    assert contents(folder) == before
    (folder / "checkpoint.npz").unlink()
    with resumable(folder, film, goes_on=True) as run:  # it begins at the start
        assert run.resumed(()) is None


def test_a_folder_is_never_a_mixture_of_two_runs(tmp_path, monkeypatch):
    """A copy of the folder before every change of a file while a run replaces another: each is the old run, or the new one, unfinished."""
    folder, copies = write(tmp_path / "run"), []
    (folder / "person.toml").write_text("old")
    changes = {"unlink": Path.unlink, "open": Path.open, "write_bytes": Path.write_bytes}

    def copying(change):
        def changed(path, *arguments, **more):
            if path.parent == folder and not (change is changes["open"] and "b" in arguments and "w" not in arguments[0]):
                copies.append(shutil.copytree(folder, tmp_path / f"copy-{len(copies)}"))
            return change(path, *arguments, **more)

        return changed

    with writer(folder, method="newer") as run:
        for name, change in changes.items():
            monkeypatch.setattr(Path, name, copying(change))
        run.begin()
        monkeypatch.undo()
        copies.append(shutil.copytree(folder, tmp_path / "last"))
        run.write(a_frame(0))
    assert len(copies) > 8
    files = set[str]()
    for copy in copies:
        info = tomllib.loads((copy / "run.toml").read_text())
        files = {path.name for path in copy.iterdir() if path.suffix in (".csv", ".json", ".npz") or path.name == "person.toml"}
        if info["method"] == "newer":
            assert not info["complete"]
            assert all(len((copy / name).read_text().splitlines()) <= 1 for name in files)
        elif info["complete"]:
            assert files >= {"joints.csv", "angles.csv", "intervals.csv", "motion.npz", "metrics.json", "person.toml"}
    assert files == {"joints.csv", "angles.csv", "intervals.csv"}


def test_a_new_folder_goes_where_nothing_was_tracked(tmp_path):
    with pytest.raises(ValueError, match="no silhouette"), writer(tmp_path / "run"):
        raise ValueError("no silhouette")
    assert not (tmp_path / "run").exists()


def test_what_others_put_beside_a_run_that_had_no_frame_stays_and_is_in_nobody_s_way(tmp_path):
    def work() -> None:
        with writer(tmp_path / "run"):
            (tmp_path / "run" / "person.toml").touch()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["person.toml", "run.toml"]
    with pytest.raises(FormatError, match="run: the run ended before its first frame"):
        read_run(tmp_path / "run")
    assert len(read_run(write(tmp_path / "run")).motion) == 5


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").touch()
    said = r"the run cannot be written \((file exists|not a directory)\)"
    for place in (tmp_path / "file", tmp_path / "file" / "run"):
        with pytest.raises(ShadowPuppetError, match=said), writer(place):
            pass


def replaced(old: str, new: str):
    def change(path: Path) -> None:
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
    return change


def without_last_line(path: Path) -> None:
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))


def test_a_recording_is_reported_from_a_run(tmp_path):
    (tmp_path / "the lab" / "video").mkdir(parents=True)
    with pytest.raises(FormatError, match=r"lab: found no run\.toml in it, .* recording: track it first \(`shadowpuppet track '.*lab'`\)"):
        read_run(tmp_path / "the lab")


def put(content: bytes):
    return lambda path: path.write_bytes(content)


@pytest.mark.parametrize(("name", "change", "said"), [
    ("run.toml", Path.unlink, "found no run.toml in it, expected the folder of a run"),
    ("run.toml", replaced("complete = true", "complete = 1"), "run.toml: complete: found 1, expected true or false"),
    ("run.toml", replaced("body", "bodies"), "run.toml: body: found None, expected the name of a body"),
    ("run.toml", replaced("seed", "settings"), "run.toml: settings: found 3, expected a table"),
    ("run.toml", put(b"complete = "), "run.toml: not valid TOML"),
    ("motion.npz", put(b"PK\x03\x04 cut off"), r"not a motion \(.*\); without this file the run is read from j"),
    ("motion.npz", put(b""), r"motion.npz: not a motion \("),
    ("motion.npz", lambda path: np.savez(path, times=np.zeros(3)), r"motion.npz: not a motion \(no array 'body_name'\)"),
    ("motion.npz", lambda path: np.savez(path, **dict.fromkeys(FIELDS, np.array([{}], object))), r"not a motion \(found Python obj"),
    ("metrics.json", put(b"[1]"), "metrics.json: found list, expected an object"),
    ("metrics.json", put(b'{"a": '), "metrics.json: not valid JSON"),
    ("metrics.json", put(b"\xff\xff"), "metrics.json: found bytes that are no text at position 0, expected a JSON"),
    ("joints.csv", replaced("uncertain", "asleep"), "csv: line 4, column 'status': found 'asleep', expected one of tracked, "),
    ("joints.csv", replaced("tracked,predicted", "tracked,asleep"), "joints.csv: line 4, column 'left_arm_status': found 'asleep'"),
    ("joints.csv", replaced("left_arm_status", "left_arm"), "joints.csv: no column 'left_arm_status'; columns there: time, neck_x"),
    ("joints.csv", replaced(",overlap", ",over"), "joints.csv: no column 'overlap'; columns there: time, neck_x"),
    ("joints.csv", replaced("0.066667", "0.06x"), "joints.csv: line 3, column 'time': found '0.06x'"),
    ("joints.csv", replaced(",lost,", ",tracked,"), None),
    ("joints.csv", replaced(",tracked,", ",lost,"), "run: joints.csv and angles.csv: poses: found values in frame 0"),
    ("angles.csv", replaced("0.066667", "0.07"), "angles.csv: column 'time': found other times than in joints.csv"),
    ("angles.csv", replaced("torso_y_sd", "torso_z_sd"), "angles.csv: no column 'torso_y_sd'"),
    ("angles.csv", without_last_line, "angles.csv: column 'time': found other times than in joints.csv"),
    ("joints.csv", without_last_line, "angles.csv: column 'time': found other times than in joints.csv"),
    ("angles.csv", Path.unlink, r"angles.csv: cannot be read \(no such file"),
])
def test_what_is_malformed_is_said(tmp_path, name, change, said):
    folder = write(tmp_path / "run")
    if name.endswith("csv"):
        (folder / "motion.npz").unlink()
    change(folder / name)
    if said is None:
        read_run(folder)
        return
    with pytest.raises(FormatError, match=said):
        read_run(folder)


def test_a_run_made_before_limbs_had_statuses_has_those_of_its_frames(tmp_path):
    folder = write(tmp_path / "run")
    with np.load(folder / "motion.npz") as arrays:
        kept = {name: arrays[name] for name in arrays if name != "limb_status"}
    np.savez(folder / "motion.npz", **kept)
    lines = (folder / "joints.csv").read_text().splitlines()
    (folder / "joints.csv").write_text("".join(line.rsplit(",", 2)[0] + "\n" for line in lines))
    for _ in ("motion.npz", "joints.csv"):
        motion = read_run(folder).motion
        np.testing.assert_array_equal(motion.limb_status, np.repeat(motion.status[:, None], 2, axis=1))
        (folder / "motion.npz").unlink(missing_ok=True)


def test_intervals_hold_nine_tenths_around_each_joint(tmp_path):
    folder = write(tmp_path / "run", ["tracked", "tracked", "lost", "uncertain"])
    motion, found = read_run(folder).motion, read_intervals(folder / "intervals.csv")
    stated = [1, 3]  # the odd frames state deviations
    assert found.names == JOINTS
    np.testing.assert_allclose(found.times, motion.times[stated], atol=5.1e-7)
    for bound, side in ((found.low, -1), (found.high, 1)):
        np.testing.assert_allclose(bound, motion.joints[stated] + side * 1.645 * motion.joint_sd[stated], atol=5.1e-7)
    lines = (folder / "intervals.csv").read_text().splitlines()
    assert lines[0] == "time,joint,mode,weight,x,y,z,x_low,x_high,y_low,y_high,z_low,z_high"
    np.testing.assert_allclose(found.places[:, :, 0], motion.joints[stated], atol=5.1e-7)
    assert (found.weights == 1).all()
    assert [line.split(",")[:2] for line in lines[1:]] == [[f"{t / 15:.6f}", name] for t in stated for name in JOINTS]
    with pytest.raises(FormatError, match=r"intervals\.csv: no joints"):
        read_joints(folder / "intervals.csv")  # bounds are nobody's places


@pytest.mark.parametrize("name", ["50 % off", "a, b", 'say "no"'])
def test_intervals_of_joints_of_any_name(tmp_path, name):
    writer = IntervalWriter(["neck", name])
    frame = MotionFrame(0.5, "tracked", joints=[[0, 1, 2], [3, 4, 5]], joint_sd=[[0.1] * 3, [0.0, np.nan, 0.2]])
    half = frame._replace(time=1.0, joint_sd=[[np.nan] * 3, [0.1] * 3])
    (tmp_path / "a.csv").write_text(writer.header() + writer.lines(frame) + writer.lines(half) + "1.5,ne", encoding="utf-8")
    found = read_intervals(tmp_path / "a.csv", cut=True)
    assert found.names == ("neck", name)
    np.testing.assert_allclose(found.low[1, 1], [2.8355, 3.8355, 4.8355])
    assert np.isnan(found.high[0, 1]).all()
    assert np.isnan(found.high[1, 0]).all()


def test_other_places_follow_their_joint_with_their_weights(tmp_path):
    writer, none = IntervalWriter(["neck", "left_elbow", "left_hand"]), [np.nan] * 3
    modes = [Mode("left_arm", 0.25, np.array([none, none, [7.0, 8, 9]])),
             Mode("left_arm", 0.15, np.array([none, [4.0, 5, 6], [1.0, 2, 3]]))]
    frame = MotionFrame(0.5, "tracked", joints=np.ones((3, 3)), joint_sd=np.full((3, 3), 0.1), modes=modes)
    (tmp_path / "a.csv").write_text(writer.header() + writer.lines(frame) + writer.lines(frame._replace(time=1.0, modes=())), "utf-8")
    found = read_intervals(tmp_path / "a.csv")
    np.testing.assert_allclose(found.weights[0], [[1, 0, 0], [0.85, 0, 0.15], [0.6, 0.25, 0.15]])
    np.testing.assert_allclose(found.weights[1], [[1, 0, 0]] * 3)
    np.testing.assert_allclose(found.places[0, 2], [[1, 1, 1], [7, 8, 9], [1, 2, 3]])
    np.testing.assert_allclose(found.places[0, 1, 2], [4, 5, 6])  # mode 2 of the hand and that of the elbow are one posture
    assert np.isnan(found.places[0, 1, 1]).all()
    np.testing.assert_allclose(found.high[0], 1.1645)


@pytest.mark.parametrize(("row", "said"), [
    ("0.1,neck,0,1,0,0,0,1,0,0,0,0,0", "line 3, column 'x_low': found 1, expected at most the 0 of 'x_high'"),
    ("0.1,neck,0,1,0,0,0,0,0,0,0,0,zero", "line 3, column 'z_high': found 'zero', expected a number or nothing"),
    ("0.0,neck,0,1,0,0,0,0,0,0,0,0,0", "line 3, column 'joint': found mode 0 of 'neck' twice at 0 s, expected each once"),
    ("0.1,neck,0.5,1,0,0,0,0,0,0,0,0,0", "line 3, column 'mode': found 0.5, expected 0 for the estimate, 1, 2"),
    ("0.1,neck,,1,0,0,0,0,0,0,0,0,0", "line 3, column 'mode': found no number, expected 0 for the estimate"),
    ("0.1,neck,1e9,1,0,0,0,0,0,0,0,0,0", "line 3, column 'mode': found 1e.09, expected 0 for the estimate"),
    ("0.1,neck,0,1.5,0,0,0,0,0,0,0,0,0", "line 3, column 'weight': found 1.5, expected 0 to 1"),
    ("0.1,neck,0,,0,0,0,0,0,0,0,0,0", "line 3, column 'weight': found nothing, expected 0 to 1"),
    ("-1,neck,0,1,0,0,0,0,0,0,0,0,0", "line 3, column 'time': found -1, expected seconds that do not decrease"),
    (",neck,0,1,0,0,0,0,0,0,0,0,0", "line 3, column 'time': found no number, expected seconds"),
    ("0.1,neck,0", "line 3: found 3 cells, expected 13"),
])
def test_malformed_intervals_are_said(tmp_path, row, said):
    path = tmp_path / "intervals.csv"
    path.write_text(f"{IntervalWriter([]).header()}0.0,neck,0,1,0,0,0,0,0,0,0,0,0\n{row}\n")
    with pytest.raises(FormatError, match=rf"intervals\.csv: {said}"):
        read_intervals(path)


def test_measures_can_be_added_later(tmp_path):
    run = read_run(write(tmp_path / "run"))
    write_metrics(run.folder, run.metrics | {"errors": {"mean_mm": np.float64(41.5)}})
    found = read_run(run.folder).metrics
    assert found["errors"] == {"mean_mm": 41.5}
    assert found["timings"] == run.metrics["timings"]


def test_a_path_that_is_no_text_does_not_end_a_run(tmp_path):
    with writer(tmp_path / "run", recording=Path("film\udcff.mp4")) as run:
        run.write(a_frame(0))
    assert read_run(tmp_path / "run").info["recording"] == "film?.mp4"


def test_revised_frames_replace_those_written_and_raw_csv_keeps_them(tmp_path):
    with writer(tmp_path / "run") as run:
        for i in range(5):
            run.write(a_frame(i, "lost" if i == 2 else "tracked"))
        raw = run.motion
        run.revise(dataclasses.replace(raw, joints=raw.joints + 1, cost=raw.cost + 1))
        run.info["smoothing"] = {"method": "tracker"}
    found = read_run(tmp_path / "run")
    assert_same(read_raw(tmp_path / "run" / "raw.csv", "cardbox"), raw, 1e-6)
    np.testing.assert_array_equal(found.motion.joints, raw.joints + 1)
    assert found.info["smoothing"] == {"method": "tracker"}
    (tmp_path / "run" / "motion.npz").unlink()
    assert_same(read_run(tmp_path / "run").motion, found.motion, 1e-6)
    bounds = read_intervals(tmp_path / "run" / "intervals.csv")
    places = found.motion.joints[[1, 3]]  # those with standard deviations
    assert ((bounds.low <= places + 1e-6) & (places <= bounds.high + 1e-6)).all()
    assert not list((tmp_path / "run").glob("*.part"))
    write(tmp_path / "run")
    assert not (tmp_path / "run" / "raw.csv").exists()


def test_a_run_killed_among_its_revised_tables_is_read_as_tracked(tmp_path):
    """One table is revised, the other not: the motion as tracked is whole."""
    with writer(tmp_path / "run") as run:
        for i in range(5):
            run.write(a_frame(i))
        raw = run.motion
        run.revise(dataclasses.replace(raw, joints=raw.joints + 1, poses=raw.poses + 1))
    info = (tmp_path / "run" / "run.toml").read_text()
    (tmp_path / "run" / "run.toml").write_text(info.replace("complete = true", "complete = false"))
    (tmp_path / "run" / "motion.npz").unlink()
    assert_same(read_run(tmp_path / "run").motion, raw, 1e-6)


def test_a_revision_that_cannot_be_written_leaves_the_tables(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    def revised():
        with writer(tmp_path / "run") as run:
            for i in range(3):
                run.write(a_frame(i))
            monkeypatch.setattr("shadowpuppet.io.run_writer.run_rows", full)
            run.revise(run.motion)

    with pytest.raises(ShadowPuppetError, match=r"the 3 frames so far are in joints\.csv"):
        revised()
    assert not (tmp_path / "run" / "raw.csv").exists()
    assert not list((tmp_path / "run").glob("*.part"))
    assert len(read_run(tmp_path / "run").motion) == 3
    assert not read_run(tmp_path / "run").complete


def test_a_malformed_raw_table_is_named(tmp_path):
    file = tmp_path / "raw.csv"
    file.write_text("time,neck_x,neck_y,neck_z,neck_sd_x,neck_sd_y,neck_sd_z,status,cost,overlap,torso_y [m]\n")
    with pytest.raises(FormatError, match=r"raw\.csv: found 1 degrees of freedom and 0 standard deviations, expected as many"):
        read_raw(file, "cardbox")
