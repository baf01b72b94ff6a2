"""Drawing of a fit as in Liu 2011 (Fig. 10-12): best estimate, matching result and raw picture, one below the other."""

from __future__ import annotations

from collections.abc import Container
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.camera.captions import WHITE, Colour, Words
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, inverse, transform

if TYPE_CHECKING:  # slow to import
    from shadowpuppet.camera.keypoints import Keypoints
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.video import Image

# Colours that colour-blind people can tell apart: Okabe & Ito 2008.
BLACK, GREY = (0, 0, 0), (96, 96, 96)
MODEL_ONLY, SILHOUETTE_ONLY = (0, 159, 230), (233, 180, 86)
SIDE_COLOURS = {"left": (115, 158, 0), "right": (167, 121, 204)}
MIDDLE_COLOUR = (66, 228, 240)
"""The colour of parts that are neither left nor right."""
LEGEND: Words = (("left", SIDE_COLOURS["left"]), ("right", SIDE_COLOURS["right"]), ("dashed: doubtful", WHITE))
"""The model's colours in words."""
CROSS: Words = (("cross: keypoint", WHITE),)
"""Keypoints in words."""
SHOWN = 0.5
"""Opacity of the model where the picture behind it is to be seen."""
DASH = 4.5
"""Length of the dashes and gaps of a doubtful limb's lines, over the lines' width."""
MATCHING = np.array([BLACK, MODEL_ONLY, SILHOUETTE_ONLY, WHITE, (40, 40, 40), (40, 40, 40), GREY, GREY], np.uint8)
"""Colours of the matching row, indexed by model + 2 silhouette + 4 ignored."""
MATCHED: Words = (("model only", MODEL_ONLY), ("silhouette only", SILHOUETTE_ONLY), ("both: white", WHITE),
                  ("left out: grey", (150, 150, 150)))
"""The same in words."""
SUBPIXEL = 4
"""Fractional bits of pixel coordinates in OpenCV's drawing."""


def overlay_frame(image: Image, mask: ArrayLike, picture: Picture, pose: ArrayLike, *, ignore: ArrayLike | None = None,
                  doubtful: Container[str] = (), last: ArrayLike | None = None, keypoints: Keypoints | None = None) -> Image:
    """The three rows (3 H, W, 3), blue green red, of a frame.

    Top: the model and its bones over the darkened picture. Middle: where model and silhouette `mask` (H, W) agree (white) or differ, and
    ignored pixels, `ignore` (H, W), in greys. Bottom: the picture with the bones. Shapes and bones whose names are `doubtful` are dashed.
    Where the `pose` (D,) is not finite, the bones of the bottom are those of the `last` finite pose, all dashed. A detector's `keypoints`
    are crosses. Raises `ShadowPuppetError` for a picture that is not of the camera's size.
    """
    image, pose, mask = in_colour(image), np.asarray(pose, float), np.asarray(mask, bool)
    size = picture.camera.size
    for what, array in (("image", image), ("mask", mask), ("ignore", mask if ignore is None else np.asarray(ignore))):
        if array.shape[:2] != size[::-1]:
            raise ShadowPuppetError(f"overlay: {what}: found {array.shape[1]} x {array.shape[0]} pixels, the camera has "
                                    f"{size[0]} x {size[1]}")
    known = bool(np.isfinite(pose).all())
    top, bottom = _darkened(image), image.copy()
    if known:
        draw_person(top, picture, pose, doubtful)
        draw_skeleton(bottom, picture, pose, doubtful)
    elif last is not None:
        draw_skeleton(bottom, picture, np.asarray(last, float), picture.body.landmark_names)
    if keypoints is not None:
        draw_keypoints(top, keypoints)
        draw_keypoints(bottom, keypoints)
    return np.concatenate([top, matching(picture.mask(pose) if known else np.zeros_like(mask), mask, ignore), bottom])


def matching(model: NDArray[np.bool_], mask: NDArray[np.bool_], ignore: ArrayLike | None = None) -> Image:
    """Comparison (H, W, 3) of a drawn model and a silhouette (H, W), in the colours `MATCHING`."""
    index = model.astype(np.uint8) + 2 * mask.astype(np.uint8)
    if ignore is not None:
        index += 4 * np.asarray(ignore, bool).astype(np.uint8)
    return MATCHING[index]


def draw_person(image: Image, picture: Picture, pose: Array, doubtful: Container[str] = ()) -> None:
    """Draw the body in the pose (D,) into an image (H, W, 3) that shows through it, and its bones over it; see `draw_model`."""
    import cv2

    drawn = image.copy()
    draw_model(drawn, picture, pose, doubtful)
    image[:] = cv2.addWeighted(drawn, SHOWN, image, 1 - SHOWN, 0)
    draw_skeleton(image, picture, pose, doubtful)


