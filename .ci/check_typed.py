"""Whether a type checker sees the types of the installed wheel: python .ci/check_typed.py BASEDPYRIGHT PYTHON_WITH_THE_WHEEL."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

CODE = """
from shadowpuppet import Camera, read_run

joints: int = read_run("run").motion.joint_names  # wrong: a tuple of names
camera: Camera = Camera.from_fov((640, 480), 1.0)
"""

checker, python = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    Path(folder, "use.py").write_text(CODE)
    Path(folder, "pyrightconfig.json").write_text('{"typeCheckingMode": "standard"}')
    command = [checker, "--outputjson", "--pythonpath", python, "--project", folder]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
found = [(item["range"]["start"]["line"] + 1, item["message"]) for item in json.loads(done.stdout)["generalDiagnostics"]]
if [line for line, _ in found] != [4] or "tuple[str, ...]" not in found[0][1]:
    sys.exit(f"expected the one mistake, of a tuple[str, ...] in line 4, found {found}")
print("types are seen from the installed wheel")
