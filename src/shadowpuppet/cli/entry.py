"""The entry point of the program: Ctrl-C ends it without a traceback even while the command line is being loaded."""

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

        return run()  # which loads the module of the command
    except ImportError as error:
        cause = error.__cause__ if isinstance(error.__cause__, ImportError) else error
        if (cause.name or "").startswith("shadowpuppet"):
            raise  # a mistake of ours
        text = " ".join(str(cause).split())
        print(f"error: a library cannot be loaded ({text}); `python -m pip install --force-reinstall shadowpuppet` gets them all anew",
              file=sys.stderr)  # fmt: skip
        return BROKEN
