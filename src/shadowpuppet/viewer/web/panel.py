"""The page's controls: timeline, view options, curves."""

from __future__ import annotations

import html
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.viewer.scene.scene import Chart
from shadowpuppet.viewer.web.curves import CurvePlot
from shadowpuppet.viewer.web.frustum_images import PictureMode
from shadowpuppet.viewer.web.scene_view import SceneView
from shadowpuppet.viewer.web.timeline import SPEEDS, Timeline

if TYPE_CHECKING:
    import viser

MAX_RATE = 30.0
"""Highest drawing rate, frames/s."""
FREE = "free"
"""Menu entry for looking through no camera."""
NAMES = {"estimate": "puppet", "truth": "truth", "other": "the other run", "mean": "mean postures"}
"""Names of figures by kind."""
PLOT_WIDTH = 320
"""Pixels."""
PLAY, PAUSE = "Play", "Pause"


class Panel:
    """The controls of a view; `follow` draws it until `stop`."""

    def __init__(self, server: viser.ViserServer, view: SceneView, clock: Callable[[], float] = time.monotonic) -> None:
        """Adds the controls that the scene needs."""
        self.server, self.view, self.scene = server, view, view.scene
        self.timeline = Timeline(self.scene.times, clock)
        self._changed, self._done = threading.Event(), False
        self._shown: int | None = None
        self._setting = False
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium", brand_color=(0, 92, 148))
        server.gui.set_panel_label("shadowpuppet")
        self.status = server.gui.add_markdown("")
        if len(self.scene.times) > 1:
            self._add_timeline()
        self._add_layers()
        self.plots = self._add_plots()
        self._add_facts()
        self._commands()

    def follow(self, done: Callable[[], bool] = lambda: False) -> None:
        """Keep drawing the frame and layers chosen by timeline and controls, until `stop` is called or `done` returns True."""
        while not (done() or self._done):
            began = time.monotonic()
            self.draw()
            playing = self.timeline.playing
            self._changed.wait(max(1 / MAX_RATE - (time.monotonic() - began), 0.001) if playing else 0.1)
            self._changed.clear()

    def draw(self) -> None:
        """Draw the current frame if it is new or options changed."""
        frame = self.timeline.tick()
        if frame == self._shown and not self._stale:
            return
        self._shown, self._stale = frame, False
        self._show_facts_of(frame)
        if self.view.reads_first:
            self.status.content += " · reading the films"
        slow = self.view.reads_first
        self.view.to(float(self.scene.times[frame]))
        if slow:
            self._show_facts_of(frame)

    def stop(self) -> None:
        """End `follow`."""
        self._done = True
        self._changed.set()

    # The timeline

    def _add_timeline(self) -> None:
        gui, last = self.server.gui, len(self.scene.times) - 1
        self.slider = gui.add_slider("frame", min=0, max=last, step=1, initial_value=0)
        self.play = gui.add_button(PLAY)
        self.steps = gui.add_button_group("step", ("|<", "<", ">", ">|"))
        self.speed = gui.add_dropdown("speed", tuple(f"{speed:g} x" for speed in SPEEDS), initial_value="1 x")
        self.loop = gui.add_checkbox("loop", initial_value=True)
        self.slider.on_update(self._slid)
        self.play.on_click(lambda _: self.toggle())
        self.steps.on_click(lambda event: self._step(event.target.value))
        self.speed.on_update(lambda _: setattr(self.timeline, "speed", float(self.speed.value.split()[0])))
        self.loop.on_update(lambda _: setattr(self.timeline, "loop", self.loop.value))

    def toggle(self) -> None:
        """Play or pause."""
        if self.timeline.playing:
            self.timeline.pause()
        else:
            self.timeline.play()
        self._changed.set()

    def _slid(self, event: Any) -> None:
        if event.client is None and self._setting:
            return  # the program moved it
        if self.slider.value != self._shown:
            self.timeline.pause()
            self.timeline.seek(int(self.slider.value))
            self._changed.set()

    def _step(self, how: str) -> None:
        if how in ("|<", ">|"):
            self.timeline.pause()
            self.timeline.seek(0 if how == "|<" else len(self.scene.times) - 1)
        else:
            self.timeline.step(-1 if how == "<" else 1)
        self._changed.set()

    def _commands(self) -> None:
        if len(self.scene.times) < 2:
            return
        gui = self.server.gui
        gui.add_command("Play or pause", hotkey="space").on_trigger(lambda _: self.toggle())
        gui.add_command("One frame back", hotkey="J").on_trigger(lambda _: self._step("<"))
        gui.add_command("One frame on", hotkey="L").on_trigger(lambda _: self._step(">"))

    # What is shown

    def _add_layers(self) -> None:
        gui, options = self.server.gui, self.view.options
        with gui.add_folder("Show"):
            for kind in dict.fromkeys(figure.kind for figure in self.scene.figures):
                self._box(NAMES[kind], options.figures[kind], lambda on, kind=kind: options.figures.__setitem__(kind, on))
            if any(figure.kind != "truth" for figure in self.scene.figures):
                self._box("see through", options.transparent, self.view.set_transparent)
            if self.scene.hull is not None:
                self._box("hull points", options.hull, lambda on: setattr(options, "hull", on))
            if self.scene.cameras:
                self._box("cameras", options.cameras, lambda on: setattr(options, "cameras", on))
                if any(each.images is not None for each in self.scene.cameras):
                    modes = tuple(mode.value for mode in PictureMode)
                    self._choice("in them", modes, options.pictures.value, lambda value: setattr(options, "pictures", PictureMode(value)))
                names = dict.fromkeys(each.camera.name for each in self.scene.cameras)
                self.through = self._choice("look through", (FREE, *names), FREE, self._through)
            if self.scene.has_uncertainty or self.scene.cloud is not None:
                self._box("uncertainty", options.uncertainty, lambda on: setattr(options, "uncertainty", on))
            if self.scene.cloud is not None:
                self._box("particles", options.particles, lambda on: setattr(options, "particles", on))

    def _box(self, name: str, value: bool, act: Callable[[bool], None]) -> None:
        box = self.server.gui.add_checkbox(name, initial_value=value)

        def changed(_: Any) -> None:
            act(box.value)
            self.again()

        box.on_update(changed)

    def _choice(self, name: str, values: tuple[str, ...], value: str, act: Callable[[str], None]) -> Any:
        choice = self.server.gui.add_dropdown(name, values, initial_value=value)

        def changed(_: Any) -> None:
            act(choice.value)
            self.again()

        choice.on_update(changed)
        return choice

    def again(self) -> None:
        """Ask for the current frame to be drawn again."""
        self._stale = True
        self._changed.set()

    _stale = False

    def _through(self, name: str) -> None:
        """Move all viewers to a camera, or back to the first viewpoint."""
        names = [each.camera.name for each in self.scene.cameras]
        n = names.index(name) if name in names else None
        self.view.look_through(n)
        for client in self.server.get_clients().values():
            with client.atomic():
                if n is None:
                    client.camera.up_direction = (0.0, 0.0, 1.0)
                    client.camera.position, client.camera.look_at = self.scene.viewpoint, self.scene.middle
                    client.camera.fov = np.radians(60)
                else:
                    frustum = self.view.frustums[n]
                    client.camera.position, client.camera.wxyz = frustum.centre, frustum.wxyz
                    client.camera.fov = 1.04 * frustum.undistort.fov

    # Curves

    def _add_plots(self) -> list[CurvePlot]:
        charts = self.scene.charts
        if not charts:
            return []
        first = charts[0]
        second = next((chart for chart in charts if chart.name.startswith("angles")), charts[-1])
        panel = self.server.gui.add_panel()
        with panel.add_tab("Curves"):
            plots = [CurvePlot(self.server, charts, chart) for chart in dict.fromkeys((first, second))]
        panel.float(x=15, y=-15, width=PLOT_WIDTH)
        return plots

    def _show_facts_of(self, frame: int) -> None:
        """Update status line, plots and controls for a frame."""
        now = float(self.scene.times[frame])
        words = [f"**{now:.2f} s**", f"frame {frame}"] if len(self.scene.times) > 1 else []
        for figure in self.scene.figures:
            n = figure.at(now) if figure.status is None else int(np.abs(figure.times - now).argmin())
            if n is not None and figure.status is not None:
                who = "" if figure.tint is None else f"{figure.name}: "
                words.append(who + str(figure.status[n]) + (f", overlap {figure.overlap[n]:.2f}" if figure.overlap is not None
                                                      and np.isfinite(figure.overlap[n]) else ""))  # fmt: skip
                words += [f"{' and '.join(limbs)} doubtful"] if figure.doubtful is not None and (limbs := figure.doubtful.named(n)) else []
        words += [f"{chart.name} {_value(chart, now)}" for chart in self.scene.charts if chart.name == "error" and _value(chart, now)]
        self.status.content = " · ".join(words)
        for plot in self.plots:
            plot.to(now)
        if len(self.scene.times) > 1:
            self._setting = True
            self.slider.value = frame
            self.play.label = PAUSE if self.timeline.playing else PLAY
            self._setting = False

    def _add_facts(self) -> None:
        gui = self.server.gui
        with gui.add_folder("About", expand_by_default=False):
            rows = "".join(f"<tr><td style='opacity:.6;padding-right:.8em;vertical-align:top'>{_plain(key)}</td>"
                           f"<td style='word-break:break-word'>{_plain(value)}</td></tr>" for key, value in self.scene.facts.items())
            notes = "".join(f"<p>{_plain(note)}</p>" for note in (*self.scene.notes, *self.scene.problems))
            gui.add_html(f"<div style='font-size:.8em;margin:.5em 1em'><table>{rows}</table>{notes}</div>")


def _value(chart: Chart, now: float) -> str:
    """The first curve's value now as text; empty if unknown."""
    values = next(iter(chart.curves.values()))
    n = int(np.abs(chart.times - now).argmin())
    return f"{values[n]:.0f} {chart.unit}" if np.isfinite(values[n]) else ""


def _plain(text: str) -> str:
    """Text escaped for HTML: names may come from other people's files."""
    return html.escape(str(text), quote=True)
