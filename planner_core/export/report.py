"""The report folder: pictures, coverage curve, what stays unseen, and a page that shows them all.

Plan, ScanEngine -> report/. The page needs nothing but the pictures beside it: no scripts, nothing from the network.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path

from planner_core.errors import MissingPackageError
from planner_core.export.maps import view_floor, write_coverage_curve, write_floor_map, write_link_map, write_overview
from planner_core.export.pictures import write_floor_picture
from planner_core.model import Plan
from planner_core.scan.engine import ScanEngine

UNSEEN_COLUMNS = ("element", "name", "kind", "source_id", "floor", "unseen_area_m2", "achievable_area_m2")
MAX_UNSEEN_ON_PAGE = 30


def report_files(plan: Plan) -> tuple[str, ...]:
    """Names below report/ that `write_report` writes, in the order of writing."""
    floors = range(len(plan.survey.floors))
    maps = [name(index) for index in floors for name in (map_name, link_map_name, picture_name)]
    overview = ["overview.png"] if plan.survey.floors else []
    return (*maps, *overview, "coverage_curve.png", "unseen.csv", "index.html")


def map_name(floor_index: int) -> str:
    """File name of a floor's map."""
    return f"map_F{floor_index}.png"


def link_map_name(floor_index: int) -> str:
    """File name of a floor's map of links."""
    return f"links_F{floor_index}.png"


def picture_name(floor_index: int) -> str:
    """File name of a floor's coverage picture."""
    return f"picture_F{floor_index}.png"


def write_report(plan: Plan, folder: Path, *, engine: ScanEngine) -> Iterator[str]:
    """Write the report into `folder`, yielding the name of each file once it is there.

    Where nothing can draw the coverage pictures, they are left out: the page says why, and so does what is yielded.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = ""
    for index in range(len(plan.survey.floors)):
        view = view_floor(plan, index, engine=engine)
        write_floor_map(plan, index, folder / map_name(index), view=view)
        yield map_name(index)
        write_link_map(plan, index, folder / link_map_name(index), view=view)
        yield link_map_name(index)
        try:
            write_floor_picture(plan, index, folder / picture_name(index), engine=engine)
            yield picture_name(index)
        except MissingPackageError as error:
            missing = str(error)
            yield f"{picture_name(index)} is left out: {missing}"
    if plan.survey.floors:
        write_overview(plan, folder / "overview.png", engine=engine)
        yield "overview.png"
    write_coverage_curve(plan, folder / "coverage_curve.png")
    yield "coverage_curve.png"
    (folder / "unseen.csv").write_text(unseen_csv(plan), encoding="utf-8")
    yield "unseen.csv"
    (folder / "index.html").write_text(report_page(plan, without_pictures=missing), encoding="utf-8")
    yield "index.html"


def unseen_csv(plan: Plan) -> str:
    """Return the text of unseen.csv: achievable surface that the plan leaves unseen, element by element."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(UNSEEN_COLUMNS)
    for part in plan.unseen:
        element = plan.survey.scene.elements[part.element]
        areas = (f"{part.unseen_area_m2:.3f}", f"{part.achievable_area_m2:.3f}")
        writer.writerow([part.element, element.name, element.kind, element.source_id, part.floor, *areas])
    return text.getvalue()


def report_page(plan: Plan, *, without_pictures: str = "") -> str:
    """Return the text of index.html.

    without_pictures : why there are no coverage pictures; empty where they are there.
    """
    name = escape(plan.survey.scene.source.path.name)
    parts = [
        f"<h1>Scan plan of {name}</h1>",
        _figures(plan),
        _warnings(plan, without_pictures),
        *_pictures(plan, with_pictures=not without_pictures),
        "<h2>Stations</h2>",
        _stations(plan),
        "<h2>What stays unseen</h2>",
        _unseen(plan),
    ]
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>Scan plan of {name}</title>\n'
        f"<style>{_STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;color:#1e2a32;max-width:1200px;margin:2rem auto;padding:0 1rem}"
    "h1{margin-bottom:.2em}h2{margin-top:2em}img{max-width:100%;border:1px solid #e3e5e7}"
    "table{border-collapse:collapse}td,th{padding:.25em .9em .25em 0;text-align:left;border-bottom:1px solid #e3e5e7}"
    "td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.warning{color:#a8430f}"
    "@media print{figure{break-inside:avoid}}figure{margin:1.5rem 0}"
)


