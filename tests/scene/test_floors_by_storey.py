"""Which storeys of a file are floors: buildings without slabs, ceilings, levels to draw at, single trades.

Ground in the open beside a storey: what a door leads to stays, the roof of a lower wing does not.
"""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.model import Room
from planner_core.scene.floors import find_floors, other_levels
from planner_core.scene.load import load_scene
from tests.reality_files import reality
from tests.scene.floor_scenes import box, four_walls, scene_of

HALL = [("Ground", 0.0), ("Upper", 3.5), ("Gallery", 6.0)]
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
WINDOW = ("window", "IfcWindow", 1, (9.87, 3.5, 3.9), (9.93, 4.5, 5.6))
DOOR = ("door", "IfcDoor", 1, (9.87, 3.5, 3.0), (9.93, 4.5, 4.7))


def office(ceiling_kind, *, storeys=(("Level 1", 0.0), ("Level 2", 4.0), ("Roof", 8.0))):
    """Two storeys of 12 x 9 m without slabs, with a suspended ceiling in each, and a parapet about the roof."""
    return scene_of(
        [
            *four_walls(12, 9, 0.0, 4.0, 0),
            ("ceiling 1", ceiling_kind, 0, (0.2, 0.2, 2.5), (11.8, 8.8, 2.55)),
            *four_walls(12, 9, 4.0, 8.0, 1),
            ("ceiling 2", ceiling_kind, 1, (0.2, 0.2, 6.5), (11.8, 8.8, 6.55)),
            *four_walls(12, 9, 8.0, 10.0, 2),
        ],
        storeys,
    )


@pytest.mark.parametrize("kind", ["IfcCovering.CEILING", "IfcCovering"])
def test_suspended_ceiling_is_no_floor_where_the_file_has_no_slabs(kind):
    report = find_floors(office(kind))
    assert [(f.name, f.elevation_m, f.origin) for f in report.floors] == [
        ("Level 1", 0.0, "storey-elevation"),
        ("Level 2", 4.0, "storey-elevation"),
    ]
    assert [f.ground_area_m2 for f in report.floors] == pytest.approx([12 * 9] * 2, rel=0.1)
    assert any("'Roof' is left out" in line for line in report.warnings)


def test_level_to_draw_ceilings_at_is_no_floor():
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.2), (12, 9, 0)),
        *four_walls(12, 9, 0.0, 3.0, 0),
        *four_walls(12, 9, 3.0, 5.5, 1),  # walls of a tall hall, drawn from the ceiling's level up
        ("roof", "IfcSlab", 2, (0, 0, 5.5), (12, 9, 5.8)),
    ]
    report = find_floors(scene_of(parts, [("Level 1", 0.0), ("Ceiling-East", 3.0), ("Roof", 5.8)]))
    assert [f.name for f in report.floors] == ["Level 1"]
    assert any("'Ceiling-East' is left out" in line for line in report.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Dachgeschoss", "Attic", "2nd floor", "Rooftop bar", "Tor 3", "1 - Piano Primo"])
def test_storey_whose_name_only_resembles_a_roof_is_a_floor(name):
    report = find_floors(office("IfcCovering.CEILING", storeys=((name, 0.0), ("Level 2", 4.0), ("Roof", 8.0))))
    assert [f.name for f in report.floors] == [name, "Level 2"]


@pytest.mark.parametrize("contained_in", [-1, 1, 2])
def test_walls_without_slab_enclose_the_storey_that_they_stand_on_wherever_they_are_contained(contained_in):
    sound = office("IfcCovering.CEILING")
    walls = [i for i, e in enumerate(sound.elements) if e.name.startswith("wall 0.0")]
    for moved in (walls[:2], walls):
        elements = [replace(e, storey=contained_in) if i in moved else e for i, e in enumerate(sound.elements)]
        report = find_floors(replace(sound, elements=tuple(elements)))
        assert [(f.name, f.ground_area_m2) for f in report.floors] == [
            (f.name, f.ground_area_m2) for f in find_floors(sound).floors
        ]


def test_walls_through_two_storeys_enclose_the_lower_one_where_the_upper_one_contains_them():
    parts = [*four_walls(12, 9, 0.0, 6.0, 1), ("roof", "IfcRoof", 2, (0, 0, 6.0), (12, 9, 6.2))]
    report = find_floors(scene_of(parts, [("Ground", 0.0), ("Upper", 3.0), ("Roof", 6.2)]))
    assert [(f.name, f.ground_area_m2) for f in report.floors] == [("Ground", 12 * 9), ("Upper", 12 * 9)]


def test_walls_from_the_footing_up_enclose_the_storey_that_names_them():
    parts = [*four_walls(12, 9, -1.2, 3.0, 1), ("roof", "IfcSlab", 2, (0, 0, 3.0), (12, 9, 3.2))]
    report = find_floors(scene_of(parts, [("Fundament", -1.2), ("Level 1", 0.0), ("Dach", 3.2)]))
    assert [(f.name, f.elevation_m) for f in report.floors] == [("Level 1", 0.0)]


@pytest.mark.parametrize(
    ("sill_m", "words"),
    [
        (0.05, "it is at the height of 'Ground'"),
        (0.9, "it is only 0.90 m above 'Ground'; two floors over each other are at least 1.8 m apart"),
        (1.6, "it is only 1.60 m above 'Ground'; two floors over each other are at least 1.8 m apart"),
    ],
)
def test_second_level_near_the_height_of_a_floor_is_left_out(sill_m, words):
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.2), (12, 9, 0)),
        *four_walls(12, 9, 0.0, 5.0, 0),
        *four_walls(12, 9, sill_m, 4.0, 1),
        ("roof", "IfcSlab", 2, (0, 0, 5.0), (12, 9, 5.2)),
    ]
    report = find_floors(scene_of(parts, [("Ground", 0.0), ("Sill", sill_m), ("Roof", 5.2)]))
    assert [f.name for f in report.floors] == ["Ground"]
    assert f"storey 'Sill' is left out: no floor slab, and {words}" in report.warnings


