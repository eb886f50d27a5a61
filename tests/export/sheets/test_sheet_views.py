"""What a drawing is made of: classes of links at their limits, solids that nobody stands in, tiles that hold all."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.export.sheets.building import Building, read_building
from planner_core.export.sheets.floor_view import FloorView, view_floor
from planner_core.export.sheets.paper import sheet_scales, tiles_of
from planner_core.model import METRE, Link
from planner_core.plan_folder.drawing.fonts import fitted, width_mm, wrapped
from planner_core.plan_folder.drawing.marks import COUNTS, STRONG, WEAK, link_class
from planner_core.plan_folder.plan_source import PlanSource

SCALES = sheet_scales(METRE)


@pytest.mark.parametrize(
    ("overlap", "strength", "expected"),
    [
        (0.2, 0.01, COUNTS), (0.19999, 0.5, WEAK), (0.1, 0.5, WEAK), (0.09999, 0.5, None),
        (0.9, 0.00999, WEAK), (0.9, 0.03999, COUNTS), (0.9, 0.04, STRONG), (0.9, math.nan, COUNTS),
    ],
)  # fmt: skip
def test_links_are_classed_by_what_was_asked(
    site_plan: PlanSource, overlap: float, strength: float, expected: int | None
) -> None:
    assert (site_plan.limits.overlap, site_plan.limits.strength) == (0.2, 0.01)
    assert link_class(Link("S001", "S002", overlap, strength), site_plan.limits) == expected


def _view(plan: PlanSource) -> FloorView:
    building = read_building(plan.folder)
    assert isinstance(building, Building)
    return view_floor(plan, plan.floors[0], building)


def test_what_a_station_stands_in_is_no_solid(scene_plan: PlanSource, edited: Callable[..., PlanSource]) -> None:
    def move(document: dict[str, Any]) -> None:
        document["stations"][0]["position"] = [40_305.0, 20_199.9, 51.4]  # inside of the wall at the south

    assert len(_view(edited(move)).solids) == len(_view(scene_plan).solids) - 1


def test_drawing_holds_walls_outside_of_the_ground(scene_plan: PlanSource) -> None:
    low, high = _view(scene_plan).window_m
    assert (low < [40_299.8, 20_199.8]).all() and (high > [40_310.2, 20_205.2]).all()


def test_feet_of_walls_are_drawn_and_of_furniture_are_not(scene_plan: PlanSource) -> None:
    """Of a parapet that is a plane, without a top, nothing else would be seen below the cut."""
    boxes = [np.array([line.min(axis=0), line.max(axis=0)]) for line in _view(scene_plan).below]

    def times(low: tuple[float, float], high: tuple[float, float]) -> int:
        asked = np.array([low, high]) + np.array([40_300.0, 20_200.0])
        return sum(bool(np.allclose(box, asked, atol=1e-6)) for box in boxes)

    assert times((4.0, 0.0), (4.2, 2.0)) == 1  # the wall between the rooms, which ends above the cut
    assert times((1.0, 1.0), (2.0, 2.0)) == 1  # the table's top alone


@pytest.mark.slow
def test_walls_are_cut_where_told(scene_plan: PlanSource) -> None:
    building = read_building(scene_plan.folder)
    assert isinstance(building, Building)
    # At 2.3 m the lintel closes the gap between the two walls; at 1.2 m it does not.
    counts = [len(view_floor(scene_plan, scene_plan.floors[0], building, cut_m=cut).solids) for cut in (0.5, 1.2)]
    assert counts[0] == counts[1]
    assert view_floor(scene_plan, scene_plan.floors[0], building, cut_m=2.3).cut_m == pytest.approx(1.4)


@settings(max_examples=60, deadline=None)
@given(
    low=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)),
    size=st.tuples(st.floats(0.5, 900.0), st.floats(0.5, 900.0)),
    at=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
    paper=st.sampled_from(["A3", "A4", "a4"]),
)
def test_every_place_of_a_floor_is_on_a_sheet(
    low: tuple[float, float], size: tuple[float, float], at: tuple[float, float], paper: str
) -> None:
    window = np.array([low, np.add(low, size)])
    tiles = tiles_of(window, paper)
    place = window[0] + np.array(at) * (window[1] - window[0])
    boxes = [tile.sheet.drawing for tile in tiles]
    spots = [tile.on_paper(place) for tile in tiles]
    assert any(
        box.left <= x <= box.right and box.bottom <= y <= box.top for box, (x, y) in zip(boxes, spots, strict=True)
    )
    assert len({tile.scale for tile in tiles}) == 1 and tiles[0].scale in SCALES
    short, long = (210, 297) if paper.upper() == "A4" else (297, 420)
    # Margins of 8 mm, 7 mm of air around, 35 mm for the band at the foot.
    rooms = [(short - 30, long - 65), (long - 30, short - 65)]
    fits = [s for s in SCALES if any(size[0] * 1000 / s <= w and size[1] * 1000 / s <= h for w, h in rooms)]
    slack = 1e-6 * (1 + max(map(abs, low)))
    if all(abs(side * 1000 / s - room) > slack for side in size for s in SCALES for pair in rooms for room in pair):
        assert (tiles[0].scale, len(tiles) == 1) == (fits[0] if fits else SCALES[-1], bool(fits))
    # Sheets side by side share 12 mm; one less in a row or a column would not hold the floor.
    box, n_sheets = tiles[0].sheet.drawing, (tiles[0].n_columns, tiles[0].n_rows)
    for n, room, side in zip(n_sheets, rooms[box.width > box.height], size, strict=True):
        assert n == 1 or (n - 1) * (room - 12) + 12 < side * 1000 / tiles[0].scale + slack


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.text(max_size=60), st.floats(8.0, 60.0))
def test_words_cut_short_have_room(words: str, room_mm: float) -> None:
    assert width_mm(fitted(words, 7.0, room_mm), 7.0) <= room_mm


@settings(max_examples=25, deadline=None)
@given(st.text(alphabet="ab üΩ,-", max_size=80), st.floats(5.0, 60.0))
def test_wrapped_lines_have_room_and_keep_all_letters(words: str, room_mm: float) -> None:
    lines = wrapped(words, 7.0, room_mm)
    assert all(width_mm(line, 7.0) <= room_mm for line in lines)
    assert "".join(lines).replace(" ", "") == words.replace(" ", "")
