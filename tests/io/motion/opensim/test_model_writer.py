"""Models for OpenSim: moved by a run's coordinates, a model's markers lie where the run's joints do; masses are a person's."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
import runs
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.motion.opensim.body_masses import average_weight, body_masses
from shadowpuppet.io.motion.opensim.coordinates import coordinates
from shadowpuppet.io.motion.opensim.model_writer import marker_names, write_osim
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation

WHOLE = ("anatomical", "cylinders")


def moving(tmp_path, name: str) -> Animation:
    return motion_animation(runs.body_of(name), read_run(runs.make_run(tmp_path / "run", name, frames=12)).motion)[0]


def numbers(element: ElementTree.Element | None) -> np.ndarray:
    assert element is not None
    return np.array([float(value) for value in (element.text or "").split()])


def frames_of(model: ElementTree.Element, values: dict[str, float]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Rotation and place of every body in the ground, by OpenSim's documented rules: a plain reader of the file."""
    frames = {"ground": (np.eye(3), np.zeros(3))}
    for joint in model.findall("JointSet/objects/CustomJoint"):
        parent, child = (frame.findtext("socket_parent", "").split("/")[-1] for frame in joint.findall("frames/PhysicalOffsetFrame"))
        R, p = frames[parent]
        offset = numbers(joint.find("frames/PhysicalOffsetFrame/translation"))
        turn, shift = np.eye(3), np.zeros(3)
        for axis in joint.findall("SpatialTransform/TransformAxis"):
            value = values.get(axis.findtext("coordinates") or "", 0.0)
            if axis.attrib["name"].startswith("rotation"):
                turn = turn @ Rotation.from_rotvec(value * numbers(axis.find("axis"))).as_matrix()
            else:
                shift = shift + value * numbers(axis.find("axis"))
        frames[child] = R @ turn, p + R @ (offset + shift)
    return frames


@pytest.mark.parametrize("name", WHOLE)
def test_the_models_markers_lie_where_the_runs_joints_do(tmp_path, name):
    body, animation = runs.body_of(name), moving(tmp_path, name)
    write_osim(tmp_path / "a.osim", body, animation)
    model = ElementTree.parse(tmp_path / "a.osim").getroot()[0]
    q = coordinates(animation, "own")
    table = marker_names(animation.table)
    assert ("LBigToe" in table.names) == (name == "anatomical")
    known = {each.attrib["name"]: each for each in model.findall("MarkerSet/objects/Marker")}
    assert set(table.names) == set(known)
    for t in range(len(table.times)):
        frames = frames_of(model, {key: float(value[t]) for key, value in q.items()})
        for n, marker in enumerate(table.names):
            R, p = frames[known[marker].findtext("socket_parent_frame", "").split("/")[-1]]
            np.testing.assert_allclose(p + R @ numbers(known[marker].find("location")), table.positions[t, n], atol=1e-6)


@pytest.mark.parametrize("name", WHOLE)
def test_poses_within_our_limits_are_within_the_ranges_of_the_models_hinges(tmp_path, name):
    body = runs.body_of(name)
    lowest, highest = body.skeleton.limits
    poses = np.array([lowest, highest]).clip(-3, 3)
    animation = BodyTree(body).animation(np.arange(2.0), poses, np.eye(4))
    write_osim(tmp_path / "a.osim", body, animation)
    model = ElementTree.parse(tmp_path / "a.osim").getroot()[0]
    ranges = {each.attrib["name"]: numbers(each.find("range")) for each in model.iter("Coordinate")}
    assert all(low < high for low, high in ranges.values())
    hinges = {each: values for each, values in coordinates(animation, "own").items() if each.startswith(("knee", "ankle", "elbow"))}
    assert len(hinges) == (6 if name == "anatomical" else 4)
    for each, values in hinges.items():
        np.testing.assert_allclose(np.sort(values), ranges[each], atol=1e-6)


@pytest.mark.parametrize("name", WHOLE)
def test_the_segments_have_the_persons_weight_and_possible_inertias(tmp_path, name):
    write_osim(tmp_path / "a.osim", runs.body_of(name), moving(tmp_path, name), 61.5)
    bodies = ElementTree.parse(tmp_path / "a.osim").getroot().findall("Model/BodySet/objects/Body")
    assert sum(float(numbers(body.find("mass"))[0]) for body in bodies) == pytest.approx(61.5, abs=1e-5)
    for body in bodies:
        xx, yy, zz, xy, xz, yz = numbers(body.find("inertia"))
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2] * (1 - 1e-9)  # no body without this is possible
    mass = {body.attrib["name"]: float(numbers(body.find("mass"))[0]) for body in bodies}
    assert mass["femur_r"] == pytest.approx(0.1447 * 61.5, rel=0.01)  # de Leva (1996)


def test_masses_are_those_of_the_same_parts_however_they_are_joined(tmp_path):
    animation = moving(tmp_path, "anatomical")
    own = {name: name if animation.parents[n] < 0 or name in ("chest", "neck") else animation.names[animation.parents[n]]
           for n, name in enumerate(animation.names)}  # fmt: skip
    whole = body_masses(animation, dict.fromkeys(own, "pelvis"), 80.0)["pelvis"]
    apart = body_masses(animation, {name: name for name in animation.names}, 80.0)
    rest = dict(zip(animation.names, animation.rest))
    centre = np.sum([part.mass * (part.centre + rest[name]) for name, part in apart.items()], 0) / 80
    np.testing.assert_allclose(whole.centre, centre, atol=1e-12)
    about = np.sum([part.inertia + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
                    for name, part in apart.items() for d in [part.centre + rest[name] - centre]], 0)  # fmt: skip
    np.testing.assert_allclose(whole.inertia, about, atol=1e-9)
    assert abs(centre[0]) < 1e-6  # left and right are alike
    assert -0.05 < centre[1] < 0.15  # metres over the hips: a standing person's is at the navel's height or under it


def test_a_person_of_average_build_weighs_what_one_does(tmp_path):
    assert 65 < average_weight(moving(tmp_path, "anatomical")) < 75  # 1.78 m with shoes


def test_an_upper_body_is_said_to_have_no_model(tmp_path):
    with pytest.raises(ShadowPuppetError, match=r"a\.osim: found an upper body \(rounded\), expected a whole body"):
        write_osim(tmp_path / "a.osim", runs.body_of("rounded"), moving(tmp_path, "rounded"))


def test_opensim_reads_the_model(tmp_path):
    opensim = pytest.importorskip("opensim")
    write_osim(tmp_path / "a.osim", runs.body_of("anatomical"), moving(tmp_path, "anatomical"), 70.0)
    model = opensim.Model(str(tmp_path / "a.osim"))
    state = model.initSystem()
    assert model.getTotalMass(state) == pytest.approx(70)
    assert model.getNumCoordinates() == 32