def draw_model(image: Image, picture: Picture, pose: Array, doubtful: Container[str] = ()) -> None:
    """Draw the body in the pose (D,) into an image (H, W, 3), shaded and outlined, farthest shapes first; `doubtful` parts are dashed
    outlines."""
    import cv2

    from shadowpuppet.body.shapes import Quads

    pieces = (_of_quads if isinstance(picture.body.shapes, Quads) else _of_hulls)(picture, pose)
    width = max(1, round(image.shape[0] / 300))
    for piece in sorted(pieces, key=lambda piece: -piece.depth):
        is_doubtful = piece.part in doubtful
        for corners, colour in () if is_doubtful else piece.fills:
            cv2.fillConvexPoly(image, _fixed(corners), colour, cv2.LINE_AA, SUBPIXEL)
        colour, dash = (colour_of(piece.part), DASH * (width + 1)) if is_doubtful else ((25, 25, 25), 0)
        draw_line(image, piece.edge, colour, width + is_doubtful, dash)


def draw_skeleton(image: Image, picture: Picture, pose: Array, doubtful: Container[str] = ()) -> None:
    """Draw the bones and joints of the pose (D,) into an image (H, W, 3); bones that lead to `doubtful` landmarks are dashed."""
    import cv2

    points = picture.body.points(pose[None], picture.T_camera_base)[0]
    names = picture.body.landmark_names
    pixels = dict(zip(names, _pixels(picture, points)))
    visible = {name: pixel for name, pixel in pixels.items() if np.isfinite(pixel).all()}
    bones = [(visible[a], visible[b], b) for a, b in BONES if a in visible and b in visible]
    joints = {name for bone in BONES for name in bone}
    dots = [_point(visible[name]) for name in names if name in visible and name in joints]
    metre = picture.camera.matrix[1, 1] / max(float(np.median(points[:, 2])), 1e-3)  # in pixels
    unit = min(_unit(image), max(0.7, metre / 100))  # thin lines on people far off
    for extra, dark in ((2, True), (0, False)):  # a dark rim, so that bones stand out from any clothes
        for a, b, name in bones:
            width = round(2 * unit)
            draw_line(image, np.array([a, b]), BLACK if dark else colour_of(name), width + extra, DASH * width * (name in doubtful))
    for radius, colour in ((3, BLACK), (2, WHITE)):
        for dot in dots:
            cv2.circle(image, dot, round(radius * unit) << SUBPIXEL, colour, -1, cv2.LINE_AA, SUBPIXEL)


def draw_line(image: Image, points: Array, colour: Colour, width: int, dash: float = 0) -> None:
    """Draw the line through pixels (K, 2) into an image (H, W, 3), in dashes of a length, pixels; 0: whole."""
    import cv2

    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    parts = [points]
    if dash and along[-1] < 10 * image.shape[0]:  # else it is mostly far outside the picture
        pieces = 2 * round(along[-1] / (2 * dash)) + 1  # odd: a dash at both ends
        starts, stops = np.linspace(0, along[-1], pieces + 1).reshape(-1, 2).T
        starts[1:] += width / 2  # a line ends in a round cap
        stops[:-1] = np.maximum(stops[:-1] - width / 2, starts[:-1])
        ends = [np.array([start, *along[(along > start) & (along < stop)], stop]) for start, stop in zip(starts, stops)]
        parts = [np.stack([np.interp(each, along, axis) for axis in points.T], 1) for each in ends]
    cv2.polylines(image, list(map(_fixed, parts)), False, colour, width, cv2.LINE_AA, SUBPIXEL)


