"""A model of our own skeleton for OpenSim: the person's bones, joints, limits, shape and masses, with markers at the joints.

Its coordinates are those of `MODELS["own"]`, so that a MOT file of these moves it exactly as the run, and inverse kinematics of the run's
TRC file finds the same angles.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import euler_angles
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.opensim.body_masses import Mass, average_weight, body_masses
from shadowpuppet.io.motion.opensim.coordinates import MODELS, PELVIS_POSITION, SIDES, TO_MODEL, Ball, Hinge, ModelJoint
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.body_animation import TO_REST
from shadowpuppet.motion.motion import JointTable

MARKERS = {
    "pelvis": "Hip", "neck": "Neck", "head": "HeadBase", "crown": "Head", "nose": "Nose",
    **{f"{side}_{joint}": f"{side[0].upper()}{name}" for side in ("left", "right") for joint, name in (
        ("shoulder", "Shoulder"), ("elbow", "Elbow"), ("wrist", "Wrist"), ("hand", "Middle1"), ("hip", "Hip"), ("knee", "Knee"),
        ("ankle", "Ankle"), ("heel", "Heel"), ("toe", "BigToe"))},
}  # fmt: skip
"""Marker names of our joints: those of HALPE_26, Pose2Sim's default. `Head` is the crown there, so the base of the skull has another name;
hands have the name of Pose2Sim's COCO_133_WRIST."""


def marker_names(table: JointTable) -> JointTable:
    """The table with names of `MARKERS`, rotated so that Y is up, (x, z, -y); joints without such a name keep theirs."""
    return replace(table, names=tuple(MARKERS.get(name, name) for name in table.names), positions=table.positions @ Y_UP.T)


VERSION = "40000"
"""Of OpenSim's file format: read by OpenSim 4.0 and later."""
BODIES = {
    "pelvis": ("pelvis", "ground_pelvis"), "chest": ("torso", "back"), "neck": ("head", "neck"),
    **{f"{side}_{joint}": (f"{name}_{side[0]}", f"{own}_{side[0]}") for side in SIDES for joint, name, own in (
        ("hip", "femur", "hip"), ("knee", "tibia", "knee"), ("ankle", "calcn", "ankle"), ("shoulder", "humerus", "acromial"),
        ("elbow", "ulna", "elbow"))},
}  # fmt: skip
"""Names of body and joint, as in other models, by the joint that moves the body."""
COLOURS = {"left": "0.9 0.55 0.2", "right": "0.25 0.5 0.85", "": "0.75 0.75 0.75"}
AXES = np.eye(3)
"""Forward, up, right."""
FREE = (-1e3, 1e3)
"""Range of the pelvis' position, metres."""


def write_osim(path: str | Path, body: Body, animation: Animation, weight: float | None = None) -> None:
    """Write a whole body as an .osim model. `animation`: the body as a skeleton; `weight`: kilograms (default: of average build), divided
    among its segments.

    Raises `ShadowPuppetError` for a body whose bones are not constant, or if the file cannot be written.
    """
    path = Path(path)
    if animation.names[0] != "pelvis" or "right_hip" not in animation.names or body.limbs is None:
        raise ShadowPuppetError(f"{path}: found an upper body ({body.name}), expected a whole body, as an OpenSim model needs: --body "
                                "anatomical")
    parts: dict[str, list[ModelJoint]] = {}
    for part in MODELS["own"].parts:
        if part.joint in animation.names and _moves(body, part.joint):
            parts.setdefault(part.joint, []).append(part)
    owners = _owners(animation, set(parts))
    masses = body_masses(animation, owners, average_weight(animation) if weight is None else weight)
    root = Element("OpenSimDocument", Version=VERSION)
    model = SubElement(root, "Model", name=path.stem)
    _text(model, "credits", "shadowpuppet; masses by de Leva (1996)")
    _text(model, "length_units", "meters")
    _text(model, "force_units", "N")
    _text(model, "gravity", "0 -9.80665 0")
    SubElement(model, "Ground", name="ground")
    bodies, joints, markers = (_set(model, name) for name in ("BodySet", "JointSet", "MarkerSet"))
    for joint in parts:
        _body(bodies, joint, masses[joint], body)
        _joint(joints, joint, parts[joint], owners, animation, body)
    for n, name in enumerate(animation.names):
        _marker(markers, MARKERS.get(name, name), owners[name], animation.rest[n] - animation.rest[animation.names.index(owners[name])])
    indent(root, "\t")
    write_whole(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, "unicode")}\n')