def test_landing_over_a_ground_that_is_not_in_the_file_does_not_make_the_floor():
    for kind in ("IfcSlab.LANDING", "IfcSlab"):
        parts = [
            *four_walls(12, 9, 0.0, 4.0, 0),
            ("landing", kind, 0, (1, 1, 1.95), (3, 3, 2.1)),
            ("roof", "IfcSlab", 1, (0, 0, 4.0), (12, 9, 4.2)),
        ]
        (floor,) = find_floors(scene_of(parts, [("Level 1", 0.0), ("Roof", 4.2)])).floors
        assert (floor.elevation_m, floor.origin) == (0.0, "storey-elevation")


def test_covering_on_its_slab_is_ground_and_one_that_hangs_is_not():
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.4), (12, 9, -0.2)),
        ("raised floor", "IfcCovering", 0, (0.2, 0.2, 0.15), (11.8, 8.8, 0.2)),
        *four_walls(12, 9, -0.2, 4.4, 0),
        ("ceiling", "IfcCovering", 0, (0.2, 0.2, 2.6), (11.8, 8.8, 2.62)),
        ("roof", "IfcSlab", 0, (0, 0, 4.4), (12, 9, 4.6)),
    ]
    scene = scene_of(parts, [("Ground", 0.0)])
    (floor,) = find_floors(scene).floors
    names = {scene.elements[i].name for i in scene.element_of_triangle[floor.ground_triangles]}
    assert "raised floor" in names and "ceiling" not in names
    assert floor.elevation_m == pytest.approx(0.2)


def test_walls_without_slabs_and_roof_are_floors_as_large_as_what_they_enclose():
    lintel = ("lintel", "IfcBeam", 0, (5, 0, 2.2), (7, 0.2, 2.4))
    parts = [*four_walls(12, 9, 0.0, 2.8, 0), lintel, *four_walls(12, 9, 3.0, 5.8, 1)]
    report = find_floors(scene_of(parts, [("00 begane grond", 0.0), ("01 verdieping", 3.0), ("02 dak", 6.0)]))
    assert [f.ground_area_m2 for f in report.floors] == pytest.approx([108.0, 108.0])


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        (
            "lamps",
            [
                (f"lamp {x} {y}", "IfcFlowTerminal", 0, (x, y, 2.4), (x + 0.6, y + 1.2, 2.5))
                for x in (1, 5, 9)
                for y in (1, 6)
            ],
        ),
        ("frames", [(f"post {i}", "IfcColumn", 0, (2 * i, 0, 0), (2 * i + 0.3, 0.3, 3)) for i in range(9)]),
        (
            "stairs",
            [
                (f"step {i}", "IfcStairFlight", 0, (i * 0.3, 0, i * 0.2), (i * 0.3 + 0.3, 6, i * 0.2 + 0.2))
                for i in range(9)
            ]
            + [("rail", "IfcRailing", 0, (30, 20, 0), (30.1, 20.1, 1))],
        ),
    ],
)
def test_single_trades_have_no_floor_and_say_so(name, parts):
    del name
    report = find_floors(scene_of(parts, [("Level 1", 0.0)]))
    assert report.floors == ()
    assert any("no floor found" in line for line in report.warnings)


def test_slabs_alone_are_planned_with_a_warning():
    parts = [("low", "IfcSlab", 0, (0, 0, -0.2), (9, 6, 0)), ("high", "IfcSlab", 1, (0, 0, 2.8), (9, 6, 3))]
    report = find_floors(scene_of(parts, [("Level 1", 0.0), ("Level 2", 3.0)]))
    assert [f.name for f in report.floors] == ["Level 1"]
    assert any("one trade of a building" in line for line in report.warnings)


