"""Where stations may be dragged to: what candidates could have been, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared_plans import SharedPlan
from stages import find_positions, tripod_tests, tripods_of

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import FloatArray, KeepOut, PriorStation
from planner_core.planning.live.draft import Draft, local_place
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.tripod_positions import (
    ADMISSIBLE,
    KEPT_OUT,
    NOTHING,
    WALKABLE,
    TripodPosition,
    TripodPositions,
)
from planner_core.positions.admissibility import RefusalTally
from planner_core.positions.allowed_positions import KINDS
from planner_core.positions.free_space import free_space
from planner_core.positions.ground_surface import GroundSurface
from planner_core.positions.reach import reachability
from planner_core.scene.build import scene_from_arrays


@pytest.fixture(scope="session")
def candidates(house: LivePlan) -> tuple[FloatArray, list[int], list[float]]:
    """Places of a plan's candidates at all heights of the tripod: positions, floors, heights."""
    settings = replace(house.settings, instrument_heights_m=(1.4, 1.5, 1.7), grid_step_m=0.8)
    engine = open_engine(house.survey.scene, house.survey.patches)
    found = find_positions(house.survey, settings, engine, floors=(0, 1)).candidates
    return found.position_m, found.floor.tolist(), found.instrument_height_m.tolist()


@pytest.mark.slow
def test_every_candidate_of_a_plan_is_a_spot(
    house: LivePlan, candidates: tuple[FloatArray, list[int], list[float]]
) -> None:
    position_m, floors, heights = candidates
    assert len(floors) > 100
    for at, floor, height in list(zip(position_m, floors, heights, strict=True))[::3]:
        spot = house.snap(house.draft, house.survey.floors[floor].id, (at[0], at[1], at[2]), height)
        assert spot.admissible, (at, spot)
        assert spot.reason == "", (at, spot)
        np.testing.assert_allclose(spot.position_m, at, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["house", "far_plan"])
def test_every_station_of_a_plan_stands_at_a_spot(name: str, request: pytest.FixtureRequest) -> None:
    live: LivePlan = request.getfixturevalue(name)
    for station in live.draft.stations:
        assert station.instrument_height_m is not None
        spot = live.snap(live.draft, station.floor, station.position_m, station.instrument_height_m)
        assert (spot.admissible, spot.reason) == (True, "")
        np.testing.assert_allclose(spot.position_m, station.position_m, atol=1e-4)


@pytest.mark.slow
def test_dragged_stations_stay_where_tripods_can_stand(house: LivePlan) -> None:
    survey, settings = house.survey, house.settings
    engine = open_engine(survey.scene, survey.patches)
    floor = survey.floors[0]
    surface, tripods = GroundSurface(survey, floor), tripods_of(survey, settings, engine)
    random = np.random.default_rng(2)
    n_moved = 0
    for plan_m in random.uniform(floor.bounds_m[0] - 1.0, floor.bounds_m[1] + 1.0, (60, 2)):
        spot = house.snap(house.draft, floor.id, (float(plan_m[0]), float(plan_m[1])), 1.5)
        assert spot.admissible
        at_m = np.array([spot.position_m])
        below = engine.cast_rays(at_m, np.array([[0.0, 0.0, -1.0]]), range_max_m=3.0)  # ground or a tread
        assert below.range_m[0] == pytest.approx(1.5, abs=2e-4)
        ground_m = at_m[:, 2] - below.range_m
        kept, reasons = tripods.reject(0, at_m, ground_m, np.abs(surface.below(at_m) - ground_m) < 0.01)
        assert kept.all(), (spot, reasons)
        away_m = float(np.hypot(*(at_m[0, :2] - plan_m)))
        n_moved += away_m > 1e-3
        assert (away_m < 1e-3) == (spot.reason == "")
        again = house.snap(house.draft, floor.id, spot.position_m, 1.5)
        assert (again.position_m, again.admissible, again.reason) == (spot.position_m, True, "")
        if spot.reason:
            assert spot.reason.endswith(f"moved by {away_m:.2f} m")
    assert 10 < n_moved < 60


