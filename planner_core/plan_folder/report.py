"""The report folder: pictures, coverage curve, what stays unseen, and a page that shows them all.

Plan, ScanEngine -> report/. The page needs nothing but the pictures beside it: no scripts, nothing from the network.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from html import escape
from math import isnan
from pathlib import Path

from planner_core.coverage.percent import not_planned, reached_percent
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import MissingPackageError
from planner_core.model import REASONS, Link, Plan, Scope
from planner_core.network.network_report import groups_first, weakest_link
from planner_core.network.weak_motion import motion_words, overlap_percent
from planner_core.plan_folder.curve_drawing import write_coverage_curve
from planner_core.plan_folder.drawing.fonts import lacking_letters
from planner_core.plan_folder.maps import view_floor, write_floor_map, write_link_map, write_overview
from planner_core.plan_folder.pictures import write_floor_picture
from planner_core.plan_folder.report_tables import (
    requirements_table,
    stations_table,
    table,
    unseen_csv,
    unseen_section,
    unseen_surfaces_csv,
)
from planner_core.plan_folder.sheet import drawn_floors
from planner_core.requirements.wording import overlap_defined, overlap_noun


def report_files(plan: Plan, *, pictures: bool = True) -> tuple[str, ...]:
    """Names below report/ that `write_report` writes, in the order of writing."""
    surfaces = ["unseen_surfaces.csv"] if plan.why is not None else []
    return (*(_picture_files(plan) if pictures else ()), "unseen.csv", *surfaces, "index.html")


def _picture_files(plan: Plan) -> tuple[str, ...]:
    floors = drawn_floors(plan)
    maps = [name(index) for index in floors for name in (map_name, link_map_name, picture_name)]
    overview = ["overview.png"] if floors else []
    return (*maps, *overview, "coverage_curve.png")


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
    if pictures:
        missing = yield from _write_pictures(plan, folder, engine)
    (folder / "unseen.csv").write_text(unseen_csv(plan), encoding="utf-8")
    yield "unseen.csv"
    if plan.why is not None:
        (folder / "unseen_surfaces.csv").write_text(unseen_surfaces_csv(plan, plan.why), encoding="utf-8")
        yield "unseen_surfaces.csv"
    page = report_page(plan, pictures=pictures, without_pictures=missing)
    (folder / "index.html").write_text(page, encoding="utf-8")
    yield "index.html"


def _write_pictures(plan: Plan, folder: Path, engine: ScanEngine) -> Generator[str, None, str]:
    """Write the pictures, yielding their names; return why there are no coverage pictures, empty where there are."""
    missing = ""
    floors = drawn_floors(plan)
    for index in floors:
        view = view_floor(plan, index, engine=engine)
        write_floor_map(plan, index, folder / map_name(index), view=view)
        yield map_name(index)
        write_link_map(plan, index, folder / link_map_name(index), view=view)
        yield link_map_name(index)
        try:
            write_floor_picture(plan, index, folder / picture_name(index))
            yield picture_name(index)
        except MissingPackageError as error:
            missing = str(error)
            yield f"{picture_name(index)} is left out: {missing}"
    if floors:
        write_overview(plan, folder / "overview.png", engine=engine)
        yield "overview.png"
    write_coverage_curve(plan, folder / "coverage_curve.png")
    yield "coverage_curve.png"
    return missing


def report_page(plan: Plan, *, pictures: bool = True, without_pictures: str = "") -> str:
    """Return the text of index.html.

    pictures : whether the page shows pictures at all.
    without_pictures : why there are no coverage pictures; empty where they are there.
    """
    name = escape(plan.survey.scene.title)
    parts = [
        f"<h1>Scan plan of {name}</h1>",
        _figures(plan),
        *(("<h2>Requirements</h2>", requirements_table(plan)) if plan.requirements else ()),
        _warnings(plan, letter_warnings(plan) if pictures else (), without_pictures),
        *(_pictures(plan, with_coverage=not without_pictures) if pictures else ()),
        "<h2>Stations</h2>",
        stations_table(plan),
        "<h2>What stays unseen, and why</h2>" if plan.why is not None else "<h2>What stays unseen</h2>",
        unseen_section(plan),
    ]
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<meta name="viewport" '
        f'content="width=device-width">\n<title>Scan plan of {name}</title>\n'
        f"<style>{_STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;color:#1e2a32;max-width:1200px;margin:2rem auto;padding:0 1rem}"
    "h1{margin-bottom:.2em}h2{margin-top:2em}img{max-width:100%;border:1px solid #e3e5e7}"
    "table{border-collapse:collapse}td,th{padding:.25em .9em .25em 0;text-align:left;border-bottom:1px solid #e3e5e7}"
    "td{vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}"
    ".wide{overflow-x:auto;font-size:14px}.own,.links{display:inline-block;min-width:19em}.links{min-width:13em}"
    ".warning{color:#a8430f}.met{color:#1f6f9c}.alarm{color:#b3141b;font-weight:bold}"
    "@media print{figure{break-inside:avoid}}figure{margin:1.5rem 0}"
)


def _figures(plan: Plan) -> str:
    scanner, coverage, requirements = plan.settings.scanner, plan.coverage, plan.settings.requirements
    bound = f", lower bound {plan.lower_bound} on these candidates" if plan.lower_bound > 0 else ""
    if 0 < plan.lower_bound == len(plan.stations):
        bound = ", proven to be the fewest on these candidates"
    reached = reached_percent(coverage.fraction_of_achievable, requirements.coverage)
    rows = [
        ("Stations", f"{len(plan.stations)}{bound}"),
        (
            "Coverage",
            f"{reached} % of {coverage.achievable_area_m2:.0f} m² scannable from "
            f"valid tripod positions (required: {100 * requirements.coverage:g} %); "
            f"{100 * coverage.fraction_of_total:.1f} % of all {coverage.total_area_m2:.0f} m² in the model"
            + "".join(f'<br><span class="alarm">{escape(line)}</span>' for line in _not_planned(plan)),
        ),
        ("Registration", _registration(plan)),
        ("Overlap", overlap_defined(requirements.overlap_measure, requirements.overlap_of)),
        *_field(plan),
        ("Scanner", f"{escape(scanner.title)}, range {scanner.range_max_m:g} m, {scanner.n_beams:,} beams per scan"),
        ("Patches", f"at most {plan.survey.patches.max_area_m2:g} m² each"),
    ]
    # The results begin with those of the planned floors, each by the name or id that the client wrote.
    planned = [plan.survey.floors[index].id for index in plan.survey.planned]
    required = {name: result.required for name, result in zip(planned, plan.requirements, strict=False)}
    for floor, figures in zip(plan.survey.floors, plan.coverage_by_floor, strict=True):
        n_stations = sum(station.floor == floor.id for station in plan.stations)
        reached = reached_percent(figures.fraction_of_achievable, required.get(floor.id, requirements.coverage))
        share = f"{reached} % of {figures.achievable_area_m2:.0f} m²"
        value = f"{n_stations} stations, {share if floor.id in planned else 'not planned'}"
        rows.append((escape(floor.name), value))
    return table((), ((f"<b>{label}</b>", value) for label, value in rows), numbers_from=9)


def _not_planned(plan: Plan) -> tuple[str, ...]:
    scope = plan.survey.scope
    return not_planned(
        sealed_m2=[room.area_m2 for room in plan.sealed],
        scope=Scope.ALL if scope is None else scope.kind,
        achievable_m2=plan.coverage.achievable_area_m2,
        total_m2=plan.coverage.total_area_m2,
        area_by_reason_m2={} if plan.why is None else dict(zip(REASONS, plan.why.area_by_reason_m2, strict=True)),
        area="{:.0f} m²".format,
    )


def _registration(plan: Plan) -> str:
    requirements, of = plan.settings.requirements, plan.registration
    counted = sum(link.counts(requirements.overlap, requirements.min_strength) for link in plan.links)
    low = ", or as set up" if any(link.as_set_up for link in plan.links) else ""
    state = "all stations connected" if plan.connected else "<b>not all stations connected</b>"
    if of is not None and len(of.networks) > 1:
        sizes = ", ".join(str(len(network.stations)) for network in of.networks)
        state = f"<b>{len(of.networks)} unconnected groups</b> of {sizes}"
    needed = [each.bottleneck for each in (() if of is None else of.networks) if each.bottleneck is not None]
    weakest = weakest_link(needed, threshold=requirements.overlap, min_strength=requirements.min_strength)
    hangs = "" if weakest is None else f"; weakest link {escape(weakest.a)} to {escape(weakest.b)}, "
    if weakest is not None:
        hangs += f"{overlap_percent(weakest.overlap)} % overlap{_strength(weakest)}{_held_least(weakest)}"
    overlap = overlap_noun(requirements.overlap_measure, requirements.overlap_of)
    return f"{counted} links with at least {100 * requirements.overlap:g} % {overlap}{low}; {state}{hangs}"


def _strength(link: Link) -> str:
    return "" if isnan(link.strength) else f", strength {link.strength:.3f}"


def _held_least(link: Link) -> str:
    motion = motion_words(link.weak_motion, of_north=" (north is up on the maps: y of the model)")
    return f"; weakest direction: {motion}" if motion else ""


def _field(plan: Plan) -> Iterator[tuple[str, str]]:
    if plan.route is not None:
        yield "Route", f"{plan.route.length_m:.0f} m between the stations"
    time = plan.field_time
    if time is not None and time.total_s is not None and time.scanning_s is not None:
        scanning, set_up, walking = (seconds / 60 for seconds in (time.scanning_s, time.set_up_s, time.walking_s))
        yield (
            "Field time",
            f"{time.total_s / 60:.0f} minutes: {scanning:.0f} scanning, {set_up:.0f} setting up, {walking:.0f} walking",
        )


def letter_warnings(plan: Plan) -> tuple[str, ...]:
    """A line where maps and pictures draw letters of names as boxes, as no font of this machine has them."""
    names = [plan.survey.scene.title, *(floor.name for floor in plan.survey.floors), *(s.id for s in plan.stations)]
    line = lacking_letters(names)
    return (line,) if line else ()


def _warnings(plan: Plan, of_letters: tuple[str, ...], without_pictures: str) -> str:
    lines = [
        *groups_first(plan.warnings),
        *of_letters,
        *([f"coverage pictures are left out: {without_pictures}"] if without_pictures else []),
    ]
    return "\n".join(f'<p class="warning">{escape(line)}</p>' for line in lines)


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
