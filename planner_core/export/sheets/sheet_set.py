"""All sheets of a plan in order, each knowing how to draw itself. PlanSource -> pages for any canvas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from planner_core.export.chosen import chosen_floors, chosen_stations
from planner_core.export.options import Options
from planner_core.export.sheets.building import Building, building_of
from planner_core.export.sheets.charts import Histogram, draw_histogram, histograms_of
from planner_core.export.sheets.cover import MAX_WARNINGS, draw_cover, draw_frame, text_room
from planner_core.export.sheets.floor_page import Neighbour, draw_floor, is_empty
from planner_core.export.sheets.floor_view import FloorView, view_floor
from planner_core.export.sheets.paper import Sheet, Tile, check_sheet, sheet_scales, text_sheet, tiles_of
from planner_core.export.sheets.table_layout import TablePiece, draw_piece, paginated
from planner_core.plan_folder.drawing.canvas import Box, Canvas
from planner_core.plan_folder.drawing.fonts import lacking_letters
from planner_core.plan_folder.drawing.pdf_canvas import PdfBook
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_tables import (
    Column,
    Table,
    floors_table,
    gaps_table,
    networks_table,
    requirements_table,
    stations_table,
    targets_table,
    unseen_tables,
)
from planner_core.plan_folder.plan_words import WHOLE_PLAN, cut_words, planned_floors, warnings_of
from planner_core.plan_folder.report import draw_curve
from planner_core.progress import Progress, ProgressEvent

#: Draws a sheet, of that number of so many.
Draw = Callable[[Canvas, int, int], None]


@dataclass(frozen=True, eq=False)
class Page:
    """A sheet that is still to be drawn."""

    title: str
    sheet: Sheet
    draw: Draw
    zoom: float = 1.0
    """How many times as large the sheet is printed."""


@dataclass(frozen=True, eq=False)
class FloorSheets:
    """What there is of one floor."""

    view: FloorView
    tiles: tuple[Tile, ...]
    table: Table


@dataclass(frozen=True, eq=False)
class Contents:
    """What sheets are made of, however they are laid out. remarks : of making them, one line each."""

    plan: PlanSource
    part: tuple[FloorSection, ...]
    """The floors that sheets are required of; empty: the whole plan."""
    floors: tuple[FloorSheets, ...]
    summary: tuple[Table, ...]
    histograms: tuple[Histogram, ...]
    remarks: tuple[str, ...]


def gather(plan: PlanSource, options: Options) -> Contents:
    """Read and work out all that sheets show, once for a plan and its options.

    Raises
    ------
    RequirementError
        No such paper or floor, or no height to cut walls at.
    ExportError
        A file of the plan folder can't be read.
    MissingPackageError
        reportlab or matplotlib is missing.
    """
    return plan.once(("sheets", options), lambda: _gathered(plan, options))


def _gathered(plan: PlanSource, options: Options) -> Contents:
    check_sheet(options.paper, options.cut_m)
    wanted = [floor for floor in chosen_floors(plan, options) if _worth_a_sheet(plan, floor, options)]
    building = building_of(plan)
    remarks = [building] if isinstance(building, str) else []
    there = None if isinstance(building, str) else building
    floors = []
    for floor in wanted:
        view = view_floor(plan, floor, there, cut_m=options.cut_m)
        tiles = tuple(
            tile
            for tile in tiles_of(view.window_m, options.paper, scales=sheet_scales(plan.frame.unit))
            if not is_empty(view, tile)
        )
        floors.append(FloorSheets(view, tiles, stations_table(plan, floor.name, plan.stations_of(floor.id))))
    part = _part(plan, options)
    summary = (
        _nowhere(plan, options),
        floors_table(plan, part),
        *(
            _whole(table, part)
            for table in (requirements_table(plan), networks_table(plan), targets_table(plan), gaps_table(plan))
        ),
        *unseen_tables(plan, part),
    )
    return Contents(
        plan=plan,
        part=part,
        floors=tuple(floors),
        summary=tuple(table for table in summary if table is not None),
        histograms=tuple(_histograms(plan, there, remarks)),
        remarks=(*remarks, *_cut_lower(plan, floors, options), *_unprintable(plan)),
    )


def _part(plan: PlanSource, options: Options) -> tuple[FloorSection, ...]:
    """Floors that sheets are required of; none where these are all of the plan."""
    chosen = chosen_floors(plan, options)
    return () if len(chosen) == len(plan.floors) else chosen


def _whole(table: Table | None, part: Sequence[FloorSection]) -> Table | None:
    """Say of a table that it is of all floors, where the other sheets are not."""
    return replace(table, title=f"{table.title}: {WHOLE_PLAN}") if table is not None and part else table


def _cut_lower(plan: PlanSource, floors: Sequence[FloorSheets], options: Options) -> list[str]:
    """Say where the height wanted is not that at which walls are cut."""
    views = [floor.view for floor in floors if floor.view.surface is not None]
    unit = plan.frame.unit
    low = [view for view in views if view.cut_m < options.cut_m - 1e-6]
    lower = [f"{view.floor.name!r} at {cut_words(unit, view.cut_m)}" for view in low]
    if not lower:
        return []
    more = f" and {len(lower) - 3} more" if len(lower) > 3 else ""
    return [
        f"walls are cut lower than at {cut_words(unit, options.cut_m)}, half-way to the floor above: "
        f"{', '.join(lower[:3])}{more}"
    ]


def _worth_a_sheet(plan: PlanSource, floor: FloorSection, options: Options) -> bool:
    """Floors that are not required, here or of the plan, have none."""
    return bool(options.floors) or floor.id in planned_floors(plan.document) or bool(plan.stations_of(floor.id))


def _nowhere(plan: PlanSource, options: Options) -> Table | None:
    """Stations that are on none of the plan's floors, as given ones may be; None where there is none."""
    floors = {floor.id for floor in plan.floors}
    stations = [station for station in chosen_stations(plan, options) if station.floor_id not in floors]
    return stations_table(plan, "no floor", stations) if stations else None


