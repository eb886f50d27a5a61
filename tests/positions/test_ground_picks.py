"""Ground picks: regions against a flood fill over the cells they are made of, floors against figures known exactly."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stages import find_positions

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, GroundPick, PlanSettings, Scene, Site, Storey
from planner_core.positions.ground_picks import with_ground_picks
from planner_core.requirements.read import requirements_from
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.floors import FloorReport, find_floors

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
Boxes = Callable[..., Scene]
FAR_M = (501_234.5, 5_412_345.25, 312.125)


def ground_of(report: FloorReport, floor_id: str) -> set[int]:
    return {int(t) for floor in report.floors if floor.id == floor_id for t in floor.ground_triangles}


def no_floors(scene: Scene) -> FloorReport:
    return FloorReport((), np.full(scene.n_triangles, -1, dtype=np.int32), (), np.zeros(scene.n_triangles, dtype=bool))


def region_of(scene: Scene, point_m: FloatArray) -> set[int]:
    """Triangles that a pick on a scene without floors makes ground."""
    x, y, z = (point_m + 0.0).tolist()
    floors = with_ground_picks(scene, no_floors(scene), [GroundPick((x, y, z))]).floors
    assert len(floors) == 1
    return {int(t) for t in floors[0].ground_triangles}


# ------------------------------------------------------------------------------------------------ regions
class Cells:
    """A field of square cells at heights, two triangles each, cut along either diagonal and wound either way."""

    def __init__(self, heights: list[list[int]], cuts: list[bool], flips: list[bool], *, step_m: float = 0.2) -> None:
        self.heights = np.array(heights)
        n_y, n_x = self.heights.shape
        triangles, cells = [], []
        for number, (y, x) in enumerate(np.ndindex(n_y, n_x)):
            z = self.heights[y, x] * step_m
            a, b, c, d = ((x, y, z), (x + 1, y, z), (x + 1, y + 1, z), (x, y + 1, z))
            for corners in ((a, b, c), (a, c, d)) if cuts[number] else ((a, b, d), (b, c, d)):
                flipped = flips[2 * number + len(triangles) % 2]
                triangles.append(corners[::-1] if flipped else corners)
                cells.append((y, x))
        self.corners_m = np.array(triangles, dtype=np.float64)
        self.cell_of_triangle = cells

    def flooded(self, start: tuple[int, int]) -> set[int]:
        """Triangles of cells that edges between cells of one height join with `start`."""
        n_y, n_x = self.heights.shape
        done, left = {start}, [start]
        while left:
            y, x = left.pop()
            for other in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                inside = 0 <= other[0] < n_y and 0 <= other[1] < n_x
                if inside and other not in done and self.heights[other] == self.heights[y, x]:
                    done.add(other)
                    left.append(other)
        return {number for number, cell in enumerate(self.cell_of_triangle) if cell in done}


@st.composite
def cells(draw: st.DrawFn) -> Cells:
    n_x, n_y = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    row = st.lists(st.integers(0, 1), min_size=n_x, max_size=n_x)
    heights = draw(st.lists(row, min_size=n_y, max_size=n_y))
    flags = st.lists(st.booleans(), min_size=n_x * n_y, max_size=n_x * n_y)
    return Cells(heights, draw(flags), draw(flags) + draw(flags))


def laid(corners_m: FloatArray, turn_rad: float, slope_rad: float, at_m: tuple[float, float, float]) -> FloatArray:
    """Corners on a slope about x, then turned about z, then moved."""
    c, s = np.cos(slope_rad), np.sin(slope_rad)
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return corners_m @ tilt.T @ turn.T + np.array(at_m)


@pytest.mark.slow
@given(
    field=cells(),
    where=st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98), st.integers(0, 10**6)),
    turn_rad=st.floats(0, 6.3),
    slope_rad=st.floats(0, np.deg2rad(9)),
    at_m=st.sampled_from([(0.0, 0.0, 0.0), FAR_M]),
    off_m=st.floats(-0.04, 0.04),
)
@settings(max_examples=80, deadline=None)
def test_region_is_what_edges_join_at_one_height_wherever_the_field_lies_and_however_it_is_cut(
    field: Cells,
    where: tuple[float, float, int],
    turn_rad: float,
    slope_rad: float,
    at_m: tuple[float, float, float],
    off_m: float,
) -> None:
    u, v, number = where
    n_y, n_x = field.heights.shape
    y, x = divmod(number % (n_x * n_y), n_x)
    # Corners are laid once each: what shares an edge shares its bits, as in loaded scenes.
    distinct, of = np.unique(field.corners_m.reshape(-1, 3), axis=0, return_inverse=True)
    scene = scene_from_arrays(laid(distinct, turn_rad, slope_rad, at_m), of.reshape(-1, 3))
    point = np.array([[x + u, y + v, field.heights[y, x] * 0.2 + off_m]])
    assert region_of(scene, laid(point, turn_rad, slope_rad, at_m)[0]) == field.flooded((y, x))


def strip(heights_m: list[float]) -> Scene:
    """Quads side by side along x, their shared edges at the heights given."""
    quads = [[(i, 0, a), (i + 1, 0, b), (i + 1, 1, b), (i, 1, a)] for i, (a, b) in enumerate(pairwise(heights_m))]
    points = np.array(quads, dtype=np.float64).reshape(-1, 3)
    triangles = [(4 * i + a, 4 * i + b, 4 * i + c) for i in range(len(quads)) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return scene_from_arrays(points, np.array(triangles))


def test_unevenness_of_millimetres_stays_one_surface_whichever_triangle_is_hit() -> None:
    rng = np.random.default_rng(5)
    scene = strip([0.0, *rng.uniform(-0.002, 0.002, 8).tolist(), 0.0])
    regions = [region_of(scene, scene.vertices_m[t].mean(axis=0) + scene.offset_m) for t in scene.triangles]
    assert all(region == set(range(18)) for region in regions)


def test_region_ends_where_the_ground_bends_up_a_ramp() -> None:
    scene = strip([0.0, 0.0, 0.0, 0.15, 0.30])
    assert region_of(scene, np.array([0.5, 0.5, 0.0])) == {0, 1, 2, 3}
    assert region_of(scene, np.array([3.5, 0.5, 0.225])) == {4, 5, 6, 7}


def test_region_ends_where_a_ramp_of_one_degree_has_left_its_plane() -> None:
    """No edge of it bends by as much as two degrees; the plane of the level part is left by a centimetre at once."""
    rise_m = np.tan(np.deg2rad(1.2))
    scene = strip([0.0] * 11 + [k * rise_m for k in range(1, 4)])
    assert region_of(scene, np.array([9.5, 0.5, 0.0])) == set(range(20))


def test_surfaces_that_touch_in_a_corner_or_not_at_all_are_apart() -> None:
    squares = [(0, 0), (1, 1), (0, 2.5)]
    points = np.array([(x + i, y + j, 0.0) for x, y in squares for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    triangles = np.array([(4 * n + a, 4 * n + b, 4 * n + c) for n in range(3) for a, b, c in ((0, 1, 2), (0, 2, 3))])
    scene = scene_from_arrays(points, triangles)
    assert [region_of(scene, np.array([x + 0.4, y + 0.3, 0.0])) for x, y in squares] == [{0, 1}, {2, 3}, {4, 5}]


def test_click_where_the_floor_meets_a_wall_means_the_floor(boxes_scene: Boxes) -> None:
    scene = boxes_scene([((0, 0, -0.2), (4, 3, 0)), ((4, 0, -0.2), (4.2, 3, 2.5))])
    corners_m = scene.vertices_m[scene.triangles]
    top = {int(t) for t in np.flatnonzero((corners_m[..., 2] == 0).all(axis=1))}
    for point in ((4.0, 1.5, 0.0), (4.0, 1.5, 0.0004), (3.9997, 1.5, 0.0009)):
        assert region_of(scene, np.array(point)) == top


# ------------------------------------------------------------------------------------------------ refusals
PODIUM: list[Box] = [((6, 0, 0), (9, 4, 0.4))]


@pytest.fixture
def hall(boxes_scene: Boxes) -> Scene:
    """A hall of 10 x 8 m with a podium of 3 x 4 m, and a slab that hangs 3.5 m above its half; a roof above all."""
    walls: list[Box] = [
        ((-0.2, -0.2, 0), (0, 8.2, 7)), ((10, -0.2, 0), (10.2, 8.2, 7)),
        ((0, -0.2, 0), (10, 0, 7)), ((0, 8, 0), (10, 8.2, 7)),
    ]  # fmt: skip
    slabs: list[Box] = [((0, 0, -0.2), (10, 8, 0)), ((0, 0, 7), (10, 8, 7.2)), ((0, 5, 3.3), (2.5, 8, 3.5))]
    return boxes_scene([*slabs, *walls, *PODIUM], at_m=FAR_M)


def point(x: float, y: float, z: float) -> tuple[float, float, float]:
    return (FAR_M[0] + x, FAR_M[1] + y, FAR_M[2] + z)


@pytest.mark.parametrize(
    ("pick", "message"),
    [
        (GroundPick(point(5, 5, 0.06)), r"^ground pick 2 at .*: got no surface within 5 cm of it, .*scene's own"),
        (GroundPick(point(20, 5, 0)), "got no surface within 5 cm"),
        (GroundPick(point(10, 4, 2)), "slope of 90 degrees, expected ground of at most 10"),
        (GroundPick(point(10, 4, 2), is_ground=False), "slope of 90 degrees"),
        (GroundPick(point(7, 2, 0.4), floor="F7"), r"got the floor 'F7', expected one of F0 \(Level 1\)"),
    ],
)
def test_pick_that_means_no_ground_is_refused_in_one_line(hall: Scene, pick: GroundPick, message: str) -> None:
    found = find_floors(hall)
    with pytest.raises(RequirementError, match=message) as refused:
        with_ground_picks(hall, found, [GroundPick(point(7, 2, 0.4)), pick])
    assert "\n" not in str(refused.value)
    with_ground_picks(hall, found, [GroundPick(point(5, 5, 0.049))])


# ------------------------------------------------------------------------------------------------ floors
@pytest.fixture(scope="module")
def house() -> Scene:
    return scenes_synthetic.build("house").scene


def test_no_picks_leave_the_floors_as_they_are(hall: Scene) -> None:
    found = find_floors(hall)
    assert with_ground_picks(hall, found, []) is found


def test_marked_podium_joins_the_nearest_floor_with_its_area(hall: Scene) -> None:
    found = find_floors(hall)
    report = with_ground_picks(hall, found, [GroundPick(point(7, 2, 0.4))])
    assert [f.id for f in found.floors] == [f.id for f in report.floors] == ["F0"]
    (before,), (after,) = found.floors, report.floors
    corners_m = hall.vertices_m[hall.triangles] + hall.offset_m - np.array(FAR_M)
    top = {int(t) for t in np.flatnonzero((np.abs(corners_m[..., 2] - 0.4) < 1e-6).all(axis=1))}
    assert ground_of(report, "F0") - ground_of(found, "F0") == top
    assert after.ground_area_m2 == pytest.approx(before.ground_area_m2 + 12.0)
    assert after.elevation_m == pytest.approx(before.elevation_m)  # of most of its area
    np.testing.assert_allclose(after.bounds_m, before.bounds_m)
    assert after.origin == before.origin
    assert report.warnings == found.warnings


def test_slab_out_of_reach_becomes_a_floor_with_the_next_number_in_the_order_of_heights(hall: Scene) -> None:
    found = find_floors(hall)
    picks = [GroundPick(point(1, 6, 3.5)), GroundPick(point(5, 5, 7.2))]
    report = with_ground_picks(hall, found, picks)
    assert [(f.id, f.name, f.origin) for f in report.floors] == [
        ("F0", found.floors[0].name, "surface"),
        ("F1", "Marked level 1", "marked"),
        ("F2", "Marked level 2", "marked"),
    ]
    middle = report.floors[1]
    assert middle.elevation_m + hall.offset_m[2] == pytest.approx(FAR_M[2] + 3.5)
    assert middle.ground_area_m2 == pytest.approx(7.5)
    low, high = middle.bounds_m + hall.offset_m[:2] - np.array(FAR_M[:2])
    np.testing.assert_allclose([*low, *high], [0, 5, 2.5, 8], atol=1e-6)
    # What lies above the new ground counts for it, as of floors that are found.
    height_m = (hall.vertices_m[hall.triangles][..., 2].mean(axis=1)) + hall.offset_m[2] - FAR_M[2]
    expected = np.where(height_m < 3.45, 0, np.where(height_m < 7.15, 1, 2))
    expected[height_m < -0.05] = -1
    np.testing.assert_array_equal(report.floor_of_triangle, expected)


def test_floor_below_the_others_keeps_the_ids_of_those_that_were_found(hall: Scene) -> None:
    found = find_floors(hall)
    lifted = replace(found, floors=(replace(found.floors[0], elevation_m=found.floors[0].elevation_m + 5.0),))
    report = with_ground_picks(hall, lifted, [GroundPick(point(7, 2, 0.4))])
    assert [f.id for f in report.floors] == ["F1", "F0"]
    again = with_ground_picks(hall, lifted, [GroundPick(point(7, 2, 0.4)), GroundPick(point(7, 2, 0.4), floor="F0")])
    assert [f.id for f in again.floors] == ["F0"]


def test_named_floor_gets_the_region_however_far_and_others_lose_it(hall: Scene) -> None:
    found = find_floors(hall)
    new = GroundPick(point(1, 6, 3.5))
    report = with_ground_picks(hall, found, [new, GroundPick(point(7, 2, 0.4), floor="marked LEVEL 1")])
    assert [len(floor.ground_triangles) for floor in report.floors][1] == 4
    moved = with_ground_picks(hall, found, [new, GroundPick(point(1, 6, 3.5), floor="F0")])
    assert [f.id for f in moved.floors] == ["F0"]
    assert ground_of(moved, "F0") - ground_of(found, "F0") == ground_of(with_ground_picks(hall, found, [new]), "F1")


def test_ground_that_is_marked_again_stays_with_its_floor(hall: Scene) -> None:
    found = find_floors(hall)
    new = GroundPick(point(1, 6, 3.5))
    named = with_ground_picks(hall, found, [replace(new, floor="F0"), new])
    assert [f.id for f in named.floors] == ["F0"]
    first = with_ground_picks(hall, found, [new])
    again = with_ground_picks(hall, found, [new, new, GroundPick(point(4, 6, 0.0))])
    assert [f.id for f in first.floors] == [f.id for f in again.floors]
    for one, other in zip(first.floors, again.floors, strict=True):
        np.testing.assert_array_equal(one.ground_triangles, other.ground_triangles)
        assert one.ground_area_m2 == other.ground_area_m2


def test_later_pick_has_the_last_word(hall: Scene) -> None:
    found = find_floors(hall)
    mark, unmark = GroundPick(point(7, 2, 0.4)), GroundPick(point(8.5, 3.5, 0.4), is_ground=False)
    neither = with_ground_picks(hall, found, [mark, unmark])
    assert ground_of(neither, "F0") == ground_of(found, "F0")
    assert neither.floors[0].ground_area_m2 == pytest.approx(found.floors[0].ground_area_m2)
    assert ground_of(with_ground_picks(hall, found, [unmark, mark]), "F0") > ground_of(found, "F0")


def test_floor_whose_ground_is_unmarked_is_none_any_more_and_the_user_is_told(hall: Scene) -> None:
    found = find_floors(hall)
    picks = [GroundPick(point(1, 6, 3.5)), GroundPick(point(2, 7, 3.5), is_ground=False, floor="F1")]
    report = with_ground_picks(hall, found, picks)
    assert [f.id for f in report.floors] == ["F0"]
    assert [line for line in report.warnings if line not in found.warnings] == [
        f"ground pick 2 at ({FAR_M[0] + 2:.3f}, {FAR_M[1] + 7:.3f}, {FAR_M[2] + 3.5:.3f}): floor 'Marked level 1' has "
        "no ground left and is not a floor any more"
    ]
    np.testing.assert_array_equal(report.floor_of_triangle, found.floor_of_triangle)


@pytest.mark.slow
def test_slab_that_is_unmarked_is_no_floor_of_a_building_with_storeys_any_more(house: Scene) -> None:
    found = find_floors(house)
    assert [f.id for f in found.floors] == ["F0", "F1"]
    report = with_ground_picks(house, found, [GroundPick((5.0, 1.0, 0.0), is_ground=False)])
    assert [(f.id, f.name) for f in report.floors] == [("F1", "Upper floor")]
    assert ground_of(report, "F1") == ground_of(found, "F1")
    heights_m = house.vertices_m[house.triangles][..., 2].mean(axis=1)
    np.testing.assert_array_equal(report.floor_of_triangle, np.where(heights_m >= 2.75, 0, -1))


def test_unmarking_what_is_no_ground_changes_nothing_and_the_user_is_told(hall: Scene) -> None:
    found = find_floors(hall)
    picks = [GroundPick(point(7, 2, 0.4), is_ground=False), GroundPick(point(1, 6, 3.5))]
    report = with_ground_picks(hall, found, picks)
    assert [line for line in report.warnings if "nothing is unmarked" in line] == [
        f"ground pick 1 at ({FAR_M[0] + 7:.3f}, {FAR_M[1] + 2:.3f}, {FAR_M[2] + 0.4:.3f}): this surface was not "
        "ground, so nothing is unmarked"
    ]
    other = with_ground_picks(hall, found, [picks[1], GroundPick(point(5, 5, 0), is_ground=False, floor="F1")])
    assert ground_of(other, "F0") == ground_of(found, "F0")
    assert any("was not ground of floor 'Marked level 1'" in line for line in other.warnings)


def test_storey_without_slab_takes_what_is_marked_for_its_ground_and_the_user_is_told(boxes_scene: Boxes) -> None:
    bare = boxes_scene(
        [((-0.2, 0, 0), (0, 8, 3)), ((10, 0, 0), (10.2, 8, 3)), ((-0.2, -0.2, 0), (10.2, 0, 3)),
         ((-0.2, 8, 0), (10.2, 8.2, 3)), ((2, 2, -0.3), (6, 5, 0.1))]
    )  # fmt: skip
    storeys = (Storey("Hall", "s0", 0.0),)
    scene = replace(bare, storeys=storeys, elements=tuple(replace(e, storey=0) for e in bare.elements))
    found = find_floors(scene)
    assert [(f.name, f.origin, f.ground_triangles.size) for f in found.floors] == [("Hall", "storey-elevation", 0)]
    report = with_ground_picks(scene, found, [GroundPick((3, 3, 0.1))])
    (floor,) = report.floors
    assert (floor.id, floor.name, floor.origin) == ("F0", "Hall", "marked")
    assert floor.ground_area_m2 == pytest.approx(12.0)
    assert floor.elevation_m == pytest.approx(0.1)
    assert any("its ground is now the marked surface only" in line for line in report.warnings)


# -------------------------------------------------------------------------------------- the rest of the flow
COARSE = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=90), grid_step_m=1.0, instrument_heights_m=(1.5,),
    max_patch_area_m2=1.0,
)  # fmt: skip


def candidates_of(scene: Scene, site: Site) -> tuple[FloatArray, list[str]]:
    """Places (N, 3) in the hall's own coordinates, and the ids of their floors."""
    told = replace(COARSE, site=site)
    survey = make_survey(scene, told)
    engine = open_engine(scene, survey.patches, engine="open3d")
    places = find_positions(survey, told, engine, floors=tuple(range(len(survey.floors))))
    at = places.candidates.position_m + scene.offset_m - np.array(FAR_M)
    return at, [survey.floors[int(i)].id for i in places.candidates.floor]


