"""What several workers of pytest-xdist do once: folders that their tests share, kernels that are compiled."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.lock import locked


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Wait until no other process is in here with the same folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as held:
        while True:
            try:
                held.enter_context(locked(folder, "test"))
                break
            except ShadowPuppetError:
                time.sleep(0.02)
        yield


def made_once(folder: Path, make: Callable[[Path], object]) -> Path:
    """A folder, which `make` fills with what tests share, if no process has done so; what a failure leaves is not used."""
    made, begun = folder / "made", folder / folder.name
    with alone(folder):
        if not made.exists():
            make(begun)
            made.touch()
    return begun


def compile_one_at_a_time() -> None:
    """Let no two processes compile the same kernel at the same time: the second waits, and reads what the first has kept.

    Numba looks for no other process: both would compile, and what one writes in the kernel's index could be lost, or be the other's.
    Numba's global lock is taken first: a kernel is compiled within the compilation of another, and two threads with one lock each would
    wait for each other.
    """
    found, here = Dispatcher.compile, set[str]()

    def compile(self: Dispatcher, signature):
        name, kept = f"{self.py_func.__module__}.{self.py_func.__qualname__}", self._cache.cache_path
        with global_compiler_lock:
            if kept is None or name in here:
                return found(self, signature)
            here.add(name)
            try:
                with alone(Path(kept, "locks", name)):
                    return found(self, signature)
            finally:
                here.remove(name)

    Dispatcher.compile = compile