def _histograms(plan: PlanSource, building: Building | None, remarks: list[str]) -> list[Histogram]:
    made = [] if building is None else histograms_of(plan, building)
    if not made:
        remarks.append("histograms of range, incidence and spacing are left out: the plan folder has no such figures")
    return made


def _unprintable(plan: PlanSource) -> list[str]:
    names = [plan.title, *(floor.name for floor in plan.floors), *(station.id for station in plan.stations)]
    names += [str(row["name"]) for row in plan.document.get("unseen", ())]
    line = lacking_letters(names)
    return [line] if line else []


def pages_of(contents: Contents, paper: str) -> list[Page]:
    """Lay the contents out: cover, a sheet a floor and its stations, figures, charts, remarks."""
    plan, (sheet, zoom) = contents.plan, text_sheet(paper)
    pages: list[Page] = []
    pages.append(_cover(contents, sheet, pages))
    for floor in contents.floors:
        pages += _drawings(plan, floor, first=len(pages) + 1)
        pages += _table_pages(plan, f"Stations of {floor.view.floor.name}", [floor.table], sheet)
    pages += _table_pages(plan, "Figures", contents.summary, sheet)
    pages.append(_charts(contents, sheet))
    remarks = (*warnings_of(plan), *contents.remarks)
    if len(remarks) > MAX_WARNINGS:
        rows = tuple((str(place), line) for place, line in enumerate(remarks, start=1))
        table = Table("Remarks", (Column("No.", 6, number=True), Column("Warning", 150)), rows)
        pages += _table_pages(plan, "Remarks", [table], sheet)
    return [replace(page, zoom=zoom) if page.sheet is sheet else page for page in pages]


def _cover(contents: Contents, sheet: Sheet, pages: list[Page]) -> Page:
    """The cover of what `pages` will hold by the time it is drawn."""

    def draw(canvas: Canvas, number: int, n_sheets: int) -> None:
        draw_frame(canvas, contents.plan, sheet, "Plan of the laser scans", number=number, n_sheets=n_sheets)
        index = _index([page.title for page in pages])
        draw_cover(canvas, contents.plan, sheet, part=contents.part, remarks=contents.remarks, index=index)

    return Page("Cover", sheet, draw)


