"""The summary of a batch: stations, bound, field time, cost and coverage by building, totals by portfolio.

Plan folders -> `summary.json`, `summary.csv` and `index.html`. Every figure is of a plan.json; docs/formats/sites.md
defines each.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from planner_core.errors import PlannerError
from planner_core.model import Scanner
from planner_core.plan_folder import html_parts
from planner_core.plan_folder.atomic import staged_file
from planner_core.plan_folder.plan_json import read_plan
from planner_core.plan_folder.plan_tables import Column, Table

from .sites_file import PriceEntries

PLANNED, FAILED, WAITING = "planned", "failed", "not planned yet"


@dataclass(frozen=True)
class Row:
    """A building, a storey, or the sum of some. Figures are None where they are not known of all of it.

    lower_bound : of stations. gap : (stations - lower_bound) / stations. coverage : share of scannable_m2.
    unconnected_groups : networks that no link connects, each plan's own; 1: all stations are connected.
    """

    name: str
    portfolio: str
    floor: str
    state: str
    stations: int | None = None
    lower_bound: int | None = None
    gap: float | None = None
    unconnected_groups: int | None = None
    coverage: float | None = None
    scannable_m2: float | None = None
    requirements_met: bool | None = None
    field_time_s: float | None = None
    cost: float | None = None
    message: str = ""
    plan: str = ""


@dataclass(frozen=True)
class Total(Row):
    """The sum of the planned buildings of a portfolio. jobs : all of them; failed : those that could not be planned.

    requirements_met : False where a plan misses one; None where none does, but there is not a plan of every building.
    """

    jobs: int = 0
    failed: int = 0


def row_of(name: str, portfolio: str, floor: str, folder: Path, root: Path, prices: PriceEntries | None) -> Row:
    """Return the figures of a plan folder; of one that can't be read, why."""
    try:
        document = read_plan(folder)
    except PlannerError as error:
        return Row(name, portfolio, floor, FAILED, message=str(error))
    coverage, optimality = document.coverage, document.optimality
    time_s = None if document.field_time is None else document.field_time.total_s
    return Row(
        name,
        portfolio,
        floor,
        PLANNED,
        stations=len(document.stations),
        lower_bound=optimality.lower_bound,
        gap=optimality.gap,
        unconnected_groups=len(document.registration.networks),
        coverage=coverage.fraction_of_achievable,
        scannable_m2=coverage.achievable_area_m2,
        requirements_met=all(result.met for result in document.requirements.results),
        field_time_s=time_s,
        cost=_cost(len(document.stations), time_s, prices),
        message=_why_no_time(document.scanner, time_s),
        plan=folder.relative_to(root).as_posix(),
    )


def totals_of(rows: Sequence[Row]) -> list[Total]:
    """Return the sum of each portfolio, in the order of the rows, and of all if there are several."""
    portfolios = list(dict.fromkeys(row.portfolio for row in rows))
    groups = [(name, [row for row in rows if row.portfolio == name]) for name in portfolios]
    return [_total(*group) for group in [*groups, *([("all", list(rows))] if len(groups) > 1 else [])]]


def write_summary(root: Path, rows: Sequence[Row], prices: PriceEntries | None) -> dict[str, Any]:
    """Write the three files, each whole or not at all, and return the contents of summary.json.

    Raises
    ------
    OSError
        The disk is full.
    """
    totals = totals_of(rows)
    document = {
        "schema": "tlsplan:batch:1",
        "currency": "" if prices is None else prices.currency,
        "rows": [asdict(row) for row in rows],
        "totals": [asdict(total) for total in totals],
    }
    texts = {
        "summary.json": json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "summary.csv": _csv(rows),
        "index.html": _page(root, rows, totals, prices),
    }
    for name, text in texts.items():
        with staged_file(root / name) as staging:
            staging.write_text(text, encoding="utf-8")
    return document


def hours(seconds: float | None) -> str:
    """Return a duration as 3 h 05 min; nothing where it is not known."""
    return "" if seconds is None else f"{round(seconds / 60) // 60} h {round(seconds / 60) % 60:02d} min"


def _why_no_time(scanner: Scanner, time_s: float | None) -> str:
    """Say why field time, and the cost by the hour, are empty."""
    if time_s is not None:
        return ""
    mode = f" in mode {scanner.mode}" if scanner.mode else ""
    return (
        f"no time per scan is known of {scanner.name}{mode}, field time and cost are empty; give seconds_per_scan, or "
        "a mode that `tlsplan scanners` has a time of"
    )


def _cost(stations: int, time_s: float | None, prices: PriceEntries | None) -> float | None:
    if prices is None or (time_s is None and prices.hour > 0):
        return None
    return round(prices.station * stations + prices.hour * (time_s or 0.0) / 3600, 2)


