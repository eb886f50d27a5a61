"""The sheet that pictures of the report are drawn on: size, title strip, legend; everything in millimetres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import Floor, Plan
from planner_core.plan_folder import palette
from planner_core.plan_folder.drawing.canvas import QUIET, Box, Canvas, Colour, Pen
from planner_core.plan_folder.drawing.fonts import fitted, width_mm
from planner_core.plan_folder.drawing.marks import corners, draw_axes, draw_scale_bar
from planner_core.plan_folder.drawing.png_canvas import PngCanvas, whole_pixels_mm
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import (
    NOT_PLANNED,
    area_words,
    floor_coverage,
    floor_percent,
    missed_on,
    scanner_words,
    stations_words,
)
from planner_core.scene.floors import ground_span_m

WIDTH_MM = 1600 / 144 * 25.4
MARGIN_MM = 8.0
HEADER_MM = 20.0
FOOTER_MM = 17.0
MAX_HEIGHT_MM = 247.0

LegendLine = tuple[str, Pen]
"""What a line is, and how it looks."""

_COVERAGE: tuple[tuple[str, Colour], ...] = (
    ("seen by 3 or more stations", palette.SEEN_OFTEN),
    ("by 2", palette.SEEN_TWICE),
    ("by 1", palette.SEEN_ONCE),
    ("not seen by this plan", palette.UNSEEN),
    ("not scannable", palette.NOT_ACHIEVABLE),
)


def coverage_legend(plan: Plan) -> tuple[tuple[str, Colour], ...]:
    """Return the colours of coverage in words; what need not be covered only where the plan has such surface."""
    if plan.required is None or plan.required.all():
        return _COVERAGE
    return (*_COVERAGE, ("not to be covered", palette.NOT_REQUIRED))


def new_sheet(height_mm: float) -> PngCanvas:
    """Return an empty sheet with room for a picture so high."""
    return PngCanvas(WIDTH_MM, height_mm + HEADER_MM + FOOTER_MM)


def picture_box(wide: float, high: float) -> Box:
    """Where a picture of these proportions is: as wide as the sheet unless that makes it too tall."""
    most_mm = WIDTH_MM - 2 * MARGIN_MM
    height_mm = min(max(most_mm * high / wide, 9.0), MAX_HEIGHT_MM)
    width_mm = whole_pixels_mm(min(most_mm, height_mm * wide / high))
    return Box(whole_pixels_mm((WIDTH_MM - width_mm) / 2), whole_pixels_mm(FOOTER_MM), width_mm, height_mm)


def draw_header(canvas: PngCanvas, title: str, subtitle: str, figures: tuple[tuple[str, str], ...]) -> None:
    """Draw the title strip: title and subtitle at the left, figures (value, label) at the right."""
    right = WIDTH_MM - MARGIN_MM
    upper, lower = canvas.box.top - 9.7, canvas.box.top - 15.5
    for value, label in reversed(figures):
        canvas.text((right, upper), value, 15.3, bold=True, align="right", colour=palette.SEEN_OFTEN)
        canvas.text((right, lower), label, 8.3, align="right", colour=QUIET)
        right -= 6.0 + max(width_mm(label, 8.3), width_mm(value, 15.3, bold=True))
    canvas.text((MARGIN_MM, upper), fitted(title, 16.7, right - MARGIN_MM, bold=True), 16.7, bold=True)
    canvas.text((MARGIN_MM, lower), fitted(subtitle, 8.7, right - MARGIN_MM), 8.7, colour=QUIET)


def floor_subtitle(plan: Plan, source: PlanSource, floor: Floor) -> str:
    """Say which floor of which model this is, and for which scanner."""
    low_m, high_m = (z_m + float(plan.survey.scene.offset_m[2]) for z_m in ground_span_m(plan.survey.scene, floor))
    at = f"at {low_m:.2f} m" if low_m == high_m else f"from {low_m:.1f} to {high_m:.1f} m"
    return (
        f"{plan.survey.scene.title}   ·   {floor.id}   ·   ground {at}, "
        f"{floor.ground_area_m2:.0f} m²   ·   {scanner_words(source.document)}"
    )


def drawn_floors(plan: Plan) -> tuple[int, ...]:
    """Floors that maps are drawn of: planned ones, and others with stations, such as given ones."""
    with_stations = {station.floor for station in plan.stations}
    return tuple(
        index
        for index, floor in enumerate(plan.survey.floors)
        if index in plan.survey.planned or floor.id in with_stations
    )


def floor_figures(source: PlanSource, floor_id: str) -> tuple[tuple[str, str], ...]:
    """Figures of one floor for `draw_header`: stations and coverage."""
    document, unit = source.document, source.frame.unit
    number, _, stations = stations_words(len(source.stations_of(floor_id))).partition(" ")
    percent, figures = floor_percent(document, floor_id), floor_coverage(document, floor_id)
    if percent in ("", NOT_PLANNED) or figures is None:
        return ((number, stations), (NOT_PLANNED, "this floor"))
    if percent == "none":
        return ((number, stations), ("none", "of it scannable"))
    label = f"of {area_words(unit, figures['achievable_area_m2'])} scannable"
    if missed_m2 := missed_on(document, floor_id):
        label += f"; {area_words(unit, missed_m2)} not as required"
    return ((number, stations), (f"{percent} %", label))


def draw_footer(
    canvas: Canvas,
    *,
    mm_per_m: float | None = None,
    legend: tuple[tuple[str, Colour], ...],
    lines: Sequence[LegendLine] = (),
) -> None:
    """Draw the legend and, where `mm_per_m` gives the length of a metre, scale bar and axes.

    legend : what colours are. lines : what the lines between stations are. Axes are the scene's x and y: models seldom
    say where north is, so none is claimed.
    """
    left, foot = MARGIN_MM, 6.3
    for label, colour in legend:
        canvas.area([corners(Box(left, foot, 4.2, 4.2))], colour)
        canvas.text((left + 5.7, foot + 1.1), label, 8.0)
        left += 10.0 + width_mm(label, 8.0)
    for label, pen in lines:
        canvas.lines([np.array([(left, foot + 2.1), (left + 9.0, foot + 2.1)])], pen)
        canvas.text((left + 10.5, foot + 1.1), label, 8.0)
        left += 14.8 + width_mm(label, 8.0)
    if mm_per_m is not None:
        draw_scale_bar(canvas, mm_per_m, WIDTH_MM - MARGIN_MM - 36.0, 6.3, longest_mm=34.0)
        draw_axes(canvas, (WIDTH_MM - MARGIN_MM - 9.0, 8.5))
