"""Whether an extra does what it is for, where the wheel and it are installed: PYTHON .ci/check_extra.py EXTRA. Imports no source."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path


def shadowpuppet(*tokens: object) -> str:
    """What a command prints; it must succeed."""
    program = Path(sys.executable).with_name("shadowpuppet")
    return subprocess.run([program, *map(str, tokens)], check=True, text=True, stdout=subprocess.PIPE).stdout


def formats(folder: Path) -> None:
    """A table of joints becomes Parquet, and comes back."""
    (folder / "in.csv").write_text("time,neck_x,neck_y,neck_z\n0.0,0.1,0.2,1.5\n0.1,0.1,0.25,1.5\n")
    shadowpuppet("convert", folder / "in.csv", folder / "joints.parquet", "--quiet")
    shadowpuppet("convert", folder / "joints.parquet", folder / "out.csv", "--quiet")
    assert "0.25" in (folder / "out.csv").read_text()


def report(folder: Path) -> None:
    """A plot is drawn."""
    from shadowpuppet.pipeline.batch.grid import make_grid
    from shadowpuppet.pipeline.batch.plot import plot_batch
    from shadowpuppet.pipeline.batch.summary import BatchRun
    from shadowpuppet.pipeline.batch.tasks import make_tasks

    (task,) = make_tasks([folder], make_grid().cases, [0])
    plot_batch([BatchRun(task, "done", metrics={"overlap": {"mean": 0.9}})], folder / "summary.png")
    assert (folder / "summary.png").stat().st_size > 1000


def live(folder: Path) -> None:
    """A program connects, and is told of a person."""
    import numpy as np
    from websockets.sync.client import connect

    from shadowpuppet.body.models import average_sizes, make_body
    from shadowpuppet.live.stream.choice import open_outlets
    from shadowpuppet.live.stream.outlet import StreamSubject
    from shadowpuppet.live.stream.settings import OutletSettings

    with open_outlets(OutletSettings(websocket="0")) as outlets:
        outlets.begin(StreamSubject(make_body("rounded", average_sizes("rounded", 1.75)), np.eye(4)))
        with connect(outlets.where.rpartition(" ")[2]) as connection:
            assert json.loads(connection.recv(10))["type"] == "begin"


def lsl(folder: Path) -> None:
    """A stream is announced; where pylsl brings no liblsl, that is said."""
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.live.stream.lsl import LslOutlet

    try:
        LslOutlet("check")
    except SettingsError as error:
        print(f"lsl: {error}")


def batch(folder: Path) -> None:
    """The scheduler's client can be loaded."""
    import distributed

    import shadowpuppet.pipeline.batch.cluster

    assert distributed.Client
    assert shadowpuppet.pipeline.batch.cluster


def view(folder: Path) -> None:
    """The viewer's page of a file is written; the extra installs nothing, and doctor names none."""
    (folder / "in.csv").write_text("time,neck_x,neck_y,neck_z\n0.0,0.1,0.2,1.5\n0.1,0.1,0.25,1.5\n")
    shadowpuppet("view", folder / "in.csv", "--html", folder / "page.html", "--quiet")
    assert "<canvas" in (folder / "page.html").read_text("utf-8")


CHECKS = {check.__name__: check for check in (formats, report, live, lsl, batch, view)}

if __name__ == "__main__":
    extra = sys.argv[1]
    with tempfile.TemporaryDirectory() as made:
        CHECKS[extra](Path(made))
    found = {finding["name"]: finding["state"] for finding in json.loads(shadowpuppet("doctor", "--json"))["findings"]}
    if found.get(f"extra {extra}", "works") != "works" and extra != "lsl":
        sys.exit(f"doctor says of the extra {extra}: {found[f'extra {extra}']}")
    print(f"extra {extra}: works")
