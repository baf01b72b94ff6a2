"""The outlets that settings ask for."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import ExitStack

from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.live.stream.outlet import Outlet, Outlets
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.network import host_and_port, is_loopback


def open_outlets(settings: OutletSettings) -> Outlets:
    """All that are asked for; what leaves this machine is said as a warning. Raises `SettingsError` where one cannot be had."""
    with ExitStack() as opened:
        made = [opened.push(maker(settings)) for field, maker in MAKERS.items() if getattr(settings, field) is not None]
        opened.pop_all()
        return Outlets(made)


def _osc(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.vmc import VmcOutlet

    made = VmcOutlet(*host_and_port(settings.osc or "", "osc"))
    if not made.sender.loopback:
        _warn(f"the person's joints are sent to {made.sender.address[0]}, unencrypted")
    return made


def _websocket(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.websocket import WebSocketOutlet

    host, port = host_and_port(settings.websocket or "", "websocket")
    made = WebSocketOutlet(host, port, [origin.strip() for origin in (settings.origin or "").split(",")])
    if not is_loopback(host):
        _warn(f"the person's joints are served at {host}: everybody who reaches this machine can have them")
    return made


def _lsl(settings: OutletSettings) -> Outlet:
    from shadowpuppet.live.stream.lsl import LslOutlet

    made = LslOutlet(settings.lsl or "", settings.lsl_scope)
    if settings.lsl_scope == "machine":
        _warn("the lab streaming layer listens in all networks of this machine: the stream is announced on this machine alone, but who "
              "knows its port can have the person's joints")
    else:
        _warn("the lab streaming layer announces the person's joints in the network, to everybody in it")
    return made


def _warn(message: str) -> None:
    warnings.warn(message, ShadowPuppetWarning, stacklevel=4)


MAKERS: dict[str, Callable[[OutletSettings], Outlet]] = {"osc": _osc, "lsl": _lsl, "websocket": _websocket}
"""How each is made, by the setting that asks for it."""
