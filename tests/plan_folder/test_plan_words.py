"""Sentences of summary, report and sheets: bounds, registration; shares that fall short never read as enough."""

import re
from fractions import Fraction
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tlsplan.summary import show

from planner_core.model import Plan
from planner_core.plan_folder.plan_source import open_plan, source_of
from planner_core.plan_folder.plan_tables import stations_tables
from planner_core.plan_folder.plan_words import (
    bound_words,
    coverage_words,
    plan_figures,
    registration_words,
    route_words,
    time_words,
)


def printed_percent(bound: float) -> str:
    text = bound_words({"objective": "most coverage", "bound": bound})
    return re.fullmatch(r", no plan with so many covers more than ([\d.]+) %", text)[1]


@given(st.integers(0, 10**9))
def test_bound_on_coverage_is_never_printed_lower_than_it_is(billionths):
    shown = Fraction(printed_percent(billionths / 10**9))
    exact = Fraction(billionths, 10**7)
    assert exact <= shown < exact + Fraction(1, 10)


@pytest.mark.parametrize(("bound", "shown"), [(0.9412, "94.2"), (0.942, "94.2"), (0.951, "95.1"), (1.0, "100.0")])
def test_bound_on_coverage_has_one_digit_more_only_where_it_is_needed(bound, shown):
    assert printed_percent(bound) == shown


USUAL = {"overlap_measure": "smaller-share", "overlap_of": "all-seen"}


def network(*overlaps: float | None, strength: float | None = None) -> dict[str, Any]:
    """A plan's registration: a network a figure, whose weakest link overlaps so much; None for a single station.

    strength : of the first network's, each further one's a tenth of the one before; None: not known.
    """
    return {
        "requirements": dict(USUAL),
        "registration": {
            "threshold": 0.295,
            "min_strength": 0.0,
            "connected": len(overlaps) < 2,
            "links": [],
            "networks": [
                {
                    "stations": [f"A{k}"] if overlap is None else [f"A{k}", f"B{k}"],
                    "bottleneck": None
                    if overlap is None
                    else {
                        "a": f"A{k}",
                        "b": f"B{k}",
                        "overlap": overlap,
                        "strength": strength and strength / 10**k,
                    },
                }
                for k, overlap in enumerate(overlaps)
            ],
        },
    }


@pytest.mark.parametrize(
    ("overlap", "shown"), [(0.29499, "just below 29.5 %"), (0.2999999, "30.0 %"), (0.289, "28.9 %")]
)
def test_overlap_of_the_weakest_link_does_not_read_as_the_threshold_that_it_misses(overlap: float, shown: str) -> None:
    assert registration_words(network(overlap)) == (
        f"0 links of at least 29.5 % overlap; all stations are connected; weakest: A0 to B0, {shown}"
    )


def test_overlap_that_is_not_the_usual_one_is_named() -> None:
    told = network(0.42)
    told["requirements"] = {"overlap_measure": "jaccard", "overlap_of": "seen-as-required"}
    assert "of at least 29.5 % Jaccard overlap of what is seen as required; all" in registration_words(told)


def test_weakest_link_is_that_of_all_networks() -> None:
    assert registration_words(network(0.42, 0.31, None)).endswith(
        "3 unconnected groups, of 2, 2, 1 stations; weakest: A1 to B1, 31.0 %"
    )


def test_weakest_link_is_the_one_nearest_to_what_is_required() -> None:
    told = network(0.31, 0.42, strength=0.2)
    assert registration_words(told).endswith(
        "2 unconnected groups, of 2, 2 stations; weakest: A0 to B0, 31.0 %, strength 0.200"
    )
    told["registration"]["min_strength"] = 0.0195
    assert registration_words(told).endswith(
        "2 unconnected groups, of 2, 2 stations; weakest: A1 to B1, 42.0 %, strength 0.020"
    )


def test_the_price_of_joins_is_stated_in_stations_and_minutes() -> None:
    plan = network(0.31, 0.42, strength=0.2)
    plan |= {"stations": [{}] * 4, "settings": {"set_up_s": 60.0, "seconds_per_scan": None}}
    plan["scanner"] = {"seconds_per_scan": 120.0}
    plan["registration"]["joins"] = [{"stations": ["A0"], "n_groups": 2, "floors": []}]
    assert "; 1 of 4 stations only joins the network (A0), about 3 min; weakest" in registration_words(plan)
    plan["scanner"] = {"seconds_per_scan": None}
    plan["registration"]["joins"] *= 2
    assert "only join the network (A0, A0), about 2 min and the scans; weakest" in registration_words(plan)


def test_summary_report_and_sheets_have_the_same_sentences(
    plan: Plan, plan_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written = open_plan(plan_folder)
    figures = plan_figures(written)
    assert plan_figures(source_of(plan)) == figures
    page = unescape((plan_folder / "report" / "index.html").read_text()).replace("\xa0", " ").replace("<wbr>", "")
    assert all(f">{value}</td>" in page for _, value in figures)
    cells = [cell for table in stations_tables(written) for row in table.rows for cell in row]
    assert cells and all(f">{cell}</td>" in page for cell in cells)
    show(written.document)
    printed = capsys.readouterr().out
    for sentence in (coverage_words(written.document), registration_words(written.document)):
        assert sentence.replace("m²", "m2") in printed
        assert any(sentence in value for _, value in figures)


def walked(n_unwalkable: int = 0, left_out: tuple[str, ...] = (), *, returns: bool = False) -> dict[str, Any]:
    return {"length_m": 174.3, "returns": returns, "n_unwalkable": n_unwalkable, "left_out": left_out}


@pytest.mark.parametrize(
    ("route", "without"),
    [
        (walked(), ""),
        (walked(1), ", without 1 leg that has no way"),
        (walked(2), ", without 2 legs that have no way"),
        (walked(0, ("S007",)), ", without 1 station that no way leads to"),
        (walked(2, ("S007", "S009")), ", without 2 legs that have no way and 2 stations that no way leads to"),
    ],
)
def test_length_and_time_of_a_route_name_what_they_leave_out(route, without):
    assert route_words(route) == f"174 m between the stations{without}"
    time = {"scanning_s": 3600.0, "set_up_s": 3600.0, "walking_s": 174.0, "total_s": 7374.0}
    assert time_words(time, route).endswith(f", 3 min walking{without}")


def test_what_is_left_out_comes_after_the_way_back():
    words = route_words(walked(1, returns=True))
    assert words == "174 m between the stations, and back to the start, without 1 leg that has no way"
