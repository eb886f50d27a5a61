"""`tlsplan compare`: a plan against where the scanner really stood, and what to scan again before leaving."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..coordinates import coordinate_options, frame_request
from ..options import Length, apply, engine_options, output_options, overwrite_option, plan_scene_option

if TYPE_CHECKING:
    from planner_core.as_scanned.comparison import AsScanned, Rescan
    from planner_core.plan_folder.plan_source import PlanSource
    from planner_core.planning.live.live_plan import LivePlan

    from ..progress import ProgressReporter

#: What the list's stations don't meet; see `tlsplan.exit_codes`.
NOT_MET = 7


@click.command("compare", epilog="Example:  tlsplan compare plan/ --stations actual.csv -o scan-again/")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--stations", "lists", type=click.Path(path_type=Path, readable=False), required=True, multiple=True,
              metavar="FILE", help="Stations as scanned: CSV, or an E57 with its poses; may be repeated.")  # fmt: skip
@click.option("--coordinates", type=click.Choice(["auto", "scene", "site"]), default="auto", show_default=True,
              help="Coordinate system of the list. auto: the one in which the list matches the plan.")  # fmt: skip
@click.option("--heights", type=click.Choice(["sensor", "ground"]), default="sensor", show_default=True,
              help="Height reference of a CSV: sensor, or ground point, with the instrument height of the list, else "
              "that of the plan.")  # fmt: skip
@click.option(
    "--columns",
    default="",
    metavar="LETTERS",
    help="Column letters of a CSV without header line, such as PENZ. [default: a header line]",
)
@click.option("--match", type=click.Choice(["name", "place"]), default="name", show_default=True,
              help="How scanned stations are matched to planned ones. name: by name, the rest by position; place: by "
              "position only.")  # fmt: skip
@click.option("--within", "within_m", type=Length(least=0.0), default=2.0, show_default=True, metavar="LENGTH",
              help="Maximum distance of a match by position.")  # fmt: skip
@click.option("--floor", "floors", multiple=True, metavar="ID|NAME",
              help="Floor to compare; may be repeated. Stations of other floors count as planned. "
              "[default: all]")  # fmt: skip
@click.option("--scan-again/--no-scan-again", default=True, show_default=True,
              help="Find the fewest additional stations that make up for what is missing.")  # fmt: skip
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Plan folder to write: scanned stations and additional ones, if any.")  # fmt: skip
@plan_scene_option
@coordinate_options
@apply(engine_options, overwrite_option, output_options)
@click.pass_context
def command(
    ctx: click.Context,
    /,
    plan: Path,
    lists: tuple[Path, ...],
    coordinates: str,
    heights: str,
    columns: str,
    match: str,
    within_m: float,
    floors: tuple[str, ...],
    scan_again: bool,
    folder: Path | None,
    scene: tuple[Path, ...],
    engine: str,
    device: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    **values: Any,
) -> None:
    """Compare stations as scanned with PLAN: what is missing, and what to scan before leaving the site.

    Exit code 0: requirements are met as far as the plan met them; 7: they are not. With -q, only warnings and the
    exit code report it.
    """
    from planner_core.as_scanned.comparison import compare_as_scanned
    from planner_core.as_scanned.document import as_scanned_document
    from planner_core.as_scanned.matching import check_heights, doubts, matched
    from planner_core.as_scanned.station_lists import read_actual
    from planner_core.export.chosen import chosen_floors
    from planner_core.export.options import Options
    from planner_core.plan_folder.folder import check_output
    from planner_core.plan_folder.plan_source import open_plan
    from planner_core.planning.live.opening import open_live

    from .. import output
    from ..progress import ProgressReporter

    if folder is not None:
        check_output(folder, overwrite=overwrite)
    source = open_plan(plan, scene=scene, frame=frame_request(values))
    compared = [floor.id for floor in chosen_floors(source, Options(floors=floors))] if floors else []
    actual = read_actual(lists, source, coordinates=coordinates, heights=heights, columns=columns, within_m=within_m)
    if heights == "sensor" and any(_has_heights(each) for each in lists):
        check_heights(source.stations, actual.stations, by=match, within_m=within_m)
    matches = matched(source.stations, actual.stations, by=match, within_m=within_m)
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        compared_m = [
            each for each in matches if not compared or each.planned is None or each.planned.floor_id in compared
        ]
        of_list = source.frame if actual.coordinates == "site" else None
        reporter.warn((*actual.doubts, *source.frame.warnings, *doubts(compared_m, within_m, of_list)))
        live = open_live(
            source.folder, scene=scene, engine=engine, device=device, with_ground=False, progress=reporter.show
        )
        reporter.warn(live.engine.warnings)
        found = compare_as_scanned(live, matches, floors=compared, progress=reporter.show)
        reporter.warn(found.warnings)
        rescan = _rescan(live, found, reporter) if scan_again and not found.met else None
        if folder is not None and rescan is not None:
            _write(rescan, live, folder, overwrite, reporter)
    document = as_scanned_document(live, source.frame, actual.coordinates, found, rescan)
    if as_json:
        output.as_json(document)
    elif not quiet:
        _show(document, source)
        if folder is not None:
            output.say(
                f"plan folder   {folder if rescan is not None else 'not written: no additional stations were planned'}"
            )
    ctx.exit(0 if found.met else NOT_MET)


def _has_heights(path: Path) -> bool:
    """Whether `--heights` can tell whose a list's heights are: of a CSV it does, of poses and plans not."""
    return path.suffix.lower() not in (".e57", ".json") and not path.is_dir()


