"""A lock on a folder, held by one process at a time and given back by the system if that process is killed."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from shadowpuppet.errors import ShadowPuppetError, reason

LOCK = ".lock"
"""Name of the file that is locked, in the folder; it names the process that holds it, and is removed at the end."""


@contextlib.contextmanager
def locked(folder: Path, what: str) -> Iterator[None]:
    """Hold the lock of a folder. Raises `ShadowPuppetError` if another process, or this one, holds it; `what` it does there, such as `run`.

    A file system without locks is used without one.
    """
    path = folder / LOCK
    try:
        file = _opened(path, what)
    except OSError as error:
        raise ShadowPuppetError(f"{folder}: cannot be written ({reason(error)})") from None
    try:
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
        file.flush()
        yield
    finally:
        with contextlib.suppress(OSError):  # Windows removes no open file
            path.unlink()
        file.close()
        with contextlib.suppress(OSError):
            if os.name == "nt":
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
