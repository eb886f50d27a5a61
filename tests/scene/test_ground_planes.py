"""The ground of storeys without slabs: where the plane at a storey's elevation lies, and that it ends beams."""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings, Room
from planner_core.positions.free_space import free_space
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.floors import find_floors
from tests.scene.floor_scenes import box, four_walls, scene_of

SETTINGS = PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=1.0)
UPPER_M = 3.0
#: The plane's underside is as far below it.
SHEET_M = 0.0021


def walls_of(outline, z0, z1, storey):
    """Walls of 0.2 m along the sides of rectangles (x0, y0, x1, y1), without lids."""
    return [
        (f"wall {z0} {i} {k}", "IfcWall", storey, (*low, z0), (*high, z1))
        for i, (x0, y0, x1, y1) in enumerate(outline)
        for k, (low, high) in enumerate(
            [
                ((x0, y0), (x1, y0 + 0.2)),
                ((x0, y1 - 0.2), (x1, y1)),
                ((x0, y0 + 0.2), (x0 + 0.2, y1 - 0.2)),
                ((x1 - 0.2, y0 + 0.2), (x1, y1 - 0.2)),
            ]
        )
    ]


def two_storeys(outline, *parts):
    """Two storeys of rectangles without slabs; the upper one has a roof over each."""
    roofs = [("roof", "IfcRoof", 1, (x0, y0, 6.0), (x1, y1, 6.2)) for x0, y0, x1, y1 in outline]
    walls = walls_of(outline, 0.0, UPPER_M, 0) + walls_of(outline, UPPER_M, 6.0, 1)
    return scene_of([*walls, *roofs, *parts], [("Ground", 0.0), ("Upper", UPPER_M)])


def heights_over(survey, points):
    """Height of what is met straight above points 1.2 m over the ground."""
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    origins = np.array([[x, y, 1.2] for x, y in points])
    hits = engine.cast_rays(origins, np.tile([0.0, 0.0, 1.0], (len(points), 1)), range_max_m=100.0)
    return 1.2 + hits.range_m


def test_plane_of_a_storey_ends_beams_from_below_and_is_its_ground():
    scene = two_storeys([(0, 0, 8, 6)])
    survey = make_survey(scene, SETTINGS)
    np.testing.assert_allclose(heights_over(survey, [(1, 1), (4, 3), (7.5, 5.5)]), UPPER_M, atol=SHEET_M)
    for floor, elevation_m in zip(survey.floors, (0.0, UPPER_M), strict=True):
        corners = survey.scene.vertices_m[survey.scene.triangles[floor.ground_triangles]]
        assert floor.origin == "storey-elevation"
        assert (corners[:, :, 2] == elevation_m).all()
        assert (survey.floor_of_triangle[floor.ground_triangles] == survey.floors.index(floor)).all()
        assert survey.patches.triangle_area_m2[floor.ground_triangles].sum() == pytest.approx(8 * 6)
    np.testing.assert_array_equal(survey.scene.triangles[: scene.n_triangles], scene.triangles)
    named = [survey.scene.elements[i] for i in np.unique(survey.scene.element_of_triangle[scene.n_triangles :])]
    assert [(e.name, e.kind, e.storey) for e in named] == [
        ("Ground: ground at its elevation", "IfcSlab", 0),
        ("Upper: ground at its elevation", "IfcSlab", 1),
    ]


def test_plane_leaves_out_the_corner_of_an_l_shaped_house():
    survey = make_survey(two_storeys([(0, 0, 12, 4), (0, 4, 4, 10)]), SETTINGS)
    over = heights_over(survey, [(10, 2), (2, 8), (10, 8)])
    np.testing.assert_allclose(over, [UPPER_M, UPPER_M, np.nan], atol=SHEET_M)
    assert survey.floors[1].ground_area_m2 == pytest.approx(12 * 4 + 4 * 6, rel=0.02)


def test_plane_leaves_out_a_courtyard():
    wings = [(0, 0, 14, 4), (0, 10, 14, 14), (0, 4, 4, 10), (10, 4, 14, 10)]
    survey = make_survey(two_storeys(wings), SETTINGS)
    np.testing.assert_allclose(heights_over(survey, [(2, 7), (7, 7)]), [UPPER_M, np.nan], atol=SHEET_M)
    assert survey.floors[1].ground_area_m2 == pytest.approx(14 * 14 - 6 * 6, rel=0.02)


def test_plane_of_a_house_without_roof_is_the_whole_inside_of_its_walls():
    survey = make_survey(scene_of(four_walls(12, 9, 0.0, 2.8, 0), [("Ground", 0.0)]), SETTINGS)
    assert survey.patches.triangle_area_m2[survey.floors[0].ground_triangles].sum() == pytest.approx(12 * 9)