def _index(titles: Sequence[str]) -> list[str]:
    """Sheets by number, those of one title in one line."""
    lines, first = [], 1
    for title, same in groupby(titles):
        last = first + len(list(same)) - 1
        lines.append(f"{first}{f'–{last}' if last > first else ''}   {title}")
        first = last + 1
    return lines


def _drawings(plan: PlanSource, floor: FloorSheets, *, first: int) -> list[Page]:
    """Sheets of a floor, the first of them number `first`."""
    neighbours = tuple(Neighbour(t.column, t.row, first + place) for place, t in enumerate(floor.tiles))

    def page(tile: Tile, place: int) -> Page:
        def draw(canvas: Canvas, number: int, n_sheets: int) -> None:
            draw_floor(canvas, plan, floor.view, tile, sheet=number, n_sheets=n_sheets, neighbours=neighbours)

        part = f", part {place + 1} of {len(floor.tiles)}" if len(floor.tiles) > 1 else ""
        return Page(f"{floor.view.floor.name}, 1:{tile.scale}{part}", tile.sheet, draw)

    return [page(tile, place) for place, tile in enumerate(floor.tiles)]


def _table_pages(plan: PlanSource, title: str, tables: Sequence[Table], sheet: Sheet) -> list[Page]:
    room = text_room(sheet)

    def page(pieces: list[TablePiece]) -> Page:
        def draw(canvas: Canvas, number: int, n_sheets: int) -> None:
            draw_frame(canvas, plan, sheet, title, number=number, n_sheets=n_sheets)
            for piece in pieces:
                draw_piece(canvas, piece, room)

        return Page(title, sheet, draw)

    return [page(pieces) for pieces in paginated(tables, room)]


def _charts(contents: Contents, sheet: Sheet) -> Page:
    title = charts_title(contents.part)

    def draw(canvas: Canvas, number: int, n_sheets: int) -> None:
        draw_frame(canvas, contents.plan, sheet, title, number=number, n_sheets=n_sheets)
        boxes = _quarters(text_room(sheet))
        draw_curve(canvas, contents.plan, boxes[0])
        for made, box in zip(contents.histograms, boxes[1:], strict=False):
            draw_histogram(canvas, made, box)

    return Page(title, sheet, draw)


def charts_title(part: Sequence[FloorSection]) -> str:
    """What stands above the charts, which are always of all floors."""
    return "Scan quality" + (f": {WHOLE_PLAN}" if part else "")


def _quarters(room: Box) -> list[Box]:
    width, height = (room.width - 10) / 2, (room.height - 8) / 2
    return [
        Box(room.left + column * (width + 10), room.top - height - row * (height + 8), width, height)
        for row in range(2)
        for column in range(2)
    ]


# ----------------------------------------------------------------------------------------------------------------- pdf
# Format `pdf`: the sheets of a plan to print, to scale. PlanSource -> PDF.

STAGE = "sheets"


def write_pdf(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the sheets into the file `path`; remarks say what could not be shown.

    Raises
    ------
    RequirementError, ExportError, MissingPackageError
        See `planner_core.export.sheets.sheet_set.gather`.
    """
    progress(ProgressEvent(STAGE, 0, 0, "reading the plan folder"))
    contents = gather(plan, options)
    pages = pages_of(contents, options.paper)
    _write(contents, pages, path, progress)
    progress(ProgressEvent(STAGE, len(pages), len(pages)))
    return contents.remarks


def _write(contents: Contents, pages: Sequence[Page], path: Path, progress: Progress) -> None:
    plan = contents.plan
    floors = f": {', '.join(floor.name for floor in contents.part)}" if contents.part else ""
    book = PdfBook(path, title=f"Scan plan of {plan.title}{floors}", subject=f"Coordinates: {plan.frame.crs_line}")
    for number, page in enumerate(pages, start=1):
        progress(ProgressEvent(STAGE, number - 1, len(pages), page.title))
        page.draw(
            book.page(page.sheet.width_mm, page.sheet.height_mm, title=page.title, zoom=page.zoom), number, len(pages)
        )
        book.turn()
    book.close()
