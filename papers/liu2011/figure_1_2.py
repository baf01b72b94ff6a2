"""Fig. 1 and 2: the volumetric model and the cardbox model with their skeleton, and the 18 sizes of the cardbox."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, new_figure
from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body, Quads
from shadowpuppet.body.sizes import SUBSETS, CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.captions import WHITE, strip
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array, rigid, rotation_about
from shadowpuppet.video import Image

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT, TILE, PAPER = 1.78, 420, 250
"""Of the person (m); pixels of a model's picture; its ground."""
RED, BLUE, ORANGE = (40, 40, 210), (220, 90, 30), (0, 140, 255)
"""Blue, green, red: skeleton, joints, axes, as in the paper."""
LINES = (("pelvis", "neck"), ("neck", "head"), ("left_shoulder", "neck"), ("neck", "right_shoulder"), ("left_shoulder", "left_elbow"),
         ("left_elbow", "left_fist"), ("right_shoulder", "right_elbow"), ("right_elbow", "right_fist"))  # fmt: skip
JOINTS = ("pelvis", "left_shoulder", "left_elbow", "right_shoulder", "right_elbow")

Line = tuple[str, tuple[float, float], tuple[float, float]]
"""A size's name, and from where to where it goes, metres."""


def make(request: Request) -> Outcome:
    """Both figures; of a person of average proportions."""
    sizes = sizes_from_height(HEIGHT)
    pictures = {"figure_1": np.concatenate([model("boxes", sizes), model("cardbox", sizes)], axis=1), "figure_2": draw_sizes(sizes)}
    rows = [[f"a{n + 1}", name.replace("_", " "), subset_of(name), round(float(value), 4)]
            for n, (name, value) in enumerate(zip(CardboxSizes.names(), sizes.to_array()))]
    said = ["Fig. 1: the volumetric model (left) and the cardbox; red the skeleton, blue its joints, orange the axes of the torso's place.",
            "Fig. 2: the sizes, in the three groups that Algorithm 1 estimates; of a person of average proportions."]
    return Outcome({"height": HEIGHT}, pictures, {"figure_2": Table(("size", "name", "group", "metres"), rows)}, said=said)


def subset_of(name: str) -> str:
    """Which of Algorithm 1's groups a size is in."""
    return next(subset for subset, names in SUBSETS.items() if name in names)


def model(name: str, sizes: CardboxSizes) -> Image:
    """A body from half aside, with its skeleton and the axes."""
    body = make_body(name, sizes)
    camera = Camera.from_fov((TILE, TILE), np.radians(24))
    down, aside = rotation_about((0, 1, 0), 0.22), rotation_about((0, 0, 1), -0.6)
    turned = place(camera, 3.6, -0.28) @ rigid(down @ aside, np.zeros(3))
    picture = Picture(body, camera, turned)
    pose = body.skeleton.pose(left_shoulder_abduction=1.2, left_elbow_roll=1.2, left_elbow_flexion=1.0, right_shoulder_abduction=0.9)
    out = np.full((TILE, TILE, 3), PAPER, np.uint8)
    draw_model(out, picture, pose)
    out[:] = np.uint8(0.55 * out + 0.45 * PAPER)
    draw_skeleton(out, picture, pose)
    draw_axes(out, picture)
    return np.concatenate([strip(TILE, [[(f"{'volumetric' if name == 'boxes' else name}: {len(body.parts)} planes", WHITE)]]), out])


def draw_skeleton(out: Image, picture: Picture, pose: Array) -> None:
    """Red lines and blue circles."""
    import cv2

    points = dict(zip(picture.body.landmark_names, pixels(picture, picture.points(pose[None])[0])))
    for a, b in LINES:
        cv2.line(out, points[a], points[b], RED, 2, cv2.LINE_AA)
    for name in JOINTS:
        cv2.circle(out, points[name], 6, BLUE, 2, cv2.LINE_AA)


def draw_axes(out: Image, picture: Picture, length: float = 0.3) -> None:
    """Orange arrows from where the torso stands: X to the camera, Y to the image's right, Z up."""
    import cv2

    ends = np.vstack([np.zeros(3), length * np.eye(3)]) @ picture.T_camera_base[:3, :3].T + picture.T_camera_base[:3, 3]
    start, *tips = pixels(picture, ends)
    for name, tip in zip("XYZ", tips):
        cv2.arrowedLine(out, start, tip, ORANGE, 2, cv2.LINE_AA, tipLength=0.15)
        cv2.putText(out, name, (tip[0] - 4, tip[1] + (-8 if name == "Z" else 18)), cv2.FONT_HERSHEY_SIMPLEX, 0.6, ORANGE, 2, cv2.LINE_AA)


def pixels(picture: Picture, points: Array) -> list[tuple[int, int]]:
    """Points (K, 3) in the camera's frame as whole pixels."""
    flat = points @ picture.camera.matrix.T
    return [(int(x), int(y)) for x, y in np.rint(flat[:, :2] / flat[:, 2:])]


