"""Format `html`: the sheets of a plan as one page for browsers, with nothing beside it. PlanSource -> HTML.

Drawings are vectors inside the page; printed at 100 % they are to scale, a sheet each.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from planner_core.handover.options import Options
from planner_core.handover.sheets.book import Contents, FloorSheets, gather, plan_guarded
from planner_core.handover.sheets.charts import draw_curve, draw_histogram
from planner_core.handover.sheets.cover import OVERVIEW, SUBTITLE, has_picture
from planner_core.handover.sheets.floor_page import Neighbour, draw_floor
from planner_core.handover.sheets.ink import Box, Ink, clean
from planner_core.handover.sheets.paper import MARGIN_MM, sheet_of
from planner_core.handover.sheets.svg_ink import SvgInk
from planner_core.handover.sheets.words import Table, plan_figures, warnings_of
from planner_core.handover.source import PlanSource
from planner_core.progress import Progress, ProgressEvent

STAGE = "sheets"
_CHART = Box(0, 0, 134, 82)
#: Browsers print sheets within margins a little smaller than the sheets' own: so that none runs over.
_SLACK_MM = 1.0

_STYLE = """
body{{font:15px/1.5 "DejaVu Sans",Verdana,system-ui,sans-serif;color:#111;background:#fff;max-width:{width}mm;
margin:1.5rem auto;padding:0 1rem}}
h1{{margin:0 0 .2em;font-size:1.9em;overflow-wrap:anywhere}}h2{{margin:1.8em 0 .4em;font-size:1.25em}}
.quiet{{color:#555;margin:.2em 0}}
table{{border-collapse:collapse;width:100%;font-size:13px;margin-bottom:1.2em}}
th,td{{padding:.3em .8em .3em 0;text-align:left;vertical-align:top;border-bottom:1px solid #bbb;overflow-wrap:anywhere}}
thead th{{border-bottom:2px solid #111;color:#444}}
.n{{text-align:right;font-variant-numeric:tabular-nums;}}td.n{{white-space:nowrap}}.b{{font-weight:bold}}
.heed{{border:2px solid #111;padding:.6em 1.2em}}.heed ul{{padding-left:1.2em;margin:.3em 0}}
figure{{margin:1rem 0}}img,svg{{max-width:100%;height:auto;display:block}}
.charts{{display:flex;flex-wrap:wrap;gap:8mm}}
.wide{{overflow-x:auto}}
@page{{size:{paper} landscape;margin:{margin}mm}}
@page upright{{size:{paper} portrait;margin:{margin}mm}}
@media print{{body{{margin:0;padding:0;max-width:none;font-size:12px}}table{{font-size:10px}}
.sheet{{break-before:page;break-after:page;break-inside:avoid;margin:0}}.upright{{page:upright}}
.screen{{display:none}}img{{max-height:95mm;max-width:none;width:auto}}
.sheet svg{{max-width:none}}tr,.charts svg{{break-inside:avoid}}h2{{break-after:avoid}}.wide{{overflow:visible}}}}
"""


def write_html(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the page into the file `path`; remarks say what could not be shown.

    Raises
    ------
    RequirementError, HandoverError, MissingPackageError
        See `planner_core.handover.sheets.book.gather`.
    """
    progress(ProgressEvent(STAGE, 0, 0, "reading the plan folder"))
    with plan_guarded(plan):
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
        _figures(plan),
        _heed([*warnings_of(plan), *contents.remarks]),
        _overview(plan),
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
        f'content="width=device-width">\n<title>Scan plan of {name}</title>\n<style>{style}</style>\n</head>\n<body>\n'
        f"{body}\n</body>\n</html>\n"
    )


def _words(words: str) -> str:
    return escape(clean(words))


def _figures(plan: PlanSource) -> str:
    rows = "\n".join(f'<tr><th scope="row">{_words(name)}</th><td>{_words(value)}</td></tr>' for name, value in
                     plan_figures(plan))  # fmt: skip
    return f"<table>\n{rows}\n</table>"


def _heed(lines: Sequence[str]) -> str:
    if not lines:
        return ""
    items = "\n".join(f"<li>{_words(line)}</li>" for line in lines)
    return f'<div class="heed"><b>To be heeded</b>\n<ul>\n{items}\n</ul></div>'


def _overview(plan: PlanSource) -> str:
    if not has_picture(plan):
        return ""
    content = base64.b64encode((plan.folder / OVERVIEW).read_bytes()).decode("ascii")
    return f'<figure><img src="data:image/png;base64,{content}" alt="All floors, cut open"></figure>'


def _drawings(plan: PlanSource, floor: FloorSheets, first: int, n_sheets: int) -> list[str]:
    """Sheets of a floor, the first of them number `first`."""
    neighbours = tuple(Neighbour(t.column, t.row, first + place) for place, t in enumerate(floor.tiles))
    drawn = []
    for number, tile in enumerate(floor.tiles, start=first):
        shown = tile.sheet.frame.inset(-0.5)
        ink = SvgInk(shown, name=f"sheet{number}", title=f"Drawing of {floor.view.floor.name}, 1:{tile.scale}")
        draw_floor(ink, plan, floor.view, tile, sheet=number, n_sheets=n_sheets, neighbours=neighbours)
        upright = " upright" if tile.sheet.height_mm > tile.sheet.width_mm else ""
        drawn.append(f'<figure class="sheet{upright}">{ink.svg()}</figure>')
    return drawn


def _table(table: Table) -> str:
    """A table; its head is repeated on every page when printed."""
    kinds = ["".join(f" {mark}" for mark, on in (("n", c.number), ("b", c.bold)) if on).strip() for c in table.columns]

    def cells(tag: str, row: Sequence[str]) -> str:
        marks = (f' class="{kind}"' if kind else "" for kind in kinds)
        return "".join(f"<{tag}{mark}>{_words(cell)}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    head = cells("th", [column.title for column in table.columns])
    rows = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in table.rows)
    note = f'<p class="quiet">{_words(table.note)}</p>\n' if table.note else ""
    return (
        f'<h2>{_words(table.title)}</h2>\n{note}<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n'
        f"{rows}\n</tbody>\n</table></div>"
    )


def _charts(contents: Contents) -> str:
    def drawn(name: str, title: str, draw: Callable[[Ink], None]) -> str:
        ink = SvgInk(_CHART, name=name, title=title)
        draw(ink)
        return ink.svg()

    charts = [drawn("curve", "What each further station adds", lambda ink: draw_curve(ink, contents.plan, _CHART))]
    for place, made in enumerate(contents.histograms):
        charts.append(
            drawn(f"histogram{place}", made.title, lambda ink, made=made: draw_histogram(ink, made, _CHART))  # type: ignore[misc]
        )
    return '<h2>How well it is seen</h2>\n<div class="charts">\n' + "\n".join(charts) + "\n</div>"
