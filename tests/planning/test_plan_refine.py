"""Refinement in whole plans: never worse, always where a tripod can stand, and the same on any number of cores."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from stages import find_positions

from planner_core.engine.open_engine import open_engine
from planner_core.model import Plan, PlanSettings, PriorStation, Site

Planned = Callable[[str, PlanSettings], Plan]
SCENES = ("l-room", "corridor-comb", pytest.param("doors-open", marks=pytest.mark.slow))


def positions_m(plan: Plan) -> np.ndarray:
    return np.stack([station.position_m for station in plan.stations])


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_refinement_takes_no_more_stations_and_of_as_many_covers_no_less(
    scene: str, small: PlanSettings, planned: Planned
) -> None:
    before, after = planned(scene, small), planned(scene, replace(small, refine=True))
    assert len(after.stations) <= len(before.stations)
    if len(after.stations) == len(before.stations):
        assert after.coverage.covered_area_m2 >= before.coverage.covered_area_m2 - 1e-9
    assert all(result.met for result in after.requirements)
    # What is asked stays what the grid can achieve.
    assert (after.achievable == before.achievable).all()
    assert [r.achievable_area_m2 for r in after.requirements] == [r.achievable_area_m2 for r in before.requirements]
    assert after.registration is not None
    assert before.registration is not None
    assert len(after.registration.networks) <= len(before.registration.networks)


@pytest.mark.parametrize(
    ("scene", "heights_m"),
    [
        ("l-room", (1.5,)),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in (("doors-open", (1.5,)), ("l-room", ()))),
    ],
)
def test_stations_off_the_grid_stand_where_any_tripod_may(
    scene: str, heights_m: tuple[float, ...], small: PlanSettings, planned: Planned
) -> None:
    # On the marks: as set up, what holds of the grid alone may take fewer.
    settings = replace(small, refine=True, instrument_heights_m=heights_m, height_step_m=0.6, set_up_tolerance_m=0.0)
    plan = planned(scene, settings)
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    places = find_positions(survey, settings, engine, floors=(0,))
    grid = {tuple(place) for place in np.round(places.candidates.position_m, 6).tolist()}
    moved = [s for s in plan.stations if tuple(np.round(s.position_m, 6).tolist()) not in grid]
    assert moved
    at_m = np.stack([s.position_m for s in moved])
    height_m = np.array([s.instrument_height_m for s in moved])
    ground_m = at_m[:, 2] - height_m
    kept, reasons = places.tripods.tests(0).reject(at_m, ground_m)
    assert not reasons
    assert len(kept) == len(moved) or np.asarray(kept).all()
    assert ground_m == pytest.approx(0.0, abs=1e-6)
    found = replace(
        places.candidates,
        position_m=at_m,
        floor=np.zeros(len(moved), dtype=np.int32),
        instrument_height_m=height_m,
    )
    assert places.allows(found).all()
    if heights_m:
        assert height_m == pytest.approx(heights_m[0])
    else:
        scanner = settings.scanner
        assert height_m.min() >= scanner.instrument_height_min_m - 1e-9
        assert height_m.max() <= scanner.instrument_height_max_m + 1e-9


@pytest.mark.slow
def test_settled_stations_do_not_move(small: PlanSettings, planned: Planned) -> None:
    prior = (
        PriorStation("done", (2.0, 1.0, 1.5), "scanned"),
        PriorStation("wanted", (5.0, 2.2, 1.5), "locked"),
    )
    plan = planned("l-room", replace(small, refine=True, site=Site(prior=prior)))
    at = {station.id: station for station in plan.stations}
    assert at["done"].position_m == pytest.approx((2.0, 1.0, 1.5))
    assert at["wanted"].position_m == pytest.approx((5.0, 2.2, 1.5))
    assert at["done"].fixed
    assert not at["wanted"].fixed


PROGRAM = """
import json, sys
from dataclasses import replace
import scenes_synthetic
from planner_core.plan_folder.plan_json import plan_document
from planner_core.model import PlanSettings, Proven, Requirements
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
settings = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=360), requirements=Requirements(coverage=0.92),
    grid_step_m=1.0, max_patch_area_m2=0.4, method=Proven(work_limit=0.1),
)
document = plan_document(make_plan(scenes_synthetic.build("l-room").scene, settings))
for name in ("timings_s", "device", "versions"):
    del document[name]
print(json.dumps(document, sort_keys=True))
"""


@pytest.mark.slow
def test_refined_plans_are_the_same_on_one_core_and_on_all() -> None:
    said = []
    for cores in ({"POCL_MAX_PTHREAD_COUNT": "1", "OMP_NUM_THREADS": "1"}, {}):
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False, env={**os.environ, **cores}
        )
        assert done.returncode == 0, done.stderr
        said.append(done.stdout)
    assert json.loads(said[0])["stations"]
    assert said[0] == said[1]
