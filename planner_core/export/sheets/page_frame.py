"""What surrounds the drawing of a floor: frame, legend, scale bar, north, title block.

Plan, FloorView, Tile -> page.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner_core.coverage.percent import link_limits_words
from planner_core.export.sheets.floor_view import FloorView
from planner_core.export.sheets.paper import Tile, scale_name
from planner_core.model import SiteFrame
from planner_core.plan_folder.drawing.canvas import INK, PAPER, QUIET, Box, Canvas, Pen
from planner_core.plan_folder.drawing.fonts import fitted, width_mm, wrapped
from planner_core.plan_folder.drawing.hatching import Family, spans_of_rings
from planner_core.plan_folder.drawing.marks import (
    BY_TARGETS,
    COUNTS,
    CUT,
    DISC_MM,
    HATCH_MISSED,
    HATCH_OUT_OF_REACH,
    KEEP_OUT,
    LINKS,
    MARK_WORDS,
    MISSED_GROUND,
    MISSED_WALL,
    OUT_OF_REACH,
    ROUTE,
    STATION_FILL,
    STRONG,
    STRONG_TIMES,
    WALL_FILL,
    WEAK,
    arrow_head,
    corners,
    draw_axes,
    draw_letter,
    draw_scale_bar,
)
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import NOT_PLANNED, cut_words, floor_words, north_words, stations_words

_FRAME = Pen(0.5)
_LINE = Pen(0.25)
_SCALE_WIDTH_MM = 42.0
_MOST_TITLE_MM = 128.0
_LEAST_TITLE_MM = 80.0
_LINK_CLASSES = {"strong": STRONG, "counts": COUNTS, "weak": WEAK, "by targets": BY_TARGETS}


def draw_band(
    canvas: Canvas,
    plan: PlanSource,
    view: FloorView,
    tile: Tile,
    *,
    sheet: int,
    n_sheets: int,
    neighbours: Sequence[tuple[int, int]],
) -> None:
    """Draw the frame and the band at its foot. neighbours : (column, row) of the tiles of this floor."""
    band = tile.sheet.band
    title_mm = min(_MOST_TITLE_MM, max(_LEAST_TITLE_MM, 0.36 * band.width))
    legend = Box(band.left, band.bottom, band.width - title_mm - _SCALE_WIDTH_MM, band.height)
    scale = Box(legend.right, band.bottom, _SCALE_WIDTH_MM, band.height)
    title = Box(scale.right, band.bottom, title_mm, band.height)
    canvas.lines([corners(tile.sheet.frame)], _FRAME, closed=True)
    canvas.lines([np.array([(band.left, band.top), (band.right, band.top)])], _FRAME)
    canvas.lines([np.array([(box.left, box.bottom), (box.left, box.top)]) for box in (scale, title)], _LINE)
    _draw_legend(canvas, plan, view, legend)
    _draw_north_or_axes(canvas, plan, scale)
    _draw_scale(canvas, plan, tile, scale)
    _draw_title(canvas, plan, view, tile, title, sheet=sheet, n_sheets=n_sheets)
    if tile.n_columns * tile.n_rows > 1:
        side = 8 if _has_two_arrows(plan.frame) else 14
        _draw_key(canvas, tile, neighbours, Box(scale.left + 41 - side, scale.bottom + 31.5 - side, side, side))


# ------------------------------------------------------------------------------------------------- legend
def _draw_legend(canvas: Canvas, plan: PlanSource, view: FloorView, box: Box) -> None:
    """Name every kind of mark, in columns."""
    entries = ["station", "route", "strong", "counts", "weak"]
    if len(view.links[BY_TARGETS]):
        entries.append("by targets")
    if view.scanned:
        entries.insert(1, "scanned")
    if view.zones:
        entries.append("keep-out")
    if view.surface is not None:
        entries += ["missed ground", "out of reach", "missed wall", "wall", "below"]
    figures = {
        "cut": cut_words(plan.frame.unit, view.cut_m),
        "link": link_limits_words(plan.limits),
        "times": STRONG_TIMES,
    }
    legend = {entry: tuple(words.format(**figures) for words in MARK_WORDS[entry]) for entry in entries}
    n_columns = 2 if len(entries) > 5 else 1
    n_rows = -(-len(entries) // n_columns)
    width, height = (box.width - 3) / n_columns, (box.height - 2) / max(n_rows, 5)
    for place, entry in enumerate(entries):
        column, row = divmod(place, n_rows)
        left, middle = box.left + 2 + column * width, box.top - 1.5 - (row + 0.5) * height
        _draw_sample(canvas, entry, Box(left, middle - 1.7, 11, 3.4))
        words = next((words for words in legend[entry] if width_mm(words, 6.4) <= width - 13), legend[entry][-1])
        canvas.text((left + 12.5, middle - 0.9), fitted(words, 6.4, width - 13), 6.4)


def _draw_sample(canvas: Canvas, entry: str, box: Box) -> None:
    middle = box.bottom + box.height / 2
    line = np.array([(box.left, middle), (box.right, middle)])
    if entry in ("station", "scanned"):
        at = (box.left + box.width / 2, middle)
        fill, letters = (STATION_FILL, PAPER) if entry == "station" else (PAPER, STATION_FILL)
        canvas.disc(at, 0.75 * DISC_MM, fill, Pen(0.3, STATION_FILL))
        canvas.text((at[0], at[1] - 0.7), "1", 5.5, colour=letters, bold=True, align="middle")
    elif entry == "route":
        canvas.lines([line], ROUTE)
        canvas.area([arrow_head(line, 2.2)], ROUTE.colour)
    elif entry in _LINK_CLASSES:
        canvas.lines([line], LINKS[_LINK_CLASSES[entry]])
    elif entry == "keep-out":
        canvas.lines([line], KEEP_OUT)
    elif entry == "missed ground":
        _draw_hatch(canvas, box, HATCH_MISSED, MISSED_GROUND)
    elif entry == "out of reach":
        _draw_hatch(canvas, box, HATCH_OUT_OF_REACH, OUT_OF_REACH)
    elif entry == "missed wall":
        canvas.lines([line], MISSED_WALL)
    elif entry == "wall":
        canvas.area([corners(box.inset(0.5))], WALL_FILL)
        canvas.lines([corners(box.inset(0.5))], CUT, closed=True)
    else:
        canvas.lines([corners(box.inset(0.5))], Pen(0.11, (0.55, 0.56, 0.58)), closed=True)


def _draw_hatch(canvas: Canvas, box: Box, kind: tuple[float, float], pen: Pen) -> None:
    family = Family(kind[0], math.radians(kind[1]))
    canvas.lines(list(spans_of_rings([[corners(box)]], family).lines(family)), pen)


# -------------------------------------------------------------------------------------------------- scale
def _draw_north_or_axes(canvas: Canvas, plan: PlanSource, box: Box) -> None:
    """Draw the arrow of the site's north; or the scene's axes, and beside them true north where it is known."""
    frame = plan.frame
    if not frame.is_scene:
        _draw_north(canvas, frame.grid_north_rad, (box.left + 12, box.top - 10.5))
    else:
        draw_axes(canvas, (box.left + (7 if _has_two_arrows(frame) else 12), box.top - 10.5))
        if frame.true_north_rad is not None:
            _draw_north(canvas, frame.true_north_rad, (box.left + 24.3, box.top - 10.0), size=0.55, kind="true")
    words = f"{'' if frame.is_scene else 'N: '}{north_words(plan) or 'x, y of the scene; north not known'}"
    words = fitted(words, 5.8, box.width - 2)
    canvas.text((box.left + box.width / 2, box.bottom + 13.4), words, 5.8, align="middle", colour=QUIET)


def _draw_scale(canvas: Canvas, plan: PlanSource, tile: Tile, box: Box) -> None:
    """Draw the scale bar, and when it holds."""
    middle = box.left + box.width / 2
    draw_scale_bar(canvas, tile.mm_per_m, middle, box.bottom + 7.2, longest_mm=box.width - 9, unit=plan.frame.unit)
    words = "true to scale when printed at 100 %"
    canvas.text((box.left + box.width / 2, box.bottom + 2.2), fitted(words, 5.8, box.width - 2), 5.8, align="middle",
                colour=QUIET)  # fmt: skip


def _has_two_arrows(frame: SiteFrame) -> bool:
    """Whether the axes of the listed coordinates are shown and north, which is another way, beside them."""
    return frame.is_scene and frame.true_north_rad is not None


def _draw_north(canvas: Canvas, turn: float, middle: tuple[float, float], *, size: float = 1.0, kind: str = "") -> None:
    """Draw an arrow to the north, turned clockwise. kind : a word at its letter where it is not the grid's."""
    at = np.array(middle)
    ahead, right = np.array([math.sin(turn), math.cos(turn)]), np.array([math.cos(turn), -math.sin(turn)])
    tip, tail = at + 5 * size * ahead, at - 8 * size * ahead
    left_half = np.array([tip, tail - 3.2 * size * right, tail + 2.2 * size * ahead])
    right_half = np.array([tip, tail + 3.2 * size * right, tail + 2.2 * size * ahead])
    canvas.area([right_half], INK)
    canvas.lines([left_half, right_half], Pen(0.25), closed=True)
    letter = tip + (2.9 if kind else 2.2) * ahead
    draw_letter(canvas, letter, "N")
    if kind:
        # On the side away from the arrow.
        canvas.text((float(letter[0]), float(letter[1]) + (1.5 if ahead[1] >= 0 else -2.9)), kind, 5.6, bold=True,
                    align="middle")  # fmt: skip


