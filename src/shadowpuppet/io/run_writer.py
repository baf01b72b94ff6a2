"""Writes run folders frame by frame (`io.run` describes them). One process at a time writes into a folder."""

from __future__ import annotations

import contextlib
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from importlib import metadata
from pathlib import Path
from typing import Any, BinaryIO, Self

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason
from shadowpuppet.io import checkpoint
from shadowpuppet.io.angle_conventions import write_angles
from shadowpuppet.io.contacts import write_contacts
from shadowpuppet.io.files.lock import LOCK, Lock, locked
from shadowpuppet.io.files.plain import for_toml, json_text, plain
from shadowpuppet.io.files.table import csv_line
from shadowpuppet.io.files.text import read_toml, write_whole
from shadowpuppet.io.inputs.earlier_run import check_folder, unmark
from shadowpuppet.io.inputs.inputs import NO_INPUTS, Inputs, Resuming
from shadowpuppet.io.inputs.same_run import INPUTS, check_same, write_inputs
from shadowpuppet.io.intervals import IntervalWriter
from shadowpuppet.io.motion.npz import write_motion_npz
from shadowpuppet.io.motion.table import run_headers, run_rows, write_raw
from shadowpuppet.io.people import person_folders, remove_people
from shadowpuppet.io.run import ANGLES, CONTACTS, RAW, TABLES
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.motion import Mode, Motion, MotionBuilder, MotionFrame

MADE = (RAW, CONTACTS, ANGLES, "motion.npz", "metrics.json", "overlay.mp4", "overlay.part.mp4")
"""Files written at the end of a run."""
FILES = (checkpoint.STATE, INPUTS, *MADE, *TABLES, checkpoint.FRAMES, "look.json", "person.toml", "calibration.toml")
"""Files of an earlier run that a new one in its folder replaces or removes. run.toml, which marks a run's folder, always stays."""
OWN_KEYS = ("complete", "frames", "body", "versions")
"""Keys of run.toml that the writer sets."""


class CompleteRun(ShadowPuppetError):
    """A run that is to go on has all of its frames."""


