"""What a scan engine is, and the choice of one: OpenCL where a device is usable, Open3D otherwise, with a warning.

Every engine keeps these rules, in the local frame and metres:

- Triangles are hit from both sides. The first surface along a beam ends it. In scans, glass lets beams pass and
  mirrors end them without a return (`planner_core.model.Optics`); free rays meet every surface.
- Vertices, origins and directions are float64 values rounded to float32 once; nothing is rounded twice.
- `range_min_m <= range <= range_max_m` is a return, both ends included. A surface nearer than `range_min_m` blocks the
  beam and gives no return.
- A miss is range NaN, triangle -1, patch -1, cosine NaN.
- The OpenCL engine is watertight: triangles are larger by the bound of rounding. A beam that hits nothing but such a
  margin, about 1 in 100 000 indoors, gets range and triangle but no patch, so that no hidden face counts as seen;
  docs/method/watertight.md has the exceptions. A position on a surface is blocked all round.
- The patch is that of `docs/method/patches.md` at the hit. Two triangles hit at one and the same float32 range: the
  lower number wins in the OpenCL engine; Open3D makes no promise.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner_core.device import DEVICE_VARIABLE, memory_allowed
from planner_core.errors import DeviceError, RequirementError, SceneError
from planner_core.model import (
    BeamTemplate,
    FloatArray,
    Int64Array,
    Optics,
    Patches,
    PatchReturns,
    RayHits,
    ScanBatch,
    Scene,
    Visibility,
)
from planner_core.progress import Progress, silent

if TYPE_CHECKING:
    from planner_core.device import Device

#: What `open_engine` accepts.
ENGINES = ("auto", "opencl", "open3d")
#: Farthest from the local origin that anything may lie. float32 has 24 bits: beyond 100 km a vertex is off by
#: millimetres and squares lose the edges; far beyond, the kernels' box tests overflow.
REACH_M = 1e5


class ScanEngine(Protocol):
    """Casts beams into one scene, which it holds in its own form."""

    name: str
    """`opencl` or `open3d`."""
    device: str
    """Where it runs, for the record."""
    warnings: tuple[str, ...]
    """One line each, for the user: a fallback, for example."""

    def cast_rays(
        self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float, through_glass: bool = False
    ) -> RayHits:
        """First hits of N free rays: origins (N, 3), directions (N, 3) of any length but zero; ranges are metres.

        Glass and mirrors are hit as all surfaces are; `through_glass`, glass that beams pass is not.

        Raises RequirementError where an origin or direction is not finite, a direction is zero, shapes disagree or the
        range is not positive.
        """
        ...

    def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
        """Scan from every one of positions (S, 3), the sensor's origin."""
        ...

    def visible_patches(
        self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
    ) -> Visibility:
        """Patches that the returns of a scan from each of positions (N, 3) lie on: the distinct values of `scan`.

        Positions stream through bounded memory, and the result does not depend on how. `progress` hears of it at least
        every 64 positions; whatever it raises ends the work, and the engine can be used again.
        """
        ...

    def patch_returns(
        self, template: BeamTemplate, positions_m: FloatArray, *, moments: bool = False, progress: Progress = silent
    ) -> PatchReturns:
        """Numbers of returns by patch of a scan from each of positions (N, 3), and moments on request.

        Streams as `visible_patches` does. The OpenCL engine gives the same bits whatever the batch, the tile and the
        number of cores; the two engines differ by rounding, docs/method/returns.md.
        """
        ...


def open_engine(scene: Scene, patches: Patches, *, engine: str = "auto", device: str | None = None) -> ScanEngine:
    """Prepare `scene` for scanning.

    Parameters
    ----------
    engine
        `opencl`, `open3d`, or `auto`: OpenCL, and Open3D with a line in `warnings` where no OpenCL device is usable.
    device
        OpenCL device by name or number, see `planner_core.device`; None takes the default one.

    Raises
    ------
    RequirementError
        Unknown engine, a device given to Open3D, or a wrong TLSPLAN_MEMORY.
    DeviceError
        `opencl`, or a device by name or by the variable TLSPLAN_DEVICE, is required and can't be had.
    SceneError
        The scene has no triangles, or vertices too far from the local origin for float32.
    """
    if engine not in ENGINES:
        raise RequirementError(f"engine: got {engine!r}, expected one of {', '.join(ENGINES)}")
    if engine == "open3d" and device is not None:
        raise RequirementError(f"device: got {device!r} with engine open3d, which has none; leave one of the two out")
    memory_allowed()  # a wrong one is refused now: selection, in the middle of a plan, would be the next to ask
    _check_scene(scene, patches)
    if engine == "open3d":
        return _open3d(scene, patches, ())
    try:
        return _opencl(scene, patches, device)
    except DeviceError as error:
        if engine == "opencl" or device is not None or os.environ.get(DEVICE_VARIABLE):
            raise  # OpenCL, or this device, is required: nothing else will do
        warning = f"no OpenCL device is usable, scanning with Open3D instead (slower): {error}"
        return _open3d(scene, patches, (warning,))


