"""A box room of known elements on two floors' worth of names, both engines, and candidates in it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.model import (
    BeamTemplate,
    Element,
    Floor,
    LoadReport,
    PlanSettings,
    Requirements,
    Scene,
    SceneSource,
    Survey,
    VisibilityMode,
)
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.patches import make_patches

SIZE_M = np.array([8.0, 4.0, 2.5])
NAMES = ("North wall", "South wall", "East wall", "West wall", "Slab", "Ceiling")
KINDS = ("IfcWall", "IfcWall", "IfcWallStandardCase", "IfcWall", "IfcSlab", "IfcCovering")
OFFSET_M = np.array([1000.0, 2000.0, 0.0])


def box_scene() -> Scene:
    """A closed room, 8 x 4 x 2.5 m, corner at the local origin; an element a side, two triangles each."""
    x, y, z = SIZE_M
    corners = np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0], [0, 0, z], [x, 0, z], [x, y, z], [0, y, z]])
    sides = [(2, 3, 7, 6), (0, 1, 5, 4), (1, 2, 6, 5), (3, 0, 4, 7), (0, 1, 2, 3), (4, 5, 6, 7)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=corners,
        triangles=np.array(triangles, dtype=np.int32),
        element_of_triangle=np.repeat(np.arange(6, dtype=np.int32), 2),
        elements=tuple(Element(name=name, kind=kind, source_id=name) for name, kind in zip(NAMES, KINDS, strict=True)),
        storeys=(),
        offset_m=OFFSET_M,
        report=LoadReport(12),
    )


def template() -> BeamTemplate:
    """Half a degree either way, from 80 degrees up to 80 down."""
    return BeamTemplate(
        azimuth_rad=np.deg2rad(np.arange(0, 360, 0.5)),
        elevation_rad=np.deg2rad(np.arange(80, -80.1, -0.5)),
        range_min_m=0.1,
        range_max_m=50.0,
    )


def floor_of(index: int, name: str, scene: Scene) -> Floor:
    return Floor(
        id=f"F{index}",
        name=name,
        elevation_m=0.0,
        ground_area_m2=16.0,
        ground_triangles=np.array([8 + index], dtype=np.int32),
        bounds_m=np.array([[0.0, 0.0], [8.0, 4.0]]),
        origin="slab",
    )


@pytest.fixture(scope="session")
def box() -> SimpleNamespace:
    """The room as a survey with two floors: `West` counts the west wall and slab, `East` the other walls; ceiling none.

    engine: this machine's own. Nine candidates along and beside the middle, 1.5 m up.
    """
    scene = box_scene()
    patches = make_patches(scene, max_area_m2=0.08)
    floors = (floor_of(0, "West", scene), floor_of(1, "East", scene))
    survey = Survey(
        scene=scene,
        floors=floors,
        patches=patches,
        floor_of_triangle=np.array([1, 1, 1, 1, 1, 1, 0, 0, 0, 0, -1, -1], dtype=np.int32),
        template=template(),
        scanner=load_scanner("hdl-64e"),
        scan_mode=VisibilityMode.PATCHES,
        planned=(0, 1),
    )
    grid = np.stack(np.meshgrid([1.0, 4.0, 7.0], [1.0, 2.0, 3.0], indexing="ij"), axis=-1).reshape(-1, 2)
    return SimpleNamespace(
        scene=scene,
        survey=survey,
        engine=open_engine(scene, patches),
        open3d=Open3DEngine(scene, patches),
        positions_m=np.column_stack([grid + np.array([0.013, 0.017]), np.full(9, 1.5)]),
        element_of_patch=scene.element_of_triangle[patches.triangle_of_patch],
    )


@pytest.fixture(scope="session")
def settings_of():
    """Settings with requirements given by keyword; patches by samples unless said otherwise."""

    def make(*, scan_mode: str = "patches", scanner: str = "hdl-64e", **asked: object) -> PlanSettings:
        return PlanSettings(
            scanner=load_scanner(scanner), requirements=Requirements(**asked), scan_mode=scan_mode, grid_step_m=1.0
        )

    return make
