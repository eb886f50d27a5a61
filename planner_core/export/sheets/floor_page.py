"""The drawing of one floor to scale: walls, stations in walking order, links, what stays unseen. FloorView -> page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.export.sheets.floor_view import FloorView
from planner_core.export.sheets.page_frame import draw_band
from planner_core.export.sheets.paper import Tile
from planner_core.export.sheets.site_grid import draw_grid
from planner_core.model import FloatArray, LengthUnit
from planner_core.model.arrays import bounds_of
from planner_core.plan_folder.drawing.canvas import PAPER, Box, Canvas, Pen
from planner_core.plan_folder.drawing.fonts import width_mm
from planner_core.plan_folder.drawing.hatching import Family, spans_of_rings, spans_of_triangles, without
from planner_core.plan_folder.drawing.marks import (
    BELOW,
    CUT,
    FITTING,
    HATCH_MISSED,
    HATCH_OUT_OF_REACH,
    MISSED_GROUND,
    MISSED_WALL,
    MISSED_WALL_RIM,
    OUT_OF_REACH,
    WALL_FILL,
    Labels,
    corners,
    draw_links,
)
from planner_core.plan_folder.floor_marks import (
    draw_floor_stations,
    draw_floor_words,
    draw_ways,
    draw_zone_borders,
    stairs_on,
)
from planner_core.plan_folder.plan_source import PlanSource


@dataclass(frozen=True)
class Neighbour:
    """Where a floor goes on. column, row : of that tile. sheet : its number."""

    column: int
    row: int
    sheet: int


def draw_floor(
    canvas: Canvas,
    plan: PlanSource,
    view: FloorView,
    tile: Tile,
    *,
    sheet: int,
    n_sheets: int,
    neighbours: Sequence[Neighbour] = (),
) -> None:
    """Draw one sheet of a floor. neighbours : all tiles of this floor that are drawn, this one among them."""
    box = tile.sheet.drawing
    with canvas.clip(box):
        _draw_ground(canvas, view, tile)
        _draw_building(canvas, view, tile)
        draw_links(canvas, [tile.on_paper(ends) for ends in view.links])
        draw_ways(canvas, view.ways, tile.on_paper, view.floor.elevation_m + view.cut_m)
        zones = draw_zone_borders(canvas, view.zones, tile.on_paper)
    others = list(_edges(tile, neighbours))
    names = draw_grid(canvas, plan.frame, tile, view.floor.elevation_m, taken=[edge for edge, _ in others])
    labels = Labels(canvas, box, [*names, *(edge for edge, _ in others)])
    with canvas.clip(box):
        _draw_stations(view, tile, labels, plan.frame.unit)
        draw_floor_words(
            labels,
            tile.on_paper,
            stairs=stairs_on(view.ways),
            ends=view.ends,
            breaks=view.breaks,
            targets=view.targets,
            unreachable=view.unreachable,
            zones=zones,
            rooms=view.rooms,
        )
    for edge, words in others:
        _draw_neighbour(canvas, edge, words)
    draw_band(
        canvas, plan, view, tile, sheet=sheet, n_sheets=n_sheets, neighbours=[(n.column, n.row) for n in neighbours]
    )


def is_empty(view: FloorView, tile: Tile) -> bool:
    """Whether a tile shows nothing of its floor."""
    low_m, high_m = tile.window_m
    lines = (*view.cuts, *(way.points_m for way in view.ways), *(s.position_m[None, :2] for s in view.stations))
    if not lines:
        return False
    points_m = np.concatenate(lines)
    return not bool(((points_m >= low_m) & (points_m <= high_m)).all(axis=1).any())


def _draw_ground(canvas: Canvas, view: FloorView, tile: Tile) -> None:
    surface = view.surface
    if surface is None:
        return
    for hatched, hiding, (apart_mm, turn_deg), pen in (
        (surface.out_of_reach, (surface.seen, surface.missed), HATCH_OUT_OF_REACH, OUT_OF_REACH),
        (surface.missed, (surface.seen,), HATCH_MISSED, MISSED_GROUND),
    ):
        family = Family(apart_mm / tile.mm_per_m, math.radians(turn_deg))
        spans = without(spans_of_triangles(_near(hatched, tile), family), spans_of_rings(view.standing, family))
        for other in hiding:
            spans = without(spans, spans_of_triangles(_near(other, tile), family))
        canvas.lines(list(tile.on_paper(spans.lines(family))), pen)


def _draw_building(canvas: Canvas, view: FloorView, tile: Tile) -> None:
    canvas.lines([tile.on_paper(line) for line in view.below], BELOW)
    for rings in view.solids:
        canvas.area([tile.on_paper(ring) for ring in rings], WALL_FILL)
    canvas.lines([tile.on_paper(line) for line in view.fittings], FITTING)
    canvas.lines([tile.on_paper(line) for line in view.cuts], CUT)
    if view.surface is not None:
        strips = list(tile.on_paper(view.surface.walls))
        canvas.lines(strips, MISSED_WALL_RIM)
        canvas.lines(strips, MISSED_WALL)


def _near(triangles: FloatArray, tile: Tile) -> FloatArray:
    """Return those of the triangles (N, 3, 2) that may be on a sheet."""
    low_m, high_m = tile.window_m
    lowest_m, highest_m = bounds_of(triangles)
    near = ((highest_m >= low_m) & (lowest_m <= high_m)).all(axis=1)
    return np.asarray(triangles[near])


def _draw_stations(view: FloorView, tile: Tile, labels: Labels, unit: LengthUnit) -> None:
    low_m, high_m = tile.window_m
    shown = [s for s in view.stations if ((s.position_m[:2] >= low_m) & (s.position_m[:2] <= high_m)).all()]
    if not shown:
        return
    spots = tile.on_paper(np.array([station.position_m[:2] for station in shown]))
    draw_floor_stations(
        labels,
        view.floor,
        shown,
        spots,
        scanned=view.scanned,
        elsewhere=view.elsewhere,
        unit=unit,
        mm_per_m=tile.mm_per_m,
    )


def _edges(tile: Tile, neighbours: Sequence[Neighbour]) -> Iterator[tuple[Box, str]]:
    """Where at the edges to say which sheet a floor goes on at, and the words."""
    box = tile.sheet.drawing
    for other in neighbours:
        dx, dy = other.column - tile.column, other.row - tile.row
        if abs(dx) + abs(dy) != 1:
            continue
        words = f"continues on sheet {other.sheet}"
        long, high = width_mm(words, 7.0, bold=True) + 4.0, 4.6
        width, height = (high, long) if dx else (long, high)
        left = box.left + (box.width - width) * (0.5 + 0.5 * dx)
        bottom = box.bottom + (box.height - height) * (0.5 + 0.5 * dy)
        yield Box(left, bottom, width, height), words


def _draw_neighbour(canvas: Canvas, box: Box, words: str) -> None:
    canvas.area([corners(box)], PAPER)
    canvas.lines([corners(box)], Pen(0.25), closed=True)
    upright = box.height > box.width
    at = (box.left + 3.1, box.bottom + box.height / 2) if upright else (box.left + box.width / 2, box.bottom + 1.5)
    canvas.text(at, words, 7.0, bold=True, align="middle", turn_rad=math.pi / 2 if upright else 0.0)
