"""Where the program begins: Ctrl-C is heeded from here on, while the command line is still being loaded."""

from __future__ import annotations

import sys
from typing import NoReturn

from shadowpuppet.errors import INTERRUPTED


def main() -> NoReturn:
    """Run the command line and exit."""
    try:
        from shadowpuppet.cli import run

        code = run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        code = INTERRUPTED
    sys.exit(code)