def _total(portfolio: str, rows: Sequence[Row]) -> Total:
    planned = [row for row in rows if row.state == PLANNED]
    stations = _sum(row.stations for row in planned)
    bound = _sum(row.lower_bound for row in planned)
    area_m2 = sum(row.scannable_m2 or 0.0 for row in planned)
    covered_m2 = sum((row.coverage or 0.0) * (row.scannable_m2 or 0.0) for row in planned)
    states = {row.state for row in rows}
    misses = any(row.requirements_met is False for row in planned)
    return Total(
        name=portfolio,
        portfolio=portfolio,
        floor="",
        state=next((state for state in (WAITING, FAILED) if state in states), PLANNED),
        stations=stations,
        lower_bound=bound,
        gap=None if bound is None or not stations else round((stations - bound) / stations, 9),
        unconnected_groups=_sum(row.unconnected_groups for row in planned),
        coverage=None if area_m2 == 0 else round(covered_m2 / area_m2, 9),
        scannable_m2=round(area_m2, 3) if planned else None,
        requirements_met=False if misses else True if states == {PLANNED} else None,
        field_time_s=_sum(row.field_time_s for row in planned),
        cost=_sum(row.cost for row in planned),
        jobs=len(rows),
        failed=sum(row.state == FAILED for row in rows),
    )


def _sum(values: Iterable[Any]) -> Any:
    """The sum; None where one is not known, or there is none."""
    known = list(values)
    return None if not known or None in known else round(sum(known), 2)


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    return text.getvalue()


# ------------------------------------------------------------------------------------------------ the page
def _page(root: Path, rows: Sequence[Row], totals: Sequence[Total], prices: PriceEntries | None) -> str:
    columns = _columns(prices)
    names = [name for name, _ in columns]
    planned = [row for row in rows if row.state == PLANNED]
    failed = [row for row in rows if row.state != PLANNED]
    parts = [
        "<h1>Scan plans of a portfolio</h1>",
        f"<p>{_counts(rows)}</p>",
        _table("Totals", ("portfolio",), ("jobs", "failed", *names), [
            (total.name or "(none)", str(total.jobs), str(total.failed), *(show(total) for _, show in columns))
            for total in totals
        ]),
        _table("Buildings", ("building", "portfolio"), names, [
            (_link(row), row.portfolio, *(show(row) for _, show in columns)) for row in planned
        ]),
        *(f"<p>{escape(_called(row))}: {escape(row.message)}</p>" for row in rows if row.plan and row.message),
    ]  # fmt: skip
    if failed:
        whys = [(_called(row), row.portfolio, row.message or row.state) for row in failed]
        parts.append(_table("Without a plan", ("building", "portfolio", "why"), (), whys))
    return html_parts.page("Scan plans of a portfolio", parts)


def _table(title: str, words: Sequence[str], numbers: Sequence[str], rows: Sequence[tuple[str, ...]]) -> str:
    columns = (*(Column(name, 1) for name in words), *(Column(name, 1, number=True) for name in numbers))
    return html_parts.rows_of(Table(title, columns, tuple(rows)))


def _columns(prices: PriceEntries | None) -> list[tuple[str, Callable[[Row], str]]]:
    columns: list[tuple[str, Callable[[Row], str]]] = [
        ("stations", lambda row: _whole(row.stations)),
        ("lower bound", lambda row: _whole(row.lower_bound)),
        ("gap %", lambda row: _percent(row.gap)),
        ("groups", lambda row: _whole(row.unconnected_groups)),
        ("coverage %", lambda row: _percent(row.coverage)),
        ("scannable m²", lambda row: "" if row.scannable_m2 is None else f"{row.scannable_m2:.0f}"),
        ("requirements", lambda row: {None: "", True: "met", False: "NOT MET"}[row.requirements_met]),
        ("field time", lambda row: hours(row.field_time_s)),
    ]
    if prices is not None:
        unit = f" {prices.currency}" if prices.currency else ""
        columns.append((f"cost{unit}", lambda row: "" if row.cost is None else f"{row.cost:.2f}"))
    return columns


def _counts(rows: Sequence[Row]) -> str:
    counts = ((sum(row.state == state for row in rows), state) for state in (PLANNED, FAILED, WAITING))
    text = ", ".join(f"{count} {state}" for count, state in counts if count)
    states = {row.state for row in rows}
    return f"{text}; totals are of the planned ones" if PLANNED in states and len(states) > 1 else text


def _called(row: Row) -> str:
    return f"{row.name} ({row.floor})" if row.floor else row.name


def _link(row: Row) -> str:
    return html_parts.Html(f'<a href="{quote(row.plan)}/report/index.html">{escape(_called(row))}</a>')


def _whole(value: int | None) -> str:
    return "" if value is None else str(value)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.1f}"