def _rescan(live: LivePlan, found: AsScanned, reporter: ProgressReporter) -> Rescan:
    from planner_core.as_scanned.comparison import plan_rescan

    rescan = plan_rescan(live, found, progress=reporter.show)
    reporter.warn(rescan.plan.warnings)
    return rescan


def _write(rescan: Rescan, live: LivePlan, folder: Path, overwrite: bool, reporter: ProgressReporter) -> None:
    from planner_core.plan_folder.folder import write_plan_folder
    from planner_core.plan_folder.report import letter_warnings

    write_plan_folder(rescan.plan, folder, engine=live.engine, overwrite=overwrite, progress=reporter.show)
    reporter.warn(letter_warnings(rescan.plan))


# ---------------------------------------------------------------------------------------------- words
_MOST_LISTED = 12
#: Less is the rounding of lists.
_SHOWN_M = 0.005


def _show(document: dict[str, Any], source: PlanSource) -> None:
    from .. import output

    for line in (*_stations(document), "", *_coverage(document), *_network(document), *_lost(document), ""):
        output.say(line)
    for line in _again(document, source):
        output.say(line)


def _stations(document: dict[str, Any]) -> list[str]:
    counts, rows = document["counts"], document["stations"]
    system = document["site_coordinates"] if document["list_coordinates"] == "site" else "scene coordinates"
    lines = [f"list          {sum(row['listed_as'] is not None for row in rows)} stations in {system}"]
    as_planned = [row for row in rows if row["fate"] == "as planned"]
    within = f", within {100 * document['as_planned_within_m']:g} cm of their planned positions" if as_planned else ""
    lines.append(f"as planned    {len(as_planned)}{within}")
    farthest = max(as_planned, key=_off_m, default=None)
    if farthest is not None and _off_m(farthest) >= _SHOWN_M:
        lines.append(f"  at most {_off_m(farthest):.2f} m off: {farthest['id']}")
    there = [(row["id"], row["listed_as"]) for row in as_planned]
    renamed = [f"{name} as {listed_as}" for name, listed_as in there if name.casefold() != listed_as.casefold()]
    if renamed:
        lines.append(f"  listed under other names: {_some(renamed)}")
    if counts["scanned before"]:
        lines.append(f"before        {counts['scanned before']} scanned before the plan, not required in the list")
    if counts["not compared"]:
        lines.append(f"not compared  {counts['not compared']} on other floors, taken as planned")
    for fate in ("moved", "missing", "additional"):
        of_fate = sorted((row for row in rows if row["fate"] == fate), key=lambda row: -row["lost_area_m2"])
        lines.append(f"{fate:<13} {counts[fate]}")
        lines += [f"  {_fate(row)}" for row in of_fate[:_MOST_LISTED]]
        if len(of_fate) > _MOST_LISTED:
            lines.append(f"  and {len(of_fate) - _MOST_LISTED} more, see --json")
    return lines


