"""The movement in a run: figures of its gait, angles over the cycle, ranges; in the page, the table and the command's words."""

from __future__ import annotations

import csv
import warnings
from dataclasses import replace
from pathlib import Path

import c3d
import numpy as np
import pytest
import runs
from walkers import walking

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.cli import app as cli
from shadowpuppet.evaluation.evaluation import measure_run
from shadowpuppet.evaluation.movement.angles import HEADING, Angle, joint_angles, ranges
from shadowpuppet.evaluation.movement.movement import Movement, movement_of, write_movement
from shadowpuppet.evaluation.report.movement_section import movement_section
from shadowpuppet.io.export import export_run
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.opensim.coordinates import coordinates
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.motion import MotionFrame

SD_JOINT, SD_ANGLE = 0.01, np.radians(2.0)
KNEE = 40.0
"""Degrees by which a made knee bends and straightens again in each second."""


def walk_run(folder: Path) -> Path:
    """A run whose joints walk, whose knees bend by a known curve, and whose deviations are known."""
    _, table = walking(seconds=6.0)
    skeleton = make_body("anatomical", average_sizes("anatomical", 1.78)).skeleton
    poses = np.zeros((len(table.times), len(skeleton.dofs)))
    for n, side in enumerate(SIDES):
        poses[:, skeleton.dof_names.index(f"{side}_knee_flexion")] = np.radians(KNEE) * (0.5 - 0.5 * np.cos(2 * np.pi * table.times + n))
    with RunWriter(folder, "anatomical", skeleton.dof_names, table.names, {"recording": "made"}) as run:
        for time, joints, pose in zip(table.times.tolist(), table.positions, poses):
            run.write(MotionFrame(time, "tracked", pose, joints, np.full_like(pose, SD_ANGLE), np.full_like(joints, SD_JOINT)))
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    return read_run(walk_run(tmp_path_factory.mktemp("walk") / "run"))


@pytest.fixture(scope="module")
def movement(run) -> Movement:
    return movement_of(run)


def test_figures_are_those_of_the_steps_and_intervals_those_of_the_run(movement):
    by_name = {each.name: each for each in movement.figures}
    gait = movement.gait
    assert movement.no_gait == ""
    lengths = np.array([step.length for step in gait.counted if step.side == "left"])
    length = by_name["step length"].left
    assert (length.number, length.mean, length.sd) == (len(lengths), pytest.approx(lengths.mean()), pytest.approx(lengths.std(ddof=1)))
    assert length.stated == pytest.approx(HALF_WIDTH * SD_JOINT * np.sqrt(2))
    both = by_name["stride time"].both
    assert by_name["cadence"].both.mean == pytest.approx(120 / both.mean, rel=0.01)
    assert by_name["speed"].both.mean == pytest.approx(by_name["stride length"].both.mean / both.mean, rel=0.01)
    assert np.isnan(by_name["cadence"].both.stated)
    stance = by_name["stance"]
    assert stance.symmetry == pytest.approx(200 * (stance.left.mean - stance.right.mean) / (stance.left.mean + stance.right.mean))


def test_angles_over_the_cycle_are_those_of_the_strides(run, movement):
    cycles = {(each.name, each.side): each for each in movement.cycles}
    knee = cycles["knee flexion", "left"]
    strides = [stride for stride in movement.gait.strides if stride.side == "left"]
    at = np.array([stride.begin + np.linspace(0, 1, 101) * stride.seconds for stride in strides])
    true = KNEE * (0.5 - 0.5 * np.cos(2 * np.pi * at))
    np.testing.assert_allclose(knee.mean, true.mean(0), atol=0.1)
    np.testing.assert_allclose(knee.sd, true.std(0, ddof=1), atol=0.1)
    np.testing.assert_allclose(knee.stated, HALF_WIDTH * 2.0)
    assert knee.number == len(strides)
    assert {side for name, side in cycles if name == "root bow"} == {*SIDES}  # of the middle, over both feet's cycles


def test_coordinates_have_the_deviations_of_their_degrees_of_freedom(tmp_path, rng):
    """Against random poses about the run's."""
    folder = runs.make_run(tmp_path / "run", "anatomical", frames=5)
    run = read_run(folder)
    sd = np.full_like(run.motion.poses, 1e-3)
    motion = replace(run.motion, pose_sd=sd)
    angles = {(each.name, each.side): each for each in joint_angles(replace(run, motion=motion))}
    tree = BodyTree(runs.body_of("anatomical"))
    drawn = [coordinates(tree.animation(motion.times, motion.poses + sd * rng.standard_normal(sd.shape), np.eye(4)), "own")
             for _ in range(400)]
    for coordinate, name, side in (("hip_flexion_l", "hip flexion", "left"), ("arm_rot_r", "arm rot", "right"),
                                   ("lumbar_extension", "lumbar extension", ""), ("ankle_angle_l", "ankle angle", "left")):
        values = np.degrees(np.unwrap(np.array([each[coordinate] for each in drawn]), axis=0))
        np.testing.assert_allclose(angles[name, side].sd, values.std(0), rtol=0.15)
    bow = motion.dof_names.index("root_bow")
    np.testing.assert_allclose(angles["pelvis tilt", ""].degrees, np.degrees(motion.poses[:, bow]))
    assert HEADING in {name for name, _ in angles}


