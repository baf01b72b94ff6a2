"""The page's controls: the timeline, what is shown, and curves that follow the time."""

from __future__ import annotations

import html
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.viewer.scene.show import Chart
from shadowpuppet.viewer.web.curves import Window
from shadowpuppet.viewer.web.pictures import Look
from shadowpuppet.viewer.web.stage import Stage
from shadowpuppet.viewer.web.timeline import SPEEDS, Timeline

if TYPE_CHECKING:
    import viser

FASTEST = 30.0
"""Frames that are drawn a second, at most."""
FREE = "free"
"""What is chosen where no camera is looked through."""
NAMES = {"estimate": "puppet", "truth": "truth", "other": "the other run", "mean": "mean postures"}
"""What figures are called by kind."""
CURVES = 320
"""Pixels that the curves are wide."""
PLAY, PAUSE = "Play", "Pause"


class Panel:
    """The controls of a stage. `follow` plays it until it is told to stop."""

    def __init__(self, server: viser.ViserServer, stage: Stage, clock: Callable[[], float] = time.monotonic) -> None:
        """Controls are there for what the show has."""
        self.server, self.stage, self.show = server, stage, stage.show
        self.timeline = Timeline(self.show.times, clock)
        self._changed, self._done, self._drawing = threading.Event(), False, threading.Lock()
        self._shown: int | None = None
        self._setting = False
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium", brand_color=(0, 92, 148))
        server.gui.set_panel_label("shadowpuppet")
        self.status = server.gui.add_markdown("")
        if len(self.show.times) > 1:
            self._add_timeline()
        self._add_layers()
        self.windows = self._add_windows()
        self._add_facts()
        self._commands()

    def follow(self, done: Callable[[], bool] = lambda: False) -> None:
        """Draw what the timeline and the controls ask for, until `done` says so."""
        while not (done() or self._done):
            began = time.monotonic()
            self.draw()
            playing = self.timeline.playing
            self._changed.wait(max(1 / FASTEST - (time.monotonic() - began), 0.001) if playing else 0.1)
            self._changed.clear()

    def draw(self, again: bool = False) -> None:
        """Draw the current frame, where it is not what is seen, or `again`."""
        with self._drawing:
            frame = self.timeline.tick()
            if frame == self._shown and not again and not self._stale:
                return
            self._shown, self._stale = frame, False
            self._tell(frame)
            if self.stage.reads_first:
                self.status.content += " · reading the films"
            slow = self.stage.reads_first
            self.stage.to(float(self.show.times[frame]))
            if slow:
                self._tell(frame)

    def stop(self) -> None:
        """End `follow`."""
        self._done = True
        self._changed.set()

    # The timeline

    def _add_timeline(self) -> None:
        gui, last = self.server.gui, len(self.show.times) - 1
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
        """Play, or stay."""
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
            self.timeline.seek(0 if how == "|<" else len(self.show.times) - 1)
        else:
            self.timeline.step(-1 if how == "<" else 1)
        self._changed.set()

    def _commands(self) -> None:
        if len(self.show.times) < 2:
            return
        gui = self.server.gui
        gui.add_command("Play or pause", hotkey="space").on_trigger(lambda _: self.toggle())
        gui.add_command("One frame back", hotkey="J").on_trigger(lambda _: self._step("<"))
        gui.add_command("One frame on", hotkey="L").on_trigger(lambda _: self._step(">"))

    # What is shown

    def _add_layers(self) -> None:
        gui, wish = self.server.gui, self.stage.wish
        with gui.add_folder("Show"):
            for kind in dict.fromkeys(figure.kind for figure in self.show.figures):
                self._box(NAMES[kind], wish.figures[kind], lambda on, kind=kind: wish.figures.__setitem__(kind, on))
            if any(figure.kind != "truth" for figure in self.show.figures):
                self._box("see through", wish.glass, self.stage.set_glass)
            if self.show.hull is not None:
                self._box("hull points", wish.hull, lambda on: setattr(wish, "hull", on))
            if self.show.eyes:
                self._box("cameras", wish.cameras, lambda on: setattr(wish, "cameras", on))
                if any(eye.seen is not None for eye in self.show.eyes):
                    looks = tuple(look.value for look in Look)
                    self._choice("in them", looks, wish.pictures.value, lambda value: setattr(wish, "pictures", Look(value)))
                names = dict.fromkeys(eye.camera.name for eye in self.show.eyes)
                self.through = self._choice("look through", (FREE, *names), FREE, self._through)
            if self.show.states_spread or self.show.cloud is not None:
                self._box("uncertainty", wish.spread, lambda on: setattr(wish, "spread", on))
            if self.show.cloud is not None:
                self._box("particles", wish.cloud, lambda on: setattr(wish, "cloud", on))

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
        """Draw the current frame anew, soon."""
        self._stale = True
        self._changed.set()

    _stale = False

    def _through(self, name: str) -> None:
        """Put everybody who looks behind a camera; or where they began."""
        names = [eye.camera.name for eye in self.show.eyes]
        n = names.index(name) if name in names else None
        self.stage.look_through(n)
        for client in self.server.get_clients().values():
            with client.atomic():
                if n is None:
                    client.camera.up_direction = (0.0, 0.0, 1.0)
                    client.camera.position, client.camera.look_at = self.show.viewpoint, self.show.middle
                    client.camera.fov = np.radians(60)
                else:
                    eye = self.stage.eyes[n]
                    client.camera.position, client.camera.wxyz, client.camera.fov = eye.centre, eye.wxyz, 1.04 * eye.plain.fov

    # Curves

    def _add_windows(self) -> list[Window]:
        charts = self.show.charts
        if not charts:
            return []
        first = charts[0]
        second = next((chart for chart in charts if chart.name.startswith("angles")), charts[-1])
        panel = self.server.gui.add_panel()
        with panel.add_tab("Curves"):
            windows = [Window(self.server, charts, chart) for chart in dict.fromkeys((first, second))]
        panel.float(x=15, y=-15, width=CURVES)
        return windows

    def _tell(self, frame: int) -> None:
        """Say and plot what is known of a frame."""
        now = float(self.show.times[frame])
        words = [f"**{now:.2f} s**", f"frame {frame}"] if len(self.show.times) > 1 else []
        for figure in self.show.figures:
            n = figure.at(now) if figure.status is None else int(np.abs(figure.times - now).argmin())
            if n is not None and figure.status is not None:
                words.append(str(figure.status[n]) + (f", overlap {figure.overlap[n]:.2f}" if figure.overlap is not None
                                                      and np.isfinite(figure.overlap[n]) else ""))  # fmt: skip
        words += [f"{chart.name} {_value(chart, now)}" for chart in self.show.charts if chart.name == "error" and _value(chart, now)]
        self.status.content = " · ".join(words)
        for window in self.windows:
            window.to(now)
        if len(self.show.times) > 1:
            self._setting = True
            self.slider.value = frame
            self.play.label = PAUSE if self.timeline.playing else PLAY
            self._setting = False

    def _add_facts(self) -> None:
        gui = self.server.gui
        with gui.add_folder("About", expand_by_default=False):
            rows = "".join(f"<tr><td style='opacity:.6;padding-right:.8em;vertical-align:top'>{_plain(key)}</td>"
                           f"<td style='word-break:break-word'>{_plain(value)}</td></tr>" for key, value in self.show.facts.items())
            notes = "".join(f"<p>{_plain(note)}</p>" for note in (*self.show.notes, *self.show.lacks))
            gui.add_html(f"<div style='font-size:.8em;margin:.5em 1em'><table>{rows}</table>{notes}</div>")


def _value(chart: Chart, now: float) -> str:
    """The first curve's value now, in words; nothing where it is not known."""
    values = next(iter(chart.curves.values()))
    n = int(np.abs(chart.times - now).argmin())
    return f"{values[n]:.0f} {chart.unit}" if np.isfinite(values[n]) else ""


def _plain(text: str) -> str:
    """Text that is read as itself: names are of files that others made."""
    return html.escape(str(text), quote=True)
