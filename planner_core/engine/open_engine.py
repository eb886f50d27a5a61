"""The choice of a scan engine: OpenCL where a device is usable, Open3D otherwise, with a warning.

Input a `Scene` and its `Patches`, output a `ScanEngine`. The engines are imported when first needed: each takes
a while.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from planner_core.device import DEVICE_VARIABLE, memory_allowed
from planner_core.engine.scan_engine import REACH_M, ScanEngine
from planner_core.errors import DeviceError, RequirementError, SceneError
from planner_core.model import Optics, Patches, Scene

if TYPE_CHECKING:
    from planner_core.device import Device

#: What `open_engine` accepts.
ENGINES = ("auto", "opencl", "open3d")


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


def engine_facts(engine: ScanEngine) -> tuple[str, ...]:
    """What an engine's results depend on, besides scene, patches and beams: its kind, device, driver and kernels."""
    device = None if engine.name == "open3d" else device_of(engine)
    return (type(engine).__name__, engine.device, *(() if device is None else device.identity().values()))


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
