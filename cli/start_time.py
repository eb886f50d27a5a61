"""How long the scan engine takes to start in this process: `python -m tlsplan.start_time` prints seconds.

From the first import of the library to the first results of free rays, a scan and visibility: drivers compile the
kernels on the way, or fetch them from their cache. `doctor` runs this in processes of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: A start that takes longer counts as failed.
_TIME_LIMIT_S = 600.0


def start() -> tuple[float, str, bool]:
    """Start the engine that a plan would use: seconds, what it is, and whether it ranges a box rightly."""
    started_s = time.perf_counter()
    import numpy as np

    from planner_core.model import BeamTemplate
    from planner_core.scan.engine import open_engine
    from planner_core.scene.build import scene_from_arrays
    from planner_core.scene.patches import make_patches

    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-2.0, 2.0) for z in (-3.0, 3.0)])
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    scene = scene_from_arrays(corners, np.array(faces))
    engine = open_engine(scene, make_patches(scene, max_area_m2=0.1))
    axes = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    hits = engine.cast_rays(np.zeros((3, 3)), axes, range_max_m=10.0)
    level = BeamTemplate(
        azimuth_rad=np.arange(4.0) * (np.pi / 2), elevation_rad=np.zeros(1), range_min_m=0.0, range_max_m=10.0
    )
    scanned = engine.scan(level, np.zeros((1, 3))).range_m[0, 0]
    seen = engine.visible_patches(level, np.zeros((1, 3)))
    right = bool(
        np.allclose(hits.range_m, [1.0, 2.0, 3.0], atol=1e-5)
        and np.allclose(scanned, [1.0, 2.0, 1.0, 2.0], atol=1e-5)
        and seen.patch.size == 4
    )
    return time.perf_counter() - started_s, f"{engine.name} on {engine.device}", right


def cached_s() -> float | None:
    """Seconds of a start in a fresh process with the caches as they are; None where it failed."""
    return _in_fresh_process({})


def first_use_s() -> float | None:
    """Seconds of a start in a fresh process that finds no compiled kernels; None where it failed."""
    with tempfile.TemporaryDirectory(prefix="tlsplan-start-", ignore_cleanup_errors=True) as home:
        # Drivers keep compiled kernels below the home or cache folder, pyopencl binaries of its own.
        empty = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "POCL_CACHE_DIR", "CUDA_CACHE_PATH"), home)
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
    print(f"{start()[0]:.3f}")
