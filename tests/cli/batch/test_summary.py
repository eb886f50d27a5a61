"""Totals of a batch: what is known of all its buildings, and what is not."""

from pathlib import Path

import pytest
from tlsplan.batch.summary import FAILED, PLANNED, WAITING, Row, totals_of, write_summary

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
