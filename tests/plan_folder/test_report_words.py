"""What the report says of registration."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner_core.model import Link, Plan, Registration, RegistrationNetwork
from planner_core.plan_folder.report import report_page


@pytest.mark.parametrize(
    ("weak_axis", "told"),
    [
        ("tilts about 134 degrees from x to y", "weakest direction: tilt about NW–SE (north is up on the maps: y of"),
        ("turns about the vertical", "38.4 % overlap; weakest direction: turn (heading)</td>"),
        ("", "38.4 % overlap</td>"),
    ],
)
def test_report_tells_the_weakest_link_in_words_of_a_survey(plan: Plan, weak_axis: str, told: str) -> None:
    weakest = Link("S001", "S002", 0.38499, 0.02, weak_axis)
    network = RegistrationNetwork(("S001", "S002"), ("F0",), 1, (weakest,), (), weakest)
    registration = Registration(0.3, 0.01, False, (network,), (), (), ())
    page = report_page(replace(plan, registration=registration))
    assert told in page
    assert "degrees from" not in page


def test_report_tells_the_weakest_link_of_all_networks(plan: Plan) -> None:
    links = (Link("S001", "S002", 0.45, 0.02, ""), Link("S003", "S004", 0.31, 0.02, ""))
    networks = tuple(RegistrationNetwork((one.a, one.b), ("F0",), 1, (one,), (), one) for one in links)
    registration = Registration(0.3, 0.01, False, networks, (), (), ())
    assert "weakest link S003 to S004, 31.0 % overlap" in report_page(replace(plan, registration=registration))
