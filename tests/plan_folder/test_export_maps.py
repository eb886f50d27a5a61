"""Maps and report: what the pictures show, against points in the building whose surface is known."""

import dataclasses
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import OpenImageIO as Oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    REASONS,
    Coverage,
    KeepOut,
    Plan,
    PlanSettings,
    PriorStation,
    Role,
    Scene,
    Site,
    UnreachableArea,
    UnseenSurface,
    Why,
)
from planner_core.plan_folder import floor_marks, maps, palette
from planner_core.plan_folder.drawing.marks import nice_length_m, spread_apart
from planner_core.plan_folder.floor_marks import zones_on
from planner_core.plan_folder.maps import shaded, view_rgb
from planner_core.plan_folder.plan_source import source_of
from planner_core.plan_folder.report import report_page
from planner_core.plan_folder.section_view import (
    SectionView,
    camera_at,
    camera_from_above,
    cut_height_m,
    inside_solid,
    joined_views,
    section_lines,
    solid_cells,
    view_lines_m,
    view_section,
)
from planner_core.plan_folder.sheet import coverage_legend, floor_figures
from planner_core.plan_folder.unseen_csv import unseen_csv
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.floors import ground_levels
from tests.coverage.conftest import BOX_FACES, box_corners
from tests.scene.floor_scenes import four_walls, scene_of

WINDOW_M = np.array([[-0.5, -0.5], [8.5, 4.5]])


@pytest.fixture(scope="module")
def view(plan: Plan, engine: ScanEngine) -> SectionView:
    return view_section(plan.survey, engine, camera_from_above(), ground_m=0.0, cut_m=1.2, window_m=WINDOW_M, width=180)


def pixel(view: SectionView, x_m: float, y_m: float) -> tuple[int, int]:
    return int((view.window_m[1, 1] - y_m) / view.pixel_m), int((x_m - view.window_m[0, 0]) / view.pixel_m)


def element_at(plan: Plan, view: SectionView, x_m: float, y_m: float) -> str:
    return plan.survey.scene.elements[plan.survey.scene.element_of_triangle[view.triangle[pixel(view, x_m, y_m)]]].name


def test_map_shows_the_ground_in_rooms_and_nothing_outside(plan: Plan, view: SectionView) -> None:
    assert view.triangle.shape == (100, 180)
    assert element_at(plan, view, 2.0, 2.0) == element_at(plan, view, 4.0, 2.0) == "Slab: ground (0)"
    assert view.triangle[pixel(view, -0.4, 2.0)] == -1
    assert view.depth_m[pixel(view, 2.0, 2.0)] == pytest.approx(1.2, abs=1e-5)


def test_cut_walls_are_solid_and_doorway_and_rooms_are_not(plan: Plan, view: SectionView) -> None:
    solid = inside_solid(plan.survey, view, plan.survey.floors[0])
    for spot in ((4.0, 0.7), (4.0, 3.3), (4.0, -0.1), (-0.1, 2.0), (8.1, 2.0)):
        assert solid[pixel(view, *spot)], spot
    for spot in ((4.0, 2.0), (2.0, 2.0), (6.0, 3.0), (-0.4, 2.0)):
        assert not solid[pixel(view, *spot)], spot


def test_solid_area_is_the_area_of_the_walls_section(plan: Plan, view: SectionView) -> None:
    solid = inside_solid(plan.survey, view, plan.survey.floors[0])
    expected_m2 = 2 * 8 * 0.2 + 2 * 4 * 0.2 + 2 * 1.5 * 0.2
    # Every edge of the section may be off by half a pixel.
    slack_m2 = 0.5 * view.pixel_m * (4 * 8.2 + 4 * 4.2 + 4 * 1.7)
    assert solid.sum() * view.pixel_m**2 == pytest.approx(expected_m2, abs=slack_m2)


