"""Given stations are placed as those of plans are: where a plan puts one, its evaluation has nothing to say of it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from real_buildings import RealScene
from stages import find_positions

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import PlanSettings, PointLimits, Requirements, Scene, Survey
from planner_core.plan_folder.stations_csv import GivenStation, read_station_list
from planner_core.planning.evaluate import evaluate_survey, place_stations
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import KINDS, AllowedPositions
from planner_core.positions.free_space import free_space
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.doors import without_door_leaves
from scenes_synthetic import build
from tests.reality_files import reality

SETTINGS = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=360),
    max_patch_area_m2=1.0,
    instrument_heights_m=(1.2, 1.5),
    grid_step_m=1.0,
)
MOVED_M = (1000.0, 2000.0, 50.0)


@pytest.fixture(scope="module")
def stairs(
    boxes_scene: Callable[..., Scene], two_rooms: Callable[..., list]
) -> tuple[Survey, ScanEngine, AllowedPositions]:
    """Two rooms with a door of 0.9 m, four steps and a landing at 1 m, far from the origin."""
    steps = [((3.4 - 0.3 * (k + 1), 1.4, 0.0), (3.4 - 0.3 * k, 2.6, 0.2 * (k + 1))) for k in range(4)]
    boxes = [*two_rooms([(1.3, 0.9)], high_m=4.0), *steps, ((1.2, 1.6, 0.0), (2.2, 2.5, 1.0))]
    survey = make_survey(boxes_scene(boxes, at_m=MOVED_M), SETTINGS)
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    return survey, engine, find_positions(survey, SETTINGS, engine, floors=(0,))


def given_at(
    survey: Survey, places: AllowedPositions, row: int, *, floor: str | None, height_m: float | None
) -> GivenStation:
    at = places.candidates.position_m[row] + survey.scene.offset_m
    return GivenStation(f"S{row}", at, height_m, floor)


@pytest.mark.slow
@pytest.mark.parametrize("floor", [None, "F0"])
def test_nothing_is_odd_about_any_place_where_a_plan_may_put_stations(
    stairs: tuple[Survey, ScanEngine, AllowedPositions], floor: str | None
) -> None:
    survey, _, places = stairs
    rows = np.concatenate([np.flatnonzero(places.kind == kind)[:4] for kind in range(len(KINDS) - 1)])
    assert {KINDS[kind] for kind in places.kind[rows]} >= {"grid", "doorway", "landing"}
    heights_m = places.candidates.instrument_height_m
    given = [given_at(survey, places, row, floor=floor, height_m=float(heights_m[row])) for row in rows.tolist()]
    stations, remarks = place_stations(places.tripods, given, places.reach.space)
    assert remarks == ()
    assert [station.order for station in stations] == list(range(1, rows.size + 1))
    np.testing.assert_allclose([s.position_m for s in stations], places.candidates.position_m[rows], atol=1e-9)
    unknown = [replace(one, instrument_height_m=None) for one in given]
    found, _ = place_stations(places.tripods, unknown, places.reach.space)
    np.testing.assert_allclose([station.instrument_height_m for station in found], heights_m[rows], atol=1e-6)


def test_what_is_odd_about_given_stations_is_said_line_by_line(
    stairs: tuple[Survey, ScanEngine, AllowedPositions],
) -> None:
    _, _, places = stairs
    given = [
        GivenStation("wall", np.array([4.1, 3.0, 1.5]) + MOVED_M, None, "F0"),
        GivenStation("high", np.array([6.0, 2.0, 1.5]) + MOVED_M, 1.8, None),
        GivenStation("attic", np.array([6.0, 2.0, 1.5]) + MOVED_M, None, "attic"),
        GivenStation("far", np.array([60.0, 2.0, 1.5]) + MOVED_M, None, None),
    ]
    stations, remarks = place_stations(places.tripods, given, places.reach.space)
    said = {name: [line for line in remarks if line.startswith(f"station {name}: ")] for name in ("high", "attic")}
    assert [line.partition(": ")[2] for line in said["high"]] == [
        "instrument height 1.800 m is given, but the sensor is 1.500 m above the ground of 'Level 1'"
    ]
    assert stations[1].instrument_height_m == 1.8
    assert len(said["attic"]) == 1
    assert "there is no floor 'attic' (there are F0 (Level 1)); taken by its height" in said["attic"][0]
    assert any(line.startswith("station wall: no valid tripod position on 'Level 1' (") for line in remarks)
    assert "station far: stands over no floor; counted for 'Level 1'" in remarks


@pytest.mark.slow
def test_an_evaluation_says_what_can_not_be_had_as_a_plan_does(
    stairs: tuple[Survey, ScanEngine, AllowedPositions],
) -> None:
    survey, engine, places = stairs
    wanted = Requirements(coverage=0.5, limits=PointLimits(range_m=0.9))
    landing = int(np.flatnonzero(places.kind == KINDS.index("landing"))[0])
    given = [given_at(survey, places, landing, floor=None, height_m=None)]
    plan = evaluate_survey(survey, replace(SETTINGS, requirements=wanted), given, engine)
    lines = [line for line in plan.warnings if "that candidates see can't be scanned with" in line]
    assert lines
    assert lines[0].startswith("requirement ")
    assert not any("no valid tripod position" in line or "instrument height" in line for line in plan.warnings)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("building", "name"),
    [
        ("house", "demo_stair_station.csv"),
        pytest.param("duplex", "duplex_joining_stations.csv", marks=pytest.mark.slow),
    ],
)
def test_stations_that_crews_set_up_on_stairs_and_in_doors_are_in_valid_places(
    building: str, name: str, real_scene: RealScene
) -> None:
    given = read_station_list(reality(name))
    scene = real_scene(building) if building == "duplex" else build(building).scene
    settings = PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0)
    survey = make_survey(without_door_leaves(scene), settings)
    tripods = Tripods(survey, settings, open_engine(survey.scene, survey.patches))
    stations, remarks = place_stations(tripods, given, free_space(survey))
    assert remarks == ()
    assert [station.id for station in stations] == [station.id for station in given]
    on_stairs = [station for station in stations if station.id.startswith("T")]
    ground_m = [station.position_m[2] - station.instrument_height_m for station in on_stairs]
    assert on_stairs
    assert all(0.5 < height_m < 1.5 for height_m in ground_m)