def draw_sizes(sizes: CardboxSizes) -> object:
    """O1, O2 and O3: the cards from the front, from the side, and an arm, with each size as an arrow."""
    body = make_body("cardbox", sizes)
    level = body.skeleton.pose(left_shoulder_abduction=np.pi / 2, right_shoulder_abduction=np.pi / 2)
    trunk, arm = ("head", "torso", "waist"), ("torso", "left_upper_arm", "left_forearm")
    views = (("O1: front", trunk, 1, front(sizes)), ("O2: side", trunk, 0, side(sizes)), ("O3: an arm, front", arm, 1, arms(sizes)))
    figure, panels = new_figure(1, 3, 11, 4.6, gridspec_kw={"width_ratios": [1.1, 0.8, 1.5]})
    for axes, (title, parts, across, lines) in zip(panels[0], views):
        for corners in cards(body, level, parts):
            axes.fill(corners[:, across], corners[:, 2], facecolor="#f3e9b0", edgecolor="0.45", linewidth=0.7, alpha=0.55)
        for line in lines:
            arrow(axes, line)
        numbered = {name: n + 1 for n, name in enumerate(CardboxSizes.names()) if name in {name for name, _, _ in lines}}
        axes.set_xlabel("\n".join(f"a{n}  {name.replace('_', ' ')}" for name, n in numbered.items()), fontsize=7, loc="left")
        axes.set_title(title, fontsize=9, pad=12)
        ends = np.array([end for line in lines for end in line[1:]])  # an annotation does not widen the axes
        axes.update_datalim(ends)
        axes.autoscale_view()
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
        axes.spines[:].set_visible(False)
    return figure


def cards(body: Body, pose: Array, parts: tuple[str, ...]) -> list[Array]:
    """Corners (4, 3), in the body's frame, of some parts' cards."""
    assert isinstance(body.shapes, Quads)
    T = body.skeleton.forward(pose[None])[0][body.shapes.joints[:, 0]]
    corners = np.einsum("qij,qvj->qvi", T[..., :3], body.shapes.corners) + T[:, None, :, 3]
    return [each for each, part in zip(corners, body.parts) if part in parts]


def front(s: CardboxSizes) -> list[Line]:
    """a1 to a8."""
    top, neck = s.torso_height, s.torso_height + s.neck_gap
    crown = neck + s.head_height
    return [
        across("head_width", s.head_width, crown + 0.03),
        ("head_height", (s.head_width / 2 + 0.05, neck), (s.head_width / 2 + 0.05, crown)),
        ("neck_gap", (-s.head_width / 2 - 0.05, top), (-s.head_width / 2 - 0.05, neck)),
        across("shoulder_width", s.shoulder_width, top - 0.05),
        across("torso_bottom_width", s.torso_bottom_width, 0.05),
        ("torso_height", (-s.shoulder_width / 2 - 0.05, 0.0), (-s.shoulder_width / 2 - 0.05, top)),
        across("waist_width", s.waist_width, -s.waist_height - 0.03),
        ("waist_height", (-s.waist_width / 2 - 0.06, -s.waist_height), (-s.waist_width / 2 - 0.06, 0.0)),
    ]  # fmt: skip


def side(s: CardboxSizes) -> list[Line]:
    """a9 to a12."""
    crown = s.torso_height + s.neck_gap + s.head_height
    return [across("head_depth", s.head_depth, crown + 0.03), across("torso_top_depth", s.torso_top_depth, s.torso_height - 0.05),
            across("torso_bottom_depth", s.torso_bottom_depth, 0.05), across("waist_depth", s.waist_depth, -s.waist_height - 0.03)]


def arms(s: CardboxSizes) -> list[Line]:
    """a13 to a18, of the left arm, level."""
    edge, z = s.shoulder_width / 2, s.torso_height - s.upper_arm_width / 2
    joint = edge - s.shoulder_inset
    elbow, end, low = joint + s.upper_arm_length, joint + s.upper_arm_length + s.forearm_length, z - s.upper_arm_width / 2 - 0.04

    def up(name: str, y: float, width: float) -> Line:
        return name, (y, z - width / 2), (y, z + width / 2)

    return [("upper_arm_length", (joint, low), (elbow, low)), up("upper_arm_width", (joint + elbow) / 2, s.upper_arm_width),
            ("forearm_length", (elbow, low), (end, low)), up("elbow_width", elbow + 0.015, s.elbow_width),
            up("hand_width", end + 0.02, s.hand_width), ("shoulder_inset", (joint, z + 0.11), (edge, z + 0.11))]  # fmt: skip


def across(name: str, width: float, z: float) -> Line:
    """A width, from side to side."""
    return name, (-width / 2, z), (width / 2, z)


def arrow(axes: Axes, line: Line) -> None:
    """A size: an arrow with two heads and its number."""
    name, start, end = line
    axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "color": COLOURS[0], "linewidth": 1, "shrinkA": 0, "shrinkB": 0})
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    level = abs(start[1] - end[1]) < abs(start[0] - end[0])
    axes.annotate(f"a{CardboxSizes.names().index(name) + 1}", middle, xytext=(0, 3) if level else (4, 0), textcoords="offset points",
                  ha="center" if level else "left", va="bottom" if level else "center", fontsize=8, color=COLOURS[1])


EXPERIMENT = Experiment("figure_1_2", "Fig. 1, 2: both models, and the 18 sizes", "a second", make)
