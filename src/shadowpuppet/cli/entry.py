"""Where the program begins: Ctrl-C is heeded from here on, while the command line is still being loaded."""

from __future__ import annotations

import sys
from typing import NoReturn

from shadowpuppet.errors import BROKEN, INTERRUPTED


def main() -> NoReturn:
    """Run the command line and exit."""
    try:
        code = _run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        code = INTERRUPTED
    sys.exit(code)


def _run() -> int:
    try:
        from shadowpuppet.cli.app import run
    except ImportError as error:
        told = " ".join(str(error).split())
        print(f"error: a library cannot be loaded ({told}); `python -m pip install --force-reinstall shadowpuppet` gets them all anew",
              file=sys.stderr)  # fmt: skip
        return BROKEN
    return run()