class RunWriter:
    """Writes a run: `with RunWriter(...) as run: run.write(frame)`; `run.metrics` may be filled until the end.

    The folder must be new, empty or an earlier run's, which is replaced by `begin`, at the latest when the first frame is written.
    Raises `ShadowPuppetError` for any other folder, for one in which another run is being written, and if it cannot be written; frames
    written before stay readable. It also does so, and the run is not complete, if the folder or its lock is taken away while the run goes
    on, or if one of its inputs changes.
    """

    def __init__(self, folder: str | Path, body_name: str, dof_names: Sequence[str], joint_names: Sequence[str],
                 info: Mapping[str, Any], resume: Resuming | Inputs = NO_INPUTS, of_group: bool = False) -> None:
        """`info`: entries of run.toml; dataclasses, arrays and paths are converted, values of None are left out. `resume`: whether an
        earlier run of the same `info` and inputs goes on from its checkpoint; inputs alone: no checkpoints are kept. `of_group`: whether it
        is the run of one of several people, with one checkpoint for all."""
        taken = set(info) & set(OWN_KEYS)
        if taken:
            raise ShadowPuppetError(f"info: found {min(taken)!r}, which the run's writer fills in itself")
        self.folder, self.metrics = Path(folder), dict[str, Any]()
        self.info = for_toml(plain(info, "info")) | {"body": body_name, "versions": versions()}
        self._motion = MotionBuilder(body_name, dof_names, joint_names)
        self._intervals = IntervalWriter(joint_names)
        self._modes = dict[float, Sequence[Mode]]()
        """Other places of limbs, by time: a motion does not keep them."""
        self._tables: Sequence[BinaryIO] = ()
        self._resume, self._inputs = (None, resume) if isinstance(resume, Inputs) else (resume, resume.inputs)
        self._earlier, self._stack = False, contextlib.ExitStack()
        self._lock: Lock
        self._before: list[MotionFrame] | None = None
        self._people, self._of_group = False, of_group

    def __enter__(self) -> Self:
        """Make the folder, and lock it. Raises `ShadowPuppetError` if it cannot be used."""
        with contextlib.ExitStack() as stack:
            with self._system_errors():
                self.folder.mkdir(parents=True, exist_ok=True)
                self._lock = stack.enter_context(locked(self.folder, "run"))
                self._earlier = check_folder(self.folder)
                probe = self.folder / "run.toml.part"  # fail now rather than after hours of tracking
                probe.touch()
                probe.unlink()
            if not self._earlier:
                self._write_info(complete=False)  # marks the folder as a run's before callers add files to it
            elif self._goes_on and not self._of_group:
                self._check_same(self._goes_on, read_toml(self.folder / "run.toml", FormatError))
            self._stack = stack.pop_all()
        return self

    @property
    def _goes_on(self) -> Resuming | None:
        """The resumption of an earlier run in the folder; None if the run begins at the start."""
        return self._resume if self._resume is not None and self._resume.goes_on and self._earlier else None

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Write the remaining files, after an error as far as possible. Raises `ShadowPuppetError` as `check` does."""
        trouble: ShadowPuppetError | None = None
        with self._stack:
            try:
                self.check()
            except ShadowPuppetError as error:
                trouble = error
            if is_ours := self._lock.is_ours:
                self._end(complete=kind is None and trouble is None)
            self._close()
        if is_ours and not self._tables and not self._earlier and not self._people:
            with contextlib.suppress(OSError):  # others put files into it
                self.folder.rmdir()
        if trouble is not None and (kind is None or issubclass(kind, ShadowPuppetError)):
            raise trouble  # a film that changes may be why it could not be read

    def track_as(self, body_name: str, dof_names: Sequence[str], joint_names: Sequence[str], settings: Mapping[str, Any]) -> None:
        """Write the motion of another body, which the film asks for, with the run's settings; before `begin`."""
        if body_name == self.info["body"]:
            return
        self.info |= {"body": body_name, "settings": for_toml(plain(settings, "settings"))}
        self._motion, self._intervals = MotionBuilder(body_name, dof_names, joint_names), IntervalWriter(joint_names)

    def check(self) -> None:
        """Raise `ShadowPuppetError` if the folder is not this run's any more, or if one of its inputs differs from what it was when the run
        began: in size or time of change."""
        self._lock.check()
        if changed := self._inputs.changed():
            raise ShadowPuppetError(f"{self.folder}: {changed} while the run went on: it is not complete, as its frames would be of two "
                                    "recordings; track it again with --force")

    def _end(self, complete: bool) -> None:
        """Write the remaining files."""
        if self._people:
            self._write_info(complete)
            if complete:
                self._remove_checkpoints(self.folder, *person_folders(self.folder).values())
        elif complete:
            self.begin()
            self._finish(complete=True)
        elif self._tables:
            with contextlib.suppress(ShadowPuppetError):
                self._finish(complete=False)
        else:
            self._leave()

    def _close(self) -> None:
        for table in self._tables:
            with contextlib.suppress(OSError):
                table.close()

    def _leave(self) -> None:
        """Remove the mark of a run without frames, unless callers put files into the folder."""
        with contextlib.suppress(OSError):
            if not self._earlier and {path.name for path in self.folder.iterdir()} <= {"run.toml", LOCK}:
                (self.folder / "run.toml").unlink()

    def hand_over(self, types: Iterable[type] = ()) -> Any:
        """Make the folder one of several people: only run.toml is written in it, with `people`; their runs go into folders of their own
        (`io.people`). Returns the state of the last `checkpoint` of an earlier run that goes on; else that is removed, and there is none.
        `types`: as in `resumed`."""
        found = checkpoint.read_checkpoint(self.folder, types) if self._goes_on else None
        self._people = True
        self.info["people"] = 0
        if found is not None:
            return found.state
        if self._earlier:
            unmark(self.folder)
            remove_people(self.folder, (*FILES, "run.toml"))
        with self._system_errors():
            for name in FILES:
                (self.folder / name).unlink(missing_ok=True)
        self._write_info(complete=False)
        self._keep_inputs()
        return None

    def adopt(self, only: RunWriter) -> None:
        """Make the run of the only one of several people that was followed this run, in this folder. Raises `ShadowPuppetError`."""
        with self._system_errors():
            for path in only.folder.iterdir():
                if path.name in (*FILES, RAW):
                    path.replace(self.folder / path.name)
            remove_people(self.folder, (*FILES, "run.toml", LOCK))
        self._motion = only._motion
        self.info = {key: value for key, value in only.info.items() if key != "person"}

    def resumed(self, types: Iterable[type]) -> tuple[Any, list[MotionFrame]] | None:
        """The state that the last `checkpoint` of the earlier run got, and its frames until then, from which `begin` goes on; None if the
        run begins at the start. `types`: the named tuples in the state. Raises `FormatError` for a damaged checkpoint."""
        found = checkpoint.read_checkpoint(self.folder, types) if self._goes_on else None
        return None if found is None else (found.state, self.go_on(found.frames))

    def go_on(self, number: int) -> list[MotionFrame]:
        """The first frames of the earlier run, from which `begin` goes on. Raises `FormatError` if there are fewer than this number."""
        frames = checkpoint.read_frames(self.folder, number, len(self._motion.dof_names), len(self._motion.joint_names),
                                        len(self._motion.limbs))
        for frame in frames:
            self._motion.append(frame)
        self._before = frames
        return frames

    def checkpoint(self, state: Any) -> None:
        """Keep a state from which the run can go on after the frames so far. Raises `ShadowPuppetError` if it cannot be written, and as
        `check` does: no checkpoint is of two recordings."""
        self.check()
        checkpoint.write_checkpoint(self.folder, checkpoint.Checkpoint(len(self._motion), state))

    def write(self, frame: MotionFrame) -> None:
        """Add a frame. Raises `ShadowPuppetError` if it does not fit the run, or cannot be written."""
        self.begin()
        self._lock.check()
        kept = self._motion.append(frame)
        self._keep_modes(kept)
        with self._system_errors():
            _append(self._tables, run_rows(kept), self._intervals.lines(kept), checkpoint.frame_bytes(kept))
            for table in self._tables:
                table.flush()  # so that a killed run keeps it

    def _keep_modes(self, frame: MotionFrame) -> None:
        """Keep a frame's other places of limbs, if it has any."""
        if frame.modes:
            self._modes[frame.time] = frame.modes

    def replace_modes(self, modes: Mapping[float, Sequence[Mode]]) -> None:
        """Replace the other places of limbs in some frames, by time (s), for `revise`."""
        self._modes |= modes

    def __len__(self) -> int:
        """Number of frames so far."""
        return len(self._motion)

    @property
    def motion(self) -> Motion:
        """The frames so far."""
        return self._motion.build()

    def revise(self, revised: Motion) -> None:
        """Replace the frames so far, at the end of a run; the tables as they were go to raw.csv. Raises `ShadowPuppetError` if something
        cannot be written; the tables stay as they were."""
        self.begin()
        self._lock.check()
        builder = MotionBuilder(revised.body_name, revised.dof_names, revised.joint_names)
        parts = [f"{name}.part" for name in (RAW, *TABLES)]
        try:
            with self._system_errors():
                write_raw(self.folder / parts[0], *(self.folder / name for name in TABLES[:2]))
                with ExitStack() as stack:
                    tables = [stack.enter_context((self.folder / part).open("wb")) for part in parts[1:]]
                    _append(tables, run_headers(builder.joint_names, builder.dof_names), self._intervals.header())
                    for frame in revised.frames():
                        kept = builder.append(frame._replace(modes=self._modes.get(frame.time, ())))
                        _append(tables, run_rows(kept), self._intervals.lines(kept))
                for table in self._tables:
                    table.close()
                for part in parts:
                    (self.folder / part).replace(self.folder / part.removesuffix(".part"))
                self._motion = builder
                self._tables = [(self.folder / name).open("ab") for name in TABLES]
        finally:
            for part in parts:
                with contextlib.suppress(OSError):
                    (self.folder / part).unlink(missing_ok=True)

    def begin(self) -> None:
        """Replace an earlier run and write the headers, or write the one that is `resumed` up to its checkpoint, once.

        The folder never holds files of two runs: the earlier one loses its mark of being complete first, and run.toml becomes the new
        one's when nothing of the earlier one is left.
        """
        if self._tables:
            return
        self._lock.check()
        if self._earlier:
            unmark(self.folder)
        with self._system_errors():
            for name in () if not self._earlier else FILES if self._before is None else MADE:
                (self.folder / name).unlink(missing_ok=True)
            if self._earlier:
                remove_people(self.folder, (*FILES, "run.toml"))
        if self._before is None:
            self._write_info(complete=False)
            self._keep_inputs()
        with self._system_errors():
            tables = [(self.folder / name).open("wb") for name in TABLES]
            self._tables = tables if self._resume is None else [*tables, checkpoint.open_frames(self.folder, self._before or [])]
            _append(self._tables, run_headers(self._motion.joint_names, self._motion.dof_names), self._intervals.header())
            for kept in self._before or []:
                self._keep_modes(kept)
                _append(self._tables, run_rows(kept), self._intervals.lines(kept))
            for table in self._tables:
                table.flush()

    def _finish(self, complete: bool) -> None:
        self._close()
        motion = self._motion.build()
        # The most important file first, in case the disk is full.
        write_motion_npz(self.folder / "motion.npz", motion)
        if (contacts := contacts_of(motion.table)) is not None:
            write_contacts(self.folder / CONTACTS, motion.times, contacts)
        write_angles(self.folder / ANGLES, motion.body_name, motion.dof_names)
        counts = {"complete": complete, "frames": len(motion), "status": motion.status_counts,
                  "limb_status": motion.limb_status_counts}
        write_metrics(self.folder, counts | self.metrics)
        self._write_info(complete)
        if complete and not self._of_group:
            self._remove_checkpoints(self.folder)

    @staticmethod
    def _remove_checkpoints(*folders: Path) -> None:
        """Remove what complete runs do not need any more."""
        for path in (folder / name for folder in folders for name in (checkpoint.STATE, checkpoint.FRAMES, INPUTS)):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)

    def _write_info(self, complete: bool) -> None:
        import tomli_w

        self._lock.check()
        head = {"complete": complete, "frames": len(self._motion)}
        write_whole(self.folder / "run.toml", tomli_w.dumps(head | self.info))

    def _keep_inputs(self) -> None:
        """Keep what the run's inputs hold, for a run that goes on."""
        if self._resume is not None and not self._of_group:
            write_inputs(self.folder, self._inputs)

    def _check_same(self, resume: Resuming, earlier: Mapping[str, Any]) -> None:
        """Raise `CompleteRun` if an earlier run is complete, `ShadowPuppetError` if it is another one than this."""
        import tomllib

        import tomli_w

        ours = tomllib.loads(tomli_w.dumps(self.info))
        check_same(self.folder, earlier, ours, resume.inputs, (self.folder / checkpoint.STATE).exists())
        if earlier["complete"]:
            raise CompleteRun(f"{self.folder}: the run is complete: nothing is left to be done")

    @contextlib.contextmanager
    def _system_errors(self) -> Iterator[None]:
        """Convert `OSError` to `ShadowPuppetError`, which states what was saved."""
        try:
            yield
        except OSError as error:
            frames = len(self._motion)
            kept = f"; the {frames} frames so far are in joints.csv and angles.csv" if frames else ""
            raise ShadowPuppetError(f"{self.folder}: the run cannot be written ({reason(error)}){kept}") from None


def _append(tables: Sequence[BinaryIO], rows: tuple[list[str], list[str]], intervals: str, exact: bytes = b"") -> None:
    """Append a row to joints.csv and angles.csv, lines to intervals.csv, and the frame to `checkpoint.FRAMES` if that is among them."""
    for table, content in zip(tables, (*(text.encode() for text in (*map(csv_line, rows), intervals)), exact)):
        table.write(content)


def write_metrics(folder: str | Path, metrics: Mapping[str, Any]) -> None:
    """Write metrics.json; NaN becomes null. Raises `ShadowPuppetError` if that fails."""
    write_whole(Path(folder) / "metrics.json", json_text(metrics, "metrics") + "\n")


def versions() -> dict[str, str]:
    """Versions of Python and the libraries on which results depend."""
    found = {"python": platform.python_version()}
    for name in ("shadowpuppet", "numpy", "scipy", "numba", "opencv-python-headless", "av"):
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found
