"""A lock on a folder, held by one process at a time and given back by the system if that process is killed."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from shadowpuppet.errors import ShadowPuppetError, reason

LOCK = ".lock"
"""Name of the file that is locked, in the folder; it names the process that holds it, and is removed at the end."""


class Lock(NamedTuple):
    """A lock that is held."""

    folder: Path
    what: str
    """Purpose of the lock, such as `run`."""
    file: BinaryIO
    """The open lock file. As long as it is open, no other file gets its number on the disk."""
    place: os.stat_result
    """Of the folder at the beginning."""

    @property
    def is_ours(self) -> bool:
        """Whether the folder's path still leads to the lock that is held: the folder is the same, and so is the lock file in it."""
        try:
            return os.path.samestat((self.folder / LOCK).stat(), os.fstat(self.file.fileno()))
        except OSError:
            return False

    def check(self) -> None:
        """Raise `ShadowPuppetError`, which says what happened, unless the lock `is_ours`."""
        if self.is_ours:
            return
        try:
            same = os.path.samestat(self.folder.stat(), self.place)
        except OSError:
            found = f"the folder was removed or renamed while the {self.what} went on"
        else:
            found = (f"{LOCK}, which keeps others out, was removed while the {self.what} went on, so that another one may have written here"
                     if same else f"another folder was put in the place of that in which the {self.what} went on")
        raise ShadowPuppetError(f"{self.folder}: {found}; the {self.what} ends here, is not complete, and writes nothing more")


@contextlib.contextmanager
def locked(folder: Path, what: str) -> Iterator[Lock]:
    """Hold the lock of a folder. Raises `ShadowPuppetError` if another process, or this one, holds it; `what` it does there, such as `run`.

    A file system without locks is used without one.
    """
    path = folder / LOCK
    try:
        file = _opened(path, what)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be written ({reason(error)})") from None
    lock = Lock(folder, what, file, folder.stat())
    try:
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
        file.flush()
        yield lock
    finally:
        ours = lock.is_ours  # else it is that of another process
        with contextlib.suppress(OSError):  # Windows removes no open file
            if ours:
                path.unlink()
        file.close()
        with contextlib.suppress(OSError):
            if ours and os.name == "nt":
                path.unlink()


def _opened(path: Path, what: str) -> BinaryIO:
    """The locked file."""
    while True:
        file = path.open("a+b")
        try:
            held = _lock(file)
            if not held:
                file.seek(0)
                owner = "".join(filter(str.isprintable, file.read(200).decode("utf-8", "replace")))
                raise ShadowPuppetError(f"{path.parent}: found another {what} at work in it ({owner or 'unknown process'}), expected its "
                                        "end first: wait for that, or choose another folder")
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                    return file
        except BaseException:
            file.close()
            raise
        file.close()  # its last holder has removed it since


def _lock(file: BinaryIO) -> bool:
    """Lock a file as long as it is open; False if another process has locked it."""
    try:
        import fcntl
    except ImportError:
        return _lock_on_windows(file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass  # a file system without locks
    return True


def _lock_on_windows(file: BinaryIO) -> bool:
    import msvcrt

    file.seek(1 << 20)  # a locked byte cannot be read by others: one behind the text
    try:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # pyright: ignore[reportAttributeAccessIssue]
    except OSError:
        return False
    return True
