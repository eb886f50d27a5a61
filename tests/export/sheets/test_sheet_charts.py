"""Histograms against NumPy's, weighted by area; and marks that grey print keeps apart."""

import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.export.sheets.building import Building, read_building
from planner_core.export.sheets.charts import histogram, histograms_of, share_axis
from planner_core.plan_folder.drawing import marks
from planner_core.plan_folder.drawing.canvas import Pen
from planner_core.plan_folder.plan_source import PlanSource


def _of(values: list[float], areas: list[float], asked: float | None = None):  # type: ignore[no-untyped-def]
    return histogram(np.array(values), np.array(areas), "title", "words", 1.0, asked)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.01, 100.0), st.floats(0.001, 1.0)), min_size=1, max_size=60),
    st.none() | st.floats(0.1, 50.0),
)
def test_histogram_is_numpys_weighted_by_area(pairs: list[tuple[float, float]], asked: float | None) -> None:
    values, areas = np.array(pairs).T
    made = _of(list(values), list(areas), asked)
    inside = np.minimum(values, made.edges[-1] * (1 - 1e-12))
    expected, _ = np.histogram(inside, bins=made.edges, weights=areas)
    # A value on an edge falls to either side by rounding.
    near = np.abs(values[:, None] - made.edges).min(axis=1) < 1e-9 * made.edges[-1]
    slack = areas[near].sum() / areas.sum()
    assert np.abs(made.shares - expected / areas.sum()).max() <= slack + 1e-9
    assert np.isclose(made.shares.sum(), 1.0)
    if asked is not None:
        assert made.edges[-1] >= asked
        assert np.isclose(made.within, areas[values <= asked * (1 + 1e-9)].sum() / areas.sum())


@given(st.floats(1e-3, 1.0))
def test_bars_have_room_below_the_highest_share_and_take_most_of_it(highest: float) -> None:
    axis = share_axis(highest)
    assert 100 * highest < axis.most < 108 * highest + axis.step * 1.001
    ticks = axis.most / axis.step
    assert abs(ticks - round(ticks)) < 1e-6 and 2 <= round(ticks) <= 5


def test_half_of_the_area_lies_below_the_median() -> None:
    made = _of([1.0, 2.0, 30.0], [1.0, 5.0, 3.0])
    assert (made.median, made.at_95) == (2.0, 30.0)


def test_unseen_surface_is_in_no_histogram() -> None:
    made = _of([1.0, np.nan], [1.0, 99.0])
    assert made.shares.sum() == 1.0 and made.median == 1.0
    assert _of([np.nan], [1.0]) is None


@pytest.mark.slow
def test_limits_of_the_plan_are_marked_in_shown_units(site_plan: PlanSource) -> None:
    building = read_building(site_plan.folder)
    assert isinstance(building, Building)
    made = {each.title: each for each in histograms_of(site_plan, building)}
    assert {title: each.limit for title, each in made.items()} == pytest.approx(
        {"Range": 4.0, "Incidence": 75.0, "Point spacing": 500.0}
    )
    document = json.loads((site_plan.folder / "viewer" / "layers.json").read_text())
    step = next(layer["step"] for layer in document["layers"] if layer["id"] == "spacing")
    steps = np.fromfile(site_plan.folder / "viewer" / "layers" / "spacing.u16", dtype="<u2")
    area = building.patches.area_m2[steps != 65535]
    shown = 1000 * step * steps[steps != 65535]
    assert made["Point spacing"].within == pytest.approx(area[shown <= 500.0 + 1e-6].sum() / area.sum())


@pytest.mark.slow
def test_building_is_read_as_it_was_planned(site_plan: PlanSource, sheet_folder: Path) -> None:
    building = read_building(sheet_folder)
    assert isinstance(building, Building)
    assert building.patches.n_patches == site_plan.document["settings"]["n_patches"]
    total_m2 = building.patches.area_m2.sum()
    assert total_m2 == pytest.approx(site_plan.document["coverage"]["total_area_m2"], rel=1e-5)
    seen_m2 = building.patches.area_m2[building.achievable].sum()
    assert seen_m2 == pytest.approx(site_plan.document["coverage"]["achievable_area_m2"], rel=0.05)
    for number, floor in enumerate(site_plan.floors):
        triangles = building.scene.triangles[building.ground_of_triangle == number]
        heights_m = building.scene.vertices_m[triangles][..., 2] + building.scene.offset_m[2]
        assert triangles.size and np.allclose(heights_m, floor.elevation_m, atol=1e-5)


@pytest.mark.slow
def test_figures_of_charts_have_units(site_sheets: Any) -> None:
    words = " ".join(" ".join(site_sheets.texts).split())
    for unit in (" m", "°", " mm"):
        assert re.search(rf"median [\d.]+{unit}, 95 % at most [\d.]+{unit};", words), unit
    assert "required: 4 m" in words and "required: 75°" in words and "required: 500 mm" in words


# ---------------------------------------------------------------------------------------------------- grey
def _grey(pen: Pen) -> float:
    return float(np.dot(pen.colour, (0.2126, 0.7152, 0.0722)))


LINES = {"weak": marks.LINKS[0], "counts": marks.LINKS[1], "strong": marks.LINKS[2], "route": marks.ROUTE,
         "missed wall": marks.MISSED_WALL}  # fmt: skip


@pytest.mark.parametrize(("one", "other"), list(combinations(LINES, 2)))
def test_lines_differ_without_colour(one: str, other: str) -> None:
    a, b = LINES[one], LINES[other]
    wider = max(a.width_mm, b.width_mm) / min(a.width_mm, b.width_mm)
    dashed = bool(a.dash_mm) != bool(b.dash_mm)
    longer = bool(a.dash_mm and b.dash_mm) and max(a.dash_mm[0], b.dash_mm[0]) / min(a.dash_mm[0], b.dash_mm[0]) >= 2
    assert wider >= 1.5 or dashed or longer


@pytest.mark.parametrize("name", list(LINES))
def test_lines_are_dark_and_wide_enough_for_a_copy(name: str) -> None:
    assert _grey(LINES[name]) < 0.55
    assert LINES[name].width_mm >= 0.25
