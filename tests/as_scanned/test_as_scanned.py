"""What was scanned against the plan: equal where nothing changed, equal to an evaluation of the list where it did."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shared_plans import SharedPlan

from planner_core.as_scanned.comparison import (
    ADDITIONAL,
    AS_PLANNED,
    MISSING,
    MOVED,
    NOT_COMPARED,
    AsScanned,
    compare_as_scanned,
    counted_links,
    is_met,
    is_part_met,
    plan_rescan,
    purposes_of,
    registration_of,
)
from planner_core.as_scanned.document import as_scanned_document
from planner_core.as_scanned.matching import matched
from planner_core.as_scanned.station_lists import read_actual
from planner_core.errors import StationListError
from planner_core.model import PartResult, Plan
from planner_core.network.network_report import registration_report
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.plan_folder.stations_csv import GivenStation, read_station_list
from planner_core.planning.evaluate import evaluate_survey
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live


def listed_of(source: PlanSource) -> list[GivenStation]:
    return [GivenStation(each.id, each.position_m.copy(), None, None) for each in source.stations]


def compared(live: LivePlan, source: PlanSource, listed: list[GivenStation]) -> AsScanned:
    return compare_as_scanned(live, matched(source.stations, listed))


def evaluated(live: LivePlan, listed: list[GivenStation], folder: Path) -> Plan:
    """The list as `tlsplan evaluate` takes it: another way from a file to figures."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(("id", "x_m", "y_m", "z_m"))
    writer.writerows((each.id, *each.position_m.tolist()) for each in listed)
    (folder / "list.csv").write_text(text.getvalue())
    return evaluate_survey(live.survey, live.settings, read_station_list(folder / "list.csv"), live.engine)


@pytest.mark.slow
def test_unchanged_list_has_the_figures_of_the_plan_itself(live: LivePlan, source: PlanSource) -> None:
    found = compared(live, source, listed_of(source))
    document = live.document
    assert {each.fate for each in found.stations} == {AS_PLANNED}
    assert found.actual.plan.coverage == found.planned.plan.coverage
    assert found.actual.plan.requirements == found.planned.plan.requirements
    assert found.actual.plan.coverage.covered_area_m2 == pytest.approx(
        document["coverage"]["covered_area_m2"], abs=2e-6
    )
    assert tuple(replace(link, as_set_up=False) for link in found.actual.plan.links) == found.planned.plan.links
    assert found.new_links == tuple(link for link in found.actual.plan.links if link.as_set_up)
    assert not (found.lost or found.lost_links or found.warnings)
    assert found.met


@pytest.mark.slow
def test_list_from_the_field_pack_has_the_figures_of_the_plan_itself(
    live: LivePlan, source: PlanSource, tmp_path: Path
) -> None:
    from planner_core.export.options import Options
    from planner_core.export.write import export_plan

    export_plan("csv", source, tmp_path / "site.csv", Options(columns="generic"))
    actual = read_actual([tmp_path / "site.csv"], source)
    assert actual.coordinates == "site"
    found = compare_as_scanned(live, matched(source.stations, actual.stations))
    assert {each.fate for each in found.stations} == {AS_PLANNED}
    assert found.actual.plan.coverage == found.planned.plan.coverage


@pytest.mark.slow
def test_without_one_station_the_figures_are_those_of_an_evaluation_of_the_rest(
    live: LivePlan, source: PlanSource, tmp_path: Path
) -> None:
    rest = listed_of(source)
    gone = rest.pop(1)
    found = compared(live, source, rest)
    expected = evaluated(live, rest, tmp_path)
    assert [each.id for each in found.of_fate(MISSING)] == [gone.id]
    assert found.actual.plan.coverage == expected.coverage
    assert found.actual.plan.coverage_by_floor == expected.coverage_by_floor
    assert found.actual.plan.requirements == expected.requirements
    links = {(link.a, link.b): link.overlap for link in counted_links(expected)}
    on_marks = [link for link in counted_links(found.actual.plan) if not link.as_set_up]
    assert {(link.a, link.b): link.overlap for link in on_marks} == links
    own_m2 = next(row["own_area_m2"] for row in live.document["stations"] if row["id"] == gone.id)
    assert found.of_fate(MISSING)[0].lost_m2 == pytest.approx(own_m2, abs=2e-6)
    assert sum(surface.area_m2 for surface in found.lost) == pytest.approx(own_m2, abs=0.01 * len(found.lost) + 0.05)
    assert all(gone.id in (link.a, link.b) for link in found.lost_links)


