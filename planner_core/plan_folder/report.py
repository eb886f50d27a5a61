"""The report folder: pictures, coverage curve, what stays unseen, and a page that shows them all.

Plan, ScanEngine -> report/. The page needs nothing but the pictures beside it: no scripts, nothing from the network.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import ExitStack
from html import escape
from pathlib import Path

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import MissingPackageError
from planner_core.model import Plan
from planner_core.plan_folder import html_parts
from planner_core.plan_folder.drawing import plot
from planner_core.plan_folder.drawing.canvas import Box, Canvas
from planner_core.plan_folder.drawing.fonts import lacking_letters
from planner_core.plan_folder.drawing.png_canvas import PngCanvas
from planner_core.plan_folder.maps import view_floor, write_floor_map, write_link_map, write_overview
from planner_core.plan_folder.offscreen import offscreen_window
from planner_core.plan_folder.pictures import write_floor_picture
from planner_core.plan_folder.plan_source import PlanSource, source_of
from planner_core.plan_folder.plan_tables import (
    floors_table,
    gaps_table,
    networks_table,
    requirements_table,
    stations_tables,
    targets_table,
    unseen_tables,
)
from planner_core.plan_folder.plan_words import plan_figures, warnings_of
from planner_core.plan_folder.sheet import WIDTH_MM, drawn_floors
from planner_core.plan_folder.unseen_csv import unseen_csv, unseen_surfaces_csv

# ------------------------------------------------------------------------------------------------------- curve drawing
# The curve of coverage: covered share of the achievable area against the number of stations. PlanSource -> drawing.


def draw_curve(canvas: Canvas, plan: PlanSource, box: Box) -> None:
    """Draw covered share against number of stations, the most useful first where the plan has their order."""
    why = plan.document.get("why")
    steps = [] if why is None else why["curve"]
    number = {station.id: station.number for station in plan.stations}
    plot.draw_curve(
        canvas,
        box,
        [step["fraction_of_achievable"] for step in steps] or list(plan.document.get("coverage_curve", ())),
        [str(number.get(step["station"], step["station"])) for step in steps],
        required=float(plan.document["requirements"]["coverage"]),
    )


def write_coverage_curve(plan: PlanSource, path: Path) -> None:
    """Write the curve as a PNG."""
    zoom = 1.6
    canvas = PngCanvas(WIDTH_MM / zoom, 80.0, zoom=zoom)
    draw_curve(canvas, plan, Box(5.0, 2.0, canvas.box.width - 10.0, 76.0))
    canvas.save(path)


# -------------------------------------------------------------------------------------------------------------- report
def report_files(plan: Plan, *, pictures: bool = True) -> tuple[str, ...]:
    """Names below report/ that `write_report` writes, in the order of writing."""
    surfaces = ["unseen_surfaces.csv"] if plan.why is not None else []
    return (*(_picture_files(plan) if pictures else ()), "unseen.csv", *surfaces, "index.html")


def _picture_files(plan: Plan) -> tuple[str, ...]:
    floors = drawn_floors(plan)
    maps = [name(index) for index in floors for name in (map_name, link_map_name)]
    pictures = [picture_name(index) for index in floors]
    overview = ["overview.png"] if floors else []
    return (*maps, *pictures, *overview, "coverage_curve.png")


def map_name(floor_index: int) -> str:
    """File name of a floor's map."""
    return f"map_F{floor_index}.png"


def link_map_name(floor_index: int) -> str:
    """File name of a floor's map of links."""
    return f"links_F{floor_index}.png"


def picture_name(floor_index: int) -> str:
    """File name of a floor's coverage picture."""
    return f"picture_F{floor_index}.png"


