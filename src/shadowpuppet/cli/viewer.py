"""The command `view`: runs, recordings, priors and files in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from shadowpuppet.cli.flags import Config, Quiet, flag, flags_of, options_from, switch, unpacked
from shadowpuppet.errors import SettingsError
from shadowpuppet.output import say
from shadowpuppet.pipeline.options import Options

if TYPE_CHECKING:
    from shadowpuppet.viewer.scene.scene import Stage

    ViewFlags = Any
else:
    TRACKING = ("preset", "seed", "height", "distance", "body", "person", "prior", "masks", "label", "overlay", "smooth", "cutoff", "gaps",
                "facing", "appearance", "anyway")
    ViewFlags = unpacked(flags_of(Options, without=(*TRACKING, "start", "end")))
    """Options for looking at a recording."""

PAGE = Group("Page", sort_key=5.5)


def view(what: Annotated[Path, Parameter(help="Folder of a run or a recording, film (with --fov), prior (.npz), calibration, or file of "
                                              "motion: .amc, .bvh, .c3d, .csv, .npz, .parquet, .trc.")],
         other: Annotated[Path | None, Parameter(help="A second one, shown beside the first.")] = None, /, *,
         beside: Annotated[Path | None, flag("The same as OTHER.")] = None,
         apart: Annotated[float, flag("Metres between the two; 0: one over the other.")] = 1.5,
         truth: Annotated[Path | None, flag("Truth of a run, in place of its recording's.")] = None,
         recording: Annotated[Path | None, flag("Recording of a run, if it was moved.")] = None,
         start: Annotated[str | None, flag("Where to begin: 3.5 (seconds) or 120f (frames).")] = None,
         end: Annotated[str | None, flag("Where to end, likewise.")] = None,
         html: Annotated[Path | None, flag("Write one file that plays in a browser without this program, and stop.", PAGE)] = None,
         pictures: Annotated[bool, switch("Include the films' pictures in that file: faces and rooms. Silhouettes are always in it.",
                                          PAGE)] = False,
         listen: Annotated[str, flag("Address at which the page is served; with any but this machine's own, others can see what it shows.",
                                     PAGE)] = "127.0.0.1",
         port: Annotated[int | None, flag("Port of the page; 0 for any free one. [default: 8610, or any free one]", PAGE)] = None,
         no_open: Annotated[bool, switch("Open no browser.", PAGE, "--no-open")] = False,
         config: Config = None, quiet: Quiet = False, flags: ViewFlags = None) -> None:  # fmt: skip
    """Look at a run, a recording, a prior or a file in space and time, on a page for a browser: the puppet, the truth, cameras and their
    films, hull points, particles, angles and errors. Ctrl-C ends it."""
    from shadowpuppet.cli.terminal import terminal

    _check(other, beside, html, pictures, port)
    options = options_from(flags, config)
    with terminal(quiet) as listener:
        from shadowpuppet.viewer.scene.of_run import side_by_side
        from shadowpuppet.viewer.scene.open_any import cut_scene, open_scene
        from shadowpuppet.viewer.web.page import check_page, write_page

        if html is not None:
            check_page(html)
        listener.begin("reading")
        scene = open_scene(what, options, truth, recording)
        if (second := other or beside) is not None:
            scene = side_by_side(scene, open_scene(second, options), apart)
        scene = cut_scene(scene, *_span(scene, start, end))
        for problem in scene.problems:
            listener.warn(problem)
        if html is None:
            listener.stop()
            return _serve(scene, listen, port, not no_open, quiet)
        write_page(html, scene, pictures, listener)
    if not quiet:
        say(f"made  {html}, {html.stat().st_size / 1e6:.1f} MB")


def _span(scene: Stage, start: str | None, end: str | None) -> tuple[float | None, float | None]:
    """Seconds at which the part to be shown begins and ends; None for the scene's own."""
    import numpy as np

    from shadowpuppet.motion.interpolation import rate_of
    from shadowpuppet.video.moments import span_of

    rate = rate_of(scene.times) if len(scene.times) > 1 else np.nan
    begin, stop = span_of(start, end, rate, np.inf)
    return (None if start is None else begin), (None if end is None else stop)


def _check(other: Path | None, beside: Path | None, html: Path | None, pictures: bool, port: int | None) -> None:
    """Raise `SettingsError` for flags that do not go together."""
    if pictures and html is None:
        raise SettingsError("flags: pictures: found it without --html, whose file it is about")
    if port is not None and not 0 <= port <= 65535:
        raise SettingsError(f"flags: port: found {port}, expected 0 to 65535")
    if other is not None and beside is not None:
        raise SettingsError(f"flags: beside: found {beside} and {other}, expected one of them")


def _serve(scene: Stage, listen: str, port: int | None, opening: bool, quiet: bool) -> None:
    """Serve the page until Ctrl-C."""
    import contextlib

    from shadowpuppet.network import open_browser
    from shadowpuppet.viewer.web.serve import serve_scene

    def ready(address: str) -> None:
        if not quiet:
            say(f"{scene.title}: to be seen at {address}; Ctrl-C ends it")
        if opening:
            open_browser(address)

    with contextlib.suppress(KeyboardInterrupt):
        serve_scene(scene, listen, port, ready)
