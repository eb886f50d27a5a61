"""Tables on printed pages: columns by share, words wrapped, rows carried over to further pages. Table -> pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.plan_folder.drawing.canvas import INK, QUIET, RULE, Box, Canvas, Pen
from planner_core.plan_folder.drawing.fonts import wrapped
from planner_core.plan_folder.plan_tables import Column, Table

SIZE_PT = 7.2
_HEAD_PT = 6.4
_TITLE_PT = 10.5
_NOTE_PT = 6.8
_LINE_MM = 3.25
_PAD_MM = 1.05
_GAP_MM = 2.8
"""Between columns."""
_TITLE_MM = 7.0
_NOTE_MM = 4.0
_BETWEEN_MM = 7.0
#: A table begins on a page only where its head and so many rows have room.
_LEAST_ROWS = 3


@dataclass(frozen=True, eq=False)
class TablePiece:
    """Part of a table on one page. top : of its title. rows : cells, each a list of lines."""

    table: Table
    top: float
    first: bool
    rows: tuple[tuple[list[str], ...], ...]


def paginated(tables: Sequence[Table], room: Box) -> list[list[TablePiece]]:
    """Lay tables out one below the other on as many pages as they take, all with the same room."""
    pages: list[list[TablePiece]] = [[]]
    top = room.top
    for table in tables:
        widths = _widths(table.columns, room.width)
        rows = [tuple(_cell(*cell) for cell in zip(row, table.columns, widths, strict=True)) for row in table.rows]
        done, first = 0, True
        while done < len(rows) or first:
            least = sum(_height(row) for row in rows[done : done + _LEAST_ROWS])
            if pages[-1] and top - _head_mm(table, widths, first=first) - least < room.bottom:
                pages.append([])
                top = room.top
            space = top - _head_mm(table, widths, first=first) - room.bottom
            n = _fitting(rows[done:], space)
            piece = TablePiece(table, top, first, tuple(rows[done : done + n]))
            pages[-1].append(piece)
            top -= _head_mm(table, widths, first=first) + sum(_height(row) for row in piece.rows) + _BETWEEN_MM
            done, first = done + n, False
            if done < len(rows):
                pages.append([])
                top = room.top
    return pages


def _fitting(rows: Sequence[tuple[list[str], ...]], space_mm: float) -> int:
    """How many rows have room; one at least, so that every page gets on."""
    used, n = 0.0, 0
    for row in rows:
        used += _height(row)
        if used > space_mm and n:
            break
        n += 1
    return n


def draw_piece(canvas: Canvas, piece: TablePiece, room: Box) -> None:
    """Draw a part of a table."""
    table, widths = piece.table, _widths(piece.table.columns, room.width)
    more = "" if piece.first else " (continued)"
    canvas.text((room.left, piece.top - 4.2), table.title + more, _TITLE_PT, bold=True)
    top = piece.top - _TITLE_MM
    if table.note and piece.first:
        for line in _note(table, room.width):
            canvas.text((room.left, top - 2.6), line, _NOTE_PT, colour=QUIET)
            top -= _NOTE_MM
    heads = _heads(table, widths)
    _draw_row(canvas, heads, table.columns, widths, room.left, top, head=True)
    top -= _height(heads)
    canvas.lines([np.array([(room.left, top), (room.right, top)])], Pen(0.35, INK))
    for row in piece.rows:
        _draw_row(canvas, row, table.columns, widths, room.left, top, head=False)
        top -= _height(row)
        canvas.lines([np.array([(room.left, top), (room.right, top)])], Pen(0.1, RULE))


def _draw_row(
    canvas: Canvas,
    cells: Sequence[list[str]],
    columns: Sequence[Column],
    widths: Sequence[float],
    left: float,
    top: float,
    *,
    head: bool,
) -> None:
    size_pt = _HEAD_PT if head else SIZE_PT
    for lines, column, width in zip(cells, columns, widths, strict=True):
        x, align = (left + width - _GAP_MM, "right") if column.number else (left, "left")
        for place, line in enumerate(lines):
            y = top - _PAD_MM - 0.8 * _LINE_MM - place * _LINE_MM
            canvas.text(
                (x, y), line, size_pt, bold=column.bold and not head, align=align, colour=QUIET if head else INK
            )
        left += width


def _widths(columns: Sequence[Column], width_mm: float) -> list[float]:
    whole = sum(column.share for column in columns)
    return [column.share / whole * width_mm for column in columns]


def _cell(words: str, column: Column, width_mm: float) -> list[str]:
    return _lines(words, column, width_mm, SIZE_PT)


def _lines(words: str, column: Column, width_mm: float, size_pt: float) -> list[str]:
    return wrapped(words, size_pt, width_mm - _GAP_MM, bold=column.bold)


def _heads(table: Table, widths: Sequence[float]) -> list[list[str]]:
    return [_lines(column.title, column, width, _HEAD_PT) for column, width in zip(table.columns, widths, strict=True)]


def _height(row: Sequence[list[str]]) -> float:
    return max(len(lines) for lines in row) * _LINE_MM + 2 * _PAD_MM


def _note(table: Table, width_mm: float) -> list[str]:
    return wrapped(table.note, _NOTE_PT, width_mm)


def _head_mm(table: Table, widths: Sequence[float], *, first: bool) -> float:
    """Height of title, note and head."""
    note = len(_note(table, sum(widths))) * _NOTE_MM if table.note and first else 0.0
    return _TITLE_MM + note + _height(_heads(table, widths))
