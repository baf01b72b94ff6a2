"""Motion capture on the mannequin: directions and lengths kept, feet on the floor, and the spec that asks for it."""

from __future__ import annotations

from dataclasses import replace

import acclaim
import numpy as np
import pytest

from shadowpuppet.errors import FormatError, SettingsError
from shadowpuppet.io.motion.amc import read_mocap
from shadowpuppet.synthetic import Gesture, Mannequin, Spec, spec_from
from shadowpuppet.synthetic.movement.mocap import retarget
from shadowpuppet.synthetic.person.kinematics import SEGMENTS
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.recording import perform

BONES = (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand"), ("hip", "knee"), ("knee", "ankle"))
LIMBS = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in BONES]


def unit(v):
    return v / np.linalg.norm(v, axis=1)[:, None]


def of(table):
    return dict(zip(table.names, table.positions.swapaxes(0, 1)))


def at(figure):
    return dict(zip(JOINTS, figure.joints.swapaxes(0, 1)))


@pytest.fixture
def capture(tmp_path, rng):
    return read_mocap(acclaim.write(tmp_path, 40, rng)[0])


@pytest.mark.parametrize("kind", ["man", "child"])
def test_limbs_point_where_the_measured_ones_point_on_the_bodys_own_lengths(capture, kind, rng):
    body = Mannequin.draw(rng, kind)
    table = capture.joints()
    measured, found, rest = of(table), at(retarget(body, table, capture.at_rest.joints())), body.rest()
    for a, b in LIMBS:
        wanted = measured[b] - measured[a]
        ours = found[b] - found[a]
        np.testing.assert_allclose(unit(ours), unit(wanted), atol=1e-6)
        length = {"knee": body.length("thigh"), "ankle": body.length("shank")}.get(b.split("_")[1], np.linalg.norm(rest[b] - rest[a]))
        np.testing.assert_allclose(np.linalg.norm(ours, axis=1), length)


def test_joints_lie_at_their_segments(capture):
    figure = retarget(Mannequin(), capture.joints(), capture.at_rest.joints())
    for side in ("left", "right"):
        ankle, foot = at(figure)[f"{side}_ankle"], figure.origin[:, SEGMENTS.index(f"{side}_foot")]
        np.testing.assert_allclose(ankle, foot, atol=1e-9)
    assert min(at(figure)[f"{side}_ankle"][:, 2].min() for side in ("left", "right")) > -0.1


def test_every_segment_is_a_rotation_and_at_rest_none_turns(capture):
    table, rest = capture.joints(), capture.at_rest.joints()
    figure = retarget(Mannequin(), table, rest)
    identity = figure.rotation @ figure.rotation.swapaxes(-1, -2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-9)
    assert (np.linalg.det(figure.rotation) > 0).all()
    calm = retarget(Mannequin(), rest, rest)
    trunk = ("pelvis", "abdomen", "thorax", "neck", "head")
    limbs = ("left_hand", "right_hand", "right_forearm", "left_foot", "right_toes", "left_clavicle", "left_upper_arm", "right_upper_arm")
    for segment in (*trunk, *limbs):
        np.testing.assert_allclose(calm.rotation[0, SEGMENTS.index(segment)], np.eye(3), atol=1e-6, err_msg=segment)
    thigh = calm.rotation[0, SEGMENTS.index("left_thigh")] @ [0, 0, 1]
    np.testing.assert_allclose(thigh, [-0.342, 0, 0.9397], atol=1e-3)  # the skeleton at rest stands with its legs apart


def test_turning_the_whole_capture_turns_the_whole_figure(capture):
    table, rest = capture.joints(), capture.at_rest.joints()
    angle = 0.7
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    plain = retarget(Mannequin(), table, rest)
    turned = retarget(Mannequin(), replace(table, positions=table.positions @ R.T), rest)
    np.testing.assert_allclose(turned.joints, plain.joints @ R.T, atol=1e-9)
    np.testing.assert_allclose(turned.rotation, R @ plain.rotation, atol=1e-9)


