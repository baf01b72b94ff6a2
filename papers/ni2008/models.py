"""Figs. 1 to 3, the paper's pictures of its model, drawn from the model that is tracked: parts and their frames, a force, the tree."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.speed import naive_multi as plain
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, new_figure
from papers.ni2008.inputs import BODY
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body, Limbs
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic import Viewpoint
from shadowpuppet.tracking.multiview.settings import make_multiview_settings

HEIGHT, LIFT = 1.75, 0.95
"""Of the person who is drawn, and of their pelvis, metres."""
PARTS = ("torso", "right_upper_arm", "right_lower_arm", "left_upper_arm", "left_lower_arm", "right_upper_leg", "right_lower_leg",
         "left_upper_leg", "left_lower_leg", "head")  # fmt: skip
"""In the paper's numbering as far as its text tells it (1 and 2 are the right arm, eq. 40); the order of the others is ours."""
SIZE, GROUND, AXIS = (620, 780), 245, 0.13
"""Of Fig. 1, pixels; its ground; how long the axes are, metres."""
AXES = ((60, 60, 210), (60, 150, 40), (200, 90, 40))
"""Colours (blue, green, red) of X, Y, Z."""
POINT, BENT = (0.16, 0.13), 0.9
"""Fig. 2's scene point: how far down the lower arm, and how far off its axis (m); the elbow's angle (rad)."""


def person() -> Body:
    """An average person, of ten cylinders."""
    return make_body(BODY, average_sizes(BODY, HEIGHT))


def limbs_of(body: Body) -> Limbs:
    """The cylinders."""
    assert body.limbs is not None
    return body.limbs


def figure_1(request: Request) -> Outcome:
    """The model with its numbers and frames, and all its parts and degrees of freedom as a table."""
    body = person()
    angles = {f"{side}_{name}": value for side in ("left", "right") for name, value in
              {"shoulder_abduction": 0.45, "elbow_flexion": 0.35, "hip_abduction": 0.12}.items()}  # fmt: skip
    pose = body.skeleton.pose(root_z=LIFT, root_heading=-np.pi / 2, **angles)
    view = Viewpoint(name="front", size=SIZE, fov_deg=20, height=1.15, distance=4.6, azimuth_deg=20, pitch_deg=3).camera()
    image = np.full((SIZE[1], SIZE[0], 3), GROUND, np.uint8)
    draw_model(image, Picture(body, view, view.T_camera_world), pose)
    image[:] = np.uint8(0.55 * image + 0.45 * GROUND)
    T, limbs = body.skeleton.forward(pose[None])[0], limbs_of(body)
    for joint in body.skeleton.joint_names:
        _frame(image, view, T[body.skeleton.joint_index(joint)])
    for number, part in enumerate(PARTS):
        s = limbs.parts.index(part)
        middle = T[limbs.joints[s]] @ np.append(0.5 * limbs.starts[s] + 0.5 * limbs.ends[s], 1)
        _number(image, view.project(middle[None])[0], str(number))
    return Outcome({"body": BODY, "height": HEIGHT}, {"figure_1": image}, {"figure_1": parts_table(body)},
                   said=[f"{len(PARTS)} parts, {len(body.skeleton.dofs)} degrees of freedom. X forward, Y to the left, Z up in each part's "
                         "frame at rest (red, green, blue); the paper's root is the torso's centre, ours the pelvis."])  # fmt: skip


def parts_table(body: Body) -> Table:
    """A row for each part: its place in the tree, degrees of freedom with limits, sizes."""
    rows, limbs = [], limbs_of(body)
    for number, part in enumerate(PARTS):
        s = limbs.parts.index(part)
        joint = body.skeleton.joints[limbs.joints[s]]
        dofs = [dof for dof in body.skeleton.dofs if dof.joint == joint.name]
        angles = [f"{np.degrees(dof.low):.0f}..{np.degrees(dof.high):.0f}" if np.isfinite(dof.low) else "free" for dof in dofs]
        radii = limbs.radii[s, 0]
        rows.append((number, part, joint.name, parent_of(body, part), " ".join(dof.name for dof in dofs), " ".join(angles),
                     float(limbs.lengths[s]), float(radii[0]), float(radii[1])))
    columns = ("number", "part", "turns_about", "hangs_on", "degrees_of_freedom", "limits_deg", "length_m", "radius_x_m", "radius_y_m")
    return Table(columns, rows)