@pytest.mark.slow
def test_map_shows_what_the_tests_say_of_its_cells(house: LivePlan) -> None:
    survey, settings = house.survey, house.settings
    engine = open_engine(survey.scene, survey.patches)
    for floor in survey.floors:
        ground = house.ground(house.draft, floor.id)
        row, column = np.nonzero(ground.values >= WALKABLE)
        plan_m = ground.origin_m + ground.cell_m * (np.column_stack([column, row]) + 0.5)
        surface = GroundSurface(survey, floor)
        ground_m = surface.below(np.column_stack([plan_m, np.full(row.size, surface.high_m + 0.1)]))
        on_floor = np.isfinite(ground_m)  # landings are no ground of the floor itself
        over_m = np.column_stack([plan_m, ground_m + 1.5])[on_floor]
        below = engine.cast_rays(over_m, np.tile([0.0, 0.0, -1.0], (len(over_m), 1)), range_max_m=3.0)
        kind = [survey.scene.elements[number].kind for number in survey.scene.element_of_triangle[below.triangle]]
        on_floor[on_floor] = [not each.startswith("IfcStair") for each in kind]  # nor are flights
        position_m = np.column_stack([plan_m, ground_m + 1.5])[on_floor]
        kept = tripod_tests(survey, settings, engine, floor).keep(position_m, ground_m[on_floor], RefusalTally())
        value = ground.values[row, column][on_floor]
        assert kept.sum() > 200
        np.testing.assert_array_equal(value == ADMISSIBLE, kept)


@pytest.mark.slow
def test_cells_are_walkable_where_the_crew_gets_to(house: LivePlan) -> None:
    space = free_space(house.survey)
    reach = reachability(house.survey, space)
    ground = house.ground(house.draft, "F0")
    fine = space.floor_map(0)
    # Every cell that one can stand on is at least walkable; outside of the walls nothing is.
    node = np.flatnonzero(reach.reached_node & (space.floor == 0) & space.on_ground)
    cell = np.floor((space.position_m(node)[:, :2] - ground.origin_m) / ground.cell_m).astype(int)
    assert (ground.values[cell[:, 1], cell[:, 0]] >= WALKABLE).mean() > 0.99
    assert (ground.values[0] == NOTHING).all()
    assert np.isnan(fine.ground_m[0]).all()


def test_review_keeps_ground_free_and_names_whose_it_is(house: LivePlan) -> None:
    plain = house.ground(house.draft, "F0")
    x0, y0 = house.survey.floors[0].bounds_m[0] + house.survey.scene.offset_m[:2]
    half = ((x0, y0), (x0 + 5.0, y0), (x0 + 5.0, y0 + 20.0), (x0, y0 + 20.0))
    draft = replace(house.draft, keep_out=(KeepOut(half, floor="F0"),))
    excluded = house.ground(draft, "F0")
    column = np.arange(plain.values.shape[1])
    in_half = plain.origin_m[0] + plain.cell_m * (column + 0.5) < x0 + 5.0
    expected = np.where((plain.values != NOTHING) & in_half, KEPT_OUT, plain.values)
    np.testing.assert_array_equal(excluded.values, expected)
    np.testing.assert_array_equal(house.ground(draft, "F1").values, house.ground(house.draft, "F1").values)
    spot = house.snap(draft, "F0", (x0 + 2.0, y0 + 2.0), 1.5)
    assert spot.position_m[0] >= x0 + 5.0
    assert spot.reason.startswith("in a keep-out of the review; moved by")
    place = PriorStation("P", (float(spot.position_m[0]), float(spot.position_m[1]), 0.0), "forbidden", "F0")
    draft = replace(draft, forbidden=(place,))
    beside = house.snap(draft, "F0", spot.position_m, 1.5)
    assert house.snap(draft, "F0", beside.position_m, 1.5).reason == ""
    assert np.hypot(*(np.array(beside.position_m[:2]) - spot.position_m[:2])) > 0.5
    assert beside.reason.startswith("at a forbidden position of the review")
    everything = ((x0 - 99, y0 - 99), (x0 + 99, y0 - 99), (x0 + 99, y0 + 99), (x0 - 99, y0 + 99))
    nowhere = house.snap(replace(draft, keep_out=(KeepOut(everything),)), "F0", spot.position_m, 1.5)
    assert not nowhere.admissible
    assert nowhere.reason == "in a keep-out of the review, and no tripod can stand nearby"