def _off_m(row: dict[str, Any]) -> float:
    """Distance of a station from its planned position."""
    return math.hypot(*row["moved_m"])


def _fate(row: dict[str, Any]) -> str:
    area_m2 = row["lost_area_m2"]
    worth = f"costs {area_m2:.1f} m2" if area_m2 >= 0.05 else f"gains {-area_m2:.1f} m2" if area_m2 <= -0.05 else ""
    parts = [f"{row['id']:<10}", f"floor {row['floor']}"]
    if row["fate"] == "moved":
        dx, dy, dz = row["moved_m"]
        parts.append(f"by {(dx * dx + dy * dy) ** 0.5:.2f} m in plan, {dz:+.2f} m in height")
    if row["matched_by"] == "place" and row["listed_as"] != row["id"]:
        parts.append(f"listed as {row['listed_as']}")
    return ", ".join([parts[0] + " " + parts[1], *parts[2:], *([f"alone {worth}"] if worth else [])])


def _coverage(document: dict[str, Any]) -> list[str]:
    from planner_core.coverage.percent import reached_percent

    lines: list[str] = []
    for row in document["requirements"]:
        required, state = row["asked"], _state(row)
        planned = reached_percent(row["planned"], 0.0 if row["planned_is_met"] else required)
        # What falls short of the plan's own figure does not read as that, either.
        least = 0.0 if row["asked_is_met"] else required if row["met"] else min(required, round(row["planned"], 3))
        lines.append(
            f"{'coverage' if not lines else '':<13} {row['name']:<24} {_percent(required)} required, "
            f"{planned} % planned, {reached_percent(row['actual'], least)} % as scanned{state}"
        )
    return lines


def _state(row: dict[str, Any]) -> str:
    if not row["met"]:
        return "   NOT MET"
    if row["asked_is_met"]:
        return ""
    return "   within half a point, as set up" if row["planned_is_met"] else "   not met, as in the plan"


def _network(document: dict[str, Any]) -> list[str]:
    from planner_core.coverage.percent import probability_percent, reached_percent

    network = document["network"]
    by_overlap = network["min_probability"] == 0.0
    state = _state(network)
    lines = [
        f"network       {_parts(network['planned_parts'])} planned, {_parts(network['actual_parts'])} as scanned; "
        f"{network['planned_links']} links planned, {network['actual_links']} as scanned{state}"
    ]
    lost = [f"{link['a']}-{link['b']}" for link in network["lost_links"]]
    if lost:
        lines.append(f"links lost    {_some(lost)}")
    low = [
        f"{link['a']}-{link['b']} "
        + (
            f"{reached_percent(link['overlap'], network['min_overlap'])} %"
            if by_overlap or link["probability"] is None
            else f"{probability_percent(link['probability'], network['min_probability'])} %"
        )
        for link in network["links_as_set_up"]
    ]
    if low:
        required = f"{100 * network['min_overlap' if by_overlap else 'min_probability']:g} %"
        lines.append(
            f"as set up     {len(low)} of them below {required}, which count between scanned stations: {_some(low)}"
        )
    if network["actual_parts"] > 1:
        lines.append("unconnected   groups of stations as scanned, without a link between them:")
        lines += [f"  group {number:<6} {_some(part)}" for number, part in enumerate(network["networks"], start=1)]
    return lines


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return f"{', '.join(names[:_MOST_LISTED])}{more}"


def _parts(number: int) -> str:
    return f"{number} group{'s' if number != 1 else ''}"


