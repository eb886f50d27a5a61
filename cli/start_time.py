"""How long the scan engine takes to start in this process: `python -m tlsplan.start_time` prints seconds.

From the first import of the library to the first results of free rays, a scan, visibility and patch mode: a driver is
checked before its first use, and kernels are compiled on the way, or fetched from the driver's cache.
`doctor` runs this in processes of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

#: A start that takes longer counts as failed.
_TIME_LIMIT_S = 600.0


@dataclass(frozen=True)
class Start:
    """The start of an engine: how long it took, what it is, its warnings, and what it computes wrongly, if anything."""

    seconds: float
    engine: str
    warnings: tuple[str, ...]
    wrong: str


def start() -> Start:
    """Start the engine that a plan would use, and let it scan a box whose ranges are known."""
    started_s = time.perf_counter()
    from planner_core.engine.open_engine import open_engine
    from planner_core.self_check import box, ranges_wrongly

    scene, patches = box()
    engine = open_engine(scene, patches)
    wrong = ranges_wrongly(engine, scene, patches)
    return Start(time.perf_counter() - started_s, f"{engine.name} on {engine.device}", engine.warnings, wrong)


def cached_s() -> float | None:
    """Seconds of a start in a fresh process with the caches as they are; None where it failed."""
    return _in_fresh_process({})


def first_use_s() -> float | None:
    """Seconds of a start in a fresh process that finds no compiled kernels; None where it failed."""
    with tempfile.TemporaryDirectory(prefix="tlsplan-start-", ignore_cleanup_errors=True) as home:
        # Drivers keep compiled kernels below the home or cache folder, pyopencl binaries of its own.
        empty = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "POCL_CACHE_DIR", "CUDA_CACHE_PATH", "TLSPLAN_CACHE"), home)
        return _in_fresh_process({**empty, "PYOPENCL_NO_CACHE": "1"})


def _in_fresh_process(variables: dict[str, str]) -> float | None:
    try:
        done = subprocess.run(
            [sys.executable, "-m", "tlsplan.start_time"],
            capture_output=True,
            text=True,
            check=False,
            timeout=_TIME_LIMIT_S,
            cwd=Path.cwd(),
            env={**os.environ, **variables},
        )
    except subprocess.TimeoutExpired:
        return None
    return float(done.stdout.split()[-1]) if done.returncode == 0 else None


if __name__ == "__main__":
    print(f"{start().seconds:.3f}")
