"""Why and route of whole plans: areas that add up, curves that rise to the coverage, legs that can be walked."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from shared_plans import SharedPlan
from slow_cases import all_slow_but

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.model import REASONS, Plan, PlanSettings, Proven
from planner_core.planning.plan import make_plan

Planned = Callable[[str, PlanSettings], Plan]


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["l-room", "closed-rooms", "house"])
def test_areas_by_reason_add_up_to_all_surface_and_the_unseen_is_listed_whole(
    scene: str, small: PlanSettings, planned: Planned, house_on_map: SharedPlan
) -> None:
    plan = house_on_map.plan if scene == "house" else planned(scene, small)
    why, area_m2 = plan.why, plan.survey.patches.area_m2
    assert why is not None
    assert sum(why.area_by_reason_m2) == pytest.approx(area_m2.sum())
    by_patch = np.bincount(why.reason_of_patch, weights=area_m2, minlength=len(REASONS))
    assert by_patch == pytest.approx(why.area_by_reason_m2)
    covered = (plan.times_seen > 0) & plan.achievable
    assert why.area_by_reason_m2[0] == pytest.approx(plan.coverage.covered_area_m2)
    assert ((why.reason_of_patch == 0) == covered).all()
    assert sum(each.area_m2 for each in why.unseen) == pytest.approx(area_m2[~covered].sum())
    by_reason: Counter[str] = Counter()
    for surface in why.unseen:
        by_reason[surface.reason] += surface.area_m2
    for reason, told_m2 in zip(REASONS[1:], why.area_by_reason_m2[1:], strict=True):
        assert by_reason[reason] == pytest.approx(told_m2, abs=1e-6)
    # What candidates see is not worth a station; what none sees has another reason.
    assert ((why.reason_of_patch == REASONS.index("not worth a station")) == (plan.achievable & ~covered)).all()


@pytest.mark.parametrize("scene", ["l-room", "corridor-comb"])
def test_what_a_station_adds_is_what_scans_of_the_others_lack(
    scene: str, small: PlanSettings, planned: Planned, looks: Callable[..., Any]
) -> None:
    plan = planned(scene, small)
    seen = looks(plan, np.stack([s.position_m for s in plan.stations])).seen
    area_m2 = plan.survey.patches.area_m2
    assert plan.why is not None
    for row, told in enumerate(plan.why.stations):
        assert told.station == plan.stations[row].id
        own = seen[row] & ~np.delete(seen, row, axis=0).any(axis=0)
        assert told.own_area_m2 == pytest.approx(area_m2[own].sum(), abs=0.02 * area_m2[seen[row]].sum())
        assert told.own_area_m2 == pytest.approx(plan.stations[row].own_area_m2)
    for curve in (plan.coverage_curve, tuple(step.fraction_of_achievable for step in plan.why.curve)):
        assert len(curve) == len(plan.stations)
        assert all(a <= b for a, b in pairwise(curve))
        assert curve[-1] == pytest.approx(plan.coverage.fraction_of_achievable)
    gains = np.diff([0.0, *(step.covered_area_m2 for step in plan.why.curve)])
    assert all(a >= b - 1e-9 for a, b in pairwise(gains))


@pytest.mark.slow
@pytest.mark.parametrize(("seen_from", "coverage"), [pytest.param(1, 0.8, marks=pytest.mark.slow), (2, 0.5)])
def test_what_a_station_adds_is_told_of_asked_floors_alone_and_once(
    seen_from: int, coverage: float, small: PlanSettings, planned: Planned
) -> None:
    asked = replace(small.requirements, coverage=coverage, floors=("F0",), seen_from=seen_from)
    plan = planned("double-height-hall", replace(small, requirements=asked, method=Proven(work_limit=0.02)))
    assert plan.why is not None
    by_station = {told.station: told.own_area_m2 for told in plan.why.stations}
    floor = np.repeat(plan.survey.floor_of_triangle, np.diff(plan.survey.patches.first_patch))
    area_m2 = plan.survey.patches.area_m2
    # What needs every station that sees it, on the floor that is asked for.
    counts = (floor == 0) & plan.achievable  # a place off the grid sees what no candidate did, too
    needed_m2 = area_m2[counts & (plan.times_seen == seen_from)].sum()
    assert area_m2[(floor != 0) & (plan.times_seen == seen_from)].sum() > 0
    assert sum(station.own_area_m2 for station in plan.stations) == pytest.approx(seen_from * needed_m2)
    for station in plan.stations:
        assert station.own_area_m2 == pytest.approx(by_station[station.id], abs=1e-9)


@pytest.mark.parametrize("scene", all_slow_but(["doors-open"], ["l-room", "doors-open", "corridor-comb"]))
def test_every_leg_can_be_walked_and_visits_are_numbered_in_its_order(
    scene: str, small: PlanSettings, planned: Planned
) -> None:
    timed = replace(small, seconds_per_scan=90.0, set_up_s=45.0, walking_m_per_s=0.5)
    plan = planned(scene, timed)
    route, time = plan.route, plan.field_time
    assert route is not None
    assert time is not None
    assert [station.order for station in plan.stations] == list(range(1, len(plan.stations) + 1))
    assert [(leg.a, leg.b) for leg in route.legs] == list(pairwise(range(len(plan.stations))))
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    for leg in route.legs:
        assert leg.walkable
        for end, point_m in ((leg.a, leg.points_m[0]), (leg.b, leg.points_m[-1])):
            assert np.linalg.norm(point_m[:2] - plan.stations[end].position_m[:2]) < 0.6
        pieces = np.diff(leg.points_m, axis=0)
        length_m = np.linalg.norm(pieces, axis=1)
        assert leg.length_m == pytest.approx(length_m.sum(), rel=1e-6)
        some = length_m > 1e-6
        # A metre above the ground nothing is in the way but doors, which whoever walks opens and shuts.
        start_m = leg.points_m[:-1][some] + np.array([0.0, 0.0, 1.0])
        hits = engine.cast_rays(start_m, pieces[some] / length_m[some][:, None], range_max_m=20.0)
        is_door = np.array([element.kind == "IfcDoor" for element in survey.scene.elements])
        stopped = (hits.triangle >= 0) & ~is_door[survey.scene.element_of_triangle[hits.triangle]]
        free_m = np.where(stopped, hits.range_m, np.inf)
        assert (free_m > length_m[some]).all()
    assert route.length_m == pytest.approx(sum(leg.length_m for leg in route.legs))
    n = len(plan.stations)
    assert time.scanning_s == 90.0 * n
    assert time.set_up_s == 45.0 * n
    assert time.walking_s == pytest.approx(route.length_m / 0.5)
    assert time.total_s == pytest.approx(135.0 * n + 2.0 * route.length_m)


@pytest.mark.slow
def test_a_scene_far_from_the_origin_gets_the_same_plan(small: PlanSettings, planned: Planned) -> None:
    here = planned("corridor-comb", small)
    there = make_plan(scenes_synthetic.build("georeferenced").scene, small)
    assert there.survey.scene.offset_m.any()
    assert [(s.id, s.order, s.position_m.tolist()) for s in there.stations] == [
        (s.id, s.order, s.position_m.tolist()) for s in here.stations
    ]
    assert there.coverage == here.coverage
