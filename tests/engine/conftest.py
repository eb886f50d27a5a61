"""Small scenes made in place, and both engines on one device."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from planner_core.device import Device, faults, open_device
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import BeamTemplate, LoadReport, Patches, Scene, SceneSource
from planner_core.scene.patches import make_patches

Points = NDArray[np.float64]
Triangles = NDArray[np.int32]


def scene_of(vertices_m: Points, triangles: Triangles) -> Scene:
    """A scene of exactly these triangles: nothing welded, dropped or moved."""
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


def box_of(low: tuple[float, float, float], high: tuple[float, float, float]) -> tuple[Points, Triangles]:
    """A closed box of 12 triangles that share their 8 vertices."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return np.array(low) + corners * (np.array(high) - np.array(low)), np.array(triangles, dtype=np.int32)


def sphere_of(radius_m: float, n_rings: int, n_sides: int) -> tuple[Points, Triangles]:
    """A closed sphere about the origin; its triangles share vertices, two of them are poles."""
    polar = np.linspace(0, np.pi, n_rings + 1)[1:-1]
    around = np.arange(n_sides) * 2 * np.pi / n_sides
    rings = np.stack(
        [
            np.sin(polar)[:, None] * np.cos(around),
            np.sin(polar)[:, None] * np.sin(around),
            np.broadcast_to(np.cos(polar)[:, None], (polar.size, n_sides)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    top, bottom = len(rings), len(rings) + 1
    triangles = []
    for side in range(n_sides):
        nxt = (side + 1) % n_sides
        triangles.append((top, side, nxt))
        for ring in range(polar.size - 1):
            a, b = ring * n_sides + side, ring * n_sides + nxt
            triangles += [(a, a + n_sides, b), (b, a + n_sides, b + n_sides)]
        last = (polar.size - 1) * n_sides
        triangles.append((last + side, bottom, last + nxt))
    return radius_m * np.concatenate([rings, [[0, 0, 1], [0, 0, -1]]]), np.array(triangles, dtype=np.int32)


def clutter_of(n_boxes: int, *, seed: int) -> tuple[Points, Triangles]:
    """A room of 8 x 6 x 3 m with boxes strewn in it, some of which cross; the middle 1 m is free."""
    rng = np.random.default_rng(seed)
    parts = [box_of((-4, -3, 0), (4, 3, 3))]
    while len(parts) <= n_boxes:
        low = rng.uniform((-4, -3, 0), (3.5, 2.5, 2.5))
        high = low + rng.uniform(0.05, 0.8, 3)
        if np.any(low[:2] > 0.5) or np.any(high[:2] < -0.5):
            parts.append(box_of(tuple(low), tuple(high)))
    vertices = np.concatenate([v for v, _ in parts])
    triangles = np.concatenate([t + 8 * index for index, (_, t) in enumerate(parts)])
    return vertices, triangles.astype(np.int32)


def template_of(
    rows: int, columns: int, *, low_deg: float = -60.0, high_deg: float = 60.0, **ranges: float
) -> BeamTemplate:
    """An even template; rows from high to low."""
    return BeamTemplate(
        azimuth_rad=np.arange(columns) * (2 * np.pi / columns),
        elevation_rad=np.deg2rad(np.linspace(high_deg, low_deg, rows)),
        range_min_m=ranges.get("range_min_m", 0.0),
        range_max_m=ranges.get("range_max_m", np.inf),
    )


@pytest.fixture(scope="session")
def shapes() -> SimpleNamespace:
    """The makers of scenes and templates above."""
    return SimpleNamespace(
        scene_of=scene_of, box_of=box_of, sphere_of=sphere_of, clutter_of=clutter_of, template_of=template_of
    )


@pytest.fixture
def own_device(needs_opencl: None) -> Device:
    """A device whose memory nobody else counts against: no engine of another test is still to be collected."""
    return open_device()


@pytest.fixture
def no_collections(monkeypatch: pytest.MonkeyPatch) -> None:
    """None before smaller batches are tried: the tests' process holds a lot, and one takes half a second there."""
    monkeypatch.setattr(faults, "gc", SimpleNamespace(collect=lambda: None))


@pytest.fixture(scope="session")
def open_both(device: Device) -> Callable[[Scene, float], tuple[OpenCLEngine, Open3DEngine, Patches]]:
    """Both engines of a scene with patches of a given area."""

    def opened(scene: Scene, max_area_m2: float = 0.04) -> tuple[OpenCLEngine, Open3DEngine, Patches]:
        patches = make_patches(scene, max_area_m2=max_area_m2)
        return OpenCLEngine(scene, patches, device), Open3DEngine(scene, patches), patches

    return opened