@pytest.mark.slow
def test_a_station_moved_by_a_foot_costs_what_an_evaluation_says(
    live: LivePlan, source: PlanSource, tmp_path: Path
) -> None:
    listed = listed_of(source)
    listed[2] = replace(listed[2], position_m=listed[2].position_m + np.array([0.3, 0.0, 0.0]))
    found = compared(live, source, listed)
    expected = evaluated(live, listed, tmp_path)
    (moved,) = found.of_fate(MOVED)
    np.testing.assert_allclose(moved.moved_m, [0.3, 0.0, 0.0], atol=1e-6)
    # Candidates of the evaluation besides: the place itself, which may see what no other does.
    seen = found.actual.plan.times_seen
    np.testing.assert_array_equal(seen, expected.times_seen)
    was_m2 = found.planned.plan.coverage.covered_area_m2
    assert moved.lost_m2 == pytest.approx(was_m2 - found.actual.plan.coverage.covered_area_m2)
    assert moved.lost_m2 != 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("off_m", "fate"),
    [
        ([0.1, 0.0, 0.0], AS_PLANNED),
        ([0.05, -0.05, 0.07], AS_PLANNED),
        ([0.09, 0.0, 0.06], MOVED),
        ([0.0, 0.12, 0.0], MOVED),
    ],
)
def test_a_station_within_ten_centimetres_is_as_planned_with_the_figures_of_its_place(
    live: LivePlan, source: PlanSource, off_m: list[float], fate: str
) -> None:
    listed = listed_of(source)
    listed[2] = replace(listed[2], position_m=listed[2].position_m + np.array(off_m))
    found = compared(live, source, listed)
    there = found.stations[2]
    assert (there.id, there.fate) == (listed[2].id, fate)
    np.testing.assert_allclose(there.moved_m, off_m, atol=1e-6)
    assert not np.array_equal(found.actual.plan.times_seen, found.planned.plan.times_seen)


@pytest.fixture(scope="module")
def crew_set_up(shared_plan: Callable[[str], SharedPlan]) -> tuple[LivePlan, PlanSource, list[GivenStation]]:
    """A plan with a network, and its stations within 10 cm of their marks: by links of 99 % alone it falls apart."""
    folder = shared_plan("corridor-comb").folder
    live, source = open_live(folder, with_ground=False), open_plan(folder)
    draw = np.random.default_rng(1)
    for _ in range(40):
        listed = listed_of(source)
        for number, each in enumerate(listed):
            turn, rise_m = 2 * np.pi * draw.random(), 0.05 * (2 * draw.random() - 1)
            shift_m = np.array([0.08 * np.cos(turn), 0.08 * np.sin(turn), rise_m])
            listed[number] = replace(each, position_m=each.position_m + shift_m)
        found = compare_as_scanned(live, matched(source.stations, listed))
        links = [replace(link, as_set_up=False) for link in found.actual.plan.links]
        floors, limits = [each.floor for each in found.actual.plan.stations], live.settings.requirements.link_limits
        if len(registration_report(links, found.draft.ids, floors, limits=limits).networks) > 1:
            return live, source, listed
    pytest.fail("no set-up breaks a link: this plan shows nothing")


@pytest.mark.slow
def test_a_crew_within_ten_centimetres_has_the_network_that_the_plan_promises(
    crew_set_up: tuple[LivePlan, PlanSource, list[GivenStation]],
) -> None:
    live, source, listed = crew_set_up
    found = compared(live, source, listed)
    assert {each.fate for each in found.stations} == {AS_PLANNED}
    assert registration_of(found.planned.plan).met
    assert registration_of(found.actual.plan).met
    document = as_scanned_document(live, source.frame, "scene", found, None)["network"]
    low = document["links_as_set_up"]
    assert low
    assert all(0.985 <= link["probability"] < 0.995 == document["min_probability"] for link in low)


@pytest.mark.slow
def test_with_one_station_missing_such_a_crew_scans_that_one(
    crew_set_up: tuple[LivePlan, PlanSource, list[GivenStation]], tmp_path: Path
) -> None:
    live, source, listed = crew_set_up
    low = {end for x in compared(live, source, listed).actual.plan.links if x.as_set_up for end in (x.a, x.b)}
    rest = [row for row in live.document["stations"] if row["id"] not in low]
    worst = max(rest, key=lambda row: row["own_area_m2"])["id"]
    found = compared(live, source, [each for each in listed if each.id != worst])
    assert not found.met
    rescan = plan_rescan(live, found)
    assert len(rescan.further) == 1
    assert rescan.met
    assert registration_of(rescan.plan).met
    write_plan_folder(rescan.plan, tmp_path / "again", engine=live.engine, pictures=False)
    again = open_plan(tmp_path / "again")
    counting = {(link.a, link.b) for link in again.links if again.counts(link)}
    assert counting == {(link.a, link.b) for link in counted_links(rescan.plan)}
    assert any(link.as_set_up for link in counted_links(rescan.plan))


