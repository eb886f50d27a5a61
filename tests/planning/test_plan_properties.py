"""Whole plans: recomputed by Open3D on the patches' own geometry, and what must not change them.

The recomputation shares nothing with our scanning but the beam angles and the positions: the patches are triangles of
their own there, so that neither our tree and kernels nor the numbering of patches take part.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest
from shared_plans import SharedPlan
from stages import find_positions

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.model import Greedy, Plan, PlanSettings, Requirements, Scene
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import patch_triangles

#: A third of the beams: Open3D scans from every candidate.
COARSE = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=1500),
    requirements=Requirements(coverage=0.9),
    grid_step_m=1.0,
    instrument_heights_m=(1.3,),
    max_patch_area_m2=0.1,
    method=Greedy(),
)


def seen_by_open3d(plan: Plan, positions_m: np.ndarray) -> np.ndarray:
    """(P,) bool: patches that any of the positions sees, by Open3D on a mesh of the patches themselves."""
    corners = patch_triangles(plan.survey.scene, plan.survey.patches).astype(np.float32)
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(
        o3d.core.Tensor(corners.reshape(-1, 3)),
        o3d.core.Tensor(np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)),
    )
    template = plan.survey.template
    elevation, azimuth = np.meshgrid(template.elevation_rad, template.azimuth_rad, indexing="ij")
    direction = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    ).reshape(-1, 3)
    seen = np.zeros(len(corners), dtype=bool)
    for position in positions_m:
        rays = np.hstack([np.broadcast_to(position, direction.shape), direction]).astype(np.float32)
        hits = caster.cast_rays(o3d.core.Tensor(np.ascontiguousarray(rays)))
        patch = hits["primitive_ids"].numpy()[hits["t_hit"].numpy() <= template.range_max_m]
        seen[patch] = True
    return seen


def recomputed_fraction(plan: Plan) -> float:
    """Covered share of the achievable area, scanned by Open3D.

    The candidates are those of the plan: to ask Open3D for them as well would test its rays through shared edges,
    which it lets slip through.
    """
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    places = find_positions(survey, plan.settings, engine, floors=tuple(range(len(survey.floors))))
    achievable = seen_by_open3d(plan, places.candidates.position_m)
    covered = seen_by_open3d(plan, np.stack([s.position_m for s in plan.stations]))
    area_m2 = survey.patches.area_m2
    return float(area_m2[covered & achievable].sum() / area_m2[achievable].sum())


def test_coverage_of_the_house_is_what_open3d_computes(house_on_map: SharedPlan) -> None:
    plan = house_on_map.plan
    assert abs(recomputed_fraction(plan) - plan.coverage.fraction_of_achievable) < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("duplex", marks=pytest.mark.campaign), "fzk-haus"])
def test_coverage_of_a_real_building_is_what_open3d_computes(name: str, real_scene: Callable[[str], Scene]) -> None:
    # All that Open3D is given returns beams; glass has its own oracle, tests/engine/test_traced_surfaces.py.
    plan = make_plan(replace(real_scene(name), optics_of_triangle=None), COARSE)
    assert abs(recomputed_fraction(plan) - plan.coverage.fraction_of_achievable) < 0.005


@pytest.mark.opencl
def test_both_engines_see_the_same_area_from_the_same_stations(house_on_map: SharedPlan) -> None:
    survey = house_on_map.plan.survey
    positions_m = np.stack([station.position_m for station in house_on_map.plan.stations])
    area_m2 = survey.patches.area_m2
    seen_m2 = {}
    for name in ("opencl", "open3d"):
        engine = open_engine(survey.scene, survey.patches, engine=name)
        patch = engine.visible_patches(survey.template, positions_m).patch
        seen_m2[name] = float(area_m2[np.unique(patch)].sum())
    assert seen_m2["opencl"] == pytest.approx(seen_m2["open3d"], rel=0.002)


def moved(scene: Scene, offset_m: tuple[float, float, float], *, quarter_turns: int) -> Scene:
    """The same triangles, turned about z and moved, brought to the local frame anew."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    vertices = scene.vertices_m @ np.linalg.matrix_power(turn, quarter_turns).T + np.array(offset_m)
    storeys = [replace(s, elevation_m=s.elevation_m + offset_m[2]) for s in scene.storeys]
    return scene_from_arrays(
        vertices,
        scene.triangles,
        element_of_triangle=scene.element_of_triangle,
        elements=scene.elements,
        storeys=storeys,
    )


