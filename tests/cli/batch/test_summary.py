"""Totals of a batch: what is known of all its buildings, and what is not."""

import json
from pathlib import Path

import pytest
from oldest_plan import floor, oldest_plan, station
from tlsplan.batch.sites_file import PriceEntries
from tlsplan.batch.summary import FAILED, PLANNED, WAITING, Row, row_of, totals_of, write_summary

GOOD = Row(
    "a", "Council", "", PLANNED, stations=2, lower_bound=1, scannable_m2=10.0, coverage=0.5, requirements_met=True
)
SHORT = Row(
    "b", "Council", "", PLANNED, stations=4, lower_bound=4, scannable_m2=30.0, coverage=0.9, requirements_met=False
)
FAILS = Row("c", "Schools", "", FAILED, message="gone")
WAITS = Row("d", "Schools", "", WAITING)


@pytest.mark.parametrize(
    ("rows", "met"),
    [
        ([GOOD], True),
        ([GOOD, GOOD], True),
        ([GOOD, SHORT], False),
        ([GOOD, FAILS], None),
        ([GOOD, WAITS], None),
        ([SHORT, FAILS], False),
        ([FAILS], None),
    ],
)
def test_requirements_are_met_in_all_where_every_building_has_a_plan_that_does(
    rows: list[Row], met: bool | None
) -> None:
    assert totals_of(rows)[-1].requirements_met is met


def test_totals_are_of_the_planned_and_empty_where_nothing_is() -> None:
    council, schools, whole = totals_of([GOOD, SHORT, FAILS])
    assert (council.stations, council.lower_bound, council.scannable_m2, council.coverage) == (6, 5, 40.0, 0.8)
    assert (schools.stations, schools.lower_bound, schools.scannable_m2, schools.coverage) == (None,) * 4
    assert (whole.stations, whole.jobs, whole.failed) == (6, 3, 1)


def test_the_page_says_what_its_totals_are_of(tmp_path: Path) -> None:
    said = "totals are of the planned ones"
    write_summary(tmp_path, [GOOD, FAILS], None)
    assert said in (tmp_path / "index.html").read_text(encoding="utf-8")
    for rows in ([GOOD], [FAILS, WAITS]):
        write_summary(tmp_path, rows, None)
        assert said not in (tmp_path / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("time_s", "mode", "cost", "words"),
    [
        (3600.0, "medium", 103.0, ""),
        (None, "40mm", None, "no time per scan is known of few in mode 40mm, field time and cost are empty; give "),
        (None, "", None, "no time per scan is known of few, field time and cost are empty; give seconds_per_scan"),
    ],
)
def test_a_cost_that_is_empty_says_why(
    tmp_path: Path, time_s: float | None, mode: str, cost: float | None, words: str
) -> None:
    document = oldest_plan(
        floors=[floor("F0", 0.0)],
        stations=[station("S001", "F0", 1, [5.0, 4.0, 1.6]), station("S002", "F0", 2, [6.0, 4.0, 1.6])],
        field_time={"scanning_s": time_s, "set_up_s": 60.0, "walking_s": 5.0, "total_s": time_s},
    )
    document["scanner"] |= {"name": "few", "mode": mode}
    folder = tmp_path / "plans" / "a"
    folder.mkdir(parents=True)
    (folder / "plan.json").write_text(json.dumps(document))
    prices = PriceEntries(currency="EUR", hour=95, station=4)
    row = row_of("a", "", "", folder, tmp_path, prices)
    assert (row.state, row.cost) == (PLANNED, cost)
    assert row.message.startswith(words) and bool(row.message) == bool(words)
    write_summary(tmp_path, [row], prices)
    assert words in (tmp_path / "index.html").read_text(encoding="utf-8")
    assert words in (tmp_path / "summary.csv").read_text(encoding="utf-8")