def test_an_additional_station_gains_and_the_list_meets_what_was_asked(live: LivePlan, source: PlanSource) -> None:
    first = source.stations[0]
    extra = GivenStation("X1", first.position_m + np.array([0.8, 0.4, 0.0]), None, None)
    found = compare_as_scanned(live, matched(source.stations, [*listed_of(source), extra], within_m=0.1))
    (added,) = found.of_fate(ADDITIONAL)
    assert (added.id, added.floor) == ("X1", first.floor_id)
    assert added.lost_m2 <= 0.0
    assert found.met
    assert not found.lost


@pytest.mark.slow
def test_what_is_to_be_scanned_again_brings_back_what_was_asked(live: LivePlan, source: PlanSource) -> None:
    rest = [each for number, each in enumerate(listed_of(source)) if number not in (0, 3)]
    found = compared(live, source, rest)
    assert not found.met
    rescan = plan_rescan(live, found)
    assert rescan.met
    assert 1 <= len(rescan.further) <= 2  # the two that are missing would do
    by_id = {station.id: station for station in rescan.plan.stations}
    for listed in rest:  # what was scanned stays as it was
        np.testing.assert_allclose(by_id[listed.id].position_m + live.survey.scene.offset_m, listed.position_m)
        assert by_id[listed.id].fixed
    assert is_met(found.planned.plan, rescan.figures.plan)
    all_met = all(result.met for result in rescan.figures.plan.requirements)
    assert all_met


def parts_of(plan: Plan) -> set[frozenset[str]]:
    """Stations that links join, by growing sets."""
    parts = [{station.id} for station in plan.stations]
    for link in counted_links(plan):
        joined = [part for part in parts if part & {link.a, link.b}]
        parts = [part for part in parts if part not in joined] + [set().union(*joined)]
    return {frozenset(part) for part in parts}


@pytest.mark.slow
def test_purposes_of_further_stations_are_those_of_evaluations(
    live: LivePlan, source: PlanSource, tmp_path: Path
) -> None:
    rest = [each for number, each in enumerate(listed_of(source)) if number not in (0, 3)]
    found = compared(live, source, rest)
    back = [each for each in live.draft.stations if each.id in {station.id for station in found.of_fate(MISSING)}]
    idle = replace(found.draft.stations[0], id="idle")  # where a scan stands already
    planned = found.planned.plan
    purposes = purposes_of(live, found.draft, [*back, idle], lambda plan: is_met(planned, plan))
    assert [each.station for each in purposes] == [*(each.id for each in back), "idle"]
    assert [each.for_lost for each in purposes][-1] is False
    assert any(each.for_lost for each in purposes)
    assert purposes[-1].gains_m2 == ()
    everyone = parts_of(planned)
    for purpose, number in zip(purposes, (0, 3), strict=False):
        here = listed_of(source)[number]
        alone = evaluated(live, [*rest, here], tmp_path).coverage_by_floor
        was = found.actual.plan.coverage_by_floor
        gains = {
            floor.id: now.covered_area_m2 - before.covered_area_m2
            for floor, now, before in zip(live.survey.floors, alone, was, strict=True)
            if now.covered_area_m2 > before.covered_area_m2
        }
        assert dict(purpose.gains_m2) == pytest.approx(gains)
        others = parts_of(evaluated(live, [each for each in listed_of(source) if each.id != here.id], tmp_path))
        (own,) = (part for part in everyone if here.id in part)
        apart = {part for part in others if part <= own}
        told = {frozenset(part) - {"idle"} for part in purpose.joins} - {frozenset()}
        assert told == (apart if len(apart) > 1 else set())


@pytest.mark.slow
def test_one_floor_is_compared_with_the_others_as_planned(live: LivePlan, source: PlanSource, tmp_path: Path) -> None:
    here, there = (source.stations_of(floor.id) for floor in source.floors)
    assert len(here) > 1
    assert there
    kept = [each for each in listed_of(source) if each.id != here[0].id]
    expected = evaluated(live, kept, tmp_path)
    above = {each.id for each in there}
    today = [each for each in kept if each.id not in above]
    astray = GivenStation(there[0].id, there[0].position_m + np.array([0.7, 0.0, 0.0]), None, None)
    more = GivenStation("X1", there[-1].position_m + np.array([0.6, 0.3, 0.0]), None, None)
    for listed in (today, [*today, astray, more]):
        matches = matched(source.stations, listed, within_m=0.1)
        found = compare_as_scanned(live, matches, floors=[here[0].floor_id])
        assert {each.id for each in found.of_fate(NOT_COMPARED)} == above
        assert [each.id for each in found.of_fate(MISSING)] == [here[0].id]
        assert not (found.of_fate(MOVED) or found.of_fate(ADDITIONAL))
        assert found.actual.plan.coverage == expected.coverage
        assert found.actual.plan.coverage_by_floor == expected.coverage_by_floor


