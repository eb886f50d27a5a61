"""Parts of the candidates' network: plans are made in as few of them as can meet what is asked."""

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import PlanSettings, Requirements
from planner_core.plan import make_plan
from planner_core.scan.scanners import load_scanner

SETTINGS = PlanSettings(
    scanner=load_scanner("hdl-64e"),
    method="proven",
    method_options=(("work_limit", "1"),),
    max_patch_area_m2=0.2,
)


@pytest.mark.parametrize(("name", "n_networks"), [("two-rooms", 1), ("doors-open", 1)])
def test_lone_candidates_do_not_split_a_plan_that_can_be_one_network(name: str, n_networks: int) -> None:
    """In both, some candidates have no link to any other: high ones near doorways."""
    scene = scenes_synthetic.build(name).scene
    plan = make_plan(scene, SETTINGS, engine="opencl")
    assert plan.registration is not None
    assert len(plan.registration.networks) == n_networks
    assert all(result.met for result in plan.requirements)


def test_rooms_that_cannot_be_registered_stay_apart_and_are_all_planned() -> None:
    scene = scenes_synthetic.build("closed-rooms").scene
    plan = make_plan(scene, SETTINGS, engine="opencl")
    free = make_plan(
        scene,
        PlanSettings(
            scanner=SETTINGS.scanner,
            method="proven",
            method_options=SETTINGS.method_options,
            max_patch_area_m2=0.2,
            requirements=Requirements(network="none"),
        ),
        engine="opencl",
    )
    assert plan.registration is not None
    n_rooms = len(scenes_synthetic.build("closed-rooms").rooms)
    assert len(plan.registration.networks) == n_rooms
    assert len(plan.stations) >= len(free.stations)
    np.testing.assert_allclose(plan.coverage.achievable_area_m2, free.coverage.achievable_area_m2)
