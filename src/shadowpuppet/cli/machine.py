"""The command about this machine."""

from __future__ import annotations

from contextlib import nullcontext

from shadowpuppet.cli.flags import AsJson
from shadowpuppet.errors import BROKEN


def doctor(*, as_json: AsJson = False) -> int:
    """Say what works on this machine, and how to mend what does not: libraries, compiled kernels, films, extras, browser, cameras.

    Exit code 1: something that tracking needs does not work.
    """
    import json
    from dataclasses import asdict

    from rich.console import Console

    from shadowpuppet.cli.doctor import examine, works
    from shadowpuppet.cli.doctor_table import doctor_table
    from shadowpuppet.cli.printing import show

    told = Console(stderr=True, quiet=as_json)
    with told.status("trying what works") if told.is_terminal else nullcontext():  # not `terminal`, which needs what may be broken
        found = examine()
    if as_json:
        print(json.dumps({"works": works(found), "findings": [asdict(finding) for finding in found]}, indent=1))
    else:
        show(*doctor_table(found))
    return 0 if works(found) else BROKEN
