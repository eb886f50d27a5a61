"""Places: candidates on real ground and the rows of prior stations, against plans that are known exactly."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from stages import find_candidates, find_positions, tripods_of

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import KeepOut, PlanSettings, PriorStation, Scene, Site, Survey
from planner_core.positions.allowed_positions import KINDS, AllowedPositions, places_as_they_are
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import carrier_of, local_site
from planner_core.positions.rooms import find_rooms
from planner_core.scanner.load_scanner import load_scanner
from scenes_synthetic import build

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0, instrument_heights_m=(1.2, 1.5))
#: A door of 0.9 m between two rooms, see `two_rooms` in conftest.py.
DOOR = (1.3, 0.9)
NO_SITE = Site()


def opened(scene: Scene) -> tuple[Survey, ScanEngine]:
    survey = make_survey(scene, SETTINGS)
    return survey, open_engine(survey.scene, survey.patches, engine="open3d")


@pytest.fixture(scope="module")
def rooms(boxes_scene: Callable[..., Scene], two_rooms: Callable[..., list]) -> tuple[Survey, ScanEngine]:
    return opened(boxes_scene(two_rooms([DOOR])))


@pytest.fixture(scope="module")
def stairwell() -> tuple[Survey, ScanEngine]:
    return opened(build("stairwell").scene)


def places_of(
    of: tuple[Survey, ScanEngine], site: Site = NO_SITE, *, floors: tuple[int, ...] = (0,), grid_only: bool = False
) -> AllowedPositions:
    return find_positions(of[0], replace(SETTINGS, site=site, special_places=not grid_only), of[1], floors=floors)


def station(name: str, x: float, y: float, z: float, role: str, **more: object) -> PriorStation:
    return PriorStation(id=name, position_m=(x, y, z), role=role, **more)  # type: ignore[arg-type]


def plan_of(places: AllowedPositions, *kinds: str) -> np.ndarray:
    chosen = np.isin(places.kind, [KINDS.index(kind) for kind in kinds])
    return np.unique(places.candidates.position_m[chosen][:, :2], axis=0)


# ----------------------------------------------------------------------------------------------- the whole
def test_where_nothing_is_kept_out_the_grid_is_the_grid(rooms: tuple[Survey, ScanEngine]) -> None:
    plain = find_positions(rooms[0], replace(SETTINGS, special_places=False), rooms[1], floors=(0,))
    grid = find_candidates(rooms[0], SETTINGS, rooms[1], floors=(0,))
    assert plain.candidates.position_m.tobytes() == grid.position_m.tobytes()
    assert plain.candidates.instrument_height_m.tobytes() == grid.instrument_height_m.tobytes()
    assert plain.candidates.rejected == grid.rejected
    assert not plain.kind.any()
    assert plain.warnings == ()


def test_special_places_add_the_doorway_and_the_middle_of_the_rooms_at_every_height(
    rooms: tuple[Survey, ScanEngine],
) -> None:
    places = places_of(rooms)
    doorway = places.candidates.position_m[places.kind == KINDS.index("doorway")]
    assert np.abs(doorway - [[4.1, 1.3, 1.2], [4.1, 1.3, 1.5]]).max() <= 0.03
    grid, centres = plan_of(places, "grid"), plan_of(places, "centre")
    for middle in ((2.0, 2.0), (5.7, 2.0)):
        # Within the cell of the free space that it is in, or a candidate of the grid is as good.
        assert np.linalg.norm(np.concatenate([grid, centres]) - middle, axis=1).min() <= 0.11
    for place in centres:
        assert np.linalg.norm(grid - place, axis=1).min() > 0.1


def test_a_middle_at_which_the_grid_has_a_candidate_is_not_there_twice_and_stays_where_memory_is_short() -> None:
    of = opened(build("thin-walls").scene)
    places = places_of(of)
    space = places.reach.space
    middle = space.position_m(find_rooms(space, 0).centre)[:, :2]
    assert middle.shape[0] > 0
    everywhere = np.unique(places.candidates.position_m[:, :2], axis=0)
    assert np.linalg.norm(everywhere[:, None] - middle, axis=-1).min(axis=0).max() <= 0.1
    grid = find_candidates(*of[:1], SETTINGS, of[1], floors=(0,)).position_m[:, :2]
    at_middle = np.linalg.norm(grid[:, None] - middle, axis=-1).min(axis=1) <= 0.1
    assert at_middle.any()
    np.testing.assert_array_equal(plan_of(places, "centre"), np.unique(grid[at_middle], axis=0))


@pytest.mark.slow
def test_candidates_are_in_order_counted_and_the_same_twice(rooms: tuple[Survey, ScanEngine]) -> None:
    site = Site(prior=(station("A", 1.0, 1.0, 1.6, "scanned"),), keep_out=(KeepOut(((0, 0), (2, 0), (2, 2), (0, 2))),))
    one, two = places_of(rooms, site), places_of(rooms, site)
    found = one.candidates
    free = found.floor.size - len(one.prior)
    assert found.n_tried == free + sum(found.rejected.values())
    keys = (found.instrument_height_m, found.position_m[:, 0], found.position_m[:, 1], found.floor)
    assert np.array_equal(np.lexsort([key[:free] for key in keys]), np.arange(free))
    assert found.position_m.tobytes() == two.candidates.position_m.tobytes()
    assert one.kind.tobytes() == two.kind.tobytes()
    assert one.warnings == two.warnings


def test_every_candidate_passes_the_tests_for_a_tripod_again(rooms: tuple[Survey, ScanEngine]) -> None:
    """By rays of our own, in Open3D: as far from walls as asked in 64 directions, to what 8 directions leave open."""
    position = places_of(rooms).candidates.position_m
    angle = np.arange(64) * 2 * np.pi / 64 + 0.01
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(64)])
    hits = rooms[1].cast_rays(np.repeat(position, 64, axis=0), np.tile(around, (len(position), 1)), range_max_m=5.0)
    nearest = np.nanmin(hits.range_m.reshape(-1, 64), axis=1)
    assert nearest.min() >= SETTINGS.clearance_m * np.cos(np.pi / 8)


# --------------------------------------------------------------------------------------------- site: areas
def crossings(outline: tuple[tuple[float, float], ...], place: np.ndarray) -> int:
    """How often a ray from a place, in an odd direction, meets the outline: odd means inside."""
    way = np.array([np.cos(0.1234), np.sin(0.1234)])
    n = 0
    for a, b in zip(outline, (*outline[1:], outline[0]), strict=True):
        side = np.array(b) - a
        solved = np.linalg.solve(np.column_stack([way, -side]), np.array(a) - place)
        n += bool(solved[0] > 0 and 0 <= solved[1] < 1)
    return n


L_SHAPE = ((0.3, 0.3), (3.1, 0.3), (3.1, 1.1), (1.2, 1.1), (1.2, 3.7), (0.3, 3.7))
TRIANGLE = ((4.4, 2.1), (6.9, 2.4), (5.1, 3.9))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("outline", "access"), [(L_SHAPE, False), (TRIANGLE, False), (TRIANGLE, True), (L_SHAPE[::-1], True)]
)
def test_candidates_are_outside_keep_outs_and_inside_access(
    rooms: tuple[Survey, ScanEngine], outline: tuple[tuple[float, float], ...], access: bool
) -> None:
    free = places_of(rooms, grid_only=True).candidates.position_m
    within = np.array([crossings(outline, place) % 2 == 1 for place in free[:, :2]])
    places = places_of(rooms, Site(keep_out=(KeepOut(outline, access=access),)), grid_only=True)
    assert 5 < within.sum() < within.size - 5
    assert places.candidates.position_m.tobytes() == free[within if access else ~within].tobytes()
    assert places.candidates.rejected["in a keep-out"] == (~within if access else within).sum()


@pytest.mark.slow
def test_an_area_of_one_floor_leaves_the_others_alone(stairwell: tuple[Survey, ScanEngine]) -> None:
    of = stairwell
    everywhere = ((-1.0, -1.0), (9.0, -1.0), (9.0, 2.0), (-1.0, 2.0))
    free = places_of(of, grid_only=True, floors=(0, 1, 2)).candidates
    excluded = places_of(
        of, Site(keep_out=(KeepOut(everywhere, floor=of[0].floors[1].name.upper()),)), grid_only=True, floors=(0, 1, 2)
    ).candidates
    for index in (0, 2):
        assert (excluded.floor == index).sum() == (free.floor == index).sum() > 10
    assert (excluded.position_m[excluded.floor == 1][:, 1] >= 2.0).all()
    assert (excluded.floor == 1).sum() < (free.floor == 1).sum()
    only = places_of(of, grid_only=True, floors=(1,)).candidates
    assert np.array_equal(only.position_m, free.position_m[free.floor == 1])


def test_nothing_stands_within_the_radius_of_a_forbidden_place_at_any_height(rooms: tuple[Survey, ScanEngine]) -> None:
    free = places_of(rooms, grid_only=True).candidates.position_m
    site = Site(prior=(station("X", 2.0, 2.0, 1.9, "forbidden", radius_m=1.2),))
    places = places_of(rooms, site, grid_only=True)
    far = ((free[:, :2] - [2.0, 2.0]) ** 2).sum(axis=1) > 1.44
    assert 0 < far.sum() < far.size
    assert places.candidates.position_m.tobytes() == free[far].tobytes()
    assert places.candidates.rejected["at a forbidden position"] == (~far).sum()
    assert not places.prior


def test_a_forbidden_place_is_on_the_floor_it_stands_over_or_names(stairwell: tuple[Survey, ScanEngine]) -> None:
    of = stairwell
    free = places_of(of, grid_only=True, floors=(0, 1)).candidates
    x, y, z = free.position_m[free.floor == 1][0]
    above = Site(prior=(station("X", x, y, z, "forbidden", radius_m=0.8),))
    left = places_of(of, above, grid_only=True, floors=(0, 1)).candidates
    assert np.array_equal(left.position_m[left.floor == 0], free.position_m[free.floor == 0])
    assert (left.floor == 1).sum() < (free.floor == 1).sum()
    assert np.linalg.norm(free.position_m[free.floor == 0][:, :2] - [x, y], axis=1).min() < 0.8
    high_m = of[0].floors[1].elevation_m
    by_height = local_site(of[0], Site(prior=(station("X", 1.0, 1.0, high_m, "forbidden"),)))
    by_name = local_site(of[0], Site(prior=(station("X", 1.0, 1.0, 0.0, "forbidden", floor="f1"),)))
    assert by_height.forbidden[0].floor == by_name.forbidden[0].floor == 1


# ------------------------------------------------------------------------------------- site: entrances, carrier
def test_only_the_room_of_the_entrance_is_planned_and_the_others_are_sealed() -> None:
    scene = build("closed-rooms")
    of = opened(scene.scene)
    places = places_of(of, Site(entrances_m=((4.5, 2.0, 0.0),)))
    low, high = next(
        (np.min(room.outline_m, axis=0), np.max(room.outline_m, axis=0))
        for room in scene.rooms
        if room.name == "Room 2"
    )
    plan = places.candidates.position_m[:, :2]
    assert plan.shape[0] > 20
    assert ((plan > low) & (plan < high)).all()
    assert places.candidates.rejected["not reachable on foot"] > 20
    assert len(places.reach.unreachable) == 2


@pytest.mark.slow
def test_far_from_the_origin_a_site_is_told_in_the_frame_of_the_scene(
    boxes_scene: Callable[..., Scene], two_rooms: Callable[..., list]
) -> None:
    at = np.array([500_000.0, 5_400_000.0, 300.0])
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])

    def site(move: np.ndarray) -> Site:
        return Site(
            entrances_m=(tuple(np.array([1.0, 3.0, 0.0]) + move),),
            keep_out=(KeepOut(tuple(map(tuple, square + move[:2]))),),
            prior=(
                station("S", *(np.array([3.0, 1.0, 1.5]) + move), "locked"),
                station("X", *(np.array([5.5, 2.0, 1.5]) + move), "forbidden", radius_m=1.0),
            ),
        )

    boxes = two_rooms([DOOR])
    near = places_of(opened(boxes_scene(boxes)), site(np.zeros(3)))
    of = opened(boxes_scene(boxes, at_m=tuple(at)))
    far = places_of(of, site(at))
    assert of[0].scene.offset_m[0] != 0
    assert np.abs(far.candidates.position_m + of[0].scene.offset_m - at - near.candidates.position_m).max() < 1e-6
    assert np.array_equal(far.kind, near.kind)
    with pytest.raises(
        RequirementError, match=r"entrance: got \(500050.00, 5400000.00, 300.00\), expected a ground point"
    ):
        places_of(of, Site(entrances_m=((at[0] + 50.0, at[1], at[2]),)))


@pytest.mark.slow
def test_a_robot_that_is_too_wide_for_the_door_stays_in_its_room(rooms: tuple[Survey, ScanEngine]) -> None:
    wide = Site(entrances_m=((2.0, 3.0, 0.0),), carrier_radius_m=0.55, step_m=0.03, carrier_height_m=0.6)
    plan = places_of(rooms, wide).candidates.position_m
    assert plan[:, 0].max() < 4.7
    assert places_of(rooms).candidates.position_m[:, 0].max() > 6.0


def test_the_carrier_of_a_site_is_a_person_but_for_what_is_told() -> None:
    told = carrier_of(Site(carrier_radius_m=0.3, carrier_height_m=0.6, step_m=0.02, opens_doors=False))
    assert (told.radius_m, told.step_m, told.height_m, told.stairs_height_m) == (0.3, 0.02, 0.6, 0.6)
    assert not told.opens_doors
    assert carrier_of(Site()).radius_m == 0.25
    with pytest.raises(RequirementError, match="carrier's height_m"):
        carrier_of(Site(carrier_height_m=0.1))


def test_areas_and_places_on_floors_that_are_not_there_are_refused(rooms: tuple[Survey, ScanEngine]) -> None:
    with pytest.raises(RequirementError, match=r"keep-out 'lab': got the floor 'attic', expected one of F0"):
        places_of(rooms, Site(keep_out=(KeepOut(TRIANGLE, floor="attic", name="lab"),)))
    with pytest.raises(RequirementError, match="forbidden position 'X': got the floor 'F7'"):
        places_of(rooms, Site(prior=(station("X", 1.0, 1.0, 1.0, "forbidden", floor="F7"),)))


# ------------------------------------------------------------------------------------------ prior stations
def test_settled_stations_are_the_last_rows_at_their_exact_places(rooms: tuple[Survey, ScanEngine]) -> None:
    told = (
        station("B", 3.0, 1.0, 1.61, "scanned"),
        station("X", 1.0, 1.0, 1.0, "forbidden"),
        station("A", 5.123, 2.0, 1.5, "locked", instrument_height_m=1.47),
        station("K", 2.2, 3.0, 1.4, "kept"),
    )
    places = places_of(rooms, Site(prior=told))
    found = places.candidates
    rows = [each.row for each in places.prior]
    assert [each.place.station.id for each in places.prior] == ["B", "A", "K"]
    assert rows == list(range(found.floor.size - 3, found.floor.size))
    assert found.position_m[rows].tolist() == [[3.0, 1.0, 1.61], [5.123, 2.0, 1.5], [2.2, 3.0, 1.4]]
    assert found.instrument_height_m[rows] == pytest.approx([1.61, 1.47, 1.4])
    assert (places.kind[rows] == KINDS.index("prior")).all()
    assert places.rows_of("scanned", "kept").tolist() == [rows[0], rows[2]]
    assert places.warnings == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("x", "z", "height_m", "remarks"),
    [
        (4.1, 1.5, None, ("no valid tripod position", "not reachable on foot")),
        (20.0, 1.5, None, ("stands over no floor",)),
        (1.0, 1.5, 1.2, ("instrument height 1.200 m is given, but the sensor is 1.500 m above",)),
    ],
)
def test_an_oddly_placed_station_stays_and_is_warned_of(
    rooms: tuple[Survey, ScanEngine], x: float, z: float, height_m: float | None, remarks: tuple[str, ...]
) -> None:
    odd = station("A", x, 3.0, z, "scanned", instrument_height_m=height_m)
    places = places_of(rooms, Site(prior=(odd,)), grid_only=True)
    assert places.candidates.position_m[-1].tolist() == [x, 3.0, z]
    assert len(places.prior) == 1
    for remark in remarks:
        assert any(remark in line and "station A" in line for line in places.warnings), remark


def test_what_is_kept_from_an_earlier_plan_is_dropped_where_nobody_may_stand_and_what_is_locked_stays(
    rooms: tuple[Survey, ScanEngine],
) -> None:
    excluded = KeepOut(((0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5)))
    prior = (
        station("K1", 1.0, 1.0, 1.5, "kept"),
        station("L1", 1.0, 1.1, 1.5, "locked"),
        station("K2", 3.0, 3.0, 1.5, "kept"),
        station("K3", 3.0, 2.0, 1.5, "kept"),
        station("X", 3.1, 3.0, 1.5, "forbidden"),
    )
    places = places_of(rooms, Site(prior=prior, keep_out=(excluded,)), grid_only=True)
    assert [each.place.station.id for each in places.prior] == ["L1", "K3"]
    assert [line.split(":")[0] for line in places.warnings] == [
        "station K1 of the earlier plan is dropped",
        "locked station L1 is in a keep-out",
        "station K2 of the earlier plan is dropped",
    ]


def test_a_station_on_a_landing_has_its_height_over_the_landing(
    boxes_scene: Callable[..., Scene], two_rooms: Callable[..., list]
) -> None:
    steps = [((3.4 - 0.3 * (k + 1), 1.4, 0.0), (3.4 - 0.3 * k, 2.6, 0.2 * (k + 1))) for k in range(4)]
    boxes = [*two_rooms([DOOR], high_m=4.0), *steps, ((1.2, 1.6, 0.0), (2.2, 2.5, 1.0))]
    of = opened(boxes_scene(boxes))
    places = places_of(of, Site(prior=(station("A", 1.7, 2.05, 2.5, "scanned"),)))
    landing = places.candidates.position_m[places.kind == KINDS.index("landing")]
    assert np.abs(landing[:, :2] - [1.7, 2.05]).max() <= 0.26
    assert sorted(set(landing[:, 2].round(6))) == [2.2, 2.5]
    assert places.prior[0].place.instrument_height_m == pytest.approx(1.5)
    assert places.warnings == ()


# ------------------------------------------------------------------------------------------ somebody else's
def test_candidates_of_others_are_left_out_where_the_site_lets_nobody_stand(rooms: tuple[Survey, ScanEngine]) -> None:
    survey, engine = rooms
    grid = find_candidates(survey, SETTINGS, engine, floors=(0,))
    site = Site(
        entrances_m=((2.0, 2.0, 0.0),),
        keep_out=(KeepOut(((4.0, -1.0), (4.6, -1.0), (4.6, 5.0), (4.0, 5.0)), name="the door"),),
        prior=(station("X", 1.0, 1.0, 1.5, "forbidden", radius_m=0.8),),
    )
    places = places_as_they_are(tripods_of(survey, SETTINGS, engine), local_site(survey, site), grid)
    x, y = grid.position_m[:, 0], grid.position_m[:, 1]
    stays = (x < 4.0) & (np.hypot(x - 1.0, y - 1.0) > 0.8)
    assert 0 < np.count_nonzero(stays) < grid.floor.size
    np.testing.assert_array_equal(places.candidates.position_m, grid.position_m[stays])
    np.testing.assert_array_equal(places.candidates.instrument_height_m, grid.instrument_height_m[stays])
    assert places.allows(grid).tolist() == stays.tolist()
    gone = {reason: n - grid.rejected.get(reason, 0) for reason, n in places.candidates.rejected.items()}
    assert sum(gone.values()) == np.count_nonzero(~stays)
    assert gone["in a keep-out"] == np.count_nonzero((x > 4.0) & (x < 4.6)) > 0
    assert gone["not reachable on foot"] == np.count_nonzero(x > 4.6) > 0
    assert gone["at a forbidden position"] == np.count_nonzero((x < 4.0) & ~stays)
    assert [int(region.inside_m[0] > 4.6) for region in places.reach.unreachable] == [1]
    assert places.candidates.n_tried == grid.n_tried


def test_candidates_of_others_stay_as_they_are_without_a_site(rooms: tuple[Survey, ScanEngine]) -> None:
    grid = find_candidates(rooms[0], SETTINGS, rooms[1], floors=(0,))
    places = places_as_they_are(tripods_of(*rooms[:1], SETTINGS, rooms[1]), local_site(rooms[0], Site()), grid)
    assert places.candidates.position_m.tobytes() == grid.position_m.tobytes()
    assert places.candidates.rejected == grid.rejected
    assert places.warnings == ()


@pytest.mark.slow
def test_free_space_that_somebody_has_gives_the_same_places(rooms: tuple[Survey, ScanEngine]) -> None:
    survey, engine = rooms
    keep_out = KeepOut(((0, 0), (2, 0), (2, 2), (0, 2)))
    for site in (NO_SITE, Site(keep_out=(keep_out,))):
        asked = replace(SETTINGS, site=site)
        alone = find_positions(survey, asked, engine, floors=(0,))
        shared = find_positions(survey, asked, engine, floors=(0,), space=free_space(survey))
        assert (alone.reach.space.can_stand == shared.reach.space.can_stand).all()
        assert alone.candidates.position_m.tolist() == shared.candidates.position_m.tolist()
    assert alone.reach.space.can_stand.sum() < free_space(survey).can_stand.sum()
