"""Format `html`: the sheets of a plan as one page for browsers, with nothing beside it. PlanSource -> HTML.

Drawings are vectors inside the page; printed at 100 % they are to scale, a sheet each.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from planner_core.export.options import Options
from planner_core.export.sheets.charts import draw_curve, draw_histogram
from planner_core.export.sheets.cover import OVERVIEW, SUBTITLE, has_picture, picture_words
from planner_core.export.sheets.cover_figures import LEFT_OUT, cover_figures, part_words
from planner_core.export.sheets.floor_page import Neighbour, draw_floor
from planner_core.export.sheets.paper import MARGIN_MM, sheet_of
from planner_core.export.sheets.sheet_set import Contents, FloorSheets, charts_title, gather
from planner_core.export.sheets.tables import Table, warnings_of
from planner_core.plan_folder.drawing.canvas import Box, Canvas
from planner_core.plan_folder.drawing.fonts import unbroken
from planner_core.plan_folder.drawing.svg_canvas import SvgCanvas
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import Progress, ProgressEvent

STAGE = "sheets"
_CHART = Box(0, 0, 134, 82)
#: Browsers print sheets within margins a little smaller than the sheets' own: so that none runs over.
_SLACK_MM = 1.0
_ALARM = ' style="color:#b3141b"'

_STYLE = """
body{{font:15px/1.5 "DejaVu Sans",Verdana,system-ui,sans-serif;color:#111;background:#fff;max-width:{width}mm;
margin:1.5rem auto;padding:0 1rem}}
h1{{margin:0 0 .2em;font-size:1.9em;overflow-wrap:anywhere}}h2{{margin:1.8em 0 .4em;font-size:1.25em}}
.quiet{{color:#555;margin:.2em 0}}
table{{border-collapse:collapse;width:100%;font-size:13px;margin-bottom:1.2em}}
th,td{{padding:.3em .8em .3em 0;text-align:left;vertical-align:top;border-bottom:1px solid #bbb;
overflow-wrap:break-word}}
.figures{{table-layout:fixed}}.figures th{{width:8.2em}}
thead th{{border-bottom:2px solid #111;color:#444}}
.n{{text-align:right;font-variant-numeric:tabular-nums;}}td.n,td.b{{white-space:nowrap}}.b{{font-weight:bold}}
.heed{{border:2px solid #111;padding:.6em 1.2em}}.heed ul{{padding-left:1.2em;margin:.3em 0}}
figure{{margin:1rem 0}}img,svg{{max-width:100%;height:auto;display:block}}
.charts{{display:flex;flex-wrap:wrap;gap:8mm}}
.wide{{overflow-x:auto}}
@media screen and (max-width:640px){{body{{margin:1rem auto;padding:0 .8rem}}h1{{font-size:1.5em}}
.figures th{{width:7.6em}}
.rows,.rows tbody,.rows tr{{display:block}}.rows thead{{display:none}}
.rows tr{{border-bottom:2px solid #111;padding:.5em 0}}.rows tr:first-child{{border-top:2px solid #111}}
.rows td{{display:flex;justify-content:space-between;gap:1.2em;padding:.1em 0;border:0;text-align:right;
white-space:normal}}
.rows td::before{{content:attr(data-name);color:#555;font-weight:normal;text-align:left;flex:0 0 42%}}
.rows td:empty{{display:none}}
.sheet{{overflow-x:auto}}.sheet svg{{width:760px;max-width:none}}.sheet.upright svg{{width:560px}}
.charts svg{{max-width:none}}}}
@page{{size:{paper} landscape;margin:{margin}mm}}
@page upright{{size:{paper} portrait;margin:{margin}mm}}
@media print{{body{{margin:0;padding:0;max-width:none;font-size:12px}}table{{font-size:10px}}
.sheet{{break-before:page;break-after:page;break-inside:avoid;margin:0}}.upright{{page:upright}}
.screen{{display:none}}img{{max-height:80mm;max-width:none;width:auto}}
.sheet svg{{max-width:none}}tr,.charts svg{{break-inside:avoid}}h2,.quiet{{break-after:avoid}}.wide{{overflow:visible}}
td{{overflow-wrap:anywhere}}}}
"""


def write_html(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the page into the file `path`; remarks say what could not be shown.

    Raises
    ------
    RequirementError, ExportError, MissingPackageError
        See `planner_core.export.sheets.sheet_set.gather`.
    """
    progress(ProgressEvent(STAGE, 0, 0, "reading the plan folder"))
    contents = gather(plan, options)
    page = _page(contents, options.paper)
    path.write_text(page, encoding="utf-8")
    progress(ProgressEvent(STAGE, 1, 1))
    return contents.remarks


def _page(contents: Contents, paper: str) -> str:
    plan, sheet = contents.plan, sheet_of(paper, upright=False)
    name = _words(plan.title)
    tiles = [tile for floor in contents.floors for tile in floor.tiles]
    parts = [
        f"<h1>{name}</h1>",
        f'<p class="quiet">{SUBTITLE}</p>',
        f"<p><b>{_words(part_words(plan, contents.part))}</b></p>" if contents.part else "",
        _figures(cover_figures(plan, contents.part)),
        _heed([*warnings_of(plan), *contents.remarks]),
        _overview(contents),
    ]
    first = 1
    for floor in contents.floors:
        parts.append(f'<h2 class="screen">{_words(floor.view.floor.name)}</h2>')
        parts += [*_drawings(plan, floor, first, len(tiles)), _table(floor.table)]
        first += len(floor.tiles)
    parts += [_table(table) for table in contents.summary]
    parts.append(_charts(contents))
    width, margin = f"{sheet.frame.width + 2 * _SLACK_MM:g}", f"{MARGIN_MM - _SLACK_MM:g}"
    style = _STYLE.format(paper=sheet.paper, width=width, margin=margin)
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<meta name="viewport" '
        f'content="width=device-width,initial-scale=1">\n<title>Scan plan of {name}</title>\n<style>{style}</style>\n'
        f"</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _words(words: str) -> str:
    return escape(unbroken(words))


def _figures(figures: Sequence[tuple[str, str]]) -> str:
    rows = "\n".join(
        f'<tr{_ALARM if name == LEFT_OUT else ""}><th scope="row">{_words(name)}</th><td>{_words(value)}</td></tr>'
        for name, value in figures
    )
    return f'<table class="figures">\n{rows}\n</table>'


def _heed(lines: Sequence[str]) -> str:
    if not lines:
        return ""
    items = "\n".join(f"<li>{_words(line)}</li>" for line in lines)
    return f'<div class="heed"><b>Warnings</b>\n<ul>\n{items}\n</ul></div>'


def _overview(contents: Contents) -> str:
    plan = contents.plan
    if not has_picture(plan):
        return ""
    content = base64.b64encode((plan.folder / OVERVIEW).read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{content}" alt="All floors, cut open">\n'
        f'<figcaption class="quiet">{picture_words(contents.part)}</figcaption></figure>'
    )


def _drawings(plan: PlanSource, floor: FloorSheets, first: int, n_sheets: int) -> list[str]:
    """Sheets of a floor, the first of them number `first`."""
    neighbours = tuple(Neighbour(t.column, t.row, first + place) for place, t in enumerate(floor.tiles))
    drawn = []
    for number, tile in enumerate(floor.tiles, start=first):
        shown = tile.sheet.frame.inset(-0.5)
        canvas = SvgCanvas(shown, name=f"sheet{number}", title=f"Drawing of {floor.view.floor.name}, 1:{tile.scale}")
        draw_floor(canvas, plan, floor.view, tile, sheet=number, n_sheets=n_sheets, neighbours=neighbours)
        upright = " upright" if tile.sheet.height_mm > tile.sheet.width_mm else ""
        drawn.append(f'<figure class="sheet{upright}">{canvas.svg()}</figure>')
    return drawn


def _table(table: Table) -> str:
    """A table; its head is repeated on every page when printed."""
    kinds = ["".join(f" {mark}" for mark, on in (("n", c.number), ("b", c.bold)) if on).strip() for c in table.columns]

    # On phones every row is a block, and its cells say themselves what they are.
    names = [f' data-name="{_words(column.title)}"' for column in table.columns]

    def cells(tag: str, row: Sequence[str], more: Sequence[str]) -> str:
        marks = (f' class="{kind}"{name}' if kind else name for kind, name in zip(kinds, more, strict=True))
        return "".join(f"<{tag}{mark}>{_words(cell)}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    head = cells("th", [column.title for column in table.columns], [""] * len(names))
    rows = "\n".join(f"<tr>{cells('td', row, names)}</tr>" for row in table.rows)
    note = f'<p class="quiet">{_words(table.note)}</p>\n' if table.note else ""
    return (
        f'<h2>{_words(table.title)}</h2>\n{note}<div class="wide"><table class="rows">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table></div>"
    )


def _charts(contents: Contents) -> str:
    def drawn(name: str, title: str, draw: Callable[[Canvas], None]) -> str:
        canvas = SvgCanvas(_CHART, name=name, title=title)
        draw(canvas)
        return canvas.svg()

    charts = [
        drawn("curve", "Coverage by number of stations", lambda canvas: draw_curve(canvas, contents.plan, _CHART))
    ]
    for place, made in enumerate(contents.histograms):
        charts.append(
            drawn(f"histogram{place}", made.title, lambda canvas, made=made: draw_histogram(canvas, made, _CHART))  # type: ignore[misc]
        )
    boxes = "\n".join(f'<div class="wide">{chart}</div>' for chart in charts)
    return f'<h2>{charts_title(contents.part)}</h2>\n<div class="charts">\n{boxes}\n</div>'