def _figures(plan: Plan) -> str:
    scanner, coverage, asked = plan.settings.scanner, plan.coverage, plan.settings.requirements
    bound = f", at least {plan.lower_bound} needed on these candidates" if plan.lower_bound > 0 else ""
    state = "all stations connected" if plan.connected else "<b>not all stations connected</b>"
    n_links = sum(link.overlap >= asked.overlap for link in plan.links)
    rows = [
        ("Stations", f"{len(plan.stations)}{bound}"),
        (
            "Coverage",
            f"{100 * coverage.fraction_of_achievable:.1f} % of {coverage.achievable_area_m2:.0f} m² achievable from "
            f"admissible positions (asked for: {100 * asked.coverage:g} %); "
            f"{100 * coverage.fraction_of_total:.1f} % of all {coverage.total_area_m2:.0f} m² in the model",
        ),
        ("Registration", f"{n_links} links with at least {100 * asked.overlap:g} % overlap; {state}"),
        ("Scanner", f"{escape(scanner.title)}, range {scanner.range_max_m:g} m, {scanner.n_beams:,} beams a scan"),
        ("Patches", f"at most {plan.survey.patches.max_area_m2:g} m² each"),
    ]
    for floor, figures in zip(plan.survey.floors, plan.coverage_by_floor, strict=True):
        n_stations = sum(station.floor == floor.id for station in plan.stations)
        share = f"{100 * figures.fraction_of_achievable:.1f} % of {figures.achievable_area_m2:.0f} m²"
        value = f"{n_stations} stations, {share}"
        rows.append((escape(floor.name), value))
    return _table((), ((f"<b>{label}</b>", value) for label, value in rows), numbers_from=9)


def _warnings(plan: Plan, without_pictures: str) -> str:
    lines = [*plan.warnings, *([f"coverage pictures are left out: {without_pictures}"] if without_pictures else [])]
    return "\n".join(f'<p class="warning">{escape(line)}</p>' for line in lines)


def _pictures(plan: Plan, *, with_pictures: bool) -> Iterator[str]:
    if plan.survey.floors:
        yield '<figure><img src="overview.png" alt="All floors, cut open"></figure>'
    for index, floor in enumerate(plan.survey.floors):
        name = escape(floor.name)
        if with_pictures:
            yield f'<figure><img src="{picture_name(index)}" alt="Coverage of {name}"></figure>'
        yield f'<figure><img src="{map_name(index)}" alt="Map of {name}"></figure>'
        yield f'<figure><img src="{link_map_name(index)}" alt="Links between the stations of {name}"></figure>'
    yield '<figure><img src="coverage_curve.png" alt="Coverage against number of stations"></figure>'


def _stations(plan: Plan) -> str:
    names = {floor.id: floor.name for floor in plan.survey.floors}
    header = ("No.", "Id", "Floor", "x, m", "y, m", "z, m", "Instrument height, m", "Sees, m²", "Sees alone, m²")
    rows = (
        (
            str(station.order),
            escape(station.id),
            escape(names.get(station.floor, station.floor)),
            *(f"{value:.3f}" for value in station.position_m + plan.survey.scene.offset_m),
            f"{station.instrument_height_m:.3f}",
            f"{station.covered_area_m2:.1f}",
            f"{station.own_area_m2:.1f}",
        )
        for station in plan.stations
    )
    return _table(header, rows, numbers_from=3)


def _unseen(plan: Plan) -> str:
    largest = sorted(plan.unseen, key=lambda part: (-part.unseen_area_m2, part.element, part.floor))
    elements = plan.survey.scene.elements
    rows = (
        (
            escape(elements[part.element].name),
            escape(elements[part.element].kind),
            escape(part.floor),
            f"{part.unseen_area_m2:.2f}",
            f"{part.achievable_area_m2:.2f}",
        )
        for part in largest[:MAX_UNSEEN_ON_PAGE]
    )
    if not largest:
        return "<p>Everything achievable is seen.</p>"
    text = _table(("Element", "Kind", "Floor", "Unseen, m²", "Achievable, m²"), rows, numbers_from=3)
    n_more = len(largest) - MAX_UNSEEN_ON_PAGE
    return text + (f"\n<p>{n_more} more in unseen.csv.</p>" if n_more > 0 else "")


def _table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]], *, numbers_from: int) -> str:
    """Cells are HTML already; columns from `numbers_from` on are aligned as numbers."""

    def cells(tag: str, row: tuple[str, ...]) -> str:
        marks = (' class="n"' if index >= numbers_from else "" for index in range(len(row)))
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    lines = [f"<tr>{cells('th', header)}</tr>"] if header else []
    lines += [f"<tr>{cells('td', row)}</tr>" for row in rows]
    return "<table>\n" + "\n".join(lines) + "\n</table>"
