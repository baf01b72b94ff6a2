"""Whether a wheel holds the package, all of it and nothing else: python .ci/check_wheel.py WHEEL."""

from __future__ import annotations

import subprocess
import sys
import zipfile

wheel = sys.argv[1]
held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
info = {name.split(".dist-info/")[1] for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" in name}
tracked = subprocess.run(["git", "ls-files", "src"], capture_output=True, text=True, check=True).stdout.split()
expected = {name.removeprefix("src/") for name in tracked}
missing, foreign = sorted(expected - held), sorted(held - expected)
missing += sorted({"licenses/LICENSE", "entry_points.txt", "METADATA"} - info)
if missing or foreign:
    sys.exit(f"{wheel}: missing {missing}, not of the package {foreign}")
print(f"{len(held)} files in the wheel, all of src/ and nothing else")
