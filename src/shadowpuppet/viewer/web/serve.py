"""A show served until it is told to end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from shadowpuppet.viewer.scene.show import Show
from shadowpuppet.viewer.web.panel import Panel
from shadowpuppet.viewer.web.pictures import Look
from shadowpuppet.viewer.web.server import address_of, close_server, open_server
from shadowpuppet.viewer.web.stage import Stage, Wish


def look(show: Show, listen: str = "127.0.0.1", port: int | None = None, wish: Wish | None = None,
         told: Callable[[str], None] = lambda address: None, done: Callable[[], bool] = lambda: False) -> None:
    """Serve a show's page until `done` says so, or Ctrl-C. `told` is called with its address once it is there.

    Raises `SettingsError` where the address or port cannot be had, `ShadowPuppetError` without viser.
    """
    server = open_server(listen, port)
    try:
        stage = Stage(server, show, wish or first_wish(show))
        stage.people(stage.time)
        panel = Panel(server, stage, time.monotonic)
        told(address_of(server))
        panel.follow(done)
    finally:
        close_server(server)


@contextmanager
def served(show: Show, wish: Wish, **more: int) -> Iterator[tuple[str, Panel]]:
    """Serve a show beside the program that asks for it: the page's address, and its controls. `more`: of `Stage`. Raises as `look`."""
    server = open_server(port=0)
    panel = Panel(server, Stage(server, show, wish, **more))
    thread = threading.Thread(target=panel.follow)
    thread.start()
    try:
        yield address_of(server), panel
    finally:
        panel.stop()
        thread.join()
        panel.stage.close()
        close_server(server)


def first_wish(show: Show, pictures: bool = True) -> Wish:
    """What is seen of a show at first: bodies seen through where a truth or an uncertainty is within them, hull points where nobody else is
    there, the pictures of films (or their silhouettes alone)."""
    kinds = {figure.kind for figure in show.figures}
    look = Look.PICTURE if pictures else Look.SILHOUETTE
    glass = "estimate" in kinds and ("truth" in kinds or show.states_spread)
    return Wish(glass=glass, hull=show.hull is not None and "estimate" not in kinds, pictures=look, spread=show.states_spread)