def test_joints_between_ceiling_panels_are_no_openings():
    panels = [("panel", "IfcCovering.CEILING", 0, (x, 0.2, 2.5), (x + 1.12, 5.8, 2.52)) for x in np.arange(0.2, 7, 1.3)]
    scene = scene_of([*four_walls(8, 6, 0.0, 3.0, 0), *panels], [("Ground", 0.0)])
    survey = make_survey(scene, SETTINGS)
    assert survey.floors[0].ground_area_m2 == pytest.approx(8 * 6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["IfcStairFlight", "IfcRampFlight"])
def test_plane_is_open_above_a_flight_so_that_it_joins_the_storeys(kind):
    """A flight of 15 risers of 0.2 m along x = 1 to 5.5, on a ground that is embedded in no slab."""
    steps = [
        (f"step {i}", kind, 0, (1 + 0.3 * i, 1, max(0.2 * i - 0.2, -0.1)), (1.3 + 0.3 * i, 2.2, 0.2 * (i + 1)))
        for i in range(15)
    ]
    survey = make_survey(two_storeys([(0, 0, 12, 6)], *steps), SETTINGS)
    over = heights_over(survey, [(0.6, 1.5), (8, 1.5), (3, 5)])
    np.testing.assert_allclose(over, UPPER_M, atol=SHEET_M)
    # 2.1 m below the plane, at x = 2.3, the opening begins; where the last step is level with it, it ends.
    at_m = np.array([[4.0, 1.6, 2.6]])
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    up = engine.cast_rays(at_m, np.array([[0.0, 0.0, 1.0]]), range_max_m=100.0)
    assert 2.6 + up.range_m[0] == pytest.approx(6.0, abs=SHEET_M)
    space = free_space(survey)
    lower, upper = (space.node_below(np.array([9.0, 5.0, z])) for z in (0.5, UPPER_M + 0.5))
    reached = {lower}
    front = [lower]
    while front:
        near = {int(n) for node in front for n in space.links[node] if n >= 0} - reached
        reached |= near
        front = list(near)
    assert upper in reached


# ------------------------------------------------------------------------------------ rooms without their slab
WITH_SLAB_M2, WITHOUT_M2 = 5.1 * 6, 4.6 * 5.6
DOOR = ("door", "IfcDoor", 0, (5.0, 2.0, 0.0), (5.2, 2.9, 2.1))


def flat(*parts, doorway=True, slabs=((0, 0, 5.1, 6),), storeys=(("Level 1", 0.0),)):
    """A flat of 10 x 6 m in two rooms, with a partition at x = 5 to 5.2 that has a doorway, and slabs in plan."""
    span = (2.0, 2.9) if doorway else (2.0, 2.0)
    partition = [
        ("partition south", "IfcWall", 0, (5.0, 0.2, 0.0), (5.2, span[0], 3.0)),
        ("partition north", "IfcWall", 0, (5.0, span[1], 0.0), (5.2, 5.8, 3.0)),
        ("lintel", "IfcWall", 0, (5.0, span[0], 2.1), (5.2, span[1] + 0.01, 3.0)),
    ]
    return scene_of(
        [
            *four_walls(10, 6, 0.0, 3.0, 0),
            *partition,
            *(("slab", "IfcSlab", 0, (x0, y0, -0.2), (x1, y1, 0.0)) for x0, y0, x1, y1 in slabs),
            ("roof", "IfcRoof", 0, (0, 0, 3.0), (10, 6, 3.2)),
            *parts,
        ],
        storeys,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        flat(),
        flat(DOOR),
        flat(("leaf", "IfcDoorStandardCase", 0, (5.3, 2.0, 0.0), (5.35, 2.9, 2.1)), doorway=False),
        flat(("cupboard", "IfcFurniture", 0, (7, 5, 0.0), (8, 5.6, 1.0)), doorway=False),
        pytest.param(flat(("terrain", "IfcSite", -1, (-20, -20, -0.6), (30, 30, -0.3))), marks=pytest.mark.slow),
        flat(("terrain", "IfcGeographicElement", -1, (-20, -20, -3.0), (30, 30, -1.0)), DOOR),
        flat(storeys=(("Level 1", -0.02),)),
    ],
    ids=[
        "doorway",
        "shut door",
        "leaf beside the wall",
        "furniture",
        "terrain",
        "terrain below",
        "slabs above the elevation",
    ],
)
def test_room_whose_slab_is_lost_has_the_ground_of_its_storey(scene):
    report = find_floors(scene)
    assert [floor.origin for floor in report.floors] == ["slab"]
    assert report.floors[0].ground_area_m2 == pytest.approx(WITH_SLAB_M2 + WITHOUT_M2, rel=0.02)
    (line,) = (line for line in report.warnings if "no floor slab" in line)
    assert line.startswith("storey 'Level 1': ") and "0.000 m, is taken as the ground there" in line
    survey = make_survey(scene, SETTINGS)
    assert [e.storey for e in survey.scene.elements if e.name == "Level 1: ground at its elevation"] == [0]
    space = free_space(survey)
    nodes = [space.node_below(np.array([x, 3.0, 0.5])) for x in (2.0, 6.5)]
    assert min(nodes) >= 0
    area_m2 = survey.patches.triangle_area_m2[survey.floors[0].ground_triangles].sum()
    assert area_m2 == pytest.approx(WITH_SLAB_M2 + WITHOUT_M2, rel=0.02)


