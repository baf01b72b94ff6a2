"""people.csv, and the folders of several people's runs."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.people import PEOPLE, open_places, person_folder, person_folders, read_places, write_place
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter

JOINTS, DOFS = ["pelvis"], ["root_x"]


def two_people(folder):
    """A run of two people without frames."""
    with RunWriter(folder, "anatomical", DOFS, JOINTS, {}) as writer:
        writer.hand_over()
        with open_places(folder) as file:
            for n in range(3):
                for person in (1, 2):
                    gone = person == 2 and n == 2
                    place = np.full(2, np.nan) if gone else np.array([n, person])
                    write_place(file, n / 10, person, "absent" if gone else "tracked", place)
        for person in (1, 2):
            with RunWriter(person_folder(folder, person), "anatomical", DOFS, JOINTS, {"person": person}):
                pass
        writer.info["people"] = 2
    return folder


def test_places_are_read_as_they_were_written(tmp_path):
    places = read_places(two_people(tmp_path / "run"))
    assert list(places) == [1, 2]
    times, status, where = places[2]
    assert times.tolist() == [0.0, 0.1, 0.2]
    assert status == ["tracked", "tracked", "absent"]
    assert where[1].tolist() == [1, 2]
    assert np.isnan(where[2]).all()


def test_places_go_on_after_those_that_are_kept(tmp_path):
    whole = (two_people(tmp_path / "run") / PEOPLE).read_bytes()
    size = whole.index(b"\n", 40) + 1
    with open_places(tmp_path / "run", size) as file:
        file.write(whole[size:])
    assert (tmp_path / "run" / PEOPLE).read_bytes() == whole
    with pytest.raises(FormatError, match=r"people\.csv: found fewer lines than the checkpoint"):
        open_places(tmp_path / "run", len(whole) + 1)


def test_a_run_of_several_people_names_its_folders(tmp_path):
    folder = two_people(tmp_path / "run")
    assert list(person_folders(folder)) == [1, 2]
    with pytest.raises(FormatError, match=r"runs of 2 people, expected one of them: person-1, person-2"):
        read_run(folder)
    assert read_run(folder / "person-2").info["person"] == 2


def test_a_new_run_removes_the_people_of_an_earlier_one(tmp_path):
    folder = two_people(tmp_path / "run")
    (folder / "person-2" / "notes.txt").write_text("mine")
    with RunWriter(folder, "anatomical", DOFS, JOINTS, {}):
        pass
    assert sorted(path.name for path in folder.iterdir()) == ["angles.csv", "intervals.csv", "joints.csv", "metrics.json", "motion.npz",
                                                              "person-2", "run.toml"]
    assert [path.name for path in (folder / "person-2").iterdir()] == ["notes.txt"]
    assert person_folders(folder) == {}


def test_people_replace_a_run_of_one(tmp_path):
    with RunWriter(tmp_path / "run", "anatomical", DOFS, JOINTS, {}):
        pass
    two_people(tmp_path / "run")
    assert not (tmp_path / "run" / "joints.csv").exists()


def test_an_interrupted_run_is_not_complete(tmp_path):
    def stopped() -> None:
        with RunWriter(tmp_path / "run", "anatomical", DOFS, JOINTS, {}) as writer:
            writer.hand_over()
            raise ShadowPuppetError("stop")

    with pytest.raises(ShadowPuppetError, match="stop"):
        stopped()
    assert "complete = false" in (tmp_path / "run" / "run.toml").read_text()


@pytest.mark.parametrize(("text", "match"), [
    ("time,person\n0,1\n", "found the columns time, person"),
    ("time,person,status,x,y\n0,,tracked,1,2\n", "empty time or person"),
    ("time,person,status,x,y\n0,one,tracked,1,2\n", "line 2, column 'person'"),
])  # fmt: skip
def test_a_damaged_table_is_named(tmp_path, text, match):
    (tmp_path / PEOPLE).write_text(text)
    with pytest.raises(FormatError, match=match):
        read_places(tmp_path)
