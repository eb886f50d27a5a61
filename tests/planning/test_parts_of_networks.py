"""Parts of the candidates' network: plans are made in as few of them as can meet what is asked."""

from dataclasses import replace

import numpy as np
import pytest
from stages import find_positions, make_pool

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Greedy, PlanSettings, Proven, Requirements
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(
    scanner=load_scanner("hdl-64e"),
    method=Proven(work_limit=0.2),
    max_patch_area_m2=0.2,
    refine=False,
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "n_networks"), [("two-rooms", 1), pytest.param("doors-open", 1, marks=pytest.mark.campaign)]
)
def test_lone_candidates_do_not_split_a_plan_that_can_be_one_network(name: str, n_networks: int) -> None:
    """In both, some candidates have no link to any other: high ones near doorways."""
    scene = scenes_synthetic.build(name).scene
    plan = make_plan(scene, SETTINGS, engine="opencl")
    assert plan.registration is not None
    assert len(plan.registration.networks) == n_networks
    assert all(result.met for result in plan.requirements)


@pytest.mark.slow
@pytest.mark.opencl
def test_rooms_that_cannot_be_registered_stay_apart_and_are_all_planned() -> None:
    scene = scenes_synthetic.build("closed-rooms").scene
    settings = replace(SETTINGS, scanner=replace(SETTINGS.scanner, n_azimuths=720))
    plan = make_plan(scene, settings, engine="opencl")
    free = make_plan(scene, replace(settings, requirements=Requirements(network="none")), engine="opencl")
    assert plan.registration is not None
    n_rooms = len(scenes_synthetic.build("closed-rooms").rooms)
    assert len(plan.registration.networks) == n_rooms
    assert len(plan.stations) >= len(free.stations)
    np.testing.assert_allclose(plan.coverage.achievable_area_m2, free.coverage.achievable_area_m2)


@pytest.mark.slow
@pytest.mark.opencl
def test_a_room_of_its_own_is_not_left_aside_however_little_is_asked() -> None:
    """Half of the area can be had without a third of the rooms; which of them, and whether, selection may say."""
    synthetic = scenes_synthetic.build("closed-rooms")
    settings = PlanSettings(
        scanner=SETTINGS.scanner, method=Proven(), max_patch_area_m2=0.2, requirements=Requirements(coverage=0.5)
    )
    survey = make_survey(synthetic.scene, settings)
    engine = open_engine(survey.scene, survey.patches, engine="opencl")
    places = find_positions(survey, settings, engine, floors=(0,))
    none = np.zeros(0, dtype=np.int64)
    pool = make_pool(survey, settings, engine, places.candidates, given=none, kept=none)
    assert pool.excluded.any(), "some high candidates see no floor, and are alone"
    free_m = places.candidates.position_m[~pool.excluded, :2] + survey.scene.offset_m[:2]
    for room in synthetic.rooms:
        low, high = np.min(room.outline_m, axis=0), np.max(room.outline_m, axis=0)
        assert ((free_m > low) & (free_m < high)).all(axis=1).any(), room.name


@pytest.mark.slow
def test_where_hardly_any_two_can_be_registered_nobody_is_left_aside() -> None:
    """Of an overlap that no two candidates reach, no link counts, and every candidate is a part by itself."""
    scene = scenes_synthetic.build("without-slabs").scene
    settings = replace(SETTINGS, requirements=Requirements(overlap=1.0))
    greedy = make_plan(scene, replace(settings, method=Greedy()), engine="opencl")
    plan = make_plan(scene, settings, engine="opencl")
    assert plan.n_bounded is not None and plan.n_bounded >= greedy.n_candidates
    assert len(plan.stations) <= len(greedy.stations)
