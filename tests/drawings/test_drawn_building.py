"""The document of a drawn building: from recognition, corrected, and raised again; areas by shapely."""

from dataclasses import replace

import ifcopenshell
import pytest
import shapely
import shapely.affinity

from planner_core.drawings.drawn_building import (
    DrawnBuilding,
    DrawnOpening,
    DrawnStorey,
    DrawnWall,
    floor_plan_of,
    raised,
    read_drawn,
)
from planner_core.drawings.ifc_file import write_building
from planner_core.drawings.lift import recognised
from planner_core.errors import RequirementError, SceneError
from tests.drawings.drawn_buildings import draw_two_rooms

OUTER = shapely.box(0.0, 0.0, 6.5, 4.4)
ROOMS = [shapely.box(0.2, 0.2, 3.2, 4.2), shapely.box(3.3, 0.2, 6.3, 4.2)]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory) -> DrawnBuilding:
    path = tmp_path_factory.mktemp("drawn") / "house.dxf"
    draw_two_rooms(path)
    return recognised([path]).drawn


def with_storey(drawn: DrawnBuilding, **changes: object) -> DrawnBuilding:
    return drawn.model_copy(update={"storeys": (replace(drawn.storeys[0], **changes), *drawn.storeys[1:])})


def outlines(storey: DrawnStorey) -> list[shapely.Polygon]:
    return [shapely.Polygon(wall.outline) for wall in storey.walls]


def box_wall(id_: str, *bounds: float) -> DrawnWall:
    return DrawnWall(id_, tuple(shapely.box(*bounds).exterior.coords[:-1]))


@pytest.mark.slow
def test_walls_run_through_under_doors_and_windows(drawn):
    (storey,) = drawn.storeys
    assert len(storey.walls) == 5  # three sides of four are interrupted, and the wall between the rooms is
    through = shapely.union_all(outlines(storey))
    truth = OUTER - shapely.union_all(ROOMS)
    assert through.symmetric_difference(truth).area < 0.005
    plan = floor_plan_of(storey)
    cut = shapely.union_all([opening.area for opening in plan.openings])
    assert cut.area == pytest.approx(1.0 * 0.2 + 0.9 * 0.1 + 1.5 * 0.2, abs=1e-3)
    walls = shapely.union_all([wall.area for wall in plan.walls])
    assert walls.symmetric_difference(truth - cut).area < 0.005
    assert [(room.name, room.long_name) for room in plan.rooms] == [("101", "Office"), ("102", "Kitchen")]


def test_document_is_read_back_as_it_was_written(drawn):
    assert read_drawn(drawn.model_dump(mode="json", by_alias=True), "") == drawn


def test_wall_a_little_thicker_than_its_door_leaves_no_film_over_it(drawn):
    (storey,) = drawn.storeys
    between = shapely.box(3.2, 0.2, 3.3, 4.2)
    thicker = [
        box_wall(wall.id, 3.1999, 0.2, 3.305, 4.2)
        if shapely.Polygon(wall.outline).within(between.buffer(0.01))
        else wall
        for wall in storey.walls
    ]
    plan = floor_plan_of(replace(storey, walls=tuple(thicker)))
    (door,) = [each for each in plan.openings if between.buffer(0.01).contains(each.area)]
    walls = shapely.union_all([wall.area for wall in plan.walls])
    assert not walls.intersects(shapely.affinity.scale(door.area, xfact=3.0, yfact=0.99))
    assert len(plan.rooms) == 2


def test_deleted_wall_makes_one_room_of_two(drawn):
    (storey,) = drawn.storeys
    between = shapely.box(3.2, 0.2, 3.3, 4.2)
    walls = [wall for wall in storey.walls if not shapely.Polygon(wall.outline).within(between.buffer(0.01))]
    openings = [each for each in storey.openings if not shapely.Polygon(each.corners).within(between.buffer(0.01))]
    assert (len(walls), len(openings)) == (4, 2)
    (room,) = floor_plan_of(replace(storey, walls=tuple(walls), openings=tuple(openings))).rooms
    assert room.outline.symmetric_difference(shapely.union_all([*ROOMS, between])).area < 0.01


def test_added_wall_parts_a_room_and_a_deleted_door_leaves_a_wall(drawn):
    (storey,) = drawn.storeys
    added = replace(storey, walls=(*storey.walls, box_wall("N1", 0.2, 2.0, 3.2, 2.1)), openings=storey.openings[1:])
    plan = floor_plan_of(added)
    areas = sorted(round(room.outline.area, 2) for room in plan.rooms)
    assert areas == pytest.approx([3.0 * 1.8, 3.0 * 2.1, 12.0], abs=0.03)
    walls = shapely.union_all([wall.area for wall in plan.walls])
    assert walls.contains(shapely.box(1.01, 0.01, 1.99, 0.19))


