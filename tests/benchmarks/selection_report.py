"""What both benchmarks of selection have in common: options, the machine in words, CPU time, where text goes."""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from planner_core.device import Device

T = TypeVar("T")


def options_of(description: str | None, *, work: float) -> argparse.Namespace:
    """Read the command line; work : limit of work unless told otherwise."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="write the report here besides printing it")
    parser.add_argument("--quick", action="store_true", help="small problems: does it run?")
    parser.add_argument("--work", type=float, default=work, help="limit of work, about seconds")
    return parser.parse_args()


def machine(device: Device) -> str:
    return (
        f"{device.label}, {os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, NumPy "
        f"{np.__version__}"
    )


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """What it returns, and its CPU time in seconds."""
    begin = time.process_time()
    result = call()
    return result, time.process_time() - begin


def publish(text: str, write: Path | None) -> None:
    """Print the report, and write it where told."""
    print(text)
    if write is not None:
        write.write_text(text, encoding="utf-8")
