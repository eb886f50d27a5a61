"""Stopping a solver after so much CPU time: its own limits go by the clock, which counts other work, too."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_LOOK_S = 0.05


@contextmanager
def stopped_after(limit_s: float, stop: Callable[[], object]) -> Iterator[None]:
    """Call `stop`, again and again, once the process has used so much CPU time."""
    ended = threading.Event()
    end_s = time.process_time() + limit_s

    def watch() -> None:
        while not ended.wait(_LOOK_S):
            if time.process_time() > end_s:
                stop()

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