@pytest.mark.slow
def test_floors_that_are_not_compared_stay_in_the_plan_of_what_to_scan_again(
    live: LivePlan, source: PlanSource
) -> None:
    here, there = (source.stations_of(floor.id) for floor in source.floors)
    gone = {each.id for each in here[:2]}
    listed = [each for each in listed_of(source) if each.id in {station.id for station in here} - gone]
    found = compare_as_scanned(live, matched(source.stations, listed), floors=[here[0].floor_id])
    assert not found.met
    rescan = plan_rescan(live, found)
    assert rescan.met
    fixed = {station.id: station.fixed for station in rescan.plan.stations}
    assert {name for name in fixed if fixed[name]} == {each.id for each in listed}
    assert {each.id for each in there} <= set(fixed)
    assert not {each.id for each in there} & {each.id for each in rescan.further}
    assert len(rescan.further) <= len(gone)


@pytest.mark.slow
def test_no_further_stations_are_planned_where_one_alone_suffices_not(live: LivePlan, source: PlanSource) -> None:
    """One missing station never needs more than one: itself."""
    worst = max(live.document["stations"], key=lambda row: row["own_area_m2"])["id"]
    found = compared(live, source, [each for each in listed_of(source) if each.id != worst])
    if found.met:
        pytest.skip("the plan has more coverage than its best station sees alone")
    assert len(plan_rescan(live, found).further) == 1


@pytest.mark.slow
def test_ground_points_take_the_planned_instrument_height(live: LivePlan, source: PlanSource, tmp_path: Path) -> None:
    lines = [f"{each.id},{','.join(f'{v:.4f}' for v in each.site_ground_m)}" for each in source.stations]
    (tmp_path / "ground.csv").write_text("\n".join(lines))
    actual = read_actual([tmp_path / "ground.csv"], source, heights="ground", columns="PENZ")
    found = compare_as_scanned(live, matched(source.stations, actual.stations))
    assert {each.fate for each in found.stations} == {AS_PLANNED}
    # 0.2 m beside it, it is placed anew: at the same height.
    shifted = [replace(each, position_m=each.position_m + np.array([0.2, 0.0, 0.0])) for each in actual.stations[:1]]
    found = compare_as_scanned(live, matched(source.stations, shifted))
    (moved,) = found.of_fate(MOVED)
    np.testing.assert_allclose(moved.moved_m, [0.2, 0.0, 0.0], atol=2e-4)


def test_an_additional_ground_point_without_height_is_refused(live: LivePlan, source: PlanSource) -> None:
    extra = GivenStation("X1", source.stations[0].ground_m + np.array([0.5, 0.0, 0.0]), None, None, is_ground=True)
    with pytest.raises(StationListError, match=r"X1.*ground point.*instrument_height"):
        compare_as_scanned(live, matched(source.stations, [*listed_of(source), extra], within_m=0.1))


@pytest.mark.slow
def test_document_tells_the_sums_apart(live: LivePlan, source: PlanSource) -> None:
    listed = listed_of(source)
    listed[1] = replace(listed[1], position_m=listed[1].position_m + np.array([0.0, 0.3, 0.0]))
    found = compared(live, source, listed[:-1])
    document = as_scanned_document(live, source.frame, "scene", found, None)
    n = len(source.stations)
    assert document["counts"] == {
        "as planned": n - 2, "moved": 1, "missing": 1, "scanned before": 0, "additional": 0, "not compared": 0,
    }  # fmt: skip
    moved = next(row for row in document["stations"] if row["fate"] == "moved")
    np.testing.assert_allclose(source.frame.to_scene(np.array(moved["site_position"])), moved["position"], atol=2e-4)
    assert document["coverage"]["planned"] == pytest.approx(
        live.document["coverage"]["fraction_of_achievable"], abs=2e-6
    )
    assert document["met"] == found.met
    assert document["scan_again"] is None


def test_a_requirement_is_met_where_it_reaches_what_was_asked_or_what_the_plan_had() -> None:
    def covering(area_m2: float) -> PartResult:
        return PartResult("overall", 0.9, achievable_area_m2=100.0, covered_area_m2=area_m2, total_area_m2=120.0)

    assert is_part_met(covering(95.0), covering(90.0))  # less than planned, and still what was asked
    assert is_part_met(covering(95.0), covering(89.6))  # half a point is what setting up may cost
    assert not is_part_met(covering(95.0), covering(89.4))
    assert is_part_met(covering(80.0), covering(80.0))  # the plan had no more stations to spend
    assert is_part_met(covering(80.0), covering(79.6))
    assert not is_part_met(covering(80.0), covering(79.4))
