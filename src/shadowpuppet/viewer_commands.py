"""The command `view`: runs, recordings, priors and files to be looked at in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from shadowpuppet.flags import OTHER, RUN, ViewFlags, options_from

if TYPE_CHECKING:
    from shadowpuppet.viewer.show import Show

PAGE = Group("Page", sort_key=5.5)
ForView = Annotated[ViewFlags | None, Parameter(name="*")]


def view(what: Annotated[Path, Parameter(help="Folder of a run or a recording, film (with --fov), prior (.npz), calibration, or file of motion: "
                                              ".amc, .bvh, .c3d, .csv, .npz, .parquet, .trc.")],
         other: Annotated[Path | None, Parameter(help="Another of these, to be shown beside it.")] = None, /, *,
         beside: Annotated[Path | None, Parameter(group=RUN, help="The same.")] = None,
         apart: Annotated[float, Parameter(group=RUN, help="Metres between the two; 0: one over the other.")] = 1.5,
         truth: Annotated[Path | None, Parameter(group=RUN, help="Truth of a run, in place of its recording's.")] = None,
         recording: Annotated[Path | None, Parameter(group=RUN, help="Recording of a run, where it is not any more where it was.")] = None,
         start: Annotated[float | None, Parameter(group=RUN, help="Seconds from which on it is shown.")] = None,
         end: Annotated[float | None, Parameter(group=RUN, help="Seconds up to which it is shown.")] = None,
         html: Annotated[Path | None, Parameter(group=RUN, help="Write it as one file that plays in a browser without this program, and end.")]
         = None,
         pictures: Annotated[bool, Parameter(group=RUN, negative=(), show_default=False, help="Put the films' pictures into that file, too: "
                                                                                              "faces and rooms. Silhouettes are without it.")]
         = False,
         listen: Annotated[str, Parameter(group=PAGE, help="Address at which the page is served; any but this machine's own lets others see "
                                                           "what it shows.")] = "127.0.0.1",
         port: Annotated[int | None, Parameter(group=PAGE, help="Port of the page; 0 for any that is free. [default: 8610, or any that is "
                                                                "free]")] = None,
         no_open: Annotated[bool, Parameter(name="--no-open", group=PAGE, negative=(), show_default=False, help="Open no browser.")] = False,
         config: Annotated[Path | None, Parameter(group=OTHER, help="File of settings, TOML, as `shadowpuppet settings` prints it.")] = None,
         quiet: Annotated[bool, Parameter(group=OTHER, negative=(), show_default=False, help="Show nothing but warnings and errors.")] = False,
         flags: ForView = None) -> None:  # fmt: skip
    """Look at a run, a recording, a prior or a file, in space and time, on a page for a browser: the puppet, the truth, cameras and what they
    saw, hull points, particles, angles and errors. Ctrl-C ends it."""
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.terminal import terminal
    from shadowpuppet.viewer.opening import between, show_of
    from shadowpuppet.viewer.server import check_viser

    check_viser()
    if pictures and html is None:
        raise SettingsError("flags: pictures: found it without --html, whose file it is about")
    if port is not None and not 0 <= port <= 65535:
        raise SettingsError(f"flags: port: found {port}, expected 0 to 65535")
    if other is not None and beside is not None:
        raise SettingsError(f"flags: beside: found {beside} and {other}, expected one of them")
    options = options_from(flags, config)
    with terminal(quiet, nothing="nothing was written") as shown:
        shown.begin("reading")
        show = show_of(what, options, truth, recording)
        if (second := other or beside) is not None:
            from shadowpuppet.viewer.of_run import beside as both

            show = both(show, show_of(second, options), apart)
        show = between(show, start, end)
        for note in show.notes:
            shown.warn(note)
        if html is not None:
            from shadowpuppet.viewer.looking import first_wish
            from shadowpuppet.viewer.page import write_page

            write_page(html, show, first_wish(show, pictures), shown)
        else:
            shown.stop()
            _serve(show, listen, port, not no_open, quiet)
    if html is not None and not quiet:
        from shadowpuppet.tables import pairs
        from shadowpuppet.terminal import show as table

        table(pairs([("made", f"{html}, {html.stat().st_size / 1e6:.1f} MB")]))


def _serve(show: Show, listen: str, port: int | None, opening: bool, quiet: bool) -> None:
    """Serve the page until Ctrl-C."""
    import contextlib
    import webbrowser

    from shadowpuppet.display.choice import has_screen
    from shadowpuppet.viewer.looking import look

    def told(address: str) -> None:
        if not quiet:
            print(f"{show.title}: to be seen at {address}; Ctrl-C ends it", flush=True)
        if opening and has_screen():
            with contextlib.suppress(webbrowser.Error):
                webbrowser.open(address)

    with contextlib.suppress(KeyboardInterrupt):
        look(show, listen, port, told=told)
