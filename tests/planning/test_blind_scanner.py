"""A scanner that sees nothing is no plan without stations."""

from dataclasses import replace

import pytest

import scenes_synthetic
from planner_core.errors import RequirementError
from planner_core.model import Greedy, PlanSettings, Scene
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner

KILOMETRES = replace(load_scanner("hdl-64e"), range_min_m=0.0005, range_max_m=0.005)


@pytest.fixture
def room() -> Scene:
    return scenes_synthetic.build("box").scene


def test_a_plan_with_ranges_in_kilometres_is_refused(room: Scene) -> None:
    with pytest.raises(RequirementError, match=r"no surface seen .* between 0.0005 and 0.005 m; check its ranges"):
        make_plan(room, PlanSettings(scanner=KILOMETRES, grid_step_m=1.0, max_patch_area_m2=0.4, method=Greedy()))


def test_a_station_that_sees_nothing_is_warned_about(room: Scene) -> None:
    settings = PlanSettings(scanner=KILOMETRES, grid_step_m=1.0, max_patch_area_m2=0.4)
    middle = room.vertices_m.mean(axis=0) + room.offset_m
    given = GivenStation(id="S001", floor="", position_m=middle, instrument_height_m=None)
    plan = evaluate_stations(room, settings, [given])
    assert any("S001 sees nothing between 0.0005 and 0.005 m" in line for line in plan.warnings)
