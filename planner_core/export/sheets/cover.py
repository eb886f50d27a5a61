"""The first page: what plan this is, its figures, a picture of all floors. PlanSource -> page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from planner_core.export.sheets.paper import Sheet
from planner_core.plan_folder.drawing.canvas import ALARM, INK, QUIET, RULE, Box, Canvas, Pen
from planner_core.plan_folder.drawing.fonts import fitted, wrapped
from planner_core.plan_folder.drawing.marks import corners
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import (
    LEFT_OUT,
    WHOLE_PLAN,
    north_words,
    part_words,
    plan_figures,
    warnings_of,
)

SUBTITLE = "Plan of the laser scans: stations, drawings to scale, registration, coverage"
OVERVIEW = "report/overview.png"
_PNG = b"\x89PNG\r\n\x1a\n"
_FOOT_MM = 8.0
_TITLE_PT = 20.0
_SIZE_PT = 8.6
_LINE_MM = 4.1
_NAME_MM = 27.0
_INDEX_MM = 3.9
#: Warnings on the cover; where there are more, they are on a page of their own.
MAX_WARNINGS = 4


def text_room(sheet: Sheet) -> Box:
    """Where the words of a page without drawing go."""
    frame = sheet.frame
    return Box(frame.left + 6, frame.bottom + _FOOT_MM + 3, frame.width - 12, frame.height - _FOOT_MM - 8)


def draw_frame(canvas: Canvas, plan: PlanSource, sheet: Sheet, title: str, *, number: int, n_sheets: int) -> None:
    """Draw the frame of a page without drawing: at its foot what it belongs to."""
    frame = sheet.frame
    canvas.lines([corners(frame)], Pen(0.5), closed=True)
    top = frame.bottom + _FOOT_MM
    canvas.lines([np.array([(frame.left, top), (frame.right, top)])], Pen(0.25))
    base = frame.bottom + 3.0
    third = frame.width / 3
    canvas.text((frame.left + 3, base), fitted(f"{plan.title} · {title}", 7.2, third, bold=True), 7.2, bold=True)
    words = fitted(plan.frame.crs_line, 6.6, 1.25 * third)
    canvas.text((frame.left + 1.6 * third, base), words, 6.6, align="middle", colour=QUIET)
    canvas.text((frame.right - 3, base), f"Sheet {number} / {n_sheets}", 7.2, bold=True, align="right")


def draw_cover(
    canvas: Canvas,
    plan: PlanSource,
    sheet: Sheet,
    *,
    part: Sequence[FloorSection] = (),
    remarks: Sequence[str] = (),
    index: Sequence[str] = (),
) -> None:
    """Draw title, figures, picture, warnings.

    part : the floors that the sheets are of, empty for all. remarks : of making them. index : what is on which.
    """
    room = text_room(sheet)
    canvas.text((room.left, room.top - 8), fitted(plan.title, _TITLE_PT, room.width, bold=True), _TITLE_PT, bold=True)
    if part:
        canvas.text((room.left, room.top - 14.5), fitted(part_words(plan, part), 12.0, room.width, bold=True), 12.0,
                    bold=True)  # fmt: skip
    else:
        canvas.text((room.left, room.top - 14.5), SUBTITLE, 10.0, colour=QUIET)
    warnings = [*warnings_of(plan), *remarks]
    foot = _draw_warnings(canvas, warnings, room)
    body = Box(room.left, foot, room.width, room.top - 20 - foot)
    picture = plan.folder / OVERVIEW
    left_mm = body.width if not has_picture(plan) else min(0.46 * body.width, 150.0)
    _draw_figures(canvas, cover_figures(plan, part), Box(body.left, body.bottom, left_mm, body.height))
    if has_picture(plan):
        beside = Box(body.left + left_mm + 6, body.bottom, body.width - left_mm - 6, body.height)
        index_mm = min(0.5 * body.height, _INDEX_MM * -(-len(index) // 2) + 18)
        foot_mm = _draw_picture(
            canvas, picture, Box(beside.left, foot + index_mm, beside.width, body.height - index_mm)
        )
        canvas.text((beside.left, foot_mm - 3.2), fitted(picture_words(part), 6.6, beside.width), 6.6, colour=QUIET)
        _draw_index(canvas, index, Box(beside.left, body.bottom, beside.width, foot_mm - body.bottom - 8))


def cover_figures(plan: PlanSource, part: Sequence[FloorSection] = ()) -> list[tuple[str, str]]:
    """Figures of the plan, or of some floors, and which north the drawings show."""
    return [*plan_figures(plan, part), ("North", north_line(plan))]


def north_line(plan: PlanSource) -> str:
    """Return which north the drawings show, where it comes from, and how they are turned to it."""
    kind, turned = north_words(plan), _turned(plan.frame.grid_north_rad)
    if not kind:
        return "not known; drawings are aligned with x and y of the scene"
    if plan.frame.is_scene:
        return f"{kind}, {turned}; coordinates are not rotated to it"
    return f"arrow N on the drawings: {kind}, {turned}"


def _turned(north_rad: float) -> str:
    """Return how far north is from up on the drawings."""
    degrees = round(math.degrees(north_rad), 1)
    if degrees == 0:
        return "up on the sheet"
    return f"{abs(degrees):.1f}° {'clockwise' if degrees > 0 else 'counter-clockwise'} from up"


def picture_words(part: Sequence[FloorSection]) -> str:
    """The text below the picture of all floors."""
    words = "A greyscale copy does not show its shades: the drawings hatch what stays unseen."
    return f"{WHOLE_PLAN.capitalize()}. {words}" if part else words


def _draw_figures(canvas: Canvas, figures: Sequence[tuple[str, str]], box: Box) -> None:
    top = box.top
    for name, value in figures:
        lines = wrapped(value, _SIZE_PT, box.width - _NAME_MM)
        colour = ALARM if name == LEFT_OUT else INK
        canvas.text((box.left, top - 4.0), name, _SIZE_PT, bold=True, colour=colour)
        for place, line in enumerate(lines):
            canvas.text((box.left + _NAME_MM, top - 4.0 - place * _LINE_MM), line, _SIZE_PT, colour=colour)
        top -= len(lines) * _LINE_MM + 2.6
        canvas.lines([np.array([(box.left, top + 0.2), (box.right, top + 0.2)])], Pen(0.1, RULE))


def _draw_index(canvas: Canvas, index: Sequence[str], box: Box) -> None:
    """List the sheets in two columns, as many as have room."""
    n_rows = int((box.height - 8) / _INDEX_MM)
    if n_rows < 1:
        return
    n_rows = min(n_rows, -(-len(index) // 2))
    shown = list(index) if len(index) <= 2 * n_rows else [*index[: 2 * n_rows - 1], "…"]
    canvas.text((box.left, box.top - 4), "Sheets", 9.0, bold=True)
    for place, words in enumerate(shown):
        column, row = divmod(place, n_rows)
        at = (box.left + column * box.width / 2, box.top - 9 - row * _INDEX_MM)
        canvas.text(at, fitted(words, 7.6, box.width / 2 - 3), 7.6)


def _draw_picture(canvas: Canvas, path: Path, box: Box) -> float:
    """Place a picture as large as there is room, at the top; return where it ends."""
    width, height = picture_size(path)
    scale = min(box.width / width, box.height / height)
    placed = Box(box.left, box.top - scale * height, scale * width, scale * height)
    canvas.picture(path, placed)
    canvas.lines([corners(placed)], Pen(0.1, RULE), closed=True)
    return placed.bottom


def has_picture(plan: PlanSource) -> bool:
    """Whether the plan folder holds the picture of all floors, and it is a PNG."""
    path = plan.folder / OVERVIEW
    return path.is_file() and path.read_bytes()[:8] == _PNG


def picture_size(path: Path) -> tuple[int, int]:
    """Pixels across and down, out of the head of a PNG."""
    head = path.read_bytes()[:24]
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def _draw_warnings(canvas: Canvas, warnings: list[str], room: Box) -> float:
    """Write the first warnings at the foot; return the height above them."""
    if not warnings:
        return room.bottom
    shown = warnings[:MAX_WARNINGS]
    lines = [(f"• {line}" if place == 0 else f"   {line}") for words in shown for place, line in
             enumerate(wrapped(words, 7.6, room.width - 12))]  # fmt: skip
    if len(warnings) > len(shown):
        lines.append(f"… and {len(warnings) - len(shown)} more: see the sheet of remarks")
    top = room.bottom + 3.7 * len(lines) + 10
    canvas.lines([corners(Box(room.left, room.bottom, room.width, top - room.bottom))], Pen(0.45), closed=True)
    canvas.text((room.left + 3, top - 5.2), "Warnings", 9.0, bold=True)
    for place, line in enumerate(lines):
        canvas.text((room.left + 3, top - 10 - 3.7 * place), line, 7.6)
    return top + 5
