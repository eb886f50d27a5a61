"""Each check of a plan's plausibility, with a building that it doubts and a near miss that it does not."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from planner_core.coverage.plausibility import CHECKS, implausible, implausible_floors
from planner_core.coverage.survey import make_survey
from planner_core.model import (
    Coverage,
    Floor,
    Plan,
    PlanSettings,
    PointLimits,
    Requirements,
    Room,
    Scene,
    Station,
    Survey,
)
from planner_core.positions.free_space import free_space
from planner_core.positions.reach import Reach, reachability
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.floors import find_floors
from tests.scene.floor_scenes import box, four_walls, scene_of

SETTINGS = PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0)
HEIGHT_M = 1.6
STOREY = (("Ground", 0.0),)
_SURVEYED: dict[int, tuple[Scene, Survey, Reach]] = {}


@cache
def hall(size_x: float, size_y: float, high: float = 3.0, *more, storeys=STOREY) -> Scene:
    return scene_of(
        [
            ("slab", "IfcSlab", 0, (0, 0, -0.2), (size_x, size_y, 0)),
            *four_walls(size_x, size_y, 0.0, high, 0),
            ("roof", "IfcRoof", 0, (0, 0, high), (size_x, size_y, high + 0.2)),
            *more,
        ],
        storeys,
    )


@cache
def cells(n_x: int, n_y: int, side: float, door: float = 1.0) -> Scene:
    """Rooms of one size beside and behind each other, with a door in the middle of each inner wall."""
    walls = []
    for number in range(1, n_x):
        x = number * side
        for row in range(n_y):
            mid = (row + 0.5) * side
            for low, high in ((row * side, mid - door / 2), (mid + door / 2, (row + 1) * side)):
                walls.append((f"x {x} {row} {low}", "IfcWall", 0, (x - 0.05, low, 0), (x + 0.05, high, 3.0)))
    for number in range(1, n_y):
        y = number * side
        for row in range(n_x):
            mid = (row + 0.5) * side
            for low, high in ((row * side, mid - door / 2), (mid + door / 2, (row + 1) * side)):
                walls.append((f"y {y} {row} {low}", "IfcWall", 0, (low, y - 0.05, 0), (high, y + 0.05, 3.0)))
    return hall(n_x * side, n_y * side, 3.0, *walls)


def at_random(n: int, size_x: float, size_y: float, seed: int = 0) -> list[tuple[float, float]]:
    place = np.random.default_rng(seed).uniform((0.6, 0.6), (size_x - 0.6, size_y - 0.6), (n, 2))
    return [(float(x), float(y)) for x, y in place]


def surveyed(scene: Scene) -> tuple[Survey, Reach]:
    """Survey and reach of a scene, made once."""
    if id(scene) not in _SURVEYED:
        survey = make_survey(scene, SETTINGS)
        _SURVEYED[id(scene)] = scene, survey, reachability(survey, free_space(survey))
    return _SURVEYED[id(scene)][1:]


def doubts(
    scene: Scene,
    at: list[tuple[float, float]],
    *,
    settings: PlanSettings = SETTINGS,
    own_m2: float = 5.0,
    covered_m2: float = 100.0,
) -> list[str]:
    """Lines on a plan with stations on the lowest floor."""
    survey, reach = surveyed(scene)
    none = np.zeros(survey.patches.n_patches)
    floor = survey.floors[0]
    stations = tuple(
        Station(f"S{n}", floor.id, n, np.array([*p, floor.elevation_m + HEIGHT_M]), HEIGHT_M, own_area_m2=own_m2)
        for n, p in enumerate(at, start=1)
    )
    plan = Plan(
        survey=survey,
        settings=settings,
        stations=stations,
        times_seen=none.astype(np.int32),
        achievable=none.astype(bool),
        coverage=Coverage(100.0, 100.0, covered_m2),
        coverage_by_floor=(),
        coverage_curve=(),
        links=(),
        connected=True,
        unseen=(),
        lower_bound=0,
        n_candidates=0,
        engine="none",
    )
    return list(implausible(plan, reach))


def doubts_of_floors(scene: Scene) -> list[str]:
    """Lines on the floors of a scene, before any plan; plans have them, too."""
    return list(implausible_floors(scene, find_floors(scene).floors))


def asking(**asked) -> PlanSettings:
    return replace(SETTINGS, requirements=Requirements(**asked))


# ------------------------------------------------------------------------------- stations per 1000 m2
@pytest.mark.parametrize(("n", "size_x", "is_doubted"), [(9, 12.0, True), (8, 12.0, False), (9, 9.5, False)])
def test_stations_per_ground_are_doubted_above_practice_but_in_small_buildings(n, size_x, is_doubted) -> None:
    lines = doubts(hall(size_x, 10.0), at_random(n, size_x, 10.0))
    assert bool(lines) == is_doubted
    if lines:
        assert lines == [
            "9 stations on 120 m2 of planned ground, 75 per 1000 m2, expected 10 to 70: no limit explains them, so "
            "furniture, niches or what hangs from ceilings hides much; leave out what the site does not have "
            "(--leave-out), or require a lower --coverage"
        ]


@pytest.mark.parametrize(
    ("settings", "own_m2", "cause"),
    [
        (asking(seen_from=2), 5.0, "each surface is required from 2 stations"),
        (asking(limits=PointLimits(range_m=3.0)), 5.0, "the required range of 3 m holds on the floor within 2.5 m"),
        (asking(limits=PointLimits(incidence_rad=math.radians(60))), 5.0, "incidence of 60° holds on the floor within"),
        (asking(limits=PointLimits(spacing_m=0.003)), 5.0, "the required spacing of 3 mm holds on the floor within"),
        (
            asking(overlap=0.6),
            0.5,
            "9 of them add less than 1 m2 each and connect the others, by links of at least 99 % prob",
        ),
        (asking(overlap=0.6, network="none"), 0.5, "no limit explains them"),
    ],
)
def test_many_stations_are_explained_by_what_is_required(settings, own_m2, cause) -> None:
    (line,) = doubts(hall(12.0, 10.0), at_random(9, 12.0, 10.0), settings=settings, own_m2=own_m2)
    assert cause in line


def test_many_stations_are_explained_by_small_rooms() -> None:
    middles = [(4 * x + 2.0, 4 * y + 2.0) for x in range(4) for y in range(2)]
    doors = [(4.0 * x, 2.0) for x in (1, 2, 3)]
    (line,) = doubts(cells(4, 2, 4.0), [*middles, *doors])
    assert line.startswith("11 stations on 128 m2 of planned ground, 86 per 1000 m2, expected 10 to 70: 8 rooms of 1")
    assert "take 1.4 each, and practice is up to 2" in line


@pytest.mark.parametrize(
    ("size_x", "at", "words"),
    [
        (20.0, [(5.0, 5.0)], "rooms measure 400 m2 on average and the scanner reaches 130 m"),
        (9.0, [(5.0, 5.0)], ""),  # one station more is within practice
        (20.0, at_random(4, 20.0, 20.0), ""),
    ],
)
def test_few_stations_of_a_hall_are_doubted_unless_one_more_would_do(size_x, at, words) -> None:
    lines = doubts(hall(size_x, 20.0, 6.0), at)
    assert [words in line for line in lines] == ([True] if words else [])


def test_few_stations_are_explained_by_coverage_and_by_rooms_seen_from_outside() -> None:
    (line,) = doubts(hall(20.0, 20.0), [(5.0, 5.0)], settings=asking(coverage=0.5))
    assert "only 50 % are required" in line
    lines = doubts(cells(4, 3, 4.5), [(2.0, 2.0)])
    assert [line.split(": ")[1].split(";")[0] for line in lines] == ["each scans several of 12 rooms"]


def test_few_stations_that_do_not_meet_the_coverage_are_not_doubted() -> None:
    assert doubts(hall(20.0, 20.0), [(5.0, 5.0)], covered_m2=50.0) == []


# ------------------------------------------------------------------------------------ storeys per height
def storeys(upper_m: float, top_m: float) -> Scene:
    """Two floors with suspended ceilings at 2.6 m above each."""
    parts = [
        *four_walls(9, 9, 0.0, top_m, 0),
        ("ceiling", "IfcCovering.CEILING", 0, (0.2, 0.2, 2.6), (8.8, 8.8, 2.65)),
        ("upper slab", "IfcSlab", 1, (0, 0, upper_m - 0.2), (9, 9, upper_m)),
        ("upper ceiling", "IfcCovering.CEILING", 1, (0.2, 0.2, upper_m + 2.6), (8.8, 8.8, upper_m + 2.65)),
    ]
    return scene_of(
        [
            ("slab", "IfcSlab", 0, (0, 0, -0.2), (9, 9, 0)),
            *parts,
            ("roof", "IfcRoof", 1, (0, 0, top_m), (9, 9, top_m + 0.2)),
        ],
        (("Ground", 0.0), ("Upper", upper_m)),
    )


def test_figures_outside_a_range_never_read_as_within() -> None:
    (stations, *_) = CHECKS
    assert [stations.written(figure) for figure in (70.4, 70.6, 9.6, 12.4)] == ["71", "71", "9", "12"]
    assert stations.written(70.04, 1) == "70.1"


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (storeys(6.4, 10.0), "rooms of floor 'Ground' are 2.6 m high and floor 'Upper' follows 6.4 m above, with"),
        (storeys(5.4, 9.0), ""),
        (storeys(3.2, 13.0), "rooms of floor 'Upper' are 2.6 m high and the building ends 10.0 m above"),
        (storeys(3.2, 11.0), ""),
        (hall(9.0, 9.0, 12.0), ""),
    ],
    ids=["storey lost between", "plenum", "storeys lost above", "attic", "hall"],
)
def test_height_without_a_floor_is_doubted_where_a_storey_fits(scene, words) -> None:
    lines = doubts_of_floors(scene)
    assert [words in line for line in lines] == ([True] if words else [])


@pytest.mark.parametrize(("rise_m", "is_doubted"), [(1.9, True), (2.1, False)])
def test_floors_closer_than_a_storey_are_doubted(rise_m, is_doubted) -> None:
    raised = ("upper slab", "IfcSlab", 1, (0, 0, rise_m - 0.05), (9, 9, rise_m))
    scene = hall(9.0, 9.0, rise_m + 3.0, raised, storeys=(("Ground", 0.0), ("Upper", rise_m)))
    lines = doubts_of_floors(scene)
    assert bool(lines) == is_doubted
    if lines:
        assert lines[0].startswith("floors 'Ground' and 'Upper' lie 1.90 m over each other, expected 2 m or more")


def test_floors_of_wings_half_a_storey_apart_are_as_high_as_where_they_lie_over_each_other() -> None:
    # The ground has two heights, 0 and 1.2 m; the upper floor lies over the lower wing alone, 1.8 m above the other.
    scene = scene_of(
        [
            ("slab", "IfcSlab", 0, (0, 0, -0.2), (6, 9, 0)),
            ("slab, wing", "IfcSlab", 0, (6, 0, 1.0), (15, 9, 1.2)),
            ("upper slab", "IfcSlab", 1, (0, 0, 2.8), (6, 9, 3.0)),
            *four_walls(15, 9, 0.0, 6.0, 0),
            ("roof", "IfcRoof", 1, (0, 0, 6.0), (15, 9, 6.2)),
        ],
        (("Ground", 0.0), ("Upper", 3.0)),
    )
    ground, upper = find_floors(scene).floors
    assert upper.elevation_m - ground.elevation_m == pytest.approx(1.8)
    assert implausible_floors(scene, (ground, upper)) == ()


@pytest.mark.parametrize(("size_m", "is_doubted"), [(3.0, False), (9.0, True)], ids=["turret", "storeys"])
def test_height_of_a_building_is_that_over_a_part_of_its_ground(size_m, is_doubted) -> None:
    ceiling = ("ceiling", "IfcCovering.CEILING", 0, (0.2, 0.2, 2.6), (8.8, 8.8, 2.65))
    above = [("top", "IfcRoof", 0, (0, 0, 14.0), (size_m, size_m, 14.2)), *four_walls(size_m, size_m, 3.2, 14.0, 0)]
    scene = hall(9.0, 9.0, 3.0, ceiling, *above)
    lines = doubts_of_floors(scene)
    assert ["the building ends 14.2 m above" in line for line in lines] == [True] * is_doubted


# ----------------------------------------------------------------------------------------- rooms entered
def room(name: str, low, high) -> Room:
    vertices, triangles = box(low, high)
    return Room(name, "", name, 0, vertices, triangles.astype(np.int32))


def with_shut_rooms(n_shut: int, *, filled: bool = False) -> Scene:
    """Six rooms of 3 x 3 m along a corridor; of some the doors are walled up, or the room is full."""
    parts = [("corridor", "IfcWall", 0, (0, 3.0, 0), (18, 3.1, 3.0))] if n_shut == 6 and not filled else []
    for number in range(6):
        x = 3.0 * number
        if number:
            parts.append((f"between {number}", "IfcWall", 0, (x - 0.05, 0.2, 0), (x + 0.05, 3.0, 3.0)))
        gap = 0.0 if number < n_shut and not filled else 1.0
        parts.append((f"left {number}", "IfcWall", 0, (x, 3.0, 0), (x + 1.5 - gap / 2, 3.1, 3.0)))
        parts.append((f"right {number}", "IfcWall", 0, (x + 1.5 + gap / 2, 3.0, 0), (x + 3.0, 3.1, 3.0)))
        if filled and number < n_shut:
            parts.append((f"shelf {number}", "IfcFurniture", 0, (x + 0.1, 0.2, 0.1), (x + 2.9, 2.95, 2.5)))
    names = [room(f"R{k}", (3 * k + 0.1, 0.2, 0), (3 * k + 2.9, 3.0, 3.0)) for k in range(6)]
    corridor = room("Corridor", (0.2, 3.1, 0), (17.8, 5.8, 3.0))
    shaft = room("Shaft", (0.3, 0.3, 0), (0.6, 0.6, 3.0))
    return replace(hall(18.0, 6.0, 3.0, *parts), rooms=(*names, corridor, shaft))


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (
            with_shut_rooms(4),
            "3 of 7 rooms of the file can be entered, 43 %, expected 67 to 100 %: no door leads to 4 ",
        ),
        (with_shut_rooms(2), ""),
        (with_shut_rooms(4, filled=True), "no room for a tripod is in 4 ('R0', 'R1', 'R2' ...)"),
        (with_shut_rooms(0), ""),
    ],
    ids=["walled up", "two are", "full", "all open"],
)
def test_rooms_that_cannot_be_entered_are_doubted_where_many(scene, words) -> None:
    lines = doubts(scene, at_random(4, 17.0, 2.0))
    assert [words in line for line in lines] == ([True] if words else [])


def test_rooms_where_no_floor_was_found_are_named_as_such() -> None:
    scene = with_shut_rooms(0)
    above = tuple(room(f"U{k}", (3 * k, 0, 5.0), (3 * k + 3, 3, 8.0)) for k in range(6))
    (line,) = doubts(replace(scene, rooms=(*scene.rooms, *above)), at_random(4, 17.0, 2.0))
    assert "7 of 13 rooms" in line and "no floor was found at 6 ('U0', 'U1', 'U2' ...); load the file with the" in line


# ------------------------------------------------------------------------------------ ground and footprint
def dock(size_y: float) -> Scene:
    """A hall of 20 x 10 m whose only slab is a dock along one wall."""
    return scene_of(
        [
            ("dock", "IfcSlab", 0, (0, 0, -0.2), (20, size_y, 0)),
            *four_walls(20, 10, -1.2, 5.0, 0),
            ("roof", "IfcRoof", 0, (0, 0, 5.0), (20, 10, 5.2)),
        ],
        STOREY,
    )


def gallery() -> Scene:
    deck = ("deck", "IfcSlab", 1, (0, 0, 3.3), (20, 2, 3.5))
    return hall(20.0, 10.0, 7.0, deck, storeys=(("Ground", 0.0), ("Gallery", 3.5)))


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (dock(2.0), "ground of floor 'Ground' is 40 m2, and 206 m2 lie between the walls at its height, 19 %"),
        (dock(5.0), ""),
        (gallery(), ""),
    ],
    ids=["dock", "half", "gallery"],
)
def test_ground_is_doubted_against_what_its_walls_enclose(scene, words) -> None:
    lines = doubts_of_floors(scene)
    assert [words in line for line in lines] == ([True] if words else [])


# ------------------------------------------------------------------------------------------------- extent
@pytest.mark.parametrize(
    ("size_x", "size_y", "words"),
    [
        (
            410.0,
            1.4,
            "410 m long, expected 3 to 400 m: the scene was read in units of 1 m, which may be wrong; if so, ",
        ),
        (390.0, 1.4, ""),
        (2.5, 2.0, "the planned floors are 2.5 m long, expected 3 to 400 m"),
        (3.2, 2.0, ""),
    ],
)
def test_length_of_floors_is_doubted_where_nothing_built_is_as_long(size_x, size_y, words) -> None:
    lines = doubts_of_floors(hall(size_x, size_y))
    assert [words in line for line in lines] == ([True] if words else [])


def test_length_in_a_unit_that_was_given_is_not_doubted() -> None:
    scene = hall(2.5, 2.0)
    assert doubts_of_floors(scene)
    given = replace(scene, source=replace(scene.source, given_metres_per_unit=1.0))
    assert doubts_of_floors(given) == []


@pytest.mark.slow
@pytest.mark.parametrize("scene", [dock(2.0), storeys(6.4, 10.0), hall(2.5, 2.0), hall(9.0, 9.0)])
def test_floors_alone_have_the_lines_of_the_plan_on_them(scene) -> None:
    lines = doubts_of_floors(scene)
    assert lines == doubts(scene, [(1.2, 1.0)], covered_m2=50.0)
    assert bool(lines) == (scene is not hall(9.0, 9.0))


def test_undersides_of_walls_taken_for_ground_are_doubted() -> None:
    scene = scene_of([*four_walls(12, 10, 0.0, 2.5, 0), ("between", "Mesh", 0, (0.2, 4, 0), (11.8, 4.2, 2.5))])
    low = np.flatnonzero((scene.vertices_m[:, 2][scene.triangles] == 0).all(axis=1)).astype(np.int32)
    floor = Floor("F0", "Level 1", 0.0, 11.0, low, np.array([[0.0, 0.0], [12.0, 10.0]]), "surface")
    (line,) = implausible_floors(scene, (floor,))
    assert line.startswith("ground of floor 'Level 1' is 11 m2, and 12") and "expected 33 % or more" in line


# -------------------------------------------------------------------------------------- stations per room
@pytest.mark.parametrize(("n", "side_m", "is_doubted"), [(4, 4.4, True), (4, 6.0, False), (3, 3.5, False)])
def test_room_is_doubted_where_it_has_many_stations_for_its_ground(n, side_m, is_doubted) -> None:
    lines = doubts(hall(side_m, side_m), at_random(n, side_m, side_m))
    assert [line.split(" of ")[0] for line in lines] == (["room about (2.2, 2.2) on floor 'Ground'"] * is_doubted)


@pytest.mark.parametrize(
    ("at", "covered_m2", "is_doubted"),
    [
        ([(4.0, 4.0), (2.0, 2.0), (6.0, 6.0)], 100.0, True),
        ([(4.0, 4.0), (8.0, 4.0), (2.0, 2.0)], 100.0, False),
        ([(4.0, 4.0), (2.0, 2.0), (6.0, 6.0)], 80.0, False),
    ],
    ids=["other room", "door", "not met"],
)
def test_large_room_without_a_station_is_doubted(at, covered_m2, is_doubted) -> None:
    lines = doubts(cells(2, 1, 8.0), at, covered_m2=covered_m2)
    assert len(lines) == is_doubted
    if lines:
        assert lines[0].startswith("no station stands in room about (11.9, 4.0) on floor 'Ground' (57 m2)")


def test_page_has_the_table_of_checks() -> None:
    page = (Path(__file__).parents[2] / "docs" / "method" / "plausibility.md").read_text(encoding="utf-8")
    rows = [f"| {check.quantity} | {check.expected} |" for check in CHECKS]
    assert "\n".join(["| measured | plausible |", "|---|---|", *rows, ""]) in page
