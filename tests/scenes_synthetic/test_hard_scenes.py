"""Hole walls and hard scenes: what makes each of them hard is there, and all of them plan."""

from dataclasses import replace

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import BeamTemplate, PlanSettings, Requirements
from planner_core.plan import make_plan
from planner_core.scan.engine import open_engine
from planner_core.scan.patch_mode import PatchMode
from planner_core.scan.scanners import load_scanner
from planner_core.scene.patches import make_patches
from scenes_synthetic import hole_walls
from scenes_synthetic.model import SyntheticScene

COARSE = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=180),
    requirements=Requirements(coverage=0.6),
    grid_step_m=2.0,
    instrument_heights_m=(1.3,),
    max_patch_area_m2=1.0,
)


# ---------------------------------------------------------------------------------------------------- hole walls
@pytest.fixture(scope="module")
def hole_scene() -> SyntheticScene:
    return scenes_synthetic.build("hole-walls")


@pytest.mark.parametrize("engine_name", ["opencl", "open3d"])
def test_scan_from_the_court_sees_the_areas_of_similar_triangles(hole_scene: SyntheticScene, engine_name: str) -> None:
    scene = hole_scene.scene
    patches = make_patches(scene, max_area_m2=0.02)
    mode = PatchMode(open_engine(scene, patches, engine=engine_name), scene, patches)
    template = BeamTemplate(
        azimuth_rad=np.arange(60_000) * (2 * np.pi / 60_000),
        elevation_rad=np.linspace(np.pi / 2, -np.pi / 2, 30_001),
        range_min_m=0.0,
        range_max_m=100.0,
    )
    element = scene.element_of_triangle[patches.triangle_of_patch]
    for view in hole_scene.truth.views:
        seen = mode.see(template, np.array([view.station_m]))
        area_m2 = patches.area_m2[seen.patch]
        found = np.bincount(element[seen.patch], seen.share * area_m2, len(scene.elements))
        across = np.bincount(element[seen.patch], area_m2 * (seen.share < 1), len(scene.elements))
        for part, area, slack in zip(hole_scene.parts, found, 0.12 * across + 0.02, strict=True):
            exact_m2 = view.visible_area_m2.get(part.name, 0.0)
            assert abs(area - exact_m2) < slack, f"{part.name} at {view.station_m}: {area}, {exact_m2}"


def test_each_hole_shows_its_outer_wall_at_its_own_height_only(hole_scene: SyntheticScene) -> None:
    through = {
        view.station_m[2]: {part.split()[-1] for part in view.visible_area_m2 if part.startswith("Outer")}
        for view in hole_scene.truth.views
    }
    for side, height in hole_walls.HOLES_M.items():
        assert through[height] == {side}
    assert sorted(hole_walls.HOLES_M.values()) == [0.6, 1.1, 1.6, 2.1]


@pytest.mark.parametrize(("off_m", "sees"), [(0.32, True), (0.33, False)])
def test_a_hole_closes_0_325_m_above_and_below_its_height(hole_scene: SyntheticScene, off_m: float, sees: bool) -> None:
    engine = open_engine(hole_scene.scene, make_patches(hole_scene.scene, max_area_m2=10.0), engine="open3d")
    slopes = np.linspace(0.0, 0.5, 20_001)
    for sign, height in ((-1.0, 0.6), (1.0, 2.1)):  # past the lowest hole and past the highest
        way = {-1.0: (0.0, -1.0), 1.0: (-1.0, 0.0)}[sign]
        rays = np.column_stack([np.broadcast_to(way, (slopes.size, 2)), -sign * slopes])
        station = np.broadcast_to([0.0, 0.0, height + sign * off_m], rays.shape)
        hits = engine.cast_rays(station, rays, range_max_m=20.0)
        assert bool((hits.range_m > 3.5).any()) is sees


def test_hole_walls_plan(hole_scene: SyntheticScene) -> None:
    assert make_plan(hole_scene.scene, COARSE).coverage.fraction_of_achievable >= 0.6
