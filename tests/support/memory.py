"""The memory that reading a file takes, measured in a process of its own."""

from __future__ import annotations

import subprocess
import sys

import pytest

from shadowpuppet.threads import child_environment

CODE = """
import contextlib, resource, sys, warnings
from pathlib import Path
from shadowpuppet.errors import ShadowPuppetError
{imports}
warnings.simplefilter("ignore")
def read(path):
    with contextlib.suppress(ShadowPuppetError):
        ({call})(path)
most = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
read(Path(sys.argv[2]))
before = most()
read(Path(sys.argv[1]))
print((most() - before) * 1024 if sys.platform != "darwin" else most() - before)
"""


def memory_of(imports, call, path, small) -> int:
    """Bytes by which the process that reads a file grows; `small`: a small file of that kind, read before so that modules are loaded."""
    pytest.importorskip("resource")  # not on Windows
    command = [sys.executable, "-P", "-c", CODE.format(imports=imports, call=call), str(path), str(small)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=child_environment({}), check=True)
    return int(done.stdout)
