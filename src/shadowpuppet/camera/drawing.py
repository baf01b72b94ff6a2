"""Drawing of a fit as in Liu 2011 (Fig. 10-12): best estimate, matching result and raw picture, one below the other."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, inverse, transform

if TYPE_CHECKING:  # slow to import
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.video import Image

Colour = tuple[int, int, int]
"""Blue, green, red."""
# Colours that colour-blind people can tell apart: Okabe & Ito 2008.
BLACK, GREY, WHITE = (0, 0, 0), (96, 96, 96), (255, 255, 255)
MODEL_ONLY, SILHOUETTE_ONLY = (0, 159, 230), (233, 180, 86)
SIDE_COLOURS = {"left": (115, 158, 0), "right": (167, 121, 204)}
MIDDLE_COLOUR = (66, 228, 240)
"""The colour of parts that are neither left nor right."""
PALE, PALENESS = (190, 190, 190), 0.7
"""The colour mixed into a doubtful limb's, and its share."""
DASH = 8
"""Length of the dashes and gaps of such a limb's bones, in pictures 240 pixels high, pixels."""
MATCHING = np.array([BLACK, MODEL_ONLY, SILHOUETTE_ONLY, WHITE, (40, 40, 40), (40, 40, 40), GREY, GREY], np.uint8)
"""Colours of the matching row, indexed by model + 2 silhouette + 4 ignored."""
LINE = 36
"""Distance of lines of text, pixels at a scale of 1."""
SUBPIXEL = 4
"""Fractional bits of pixel coordinates in OpenCV's drawing."""


def overlay_frame(image: Image, mask: ArrayLike, picture: Picture, pose: ArrayLike, *, status: str, time: float, overlap: float = np.nan,
                  ignore: ArrayLike | None = None, doubtful: Container[str] = (), last: tuple[ArrayLike, float] | None = None) -> Image:
    """The three rows (3 H, W, 3), blue green red, of a frame.

    Top: the model over the darkened picture, cards brighter the more they face the camera. Middle: where model and silhouette `mask` (H,
    W) agree (white) or differ, and ignored pixels, `ignore` (H, W), in greys. Bottom: the picture with the skeleton, the time (s),
    the status and the overlap. Shapes and bones whose names are `doubtful` are pale, and the bones dashed. Where the `pose` (D,) is not
    finite, the skeleton has the `last` finite pose, of a time (s), all pale. Raises `ShadowPuppetError` for a picture that is
    not of the camera's size.
    """
    image, pose, mask = in_colour(image), np.asarray(pose, float), np.asarray(mask, bool)
    size = picture.camera.size
    for what, array in (("image", image), ("mask", mask), ("ignore", mask if ignore is None else np.asarray(ignore))):
        if array.shape[:2] != size[::-1]:
            raise ShadowPuppetError(f"overlay: {what}: found {array.shape[1]} x {array.shape[0]} pixels, the camera has "
                                    f"{size[0]} x {size[1]}")
    known = bool(np.isfinite(pose).all())
    height = size[1]
    out = np.empty((3 * height, size[0], 3), np.uint8)
    out[:height], out[2 * height :] = _darkened(image), image
    if known:
        draw_model(out[:height], picture, pose, doubtful)
        draw_skeleton(out[2 * height :], picture, pose, doubtful)
    elif last is not None:
        draw_skeleton(out[2 * height :], picture, np.asarray(last[0], float), picture.body.landmark_names)
    out[height : 2 * height] = matching(picture.mask(pose) if known else np.zeros_like(mask), mask, ignore)
    _label(out, height, said_of(status, None if known or last is None else last[1]), time, overlap, ignore is not None)
    return out


def said_of(status: str, last: float | None) -> str:
    """A status in words; `last`: time (s) of the pose that is shown in place of the frame's own, None if that is shown."""
    return status if last is None else f"{status}, pale: at {last:.2f} s"


def matching(model: NDArray[np.bool_], mask: NDArray[np.bool_], ignore: ArrayLike | None = None) -> Image:
    """Comparison (H, W, 3) of a drawn model and a silhouette (H, W), in the colours `MATCHING`."""
    index = model.astype(np.uint8) + 2 * mask.astype(np.uint8)
    if ignore is not None:
        index += 4 * np.asarray(ignore, bool).astype(np.uint8)
    return MATCHING[index]