def test_walls_that_enclose_little_have_a_floor_all_over_what_they_span(drawn):
    parallel = tuple(box_wall(f"W{n}", 6.0 * n, 0.0, 6.0 * n + 0.2, 9.0) for n in range(5))
    far = tuple(box_wall(f"X{n}", 60.0, 4.0 * n, 68.0, 4.0 * n + 0.2) for n in range(3))
    plan = floor_plan_of(replace(drawn.storeys[0], walls=(*parallel, *far), openings=(), texts=()))
    spanned = shapely.union_all([shapely.box(0, 0, 24.2, 9), shapely.box(60, 0, 68, 8.2)])  # fronts of glass
    assert plan.outline.area == pytest.approx(spanned.area, rel=0.05)
    assert len(plan.outline.geoms) == 2
    assert not (plan.outline - spanned.buffer(1e-3)).area
    (line,) = raised(with_storey(drawn, walls=parallel, openings=(), texts=())).warnings
    assert line.startswith("Level 1: its walls enclose 9 m² of the 20") and "--layer window=NAME" in line


def test_walls_without_a_room_are_told_where_they_span_no_more_than_they_fill(drawn):
    (line,) = floor_plan_of(
        replace(drawn.storeys[0], walls=(box_wall("W1", 0.0, 0.0, 4.0, 0.2),), openings=())
    ).warnings
    assert "its walls enclose no room" in line


def test_marked_passage_is_open_for_certain(drawn):
    opening = drawn.storeys[0].openings[1]
    names = {}
    for doubtful in (True, False):
        changed = replace(opening, kind="passage", doubtful=doubtful)
        building = raised(with_storey(drawn, openings=(*drawn.storeys[0].openings[:1], changed)))
        names[doubtful] = [element.name for element in building.storeys[0].elements if element.is_doubtful]
    assert names == {True: ["Gap 1 (doubtful)"], False: []}


def test_storeys_are_as_high_as_stated_and_slabs_fill_what_is_between(drawn):
    lower = replace(drawn.storeys[0], name="Ground", elevation_m=1.0, room_height_m=2.5)
    upper = replace(drawn.storeys[0], name="Upper", elevation_m=4.0, room_height_m=3.2)
    building = raised(drawn.model_copy(update={"storeys": (lower, upper)}))
    tops = [
        [
            (element.name, prism.low_m, prism.high_m)
            for element in storey.elements
            if element.kind == "IfcSlab"
            for prism in element.prisms
        ]
        for storey in building.storeys
    ]
    assert tops == [[("Floor", -0.2, 0.0), ("Ceiling", 2.5, 3.0)], [("Roof", 3.2, pytest.approx(3.4))]]
    assert [storey.elevation_m for storey in building.storeys] == [1.0, 4.0]
    with pytest.raises(SceneError, match="room height: got 2 m, expected at least the head of doors and windows"):
        raised(with_storey(drawn, room_height_m=2.0))


def test_north_is_in_the_ifc_file(drawn, tmp_path):
    write_building(raised(drawn.model_copy(update={"north_deg": 30.0})), tmp_path / "a.ifc")
    (context,) = ifcopenshell.open(tmp_path / "a.ifc").by_type(
        "IfcGeometricRepresentationContext", include_subtypes=False
    )
    assert context.TrueNorth.DirectionRatios == pytest.approx((0.5, 3**0.5 / 2))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "tlsplan:drawing:2"}, r"^a\.json: got the schema 'tlsplan:drawing:2', .* update tlsplan$"),
        ({"schema": "tlsplan:plan:1"}, "it is no drawn building of tlsplan"),
        ({"door_height_m": "high"}, r"^a\.json: door_height_m: got 'high', expected a finite number; correct it$"),
        (
            {"walls": [box_wall("N1", 1.0, 1.0, 1.0, 2.0)]},
            r"storeys\[0\]: wall N1: got 0 m², expected a simple outline of 0.004 m² or more",
        ),
        (
            {"walls": [DrawnWall("N1", ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)))]},
            "wall N1: got an outline that crosses itself",
        ),
        ({"walls": [box_wall("N1", 0.0, 0.0, 1.0, 1.0)] * 2}, r"walls: got the id N1 twice"),
        (
            {"openings": [DrawnOpening("N1", "door", ((1.0, 1.0), (2.0, 1.0), (2.0, 1.2), (1.0, 1.2)))]},
            "door N1: got 0 % of it on walls, expected 80 % or more; move it onto a wall, or delete it",
        ),
        (
            {"openings": [DrawnOpening("N1", "window", ((1.0, 0.0), (1.1, 0.0), (1.1, 0.2), (1.0, 0.2)))]},
            "window N1: got a width of 0.1 m, expected 0.2 m or more",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(drawn, change, message):
    entry = with_storey(drawn, **{k: tuple(v) for k, v in change.items() if k in ("walls", "openings")})
    written = entry.model_dump(mode="json", by_alias=True)
    written |= {key: value for key, value in change.items() if key not in ("walls", "openings")}
    with pytest.raises(RequirementError, match=message) as refused:
        read_drawn(written, "a.json: ")
    assert "\n" not in str(refused.value)


def test_storeys_through_each_other_are_refused(drawn):
    two = drawn.model_copy(update={"storeys": (drawn.storeys[0], replace(drawn.storeys[0], elevation_m=2.0))})
    with pytest.raises(RequirementError, match=r"storeys\[1\].elevation_m: got 2 m, expected 2.85 m or more"):
        read_drawn(two.model_dump(mode="json", by_alias=True), "")