@pytest.mark.parametrize("index", [0, 1])
def test_cells_of_cut_walls_are_the_solid_pixels_of_the_view_from_above(
    plan: Plan, engine: ScanEngine, index: int
) -> None:
    floor = plan.survey.floors[index]
    cut_m = cut_height_m(plan, floor)
    view = view_section(plan.survey, engine, camera_from_above(), ground_m=floor.elevation_m, cut_m=cut_m,
                        window_m=WINDOW_M, width=180)  # fmt: skip
    expected = inside_solid(plan.survey, view, floor)
    cells, cell_m = solid_cells(plan.survey, floor=floor, cut_m=cut_m, window_m=WINDOW_M, width=180)
    assert cell_m == view.pixel_m
    assert 2000 < expected.sum() < 3000
    np.testing.assert_array_equal(cells, expected)


def test_nothing_is_cut_above_the_roof(plan: Plan) -> None:
    floor = plan.survey.floors[0]
    cells, _ = solid_cells(plan.survey, floor=floor, cut_m=9.0, window_m=WINDOW_M, width=180)
    assert not cells.any()


def test_section_lines_have_the_length_of_the_walls_outlines(plan: Plan) -> None:
    lines = section_lines(plan.survey, 1.2)
    assert (np.abs(lines[:, :, 2] - 1.2) < 1e-12).all()
    outside = 2 * (8 + 0.2) * 2 + 2 * (4 + 0.2) * 2 + 2 * (1.5 + 0.2) * 2
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() == pytest.approx(outside)


def test_pixels_have_the_colour_of_their_patch(plan: Plan, view: SectionView) -> None:
    rgb = view_rgb(plan, shaded(plan.survey, plan.survey.floors[0], view))
    rows, columns = np.nonzero(np.isin(view.triangle, plan.survey.floors[0].ground_triangles))
    solid = inside_solid(plan.survey, view, plan.survey.floors[0])
    inner = ~solid[rows, columns] & (view.depth_m[rows, columns] > 1.19)
    patch = view.patch[rows, columns][inner]
    expected = palette.PATCH_COLOURS_SRGB[palette.patch_colour_index(plan.times_seen[patch], plan.achievable[patch])]
    shown = rgb[rows, columns][inner]
    assert np.isclose(shown, expected, atol=1e-6).all(axis=1).mean() > 0.95  # the rest are edges, drawn darker


def test_surface_that_need_not_be_covered_has_a_colour_of_its_own_seen_or_not(plan: Plan, view: SectionView) -> None:
    floor, number = plan.survey.floors[0], np.arange(plan.survey.patches.n_patches)
    required, times_seen = number % 2 == 1, (number // 2 % 3).astype(np.int32)
    plan = dataclasses.replace(plan, times_seen=times_seen, achievable=number % 7 > 0)
    shown = shaded(plan.survey, floor, view)
    before, after = (view_rgb(dataclasses.replace(plan, required=each), shown) for each in (None, required))
    changed = (before != after).any(axis=2)
    there = view.triangle >= 0
    solid = inside_solid(plan.survey, view, floor)
    np.testing.assert_array_equal(changed, there & ~required[view.patch] & ~solid)
    level = changed & np.isin(view.triangle, floor.ground_triangles) & (np.abs(view.depth_m - 1.2) < 1e-4)
    assert set(times_seen[view.patch[changed]].tolist()) == {0, 1, 2}
    assert np.isclose(after[level], palette.NOT_REQUIRED, atol=1e-6).all(axis=1).mean() > 0.95  # the rest are edges


def test_legend_names_what_need_not_be_covered_where_there_is_such_surface(plan: Plan) -> None:
    def words(required: np.ndarray | None) -> list[str]:
        return [label for label, _ in coverage_legend(dataclasses.replace(plan, required=required))]

    everything = np.ones(plan.survey.patches.n_patches, dtype=np.bool_)
    assert words(None) == words(everything)
    but_one = everything.copy()
    but_one[7] = False
    assert words(but_one) == [*words(None), "not to be covered"]
    colours = [colour for _, colour in coverage_legend(dataclasses.replace(plan, required=but_one))]
    assert sorted(colours) == sorted(map(tuple, palette.PATCH_COLOURS_SRGB.tolist()))


def test_upper_floor_is_cut_above_its_own_ground(plan: Plan) -> None:
    assert [cut_height_m(plan, floor) for floor in plan.survey.floors] == pytest.approx([1.2, 4.0])


@given(azimuth=st.floats(-4, 4), elevation=st.floats(0.2, 1.5))
def test_camera_shows_a_point_where_it_projects_to(azimuth: float, elevation: float) -> None:
    camera = camera_at(azimuth_rad=azimuth, elevation_rad=elevation)
    np.testing.assert_allclose(
        np.stack([camera.right, camera.up, camera.forward]) @ camera.right, [1, 0, 0], atol=1e-12
    )
    np.testing.assert_allclose(np.cross(camera.right, camera.up), -camera.forward, atol=1e-12)
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 3.0]])
    seen = camera.project(points)
    np.testing.assert_allclose(camera.on_plane(seen[:, 0], seen[:, 1], 3.0), points, atol=1e-9)


