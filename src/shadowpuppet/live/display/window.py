"""A live session in a window, by Tk."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from shadowpuppet.live.display.drawing import drawn
from shadowpuppet.live.display.view import Angle, Display, View

if TYPE_CHECKING:
    from shadowpuppet.video import Image

GROUND, PANEL, LINE, TEXT, FAINT = "#0e1116", "#161b22", "#262d37", "#e6e9ee", "#8b95a3"
CHIPS = {"tracked": "#3fb68b", "uncertain": "#e8b339", "predicted": "#e8b339", "lost": "#e5675b", "paused": "#e5675b", "absent": FAINT}
CALM = "#6f9fd8"
BARS = {"left": "#3fb68b", "right": "#d08cb8", "torso": "#e8d44d"}
SIDE, MARGIN, FONT = 380, 20, "Helvetica"
"""Width of the column beside the picture, and the space around, pixels."""
LEAST_HEIGHT = 550
"""Of the window, pixels, so that all angles fit."""
LATENCIES = 300
"""Pictures in the sparkline."""
KEYS = {"q": "stop", "<Escape>": "stop", "b": "learn", "m": "measure"}

KEYS_TOLD = "q  stop      b  learn the background anew      m  measure anew"


def no_window() -> str:
    """Why no window can be opened; empty where one can."""
    try:
        import tkinter
    except ImportError:
        return "Python's tkinter is not installed"
    try:
        tkinter.Tk().destroy()
    except tkinter.TclError as error:
        return str(error)
    return ""


class WindowDisplay(Display):
    """A window from its `with` block's beginning to its end; its keys are q (stop), b (learn the background), m (measure)."""

    where = "in the window; q stops, b learns the background anew, m measures the person anew"

    def __init__(self, footer: str = "") -> None:
        """`footer`: what it says at its foot."""
        self.footer, self._wish = footer, ""
        self._late: list[float] = []

    def __enter__(self) -> Self:
        """Open the window."""
        import tkinter

        self.root = tkinter.Tk(className="shadowpuppet")
        self.root.title("shadowpuppet live")
        self.root.configure(background=GROUND)
        self.root.protocol("WM_DELETE_WINDOW", lambda: self._ask("stop"))
        for key, wish in KEYS.items():
            self.root.bind(key, lambda _, wish=wish: self._ask(wish))
        self.canvas = tkinter.Canvas(self.root, width=640 + SIDE + 3 * MARGIN, height=LEAST_HEIGHT, background=GROUND, highlightthickness=0)
        self.canvas.pack()
        self._photo: Any = None
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        import tkinter

        with contextlib.suppress(tkinter.TclError):  # which says that it is closed already
            self.root.destroy()

    def wish(self) -> str:
        """The last key that was pressed; closing the window is a wish to stop."""
        wish, self._wish = self._wish, ""
        return wish

    def show(self, view: View) -> None:
        """Draw a view, and let the window live; one whose screen is gone is a wish to stop."""
        import tkinter

        try:
            self._show(view)
        except tkinter.TclError:
            self._ask("stop")

    def _show(self, view: View) -> None:
        image = drawn(view)
        if image is not None:
            self._put(image)
        if image is not None or view.trouble:
            self._late = [*self._late[-LATENCIES:], *([1000 * view.latency] if np.isfinite(view.latency) else [])]
            self.canvas.delete("drawn")
            self._column(view, MARGIN + (self._photo.width() if self._photo else 640) + MARGIN)
        self.root.update()

    def _ask(self, wish: str) -> None:
        self._wish = wish

    def _put(self, image: Image) -> None:
        import tkinter

        height, width = image.shape[:2]
        data = b"P6 %d %d 255 " % (width, height) + image[..., ::-1].tobytes()
        if self._photo is None:
            self.canvas.configure(width=width + SIDE + 3 * MARGIN, height=max(height + 2 * MARGIN + 16, LEAST_HEIGHT))
        self._photo = tkinter.PhotoImage(master=self.root, data=data, format="PPM")
        self.canvas.delete("picture")
        self.canvas.create_image(MARGIN, MARGIN, image=self._photo, anchor="nw", tags="picture")
        self.canvas.tag_lower("picture")

    # The column beside the picture

    def _column(self, view: View, left: int) -> None:
        self._text(left, 32, "shadowpuppet", size=13, bold=True)
        colour = CHIPS.get(view.chip, CALM)
        self.canvas.create_oval(left + SIDE - 100, 27, left + SIDE - 91, 36, fill=colour, outline="", tags="drawn")
        self._text(left + SIDE - 84, 32, view.chip, colour, bold=True)
        figures = (("latency", view.latency * 1000, "{:.0f} ms"), ("speed", view.rate, "{:.1f} frames/s"),
                   ("overlap", view.overlap, "{:.2f}"), ("dropped", view.dropped, "{:d}"))
        for n, (name, value, form) in enumerate(figures):
            x, y = left + (SIDE // 2) * (n % 2), 66 + 52 * (n // 2)
            self._text(x, y, name, FAINT, 9)
            self._text(x, y + 21, form.format(value) if np.isfinite(value) else "–", size=16, bold=True)
        self._sparkline(left, 172, 44, view.interval * 1000)
        for n, angle in enumerate(view.angles):
            self._bar(angle, left, 248 + 22 * n + 8 * sum(angle.name.startswith(side) for side in ("left", "right"))
                      + 8 * angle.name.startswith("right"))
        self._message(view)
        self._text(left, self.canvas.winfo_reqheight() - 26, self.footer, FAINT, 8)
        self._text(MARGIN, self.canvas.winfo_reqheight() - 16, KEYS_TOLD, FAINT, 9, width=640)

    def _message(self, view: View) -> None:
        said = view.trouble or view.message
        if not said or self._photo is None:
            return
        width, height = self._photo.width(), self._photo.height()
        count = f"{np.ceil(view.countdown):.0f}\n" if view.countdown else ""
        text = self.canvas.create_text(MARGIN + width / 2, MARGIN + height - 24, text=count + said, fill=TEXT, font=(FONT, 18, "bold"),
                                       anchor="s", justify="center", width=width - 40, tags="drawn")
        x0, y0, x1, y1 = self.canvas.bbox(text)
        box = self.canvas.create_rectangle(x0 - 14, y0 - 8, x1 + 14, y1 + 8, fill=GROUND, outline=LINE, tags="drawn")
        self.canvas.tag_lower(box, text)

    def _sparkline(self, left: int, top: int, height: int, interval: float) -> None:
        self.canvas.create_rectangle(left, top, left + SIDE, top + height, fill=PANEL, outline=LINE, tags="drawn")
        most = 1.15 * max([*self._late, 20, interval if np.isfinite(interval) else 0])
        y = [top + height - height * late / most for late in self._late]
        if np.isfinite(interval):
            frame = top + height - height * interval / most
            self.canvas.create_line(left, frame, left + SIDE, frame, fill=FAINT, dash=(4, 4), tags="drawn")
        if len(y) > 1:
            x = left + SIDE - SIDE * np.arange(len(y))[::-1] / LATENCIES
            self.canvas.create_line(*np.stack([x, y], 1).ravel().tolist(), fill=CALM, width=2, tags="drawn")
        self._text(left, top + height + 12, "capture to pose; dashed: a frame's time", FAINT, 8)

    def _bar(self, angle: Angle, left: int, y: int) -> None:
        start, end = left + 178, left + SIDE - 48

        def place(value: float) -> float:
            return start + (end - start) * (np.clip(value, angle.low, angle.high) - angle.low) / (angle.high - angle.low)

        self._text(left, y, angle.name, size=10)
        self.canvas.create_rectangle(start, y - 3, end, y + 4, fill=LINE, outline="", tags="drawn")
        if np.isfinite(angle.value):
            colour = BARS[angle.name.split()[0]]
            self.canvas.create_rectangle(place(0), y - 3, place(angle.value), y + 4, fill=colour, outline="", tags="drawn")
        self.canvas.create_line(place(0), y - 6, place(0), y + 7, fill=FAINT, tags="drawn")
        shown = f"{round(angle.value)}°" if np.isfinite(angle.value) else "–"
        self.canvas.create_text(left + SIDE, y, text=shown, fill=TEXT, font=(FONT, 10), anchor="e", tags="drawn")

    def _text(self, x: float, y: float, text: str, colour: str = TEXT, size: int = 11, bold: bool = False,
              width: int = SIDE) -> None:
        self.canvas.create_text(x, y, text=text, fill=colour, font=(FONT, size, "bold" if bold else "normal"), anchor="w", width=width,
                                tags="drawn")
