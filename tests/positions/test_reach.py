"""Reach: which rooms of buildings that are known can be walked to."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from stages import find_candidates

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import Candidates, Element, PlanSettings, Scene, Station, Survey
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import Carrier, WalkingZone
from planner_core.positions.outlines import over_polygon
from planner_core.positions.reach import Reach, reachability, reachable, stand_nodes, triangles_over
from planner_core.route.unreachable import reach_warnings
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene import array_rows
from planner_core.scene.build import scene_from_arrays
from scenes_synthetic import SyntheticScene, build
from scenes_synthetic.basement import ENCLOSED
from tests.scene.floor_scenes import four_walls, scene_of

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0, instrument_heights_m=(1.5,))
PERSON = Carrier()
KEYLESS = Carrier(opens_doors=False)
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("atrium", "corridor-comb")]


@cache
def survey_of(name: str) -> Survey:
    """Of a synthetic building; nobody changes it."""
    return make_survey(build(name).scene, SETTINGS)


def reach_of(survey: Survey, carrier: Carrier = PERSON, *entrances: tuple[float, float, float]) -> Reach:
    given = np.array(entrances) if entrances else None
    return reachability(survey, free_space(survey, carrier), given)


def room_of(scene: SyntheticScene, place: np.ndarray) -> str:
    """The room whose bounds a place is in: rooms here are rectangles."""
    for room in scene.rooms:
        low, high = np.min(room.outline_m, axis=0), np.max(room.outline_m, axis=0)
        if (place[:2] >= low).all() and (place[:2] <= high).all() and abs(place[2] - room.floor_m) < 0.1:
            return room.name
    return ""


def test_of_three_sealed_rooms_the_two_without_the_entrance_are_reported_with_their_areas() -> None:
    scene, survey = build("closed-rooms"), survey_of("closed-rooms")
    reach = reach_of(survey, PERSON, (4.5, 2.0, 0.0))
    assert [region.reached for region in reach.regions].count(True) == 1
    assert {room_of(scene, region.inside_m) for region in reach.unreachable} == {"Room 1", "Room 3"}
    for region in reach.unreachable:
        truth = scene.truth.floor_area_m2[room_of(scene, region.inside_m)]
        corners_m2 = (4 - np.pi) * PERSON.radius_m**2  # a round body does not get into them
        rim_m2 = (2 * 7 + 4) * 0.5 * reach.space.grid.cell_m
        assert region.floor == 0
        assert truth - corners_m2 - rim_m2 <= region.area_m2 <= truth


def test_candidates_in_unreachable_rooms_are_flagged() -> None:
    scene, survey = build("closed-rooms"), survey_of("closed-rooms")
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    candidates = find_candidates(survey, SETTINGS, engine, floors=(0,))
    flag = reachable(reach_of(survey, PERSON, (4.5, 2.0, 0.0)), candidates)
    in_middle = np.array([room_of(scene, p - [0.0, 0.0, 1.5]) == "Room 2" for p in candidates.position_m])
    assert 10 < in_middle.sum() < in_middle.size
    assert np.array_equal(flag, in_middle)


def test_candidates_inside_a_solid_are_not_reachable_and_all_others_are() -> None:
    scene = build("l-room")
    survey = make_survey(scene.scene, SETTINGS)
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    candidates = find_candidates(survey, SETTINGS, engine, floors=(0,))
    in_room = over_polygon(candidates.position_m[:, :2], np.array(scene.rooms[0].outline_m))
    assert np.array_equal(reachable(reach_of(survey), candidates), in_room)
    assert in_room.sum() > 50


def test_a_tripod_is_set_down_at_arms_length_but_not_through_a_wall() -> None:
    survey = survey_of("thin-walls")
    excluded = WalkingZone(np.array([[3.0, -1.0], [10.0, -1.0], [10.0, 5.0], [3.0, 5.0]]), 0)
    reach = reachability(survey, free_space(survey, PERSON, zones=(excluded,)), np.array([[1.5, 2.0, 0.0]]))
    wall_x = 3.0
    # Both are some 0.3 m from where a person stands west of the wall; the doorway lies far off.
    ground = np.array([[wall_x - 0.08, 0.6, 0.0], [wall_x + 0.09, 0.6, 0.0]])
    assert (stand_nodes(reach, ground) >= 0).tolist() == [True, False]
    heights = np.full(2, 1.4)
    candidates = Candidates(ground + np.array([0.0, 0.0, 1.4]), np.zeros(2, np.int32), heights, 2)
    assert reachable(reach, candidates).tolist() == [True, False]


@pytest.mark.slow
def test_without_entrances_equal_rooms_are_all_entered_and_small_ones_are_not() -> None:
    assert not reach_of(survey_of("closed-rooms")).unreachable
    basement = reach_of(survey_of("basement"))
    assert [round(region.area_m2) for region in basement.unreachable] == [12]


@pytest.mark.slow
def test_shut_doors_seal_rooms_for_a_mover_that_opens_none_and_open_ones_do_not() -> None:
    shut, survey = build("doors-shut"), survey_of("doors-shut")
    corridor = (1.0, 0.8, 0.0)
    assert not reach_of(survey_of("doors-open"), KEYLESS, corridor).unreachable
    unreachable = reach_of(survey, KEYLESS, corridor).unreachable
    assert sorted(room_of(shut, region.inside_m) for region in unreachable) == ["Room 1", "Room 2", "Room 3"]
    assert not reach_of(survey, PERSON, corridor).unreachable


def test_storeys_of_a_stairwell_are_reached_by_its_stairs() -> None:
    survey = survey_of("stairwell")
    reach = reach_of(survey, PERSON, (0.6, 1.0, 0.0))
    assert len(reach.regions) == 1
    assert reach.regions[0].reached
    assert all(area > 8.0 for area in reach.regions[0].area_by_floor_m2)
    robot = Carrier(radius_m=0.2, step_m=0.03, height_m=0.6, opens_doors=False)
    alone = reach_of(survey, robot, (0.6, 1.0, 0.0))
    assert sorted(region.floor for region in alone.unreachable) == [1, 2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spiral", "thin-walls", "double-height-hall", *SLOW])
def test_nothing_is_sealed_in_a_building_with_open_doorways(name: str) -> None:
    survey = survey_of(name)
    reach = reach_of(survey)
    reached = np.sum([r.area_by_floor_m2 for r in reach.regions if r.reached], axis=0)
    assert not reach.unreachable
    assert (reached > 30.0).all()


@pytest.mark.slow
def test_enclosed_rooms_of_the_basement_are_sealed_and_no_others() -> None:
    scene = build("basement")
    survey = make_survey(scene.scene, SETTINGS)
    unreachable = reach_of(survey, KEYLESS, (5.0, 5.0, 0.0)).unreachable
    assert sorted(room_of(scene, region.inside_m) for region in unreachable) == sorted(ENCLOSED)
    by_doors = reach_of(survey, PERSON, (5.0, 5.0, 0.0))
    assert [room_of(scene, region.inside_m) for region in by_doors.unreachable] == ["Shaft"]
    # The stairs lead on to the roof, which is no floor.
    assert by_doors.regions[0].area_m2 < sum(scene.truth.floor_area_m2.values())
    assert by_doors.space.ground_m[by_doors.region == 0].max() > 3.0


def test_a_thick_pier_is_no_sealed_room() -> None:
    scene = build("convex-room").scene
    corner = np.array([[x, y, z] for x in (3.0, 4.8) for y in (2.0, 3.8) for z in (0.0, 2.7)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    pier = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    built = scene_from_arrays(
        np.concatenate([scene.vertices_m, corner]),
        np.concatenate([scene.triangles, pier + len(scene.vertices_m)]),
        element_of_triangle=np.append(scene.element_of_triangle, np.full(12, len(scene.elements))),
        elements=(*scene.elements, Element("Pier", "IfcColumn", "pier")),
        storeys=scene.storeys,
    )
    reach = reach_of(make_survey(built, SETTINGS))
    hollow = [region for region in reach.regions if not region.reached]
    assert [region.in_solid for region in hollow] == [True]
    assert hollow[0].area_m2 > 2.0
    assert not reach.unreachable


def test_rooms_modelled_as_closed_surfaces_are_rooms() -> None:
    """Two boxes of one sheet each, 4 x 3 m, 0.2 m apart: no walls, slabs or ceilings of their own."""
    corner = np.array([[x, y, z] for x in (0.0, 4.0) for y in (0.0, 3.0) for z in (0.0, 2.6)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    rooms = scene_from_arrays(
        np.concatenate([corner, corner + np.array([4.2, 0.0, 0.0])]),
        np.concatenate([faces, faces + 8]),
        element_of_triangle=np.repeat([0, 1], 12),
        elements=(Element("West", "Mesh", "0"), Element("East", "Mesh", "1")),
    )
    unreachable = reach_of(make_survey(rooms, SETTINGS), PERSON, (2.0, 1.5, 0.0)).unreachable
    assert [region.inside_m[0] > 4.2 for region in unreachable] == [True]


def test_an_entrance_in_a_wall_or_in_the_air_is_refused() -> None:
    survey = survey_of("closed-rooms")
    space = free_space(survey)
    for wrong in ((-3.0, 2.0, 0.0), (1.5, 2.0, 1.5)):
        with pytest.raises(RequirementError, match="entrance: got"):
            reachability(survey, space, np.array([wrong]))


def test_regions_come_largest_first_and_cover_all_standing_ground() -> None:
    survey = survey_of("doors-shut")
    reach = reach_of(survey, KEYLESS)
    areas = [region.area_m2 for region in reach.regions]
    assert areas == sorted(areas, reverse=True)
    assert np.array_equal(reach.region >= 0, reach.space.can_stand)
    assert (reach.near_region[reach.region >= 0] == reach.region[reach.region >= 0]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "least_m2"),
    [pytest.param("duplex", (140.0, 90.0), marks=pytest.mark.campaign), ("fzk-haus", (90.0, 45.0))],
)
def test_both_storeys_of_a_real_house_are_one_walk(
    name: str, least_m2: tuple[float, float], real_scene: Callable[[str], Scene]
) -> None:
    survey = make_survey(real_scene(name), SETTINGS)
    reach = reach_of(survey)
    reached = np.sum([r.area_by_floor_m2 for r in reach.regions if r.reached], axis=0)
    assert (reached > least_m2).all()
    assert not reach.unreachable
    for region in reach.regions:
        if region.reached:
            assert min(region.area_by_floor_m2) > 40.0, "a storey without a way up"


@pytest.mark.parametrize("size", [7, 10_000])
def test_triangles_over_places_are_those_whose_bounds_hold_them(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array_rows, "_CHUNK", size)
    scene = build("two-rooms").scene
    corners = scene.vertices_m[scene.triangles][:, :, :2]
    rng = np.random.default_rng(2)
    # Also on edges and corners of the bounds.
    places = np.concatenate([rng.uniform(-1.0, 9.0, (40, 2)), corners.reshape(-1, 2)[::5]])
    found = triangles_over(scene, places)
    for place, over in zip(places, found, strict=True):
        holds = (corners.min(axis=1) <= place).all(axis=1) & (corners.max(axis=1) >= place).all(axis=1)
        assert over.tolist() == np.flatnonzero(holds).tolist()
    assert any(over.size for over in found)
    assert not all(over.size for over in found)


@pytest.mark.parametrize("stairs", [False, True], ids=["no way up", "stairs"])
def test_top_floor_that_no_way_leads_to_has_the_option_that_leaves_it_out(stairs: bool) -> None:
    # An attic ring above a hall, as the hollow upper walls of a church: rooms beneath it, and no stairs.
    walls = [*four_walls(9, 9, 0.0, 3.0, 0), *four_walls(9, 9, 3.2, 6.2, 0)]
    slabs = [("floor", "Mesh", 0, (0, 0, -0.2), (9, 9, 0)), ("upper", "Mesh", 0, (0, 1.6, 3.0), (9, 9, 3.2))]
    roof = ("roof", "Mesh", 0, (0, 0, 6.2), (9, 9, 6.4))
    steps = [(f"s{k}", "Mesh", 0, (0.6 + 0.28 * k, 0.4, 0), (0.88 + 0.28 * k, 1.6, 0.2 * (k + 1))) for k in range(16)]
    survey = make_survey(
        scene_of([*walls, *slabs, roof, *(steps if stairs else ())]),
        PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0),
    )
    reach = reachability(survey, free_space(survey))
    given = [Station(f"S{k}", f"F{k}", k, np.array([7.0, 6.0, z + 1.5]), 1.5) for k, z in enumerate([0.0, 3.2])]
    lines = [line for line in reach_warnings(survey, reach, given) if "no route joins" in line]
    without = "if nobody can enter 'Level 2', such as a roof, plan without it (--floor F0)"
    assert [without in line for line in lines] == ([] if stairs else [True])
