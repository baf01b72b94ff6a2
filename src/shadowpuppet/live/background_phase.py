"""Long tasks in a thread of their own, while pictures go on."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


def in_background(task: Callable[[], Result]) -> Callable[[], Result | None]:
    """Start a task in a daemon thread; the answer gives its result, None before it is ready.

    An error of the task is raised by the answer.
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
