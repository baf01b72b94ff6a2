"""What the command line shows of several cameras before a run, in words and a table of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group, RenderableType

from shadowpuppet.cli.tables import pairs, plain_table
from shadowpuppet.pipeline.look import CameraLook, RigLook


def rig_look_table(look: RigLook) -> RenderableType:
    """What was found before the run."""
    return Group(pairs([("recording", look.recording), ("cameras", _cameras(look))]), "", _each_camera(look), "", pairs(_below(look)))


def _cameras(look: RigLook) -> str:
    count = f"{look.frames} sets" if look.frames else "sets not counted"
    return f"{len(look.cameras)}, {count} of pictures in step, {look.rate:.4g} a second"


def _each_camera(look: RigLook) -> RenderableType:
    table = plain_table("", ("camera", "pixels", "wide", "stands at, m", "person", "exact", "apart"), right=(2, 4, 5, 6))
    for camera, apart in zip(look.cameras, look.agreement.apart):
        place = " ".join(f"{value:.2f}" for value in camera.place)
        exact = "" if camera.exact_overlap is None else f"{camera.exact_overlap:.3f}"
        table.add_row(camera.name, _pixels(camera), f"{camera.fov:.0f}°", place, f"{100 * camera.quality.area:.1f} %", exact,
                      "" if apart is None else f"{apart:.1f} px")
    return table


def _pixels(camera: CameraLook) -> str:
    shown = f"{camera.size[0]} x {camera.size[1]}"
    return shown if camera.worked_size == camera.size else f"{shown}, as {camera.worked_size[0]} x {camera.worked_size[1]}"


def _below(look: RigLook) -> Iterator[tuple[str, str]]:
    backgrounds = sorted({camera.background.replace(camera.name, "<camera>") for camera in look.cameras})
    yield "background", "; ".join(backgrounds)
    keys = sorted({camera.key.split(":")[0] for camera in look.cameras} - {"none"})
    if keys:
        yield "keys", ", ".join(keys)
    if look.agreement.height is not None:
        yield "height", f"{look.agreement.height:.2f} m from end to end, as the cameras see it"
    if look.person is not None:
        yield "person", _person(look.person)


def _person(person: Mapping[str, Any]) -> str:
    said = [f"sizes from {person['source']}"] if "source" in person else []
    said += [f"overlaps the first silhouettes by {person['overlap']:.2f}"] if "overlap" in person else []
    said += [f"{1000 * person['residual']:.0f} mm from their hulls"] if person.get("residual") is not None else []
    return "; ".join(said) or "measured"