def test_a_motion_without_strides_has_ranges_over_the_frames_vouched_for(tmp_path):
    times = np.arange(100) / 50.0
    degrees, sure = 30 * np.sin(2 * np.pi * times), np.ones(100, bool)
    degrees[40], sure[40] = 500, False
    (found,) = ranges(times, [Angle("knee angle", "left", degrees, np.full(100, 2.0), sure)])
    assert (found.low, found.high) == pytest.approx((-30, 30), abs=0.1)
    assert found.speed == pytest.approx(30 * 2 * np.pi, rel=0.01)
    assert (found.frames, found.left_out) == (99, 1)
    assert found.stated == pytest.approx(HALF_WIDTH * 2.0)


@pytest.mark.parametrize(("body", "why"), [("rounded", "has no feet"), ("anatomical", "no f")])
def test_who_takes_no_stride_is_told_why(tmp_path, body, why):
    folder = runs.make_run(tmp_path / "run", body, lost=(3,), spread=True)
    found = movement_of(read_run(folder))
    assert not found.figures
    assert not found.cycles
    assert why in found.no_gait
    assert "0 of" not in found.no_gait
    section = movement_section(found)
    assert found.no_gait[1:].replace("'", "&#x27;") in section
    assert "elbow flex" in section
    assert all(each.left_out == 1 for each in found.ranges)


def test_a_table_has_a_row_a_figure_and_a_row_a_percent(tmp_path, movement):
    write_movement(tmp_path / "movement.csv", movement)
    with (tmp_path / "movement.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    cadence = next(row for row in rows if (row["name"], row["side"]) == ("cadence", "both"))
    assert float(cadence["mean"]) == pytest.approx(movement.figures[2].both.mean, abs=1e-4)
    assert cadence["half_width_90"] == ""
    knee = [row for row in rows if (row["name"], row["side"]) == ("knee flexion", "right")]
    assert [row["percent"] for row in knee] == [str(n) for n in range(101)]
    assert knee[0]["normal_mean"] == ""  # a degree of freedom has no band: names are those of coordinates


def test_strikes_in_a_c3d_file_are_those_of_the_strides(tmp_path, run, movement):
    export_run(run.folder, ["c3d"], tmp_path)
    with next(tmp_path.rglob("*.c3d")).open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the reader, where a parameter of ours is not one that it looks for
        parameters = c3d.Reader(file)
        times = parameters.get("EVENT:TIMES").float_array.reshape(-1, 2)[:, 1]
        labels, sides = ([word.strip() for word in parameters.get(f"EVENT:{name}").string_array] for name in ("LABELS", "CONTEXTS"))
    found = list(zip(labels, sides))
    strikes = {side: times[[each == ("Foot Strike", side.capitalize()) for each in found]] for side in SIDES}
    assert movement.gait.strides
    for stride in movement.gait.strides:
        for end in (stride.begin, stride.end):
            assert np.abs(strikes[stride.side] - end).min() < 1e-3
    assert labels.count("Foot Off") >= len(movement.gait.strides)


def test_page_table_and_words_say_the_same(tmp_path, run, capsys):
    write_person(run.folder / "person.toml", Person(average_sizes("anatomical", 1.78), 1.78, "tests"))
    of = measure_run(run.folder)
    cadence = f"{of.measured['gait']['figures']['cadence']['both']['mean']:.1f}"
    text = movement_section(movement_of(of.run))
    assert f"<td>{cadence} ± " in text
    assert ">knee angle<" in text
    assert 'id="cycle-' in text
    assert ">normal<" in text
    assert cli.run(["evaluate", str(run.folder), "--movement", str(tmp_path / "movement.csv")]) == 0
    assert f"{cadence} steps/min" in capsys.readouterr().out
    with (tmp_path / "movement.csv").open(newline="") as file:
        (knee,) = [row for row in csv.DictReader(file) if (row["name"], row["side"], row["percent"]) == ("knee angle", "left", "72")]
    assert float(knee["normal_mean"]) == pytest.approx(61.9, abs=0.1)