def write_report(plan: Plan, folder: Path, *, engine: ScanEngine, pictures: bool = True) -> Iterator[str]:
    """Write the report into `folder`, yielding the name of each file once it is there.

    pictures : False leaves out maps, coverage pictures and the curve, which take longer than all else. Where nothing
    can draw the coverage pictures, they alone are left out: the page gives the reason, and so does the name yielded.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = ""
    source = source_of(plan)
    if pictures:
        missing = yield from _write_pictures(plan, source, folder, engine)
    (folder / "unseen.csv").write_text(unseen_csv(plan), encoding="utf-8")
    yield "unseen.csv"
    if plan.why is not None:
        (folder / "unseen_surfaces.csv").write_text(unseen_surfaces_csv(plan, plan.why), encoding="utf-8")
        yield "unseen_surfaces.csv"
    page = report_page(plan, source, pictures=pictures, without_pictures=missing)
    (folder / "index.html").write_text(page, encoding="utf-8")
    yield "index.html"


def _write_pictures(plan: Plan, source: PlanSource, folder: Path, engine: ScanEngine) -> Generator[str, None, str]:
    """Write the pictures, yielding their names; return why there are no coverage pictures, empty where there are."""
    floors = drawn_floors(plan)
    for index in floors:
        view = view_floor(plan, index, engine=engine)
        write_floor_map(plan, index, folder / map_name(index), view=view, source=source)
        yield map_name(index)
        write_link_map(plan, index, folder / link_map_name(index), view=view, source=source)
        yield link_map_name(index)
    missing = ""
    with ExitStack() as opened:
        try:
            window = opened.enter_context(offscreen_window())
        except MissingPackageError as error:
            missing = str(error)
        for index in floors:
            if missing:
                yield f"{picture_name(index)} is left out: {missing}"
                continue
            write_floor_picture(plan, index, folder / picture_name(index), window=window, source=source)
            yield picture_name(index)
    if floors:
        write_overview(plan, folder / "overview.png", engine=engine, source=source)
        yield "overview.png"
    write_coverage_curve(source, folder / "coverage_curve.png")
    yield "coverage_curve.png"
    return missing


def report_page(
    plan: Plan, source: PlanSource | None = None, *, pictures: bool = True, without_pictures: str = ""
) -> str:
    """Return the text of index.html.

    source : of the plan; None: it is made. pictures : whether the page shows pictures at all.
    without_pictures : why there are no coverage pictures; empty where they are there.
    """
    source = source or source_of(plan)
    warnings = [
        *warnings_of(source),
        *(letter_warnings(plan) if pictures else ()),
        *([f"coverage pictures are left out: {without_pictures}"] if without_pictures else []),
    ]
    unseen = unseen_tables(source)
    after = (networks_table(source), targets_table(source), gaps_table(source), *unseen)
    before = (requirements_table(source), floors_table(source))
    parts = [
        f"<h1>Scan plan of {html_parts.words(source.title)}</h1>",
        html_parts.figures(plan_figures(source)),
        html_parts.warnings(warnings),
        *(html_parts.rows_of(table) for table in before if table is not None),
        *(_pictures(plan, with_coverage=not without_pictures) if pictures else ()),
        *(html_parts.rows_of(table) for table in (*stations_tables(source), *after) if table is not None),
        "" if unseen else "<p>All scannable surface is seen.</p>",
    ]
    return html_parts.page(f"Scan plan of {source.title}", parts)


def letter_warnings(plan: Plan) -> tuple[str, ...]:
    """A line where maps and pictures draw letters of names as boxes, as no font of this machine has them."""
    names = [plan.survey.scene.title, *(floor.name for floor in plan.survey.floors), *(s.id for s in plan.stations)]
    line = lacking_letters(names)
    return (line,) if line else ()


def _pictures(plan: Plan, *, with_coverage: bool) -> Iterator[str]:
    if drawn_floors(plan):
        yield '<figure><img src="overview.png" alt="Floors, cut open"></figure>'
    for index in drawn_floors(plan):
        name = escape(plan.survey.floors[index].name)
        if with_coverage:
            yield f'<figure><img src="{picture_name(index)}" alt="Coverage of {name}"></figure>'
        yield f'<figure><img src="{map_name(index)}" alt="Map of {name}"></figure>'
        yield f'<figure><img src="{link_map_name(index)}" alt="Links between the stations of {name}"></figure>'
    yield '<figure><img src="coverage_curve.png" alt="Coverage against number of stations"></figure>'
