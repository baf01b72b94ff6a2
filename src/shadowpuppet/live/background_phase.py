"""Work that takes seconds, done beside the pictures."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


def in_background(task: Callable[[], Result]) -> Callable[[], Result | None]:
    """Begin a task in a thread of its own, which ends with the program; the answer gives its result, None before that is there.

    An error of the task is raised where its result is asked for.
    """
    done: list[Result] = []
    failed: list[BaseException] = []

    def run() -> None:
        try:
            done.append(task())
        except BaseException as error:
            failed.append(error)

    def result() -> Result | None:
        if failed:
            raise failed[0]
        return done[0] if done else None

    threading.Thread(target=run, name="measuring", daemon=True).start()
    return result
