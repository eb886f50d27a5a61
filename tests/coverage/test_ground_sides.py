"""Ground of slabs that are single planes, from the room above and from the one below."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stages import visible_from

from planner_core.coverage.observe import observations_in_batches
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Floor, Paper, PlanSettings, ScanBy, Scanner, Scene, Survey
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.independent_check import check_independently
from planner_core.scene.build import scene_from_arrays

SCANNER = Scanner(
    name="ball", title="looks all around", source="made up", range_min_m=0.1, range_max_m=20.0, n_azimuths=360,
    elevation_rad=tuple(np.deg2rad(np.arange(-90.0, 91.0))), instrument_height_min_m=1.0, instrument_height_max_m=2.0,
)  # fmt: skip
SETTINGS = PlanSettings(scanner=SCANNER, max_patch_area_m2=0.25)
SIDE_M, STOREY_M = 4.0, 3.0


def house(*, turned: bool) -> Scene:
    """Two rooms, one over the other: four walls of single planes, and level planes at 0, 3 and 6 m."""
    corners = [(x, y, z) for z in (0.0, 3.0, 6.0) for x, y in ((0, 0), (SIDE_M, 0), (SIDE_M, SIDE_M), (0, SIDE_M))]
    level = [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(3) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    walls = [
        triangle for k in range(4) for triangle in ((k, (k + 1) % 4, 8 + k), ((k + 1) % 4, 8 + (k + 1) % 4, 8 + k))
    ]
    triangles = np.array([*level, *walls], dtype=np.int32)
    return scene_from_arrays(np.array(corners), triangles[:, ::-1].copy() if turned else triangles)


def survey_of(scene: Scene, settings: PlanSettings = SETTINGS) -> Survey:
    survey = make_survey(scene, settings)
    z_m = scene.vertices_m[scene.triangles][:, :, 2] + scene.offset_m[2]
    bounds_m = np.array([[0.0, 0.0], [SIDE_M, SIDE_M]]) - scene.offset_m[:2]
    floors = tuple(
        Floor(f"F{k}", f"Level {k}", height - float(scene.offset_m[2]), SIDE_M**2,
              np.flatnonzero((z_m == height).all(axis=1)).astype(np.int32), bounds_m, "surface")
        for k, height in enumerate((0.0, STOREY_M))
    )  # fmt: skip
    return replace(survey, floors=floors)


def middle_m(scene: Scene, z_m: float) -> np.ndarray:
    return np.array([[SIDE_M / 2, SIDE_M / 2, z_m]]) - scene.offset_m


@pytest.mark.parametrize("turned", [False, True], ids=["as wound", "turned"])
@pytest.mark.parametrize("mode", list(ScanBy)[1:])
@pytest.mark.parametrize("engine_name", ["opencl", "open3d"])
def test_ground_is_seen_from_above_alone(mode: ScanBy, engine_name: str, turned: bool) -> None:
    scene = house(turned=turned)
    survey = survey_of(scene)
    engine = open_engine(survey.scene, survey.patches, engine=engine_name)
    upper = np.isin(survey.patches.triangle_of_patch, survey.floors[1].ground_triangles)
    settings = replace(SETTINGS, scan_mode=mode)
    at = np.concatenate([middle_m(scene, 1.5), middle_m(scene, 4.5)])
    for seen in (
        visible_from(survey, settings, engine, at),
        next(observations_in_batches(replace(survey, scan_mode=mode), engine, at)),
    ):
        below, above = np.split(seen.patch, seen.starts[1:-1])
        assert not upper[below].any()
        assert upper[above].sum() > 0.3 * upper.sum()
        assert below.size > 100  # walls and its own ground
    both = survey_of(scene, replace(SETTINGS, method=Paper()))
    engine = open_engine(both.scene, both.patches, engine=engine_name)
    upper = np.isin(both.patches.triangle_of_patch, both.floors[1].ground_triangles)
    assert upper[visible_from(both, settings, engine, at[:1]).patch].any()


def test_the_method_paper_counts_what_is_reached_from_either_side() -> None:
    scene = house(turned=False)
    assert not make_survey(scene, SETTINGS).as_in_paper
    assert make_survey(scene, replace(SETTINGS, method=Paper())).as_in_paper


def test_the_independent_check_agrees() -> None:
    scene = house(turned=False)
    settings = replace(SETTINGS, scan_mode=ScanBy.PATCHES)
    station = GivenStation("S1", np.array([SIDE_M / 2, SIDE_M / 2, 1.5]), 1.5, "")
    plan = evaluate_stations(scene, settings, [station])
    assert [floor.elevation_m for floor in plan.survey.floors] == pytest.approx([0.0, 3.0], abs=1e-6)
    engine = open_engine(plan.survey.scene, plan.survey.patches)
    found = check_independently(plan, engine, n_points=5_000)
    assert abs(found.covered_m2.told - found.covered_m2.judged) < 4 * found.covered_m2.error
    # The lower room with its ceiling, the other side of the sheet that is the upper room's ground.
    assert plan.coverage.covered_area_m2 == pytest.approx(2 * SIDE_M**2 + 4 * SIDE_M * STOREY_M, rel=0.02)
