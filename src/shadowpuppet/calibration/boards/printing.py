"""A board as a PDF page at true scale, drawn as rectangles."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from scipy.constants import inch

from shadowpuppet.calibration.boards.board import Board, check_turned
from shadowpuppet.errors import CalibrationError
from shadowpuppet.io.files.text import write_whole

POINTS_PER_METRE = 72 / inch
PAPERS = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "A2": (0.420, 0.594), "A1": (0.594, 0.841), "A0": (0.841, 1.189)}
"""Widths and heights of sheets, metres."""
MARGIN = 0.012
"""White margin around the board, metres; boards need some to be found."""
NOTE_HEIGHT = 0.014
"""Height of the note and the ruler under the board, metres."""
RULER = 0.1
"""Length of the ruler, metres."""


def write_board(path: Path, board: Board) -> str:
    """Write the board as a PDF of true size; returns the sheet's name. Raises `ShadowPuppetError` if it cannot be written, or looks the
    same after half a turn."""
    check_turned(board)
    if path.suffix.lower() != ".pdf":
        raise CalibrationError(f"{path}: found the ending {path.suffix!r}, expected .pdf")
    name, width, height = sheet_of(board)
    write_whole(path, board_pdf(board, width, height))
    return name


def sheet_of(board: Board) -> tuple[str, float, float]:
    """Name, width and height (metres) of the smallest sheet that holds the board; one as large as needed if none does."""
    wide, high = board.size[0] + 2 * MARGIN, board.size[1] + 2 * MARGIN + NOTE_HEIGHT
    for name, (short, long) in PAPERS.items():
        for width, height in ((short, long), (long, short)):
            if wide <= width and high <= height:
                return name, width, height
    return f"{1000 * wide:.0f} x {1000 * high:.0f} mm", wide, high


def rectangles(board: Board) -> Iterator[tuple[float, float, float, float]]:
    """Left, top, width and height of the black rectangles, metres from the board's upper left corner."""
    side = board.square
    for row, line in enumerate(board.squares().tolist()):
        for column, black in enumerate(line):
            if black:
                yield column * side, row * side, side, side
    for row, column, bits in board.marker_bits():
        cell, inset = board.marker / len(bits), (side - board.marker) / 2
        for y, cells in enumerate(bits.tolist()):
            x = 0
            while x < len(cells):  # runs of black cells, so that no hairlines show between them
                run = next((n for n in range(x, len(cells)) if not cells[n]), len(cells)) - x
                if run:
                    yield column * side + inset + x * cell, row * side + inset + y * cell, run * cell, cell
                x += max(run, 1)


def board_pdf(board: Board, width: float, height: float) -> bytes:
    """A page of the given width and height (metres) with the board in its middle, a note and a ruler."""
    left, top = (width - board.size[0]) / 2, (height - NOTE_HEIGHT - board.size[1]) / 2
    k = POINTS_PER_METRE
    parts = ["0 g"]
    parts += [f"{k * (left + x):.4f} {k * (height - top - y - h):.4f} {k * w:.4f} {k * h:.4f} re" for x, y, w, h in rectangles(board)]
    parts.append("f")
    base = top + board.size[1] + MARGIN
    note = (f"{board.text}{', ' + board.dictionary if board.dictionary else ''}. Print at 100 %, without fitting to the page; the line is "
            f"{1000 * RULER:g} mm long.")
    parts += [f"BT /F 7 Tf {k * left:.3f} {k * (height - base - 0.004):.3f} Td ({note}) Tj ET",
              f"0.5 w {k * left:.4f} {k * (height - base - 0.007):.4f} m {k * (left + RULER):.4f} {k * (height - base - 0.007):.4f} l S"]
    stream = "\n".join(parts).encode("ascii")
    box = f"[0 0 {k * width:.3f} {k * height:.3f}]"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(stream), stream),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    return _file_of(objects)


def _file_of(objects: list[bytes]) -> bytes:
    """A PDF file of numbered objects, with its table of places."""
    out, places = b"%PDF-1.4\n", []
    for n, body in enumerate(objects, 1):
        places.append(len(out))
        out += b"%d 0 obj\n%s\nendobj\n" % (n, body)
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    return (out + b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1) + table
            + b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, len(out)))
