"""The viewer's page as text: its template, and a scene as numbers that the page draws. It fetches nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.camera.drawing import MIDDLE_COLOUR, SIDE_COLOURS
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.motion.limbs import LIMBS, limb_of
from shadowpuppet.motion.motion import STATUSES
from shadowpuppet.viewer.scene.scene import Chart, SceneCamera, SceneFigure, Stage
from shadowpuppet.viewer.scene.strip import Strip, doubtful_moments, strips_of
from shadowpuppet.viewer.web.frustum_images import Undistorter

SCRIPTS = ("stage.js", "charts.js", "page.js")
BY_CAMERA = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
"""Colours of cameras (Okabe and Ito 2008) and of the hull points on their contours."""
NOTHING = "'none'"
Images = Mapping[str, Sequence[Sequence[str]]]


def page_text(scene: Stage, cameras: Sequence[Undistorter], images: Images | None,
              frames: NDArray[np.int64] | None = None) -> str:
    """The page of a scene.

    Args:
        scene: what is shown.
        cameras: for each camera, what its images are undistorted by.
        images: `pictures` and `silhouettes`, or these alone: data URLs of each camera's images by frame, empty where there is none; None if
            the page asks its server for them.
        frames: indices of the frames that the page has; None: all.
    """
    every = np.arange(len(scene.times)) if frames is None else frames
    data = json.dumps(content(scene, cameras, images, every), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    script, style = script_text(SCRIPTS), _file("page.css")
    server = "'self'" if images is None else ""
    policy = (f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data: {server}; "
              f"connect-src {server or NOTHING}; base-uri 'none'; form-action 'none'")  # fmt: skip
    parts = {"POLICY": policy, "TITLE": html.escape(scene.title), "STYLE": style, "DATA": data, "SCRIPT": script}
    return re.sub(r"@([A-Z]+)@", lambda found: parts[found[1]], _file("page.html"))  # in one pass: names in the parts may look like places


def script_text(names: Sequence[str]) -> str:
    """Scripts of the page, one after the other, as one."""
    return "\n".join(map(_file, names))


def _file(name: str) -> str:
    return files("shadowpuppet.viewer.web").joinpath(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def content(scene: Stage, cameras: Sequence[Undistorter], images: Images | None,
            frames: NDArray[np.int64]) -> dict[str, Any]:
    """A scene for the page's scripts, as JSON; arguments as of `page_text`."""
    times = scene.times[frames]
    low, high = scene.box
    return {
        "title": scene.title, "times": packed(times, "f8"), "frames": packed(frames, "u4"), "statuses": STATUSES,
        "box": [low.tolist(), high.tolist()], "floor": scene.floor, "direction": (scene.viewpoint - scene.middle).tolist(),
        "figures": [_figure(figure, times) for figure in scene.figures],
        "cameras": [_camera(each, lens, n, times) for n, (each, lens) in enumerate(zip(scene.cameras, cameras))],
        "images": images, "served": images is None, "sides": [colour[::-1] for colour in (MIDDLE_COLOUR, *SIDE_COLOURS.values())],
        "hull": images is None and scene.hull is not None, "particles": images is None and scene.cloud is not None,
        "charts": [_chart(chart, times) for chart in scene.charts],
        "strips": [_strip(strip, frames) for strip in strips_of(scene)],
        "moments": np.searchsorted(frames, doubtful_moments(scene)).clip(max=len(frames) - 1).tolist(),
        "labels": [{"text": text, "at": place} for text, place in scene.labels],
        "facts": dict(scene.facts), "notes": scene.notes, "problems": scene.problems, "interval": HALF_WIDTH,
    }  # fmt: skip


def _figure(figure: SceneFigure, times: Array) -> dict[str, Any]:
    """A figure at the page's frames: its mesh, and where its joints are in each of its own frames that is shown."""
    mesh = figure.mesh
    found = motion_content(figure, times) | {
        "name": figure.name, "kind": figure.kind, "shift": figure.shift, "joints": figure.places.shape[1],
        "jointNames": [name.replace("_", " ") for name in figure.joint_names], "bones": figure.bones,
        "jointLimbs": [LIMBS.index(limb_of(name)) for name in figure.joint_names],
        "jointSides": [_side(name) for name in figure.joint_names],
        "limbs": 0 if figure.doubtful is None else figure.doubtful.frames.shape[1],
    }  # fmt: skip
    if figure.kind == "truth" and figure.joints is not None and figure.bones:
        return found  # lines
    limbs = np.zeros(len(mesh.joints)) if figure.doubtful is None else figure.doubtful.limbs[mesh.joints]
    return found | {"mesh": {
        "points": packed(mesh.points - figure.rest[mesh.joints], "f4"), "normals": packed(mesh.normals, "f4"),
        "triangles": packed(mesh.triangles, "u4"), "colours": packed(mesh_colours(figure), "u1"),
        "joints": packed(mesh.joints, "f4"), "limbs": packed(limbs, "f4")}}  # fmt: skip