def test_heights_that_the_tripod_does_not_have_are_refused(house: LivePlan) -> None:
    at = house.draft.stations[0].position_m
    high_m = house.settings.scanner.instrument_height_max_m
    spot = house.snap(house.draft, house.draft.stations[0].floor, at, high_m + 0.1)
    assert not spot.admissible
    assert spot.reason.startswith("the tripod puts the instrument")
    assert house.snap(house.draft, house.draft.stations[0].floor, at, high_m).admissible


@pytest.mark.slow
def test_georeferenced_places_are_few_digits_and_come_back_the_same(far_plan: LivePlan) -> None:
    live = far_plan
    offset_m = live.survey.scene.offset_m
    assert np.abs(offset_m).max() > 1e5
    low, high = live.survey.floors[0].bounds_m
    spot = live.snap(live.draft, "F0", tuple((0.4 * low + 0.6 * high).tolist()), 1.5)
    told = [round(value, 4) for value in (np.array(spot.position_m) + offset_m).tolist()]
    assert local_place(told, offset_m) == spot.position_m


def box_faces(low: tuple[float, ...], high: tuple[float, ...]) -> FloatArray:
    """(36, 3) corners of a box's twelve triangles."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    order = [index for a, b, c, d in faces for index in (a, b, c, a, c, d)]
    return (np.array(low) + corner * (np.array(high) - low))[order]


def test_stations_on_landings_can_be_dragged_on_them(house_plan: SharedPlan) -> None:
    steps = [((3.4 - 0.3 * (k + 1), 1.4, 0.0), (3.4 - 0.3 * k, 2.6, 0.2 * (k + 1))) for k in range(4)]
    walls = [
        ((-0.2, -0.2, -0.2), (7.2, 4.2, 0.0)),
        ((-0.2, -0.2, 4.0), (7.2, 4.2, 4.2)),
        ((-0.2, -0.2, 0.0), (7.2, 0.0, 4.0)),
        ((-0.2, 4.0, 0.0), (7.2, 4.2, 4.0)),
        ((-0.2, 0.0, 0.0), (0.0, 4.0, 4.0)),
        ((7.0, 0.0, 0.0), (7.2, 4.0, 4.0)),
    ]
    points = np.concatenate(
        [box_faces(low, high) for low, high in [*walls, *steps, ((1.2, 1.4, 0.0), (2.2, 2.6, 1.0))]]
    )
    settings = house_plan.settings
    survey = make_survey(scene_from_arrays(points, np.arange(len(points)).reshape(-1, 3)), settings)
    engine = open_engine(survey.scene, survey.patches)
    places = find_positions(survey, settings, engine, floors=(0,))
    landing = np.flatnonzero(places.kind == KINDS.index("landing"))
    assert landing.size > 0
    spots = TripodPositions(places.tripods, places.site, places.reach, height_m=1.5)
    for x, y, z in places.candidates.position_m[landing].tolist():
        assert z == pytest.approx(2.5)
        spot = spots.nearest("F0", (x + 0.03, y - 0.03), Draft(()), height_m=1.5, sensor_z_m=z)
        assert spot == TripodPosition((pytest.approx(x + 0.03), pytest.approx(y - 0.03), pytest.approx(2.5)), True, "")
    # Beyond its edge the steps begin, where the legs stand on several: the lowest tread is at 0.2 m.
    spot = spots.nearest("F0", (2.35, 2.0), Draft(()), height_m=1.5, sensor_z_m=2.5)
    assert spot == TripodPosition((pytest.approx(2.35), pytest.approx(2.0), pytest.approx(2.3)), True, "")
