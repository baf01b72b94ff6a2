"""The command `view`: runs, recordings, priors and files to be looked at in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from shadowpuppet.cli.flags import OTHER, RUN, ViewFlags, options_from
from shadowpuppet.errors import SettingsError

if TYPE_CHECKING:
    from shadowpuppet.viewer.scene.show import Show

PAGE = Group("Page", sort_key=5.5)


def _switch(help: str, group: Group = RUN, name: str | None = None) -> Parameter:
    return Parameter(name=name, group=group, negative=(), show_default=False, help=help)


What = Annotated[Path, Parameter(help="Folder of a run or a recording, film (with --fov), prior (.npz), calibration, or file of motion: "
                                      ".amc, .bvh, .c3d, .csv, .npz, .parquet, .trc.")]
Other = Annotated[Path | None, Parameter(help="Another of these, to be shown beside it.")]
Beside = Annotated[Path | None, Parameter(group=RUN, help="The same as OTHER.")]
Apart = Annotated[float, Parameter(group=RUN, help="Metres between the two; 0: one over the other.")]
Truth = Annotated[Path | None, Parameter(group=RUN, help="Truth of a run, in place of its recording's.")]
RecordingOf = Annotated[Path | None, Parameter(group=RUN, help="Recording of a run, where it is not any more where it was.")]
Start = Annotated[float | None, Parameter(group=RUN, help="Seconds from which on it is shown.")]
End = Annotated[float | None, Parameter(group=RUN, help="Seconds up to which it is shown.")]
Html = Annotated[Path | None, Parameter(group=PAGE, help="Write one file that plays in a browser without this program, and end.")]
Pictures = Annotated[bool, _switch("Put the films' pictures into that file: faces and rooms. Silhouettes are in it without.", PAGE)]
Listen = Annotated[str, Parameter(group=PAGE, help="Address at which the page is served; any but this machine's own lets others see what "
                                                   "it shows.")]
Port = Annotated[int | None, Parameter(group=PAGE, help="Port of the page; 0 for any that is free. [default: 8610, or any that is free]")]
NoOpen = Annotated[bool, _switch("Open no browser.", PAGE, "--no-open")]
Config = Annotated[Path | None, Parameter(group=OTHER, help="File of settings, TOML, as `shadowpuppet settings` prints it.")]
Quiet = Annotated[bool, _switch("Show nothing but warnings and errors.", OTHER)]
ForView = Annotated[ViewFlags | None, Parameter(name="*")]


def view(what: What, other: Other = None, /, *, beside: Beside = None, apart: Apart = 1.5, truth: Truth = None,
         recording: RecordingOf = None, start: Start = None, end: End = None, html: Html = None, pictures: Pictures = False,
         listen: Listen = "127.0.0.1", port: Port = None, no_open: NoOpen = False, config: Config = None, quiet: Quiet = False,
         flags: ForView = None) -> None:  # fmt: skip
    """Look at a run, a recording, a prior or a file in space and time, on a page for a browser: the puppet, the truth, cameras and what
    they saw, hull points, particles, angles and errors. Ctrl-C ends it."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.viewer.web.server import check_viser

    check_viser()
    _check(other, beside, html, pictures, port)
    options = options_from(flags, config)
    with terminal(quiet) as shown:
        from shadowpuppet.viewer.scene.of_run import beside as side_by_side
        from shadowpuppet.viewer.scene.open_any import between, show_of
        from shadowpuppet.viewer.web.page import check_page, write_page
        from shadowpuppet.viewer.web.serve import first_wish

        if html is not None:
            check_page(html)
        shown.begin("reading")
        show = show_of(what, options, truth, recording)
        if (second := other or beside) is not None:
            show = side_by_side(show, show_of(second, options), apart)
        show = between(show, start, end)
        for lack in show.lacks:
            shown.warn(lack)
        if html is None:
            shown.stop()
            return _serve(show, listen, port, not no_open, quiet)
        write_page(html, show, first_wish(show, pictures), shown)
    if not quiet:
        print(f"made  {html}, {html.stat().st_size / 1e6:.1f} MB")


def _check(other: Path | None, beside: Path | None, html: Path | None, pictures: bool, port: int | None) -> None:
    """Raise `SettingsError` for flags that cannot be."""
    if pictures and html is None:
        raise SettingsError("flags: pictures: found it without --html, whose file it is about")
    if port is not None and not 0 <= port <= 65535:
        raise SettingsError(f"flags: port: found {port}, expected 0 to 65535")
    if other is not None and beside is not None:
        raise SettingsError(f"flags: beside: found {beside} and {other}, expected one of them")


def _serve(show: Show, listen: str, port: int | None, opening: bool, quiet: bool) -> None:
    """Serve the page until Ctrl-C."""
    import contextlib

    from shadowpuppet.network import open_browser
    from shadowpuppet.viewer.web.serve import look

    def told(address: str) -> None:
        if not quiet:
            print(f"{show.title}: to be seen at {address}; Ctrl-C ends it", flush=True)
        if opening:
            open_browser(address)

    with contextlib.suppress(KeyboardInterrupt):
        look(show, listen, port, told=told)