def _draw_key(canvas: Canvas, tile: Tile, neighbours: Sequence[tuple[int, int]], box: Box) -> None:
    """Show which part of the floor a sheet is."""
    shape = tile.sheet.drawing
    cell = min(box.width / (tile.n_columns * shape.width), box.height / (tile.n_rows * shape.height))
    width, height = cell * shape.width, cell * shape.height
    for column, row in neighbours:
        outline = corners(Box(box.left + column * width, box.bottom + row * height, width, height))
        if (column, row) == (tile.column, tile.row):
            canvas.area([outline], INK)
        canvas.lines([outline], Pen(0.2), closed=True)


# -------------------------------------------------------------------------------------------------- title
def _draw_title(
    canvas: Canvas, plan: PlanSource, view: FloorView, tile: Tile, box: Box, *, sheet: int, n_sheets: int
) -> None:
    """Draw project, floor and coordinates, and at the right scale and number of the sheet."""
    right = Box(box.right - 25, box.bottom, 25, box.height)
    canvas.lines([np.array([(right.left, right.bottom), (right.left, right.top)])], _LINE)
    middle = right.bottom + box.height / 2
    canvas.lines([np.array([(right.left, middle), (right.right, middle)])], _LINE)
    in_feet, on_paper = scale_name(tile.scale, plan.frame.unit), f"on {tile.sheet.paper}"
    if in_feet:
        canvas.text((right.right - 1.5, right.top - 3.4), on_paper, 6.0, colour=QUIET, align="right")
        on_paper = in_feet
    for name, value, note, top in (
        ("Scale", f"1:{tile.scale}", on_paper, right.top),
        ("Sheet", f"{sheet} / {n_sheets}", "", right.top - box.height / 2),
    ):
        canvas.text((right.left + 1.5, top - 3.4), name, 6.0, colour=QUIET)
        canvas.text((right.left + right.width / 2, top - 10.0), value, 12.0, bold=True, align="middle")
        canvas.text((right.left + right.width / 2, top - 14.2), note, 6.4, colour=QUIET, align="middle")
    room, left = right.left - box.left - 4, box.left + 2
    canvas.text((left, box.top - 5.2), fitted(plan.title, 9.5, room, bold=True), 9.5, bold=True)
    canvas.text((left, box.top - 10.6), fitted(view.floor.name, 9.5, room), 9.5)
    seen = floor_words(plan.document, view.floor.id, plan.frame.unit)
    lines = [f"{stations_words(len(view.stations))}; seen: {seen}"]
    if seen in ("", NOT_PLANNED):
        lines = [stations_words(len(view.stations)) + (seen and "; this floor is not planned")]
    ground_m = float(plan.frame.to_site(np.array([*view.window_m.mean(axis=0), view.floor.elevation_m]))[2])
    lines.append(f"Ground at H {plan.frame.unit.text(ground_m, 2)}")
    if not plan.document["registration"]["connected"]:
        lines.append("NOT all scans of the plan register")
    lines += wrapped(f"Coordinates: {plan.frame.crs_line}", 6.4, room)[:2]
    if view.surface is None:
        lines.append("Without walls: see the remarks")
    for place, line in enumerate(lines[:6]):
        canvas.text((left, box.top - 15.6 - 3.5 * place), fitted(line, 6.4, room), 6.4)
