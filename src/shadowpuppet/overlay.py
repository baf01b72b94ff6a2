"""The picture of a fit, as Liu 2011 shows it (Fig. 10-12): best estimate, matching result, raw picture, one below the other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, inverse, transform
from shadowpuppet.motion import BONES

if TYPE_CHECKING:  # both bring much with them
    from shadowpuppet.rasterize import Picture
    from shadowpuppet.video import FrameWriter, Image

# Colours (blue, green, red) that people who see colours differently tell apart: Okabe & Ito 2008.
BLACK, GREY, WHITE = (0, 0, 0), (96, 96, 96), (255, 255, 255)
MODEL_ONLY, SILHOUETTE_ONLY = (0, 159, 230), (233, 180, 86)
SIDES = {"left": (115, 158, 0), "right": (167, 121, 204)}
MIDDLE = (66, 228, 240)
"""The colour of what is neither left nor right."""
MATCHING = np.array([BLACK, MODEL_ONLY, SILHOUETTE_ONLY, WHITE, (40, 40, 40), (40, 40, 40), GREY, GREY], np.uint8)
"""Colours of the matching row by model + 2 silhouette + 4 ignored."""
SUBPIXEL = 4
"""Bits of a pixel's fraction in OpenCV's drawing."""


def overlay_frame(image: Image, mask: ArrayLike, picture: Picture, pose: ArrayLike, *, status: str, time: float,
                  overlap: float = np.nan, ignore: ArrayLike | None = None) -> Image:
    """The three rows (3 H, W, 3), blue green red, of a frame.

    Top: the model's cards over the darkened picture, brighter the more they face the camera. Middle: where model and silhouette
    `mask` (H, W) agree (white), where there is only one of them, and what does not count, `ignore` (H, W), in greys. Bottom: the
    picture with the skeleton, the time (s), the status and the overlap. A `pose` (D,) that is not numbers is not drawn.
    Raises `ShadowPuppetError` where a picture has not the camera's size.
    """
    image, pose, mask = _colour(image), np.asarray(pose, float), np.asarray(mask, bool)
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
        draw_model(out[:height], picture, pose)
        draw_skeleton(out[2 * height :], picture, pose)
    out[height : 2 * height] = matching(picture.mask(pose) if known else np.zeros_like(mask), mask, ignore)
    _label(out, height, status, time, overlap)
    return out


def matching(model: NDArray[np.bool_], mask: NDArray[np.bool_], ignore: ArrayLike | None = None) -> Image:
    """Where a drawn model and a silhouette (H, W) agree and differ, (H, W, 3); the colours are `MATCHING`."""
    index = model.astype(np.uint8) + 2 * mask.astype(np.uint8)
    if ignore is not None:
        index += 4 * np.asarray(ignore, bool).astype(np.uint8)
    return MATCHING[index]


def draw_model(image: Image, picture: Picture, pose: Array) -> None:
    """Draw the body's quads in the pose (D,) into an image (H, W, 3), shaded and outlined, nearer ones over farther ones.

    Cards cross one another, so that each is drawn as four pieces, which mostly do not.
    """
    import cv2

    body = picture.body
    pieces = _pieces(picture.transforms(pose[None])[0], body.quads, body.quad_joints)
    pixels = _pixels(picture, pieces)
    visible = np.asarray(np.isfinite(pixels).all((2, 3)))
    pixels = _fixed(np.where(visible[..., None, None], pixels, 0))
    colours = np.array([_side(part) for part in body.quad_parts], float)[:, None] * _shades(pieces)[..., None]
    order = np.argsort(-pieces[..., 2].mean(2), axis=None, kind="stable")
    width = max(1, round(image.shape[0] / 300))
    for q, k in zip(*np.unravel_index(order, visible.shape)):
        if visible[q, k]:
            corners = pixels[q, k]
            cv2.fillConvexPoly(image, corners, colours[q, k].tolist(), cv2.LINE_AA, SUBPIXEL)
            # The first three corners of a piece lie on the card's edge, which is all that is outlined.
            cv2.polylines(image, [corners[:3]], False, (25, 25, 25), width, cv2.LINE_AA, SUBPIXEL)


def draw_skeleton(image: Image, picture: Picture, pose: Array) -> None:
    """Draw the bones and joints of the pose (D,) into an image (H, W, 3)."""
    import cv2

    points = picture.body.points(pose[None], picture.T_camera_base)[0]
    names = picture.body.landmark_names
    pixels = dict(zip(names, _pixels(picture, points)))
    seen = {name: pixel for name, pixel in pixels.items() if np.isfinite(pixel).all()}
    bones = [(seen[a], seen[b], _side(b)) for a, b in BONES if a in seen and b in seen]
    unit = max(1.0, image.shape[0] / 240)
    for extra, dark in ((2, True), (0, False)):  # a dark rim, so that bones stand out from any clothes
        for a, b, colour in bones:
            cv2.line(image, _point(a), _point(b), BLACK if dark else colour, round(2 * unit) + extra, cv2.LINE_AA, SUBPIXEL)
    for name in {name for bone in BONES for name in bone} & set(seen):
        cv2.circle(image, _point(seen[name]), round(3 * unit) << SUBPIXEL, BLACK, -1, cv2.LINE_AA, SUBPIXEL)
        cv2.circle(image, _point(seen[name]), round(2 * unit) << SUBPIXEL, WHITE, -1, cv2.LINE_AA, SUBPIXEL)


class OverlayWriter:
    """A film of overlays: `with OverlayWriter("overlay.mp4", 25, picture) as film: film.write(image, mask, pose, ...)`."""

    def __init__(self, path: str | Path, rate: float, picture: Picture) -> None:
        """`rate`: frames/s. Raises `VideoError` for endings that are no film's, and later where it cannot be written."""
        from shadowpuppet.video import write_frames

        self.picture = picture
        self._film: FrameWriter = write_frames(path, rate)

    def __enter__(self) -> Self:
        """Use it in a `with` block."""
        self._film.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        """Finish the film; after an error what there is can be played from `<name>.part.<ending>`."""
        self._film.__exit__(*error)  # type: ignore[arg-type]

    def write(self, image: Image, mask: ArrayLike, pose: ArrayLike, *, status: str, time: float, overlap: float = np.nan,
              ignore: ArrayLike | None = None) -> None:
        """Add a frame; the arguments are those of `overlay_frame`."""
        self._film.write(overlay_frame(image, mask, self.picture, pose, status=status, time=time, overlap=overlap, ignore=ignore))


