"""Doorways, room centres, landings and flights: against plans that are known exactly."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage
from stages import find_positions

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Doors, PlanSettings, Scene, Survey
from planner_core.positions.allowed_positions import KINDS
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.positions.rooms import (
    _AROUND,
    _Cells,
    _distance_cells,
    _distance_in_tree,
    centre_in_doorways,
    find_rooms,
)
from planner_core.positions.stairs import find_flights, find_landings
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.doors import without_door_leaves

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0, instrument_heights_m=(1.5,))
MAKES = Callable[..., Scene]


def survey_of(scene: Scene) -> Survey:
    return make_survey(scene, SETTINGS)


def off_by(space: FreeSpace, node: np.ndarray, *plan_m: tuple[float, float]) -> float:
    """Greatest distance of expected places from the nearest found, or inf where their numbers differ."""
    found = space.position_m(node)[:, :2]
    if len(found) != len(plan_m):
        return float("inf")
    return float(max(np.linalg.norm(found - place, axis=1).min() for place in plan_m))


# ------------------------------------------------------------------------------------------- rooms, doorways
@settings(max_examples=25, deadline=None)
@given(hnp.arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.sampled_from([True, True, False])))
def test_distances_of_single_cells_are_the_exact_distance_transform(walkable: np.ndarray) -> None:
    cells = _Cells(np.flatnonzero(walkable), walkable.shape[1])
    if not walkable.any():
        return
    exact = ndimage.distance_transform_edt(np.pad(walkable, 1))[1:-1, 1:-1]
    assert np.array_equal(_distance_cells(cells), exact[walkable])
    assert np.array_equal(_distance_in_tree(cells.place(np.arange(cells.column.size)), cells), exact[walkable])
    number = np.pad(np.full(walkable.shape, -1), 1, constant_values=-1)
    number[1:-1, 1:-1][walkable] = np.arange(cells.column.size)
    y, x = np.nonzero(walkable)
    for (dy, dx), beside in zip(_AROUND, cells.beside, strict=True):
        assert np.array_equal(beside, number[y + 1 + dy, x + 1 + dx])


@pytest.mark.slow
def test_rooms_and_doorways_of_houses_a_kilometre_apart_are_those_of_each(
    boxes_scene: MAKES, two_rooms: Callable[..., list]
) -> None:
    """Their grid has 400 million cells, 3 GB a number each: what is between the houses takes no memory."""
    boxes, far = two_rooms([(2.0, 0.9)]), np.array([1000.0, 1000.0, 0.0])
    one = survey_of(boxes_scene(boxes))
    two = survey_of(boxes_scene([*boxes, *((np.add(low, far), np.add(high, far)) for low, high in boxes)]))
    in_one, in_two = free_space(one), free_space(two)
    assert in_two.grid.nx * in_two.grid.ny > 400_000_000
    for name in ("centre", "doorway"):
        alone = in_one.position_m(getattr(find_rooms(in_one, 0), name)) + one.scene.offset_m
        both = in_two.position_m(getattr(find_rooms(in_two, 0), name)) + two.scene.offset_m
        assert alone.shape[0] == {"centre": 2, "doorway": 1}[name]
        expected = np.concatenate([alone, alone + far])
        assert both.shape == expected.shape
        assert (np.linalg.norm(both[:, None] - expected, axis=2).min(axis=0) <= 1.5 * in_one.grid.cell_m).all()


@pytest.mark.slow
@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    middle=st.floats(0.8, 3.2),
    width=st.floats(0.7, 1.3),
    thickness=st.floats(0.08, 0.4),
    angle=st.floats(0, 3.1),
)
def test_a_doorway_between_two_rooms_is_found_at_its_middle_in_any_direction(
    boxes_scene: MAKES, two_rooms: Callable[..., list], middle: float, width: float, thickness: float, angle: float
) -> None:
    scene = boxes_scene(two_rooms([(middle, width)], thickness_m=thickness), angle_rad=angle)
    survey = survey_of(scene)
    space = free_space(survey)
    rooms = find_rooms(space, 0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = turn @ [4.0 + thickness / 2, middle]
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    assert rooms.doorway.size == 1
    placed = centre_in_doorways(engine, space.position_m(rooms.doorway))[0]
    # Chords are 5 degrees apart: the shortest is turned by half of that at most.
    assert np.linalg.norm(placed[:2] - expected) <= 0.04
    across = turn @ [0.0, 1.0]
    assert abs((placed[:2] - expected) @ across) <= 0.02


def test_both_doors_between_the_same_rooms_are_found(boxes_scene: MAKES, two_rooms: Callable[..., list]) -> None:
    space = free_space(survey_of(boxes_scene(two_rooms([(0.8, 0.9), (3.1, 0.8)]))))
    assert off_by(space, find_rooms(space, 0).doorway, (4.1, 0.8), (4.1, 3.1)) <= 0.15


def test_rooms_have_their_centres_in_the_middle(boxes_scene: MAKES, two_rooms: Callable[..., list]) -> None:
    space = free_space(survey_of(boxes_scene(two_rooms([(1.3, 0.9)]))))
    rooms = find_rooms(space, 0)
    centre = space.position_m(rooms.centre)[:, :2]
    # The larger is a square; in the smaller, 3 x 4 m, all places of a middle line of 1 m are as far from walls.
    assert off_by(space, rooms.centre, (2.0, 2.0), (5.7, 2.0)) <= 0.11
    assert centre.shape == (2, 2)


@pytest.mark.slow
@pytest.mark.parametrize("doors", [[], [(2.0, 3.9)]])
def test_walls_without_doors_and_openings_as_wide_as_the_room_have_no_doorways(
    boxes_scene: MAKES, two_rooms: Callable[..., list], doors: list
) -> None:
    space = free_space(survey_of(boxes_scene(two_rooms(doors))))
    assert find_rooms(space, 0).doorway.size == 0


def test_a_doorway_that_the_mover_does_not_fit_through_is_none(
    boxes_scene: MAKES, two_rooms: Callable[..., list]
) -> None:
    space = free_space(survey_of(boxes_scene(two_rooms([(2.0, 0.4)]))))
    assert find_rooms(space, 0).doorway.size == 0
    assert find_rooms(space, 0).centre.size == 2


def test_places_anywhere_in_a_doorway_are_moved_to_its_middle_and_those_in_the_open_stay(
    boxes_scene: MAKES, two_rooms: Callable[..., list]
) -> None:
    survey = survey_of(boxes_scene(two_rooms([(1.3, 0.9)])))
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    inside = np.array([(x, y, 0.0) for x in (4.02, 4.1, 4.18) for y in (1.0, 1.3, 1.55)])
    moved = centre_in_doorways(engine, inside)
    assert np.abs(moved - [4.1, 1.3, 0.0]).max() <= 0.03
    in_the_open = np.array([[2.0, 2.0, 0.0]])
    assert np.array_equal(centre_in_doorways(engine, in_the_open), in_the_open)
    assert centre_in_doorways(engine, np.empty((0, 3))).shape == (0, 3)


@pytest.mark.slow
def test_every_inner_door_of_the_duplex_has_a_place_in_its_middle(real_scene: MAKES) -> None:
    """By the boxes of the door elements, which the search does not look at."""
    shut = real_scene("duplex")
    survey = survey_of(without_door_leaves(shut, Doors.ALL))
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    space = free_space(survey)
    doorway = np.concatenate([find_rooms(space, floor).doorway for floor in range(len(survey.floors))])
    found = centre_in_doorways(engine, space.position_m(doorway))
    n_inner = 0
    for number, element in enumerate(shut.elements):
        if element.kind == "IfcDoor" and "1250mm" not in element.name:  # those two lead outside, to no ground
            corners = shut.vertices_m[shut.triangles[shut.element_of_triangle == number]].reshape(-1, 3)
            middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
            middle[2] = corners[:, 2].min()
            assert np.linalg.norm(found - middle, axis=1).min() <= 0.05, element.name
            n_inner += 1
    assert n_inner == 12


# ------------------------------------------------------------------------------------------------- landings
def stairs_to(platform: tuple[float, float]) -> list:
    """Boxes: six steps of 0.3 x 1.2 m, 0.2 m high each, from x = 4 down to 2.2, to a platform of that size at 1.4 m."""
    steps = [((4.0 - 0.3 * (k + 1), 1.4, 0.0), (4.0 - 0.3 * k, 2.6, 0.2 * (k + 1))) for k in range(6)]
    size_x, size_y = platform
    return [*steps, ((2.2 - size_x, 2.0 - size_y / 2, 0.0), (2.2, 2.0 + size_y / 2, 1.4))]


def test_a_landing_with_room_for_a_tripod_is_found_and_treads_are_not(
    boxes_scene: MAKES, two_rooms: Callable[..., list]
) -> None:
    survey = survey_of(boxes_scene([*two_rooms([], high_m=4.0), *stairs_to((0.9, 0.8))]))
    space = free_space(survey)
    landing = find_landings(space, ring_radius_m=0.2, apart_m=0.5)
    place = space.position_m(landing)
    assert landing.size == 1
    assert np.linalg.norm(place[0] - [1.75, 2.0, 1.4]) <= 0.06
    assert not space.on_ground[landing].any()
    assert find_landings(space, ring_radius_m=0.42, apart_m=0.5).size == 0


def test_a_landing_too_narrow_for_the_feet_is_none(boxes_scene: MAKES, two_rooms: Callable[..., list]) -> None:
    survey = survey_of(boxes_scene([*two_rooms([], high_m=4.0), *stairs_to((0.35, 1.2))]))
    space = free_space(survey)
    assert (space.ground_m > 1.3).sum() > 50
    assert find_landings(space, ring_radius_m=0.2, apart_m=0.5).size == 0


def test_a_large_landing_has_a_lattice_of_places_with_room_for_the_feet_each(
    boxes_scene: MAKES, two_rooms: Callable[..., list]
) -> None:
    low, high = np.array([1.3, 1.45]), np.array([2.2, 2.55])
    survey = survey_of(boxes_scene([*two_rooms([], high_m=4.0), *stairs_to((0.9, 1.1))]))
    space = free_space(survey)
    place = space.position_m(find_landings(space, ring_radius_m=0.2, apart_m=0.25))
    apart = np.linalg.norm(place[:, None] - place[None], axis=-1)[~np.eye(len(place), dtype=bool)]
    assert len(place) >= 4
    assert apart.min() >= 0.25 - 1e-9
    room = np.minimum(place[:, :2] - low, high - place[:, :2]).min(axis=1)
    assert (room >= 0.2 - 0.5 * space.grid.cell_m).all()


# -------------------------------------------------------------------------------------------------- flights
def flight_boxes(width_m: float, *, going_m: float = 0.3, riser_m: float = 0.2, top_m: float = 1.4) -> list:
    """Boxes of steps that climb from x = 3.4 towards x = 0, about y = 2, up to a landing of 0.8 m at `top_m`."""
    n = round(top_m / riser_m)
    low_y, high_y = 2.0 - width_m / 2, 2.0 + width_m / 2
    steps = [
        ((3.4 - going_m * (k + 1), low_y, 0.0), (3.4 - going_m * k, high_y, riser_m * (k + 1))) for k in range(n - 1)
    ]
    end = 3.4 - going_m * (n - 1)
    return [*steps, ((end - 0.8, low_y, 0.0), (end, high_y, top_m))]


def tread_below(x_m: np.ndarray, y_m: np.ndarray, width_m: float) -> np.ndarray:
    """Height of the steps of `flight_boxes` with their default sizes; 0 beside them."""
    tread = np.clip(np.floor((3.4 - x_m) / 0.3) + 1.0, 0.0, 7.0) * 0.2
    return np.where((np.abs(y_m - 2.0) < width_m / 2) & (x_m > 0.8), tread, 0.0)


@pytest.mark.parametrize("width_m", [0.7, 1.2])
def test_a_tripod_stands_on_a_flight_with_each_leg_on_a_tread(
    boxes_scene: MAKES, two_rooms: Callable[..., list], width_m: float
) -> None:
    survey = survey_of(boxes_scene([*two_rooms([], high_m=4.5), *flight_boxes(width_m)]))
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    places = find_positions(survey, SETTINGS, engine, floors=(0,))
    at = places.candidates.position_m[places.kind == KINDS.index("flight")]
    assert len(at) >= 3
    tread_m = tread_below(at[:, 0], at[:, 1], width_m)
    np.testing.assert_allclose(at[:, 2], tread_m + 1.5, atol=1e-4)
    assert tread_m.min() >= 0.4 - 1e-9  # lower ones are hardly above the floor
    apart_m = np.linalg.norm(at[:, None] - at[None], axis=-1)[~np.eye(len(at), dtype=bool)]
    assert apart_m.min() >= SETTINGS.grid_step_m - 1e-9
    angle = np.arange(360)[:, None] * np.pi / 180 + np.arange(3) * 2 * np.pi / 3
    for (x, y, _), below_m in zip(at.tolist(), tread_m.tolist(), strict=True):
        foot_m = tread_below(x + 0.35 * np.cos(angle), y + 0.35 * np.sin(angle), width_m)
        assert (np.abs(foot_m - below_m) <= 0.5).all(axis=1).any()


@pytest.mark.parametrize(
    "boxes",
    [
        pytest.param(flight_boxes(0.5), id="narrower than a tripod"),
        pytest.param(flight_boxes(1.2, top_m=0.8), id="hardly higher than the floor"),
    ],
)
def test_a_flight_on_which_no_tripod_stands_has_no_places(
    boxes_scene: MAKES, two_rooms: Callable[..., list], boxes: list
) -> None:
    space = free_space(survey_of(boxes_scene([*two_rooms([], high_m=4.5), *boxes])))
    assert find_flights(space, np.empty(0, np.int64), apart_m=0.5).size == 0


@pytest.mark.slow
def test_steps_as_wide_as_terrain_are_no_flight(boxes_scene: MAKES) -> None:
    slab = ((-8.0, -8.0, -0.2), (8.0, 8.0, 0.0))
    for half_m, is_flight in ((0.6, True), (3.0, False)):
        steps = [((0.3 * k, -half_m, 0.0), (0.3 * (k + 1), half_m, 0.16 * (k + 1))) for k in range(10)]
        space = free_space(survey_of(boxes_scene([slab, *steps])))
        place_m = space.position_m(find_flights(space, np.empty(0, np.int64), apart_m=0.5))
        assert (len(place_m) >= 4) == is_flight
        assert (np.abs(place_m[:, 1]) <= 0.35).all()


@pytest.mark.parametrize(("width_m", "stands"), [(0.9, True), (0.7, True), (0.58, False)])
def test_a_tripod_stands_in_a_door_that_leaves_nearly_its_clearance(
    boxes_scene: MAKES, two_rooms: Callable[..., list], width_m: float, stands: bool
) -> None:
    survey = survey_of(boxes_scene(two_rooms([(1.3, width_m)])))
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    places = find_positions(survey, SETTINGS, engine, floors=(0,))
    in_wall = np.abs(places.candidates.position_m[:, 0] - 4.1) < 0.1
    assert in_wall.any() == stands
