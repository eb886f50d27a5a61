"""A small room and a triangle soup, opened with both engines."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import BeamTemplate, LoadReport, Scene, SceneSource
from planner_core.scene.patches import make_patches

_UNIT = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
_BOX = np.array([t for a, b, c, d in _FACES for t in ((a, b, c), (a, c, d))])


def scene_of(vertices_m: np.ndarray, triangles: np.ndarray) -> Scene:
    """A scene of exactly these triangles."""
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=np.ascontiguousarray(vertices_m, dtype=np.float64),
        triangles=np.ascontiguousarray(triangles, dtype=np.int32),
        element_of_triangle=np.zeros(len(triangles), dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(len(triangles)),
    )


def room_of(n_boxes: int, *, seed: int = 1) -> Scene:
    """A room of 4 x 3 x 2.5 m, its middle at the origin, with tilted boxes in its corners."""
    rng = np.random.default_rng(seed)
    parts = [_UNIT * [4.0, 3.0, 2.5] - [2.0, 1.5, 1.0]]
    for _ in range(n_boxes):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        at = rng.choice([-1.0, 1.0], 2) * rng.uniform([0.9, 0.7], [1.4, 1.0])
        parts.append([*at, rng.uniform(-0.7, 0.6)] + (_UNIT * rng.uniform(0.05, 0.6, 3)) @ turn)
    return scene_of(np.concatenate(parts), np.concatenate([_BOX + 8 * index for index in range(len(parts))]))


def template_of(rows: int, columns: int, *, range_max_m: float = 50.0) -> BeamTemplate:
    """An even template from 60 degrees down to -60."""
    return BeamTemplate(
        azimuth_rad=np.arange(columns) * (2 * np.pi / columns),
        elevation_rad=np.deg2rad(np.linspace(60, -60, rows)),
        range_min_m=0.0,
        range_max_m=range_max_m,
    )


@pytest.fixture(scope="session")
def rooms() -> SimpleNamespace:
    """The makers above."""
    return SimpleNamespace(scene_of=scene_of, room_of=room_of, template_of=template_of)


@pytest.fixture(scope="session")
def furnished(device: Device) -> SimpleNamespace:
    """A room with six boxes in it, patches of 0.1 m^2, both engines, and three positions in the free middle."""
    scene = room_of(6)
    patches = make_patches(scene, max_area_m2=0.1)
    return SimpleNamespace(
        scene=scene,
        patches=patches,
        opencl=OpenCLEngine(scene, patches, device),
        open3d=Open3DEngine(scene, patches),
        positions_m=np.array([[0.1, 0.2, 0.3], [-0.35, 0.1, 0.05], [0.2, -0.15, 0.6]]),
    )
