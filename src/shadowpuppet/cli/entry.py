"""The entry point of the program: Ctrl-C ends it without a traceback even while the command line is being loaded, and SIGTERM (a
scheduler, a container) and SIGHUP (a closed terminal) end it in the same way."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn

from shadowpuppet.errors import BROKEN, INTERRUPTED
from shadowpuppet.output import guard_streams, output_failure, say

ENDING = ("SIGTERM", "SIGHUP")
"""Signals that end the program as Ctrl-C does; its exit code is then 128 and the signal's number."""


def main() -> NoReturn:
    """Run the command line and exit."""
    heard = list[int]()
    try:
        guard_streams()
        _handle_signals(heard)
        code = _run()
    except KeyboardInterrupt:
        say("interrupted", error=True)
        code = INTERRUPTED
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))  # the work is over: only threads are waited for
    code = output_failure(code)
    sys.exit(128 + heard[0] if heard and code == INTERRUPTED else code)


def _handle_signals(heard: list[int]) -> None:
    """Have `ENDING` raise `KeyboardInterrupt` once, and add their number to `heard`; ignored ones, as under nohup, stay so."""
    numbers = [number for name in ENDING if (number := getattr(signal, name, None)) is not None]
    ours = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]

    def end(number: int, frame: FrameType | None) -> None:
        for each in ours:
            signal.signal(each, signal.SIG_IGN)  # files are being completed
        heard.append(number)
        for stream in (1, 2):
            if number != signal.SIGTERM and os.isatty(stream):  # the terminal is gone: printing to it would fail
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        raise KeyboardInterrupt

    for number in ours:
        signal.signal(number, end)


def _run() -> int:
    try:
        from shadowpuppet.cli.app import run

        return run()  # which loads the module of the command
    except ImportError as error:
        cause = error.__cause__ if isinstance(error.__cause__, ImportError) else error
        if (cause.name or "").startswith("shadowpuppet"):
            raise  # a mistake of ours
        text = " ".join(str(cause).split())
        say(f"error: a library cannot be loaded ({text}); `python -m pip install --force-reinstall shadowpuppet` installs them all again",
            error=True)
        return BROKEN
