"""What a planner's own plan hands to viewers by patch: what candidates can meet, and why the unseen stays unseen."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from oracles import observations_from, times_meeting
from stages import find_positions

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import REASONS, PartRequirement, Plan, PlanSettings, PointLimits, Requirements
from planner_core.plan_folder.viewer_layers import layer_files

LIMITS = (PointLimits(range_m=3.0), PointLimits(incidence_rad=0.9))


@pytest.fixture(scope="module")
def asking(small: PlanSettings) -> PlanSettings:
    walls = PartRequirement("walls", coverage=0.5, limits=LIMITS[1], classes=("*wall*",))
    return replace(small, requirements=Requirements(coverage=0.8, limits=LIMITS[0], seen_from=2, parts=(walls,)))


@pytest.fixture(scope="module")
def plan(planned: Callable[[str, PlanSettings], Plan], asking: PlanSettings) -> Plan:
    return planned("l-room", asking)


@pytest.fixture(scope="module")
def engine(plan: Plan) -> ScanEngine:
    return open_engine(plan.survey.scene, plan.survey.patches)


@pytest.fixture(scope="module")
def files(plan: Plan, engine: ScanEngine) -> dict[str, bytes]:
    return dict(layer_files(plan, engine))


@pytest.mark.slow
def test_achievable_layer_counts_the_candidates_that_meet_each_quality(
    plan: Plan, engine: ScanEngine, asking: PlanSettings, files: dict[str, bytes]
) -> None:
    places = find_positions(plan.survey, asking, engine, floors=(0,))
    observations = observations_from(plan.survey, asking, engine, places.candidates.position_m)
    found = np.frombuffer(files["viewer/achievable.u8"], dtype=np.uint8).reshape(2, -1)
    assert plan.qualities == LIMITS
    walls = np.array(["wall" in f"{element.name} {element.kind}".casefold() for element in plan.survey.scene.elements])
    walls = walls[plan.survey.scene.element_of_triangle[plan.survey.patches.triangle_of_patch]]
    assert walls.any()
    for quality, (asked, of) in enumerate(zip(LIMITS, (np.ones_like(walls), walls), strict=True)):
        np.testing.assert_array_equal(found[quality], np.where(of, times_meeting(observations, asked), 0))
    np.testing.assert_array_equal(found[0] >= 2, plan.achievable)
    assert 0 < plan.achievable.mean() < 1


@pytest.mark.slow
def test_reason_layer_adds_up_to_the_areas_of_the_plan(plan: Plan, files: dict[str, bytes]) -> None:
    assert plan.why is not None
    reason = np.frombuffer(files["viewer/reason.u8"], dtype=np.uint8)
    area_m2 = plan.survey.patches.area_m2
    by_reason = [float(area_m2[reason == number].sum()) for number in range(len(REASONS))]
    np.testing.assert_allclose(by_reason, plan.why.area_by_reason_m2, atol=1e-9)
    assert np.count_nonzero(by_reason) > 1


def test_bits_hold_what_a_station_sees_at_all_and_then_what_meets_the_limits_as_often_as_it_is_counted(
    plan: Plan, engine: ScanEngine, files: dict[str, bytes]
) -> None:
    positions_m = np.stack([station.position_m for station in plan.stations])
    seen = engine.visible_patches(plan.survey.template, positions_m)
    packed = np.stack([np.frombuffer(files[f"viewer/seen/{s.id}.bits"], dtype=np.uint8) for s in plan.stations])
    bits = np.unpackbits(packed.reshape(len(plan.stations), 2, -1), axis=2, bitorder="little")
    for row, patch in enumerate(bits[:, 0]):
        np.testing.assert_array_equal(np.flatnonzero(patch), seen.row(row))
    met = bits[:, 1].sum(axis=0)[: plan.times_seen.size]
    np.testing.assert_array_equal(met, plan.times_seen)
    assert bits[:, 0].sum() > met.sum() > 0
