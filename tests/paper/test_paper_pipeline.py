"""The method paper's pipeline end to end on small rooms: searches that improve, selections that meet what is asked."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components
from slow_cases import all_slow_but
from stages import tripods_of

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import Candidates, Paper, PlanSettings, Requirements, Survey
from planner_core.model.methods import GeneticSettings
from planner_core.model.options import method_of
from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.overlap_repair import station_overlaps
from planner_core.paper.pipeline import find_pool
from planner_core.paper.point_distribution import PointDistribution
from planner_core.planning.plan import plan_survey
from planner_core.positions.ground_surface import GroundSurface
from planner_core.scanner.load_scanner import load_scanner

SHORT = Paper(spatial=SearchSettings(max_iterations=4, step_m=0.2))
SETTINGS = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=180),
    requirements=Requirements(coverage=0.9),
    method=SHORT,
    grid_step_m=1.0,
    instrument_heights_m=(1.0, 1.5),
    max_patch_area_m2=0.3,
)


def opened(scene: str, settings: PlanSettings = SETTINGS) -> tuple[Survey, ScanEngine]:
    survey = make_survey(scenes_synthetic.build(scene).scene, settings)
    return survey, open_engine(survey.scene, survey.patches)


def pool_of(survey: Survey, settings: PlanSettings, engine: ScanEngine) -> Candidates:
    paper = settings.seeded_method
    assert isinstance(paper, Paper)
    return find_pool(tripods_of(survey, settings, engine), paper, seed=settings.seed)


@pytest.mark.parametrize(
    "search", ["ts", pytest.param("ls", marks=pytest.mark.slow), pytest.param("sa", marks=pytest.mark.slow)]
)
def test_plan_by_the_papers_pipeline_meets_the_requirement(search: str) -> None:
    settings = replace(SETTINGS, method=replace(SHORT, search=search))
    survey, engine = opened("l-room", settings)
    plan = plan_survey(survey, settings, engine)
    assert plan.coverage.meets(0.9)
    assert all(coverage.meets(0.9) for coverage in plan.coverage_by_floor)
    assert plan.lower_bound <= len(plan.stations) < 20
    again = plan_survey(survey, settings, engine)
    assert [s.position_m.tolist() for s in again.stations] == [s.position_m.tolist() for s in plan.stations]


@pytest.mark.slow
def test_repair_brings_every_circle_to_the_required_overlap() -> None:
    base = replace(SETTINGS, requirements=Requirements(coverage=0.8, overlap=0.6))
    fast = Paper(search="none", overlap_radius_m=2)
    survey, engine = opened("corridor-comb", base)
    found = {
        word: plan_survey(survey, replace(base, method=replace(fast, repair=word == "yes")), engine)
        for word in ("no", "yes")
    }
    before, after = found["no"].stations, found["yes"].stations
    kept = {tuple(station.position_m) for station in before}
    assert kept < {tuple(station.position_m) for station in after}
    position_m = np.array([station.position_m for station in after])
    assert station_overlaps(position_m, radius_m=2.0).min() >= 0.6
    near = np.linalg.norm(position_m[:, None, :2] - position_m[None, :, :2], axis=2) < 4.0
    assert connected_components(near)[0] == 1


@pytest.mark.slow
def test_improved_positions_are_better_than_their_starts_and_admissible() -> None:
    survey, engine = opened("l-room")
    none = replace(SETTINGS, method=Paper(search="none"))
    starts = pool_of(survey, none, engine)
    only = replace(SETTINGS, method=replace(SHORT, pool="improved", search="ls"))
    improved = pool_of(survey, only, engine)
    judge = PointDistribution(survey.scene, survey.patches, engine)
    before = judge.of(survey.template, starts.position_m).f2_m2
    after = judge.of(survey.template, improved.position_m).f2_m2
    assert after.min() <= before.min()
    assert after.mean() < before.mean()
    ground_m = GroundSurface(survey, survey.floors[0]).below(improved.position_m)
    np.testing.assert_allclose(improved.position_m[:, 2] - ground_m, improved.instrument_height_m)
    assert ((improved.instrument_height_m > 0.9) & (improved.instrument_height_m < 1.6)).all()
    both = replace(SETTINGS, method=replace(SHORT, search="ls"))
    pool = pool_of(survey, both, engine)
    rows = {tuple(row) for row in pool.position_m}
    assert len(rows) == len(pool.position_m)
    assert rows == {tuple(row) for row in np.concatenate([starts.position_m, improved.position_m])}


def test_random_starts_follow_the_seed() -> None:
    survey, engine = opened("box")

    def drawn(seed: int) -> list[list[float]]:
        paper = Paper(starts="random", n_random=9, search="none")
        settings = replace(SETTINGS, seed=seed, method=paper)
        return pool_of(survey, settings, engine).position_m.tolist()

    assert len(drawn(1)) == 9
    assert drawn(1) == drawn(1) != drawn(2)


def test_the_pool_is_narrowed_to_the_best_by_f2() -> None:
    survey, engine = opened("l-room")

    def pool(**options: object) -> np.ndarray:
        settings = replace(SETTINGS, method=Paper(search="none", **options))
        return pool_of(survey, settings, engine).position_m

    whole, judge = pool(), PointDistribution(survey.scene, survey.patches, engine)
    f2 = judge.of(survey.template, whole).f2_m2
    assert len(whole) > 20
    best = whole[np.sort(np.argsort(f2, kind="stable")[:5])]
    np.testing.assert_array_equal(pool(best_k=5), best)
    apart = pool(best_k=5, best_apart_m=1.5)
    assert len(apart) == 5
    assert np.linalg.norm(apart[:, None] - apart[None], axis=2)[np.triu_indices(5, 1)].min() >= 1.5
    thin = pool(thin_cell_m=2.0)
    cell = np.floor(whole[:, :2] / 2.0)
    least = [f2[(cell == one).all(axis=1)].min() for one in np.unique(cell, axis=0)]
    assert sorted(judge.of(survey.template, thin).f2_m2) == pytest.approx(sorted(least))
    assert len(thin) < len(whole)


def test_starts_without_halving_lie_on_the_grid_alone() -> None:
    settings = replace(SETTINGS, grid_step_m=2.0, method=Paper(search="none"))
    survey, engine = opened("corridor-comb", settings)
    plain = replace(settings, method=Paper(search="none", halve_grid=False))
    halved, whole = ({tuple(row) for row in pool_of(survey, one, engine).position_m} for one in (settings, plain))
    assert whole < halved
    x = np.array(sorted(whole))[:, 0]
    np.testing.assert_allclose((x - x[0]) / 2.0, np.rint((x - x[0]) / 2.0), atol=1e-9)


def test_equation_9_counts_patches_where_told() -> None:
    settings = replace(SETTINGS, method=Paper(search="none", repair=False))
    survey, engine = opened("two-rooms", settings)
    chosen = {}
    for count in ("area", "patches"):
        method = method_of(
            "paper", [("search", "none"), ("repair", "no"), ("genetic.objective", "eq9"), ("count", count)]
        )
        plan = plan_survey(survey, replace(settings, method=method), engine)
        chosen[count] = np.array([station.position_m for station in plan.stations])
    pool = pool_of(survey, settings, engine).position_m
    seen = engine.visible_patches(survey.template, pool)
    counts, areas = np.diff(seen.starts), [survey.patches.area_m2[seen.row(k)].sum() for k in range(len(pool))]
    assert len(chosen["area"]) == len(chosen["patches"]) == 1
    by_patches, by_area = (np.linalg.norm(pool - chosen[key][0], axis=1).argmin() for key in ("patches", "area"))
    assert counts[by_patches] >= counts[by_area]
    assert areas[by_area] >= areas[by_patches]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("search", "pso"), "search: got 'pso', expected one of ls, sa, ts, none"),
        (("n_random", "0"), "n_random: got 0, expected at least 1"),
        (("pool", "all"), "pool: got 'all', expected one of both, improved"),
        (("count", "beams"), "count: got 'beams', expected one of area, patches"),
        (("count", "patches"), "count: got patches with genetic.objective fewest"),
        (("best_k", "-1"), "best_k: got -1, expected 0 or more"),
        (("thin_cell_m", "-1"), "thin_cell_m: got -1, expected 0 or more"),
        (("genetic.population", "1"), "genetic population: got 1"),
        (("spatial.step_m", "-1"), "step_m: got -1"),
    ],
)
def test_options_of_the_pipeline_are_checked_as_they_are_read(option: tuple[str, str], message: str) -> None:
    with pytest.raises(RequirementError, match=message):
        method_of("paper", [option])


def test_searches_have_the_plans_seed_and_its_one_height_unless_they_have_their_own() -> None:
    told = replace(SETTINGS, seed=5, instrument_heights_m=(1.5,))
    paper = told.seeded_method
    assert (paper.spatial.seed, paper.spatial.fixed_height, paper.genetic.seed) == (5, True, 5)
    own = Paper(spatial=SearchSettings(seed=0, fixed_height=False), genetic=GeneticSettings(seed=1))
    assert replace(told, method=own).seeded_method == replace(own, overlap_radius_m=SETTINGS.scanner.range_max_m)


def test_a_search_with_very_many_beams_is_refused_before_it_takes_days() -> None:
    settings = replace(SETTINGS, scanner=load_scanner("rtc360"))
    survey, engine = opened("box", settings)
    with pytest.raises(RequirementError, match="expected at most 4000000 for a spatial search"):
        pool_of(survey, settings, engine)


def test_greedy_has_no_options() -> None:
    with pytest.raises(RequirementError, match=r"option spatial\.max_iterations: got it with method greedy"):
        method_of("greedy", [("spatial.max_iterations", "6")])


@pytest.mark.parametrize(
    ("option", "value"),
    all_slow_but([("max_iterations", 0)], [("objective", "eq9"), ("max_iterations", 0), ("patience", 30)]),
)
def test_a_plan_that_misses_its_coverage_says_so_and_no_other_does(option: str, value: object) -> None:
    genetic = replace(GeneticSettings(population=8, n_parents=8, expected_active=1), **{option: value})
    settings = replace(SETTINGS, method=Paper(search="none", repair=False, genetic=genetic))
    survey, engine = opened("corridor-comb", settings)
    plan = plan_survey(survey, settings, engine)
    met = plan.coverage.meets(0.9) and all(coverage.meets(0.9) for coverage in plan.coverage_by_floor)
    told = [line for line in plan.warnings if line.startswith("genetic selection: ended with")]
    assert met == (value == 30)
    assert len(told) == (0 if met else 1)


def test_repair_says_that_it_leaves_out_an_overlap_of_the_whole_circle() -> None:
    paper = Paper(search="none", genetic=GeneticSettings(max_iterations=5))
    settings = replace(SETTINGS, requirements=Requirements(coverage=0.5, overlap=1.0), method=paper)
    survey, engine = opened("box", settings)
    plan = plan_survey(survey, settings, engine)
    assert any(line.startswith("overlap repair: left out") for line in plan.warnings)
