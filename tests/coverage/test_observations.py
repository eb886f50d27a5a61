"""Observations against values worked out by hand and plain loops over all sights; ground is seen from above only."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import times_meeting
from stages import visible_from

from planner_core.coverage.observations import (
    Observations,
    observations_in_batches,
    observations_meeting,
    observations_of_returns,
    observations_of_views,
    with_noise,
)
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.errors import RequirementError
from planner_core.model import (
    BeamTemplate,
    Floor,
    Paper,
    PlanSettings,
    PointLimits,
    Scanner,
    Scene,
    Survey,
    VisibilityMode,
)
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.independent_check import check_independently
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches, patch_triangles

SCANNER = Scanner(
    name="ball", title="looks all around", source="made up", range_min_m=0.1, range_max_m=20.0, n_azimuths=360,
    elevation_rad=tuple(np.deg2rad(np.arange(-90.0, 91.0))), instrument_height_min_m=1.0, instrument_height_max_m=2.0,
)  # fmt: skip
SETTINGS = PlanSettings(scanner=SCANNER, max_patch_area_m2=0.25)
SIDE_M, STOREY_M = 4.0, 3.0


def three_rows() -> Observations:
    """Patch 0: near but askew, and far but straight. 1: from the second position only. 2: unseen. 3: far."""
    return Observations(
        starts=np.array([0, 2, 4, 4]),
        patch=np.array([0, 3, 0, 1], dtype=np.int32),
        n_patches=4,
        spacing_m=np.array([0.010, 0.050, 0.040, 0.030]),
        range_m=np.array([2.0, 30.0, 9.0, 5.0]),
        incidence_rad=np.array([1.2, 0.3, 0.1, 0.5]),
    )


@pytest.mark.parametrize(
    ("asked", "meets"),
    [
        (PointLimits(), [True, True, False, True]),
        (PointLimits(range_m=5.0), [True, True, False, False]),
        (PointLimits(range_m=4.999), [True, False, False, False]),
        (PointLimits(incidence_rad=0.5), [True, True, False, True]),
        (PointLimits(spacing_m=0.02), [True, False, False, False]),
        # Patch 0 is near from one position and seen straight from the other, but not both from one.
        (PointLimits(range_m=5.0, incidence_rad=0.5), [False, True, False, False]),
        (PointLimits(range_m=9.0, incidence_rad=0.5, spacing_m=0.04), [True, True, False, False]),
        (PointLimits(spacing_m=0.0), [False, False, False, False]),
    ],
)
def test_patches_meet_limits_from_one_position_at_once(asked: PointLimits, meets: list[bool]) -> None:
    assert (times_meeting(three_rows(), asked) > 0).tolist() == meets


def test_noise_is_asked_for_at_the_reflectivity_that_comes_back() -> None:
    scanner = replace(
        load_scanner("hdl-64e"),
        range_noise=((1.0, 0.2, 0.004), (41.0, 0.2, 0.024), (1.0, 0.8, 0.001), (41.0, 0.8, 0.011)),
    )
    observations = replace(three_rows(), incidence_rad=np.array([0.0, np.arccos(0.25), np.arccos(0.625), 1.5]))
    noise = with_noise(observations, scanner, reflectivity=0.8).noise_m
    # Range 2 m at 0.8; 30 m at 0.2; 9 m at 0.5, halfway between; grazing: below the table.
    assert noise[0] == pytest.approx(0.00125)
    assert noise[1] == pytest.approx(0.0185)
    assert noise[2] == pytest.approx((0.008 + 0.003) / 2)
    assert np.isnan(noise[3])
    meets = observations_meeting(with_noise(observations, scanner, reflectivity=0.8), PointLimits(noise_m=0.002))
    assert meets.tolist() == [True, False, False, False]


def test_noise_that_nobody_worked_out_is_no_met_limit() -> None:
    with pytest.raises(RequirementError, match="with_noise"):
        observations_meeting(three_rows(), PointLimits(noise_m=0.002))
    with pytest.raises(RequirementError, match="reflectivity"):
        with_noise(three_rows(), load_scanner("hdl-64e"), reflectivity=0.0)


@pytest.mark.parametrize("name", ["spacing_m", "range_m", "incidence_rad", "noise_m"])
def test_limits_below_nothing_are_refused(name: str) -> None:
    for limit in (-1.0, np.nan):
        with pytest.raises(RequirementError, match=name):
            PointLimits(**{name: limit})


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_figures_are_those_of_plain_loops(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n_patches = 12
    rows = [np.flatnonzero(rng.random(n_patches) < 0.4).astype(np.int32) for _ in range(5)]
    starts = np.cumsum([0, *(row.size for row in rows)])
    patch = np.concatenate(rows)
    spacing, range_m, incidence = rng.uniform(0, 1, (3, patch.size)).round(1)
    observations = Observations(starts, patch, n_patches, spacing, range_m, incidence)
    limits = {name: rng.choice([None, 0.2, 0.5, 0.8]) for name in ("spacing_m", "range_m", "incidence_rad")}
    count = np.zeros(n_patches)
    for entry in range(patch.size):
        figures = {"spacing_m": spacing[entry], "range_m": range_m[entry], "incidence_rad": incidence[entry]}
        count[patch[entry]] += all(limits[name] is None or figures[name] <= limits[name] for name in limits)
    assert times_meeting(observations, PointLimits(**limits)).tolist() == count.tolist(), (seed, limits)


@pytest.fixture(scope="module")
def wall(build: SimpleNamespace, device) -> SimpleNamespace:
    """A wall of 4 x 2 m at x = 3 and a floor below, seen by 0.25 x 0.5 degrees from the origin."""
    vertices = np.array([[3, -2, -1], [3, 2, -1], [3, 2, 1], [3, -2, 1], [0.5, -2, -1], [0.5, 2, -1]], dtype=float)
    scene = build.scene_of(vertices, np.array([[0, 1, 2], [0, 2, 3], [4, 5, 1], [4, 1, 0]]))
    patches = make_patches(scene, max_area_m2=0.02)
    template = BeamTemplate(
        azimuth_rad=np.deg2rad(np.arange(0, 360, 0.25)),
        elevation_rad=np.deg2rad(np.arange(80, -80.1, -0.5)),
        range_min_m=0.0,
        range_max_m=20.0,
    )
    return SimpleNamespace(scene=scene, patches=patches, engine=OpenCLEngine(scene, patches, device), template=template)


def test_levels_of_a_wall_are_those_of_trigonometry_by_samples_and_by_beams(wall: SimpleNamespace) -> None:
    at = np.array([[0.0, 0.0, 0.0]])
    views = observations_of_views(PatchMode(wall.engine, wall.scene, wall.patches).see(wall.template, at))
    returns = wall.engine.patch_returns(wall.template, at, moments=True)
    beams = observations_of_returns(returns, wall.patches.area_m2)
    on_wall = wall.patches.triangle_of_patch[views.patch] < 2
    assert on_wall.sum() > 300
    # Every patch of the wall: 3 m away along x, so that cos(incidence) = 3 / range, and rows are r step / cos apart at
    # least, columns at most 0.25 degrees.
    np.testing.assert_allclose(np.cos(views.incidence_rad[on_wall]), 3.0 / views.range_m[on_wall], rtol=1e-5)
    step = np.deg2rad(0.5)
    assert (views.spacing_m[on_wall] >= 3.0 * step * 0.999).all()
    assert (views.spacing_m[on_wall] <= views.range_m[on_wall] ** 2 / 3.0 * step * 1.001).all()
    np.testing.assert_array_equal(views.patch, beams.patch)
    np.testing.assert_allclose(beams.range_m, views.range_m, rtol=0.03)
    np.testing.assert_allclose(beams.incidence_rad, views.incidence_rad, atol=0.03)
    # A cell of the raster on a surface is range^2 d azimuth cos(elevation) d elevation / cos(incidence) large.
    centre = patch_triangles(wall.scene, wall.patches)[beams.patch].mean(axis=1)
    elevation = np.arctan2(centre[:, 2], np.hypot(centre[:, 0], centre[:, 1]))
    cell = beams.range_m**2 * step * np.deg2rad(0.25) * np.cos(elevation) / np.cos(beams.incidence_rad)
    # By counting, a patch of n returns says it to some 1 / sqrt(n), which halves in the root.
    many = returns.n_returns >= 30
    assert many.sum() > 400
    ratio = (beams.spacing_m / np.sqrt(cell))[many]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.01)
    assert ((ratio > 0.8) & (ratio < 1.25)).all()


def test_returns_without_moments_are_refused(wall: SimpleNamespace) -> None:
    returns = wall.engine.patch_returns(wall.template, np.zeros((1, 3)))
    with pytest.raises(ValueError, match="moments=True"):
        observations_of_returns(returns, wall.patches.area_m2)


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
@pytest.mark.parametrize("mode", list(VisibilityMode)[1:])
@pytest.mark.parametrize("engine_name", ["opencl", "open3d"])
def test_ground_is_seen_from_above_alone(mode: VisibilityMode, engine_name: str, turned: bool) -> None:
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
    settings = replace(SETTINGS, scan_mode=VisibilityMode.PATCHES)
    station = GivenStation("S1", np.array([SIDE_M / 2, SIDE_M / 2, 1.5]), 1.5, "")
    plan = evaluate_stations(scene, settings, [station])
    assert [floor.elevation_m for floor in plan.survey.floors] == pytest.approx([0.0, 3.0], abs=1e-6)
    engine = open_engine(plan.survey.scene, plan.survey.patches)
    found = check_independently(plan, engine, n_points=5_000)
    assert abs(found.covered_m2.planned - found.covered_m2.judged) < 4 * found.covered_m2.error
    # The lower room with its ceiling, the other side of the sheet that is the upper room's ground.
    assert plan.coverage.covered_area_m2 == pytest.approx(2 * SIDE_M**2 + 4 * SIDE_M * STOREY_M, rel=0.02)