@pytest.mark.slow
def test_tripods_stand_on_what_is_marked_and_no_longer_on_what_is_unmarked(hall: Scene) -> None:
    def on_podium(at: FloatArray) -> FloatArray:
        return at[(at[:, 0] > 6) & (at[:, 0] < 9) & (at[:, 1] < 4)]

    # The step onto the podium is too high for the crew: somebody lets them in up there.
    up = (point(7.5, 2, 0.4), point(3, 3, 0.0))
    before, _ = candidates_of(hall, Site(entrances_m=up[1:]))
    assert len(on_podium(before)) == 0
    after, _ = candidates_of(hall, Site(entrances_m=up, ground_picks=(GroundPick(up[0]),)))
    stands = on_podium(after)
    assert len(stands) > 0
    np.testing.assert_allclose(stands[:, 2], 0.4 + 1.5, atol=1e-6)
    assert len(after) > len(stands)
    picks = (GroundPick(up[0]), GroundPick(point(5, 5, 0.0), is_ground=False))
    only, _ = candidates_of(hall, Site(entrances_m=up[:1], ground_picks=picks))
    assert len(only) == len(on_podium(only)) > 0


@pytest.mark.slow
def test_floor_that_is_marked_is_planned_by_its_id(hall: Scene) -> None:
    ways = (point(1, 6.5, 3.5), point(5, 5, 0.0))
    at, floors = candidates_of(hall, Site(entrances_m=ways, ground_picks=(GroundPick(ways[0]),)))
    up = at[[floor == "F1" for floor in floors]]
    assert len(up) > 0
    np.testing.assert_allclose(up[:, 2], 5.0, atol=1e-6)
    assert "F0" in floors