def motion_content(figure: SceneFigure, times: Array) -> dict[str, Any]:
    """What `Stage.move` takes: the figure's own frame at each of the times (s), -1 for none, and the joints in these frames, for JSON."""
    shown = np.array([-1 if (n := figure.at(float(time))) is None else n for time in times])
    used, index = np.unique(shown[shown >= 0], return_inverse=True)
    at = np.full(len(times), -1)
    at[shown >= 0] = index.ravel()
    return {
        "frames": packed(at, "i4"), "count": len(used), "turns": packed(32767 * np.roll(figure.quaternions[used], -1, axis=2), "i2"),
        "places": packed(figure.places[used], "f4"), "named": None if figure.joints is None else packed(figure.joints[used], "f4"),
        "sd": None if figure.joint_sd is None or not np.isfinite(figure.joint_sd).any() else packed(figure.joint_sd[used], "f4"),
        "doubtful": None if figure.doubtful is None else packed(figure.doubtful.frames[used], "u1"),
    }  # fmt: skip


def _camera(each: SceneCamera, lens: Undistorter, n: int, times: Array) -> dict[str, Any]:
    T = inverse(each.camera.T_camera_world)
    return {"name": each.camera.name, "pose": T.tolist(), "tan": [lens.aspect * np.tan(lens.fov / 2), np.tan(lens.fov / 2)],
            "colour": BY_CAMERA[n % len(BY_CAMERA)], "images": each.images is not None, "width": lens.size[0], "height": lens.size[1],
            **_keypoints(each, lens, times)}


def _keypoints(each: SceneCamera, lens: Undistorter, times: Array) -> dict[str, Any]:
    """A detector's keypoints at times (s): for each place the index of its colour in `sides`; and, of shape (T, places, 3), x and y in the
    undistorted image, from -1 to 1, and the confidence, 0 for none, all times 10,000. Nothing without keypoints."""
    found = [] if each.keypoints is None else [each.keypoints(float(time)) for time in times]
    if not found:
        return {}
    sides = [_side(name) for name in found[0].names]
    people, half = max(len(one.xy) for one in found), np.array([lens.aspect, 1.0]) * np.tan(lens.fov / 2)
    out = np.zeros((len(found), people * len(sides), 3))
    for one, place in zip(found, out):
        known = np.column_stack([each.camera.rays(one.xy)[..., :2].reshape(-1, 2) / half, one.confidence.ravel()])
        place[: len(known)] = np.where((np.abs(known) <= 1).all(1, keepdims=True), known, 0)
    return {"sides": sides * people, "keypoints": packed(10_000 * out, "i2")}


def _side(name: str) -> int:
    """Index of a landmark's colour in `sides`."""
    side = name.partition("_")[0]
    return list(SIDE_COLOURS).index(side) + 1 if side in SIDE_COLOURS else 0


def _chart(chart: Chart, times: Array) -> dict[str, Any]:
    kept = (chart.times >= times[0] - 1e-6) & (chart.times <= times[-1] + 1e-6)
    return {"name": chart.name, "unit": chart.unit, "times": packed(chart.times[kept], "f8"), "curves": _packed(chart.curves, kept),
            "sd": _packed(chart.sd, kept)}


def _packed(curves: Mapping[str, Array], kept: NDArray[np.bool_]) -> dict[str, Any]:
    return {name: packed(values[kept], "f4") for name, values in curves.items()}


def _strip(strip: Strip, frames: NDArray[np.int64]) -> dict[str, Any]:
    rows = {"widest 90 % interval": ("interval", strip.width, "mm"), "overlap": ("overlap", strip.overlap, "of 1"),
            "error": ("error", strip.error, "mm")}  # fmt: skip
    return {"name": strip.name, "limbs": strip.limbs, "status": packed(strip.status[frames], "i1"),
            "rows": [{"name": name, "short": short, "unit": unit, "values": packed(values[frames], "f4")}
                     for name, (short, values, unit) in rows.items() if np.isfinite(values).any()]}  # fmt: skip


def packed(values: ArrayLike, kind: str) -> dict[str, str]:
    """An array as its type and its bytes in base 64, little-endian, for `unpack` in stage.js."""
    array = np.asarray(values)
    if kind[0] in "iu" and array.dtype.kind == "f":
        array = np.nan_to_num(array).round()
    return {"type": kind, "data": base64.b64encode(np.ascontiguousarray(array, f"<{kind}").tobytes()).decode()}


MIXED = {"estimate": ((0, 0, 0), 0.0), "truth": ((0, 0, 0), 0.0), "other": ((112, 64, 170), 0.35), "mean": ((150, 156, 164), 0.35)}
"""Colour mixed into the colour of a kind of figure, and its share."""
TINT = 0.5
"""Share of a person's own tint."""


def mesh_colours(figure: SceneFigure) -> Array:
    """Colours of the points of a figure's mesh, sRGB, 0..255, of shape (V, 3)."""
    linear = np.clip(figure.mesh.colours, 0, 1)
    own = 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    mixed, share = MIXED[figure.kind] if figure.tint is None else (figure.tint, TINT)
    return np.asarray(((1 - share) * own + share * np.array(mixed)).round())
