"""Overlap as a plan is asked to measure it, recounted from whole scans: by candidates, refined plans and lists."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import networkx as nx
import numpy as np
import pytest
from stages import find_positions, make_pool

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Plan, PlanSettings, PointLimits, PreAlignment, Proven, Requirements
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.pool import Pool

Planned = Callable[[str, PlanSettings], Plan]
#: Of 5 m that the scanner reaches: candidates are still linked, by fewer links.
LIMITS = PointLimits(range_m=4.6)
WAYS = [(measure, of) for measure in ("smaller-share", "jaccard") for of in ("all-seen", "seen-as-required")]


def asking(small: PlanSettings, measure: str, of: str) -> PlanSettings:
    required: dict[str, Any] = {"overlap": 0.3, "min_probability": 0.0, "overlap_measure": measure, "overlap_of": of}
    requirements = Requirements(coverage=0.9, limits=LIMITS, min_strength=0.01, **required)
    return replace(small, requirements=requirements, method=Proven(work_limit=0.05))


def recounted(looks: Any, area_m2: Any, measure: str, of: str) -> dict[tuple[int, int], float]:
    """Overlap of all pairs that have anything in common, by the definition."""
    rows = looks.seen if of == "all-seen" else looks.seen & (looks.range_m <= LIMITS.range_m)
    found = {}
    for i, j in combinations(range(len(rows)), 2):
        common = area_m2[rows[i] & rows[j]].sum()
        whole = max(area_m2[rows[i]].sum(), area_m2[rows[j]].sum())
        if measure == "jaccard":
            whole = area_m2[rows[i] | rows[j]].sum()
        if common > 0:
            found[i, j] = float(common / whole)
    return found


@pytest.fixture(scope="module")
def pools(small: PlanSettings) -> dict[tuple[str, str], Pool]:
    """Candidates with their links, before any is chosen."""
    scene, none, found = scenes_synthetic.build("corridor-comb").scene, np.zeros(0, dtype=np.int64), {}
    survey = make_survey(scene, small)
    engine = open_engine(scene, survey.patches)
    at = find_positions(survey, small, engine, floors=(0,)).candidates
    for way in WAYS:
        found[way] = make_pool(survey, asking(small, *way), engine, at, given=none, kept=none)
    return found


def assert_listed(found: dict[tuple[int, int], float], expected: dict[tuple[int, int], float], least: float) -> None:
    """Scans decide which of two patches a beam on their edge hits: some thousandths of an overlap."""
    for pair in found.keys() | expected.keys():
        if max(found.get(pair, 0.0), expected.get(pair, 0.0)) > least + 0.01:
            assert found[pair] == pytest.approx(expected[pair], abs=0.01), pair


@pytest.mark.slow
@pytest.mark.parametrize(("measure", "of"), WAYS)
def test_candidates_and_stations_are_linked_by_what_is_asked(
    measure: str,
    of: str,
    small: PlanSettings,
    planned: Planned,
    pools: dict[tuple[str, str], Pool],
    looks: Callable[..., Any],
) -> None:
    plan = planned("corridor-comb", asking(small, measure, of))
    area_m2 = plan.survey.patches.area_m2
    ids = [station.id for station in plan.stations]
    told = {(ids.index(link.a), ids.index(link.b)): link.overlap for link in plan.links}
    seen = looks(plan, np.stack([station.position_m for station in plan.stations]))
    assert_listed(told, recounted(seen, area_m2, measure, of), 0.05)
    assert len(told) > 0
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(ids)
    graph.add_edges_from((link.a, link.b) for link in plan.links if link.overlap >= 0.3 and link.strength >= 0.01)
    assert nx.is_connected(graph)
    pool = pools[measure, of]
    assert pool.links is not None
    some = np.arange(0, pool.n_candidates, max(pool.n_candidates // 20, 1))
    expected = recounted(looks(plan, pool.candidates.position_m[some]), area_m2, measure, of)
    linked = {}
    for i, j in expected:
        row = pool.links.row(int(some[i]))
        at = np.flatnonzero(pool.links.neighbour[row] == some[j])
        if at.size:
            linked[i, j] = float(pool.links.overlap[row][at[0]])
    # Those that are missing overlap too little, or are too weak.
    assert_listed(linked, {pair: expected[pair] for pair in linked}, 0.3)
    assert min(linked.values()) >= 0.3
    assert any(overlap < 0.29 for overlap in expected.values())
    assert not any(overlap < 0.29 and pair in linked for pair, overlap in expected.items())


@pytest.mark.slow
def test_what_is_asked_decides_the_links(pools: dict[tuple[str, str], Pool]) -> None:
    n_links = {way: pool.links.n_links for way, pool in pools.items() if pool.links is not None}
    for of in ("all-seen", "seen-as-required"):
        assert n_links["jaccard", of] < n_links["smaller-share", of]
    assert n_links["smaller-share", "seen-as-required"] < n_links["smaller-share", "all-seen"]


def test_where_registration_starts_decides_the_links_of_candidates(small: PlanSettings) -> None:
    """As required, else as the scanner has it."""
    scene, none = scenes_synthetic.build("l-room").scene, np.zeros(0, dtype=np.int64)
    survey = make_survey(scene, small)
    engine = open_engine(scene, survey.patches)
    at = find_positions(survey, small, engine, floors=(0,)).candidates
    linked = []
    for start, of_scanner in ((None, "tracked"), ("tracked", "manual"), (None, "manual"), ("none", "tracked")):
        scanner = replace(survey.scanner, pre_alignment=PreAlignment(of_scanner))
        required = replace(small.requirements, min_probability=0.999, pre_alignment=start)
        settings = replace(small, scanner=scanner, requirements=required)
        pool = make_pool(replace(survey, scanner=scanner), settings, engine, at, given=none, kept=none)
        assert pool.links is not None
        linked.append(pool.links.n_links)
    assert linked[0] == linked[1] > linked[2] > linked[3] == 0


@pytest.mark.slow
def test_plans_off_the_grid_and_lists_are_measured_alike(
    small: PlanSettings, planned: Planned, looks: Callable[..., Any]
) -> None:
    plan = planned("corridor-comb", replace(asking(small, "jaccard", "seen-as-required"), refine=True))
    at_m = np.stack([station.position_m for station in plan.stations])
    ids = [station.id for station in plan.stations]
    engine = open_engine(plan.survey.scene, plan.survey.patches)
    grid_m = find_positions(plan.survey, plan.settings, engine, floors=(0,)).candidates.position_m
    off_grid = [np.abs(grid_m - at).sum(axis=1).min() > 0.01 for at in at_m]
    assert any(off_grid)
    told = {(ids.index(link.a), ids.index(link.b)): link.overlap for link in plan.links}
    expected = recounted(looks(plan, at_m), plan.survey.patches.area_m2, "jaccard", "seen-as-required")
    assert_listed(told, expected, 0.05)
    assert plan.connected
    offset_m = plan.survey.scene.offset_m
    given = [
        GivenStation(station.id, station.position_m + offset_m, station.instrument_height_m, station.floor)
        for station in plan.stations
    ]
    listed = evaluate_stations(plan.survey.scene, plan.settings, given)
    assert [(link.a, link.b, link.overlap, link.strength) for link in listed.links] == [
        (link.a, link.b, link.overlap, link.strength) for link in plan.links
    ]
    usual = Requirements(coverage=0.9, limits=LIMITS)
    otherwise = evaluate_stations(plan.survey.scene, replace(plan.settings, requirements=usual), given)
    assert {link.overlap for link in otherwise.links} != {link.overlap for link in plan.links}