def test_zones_of_a_map_lie_on_their_floors(plan: Plan) -> None:
    x, y, z = (plan.stations[0].position_m + plan.survey.scene.offset_m).tolist()
    corners = ((x, y), (x + 1.0, y), (x, y + 1.0))
    first, last = plan.survey.floors[0], plan.survey.floors[-1]
    site = Site(
        keep_out=(KeepOut(corners, first.id, name="store"), KeepOut(corners, last.name, access=True), KeepOut(corners)),
        prior=(PriorStation("", (x, y, z), Role.FORBIDDEN, first.name, radius_m=0.4),),
    )
    told = dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, site=site))
    source = source_of(told)
    found = zones_on(source, source.floors[0])
    assert [zone.words for zone in found] == ["keep-out: store", "keep-out", "no station"]
    np.testing.assert_allclose(found[0].outline[0], (x, y), atol=1e-6)
    np.testing.assert_allclose(found[0].outline[0], found[0].outline[-1])
    np.testing.assert_allclose(np.linalg.norm(found[2].outline - (x, y), axis=1), 0.4)
    assert [zone.words for zone in zones_on(source, source.floors[-1])] == ["access area", "keep-out"]


@settings(deadline=None, max_examples=40)
@given(spots=st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), min_size=1, max_size=12))
def test_markers_do_not_overlap(spots: list[tuple[float, float]]) -> None:
    discs = spread_apart(np.array(spots), 0.5)
    gaps = np.linalg.norm(discs[:, None] - discs[None], axis=2)[~np.eye(len(spots), dtype=np.bool_)]
    assert gaps.min(initial=np.inf) >= 0.45


def test_markers_far_apart_stay_where_they_are() -> None:
    spots = np.array([[0.0, 0.0], [3.0, 0.0]])
    np.testing.assert_array_equal(spread_apart(spots, 1.0), spots)


@given(longest=st.floats(1e-3, 1e4))
def test_scale_bar_is_a_round_length_that_fits(longest: float) -> None:
    length = nice_length_m(longest)
    assert longest / 2.5 * (1 - 1e-6) <= length <= longest * (1 + 1e-6)
    assert f"{length:e}"[0] in "125"


@pytest.mark.parametrize(
    "name", ["map_F0.png", "map_F1.png", "links_F0.png", "picture_F0.png", "overview.png", "coverage_curve.png"]
)
def test_report_pictures_are_wide_and_not_blank(plan_folder: Path, name: str) -> None:
    """At 29 dots per inch; test_route_drawing.py measures maps at the 144 of the product."""
    picture = Oiio.ImageBuf(str(plan_folder / "report" / name))
    pixels = picture.get_pixels(Oiio.UINT8)[:, :, :3]
    assert pixels.shape[1] == 322
    assert 60 < pixels.shape[0] < 400
    assert (pixels.min(axis=2) < 200).mean() > 0.003
    assert picture.spec().getattribute("Software") is None