def draw_keypoints(image: Image, keypoints: Keypoints) -> None:
    """Draw keypoints as thin crosses in the colours of their sides, the fainter the less confident, into an image
    (H, W, 3)."""
    import cv2

    arm = round(4 * _unit(image))
    for name, at, sure in zip(np.tile(keypoints.names, len(keypoints.xy)), keypoints.xy.reshape(-1, 2), keypoints.confidence.ravel()):
        if np.isfinite(at).all():
            place = np.round(at).astype(int)
            left, top = np.maximum(place - arm - 2, 0)
            patch = image[top : top + 2 * arm + 5, left : left + 2 * arm + 5]
            drawn, (x, y) = patch.copy(), (place - (left, top)).tolist()
            light = tuple((255 + value) // 2 for value in colour_of(name))  # seen on the bone of the same side
            for colour, aside in ((BLACK, 1), (light, 0)):
                cv2.drawMarker(drawn, (x + aside, y + aside), colour, cv2.MARKER_CROSS, 2 * arm, 1)
            patch[:] = cv2.addWeighted(drawn, float(sure), patch, 1 - float(sure), 0)


def write_over(image: Image, text: str, picture: Picture, pose: Array) -> None:
    """Write a text above the head of the body in the pose (D,) into an image (H, W, 3)."""
    import cv2

    rows, columns = np.nonzero(picture.mask(pose))
    if len(rows):
        scale = 0.5 * _unit(image)
        (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
        place = int(columns[rows == rows[0]].mean()) - width // 2, max(int(rows[0]) - round(8 * scale), round(24 * scale))
        for colour, thickness in ((BLACK, round(6 * scale)), (WHITE, round(2 * scale))):
            cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, thickness, cv2.LINE_AA)


def _unit(image: Image) -> float:
    """Pixels of an image (H, W, 3) for one of a picture 240 pixels high; 1 in smaller ones."""
    return max(1.0, image.shape[0] / 240)


def in_colour(image: Image) -> Image:
    """A picture (H, W, 3) from one (H, W, 3) or (H, W)."""
    image = np.asarray(image, np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def _darkened(image: Image) -> Image:
    """The picture in dark grey, so that the model's colours stand out."""
    import cv2

    grey = cv2.convertScaleAbs(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), alpha=0.4)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def colour_of(name: str) -> Colour:
    """The colour of a landmark's bone or of a part by its side."""
    return SIDE_COLOURS.get(name.split("_")[0], MIDDLE_COLOUR)


class _Piece(NamedTuple):
    """A flat piece of the model."""

    part: str
    depth: float
    """Distance from the camera, metres."""
    fills: list[tuple[Array, tuple[float, ...]]]
    """Convex polygons (K, 2), pixels, and their colours, drawn in order."""
    edge: Array
    """The line (K, 2), pixels, that is outlined."""


def _of_quads(picture: Picture, pose: Array) -> list[_Piece]:
    """Pieces of quads, each cut in four: crossing cards overlap, their quarters mostly do not."""
    body = picture.body
    quarters = _quarters(picture.transforms(pose[None])[0], body.shapes.arrays[0], body.shapes.joints[:, 0])
    pixels, depths = _pixels(picture, quarters), quarters[..., 2].mean(2)
    shades = _shades(quarters)
    # The first three corners of a quarter lie on the card's edge; only this edge is outlined.
    return [_Piece(part, depths[q, k], [(pixels[q, k], _shaded(colour_of(part), shades[q, k]))], pixels[q, k, :3])
            for q, part in enumerate(body.parts) for k in range(4) if np.isfinite(pixels[q, k]).all()]


def _of_hulls(picture: Picture, pose: Array) -> list[_Piece]:
    """Pieces of hulls: their outlines, brighter toward the middle."""
    body, T = picture.body, picture.transforms(pose[None])
    corners, counts = picture.polygons(T, picture.every)
    T = T[0, body.shapes.joints]
    depths = (np.einsum("sej,sej->se", T[..., 2, :3], body.shapes.arrays[0]) + T[..., 2, 3]).mean(1)
    pieces = []
    for i in np.flatnonzero(counts[0]):
        outline, part = corners[0, i, : counts[0, i]], body.parts[i]
        middle = outline.mean(0)
        colour = colour_of(part)
        fills = [(middle + size * (outline - middle), _shaded(colour, 1 - 0.45 * size**2)) for size in (1.0, 0.8, 0.6, 0.4, 0.2)]
        pieces.append(_Piece(part, depths[i], fills, np.concatenate([outline, outline[:1]])))
    return pieces


def _quarters(transforms: Array, quads: Array, joints: NDArray[np.int64]) -> Array:
    """Quads cut in four, (Q, 4, 4, 3) in the camera's frame; the last corner of each quarter is the quad's centre."""
    T = transforms[joints]
    corners = np.einsum("qij,qvj->qvi", T[..., :3], quads) + T[:, None, :, 3]
    after = 0.5 * (corners + np.roll(corners, -1, axis=1))
    middle = np.broadcast_to(corners.mean(1, keepdims=True), corners.shape)
    return np.stack([np.roll(after, 1, axis=1), corners, after, middle], axis=2)


def _shades(pieces: Array) -> Array:
    """Brightness (Q, 4) of pieces by how much they face the camera."""
    normals = np.cross(pieces[:, :, 2] - pieces[:, :, 0], pieces[:, :, 3] - pieces[:, :, 1])
    view = pieces.mean(2)
    sizes = np.linalg.norm(normals, axis=2) * np.linalg.norm(view, axis=2)
    return 0.4 + 0.6 * np.abs((normals * view).sum(2)) / np.maximum(sizes, 1e-12)


def _shaded(colour: Colour, shade: float) -> tuple[float, ...]:
    return tuple(shade * value for value in colour)


def _pixels(picture: Picture, points_camera: Array) -> Array:
    """Pixels (..., 2) of points in the camera's frame."""
    return picture.camera.project(transform(inverse(picture.camera.T_camera_world), points_camera))


def _fixed(pixels: Array) -> NDArray[np.int32]:
    """Pixels as OpenCV's fixed-point numbers, clipped far outside the picture."""
    return np.clip(np.round(pixels * (1 << SUBPIXEL)), -(1 << 20), 1 << 20).astype(np.int32)


def _point(pixel: Array) -> tuple[int, int]:
    x, y = _fixed(pixel).tolist()
    return x, y
