"""angles.toml of a run folder."""

from __future__ import annotations

import tomllib

import pytest
import runs

from shadowpuppet.io.angle_conventions import write_angles


@pytest.mark.parametrize("body", runs.BODIES)
def test_a_run_has_a_table_for_each_of_its_angles(tmp_path, body):
    run = runs.make_run(tmp_path / "run", body, frames=3)
    found = tomllib.loads((run / "angles.toml").read_text())
    dofs = runs.body_of(body).skeleton.dofs
    assert [key for key, value in found.items() if isinstance(value, dict)] == [dof.name for dof in dofs]
    for dof in dofs:
        entry = found[dof.name]
        assert entry["unit"] == ("m" if dof.kind == "translation" else "rad")
        assert {"joint", "order", "axis", "zero", "positive", "kind"} <= set(entry)


def test_an_ankle_is_positive_against_the_society(tmp_path):
    found = tomllib.loads((runs.make_run(tmp_path / "run", frames=3) / "angles.toml").read_text())
    ankle = found["left_ankle_flexion"]
    assert (ankle["isb"], ankle["isb_sign"]) == ("ankle dorsiflexion", -1)
    assert ankle["positive"] == "left_toe moves down"
    assert ankle["zero"] == "left_toe before left_ankle"
    assert found["right_ankle_inversion"]["order"] == 2
    assert "low" not in found["root_heading"]


def test_a_body_of_ones_own_has_none(tmp_path):
    assert not write_angles(tmp_path / "angles.toml", "robot", ["a"])
    assert not write_angles(tmp_path / "angles.toml", "anatomical", ["a"])
    assert not (tmp_path / "angles.toml").exists()