def _moves(body: Body, joint: str) -> bool:
    """Whether a joint of `MODELS` has degrees of freedom in a body."""
    return any(dof.joint == {"neck": "head"}.get(joint, joint) for dof in body.skeleton.dofs)


def _owners(animation: Animation, moving: set[str]) -> dict[str, str]:
    """For each point of the skeleton, the joint whose body it belongs to."""
    owners: dict[str, str] = {}
    for n, name in enumerate(animation.names):
        owners[name] = name if name in moving else owners[animation.names[animation.parents[n]]]
    return owners


def _body(bodies: Element, joint: str, mass: Mass, body: Body) -> None:
    own = SubElement(bodies, "Body", name=BODIES[joint][0])
    assert body.limbs is not None
    index = body.skeleton.joint_index({"neck": "head"}.get(joint, joint))
    components = SubElement(own, "components")
    for n in np.flatnonzero(body.limbs.joints == index):
        _shape(components, body, int(n))
    inertia = TO_MODEL @ mass.inertia @ TO_MODEL.T
    _text(own, "mass", _numbers(mass.mass))
    _text(own, "mass_center", _numbers(TO_MODEL @ mass.centre))
    _text(own, "inertia", _numbers([*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]))


def _shape(components: Element, body: Body, n: int) -> None:
    """A limb as an ellipsoid around it."""
    limbs = body.limbs
    assert limbs is not None
    to_model = TO_MODEL @ TO_REST
    name, along = limbs.parts[n], limbs.ends[n] - limbs.starts[n]
    frame = SubElement(components, "PhysicalOffsetFrame", name=f"{name}_shape")
    geometry = SubElement(SubElement(frame, "attached_geometry"), "Ellipsoid", name=f"{name}_ellipsoid")
    radii = limbs.radii[n].mean(0)
    _text(geometry, "radii", _numbers([*radii, np.linalg.norm(along) / 2 + limbs.caps[n].mean()]))
    _text(SubElement(geometry, "Appearance"), "color", COLOURS[name.split("_")[0] if name.split("_")[0] in COLOURS else ""])
    _text(frame, "socket_parent", "..")
    _text(frame, "translation", _numbers(to_model @ (limbs.starts[n] + limbs.ends[n]) / 2))
    _text(frame, "orientation", _numbers(euler_angles((to_model @ limbs.rotations[n])[None], (0, 1, 2))[0]))