class Page(HTMLParser):
    """Tags that were opened and not closed, and what the page wants to load."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loads += [value or "" for key, value in attrs if key in ("src", "href")]
        if tag not in ("meta", "img", "wbr"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_report_page_is_closed_and_loads_only_what_lies_beside_it(plan: Plan, plan_folder: Path) -> None:
    page = Page((plan_folder / "report" / "index.html").read_text())
    assert page.open == []
    assert len(page.loads) == 8
    assert [name for name in page.loads if not (plan_folder / "report" / name).is_file()] == []


def test_report_page_escapes_what_the_source_says(plan: Plan) -> None:
    text = report_page(plan)
    assert "Obergeschoß" in text
    assert "units were guessed" in text
    assert "Nothing&#x27;s name" in text


def test_unseen_list_names_the_element_in_its_source(plan: Plan) -> None:
    lines = unseen_csv(plan).splitlines()
    assert lines[1] == "3,Wand süd,IfcWall,id-3,F0,1.250,40.000"
    assert len(lines) == 3


def test_wings_half_a_storey_apart_are_each_cut_above_their_own_ground() -> None:
    """Ground at 0 and at 1.5 m, a table on each: one map shows both floors, both tables, and walls of either."""
    boxes = [
        ("low slab", (0.0, 0.0, -0.2), (6.0, 6.0, 0.0)),
        ("high slab", (6.0, 0.0, 1.3), (12.0, 6.0, 1.5)),
        ("low table", (2.0, 2.0, 0.0), (3.0, 3.0, 0.7)),
        ("high table", (9.0, 2.0, 1.5), (10.0, 3.0, 2.2)),
        ("low wall", (-0.2, 0.0, -0.2), (0.0, 6.0, 4.0)),
        ("high wall", (12.0, 0.0, 1.3), (12.2, 6.0, 4.0)),
    ]
    corners = np.concatenate([box_corners(low, high) for _, low, high in boxes])
    scene = scene_from_arrays(corners, np.concatenate([BOX_FACES + 8 * number for number in range(len(boxes))]))
    survey = make_survey(scene, PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=1.0))
    top = {number: np.flatnonzero(_is_top(scene, 12 * number)) + 12 * number for number in (0, 1)}
    floor = dataclasses.replace(
        survey.floors[0], elevation_m=0.0, ground_triangles=np.concatenate([top[0], top[1]]).astype(np.int32)
    )
    levels = ground_levels(survey.scene, floor)
    assert [height for height, _ in levels] == pytest.approx([0.0, 1.5])
    for (_, corners_m), triangles in zip(levels, (top[0], top[1]), strict=True):
        np.testing.assert_array_equal(corners_m, scene.vertices_m[scene.triangles[np.sort(triangles)]])
    window_m = np.array([[-1.0, -1.0], [13.0, 7.0]])
    engine = open_engine(scene, survey.patches)
    joined = joined_views(
        [
            view_section(survey, engine, camera_from_above(), ground_m=z, cut_m=z + 1.2, window_m=window_m, width=280)
            for z, _ in levels
        ],
        [corners_m for _, corners_m in levels],
    )
    shown = {spot: joined.triangle[pixel(joined, *spot)] // 12 for spot in ((1, 1), (11, 1), (2.5, 2.5), (9.5, 2.5))}
    assert list(shown.values()) == [0, 1, 2, 3]
    solid = inside_solid(survey, joined, floor)
    assert [solid[pixel(joined, x, 3.0)] for x in (-0.1, 12.1, 5.0, 7.0)] == [True, True, False, False]
    # Outlines of both walls, and of neither slab: the low level's plane cuts through none of them over the high one.
    lines_m = view_lines_m(survey, joined)
    assert np.linalg.norm(lines_m[:, 1] - lines_m[:, 0], axis=1).sum() == pytest.approx(2 * 2 * (6.0 + 0.2), abs=0.01)


def _is_top(scene: Scene, first: int) -> np.ndarray:
    """(12,) bool: which of a box's triangles, numbered from `first`, are its upper face."""
    z_m = scene.vertices_m[scene.triangles[first : first + 12]][:, :, 2]
    return np.asarray((z_m == z_m.max()).all(axis=1))