def hall(*parts, lower_top=3.5, upper_foot=3.5, storeys=HALL):
    """A hall of 20 x 12 m with a slab, whose walls are drawn storey by storey, under a roof at 8 m."""
    slab = ("slab", "IfcSlab", 0, (0, 0, -0.2), (20, 12, 0))
    roof = ("roof", "IfcRoof", 1, (0, 0, 8), (20, 12, 8.2))
    walls = four_walls(20, 12, 0, lower_top, 0) + four_walls(20, 12, upper_foot, 8, 1)
    return scene_of([slab, *walls, roof, *parts], storeys)


def test_upper_walls_of_a_hall_are_no_floor():
    report = find_floors(load_scene(reality("hall_with_upper_walls.ifc")))
    assert [(f.name, f.origin) for f in report.floors] == [("00 Begane grond", "slab")]
    (line,) = [line for line in report.warnings if "is left out" in line]
    assert "'01 Eerste verdieping'" in line and "no door and no room" in line


@pytest.mark.slow
@pytest.mark.parametrize(
    "parts",
    [
        pytest.param([], id="two bands of walls"),
        pytest.param(four_walls(20, 12, 6, 8, 2), id="three bands of walls"),
        pytest.param(
            [(f"machine {x}", "IfcBuildingElementProxy", 0, (x, 2, 0), (x + 2, 10, 3)) for x in (2, 8, 14)],
            id="machines on the ground",
        ),
        pytest.param([("gate", "IfcDoor", 1, (5, 0, 0), (9, 0.2, 5))], id="a gate higher than the lower walls"),
        pytest.param([("frieze", "IfcWall", 1, (8, 0.2, 3.5), (8.2, 4, 8))], id="a wall that hangs"),
    ],
)
def test_storeys_of_wall_bands_around_a_hall_are_one_floor(parts):
    assert [f.name for f in find_floors(hall(*parts)).floors] == ["Ground"]


@pytest.mark.parametrize(
    "parts",
    [
        pytest.param([("door", "IfcDoor", 1, (5, 0, 3.5), (6, 0.2, 5.6))], id="door"),
        pytest.param([("desk", "IfcFurniture", 1, (5, 5, 3.5), (6, 6, 4.2))], id="furniture"),
        pytest.param([("flight", "IfcStairFlight", 0, (5, 5, 0), (6, 9, 3.45))], id="stairs"),
        pytest.param([("ceiling", "IfcCovering.CEILING", 0, (0.2, 0.2, 2.7), (19.8, 11.8, 2.75))], id="ceiling below"),
        pytest.param(
            [(f"partition {x}", "IfcWall", 1, (x, 0.2, 3.5), (x + 0.1, 11.8, 8)) for x in range(2, 20, 2)],
            id="partitions",
        ),
    ],
)
def test_storey_without_slab_that_people_use_is_a_floor(parts):
    assert [f.name for f in find_floors(hall(*parts, storeys=HALL[:2])).floors] == ["Ground", "Upper"]


def test_storey_without_slab_over_walls_that_leave_room_for_a_slab_is_a_floor():
    assert [f.name for f in find_floors(hall(lower_top=3.2, storeys=HALL[:2])).floors] == ["Ground", "Upper"]


def test_storey_without_slab_that_has_a_room_is_a_floor():
    corners_m, triangles = box((0.2, 0.2, 3.5), (19.8, 11.8, 8))
    room = Room("101", "Office", "id", 1, corners_m, triangles.astype(np.int32))
    scene = replace(hall(storeys=HALL[:2]), rooms=(room,))
    assert [f.name for f in find_floors(scene).floors] == ["Ground", "Upper"]


# ------------------------------------------------------------------------------------------------ mezzanines
@pytest.mark.parametrize("roof", ["IfcSlab", "IfcSlab.ROOF", "IfcRoof", None])
@pytest.mark.parametrize(("depth_m", "is_ground"), [(3.5, True), (7.0, False)], ids=["mezzanine", "deck over most"])
def test_mezzanine_is_a_level_of_its_floor_whatever_the_roof_is(roof, depth_m, is_ground):
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.2), (12, 8, 0)),
        *four_walls(12, 8, 0, 6, 0),
        ("mezzanine", "IfcSlab", 0, (0, 0, 2.6), (12, depth_m, 2.8)),
        ("lower roof", "IfcRoof", 0, (0, 0, 5.4), (12, depth_m, 5.6)),
    ]
    top = [("roof", roof, 0, (0, 0, 6), (12, 8, 6.2))] if roof else []
    scene = scene_of([*parts, *top], (("EG", 0.0),))
    (floor,) = find_floors(scene).floors
    assert floor.elevation_m == pytest.approx(0.0)
    expected = [(2.8, 12 * depth_m)] if is_ground else []
    assert [pytest.approx(level, abs=0.01) for level in expected] == other_levels(scene, floor)


def test_mezzanine_of_reality_is_a_level_of_its_floor():
    scene = load_scene(reality("mezzanine.ifc"))
    (floor,) = find_floors(scene).floors
    ((height_m, area_m2),) = other_levels(scene, floor)
    assert height_m == pytest.approx(2.8) and area_m2 == pytest.approx(34.8, abs=0.5)


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