def _joint(joints: Element, joint: str, parts: list[ModelJoint], owners: dict[str, str], animation: Animation, body: Body) -> None:
    """The joint that moves a body: a ball, a hinge, or an ankle's two."""
    n = animation.names.index(joint)
    above = None if n == 0 else owners[animation.names[animation.parents[n]]]
    name, parent = BODIES[joint][1], "ground" if above is None else BODIES[above][0]
    own = SubElement(joints, "CustomJoint", name=name)
    _text(own, "socket_parent_frame", f"{parent}_offset")
    _text(own, "socket_child_frame", f"{BODIES[joint][0]}_offset")
    axes = [(coordinate, axis) for part in parts for coordinate, axis in _axes(part)]
    ranges = {coordinate: low_high for part in parts for coordinate, low_high in _ranges(part, body)}
    coordinates = SubElement(own, "coordinates")
    shifts = [(coordinate, axis) for coordinate, axis in zip(PELVIS_POSITION, AXES)] if above is None else []
    leg = -float(animation.rest[:, 1].min())
    for coordinate, _ in [*axes, *shifts]:
        each = SubElement(coordinates, "Coordinate", name=coordinate)
        _text(each, "default_value", _numbers(leg if coordinate == "pelvis_ty" else 0.0))
        _text(each, "range", _numbers(ranges.get(coordinate, FREE)))
    at = np.zeros(3) if above is None else animation.rest[n] - animation.rest[animation.names.index(above)]
    frames = SubElement(own, "frames")
    for frame, owner, place in ((parent, parent, TO_MODEL @ at), (BODIES[joint][0], BODIES[joint][0], np.zeros(3))):
        offset = SubElement(frames, "PhysicalOffsetFrame", name=f"{frame}_offset")
        _text(offset, "socket_parent", "/ground" if owner == "ground" else f"/bodyset/{owner}")
        _text(offset, "translation", _numbers(place))
        _text(offset, "orientation", "0 0 0")
    transform = SubElement(own, "SpatialTransform")
    spare = [axis for axis in AXES if not any(abs(axis @ other) > 0.5 for _, other in axes)]
    turns = [*axes, *(("", axis) for axis in spare)][:3]
    moves = shifts or [("", axis) for axis in AXES]
    for kind, three in (("rotation", turns), ("translation", moves)):
        for k, (coordinate, axis) in enumerate(three, 1):
            _transform_axis(transform, f"{kind}{k}", coordinate, axis)


def _transform_axis(transform: Element, name: str, coordinate: str, axis: np.ndarray) -> None:
    each = SubElement(transform, "TransformAxis", name=name)
    _text(each, "coordinates", coordinate)
    _text(each, "axis", _numbers(axis))
    if coordinate:
        _text(SubElement(each, "LinearFunction", name="function"), "coefficients", "1 0")
    else:
        _text(SubElement(each, "Constant", name="function"), "value", "0")


def _axes(part: ModelJoint) -> list[tuple[str, np.ndarray]]:
    """Coordinates of a part, each with the axis (3,), forward, up, right, about which it rotates."""
    forward, up, right = AXES
    if isinstance(part, Ball):
        return list(zip(part.names, (sign * axis for sign, axis in zip(part.signs, (right, forward, up)))))
    return [(part.name, part.sign * (forward if part.axis == "forward" else -right))]


def _ranges(part: ModelJoint, body: Body) -> list[tuple[str, tuple[float, float]]]:
    """Coordinates of a part, each with its range, rad: a hinge's by our skeleton's limits."""
    if isinstance(part, Ball):
        return [(name, (float(np.radians(low)), float(np.radians(high)))) for name, (low, high) in zip(part.names, part.limits)]
    return [(part.name, _hinge_range(part, body))]


def _hinge_range(part: Hinge, body: Body) -> tuple[float, float]:
    letter = "x" if part.axis == "forward" else "y"
    dof = next(dof for dof in body.skeleton.dofs if dof.joint == part.joint and dof.axis.endswith(letter))
    sign = part.sign * (-1 if dof.axis.startswith("-") else 1)
    low, high = sorted((sign * dof.low, sign * dof.high))
    return low, high


def _marker(markers: Element, name: str, owner: str, place: np.ndarray) -> None:
    each = SubElement(markers, "Marker", name=name)
    _text(each, "socket_parent_frame", f"/bodyset/{BODIES[owner][0]}")
    _text(each, "location", _numbers(TO_MODEL @ place))
    _text(each, "fixed", "true")


def _set(model: Element, kind: str) -> Element:
    return SubElement(SubElement(model, kind, name=kind.lower()), "objects")


def _text(parent: Element, tag: str, text: str) -> None:
    SubElement(parent, tag).text = text


def _numbers(values: ArrayLike) -> str:
    return " ".join(f"{float(value) + 0.0:.9g}" for value in np.atleast_1d(np.asarray(values, float)))
