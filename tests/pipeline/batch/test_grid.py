"""What a batch is to run: grids, seeds, and how tasks are known again."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.io.files.plain import for_toml
from shadowpuppet.io.inputs.inputs import fingerprint
from shadowpuppet.pipeline.batch.grid import Case, make_grid, read_grid, seeds_of
from shadowpuppet.pipeline.batch.tasks import make_tasks
from shadowpuppet.pipeline.options import Options, make_options, plain_options

GRID = """\
seeds = "0:3"
preset = "liu2011"
tracker.arm.survival = 0.5

[grid]
"tracker.arm.particles" = [100, 200]
silhouette.factor = [2.0, 3.0, 4.0]

[case.drs]
tracker.resampling = "deterministic"
[case.srs]
tracker.resampling = "stratified"
tracker.arm.survival = 0.6
"""


@pytest.fixture
def written(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "grid.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def recording(tmp_path) -> Path:
    """What looks like one, for those who only look at files."""
    folder = tmp_path / "here" / "walk"
    for name, text in {"video/a.mp4": "film", "calibration.toml": "[a]", "truth.csv": "time\n"}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


# Seeds


@pytest.mark.parametrize(("said", "meant"), [
    ("0:10", range(10)), ("3", [3]), ("1,5,9", [1, 5, 9]), ("0:10:3", [0, 3, 6, 9]), ("0:2, 7", [0, 1, 7]), (4, [4]), ([2, 1], [2, 1]),
])  # fmt: skip
def test_seeds_are_reported_in_many_ways(said, meant):
    assert seeds_of(said) == tuple(meant)


@given(st.integers(0, 10**12), st.integers(1, 300), st.integers(1, 9))
def test_seeds_are_ranges_as_pythons(first, count, step):
    assert seeds_of(f"{first}:{first + count}:{step}") == tuple(range(first, first + count, step))


@pytest.mark.parametrize("said", ["", "ten", "3:3", "5:1", "0:9:0", "-1", "0:-3", "1,,2", "1,1", "0:1000000000000", [], [1.5], [True],
                                  [0, 0], None, {"a": 1}, [-1]])  # fmt: skip
def test_what_are_no_seeds_is_said(said):
    with pytest.raises(SettingsError, match=r"^here: found .*, expected numbers from 0 on: 0:10 \(which is 0 to 9\)"):
        seeds_of(said, "here")


# Grids


def test_a_grid_is_every_case_with_every_combination(written):
    grid = read_grid(written(GRID))
    assert grid.seeds == (0, 1, 2)
    assert len(grid.cases) == 2 * 2 * 3
    assert len({case.label for case in grid.cases}) == 12
    assert grid.cases[0].label == "drs, particles 100, factor 2.0"
    options = [make_options(case.values) for case in grid.cases]
    assert {o.tracker.resampling for o in options[:6]} == {"deterministic"}
    assert [o.silhouette.factor for o in options[:6]] == [2.0, 3.0, 4.0] * 2
    assert {o.tracker.arm.particles for o in options} == {100, 200}
    assert [o.tracker.arm.survival for o in options] == [0.5] * 6 + [0.6] * 6  # a case holds over what all have
    assert all(o.tracker.torso.particles == 200 and o.preset == "liu2011" for o in options)


def test_any_file_of_settings_is_a_grid(written, tmp_path):
    options = make_options({"preset": "liu2011", "seed": 7, "tracker": {"arm": {"particles": 50}}})
    run = {"complete": True, "versions": {}, "settings": for_toml(plain_options(options))}
    grid = read_grid(written(tomli_w.dumps(run)))
    assert grid.seeds == (7,)
    assert [make_options(case.values) for case in grid.cases] == [replace(options, seed=0)]


def test_flags_hold_over_the_file_and_may_not_be_varied(written):
    path = written(GRID)
    assert {case.values["preset"] for case in read_grid(path, {"preset": "default"}).cases} == {"default"}
    with pytest.raises(SettingsError, match=r"^flags: tracker.arm.particles: found 50, but the grid varies it"):
        read_grid(path, {"tracker": {"arm": {"particles": 50}}})


def test_files_are_reported_from_the_grids_folder_on(written, tmp_path):
    grid = read_grid(written('calibration = "rig.toml"\n[grid]\nprior = ["a.npz", "b.npz"]\n[case.x]\nperson = "me.toml"\n'))
    values = grid.cases[1].values
    assert [values["calibration"], values["prior"], values["person"]] == [str(tmp_path / name) for name in ("rig.toml", "b.npz", "me.toml")]


@pytest.mark.parametrize(("text", "said"), [
    ("grid = 3", "grid: found 3, expected a table [grid]"),
    ("[grid]\nmasks = true", "grid.masks: found True, expected a list of values"),
    ("[grid]\nmasks = []", "grid.masks: found [], expected a list of values"),
    ("[grid]\nheight = [1.7, 1.7]", "grid.height: found 1.7 twice"),
    ("[grid]\nheight = [1.7, 170]", "grid.height: height: found 170; expected 0.5 to 2.5 metres"),
    ("[grid]\n\"tracker.arm.particle\" = [1]", "grid.tracker.arm.particle: tracker: "),
    ("[grid]\ncolour = [1]", "grid.colour: "),
    ("[grid]\nseed = [1, 2]", "grid.seed: found [1, 2], expected seeds = ..."),
    ("[case]\nfast = 3", "case.fast: found 3, expected a table of settings"),
    ("case = 'fast'", "case: found 'fast', expected a table [case]"),
    ("[case.fast]\nspeed = 3", "case.fast: unknown setting 'speed'; there are: anyway, appearance, background"),
    ("[case.fast]\nheight = 'tall'", "case.fast: height: found 'tall'"),
    ("[case.fast]\nseed = 3", "case.fast: found a seed in it"),
    ("[case.'a/b']\nmasks = true", "case: found the name 'a/b', expected letters"),
    ("seeds = 'all'", "seeds: found 'all', expected numbers"),
    ("speed = 3", "unknown setting 'speed'"),
    ("[grid", "not valid TOML"),
    (f"[grid]\nheight = {[1 + n / 1000 for n in range(500)]}\ndistance = {[1 + n / 1000 for n in range(500)]}",
     "grid: found 250000 combinations, expected at most 10000"),
])  # fmt: skip
def test_what_is_wrong_with_a_grid_is_said_with_file_and_field(written, text, said):
    path = written(text)
    with pytest.raises(SettingsError) as error:
        read_grid(path)
    assert str(error.value).startswith(f"{path}: ")
    assert said in str(error.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(SettingsError, match=r"none.toml: cannot be read \(no such file"):
        read_grid(tmp_path / "none.toml")


# Tasks


@given(st.sets(st.lists(st.sampled_from("ab"), min_size=1, max_size=4).map(tuple), min_size=1, max_size=5))
def test_recordings_have_as_many_folders_in_their_names_as_tell_them_apart(places):
    names = [task.name for task in make_tasks([Path("/", *place) for place in places], [Case("", {}, {})], [0])]
    depth = 1 + max(name.count("-") for name in names)
    assert names == ["-".join(place[-depth:]) for place in places]
    assert len(set(names)) == len(places)
    assert depth == 1 or len({place[1 - depth:] for place in places}) < len(places)


def test_recordings_that_no_number_of_folders_tells_apart_are_numbered():
    names = [task.name for task in make_tasks(["/a/b-c", "/a-b/c", "/d/c"], [Case("", {}, {})], [0])]
    assert names == ["a-b-c-0", "a-b-c-1", "d-c-2"]


def ids(recording: Path, values: dict | None = None, seeds=(0,)) -> list[str]:
    return [task.id for task in make_tasks([recording], make_grid(values).cases, seeds)]


def test_a_task_is_known_by_recording_settings_and_seed(recording, tmp_path):
    first = ids(recording)
    assert ids(recording) == first
    assert ids(recording, {"preset": "default"}) == first  # said or not, it is the same
    assert ids(recording, {"tracker": {"arm": {"particles": Options().tracker.arm.particles}}}) == first
    others = [*ids(recording, {"tracker": {"arm": {"particles": 77}}}), *ids(recording, seeds=(1, 2)), *ids(recording, {"overlay": True})]
    assert len({*first, *others}) == 5
    renamed = make_tasks([recording], [Case("fast", {}, {})], [0])
    assert [task.id for task in renamed] == first
    moved = recording.rename(tmp_path / "walk")
    assert ids(moved) == first


@pytest.mark.parametrize("salt", ["1", "2"])
def test_another_process_knows_the_same_task(recording, salt):
    """As a second start must, whatever the seed of Python's own hashes is; and another machine."""
    said = "import sys; from test_grid import ids; from pathlib import Path; print(*ids(Path(sys.argv[1]), {'height': 1.8}, (0, 1)))"
    path = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    done = subprocess.run([sys.executable, "-c", said, recording], env={**os.environ, **path, "PYTHONHASHSEED": salt}, text=True,
                          stdout=subprocess.PIPE, check=True)
    assert done.stdout.split() == ids(recording, {"height": 1.8}, (0, 1))


