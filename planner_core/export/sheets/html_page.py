"""Format `html`: the sheets of a plan as one page for browsers, with nothing beside it. PlanSource -> HTML.

Drawings are vectors inside the page; printed at 100 % they are to scale, a sheet each.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path

from planner_core.export.options import Options
from planner_core.export.sheets.charts import draw_histogram
from planner_core.export.sheets.cover import OVERVIEW, SUBTITLE, cover_figures, has_picture, picture_words
from planner_core.export.sheets.floor_page import Neighbour, draw_floor
from planner_core.export.sheets.paper import MARGIN_MM, sheet_of
from planner_core.export.sheets.sheet_set import Contents, FloorSheets, charts_title, gather
from planner_core.plan_folder import html_parts
from planner_core.plan_folder.drawing.canvas import Box, Canvas
from planner_core.plan_folder.drawing.svg_canvas import SvgCanvas
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import part_words, warnings_of
from planner_core.plan_folder.report import draw_curve
from planner_core.progress import Progress, ProgressEvent

STAGE = "sheets"
_CHART = Box(0, 0, 134, 82)
#: Browsers print sheets within margins a little smaller than the sheets' own: so that none runs over.
_SLACK_MM = 1.0

_STYLE = """
body{{max-width:{width}mm}}
.charts{{display:flex;flex-wrap:wrap;gap:8mm}}
@media screen and (max-width:640px){{.sheet{{overflow-x:auto}}.sheet svg{{width:760px;max-width:none}}
.sheet.upright svg{{width:560px}}.charts svg{{max-width:none}}}}
@page{{size:{paper} landscape;margin:{margin}mm}}
@page upright{{size:{paper} portrait;margin:{margin}mm}}
@media print{{body{{margin:0;padding:0;max-width:none;font-size:12px}}table{{font-size:10px}}
.sheet{{break-before:page;break-after:page;break-inside:avoid;margin:0}}.upright{{page:upright}}
.screen{{display:none}}img{{max-height:80mm;max-width:none;width:auto}}
.sheet svg{{max-width:none}}.charts svg{{break-inside:avoid}}}}
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
    tiles = [tile for floor in contents.floors for tile in floor.tiles]
    parts = [
        f"<h1>{html_parts.words(plan.title)}</h1>",
        f'<p class="quiet">{SUBTITLE}</p>',
        f"<p><b>{html_parts.words(part_words(plan, contents.part))}</b></p>" if contents.part else "",
        html_parts.figures(cover_figures(plan, contents.part)),
        html_parts.warnings([*warnings_of(plan), *contents.remarks]),
        _overview(contents),
    ]
    first = 1
    for floor in contents.floors:
        parts.append(f'<h2 class="screen">{html_parts.words(floor.view.floor.name)}</h2>')
        parts += [*_drawings(plan, floor, first, len(tiles)), html_parts.rows_of(floor.table)]
        first += len(floor.tiles)
    parts += map(html_parts.rows_of, contents.summary)
    parts.append(_charts(contents))
    width, margin = f"{sheet.frame.width + 2 * _SLACK_MM:g}", f"{MARGIN_MM - _SLACK_MM:g}"
    style = _STYLE.format(paper=sheet.paper, width=width, margin=margin)
    return html_parts.page(f"Scan plan of {plan.title}", parts, more_style=style)


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
