"""The ends of a run: its options and folder checked before, and judged by what it states of itself after."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shadowpuppet.io.inputs.inputs import Resuming
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.io.prior import read_prior
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.pipeline.findings.look import Look, RigLook
from shadowpuppet.pipeline.findings.verdict import verdict_of_run
from shadowpuppet.pipeline.options import Options, check_used, plain_options
from shadowpuppet.pipeline.prepare import Kind
from shadowpuppet.pipeline.progress import Summary, evaluated, tracked, warn_of_left_out, warn_of_losses, warn_of_set_aside
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.subject import Before, Observation, State, average_body, floor_entry, joint_names


def check_options(options: Options, rig: Rig) -> None:
    """Raise `SettingsError` for options that have no effect on a rig, `FormatError` for a person or a prior that cannot be read, before the
    recording is examined."""
    check_used(options, rig.is_multiview)
    if options.person is not None:
        read_person(options.person, (options.multiview if rig.is_multiview else options.tracker).body)
    if options.prior is not None and rig.is_multiview:
        read_prior(options.prior)


def run_writer(rig: Rig, kind: Kind[State, Observation, Before], folder: str | Path, options: Options, resume: bool) -> RunWriter:
    """The writer of a run's folder; `resume`: an earlier run there goes on."""
    body, recording = average_body(getattr(options, kind.settings).body), rig.recording
    info = {"recording": recording.path.resolve(), "method": kind.name(options.preset, len(rig.cameras)),
            "cameras": list(rig.names) if rig.is_multiview else None, "settings": plain_options(options),
            "truth": recording.truth and recording.truth.resolve(), "begin": recording.begin or None, "end": recording.duration}
    return RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), info, Resuming(resume, rig.inputs))


def judge(writer: RunWriter, rig: Rig, look: Look | RigLook, person: Person, options: Options) -> dict[str, Any]:
    """Complete the run's entries: its floor, its errors and the verdict on it. Returns the errors and other metrics of the motion."""
    writer.info |= floor_entry(writer.motion, rig.cameras, person)
    writer.check()
    found, frames = evaluated(rig, writer.motion), (len(writer.motion), tracked(look.frames, options.every))
    verdict = verdict_of_run(look, writer.motion, writer.metrics.get("set_aside", ()), frames)
    writer.metrics |= found | {"verdict": verdict.plain()}
    return found


def summary(folder: str | Path, found: dict[str, Any], look: Look | RigLook) -> Summary:
    """The finished run in a folder, with warnings of what was lost and left out; `found`: metrics of its motion."""
    written = read_run(folder)
    metrics = written.metrics | found
    warn_of_losses(written.motion)
    warn_of_left_out(metrics.get("left_out", []))
    warn_of_set_aside(metrics.get("set_aside", []))
    return Summary(Path(folder), written.motion, metrics, look)
