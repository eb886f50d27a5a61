"""Ground in the open beside a storey: what a door leads to stays, the roof of a lower wing does not."""

import pytest

from planner_core.scene.floors import find_floors
from tests.scene.floor_scenes import four_walls, scene_of

STOREYS = [("Ground", 0.0), ("Upper", 3.0), ("Roof", 6.0)]
BLOCK_M2, WING_M2 = 10 * 8, 6 * 8

#: A block of two storeys, 10 x 8 m, and a wing of one beside it, from x = 10 to 16 m, whose roof is at the height of
#: the block's upper floor. Of the upper storey's wall towards the wing, at x = 9.8 to 10 m, each test has its own.
HOUSE = [
    ("slab", "IfcSlab", 0, (0, 0, -0.2), (16, 8, 0)),
    *four_walls(16, 8, 0.0, 2.8, 0),
    ("floor", "IfcSlab", 1, (0, 0, 2.8), (10, 8, 3)),
    ("wall west", "IfcWall", 1, (0, 0, 3), (0.2, 8, 5.8)),
    ("wall south", "IfcWall", 1, (0.2, 0, 3), (9.8, 0.2, 5.8)),
    ("wall north", "IfcWall", 1, (0.2, 7.8, 3), (9.8, 8, 5.8)),
    ("roof", "IfcSlab", 2, (0, 0, 5.8), (10.8, 8, 6)),  # with eaves of 0.8 m over the wing
]
WING = ("flat roof", "IfcSlab", 1, (10, 0, 2.8), (16, 8, 3))


def towards_wing(sill_m, kind="IfcWall"):
    """A wall with an opening of 1 m width and 1.7 m height above a sill."""
    return [
        ("east 0", kind, 1, (9.8, 0, 3), (10, 3.5, 5.8)),
        ("east 1", kind, 1, (9.8, 4.5, 3), (10, 8, 5.8)),
        ("lintel", kind, 1, (9.8, 3.5, 3 + sill_m + 1.7), (10, 4.5, 5.8)),
        *([("sill", kind, 1, (9.8, 3.5, 3), (10, 4.5, 3 + sill_m))] if sill_m else []),
    ]


def upper(parts, house=HOUSE):
    """Area of the upper floor's ground, its eastern end, and what was told of a lower wing."""
    report = find_floors(scene_of([*house, *parts], STOREYS))
    assert [f.name for f in report.floors][:2] == ["Ground", "Upper"]
    floor = report.floors[1]
    assert floor.elevation_m == pytest.approx(3.0)
    return floor.ground_area_m2, floor.bounds_m[1, 0], [line for line in report.warnings if "lower wing" in line]


WINDOW = ("window", "IfcWindow", 1, (9.87, 3.5, 3.9), (9.93, 4.5, 5.6))
DOOR = ("door", "IfcDoor", 1, (9.87, 3.5, 3.0), (9.93, 4.5, 4.7))


@pytest.mark.slow
@pytest.mark.parametrize(
    "wall", [[("east", "IfcWall", 1, (9.8, 0, 3), (10, 8, 5.8))], [*towards_wing(0.9), WINDOW], towards_wing(0.9)]
)
def test_roof_of_a_lower_wing_behind_a_wall_is_no_ground(wall):
    area_m2, east_m, told = upper([*wall, WING])
    assert (area_m2, east_m) == (pytest.approx(BLOCK_M2, rel=0.02), pytest.approx(10.0))
    (line,) = told
    assert "'Upper': 48 m2 in the open" in line or "'Upper': 47 m2 in the open" in line


@pytest.mark.slow
@pytest.mark.parametrize("way", [towards_wing(0.0), [*towards_wing(0.0), DOOR], [*towards_wing(0.2), DOOR]])
def test_terrace_on_a_lower_wing_that_a_door_leads_to_is_ground(way):
    area_m2, east_m, told = upper([*way, WING])
    assert (area_m2, east_m) == (pytest.approx(BLOCK_M2 + WING_M2, rel=0.02), pytest.approx(16.0))
    assert told == []