def draw_model(image: Image, picture: Picture, pose: Array, doubtful: Container[str] = ()) -> None:
    """Draw the body in the pose (D,) into an image (H, W, 3), shaded and outlined, farthest shapes first; `doubtful` parts are pale."""
    import cv2

    from shadowpuppet.body.shapes import Quads

    pieces = (_of_quads if isinstance(picture.body.shapes, Quads) else _of_hulls)(picture, pose, doubtful)
    width = max(1, round(image.shape[0] / 300))
    for piece in sorted(pieces, key=lambda piece: -piece.depth):
        for corners, colour in piece.fills:
            cv2.fillConvexPoly(image, _fixed(corners), colour, cv2.LINE_AA, SUBPIXEL)
        cv2.polylines(image, [_fixed(piece.edge)], False, (25, 25, 25), width, cv2.LINE_AA, SUBPIXEL)


def draw_skeleton(image: Image, picture: Picture, pose: Array, doubtful: Container[str] = ()) -> None:
    """Draw the bones and joints of the pose (D,) into an image (H, W, 3); bones that lead to `doubtful` landmarks are dashed and pale."""
    import cv2

    points = picture.body.points(pose[None], picture.T_camera_base)[0]
    names = picture.body.landmark_names
    pixels = dict(zip(names, _pixels(picture, points)))
    visible = {name: pixel for name, pixel in pixels.items() if np.isfinite(pixel).all()}
    bones = [(visible[a], visible[b], b) for a, b in BONES if a in visible and b in visible]
    joints = {name for bone in BONES for name in bone}
    dots = [_point(visible[name]) for name in names if name in visible and name in joints]
    unit = max(1.0, image.shape[0] / 240)
    for extra, dark in ((2, True), (0, False)):  # a dark rim, so that bones stand out from any clothes
        for a, b, name in bones:
            draw_bone(image, a, b, BLACK if dark else colour_of(name, doubtful), round(2 * unit) + extra, name in doubtful)
    for radius, colour in ((3, BLACK), (2, WHITE)):
        for dot in dots:
            cv2.circle(image, dot, round(radius * unit) << SUBPIXEL, colour, -1, cv2.LINE_AA, SUBPIXEL)


def draw_bone(image: Image, start: Array, end: Array, colour: Colour, width: int, dashed: bool) -> None:
    """Draw the line between two pixels (2,) into an image (H, W, 3)."""
    import cv2

    pieces = 1
    if dashed and (length := float(np.hypot(*(end - start)))) < 10 * image.shape[0]:  # else it is mostly far outside the picture
        pieces = 2 * round(length / (2 * DASH * max(1.0, image.shape[0] / 240))) + 1  # odd: a dash at both ends
    ends = start + np.linspace(0, 1, pieces + 1)[:, None] * (end - start)
    for n in range(0, pieces, 2):
        cv2.line(image, _point(ends[n]), _point(ends[n + 1]), colour, width, cv2.LINE_AA, SUBPIXEL)


def in_colour(image: Image) -> Image:
    """A picture (H, W, 3) from one (H, W, 3) or (H, W)."""
    image = np.asarray(image, np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def _darkened(image: Image) -> Image:
    """The picture in dark grey, so that the model's colours stand out."""
    import cv2

    grey = cv2.convertScaleAbs(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), alpha=0.4)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def colour_of(name: str, doubtful: Container[str] = ()) -> Colour:
    """The colour of a landmark's bone or of a part by its side, pale if it is `doubtful`."""
    colour = SIDE_COLOURS.get(name.split("_")[0], MIDDLE_COLOUR)
    if name not in doubtful:
        return colour
    blue, green, red = (round((1 - PALENESS) * own + PALENESS * pale) for own, pale in zip(colour, PALE))
    return blue, green, red


class _Piece(NamedTuple):
    """A flat piece of the model."""

    depth: float
    """Distance from the camera, metres."""
    fills: list[tuple[Array, tuple[float, ...]]]
    """Convex polygons (K, 2), pixels, and their colours, drawn in order."""
    edge: Array
    """The line (K, 2), pixels, that is outlined."""


