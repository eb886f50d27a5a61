"""Waiting for what other processes do, on a machine that does other things, too."""

import time
from collections.abc import Callable
from typing import Any

PATIENCE_S = 240.0


def until(happens: Callable[[], Any]) -> Any:
    """Return what is found once it is something."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        found = happens()
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError("it did not happen")
