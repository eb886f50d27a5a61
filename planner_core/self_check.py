"""What shows that an engine computes rightly: beams in a box whose ranges are known.

`python -m planner_core.self_check INDEX LABEL LANES` does it with the kernels of one OpenCL device, in packets of at
most so many lanes, in a process that may crash: `planner_core.device.check` asks for that before a device is used.
"""

from __future__ import annotations

import sys

import numpy as np

from planner_core.device.check import ALL_WELL, FAULT_FOUND
from planner_core.device.choice import open_unchecked
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import DeviceError, DeviceMemoryError
from planner_core.model import BeamTemplate, Patches, Scene
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches

#: Half the sides of the box, which the sensor is in the middle of.
_HALF_M = (1.0, 2.0, 3.0)


def box() -> tuple[Scene, Patches]:
    """A closed box about the origin."""
    x, y, z = _HALF_M
    corners = np.array([(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)])
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    scene = scene_from_arrays(corners, np.array(faces))
    return scene, make_patches(scene, max_area_m2=0.05)


def ranges_wrongly(engine: ScanEngine, scene: Scene, patches: Patches) -> str:
    """Say what an engine that holds the `box` gets wrong; empty: nothing.

    Free rays and a scan against the ranges that the box has; the patches that it sees against those of the scan, and
    in patch mode against all: from inside a convex room nothing is hidden.
    """
    rays = np.concatenate([np.eye(3), -np.eye(3)])
    hits = engine.cast_rays(np.zeros((6, 3)), rays, range_max_m=10.0)
    if not np.allclose(hits.range_m, 2 * _HALF_M, atol=1e-5):
        return "free rays end at wrong ranges"
    template = BeamTemplate(
        azimuth_rad=np.radians(np.arange(360.0)),
        elevation_rad=np.radians(np.arange(-80.0, 81.0)),
        range_min_m=0.0,
        range_max_m=10.0,
    )
    at = np.zeros((1, 3))
    scan = engine.scan(template, at)
    elevation, azimuth = np.meshgrid(template.elevation_rad, template.azimuth_rad, indexing="ij")
    along = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    )
    with np.errstate(divide="ignore"):
        expected_m = (np.array(_HALF_M) / np.abs(along)).min(axis=-1)
    if not np.allclose(scan.range_m[0], expected_m, rtol=1e-4):
        return "a scan has wrong ranges"
    seen = engine.visible_patches(template, at).patch
    if not np.array_equal(seen, np.unique(scan.patch[scan.patch >= 0])):
        return "the patches that a position sees are not those of its scan"
    in_patch_mode = PatchMode(engine, scene, patches).visible_patches(template, at, least_returns=0.0).patch
    return "" if np.isin(seen, in_patch_mode).all() else "patch mode misses patches that beams meet"


def main(index: str, label: str, lanes: str) -> int:
    """Check one device; return the exit code, and print what `planner_core.device.check` reads."""
    try:
        device = open_unchecked(int(index))
        if device.label != label:
            return _say(f"device {index} is {device.label} in a process of its own, expected {label}")
        device.max_lanes = min(int(lanes), device.max_lanes)
        scene, patches = box()
        wrong = ranges_wrongly(OpenCLEngine(scene, patches, device), scene, patches)
    except DeviceMemoryError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    except DeviceError as error:
        # The caller adds the remedy.
        return _say(str(error).partition("; take another device")[0].replace(f" on {label}", ""))
    if wrong:
        return _say(f"it gives wrong results: {wrong}")
    sys.stdout.write(f"{ALL_WELL}\n")
    return 0


def _say(what_is_wrong: str) -> int:
    sys.stdout.write(f"{' '.join(what_is_wrong.split())}\n")
    return FAULT_FOUND


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