def device_of(engine: ScanEngine) -> Device | None:
    """The OpenCL device that an engine runs on, for other work on it; None where it runs on none."""
    from planner_core.engine.in_parts import PartedEngine
    from planner_core.engine.opencl import OpenCLEngine

    if isinstance(engine, PartedEngine):
        return engine.opened
    return engine.on_device[0] if isinstance(engine, OpenCLEngine) else None


def check_positions(positions_m: FloatArray) -> FloatArray:
    """Positions as (N, 3) float64, or RequirementError where they have another shape or are not finite."""
    positions = np.ascontiguousarray(positions_m, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise RequirementError(f"positions_m: got shape {positions.shape}, expected (N, 3); pass one row per position")
    if positions.size and not np.abs(positions).max() <= REACH_M:  # NaN compares false
        _refuse_position(positions)
    return positions


def _refuse_position(positions: FloatArray) -> None:
    """Say which row is not finite, or else which lies out of reach."""
    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise RequirementError(f"positions_m: row {row} is {positions[row]}, expected finite metres; leave it out")
    row = int(np.argmax((np.abs(positions) > REACH_M).any(axis=1)))
    raise RequirementError(
        f"positions_m: row {row} is {positions[row]}, expected less than 100 km from the local origin; "
        "check its unit and its order of coordinates"
    )


def check_rays(origins_m: FloatArray, directions: FloatArray, range_max_m: float) -> tuple[FloatArray, FloatArray]:
    """Origins and UNIT directions as (N, 3) float64, or RequirementError, see `ScanEngine.cast_rays`."""
    if not range_max_m > 0:
        raise RequirementError(f"range_max_m: got {range_max_m}, expected a positive range in metres or infinity")
    origins = check_positions(origins_m)
    rays = np.ascontiguousarray(directions, dtype=np.float64)
    if rays.shape != origins.shape:
        raise RequirementError(f"directions: got shape {rays.shape}, expected {origins.shape}; pass one row per ray")
    squared = np.einsum("ij,ij->i", rays, rays)
    odd = ~((squared > 1e-200) & (squared < 1e200))
    if odd.any():
        # Squares of huge or tiny components overflow or vanish: those rows are scaled by their largest first.
        rays = _scaled(rays, np.flatnonzero(odd))
        squared = np.einsum("ij,ij->i", rays, rays)
    return origins, rays / np.sqrt(squared)[:, None]


def _scaled(rays: FloatArray, rows: Int64Array) -> FloatArray:
    """Divide some directions by their largest component, or refuse them."""
    largest = np.abs(rays[rows]).max(axis=1)
    bad = rows[~(np.isfinite(largest) & (largest > 0))]
    if bad.size:
        row = int(bad[0])
        raise RequirementError(f"directions: row {row} is {rays[row]}, expected finite and not zero; leave it out")
    scaled = rays.copy()
    scaled[rows] /= largest[:, None]
    return scaled


def _check_scene(scene: Scene, patches: Patches) -> None:
    if scene.n_triangles == 0:
        raise SceneError(f"{scene.source.path}: no triangles to scan, expected at least one; check what was loaded")
    if scene.optics_of_triangle is not None and (scene.optics_of_triangle == Optics.PASSES).all():
        raise SceneError(
            f"{scene.source.path}: all of it is glass, expected a surface that returns beams; pass --glass return"
        )
    if patches.depth.size != scene.n_triangles:
        raise SceneError(
            f"patches are of {patches.depth.size} triangles, the scene has {scene.n_triangles}; make them of this scene"
        )
    reach_m = float(np.abs(scene.vertices_m).max())
    if not reach_m < REACH_M:
        raise SceneError(
            f"{scene.source.path}: a vertex is {reach_m:.3g} m from the local origin, expected less than 100 km; "
            "split the model or remove stray geometry"
        )


def _open3d(scene: Scene, patches: Patches, warnings: tuple[str, ...]) -> ScanEngine:
    from planner_core.engine.open3d import Open3DEngine

    return Open3DEngine(scene, patches, warnings=warnings)


def _opencl(scene: Scene, patches: Patches, device: str | None) -> ScanEngine:
    from planner_core.device import open_device
    from planner_core.engine.in_parts import PartedEngine
    from planner_core.engine.opencl import OpenCLEngine
    from planner_core.engine.parts import fits

    opened = open_device(device)
    # Of a scene with glass, free rays have a tree of their own.
    has_glass = scene.optics_of_triangle is not None and (scene.optics_of_triangle == Optics.PASSES).any()
    n_triangles = scene.n_triangles * (2 if has_glass else 1)
    return (OpenCLEngine if fits(opened, n_triangles) else PartedEngine)(scene, patches, opened)
