"""The page about a calibration session: errors, coverage of each picture, where cameras stand, and what to film again."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from shadowpuppet.calibration.session import DOUBT_FACTOR, Calibrated
from shadowpuppet.calibration.solve.lens import LensFit
from shadowpuppet.camera.camera import Camera
from shadowpuppet.evaluation.report.html import document, figure, plain, rows, table
from shadowpuppet.geometry import Array, evenly_spread

MAP_WIDTH, PICTURE_WIDTH = 520, 340
"""Widths of the drawings, pixels."""
ARROW_SCALE = 40.0
"""Factor by which reprojection errors are drawn larger than they are."""


def calibration_page(found: Calibrated) -> str:
    """The page as HTML; it is complete in itself and makes no requests."""
    name = found.session.folder.resolve().name
    return document(f"{name}: calibration", _parts(found, name))


def _parts(found: Calibrated, name: str) -> Iterator[str]:
    yield f'<header><h1>{plain(name)}: calibration</h1><p class="under">{plain(found.session.board.text)}</p></header>'
    yield "<h2>What to film again</h2>"
    yield "<ul>" + "".join(f"<li>{plain(each)}</li>" for each in found.advice) + "</ul>" if found.advice else "<p>Nothing.</p>"
    if found.notes:
        yield "<h3>Notes</h3><ul>" + "".join(f"<li>{plain(each)}</li>" for each in found.notes) + "</ul>"
    fits = [fit for fit in found.lenses if fit is not None]
    if fits:
        yield "<h2>Lenses</h2>" + _lens_table(fits)
        note = "Corners of the board over the picture; strokes are reprojection errors, {:g} times enlarged."
        shots = "".join(figure(_picture(fit), f"<b>{plain(fit.camera.name)}</b>: {note.format(ARROW_SCALE)}") for fit in fits)
        yield f'<div class="shots">{shots}</div>'
    if found.placement is not None:
        yield "<h2>Places</h2>" + _place_table(found)
        yield figure(_map(found), "From above: cameras and their directions, and where the board was (grey).")
        yield "<h3>Pairs</h3><p class=said>Moments in which two cameras see the board together, and moments that agree.</p>"
        yield _pair_table(found)


def _lens_table(fits: list[LensFit]) -> str:
    head = ["camera", "pixels", "model", "views", "error, px", "95 %, px", "unseen views, px", "focal lengths, px", "known to",
            "coverage", "tilt", "distances"]
    cells = ((fit.camera.name, f"{fit.camera.size[0]} x {fit.camera.size[1]}", fit.model, str(fit.views), f"{fit.rms:.2f}",
              f"{np.percentile(np.linalg.norm(fit.residuals, axis=1), 95):.2f}", f"{fit.held_out:.2f}",
              f"{fit.camera.matrix[0, 0]:.1f}, {fit.camera.matrix[1, 1]:.1f}", f"{100 * fit.focal_sd:.2f} %", f"{100 * fit.coverage:.0f} %",
              f"{fit.tilt:.0f}°", f"1 : {fit.distances:.1f}") for fit in fits)  # fmt: skip
    return table(head, rows(cells))


def _place_table(found: Calibrated) -> str:
    assert found.placement is not None
    solved = found.placement.solved
    number = np.repeat([c for c, _, _ in found.placement.views], [len(view.ids) for _, _, view in found.placement.views])
    cells = []
    for n, camera in enumerate(found.cameras):
        off = np.linalg.norm(solved.residuals[number == n], axis=1)
        spread = (np.sqrt((off**2).mean()), np.median(off), np.percentile(off, 95)) if len(off) else ()
        error = [f"{value:.2f}" for value in spread] or [""] * 3
        cells.append((camera.name, " ".join(f"{value:.3f}" for value in camera.centre.tolist()),
                      f"{1000 * DOUBT_FACTOR * solved.place_sd[n]:.1f}", f"{np.degrees(DOUBT_FACTOR * solved.angle_sd[n]):.2f}", *error,
                      f"{1000 * solved.bundle.delays[n]:.1f}"))
    head = ["camera", "at, m", "known to, mm", "known to, °", "error, px", "median, px", "95 %, px", "film late, ms"]
    return table(head, rows(cells))


def _pair_table(found: Calibrated) -> str:
    assert found.placement is not None
    names = [camera.name for camera in found.cameras]
    cells = ((f"{names[pair.first]}, {names[pair.second]}", str(pair.seen), str(pair.agreed), "" if pair.good else "not used")
             for pair in found.placement.pairs)  # fmt: skip
    return table(["cameras", "together", "agree", ""], rows(cells))


def _picture(fit: LensFit) -> str:
    """Corners and errors over the picture's frame, as SVG."""
    width, height = fit.camera.size
    k = PICTURE_WIDTH / width
    chosen = evenly_spread(len(fit.corners), 1500)
    ends = fit.corners + ARROW_SCALE * fit.residuals
    marks = "".join(f"M{k * a:.1f} {k * b:.1f}L{k * c:.1f} {k * d:.1f}" for (a, b), (c, d) in zip(fit.corners[chosen], ends[chosen]))
    dots = "".join(f'<circle cx="{k * a:.1f}" cy="{k * b:.1f}" r="1.1"/>' for a, b in fit.corners[chosen])
    return (f'<svg viewBox="0 0 {PICTURE_WIDTH} {k * height:.0f}" role="img" aria-label="coverage of {plain(fit.camera.name)}">'
            f'<rect width="{PICTURE_WIDTH}" height="{k * height:.1f}" fill="#f6f8fa" stroke="#c8ced6"/>'
            f'<path d="{marks}" stroke="#d55e00" stroke-width="0.6" fill="none"/><g fill="#0072b2">{dots}</g></svg>')


def _map(found: Calibrated) -> str:
    """Cameras and boards from above, as SVG."""
    assert found.placement is not None
    boards = found.placement.solved.bundle.boards[:, :2, 3]
    places = np.array([camera.centre[:2] for camera in found.cameras])
    points = np.concatenate([boards, places])
    low, high = points.min(0) - 0.8, points.max(0) + 0.8
    k = MAP_WIDTH / max(float((high - low).max()), 1e-6)

    def at(point: Array) -> tuple[float, float]:
        return k * float(point[0] - low[0]), k * float(high[1] - point[1])

    dots = "".join('<circle cx="{:.1f}" cy="{:.1f}" r="2"/>'.format(*at(point)) for point in boards)
    drawn = "".join(_drawn_camera(camera, at) for camera in found.cameras)
    x, y = at(np.zeros(2))
    origin = f'<path d="M{x - 5:.1f} {y:.1f}h10M{x:.1f} {y - 5:.1f}v10" stroke="#1f2329"/>'
    width, height = k * (high - low)
    return (f'<svg viewBox="0 0 {width:.0f} {height:.0f}" style="max-width:{width:.0f}px" role="img" aria-label="cameras from above">'
            f'<rect width="{width:.1f}" height="{height:.1f}" fill="#f6f8fa" stroke="#c8ced6"/><g fill="#b6bec9">{dots}</g>'
            f"{origin}{drawn}</svg>")


def _drawn_camera(camera: Camera, at: Callable[[Array], tuple[float, float]]) -> str:
    x, y = at(camera.centre[:2])
    a, b = at(camera.centre[:2] + 0.5 * camera.T_camera_world[2, :2])
    return (f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#0072b2"/><path d="M{x:.1f} {y:.1f}L{a:.1f} {b:.1f}" stroke="#0072b2" '
            f'stroke-width="2"/><text x="{x + 6:.1f}" y="{y - 6:.1f}" font-size="11">{plain(camera.name)}</text>')