def _lost(document: dict[str, Any]) -> list[str]:
    surfaces = document["lost_surfaces"]
    if not surfaces:
        return []
    total_m2 = sum(surface["area_m2"] for surface in surfaces)
    lines = [f"lost          {total_m2:.1f} m2 that the plan sees"]
    for surface in surfaces[:_MOST_LISTED]:
        room = f", room {surface['room']}" if surface["room"] else ""
        lines.append(
            f"  {surface['area_m2']:7.2f} m2  {surface['kind']} {surface['element']}, floor {surface['floor']}{room}"
        )
    if len(surfaces) > _MOST_LISTED:
        lines.append(f"  and {len(surfaces) - _MOST_LISTED} more surfaces, see --json")
    return lines


def _again(document: dict[str, Any], source: PlanSource) -> list[str]:
    again, parts = document["scan_again"], document["network"]["actual_parts"]
    if document["met"]:
        missed = _missed(document, document["network"], parts, "asked_is_met")
        if not missed:
            within = "" if all(row["asked_is_met"] for row in document["requirements"]) else " within half a point"
            return [f"The requirements are still met{within}: nothing has to be scanned again."]
        return [
            "All that the plan met is still met: nothing has to be scanned again.",
            f"NOT met, as in the plan: {missed}.",
        ]
    if again is None:
        return [f"Requirements NOT met: {_missed(document, document['network'], parts, 'met')}."]
    rows = again["stations"]
    fewest = "fewest possible" if again["fewest_is_proven"] else "fewest found"
    many = "station" if len(rows) == 1 else "stations"
    lines = [f"SCAN AGAIN    {len(rows)} {many} before leaving the site ({fewest}), sensor in {source.frame.crs_line}:"]
    unit = source.frame.unit
    for row in rows:
        x, y, z = (unit.of(value) for value in row.get("site_position", row["position"]))
        above_m = row["instrument_height_m"]
        height = "" if above_m is None else f", {unit.text(above_m, 2)} above the ground"
        lines.append(
            f"  {row['id']:<10} floor {row['floor']:<5} {x:.3f} {y:.3f} {z:.3f}{height}"
            f"{' (planned, missing)' if row['is_planned'] else ''}"
        )
        lines.append(f"{'':<13}{_purpose(row)}")
    lost = [row["id"] for row in rows if row["for_what_was_lost"]]
    others = [row["id"] for row in rows if not row["for_what_was_lost"]]
    if others:
        make = "makes" if len(lost) == 1 else "make"
        rest = f"for the rest of the requirements: {_some(others)}"
        lines.append(f"enough        {_some(lost)} {make} up for what was lost; {rest}")
    return [*lines, _with_them(document, again)]


def _purpose(row: dict[str, Any]) -> str:
    adds = [f"{each['area_m2']:.1f} m2 on floor {each['floor']}" for each in row["adds"] if each["area_m2"] >= 0.05]
    parts = [part[0] if len(part) == 1 else f"{part[0]} and {len(part) - 1} more" for part in row["joins"]]
    gains = [f"adds {', '.join(adds)} to the scans"] if adds else []
    gains += [f"connects {parts[0]} with {' and with '.join(parts[1:])}"] if parts else []
    return "; ".join(gains) or "adds no area to the scans, and connects no groups"


def _with_them(document: dict[str, Any], again: dict[str, Any]) -> str:
    missed = _missed(again, again["network"], again["network_parts"], "asked_is_met")
    planned = _missed(document, document["network"], document["network"]["planned_parts"], "planned_is_met")
    if not again["met"]:
        state = f"still NOT met: {_missed(again, again['network'], again['network_parts'], 'met')}"
    elif missed:
        state = f"as good as the plan again; NOT met, as in the plan: {missed}"
    else:
        state = f"all requirements are met{'' if planned else ' again'}"
    return f"with them     {_percent(again['coverage'])} coverage, {_parts(again['network_parts'])}: {state}"


def _missed(of: dict[str, Any], network: dict[str, Any], n_parts: int, key: str) -> str:
    """Words for the requirements, and the network, that are not met by `key`; empty where all are.

    What misses by no more than setting up may cost is met by the crew.
    """
    rows = (row for row in of["requirements"] if not (row["met"] and row.get("planned_is_met")))
    names = [f"coverage {row['name']}" for row in rows if not row[key]]
    names += [] if network[key] else [f"the network ({_parts(n_parts)})"]
    return ", ".join(names)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