@pytest.mark.slow
def test_a_quarter_turn_and_a_far_origin_change_no_figure() -> None:
    settings = replace(COARSE, max_patch_area_m2=0.3)
    scene = scenes_synthetic.build("two-rooms").scene
    here = make_plan(moved(scene, (0.0, 0.0, 0.0), quarter_turns=0), settings)
    there = make_plan(moved(scene, (500_000.0, 5_400_000.0, 300.0), quarter_turns=1), settings)
    assert there.survey.scene.offset_m.any()
    assert there.n_candidates == here.n_candidates
    assert len(there.stations) == len(here.stations)
    # Beams start at another azimuth after the turn, so patches at the edge of what is seen may differ.
    assert there.coverage.achievable_area_m2 == pytest.approx(here.coverage.achievable_area_m2, rel=0.01)


@pytest.mark.slow
def test_the_order_of_given_stations_changes_no_figure_and_more_stations_see_more(house_on_map: SharedPlan) -> None:
    scene = house_on_map.plan.survey.scene
    given = [GivenStation(s.id, s.position_m + scene.offset_m, None, None) for s in house_on_map.plan.stations[:6]]
    settings = replace(COARSE, grid_step_m=2.0, max_patch_area_m2=0.3)  # what is achievable takes part in none of it
    forward = evaluate_stations(scene, settings, given)
    backward = evaluate_stations(scene, settings, given[::-1])
    fewer = evaluate_stations(scene, settings, given[:4])
    assert (forward.times_seen == backward.times_seen).all()
    assert forward.coverage == backward.coverage
    assert fewer.coverage.covered_area_m2 < forward.coverage.covered_area_m2
    assert (fewer.times_seen <= forward.times_seen).all()
    assert all(np.diff(forward.coverage_curve) >= 0)


@pytest.mark.slow
def test_a_storey_without_slab_is_planned_on_its_elevation_with_a_warning() -> None:
    scene = scenes_synthetic.build("two-rooms").scene
    walls_only = np.array([e.kind != "IfcSlab" for e in scene.elements])[scene.element_of_triangle]
    bare = replace(
        scene, triangles=scene.triangles[walls_only], element_of_triangle=scene.element_of_triangle[walls_only]
    )
    plan = make_plan(bare, COARSE)
    assert [floor.origin for floor in plan.survey.floors] == ["storey-elevation"]
    assert any("slab" in warning for warning in plan.warnings)
    assert plan.coverage.fraction_of_achievable >= 0.9
    heights = [s.position_m[2] - plan.survey.floors[0].elevation_m for s in plan.stations]
    assert heights == pytest.approx([1.3] * len(heights))


@pytest.mark.slow
def test_every_puzzle_is_solved_with_no_more_stations_than_greedy_may_take() -> None:
    for name in ("box", "two-rooms", "closed-rooms"):
        synthetic = scenes_synthetic.build(name)
        assert synthetic.truth.n_stations is not None
        settings = replace(COARSE, scanner=replace(COARSE.scanner, range_max_m=20.0), grid_step_m=0.5)
        settings = replace(settings, requirements=Requirements(coverage=0.8))
        plan = make_plan(synthetic.scene, settings)
        assert plan.lower_bound <= len(plan.stations) <= 2 * synthetic.truth.n_stations, name
        assert plan.coverage.fraction_of_achievable >= 0.8
