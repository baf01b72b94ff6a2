"""Opens the outlets selected by the settings."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack

from shadowpuppet.errors import warn
from shadowpuppet.live.stream.outlet import Outlet, Outlets
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.network import host_and_port, is_loopback


def open_outlets(settings: OutletSettings) -> Outlets:
    """Open all outlets that are set. Warns if data leave this machine. Raises `SettingsError` if one cannot be opened."""
    with ExitStack() as opened:
        outlets = [opened.push(open_one(settings)) for field, open_one in OPENERS.items() if getattr(settings, field) is not None]
        opened.pop_all()
        return Outlets(outlets)


def _osc(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.vmc import VmcOutlet

    outlet = VmcOutlet(*host_and_port(settings.osc or "", "osc"))
    if not outlet.loopback:
        warn(f"the person's joints are sent to {outlet.address}, unencrypted")
    return outlet


def _websocket(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.websocket import WebSocketOutlet

    host, port = host_and_port(settings.websocket or "", "websocket")
    outlet = WebSocketOutlet(host, port, [origin.strip() for origin in (settings.origin or "").split(",")])
    if not is_loopback(host):
        warn(f"the person's joints are served at {host}: everybody who reaches this machine can have them")
    return outlet


def _lsl(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.lsl import LslOutlet

    outlet = LslOutlet(settings.lsl or "", settings.lsl_scope)
    if settings.lsl_scope == "machine":
        warn("the lab streaming layer listens in all networks of this machine: the stream is announced on this machine alone, but who "
             "knows its port can have the person's joints")
    else:
        warn("the lab streaming layer announces the person's joints in the network, to everybody in it")
    return outlet


OPENERS: dict[str, Callable[[OutletSettings], Outlet]] = {"osc": _osc, "lsl": _lsl, "websocket": _websocket}
"""Opens each outlet, by the setting that selects it."""