def test_a_bent_elbow_and_knee_tell_how_the_limb_is_turned(tmp_path):
    frames = acclaim.poses(1, np.random.default_rng(0), 0.0)
    frames[0]["root"] = [0, 17, 0, 0, 0, 0]
    frames[0]["lradius"], frames[0]["ltibia"] = [70.0], [60.0]
    (tmp_path / "01.asf").write_text(acclaim.asf(), "utf-8")
    (tmp_path / "01.amc").write_text(acclaim.amc(frames), "utf-8")
    capture = read_mocap(tmp_path / "01.amc")
    figure = retarget(Mannequin(), capture.joints(), capture.at_rest.joints())
    joint = {name: places[0] for name, places in at(figure).items()}
    for segment, column, sign, (a, b, c) in (("left_upper_arm", 2, -1, ("shoulder", "elbow", "wrist")),
                                             ("left_thigh", 0, 1, ("hip", "knee", "ankle")),
                                             ("left_shank", 0, 1, ("hip", "knee", "ankle"))):  # fmt: skip
        plane = np.cross(joint[f"left_{b}"] - joint[f"left_{a}"], joint[f"left_{c}"] - joint[f"left_{b}"])
        hinge = figure.rotation[0, SEGMENTS.index(segment)][:, column]
        assert sign * (plane @ hinge) / np.linalg.norm(plane) > 0.99, segment


def test_a_spec_plays_a_file(tmp_path):
    path, _ = acclaim.write(tmp_path, 60, np.random.default_rng(2), size=3.0)
    spec = Spec(motion=(Gesture(motion="mocap", seconds=60, file=str(path), file_rate=20.0),), rate=10)
    times, figure = perform(spec, np.random.default_rng(1))
    assert times[-1] == pytest.approx(2.9)
    pelvis = figure.joints[:, 0, :2]
    np.testing.assert_allclose(pelvis.max(0) + pelvis.min(0), 0, atol=1e-9)
    facing = figure.rotation[0, 0] @ [0, -1, 0]
    assert abs(facing[0]) < 1e-6
    assert facing[1] < -0.9
    later = perform(replace(spec, motion=(replace(spec.motion[0], start=1.0),)), np.random.default_rng(1))
    np.testing.assert_allclose(later[0][-1], 1.9)
    rough = perform(replace(spec, rate=5), np.random.default_rng(1))
    np.testing.assert_allclose(rough[1].rotation[3], figure.rotation[6], atol=0.05)


def test_what_cannot_be_played_is_said(tmp_path):
    path, _ = acclaim.write(tmp_path, 5)
    with pytest.raises(SettingsError, match=r"motion.0: .*file: needed by the motion mocap, and only by it"):
        spec_from({"motion": [{"motion": "mocap"}]})
    with pytest.raises(SettingsError, match=r"file: needed by the motion mocap"):
        spec_from({"motion": [{"motion": "walk", "file": "a.amc"}]})
    played = Gesture(motion="mocap", file=str(path))
    with pytest.raises(SettingsError, match=r"found mocap among 2 motions, expected it alone"):
        perform(Spec(motion=(played, Gesture(motion="walk"))), np.random.default_rng(1))
    with pytest.raises(SettingsError, match=r"start: found 9 s, but .*01_01.amc has only 0.03 s"):
        perform(Spec(motion=(replace(played, start=9.0),)), np.random.default_rng(1))
    with pytest.raises(FormatError, match=r"gone.amc: cannot be read \(no such file\)"):
        perform(Spec(motion=(replace(played, file=str(tmp_path / "gone.amc")),)), np.random.default_rng(1))


@pytest.mark.shared
@pytest.mark.parametrize("name", ["02_04", "02_10", "03_01"])
def test_the_shared_motions_are_played_without_jerks_and_above_the_floor(shared, name):
    file = str(shared / "mocap" / f"{name}.amc")
    _, figure = perform(Spec(motion=(Gesture(motion="mocap", seconds=20, file=file),), rate=60), np.random.default_rng(1))
    turned = np.einsum("tsij,tsik->tsjk", figure.rotation[:-1], figure.rotation[1:])
    angle = np.degrees(np.arccos(np.clip((np.trace(turned, axis1=2, axis2=3) - 1) / 2, -1, 1)))
    assert angle.max() < 40  # between two pictures
    toes = figure.origin[:, [SEGMENTS.index("left_toes"), SEGMENTS.index("right_toes")], 2]
    assert toes.min() > -0.1  # on 03_01 the ground falls
    assert np.percentile(toes.min(1), 5) < 0.06