@pytest.mark.parametrize("change", ["video/a.mp4", "calibration.toml", "truth.csv", "recording.toml", "masks/a.png"])
def test_another_content_is_another_task(recording, change):
    first = ids(recording)
    (recording / change).parent.mkdir(exist_ok=True)
    (recording / change).write_text("other")
    assert ids(recording) != first


def test_what_a_run_does_not_read_is_no_other_content(recording):
    first = ids(recording)
    (recording / "notes.txt").write_text("filmed on a Monday")
    (recording / "batch" / "runs").mkdir(parents=True)
    assert ids(recording) == first


def test_files_in_other_places_are_content_too(recording, tmp_path):
    (tmp_path / "take.mp4").write_text("1")
    (recording / "recording.toml").write_text('[video]\na = "../../take.mp4"\n')
    first = ids(recording)
    (tmp_path / "take.mp4").write_text("2")
    assert ids(recording) != first


def test_files_that_settings_name_are_content_too(recording, tmp_path):
    person = tmp_path / "person.toml"
    person.write_text("height = 1.7")
    first = ids(recording, {"person": str(person)})
    moved = person.rename(tmp_path / "me.toml")
    assert ids(recording, {"person": str(moved)}) == first
    moved.write_text("height = 1.8")
    assert ids(recording, {"person": str(moved)}) != first