def _colour(image: Image) -> Image:
    image = np.asarray(image, np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def _darkened(image: Image) -> Image:
    """Grey and dark, so that the model's colours stand out."""
    import cv2

    grey = cv2.convertScaleAbs(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), alpha=0.4)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def _side(name: str) -> tuple[int, int, int]:
    return SIDES.get(name.split("_")[0], MIDDLE)


def _pieces(transforms: Array, quads: Array, joints: NDArray[np.int64]) -> Array:
    """Quads cut in four, (Q, 4, 4, 3) in the camera's frame; of each piece's corners the last is the quad's middle."""
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


def _pixels(picture: Picture, points_camera: Array) -> Array:
    """Pixels (..., 2) of points in the camera's frame."""
    return picture.camera.project(transform(inverse(picture.camera.T_camera_world), points_camera))


def _fixed(pixels: Array) -> NDArray[np.int32]:
    """Pixels as OpenCV's fixed-point numbers, those far outside the picture nearer to it."""
    return np.clip(np.round(pixels * (1 << SUBPIXEL)), -(1 << 20), 1 << 20).astype(np.int32)


def _point(pixel: Array) -> tuple[int, int]:
    x, y = _fixed(pixel).tolist()
    return x, y


def _label(out: Image, height: int, status: str, time: float, overlap: float) -> None:
    fit = "" if np.isnan(overlap) else f"  IoU {overlap:.2f}"
    _write(out, f"{time:.2f} s  {status}{fit}", 3 * height, WHITE)
    _write(out, "best estimate", height, WHITE)
    end = _write(out, "model only", 2 * height, MODEL_ONLY)
    _write(out, "silhouette only", 2 * height, SILHOUETTE_ONLY, end)


def _write(out: Image, text: str, bottom: int, colour: tuple[int, int, int], left: int = 0) -> int:
    """Write a line of text above `bottom`, with a dark rim; returns where it ends."""
    import cv2

    scale = max(0.35, out.shape[0] / 3 / 600)
    (width, _), base = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    place = (left + round(10 * scale), bottom - base - round(4 * scale))
    for thickness, ink in ((3, BLACK), (1, colour)):
        cv2.putText(out, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, ink, max(1, round(thickness * scale / 0.4)), cv2.LINE_AA)
    return place[0] + width + round(10 * scale)