def parent_of(body: Body, part: str) -> str | None:
    """The part that a part hangs on; None for the root."""
    limbs = limbs_of(body)
    parent = body.skeleton.joints[limbs.joints[limbs.parts.index(part)]].parent
    return None if parent is None else limbs.parts[list(limbs.joints).index(body.skeleton.joint_index(parent))]


def figure_2(request: Request) -> Outcome:
    """A lower arm, a scene point, and what it does (eqs. 32-35)."""
    body, settings = person(), make_multiview_settings("ni2008")
    limbs, s = limbs_of(body), limbs_of(body).parts.index("right_lower_arm")
    T, _ = plain.place(body.skeleton, body.skeleton.pose(right_elbow_flexion=BENT))
    elbow = T[limbs.joints[s]]
    along, across = elbow[:3, :3] @ limbs.rotations[s][:, 2], elbow[:3, :3] @ limbs.rotations[s][:, 0]
    point = elbow[:3, 3] + POINT[0] * along + POINT[1] * across
    near = plain.closest(limbs, s, elbow, point[None])
    foot, normal = near.feet[0], near.normals[0]
    away = point - foot
    cosine = float(normal @ away / np.linalg.norm(away))
    force = away / np.linalg.norm(away) * rho(cosine * float(np.linalg.norm(away)), settings.forces.fine_tau)
    moment = np.cross(foot - elbow[:3, 3], force)
    plane = np.stack([along, across])
    figure = _force_picture(limbs, s, plane @ (point - elbow[:3, 3]), plane @ (foot - elbow[:3, 3]), plane @ force)
    rows = [(name, *map(float, value)) for name, value in (("P", point), ("P'", foot), ("c", elbow[:3, 3]), ("F", force), ("M", moment))]
    told = {"point_m": list(POINT), "tau_m": settings.forces.fine_tau}
    return Outcome(told, {"figure_2": figure}, {"figure_2": Table(("what", "x", "y", "z"), rows, True)},
                   said=[told_of(away, settings.forces.fine_tau, moment)])  # fmt: skip


def rho(distance: float, tau: float) -> float:
    """The robust function of eq. 32, a truncated quadratic, divided by tau, metres."""
    return min(distance**2, tau**2) / tau


def told_of(away: Array, tau: float, moment: Array) -> str:
    """The force in a sentence."""
    return (f"P is {1000 * np.linalg.norm(away):.0f} mm from P', the closest point on the model; the force is bounded at "
            f"{1000 * tau:.0f} mm (rho), its moment about the elbow {np.linalg.norm(moment):.4f} m².")


def _force_picture(limbs: Limbs, s: int, P: Array, foot: Array, F: Array):
    """The plane of the arm's axis and the point, in centimetres."""
    figure, panels = new_figure(1, 1, width=6, height=3.4)
    axes, cm = panels[0, 0], 100.0
    length, radius = cm * float(limbs.lengths[s]), cm * float(limbs.radii[s, 0, 0])
    axes.fill([0, length, length, 0], [-radius, -radius, radius, radius], color="0.88", edgecolor="0.45")
    axes.plot([0, length], [0, 0], color="0.6", linewidth=0.8, linestyle="-.")
    end = foot + F
    corner = np.array([foot[0], 0.0])  # the force's line nearest to the centre of rotation
    axes.annotate("", cm * end, cm * foot, arrowprops={"arrowstyle": "-|>", "color": COLOURS[1], "linewidth": 2})
    axes.plot(*cm * np.array([foot, P]).T, color="0.3", linestyle=":", linewidth=1)
    axes.plot(*cm * np.array([corner, corner * 0]).T, color=COLOURS[0], linewidth=1.5)
    axes.plot(0, 0, "o", color="black", markersize=6)
    axes.plot(*cm * P, "o", color="black", markersize=6)
    axes.plot(*cm * foot, "o", color="0.4", markersize=5)
    turn = np.linspace(-0.5, 0.75, 30)
    axes.plot(4.2 * np.cos(turn) - 0.2, 4.2 * np.sin(turn), color=COLOURS[2], linewidth=1.8)
    axes.annotate("", (4.2 * np.cos(0.9) - 0.2, 4.2 * np.sin(0.9)), (4.2 * np.cos(0.72) - 0.2, 4.2 * np.sin(0.72)),
                  arrowprops={"arrowstyle": "-|>", "color": COLOURS[2], "linewidth": 1.8})
    axes.annotate("", (length + 2, 5.0), (length + 2, 0.0), arrowprops={"arrowstyle": "-|>", "color": COLOURS[3], "linewidth": 1.8})
    for text, place, colour in (
        ("P  scene point", cm * P + [0.8, 0.2], "black"), ("P'  nearest place on the model", cm * foot + [0.9, -1.6], "0.3"),
        ("F  (eq. 32)", cm * (foot + 0.5 * F) + [0.8, 0.0], COLOURS[1]), ("L", cm * corner / 2 + [0, -1.9], COLOURS[0]),
        ("rotation centre", (-1.0, -radius - 2.0), "black"), ("ω = λM", (3.6, 4.4), COLOURS[2]),
        ("v = ρF", (length + 2.6, 2.0), COLOURS[3]),
    ):  # fmt: skip
        axes.text(*place, text, color=colour, fontsize=9)
    axes.set_aspect("equal")
    axes.set_xlim(-4, length + 9)
    axes.set_ylim(-radius - 4, cm * float(P[1]) + 3)
    axes.axis("off")
    return figure


