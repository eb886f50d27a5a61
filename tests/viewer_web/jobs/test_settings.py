"""What a run plans with: the plan's settings, what is asked instead, and the review."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import PlannerError, RequirementError
from planner_core.model import PartRequirement, PlanSettings, Proven, Requirements, Scope
from planner_core.model.review import Entrance, Zone
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import settings_of
from planner_core.requirements.read import requirements_from
from planner_core.review.changes import AddEntrance, AddZone, LockStation, SetDoor
from planner_core.review.store import ReviewStore
from viewer_web.server.jobs.documents import RunRequest
from viewer_web.server.jobs.settings import _following, run_load_options, run_settings


@pytest.fixture(scope="module")
def planned(hall: Path) -> PlanSettings:
    return settings_of(read_plan_json(hall / "plan"))


def asked(plan_folder: Path, requirements: dict[str, Any] | None = None, **more: Any) -> PlanSettings:
    return run_settings(plan_folder, RunRequest(requirements=requirements or {}, **more))


def test_a_run_that_asks_nothing_else_differs_from_the_plan_in_its_method_only(
    hall: Path, planned: PlanSettings
) -> None:
    again = asked(hall / "plan")
    assert again.method == Proven()
    assert again.requirements == planned.requirements
    assert (again.site, again.scanner, again.grid_step_m) == (planned.site, planned.scanner, planned.grid_step_m)


def test_what_is_said_replaces_the_plans_and_what_has_no_zero_stays(hall: Path, planned: PlanSettings) -> None:
    again = asked(hall / "plan", {"Coverage": "80 %", "spacing": "2 cm", "planned floors": ["F0"]})
    assert again.requirements.coverage == 0.8
    assert again.requirements.limits.spacing_m == 0.02
    assert again.requirements.floors == ("F0",)
    assert (again.requirements.network, again.requirements.parts) == ("none", planned.requirements.parts)
    assert asked(hall / "plan", {"zones": [{"name": "z", "heights": [0, 1]}]}).requirements.parts[0].name == "z"


def test_scope_and_obstacles_stay_where_nothing_is_said_of_them() -> None:
    sofa, walls = PartRequirement("sofa", 0.0, classes=("IfcFurniture",)), PartRequirement("walls", 0.9)
    planned = Requirements(scope=Scope.INTERIOR, parts=(sofa, walls))
    for entries, scope, names in (
        ({}, "interior", ["sofa", "walls"]),
        ({"scope": "all", "classes": {"IfcDoor": "90 %"}}, "all", ["IfcDoor", "sofa"]),
        ({"classes": {"IfcFurniture": {"name": "sofa", "coverage": "50 %"}}}, "interior", ["sofa"]),
    ):
        found = _following(requirements_from(entries)[0], entries, planned)
        assert (found.scope, [part.name for part in found.parts]) == (scope, names)


def test_what_overlap_is_stays_where_nothing_is_said_of_it() -> None:
    planned = Requirements(overlap_measure="jaccard", overlap_of="seen-as-required")
    for entries, measure in (({"overlap": "20 %"}, "jaccard"), ({"Overlap measure": "smaller share"}, "smaller-share")):
        found = _following(requirements_from(entries)[0], entries, planned)
        assert (found.overlap_measure, found.overlap_of) == (measure, "seen-as-required")


def test_a_limit_of_time_is_an_option_of_the_search(hall: Path) -> None:
    assert asked(hall / "plan", time_limit_s=30).method == Proven(time_limit_s=30)
    assert asked(hall / "plan").method == Proven()


def test_the_review_locks_keeps_and_adds_what_it_says(own_hall: Path) -> None:
    store = ReviewStore(own_hall)
    first, *others = [station.id for station in store.plan().stations]
    zone = Zone("", "priority", ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)), name="desk", coverage=0.75)
    store.commit(0, [LockStation(first), AddZone(zone)], "Ana")
    roles = {station.id: station.role for station in asked(own_hall, from_review=True).site.prior}
    assert roles == {first: "locked", **dict.fromkeys(others, "kept")}
    parts = asked(own_hall, from_review=True).requirements.parts
    assert [(part.name, part.coverage) for part in parts] == [("upper half", 0.5), ("desk", 0.75)]
    assert asked(own_hall).site.prior == ()


def test_entrances_and_doors_of_the_review_count_where_the_review_does(own_hall: Path) -> None:
    at_m = (3.0, 4.0, 0.0)
    changes = [AddEntrance(Entrance("", at_m, "F0")), SetDoor("a", "open"), SetDoor("b", "shut")]
    ReviewStore(own_hall).commit(0, changes, "Ana")
    for from_review, entrances, doors in ((True, (at_m,), (("a",), ("b",))), (False, (), ((), ()))):
        request = RunRequest(from_review=from_review)
        assert run_settings(own_hall, request).site.entrances_m == entrances
        (options,) = run_load_options(own_hall, request)
        assert (options.doors_open, options.doors_shut) == doors


def test_other_objectives_keep_no_stations_but_locked_ones(own_hall: Path) -> None:
    store = ReviewStore(own_hall)
    first = store.plan().stations[0].id
    store.commit(0, [LockStation(first)], "Ana")
    prior = asked(own_hall, from_review=True, objective="coverage", max_stations=3).site.prior
    assert [(station.id, station.role) for station in prior] == [(first, "locked")]


def test_a_run_begins_with_the_stations_that_it_is_given(hall: Path) -> None:
    begun = run_settings(hall / "plan", RunRequest(), begun_m=[(1.0, 2.0, 1.3)]).site.prior
    assert [(station.role, station.position_m) for station in begun] == [("begun", (1.0, 2.0, 1.3))]


@pytest.mark.parametrize(
    ("more", "word"),
    [
        ({"requirements": {"coverage": "900 %"}}, "coverage"),
        ({"requirements": {"covverage": 1}}, "covverage"),
        ({"requirements": {"site": {"entrances": [[1, 2]]}}}, "entrances"),
        ({"objective": "coverage"}, "limit"),
        ({"max_stations": 3}, "limit"),
        ({"requirements": {"noise": "2 mm"}}, "noise"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_name(hall: Path, more: dict[str, Any], word: str) -> None:
    with pytest.raises(RequirementError, match=word):
        run_settings(hall / "plan", RunRequest(**more))


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
_ENTRY = st.sampled_from(
    ["coverage", "overlap", "network", "spacing", "range", "seen_from", "planned_floors", "floors", "classes", "zones",
     "site", "link_strength", "reflectivity"]
)  # fmt: skip
_SITE = st.dictionaries(st.sampled_from(["entrances", "kept", "fixed", "keep_out", "robot", "ground_picks"]), _JSON)


@settings(max_examples=60, deadline=None)
@given(entries=st.dictionaries(_ENTRY, _JSON | _SITE, max_size=4))
def test_whatever_json_is_asked_is_understood_or_refused_in_words(hall: Path, entries: dict[str, Any]) -> None:
    try:
        asked(hall / "plan", entries)
    except PlannerError as error:
        assert "\n" not in str(error)