def test_a_floor_without_anything_scannable_has_no_percentage(plan: Plan) -> None:
    first, *others = plan.coverage_by_floor
    empty = dataclasses.replace(first, achievable_area_m2=0.0)
    assert floor_figures(source_of(plan), "F0")[1][0].endswith(" %")
    assert floor_figures(source_of(dataclasses.replace(plan, coverage_by_floor=(empty, *others))), "F0")[1] == (
        "none",
        "of it scannable",
    )


def test_report_names_rooms_that_nobody_enters_beside_the_coverage(plan: Plan) -> None:
    room = UnreachableArea(floor=0, area_m2=12.4, inside_m=np.zeros(3), strips_m=np.zeros((0, 2, 2)))
    page = report_page(dataclasses.replace(plan, unreachable=(room,)), pictures=False).replace("\xa0", " ")
    assert '<tr class="alarm"><th scope="row">Left out</th>' in page
    assert "Not planned: 12 m² of floor that can&#x27;t be reached on foot, in one area</td>" in page
    assert "Left out" not in report_page(dataclasses.replace(plan, unreachable=()), pictures=False)


@pytest.mark.parametrize(("rise_m", "words"), [(2.8, ["ground +2.80 m"]), (0.3, [""])])
def test_station_on_a_mezzanine_has_its_height_at_the_marker_of_the_map(
    plan: Plan, view: SectionView, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rise_m: float, words: list[str]
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(floor_marks, "draw_stations", lambda labels, spots, numbers, told, **_: shown.extend(told))
    first = plan.stations[0]
    raised = dataclasses.replace(first, position_m=first.position_m + np.array([0.0, 0.0, rise_m]))
    alone = dataclasses.replace(plan, stations=(raised,), links=(), route=None)
    shown_at = shaded(plan.survey, plan.survey.floors[0], view)
    maps.write_floor_map(alone, 0, tmp_path / "map.png", view=shown_at, source=source_of(alone))
    assert shown == words


def test_headline_of_a_map_names_what_is_not_scanned_as_required(plan: Plan) -> None:
    reasons = [("too oblique", 6.0, "F0"), ("occluded", 90.0, "F0"), ("too sparse", 0.1, "F1")]
    unseen = tuple(UnseenSurface(0, -1, floor, reason, area, 1, ()) for reason, area, floor in reasons)
    why = Why((), (), unseen, np.zeros(plan.survey.patches.n_patches, dtype=np.uint8), (0.0,) * len(REASONS))
    small = dataclasses.replace(plan, why=why, coverage_by_floor=(Coverage(40.0, 140.0, 39.0),) * 2)
    labels = [floor_figures(source_of(small), floor)[1] for floor in ("F0", "F1")]
    assert labels == [
        ("97.5 %", "of 40 m² scannable; 6 m² not as required"),
        ("97.5 %", "of 40 m² scannable"),
    ]


def test_border_of_a_level_above_the_cut_is_drawn_and_of_one_below_it_is_not(plan: Plan) -> None:
    scene = scene_of(
        [
            ("slab", "IfcSlab", 0, (0, 0, -0.2), (12, 8, 0)),
            *four_walls(12, 8, 0, 6, 0),
            ("mezzanine", "IfcSlab", 0, (0, 0, 2.6), (5, 4, 2.8)),
            ("stage", "IfcSlab", 0, (8, 0, 0), (12, 4, 0.9)),
            ("roof", "IfcRoof", 0, (0, 0, 6), (12, 8, 6.2)),
        ],
        (("EG", 0.0),),
    )
    survey = make_survey(scene, plan.settings)
    borders_m = maps._overhead_m(dataclasses.replace(plan, survey=survey), survey.floors[0])
    ends = {tuple(map(tuple, np.round(border_m + scene.offset_m[:2], 3).tolist())) for border_m in borders_m}
    assert ends == {((0, 0), (0, 4)), ((0, 0), (5, 0)), ((0, 4), (5, 4)), ((5, 0), (5, 4))}