def test_long_files_are_distinguished_by_their_ends(tmp_path):
    film, prints = tmp_path / "film.mp4", set()
    for start, end, size in ((b"a", b"z", 10**6), (b"b", b"z", 10**6), (b"a", b"y", 10**6), (b"a", b"z", 10**6 + 1)):
        film.write_bytes(start + bytes(size) + end)
        prints.add(fingerprint(film))
    assert len(prints) == 4


def test_tasks_whose_silhouettes_are_the_same_are_of_one_film(recording):
    cases = make_grid({}, grid={"tracker.resampling": ["deterministic", "systematic"]}).cases
    assert len({task.film for task in make_tasks([recording], cases, [0, 1])}) == 1
    cases = make_grid({}, grid={"silhouette.factor": [2.0, 3.0], "max_size": [320, 640]}).cases
    assert len({task.film for task in make_tasks([recording], cases, [0, 1])}) == 4


def test_recordings_of_one_name_are_distinguished(tmp_path):
    tasks = make_tasks([tmp_path / "a" / "walk", tmp_path / "b" / "walk", tmp_path / "c" / "run"], make_grid().cases, [0])
    assert [task.name for task in tasks] == ["a-walk", "b-walk", "c-run"]
    assert len({task.id for task in tasks}) == len({task.folder for task in tasks}) == 3


def test_a_run_folder_has_a_readable_name(recording):
    grid = make_grid(cases={"drs": {}}, grid={"tracker.arm.particles": [50], "region": [[1, 2, 30, 40]]})
    (task,) = make_tasks([recording], grid.cases, [3])
    assert task.label == "walk, drs, particles 50, region 1-2-30-40, seed 3"
    assert task.folder == f"walk_drs_particles-50_region-1-2-30-40_seed-3_{task.id}"


@pytest.mark.parametrize(("recordings", "grid", "seeds", "said"), [
    ([], {}, [0], "recordings: found none"),
    (["a", "./a"], {}, [0], "recordings: found ./a twice"),
    (["a"], {"cases": {"x": {}, "y": {"preset": "default"}}}, [0], "grid: found 'y' and 'x', which are the same settings"),
    ([f"r{n}" for n in range(200)], {}, range(1000), "batch: found 200 recordings x 1 choices of settings x 1000 seeds"),
])  # fmt: skip
def test_what_cannot_be_a_batch_is_said(recordings, grid, seeds, said):
    with pytest.raises(ShadowPuppetError, match=said):
        make_tasks(recordings, make_grid(**grid).cases, seeds)
