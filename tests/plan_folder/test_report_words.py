"""What the report says of registration."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner_core.model import Link, LinkLimits, Plan, Registration, RegistrationNetwork, WeakMotion
from planner_core.plan_folder.drawing import fonts
from planner_core.plan_folder.report import report_page

LIMITS = LinkLimits(0.3, 0.01)


def contract(plan: Plan) -> Plan:
    """Of links by overlap alone, as a contract may have it."""
    required = replace(plan.settings.requirements, overlap=LIMITS.overlap, min_probability=0.0)
    return replace(plan, settings=replace(plan.settings, requirements=required))


def test_report_has_the_probability_of_the_weakest_link(plan: Plan) -> None:
    weakest = Link("S001", "S002", 0.44, 0.05, probability=0.99123)
    network = RegistrationNetwork(("S001", "S002"), ("F0",), 1, (weakest,), (), weakest)
    registration = Registration(plan.settings.requirements.link_limits, False, (network,), (), (), ())
    page = report_page(replace(plan, links=(weakest,), registration=registration)).replace("\xa0", " ")
    assert "1 link of at least 99 % probability of registering (" in page
    assert "weakest: S001 to S002, 99.1 %, overlap 44.0 %, strength 0.050</td>" in page


@pytest.mark.parametrize(
    ("motion", "told"),
    [
        (
            WeakMotion("turn", (-0.694658, 0.71934, 0.0)),
            ">1 to 2: 38.5\xa0%, tilt about the line 44° from y to -x</td>",
        ),
        (WeakMotion("turn", (0.0, 0.0, 1.0)), ">1 to 2: 38.5\xa0%, turn (heading)</td>"),
        (None, ">1 to 2: 38.5\xa0%</td>"),
    ],
)
def test_report_tells_the_weakest_link_in_words_of_a_survey(plan: Plan, motion: WeakMotion | None, told: str) -> None:
    weakest = Link("S001", "S002", 0.38499, 0.02, motion)
    network = RegistrationNetwork(("S001", "S002"), ("F0",), 1, (weakest,), (), weakest)
    registration = Registration(LIMITS, False, (network,), (), (), ())
    page = report_page(replace(contract(plan), registration=registration))
    assert told in page
    assert "weakest: S001 to S002, 38.5\xa0%, strength 0.020</td>" in page
    assert "degrees from" not in page


def test_report_tells_the_weakest_link_of_all_networks(plan: Plan) -> None:
    links = (Link("S001", "S002", 0.45, 0.02), Link("S003", "S004", 0.31, 0.02))
    networks = tuple(RegistrationNetwork((one.a, one.b), ("F0",), 1, (one,), (), one) for one in links)
    registration = Registration(LIMITS, False, networks, (), (), ())
    assert "weakest: S003 to S004, 31.0\xa0%" in report_page(replace(contract(plan), registration=registration))


@pytest.mark.parametrize(
    ("measure", "of", "noun", "defined"),
    [
        ("smaller-share", "all-seen", "% overlap; ", ">smaller of both shares, of all that is seen<"),
        ("jaccard", "all-seen", "% Jaccard overlap; ", ">share of what either sees (Jaccard), of all that is seen<"),
        (
            "smaller-share", "seen-as-required", "% overlap of what is seen as required; ",
            ">smaller of both shares, of what is seen as required<",
        ),
    ],
)  # fmt: skip
def test_report_names_its_overlap(plan: Plan, measure: str, of: str, noun: str, defined: str) -> None:
    asked = replace(contract(plan).settings.requirements, overlap_measure=measure, overlap_of=of)
    page = report_page(replace(plan, settings=replace(plan.settings, requirements=asked)))
    assert f"of at least 30 {noun}" in page.replace("\xa0", " ")
    assert defined in page


@pytest.mark.parametrize("pictures", [True, False])
def test_letters_that_pictures_draw_as_boxes_are_named_where_there_are_pictures(
    plan: Plan, monkeypatch: pytest.MonkeyPatch, pictures: bool
) -> None:
    monkeypatch.setattr(fonts, "letter_of", lambda letter: None)
    first, *others = plan.survey.floors
    named = replace(plan, survey=replace(plan.survey, floors=(replace(first, name="标高 1"), *others)))
    page = report_page(named, pictures=pictures)
    assert ("letters of 1 name, such as &#x27;标高 1&#x27;, are drawn as boxes" in page) == pictures