def test_room_of_the_file_without_a_slab_has_the_ground_of_its_storey():
    corners, faces = box((5.2, 0.2, 0.0), (9.8, 5.8, 2.5))
    scene = replace(flat(doorway=False), rooms=(Room("Bath", "", "guid", 0, corners, faces),))
    assert find_floors(scene).floors[0].ground_area_m2 == pytest.approx(WITH_SLAB_M2 + WITHOUT_M2, rel=0.02)


def test_room_without_slab_that_nothing_leads_to_only_gets_a_warning():
    report = find_floors(flat(doorway=False))
    assert report.floors[0].ground_area_m2 == pytest.approx(WITH_SLAB_M2, rel=0.02)
    assert any("26 m2 between its walls have no floor slab and no door" in line for line in report.warnings)


@pytest.mark.parametrize(
    "scene",
    [
        flat(slabs=((0, 0, 10, 6),)),
        flat(slabs=((0, 0, 10, 2), (0, 4.5, 10, 6), (0, 2, 6, 4.5), (9, 2, 10, 4.5))),
        flat(("split level", "IfcSlab", 0, (5.1, 0, 1.1), (10, 6, 1.3))),
        flat(("bottom of a shaft", "IfcSlab", -1, (5.1, 0, -2.5), (10, 6, -2.3)), DOOR),
    ],
    ids=["none is lost", "hole in a slab", "split level", "shaft"],
)
def test_what_is_no_lost_slab_gets_no_plane_and_no_warning(scene):
    report = find_floors(scene)
    assert not report.floors[0].plane_m.size
    assert not any("no floor slab" in line for line in report.warnings)


def test_furnished_room_over_another_storey_is_no_upper_part_of_a_hall():
    cellar = [("cellar", "IfcSlab", 1, (0, 0, -3.2), (10, 6, -3.0)), *four_walls(10, 6, -3.0, -0.2, 1)]
    bed = ("bed", "IfcFurniture", 0, (7, 3, 0.0), (9, 5, 0.4))
    for parts, area_m2 in (
        ((DOOR,), WITH_SLAB_M2),
        ((DOOR, bed), WITH_SLAB_M2 + WITHOUT_M2 - 2 * 2),
    ):  # but for the bed
        report = find_floors(flat(*cellar, *parts, storeys=[("Level 1", 0.0), ("Cellar", -3.0)]))
        assert [floor.ground_area_m2 for floor in report.floors] == pytest.approx([10 * 6, area_m2], rel=0.02)


def hall(*parts):
    """A hall of 12 x 8 m and 6 m height without its floor slab."""
    return scene_of([*four_walls(12, 8, 0.0, 6.0, 0), *parts], [("EG", 0.0)])


def test_mezzanine_over_ground_that_the_file_lacks_is_not_the_only_floor():
    mezzanine = ("mezzanine", "IfcSlab", 0, (0, 0, 2.6), (4.5, 8, 2.8))
    roof = ("roof", "IfcRoof", 0, (0, 0, 6.0), (12, 8, 6.2))
    (floor,) = make_survey(hall(mezzanine, roof), SETTINGS).floors
    assert (floor.elevation_m, floor.origin) == (0.0, "storey-elevation")
    assert floor.ground_area_m2 == pytest.approx(12 * 8)
    scene = make_survey(hall(mezzanine, roof), SETTINGS).scene
    assert {float(z) for z in scene.vertices_m[scene.triangles[floor.ground_triangles], 2].ravel()} == {0.0, 2.8}


@pytest.mark.parametrize("top", [6.0, 3.0])
def test_roof_slab_in_the_storey_that_lacks_its_floor_slab_is_no_floor(top):
    """Under the open sky, or under a roof of its own: the ceiling of the storey, not its ground."""
    over = [("gable", "IfcRoof", 0, (0, 0, 5.8), (12, 8, 6.0))] if top < 6 else []
    scene = hall(("deck", "IfcSlab", 0, (0, 0, top), (12, 8, top + 0.2)), *over)
    (floor,) = find_floors(scene).floors
    assert (floor.elevation_m, floor.origin) == (0.0, "storey-elevation")
    assert floor.ground_area_m2 == pytest.approx(12 * 8)