def test_picks_are_read_from_the_site_of_a_requirements_file() -> None:
    told = {"ground_picks": [{"point": [4, 2, 0.75], "is_ground": False, "floor": "F0"}, [1.5, 2.5, 3.5]]}
    assert requirements_from({"site": told})[1].ground_picks == (
        GroundPick((4.0, 2.0, 0.75), False, "F0"),
        GroundPick((1.5, 2.5, 3.5), True, ""),
    )


@pytest.mark.parametrize(
    ("picks", "message"),
    [
        ([{"point": [1, 2]}], r"ground_picks\[0\].point: got \[1, 2\], expected 3 numbers"),
        ([[1, 2, "x"]], r"ground_picks\[0\]: got .*, expected 3 finite numbers"),
        ([{"is_ground": True}], r"ground_picks\[0\]: got no point"),
        ([{"point": [1, 2, 3], "ground": True}], "got the unknown entry 'ground'.*did you mean is_ground"),
        ([{"point": [1, 2, 3], "is_ground": "yes"}], "is_ground: got 'yes', expected true or false"),
        ([[0, 0, 0]] * 1001, "got 1001 of them, expected at most 1000"),
    ],
)
def test_picks_that_are_none_are_refused(picks: object, message: str) -> None:
    with pytest.raises(RequirementError, match=message):
        requirements_from({"site": {"ground_picks": picks}})