def _of_quads(picture: Picture, pose: Array, doubtful: Container[str]) -> list[_Piece]:
    """Pieces of quads, each cut in four: crossing cards overlap, their quarters mostly do not."""
    body = picture.body
    quarters = _quarters(picture.transforms(pose[None])[0], body.shapes.arrays[0], body.shapes.joints[:, 0])
    pixels, depths = _pixels(picture, quarters), quarters[..., 2].mean(2)
    shades = _shades(quarters)
    # The first three corners of a quarter lie on the card's edge; only this edge is outlined.
    return [_Piece(depths[q, k], [(pixels[q, k], _shaded(colour_of(part, doubtful), shades[q, k]))], pixels[q, k, :3])
            for q, part in enumerate(body.parts) for k in range(4) if np.isfinite(pixels[q, k]).all()]


def _of_hulls(picture: Picture, pose: Array, doubtful: Container[str]) -> list[_Piece]:
    """Pieces of hulls: their outlines, brighter toward the middle."""
    body, T = picture.body, picture.transforms(pose[None])
    corners, counts = picture.polygons(T, np.arange(len(body.parts)))
    T = T[0, body.shapes.joints]
    depths = (np.einsum("sej,sej->se", T[..., 2, :3], body.shapes.arrays[0]) + T[..., 2, 3]).mean(1)
    pieces = []
    for i in np.flatnonzero(counts[0]):
        outline, part = corners[0, i, : counts[0, i]], body.parts[i]
        middle = outline.mean(0)
        colour = colour_of(part, doubtful)
        fills = [(middle + size * (outline - middle), _shaded(colour, 1 - 0.45 * size**2)) for size in (1.0, 0.8, 0.6, 0.4, 0.2)]
        pieces.append(_Piece(depths[i], fills, np.concatenate([outline, outline[:1]])))
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


LEGEND = (("left", SIDE_COLOURS["left"]), ("right", SIDE_COLOURS["right"]), ("pale: doubtful", PALE))
"""The model's colours."""


def _label(out: Image, height: int, status: str, time: float, overlap: float, ignores: bool) -> None:
    fit = "" if np.isnan(overlap) else f"  IoU {overlap:.2f}"
    write_words(out, 0, (("best estimate", WHITE), *LEGEND))
    left_out = (("left out", (150, 150, 150)),) if ignores else ()
    write_words(out, height, (("model only", MODEL_ONLY), ("silhouette only", SILHOUETTE_ONLY), ("both", WHITE), *left_out))
    for top, line in lines_below(out, f"{time:.2f} s  {status}{fit}", 2 * height):
        write_text(out, line, top, WHITE)


def write_words(out: Image, top: int, words: Iterable[tuple[str, Colour]], size: float | None = None) -> None:
    """Write words in their colours beside each other below `top`, scaled as by `write_text`."""
    end = 0
    for text, colour in words:
        end = write_text(out, text, top, colour, end, size)


def lines_below(out: Image, text: str, top: int, size: float | None = None) -> list[tuple[int, str]]:
    """A text as lines that fit into a picture, broken at blanks, each with its `top` for `write_text`, the first's below `top`."""
    import cv2

    scale, thickness = _scale(out, size)
    lines, most = [""], out.shape[1] - round(12 * scale)
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        (width, _), _ = cv2.getTextSize(longer, cv2.FONT_HERSHEY_SIMPLEX, scale, thickness)
        if lines[-1] and round(12 * scale) + width > most:
            lines.append(word)
        else:
            lines[-1] = longer
    return [(top + n * round(LINE * scale), line) for n, line in enumerate(lines)]


def _scale(out: Image, size: float | None) -> tuple[float, int]:
    """Scale of the font and thickness of its lines for a picture of height `size`; None: for one of three rows."""
    scale = max(0.35, (out.shape[0] / 3 if size is None else size) / 600)
    return scale, max(1, round(1.5 * scale))


def write_text(out: Image, text: str, top: int, colour: tuple[int, int, int], left: int = 0, size: float | None = None) -> int:
    """Write a line of text with a dark rim below `top`, scaled for a picture of height `size`; returns the text's right end."""
    import cv2

    scale, thickness = _scale(out, size)
    rim = max(1, round(scale))
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, thickness)
    x, y = left + round(12 * scale), top + height + round(12 * scale)
    # The rim is the same text moved, because OpenCV 5 draws thicker text wider.
    for dx, dy, ink in ((-1, -1, BLACK), (1, -1, BLACK), (-1, 1, BLACK), (1, 1, BLACK), (0, 0, colour)):
        place = (x + rim * dx, y + rim * dy)
        cv2.putText(out, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, ink, thickness, cv2.LINE_AA)
    return x + width + round(10 * scale)