def test_what_only_a_curtain_wall_cuts_off_is_ground():
    glazed = ("east", "IfcCurtainWall", 1, (9.8, 0, 3), (10, 8, 5.8))
    area_m2, _, told = upper([glazed, WING])
    assert area_m2 == pytest.approx(BLOCK_M2 + WING_M2, rel=0.02)
    assert told == []


@pytest.mark.parametrize(("gap_m", "is_ground"), [(0.3, True), (1.2, False)])
def test_terrace_begins_beyond_the_gap_of_a_facade_and_not_beyond_a_passage(gap_m, is_ground):
    """The facade is in another file: the opening of the inner leaf is there, the slabs don't touch."""
    wing = ("flat roof", "IfcSlab", 1, (10 + gap_m, 0, 2.8), (16, 8, 3))
    area_m2, _, told = upper([*towards_wing(0.0), wing])
    assert area_m2 == pytest.approx(BLOCK_M2 + (WING_M2 - 8 * gap_m if is_ground else 0), rel=0.02)
    assert bool(told) is not is_ground


def test_room_whose_roof_is_not_modelled_is_ground_though_no_door_is_either():
    east = ("east", "IfcWall", 1, (9.8, 0, 3), (10, 8, 5.8))
    walls = [
        ("wing east", "IfcWall", 1, (15.8, 0, 3), (16, 8, 5.8)),
        ("wing south", "IfcWall", 1, (10, 0, 3), (15.8, 0.2, 5.8)),
        ("wing north", "IfcWall", 1, (10, 7.8, 3), (15.8, 8, 5.8)),
    ]
    area_m2, _, told = upper([east, *walls, WING])
    assert area_m2 == pytest.approx(BLOCK_M2 + WING_M2, rel=0.02)
    assert told == []


def test_parapet_about_a_roof_makes_no_room_of_it():
    east = ("east", "IfcWall", 1, (9.8, 0, 3), (10, 8, 5.8))
    parapet = [
        ("parapet east", "IfcWall", 1, (15.8, 0, 3), (16, 8, 3.9)),
        ("parapet south", "IfcWall", 1, (10, 0, 3), (15.8, 0.2, 3.9)),
        ("parapet north", "IfcWall", 1, (10, 7.8, 3), (15.8, 8, 3.9)),
    ]
    area_m2, _, told = upper([east, *parapet, WING])
    assert area_m2 == pytest.approx(BLOCK_M2, rel=0.02)
    assert len(told) == 1


def test_paving_beside_a_house_is_ground_as_no_rooms_are_below():
    """The lower storey of a house on a slope: people walk on what lies on the earth, whichever way they come."""
    house = [("slab", "IfcSlab", 0, (0, 0, -0.2), (10, 8, 0)), *four_walls(10, 8, 0.0, 2.8, 0), *HOUSE[5:]]
    east = ("east", "IfcWall", 1, (9.8, 0, 3), (10, 8, 5.8))
    area_m2, east_m, told = upper([east, WING], house)
    assert (area_m2, east_m) == (pytest.approx(BLOCK_M2 + WING_M2, rel=0.02), pytest.approx(16.0))
    assert told == []


def test_terrace_stays_about_a_stair_house_that_is_smaller():
    """Most of the ground is in the open: what has the stair house's room behind its door is the floor."""
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.2), (16, 8, 0)),
        *four_walls(16, 8, 0.0, 2.8, 0),
        ("deck", "IfcSlab", 1, (0, 0, 2.8), (16, 8, 3)),
        ("stair house west", "IfcWall", 1, (5, 2, 3), (5.2, 6, 5.8)),
        ("stair house south", "IfcWall", 1, (5.2, 2, 3), (9.8, 2.2, 5.8)),
        ("stair house north", "IfcWall", 1, (5.2, 5.8, 3), (9.8, 6, 5.8)),
        ("stair house east 0", "IfcWall", 1, (9.8, 2, 3), (10, 3.5, 5.8)),
        ("stair house east 1", "IfcWall", 1, (9.8, 4.5, 3), (10, 6, 5.8)),
        ("stair house roof", "IfcSlab", 2, (5, 2, 5.8), (10, 6, 6)),
    ]
    report = find_floors(scene_of(parts, STOREYS))
    assert report.floors[1].ground_area_m2 == pytest.approx(16 * 8, rel=0.02)
    assert not any("lower wing" in line for line in report.warnings)