def figure_3(request: Request) -> Outcome:
    """The tree: whose moments a part feels (eqs. 38-40)."""
    body = person()
    places, edges = _layout(body)
    figure, panels = new_figure(1, 1, width=8, height=3.2)
    axes = panels[0, 0]
    for part, parent in edges:
        axes.plot(*np.array([places[parent], places[part]]).T, color="0.5", linewidth=1.2, zorder=1)
    for number, part in enumerate(PARTS):
        dofs = sum(dof.joint == _joint(body, part) for dof in body.skeleton.dofs)
        text = f"{number}  {part.replace('_', ' ')}\n{dofs} DOF, feels {_listed(below(body, part))}"
        axes.text(*places[part], text, ha="center", va="center", fontsize=7.5, zorder=2,
                  bbox={"boxstyle": "round", "facecolor": "#e8f1f8", "edgecolor": COLOURS[0]})
    axes.set_xlim(-0.7, 4.7)
    axes.set_ylim(-0.45, 2.4)
    axes.axis("off")
    rows = [(n, part, parent_of(body, part), _listed(below(body, part))) for n, part in enumerate(PARTS)]
    return Outcome({}, {"figure_3": figure}, {"figure_3": Table(("number", "part", "hangs_on", "feels_forces_on"), rows)})


def below(body: Body, part: str) -> list[int]:
    """Numbers of the parts whose forces turn a part: itself, and all that hang on it."""
    own = [number for number, other in enumerate(PARTS) if other == part]
    return sorted(own + [n for other in PARTS if parent_of(body, other) == part for n in below(body, other)])


def _layout(body: Body) -> tuple[dict[str, Array], list[tuple[str, str]]]:
    """Where each part stands in the picture, and which hangs on which."""
    edges = [(part, parent) for part in PARTS if (parent := parent_of(body, part)) is not None]
    first = [part for part, parent in edges if parent == "torso"]
    order = sorted(first, key=lambda part: ("right_upper_arm", "right_upper_leg", "head", "left_upper_leg", "left_upper_arm").index(part))
    places = {"torso": np.array([2.0, 2.0])} | {part: np.array([float(n), 1.0]) for n, part in enumerate(order)}
    return places | {part: places[parent] - [0, 1] for part, parent in edges if parent != "torso"}, edges


def _joint(body: Body, part: str) -> str:
    limbs = limbs_of(body)
    return body.skeleton.joints[limbs.joints[limbs.parts.index(part)]].name


def _listed(numbers: list[int]) -> str:
    return "all" if len(numbers) == len(PARTS) else " + ".join(map(str, numbers))


def _frame(image: np.ndarray, view, T: Array) -> None:
    """A joint's axes."""
    ends = view.project(np.concatenate([T[:3, 3][None], T[:3, 3] + AXIS * T[:3, :3].T]))
    origin, *tips = np.rint(ends).astype(int).tolist()
    for colour, tip in zip(AXES, tips):
        cv2.arrowedLine(image, origin, tip, colour, 2, cv2.LINE_AA, tipLength=0.25)


def _number(image: np.ndarray, pixel: Array, text: str) -> None:
    """A part's number in a disc."""
    x, y = np.rint(pixel).astype(int).tolist()
    cv2.circle(image, (x, y), 13, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(image, (x, y), 13, (60, 60, 60), 1, cv2.LINE_AA)
    cv2.putText(image, text, (x - 6, y + 7), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (20, 20, 20), 2, cv2.LINE_AA)
