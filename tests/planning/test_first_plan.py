"""The first plan: told before all candidates are observed from, nearly as good, and of no consequence."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import Candidates, Greedy, Plan, PlanSettings, PriorStation, Proven, Requirements, Role, Site
from planner_core.model.stored_rows import VISIBILITY_VARIABLE
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.first_plan import STAGE, as_needed, far_apart, observe_few
from planner_core.planning.plan import make_plan
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.progress import ProgressEvent, silent
from planner_core.requirements.demand import KnownObservations

Planned = Callable[[str, PlanSettings], Plan]


@pytest.fixture(scope="module")
def comb(small: PlanSettings) -> PlanSettings:
    """Of `corridor-comb`: 192 candidates, 18 of them far apart."""
    return replace(small, grid_step_m=0.5, max_patch_area_m2=1.6)


@pytest.fixture(scope="module")
def told(comb: PlanSettings) -> tuple[Plan, list[ProgressEvent]]:
    events: list[ProgressEvent] = []
    return make_plan(scenes_synthetic.build("corridor-comb").scene, comb, progress=events.append), events


def test_it_is_told_before_all_candidates_are_scanned(told: tuple[Plan, list[ProgressEvent]]) -> None:
    _, events = told
    stages = list(dict.fromkeys(event.stage for event in events))
    assert stages.index(STAGE) < stages.index("scan")
    first = [event for event in events if event.stage == STAGE]
    n_left = max(event.total for event in events if event.stage == "scan")
    n_first = first[-1].total - 1
    assert first[-1].best is not None
    assert first[-1].done == first[-1].total
    # Nobody looks around from a candidate twice.
    assert (n_first, n_first + n_left) == (48, 192)
    assert [event.best for event in first[:-1]] == [None] * (len(first) - 1)
    assert first[-1].note == f"{first[-1].best.n_stations} stations"


@pytest.mark.slow
def test_its_stations_cover_what_is_asked_but_for_little_and_mostly_hang_together(
    told: tuple[Plan, list[ProgressEvent]], comb: PlanSettings
) -> None:
    plan, events = told
    best = next(event.best for event in events if event.stage == STAGE and event.best is not None)
    assert 1 < best.n_stations == len(best.positions_m) <= len(plan.stations) + 3
    scene = scenes_synthetic.build("corridor-comb").scene
    given = [GivenStation(f"T{i}", np.array(at) + scene.offset_m, None, None) for i, at in enumerate(best.positions_m)]
    judged = evaluate_stations(scene, comb, given)
    # What it meets is what is asked of what few candidates see, which all see more of.
    assert judged.coverage.fraction_of_achievable >= comb.requirements.coverage - 0.05
    assert judged.registration is not None
    # Few candidates may not all be linked, as the many are.
    assert max(len(network.stations) for network in judged.registration.networks) >= 0.75 * best.n_stations


@pytest.mark.slow
def test_the_plan_is_the_same_without_it(
    told: tuple[Plan, list[ProgressEvent]], comb: PlanSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner_core.planning.plan.observe_few", lambda *_: None)
    events: list[ProgressEvent] = []
    plan = make_plan(scenes_synthetic.build("corridor-comb").scene, comb, progress=events.append)
    assert STAGE not in {event.stage for event in events}
    assert [s.position_m.tolist() for s in plan.stations] == [s.position_m.tolist() for s in told[0].stations]
    assert plan.warnings == told[0].warnings


@pytest.mark.slow
def test_stations_that_are_locked_are_in_it(comb: PlanSettings) -> None:
    scene = scenes_synthetic.build("corridor-comb").scene
    # A corner that no plan would take.
    x, y, z = (np.array([0.8, 0.8, 1.5]) + scene.offset_m).tolist()
    prior = PriorStation("L1", (x, y, z), Role.LOCKED)
    events: list[ProgressEvent] = []
    make_plan(scene, replace(comb, site=Site(prior=(prior,))), progress=events.append)
    best = next(event.best for event in events if event.stage == STAGE and event.best is not None)
    away_m = np.linalg.norm(np.array(best.positions_m) - [0.8, 0.8, 1.5], axis=1)
    assert away_m.min() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("method", ["greedy", pytest.param("impossible", marks=pytest.mark.slow)])
def test_nothing_is_told_where_it_would_come_too_late_or_is_not_to_be_had(method: str, comb: PlanSettings) -> None:
    settings = replace(comb, method=Greedy()) if method == "greedy" else comb
    if method == "impossible":  # so many of all candidates see a patch, but of the few there are not as many
        settings = replace(comb, requirements=Requirements(coverage=0.3, seen_from=40, overlap=0.0))
    events: list[ProgressEvent] = []
    make_plan(scenes_synthetic.build("corridor-comb").scene, settings, progress=events.append)
    assert [event.best for event in events if event.stage == STAGE and event.best] == []


@pytest.mark.slow
def test_candidates_that_memory_would_not_hold_are_left_out_evenly_and_that_is_told(
    told: tuple[Plan, list[ProgressEvent]], comb: PlanSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes_synthetic.build("corridor-comb").scene
    assert not any("memory" in line for line in told[0].warnings)
    monkeypatch.setattr("planner_core.planning.first_plan._MOST_ENTRIES", 4_500)
    prior = PriorStation("L1", tuple((np.array([0.8, 0.8, 1.5]) + scene.offset_m).tolist()), Role.LOCKED)
    events: list[ProgressEvent] = []
    plan = make_plan(scene, replace(comb, site=Site(prior=(prior,))), progress=events.append)
    (line,) = (line for line in plan.warnings if "too much for memory" in line)
    used = int(line.split()[1])
    (n_first,) = {event.total - 1 for event in events if event.stage == STAGE}
    assert n_first <= used < 150
    assert plan.n_candidates == used
    assert max(event.total for event in events if event.stage == "scan") == used - n_first
    (locked,) = (station for station in plan.stations if station.id == "L1")
    assert np.allclose(locked.position_m, [0.8, 0.8, 1.5], atol=1e-6)
    assert all(result.met for result in plan.requirements)
    assert len(plan.stations) <= len(told[0].stations) + 4


@pytest.mark.slow
@pytest.mark.parametrize("method", [Greedy(), pytest.param(Proven(work_limit=0.1), marks=pytest.mark.slow)])
def test_memory_is_kept_to_whatever_the_method_and_however_little_there_is(
    method: Greedy | Proven, comb: PlanSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner_core.planning.first_plan._MOST_ENTRIES", 1)
    plan = make_plan(scenes_synthetic.build("corridor-comb").scene, replace(comb, method=method))
    assert any("too much for memory" in line for line in plan.warnings)
    # The few that were observed from stay, and the one of a floor that is always taken.
    assert 40 < plan.n_candidates < 70
    assert plan.stations


def test_candidates_on_both_sides_of_the_origin_come_down_to_one_a_floor() -> None:
    rng = np.random.default_rng(3)
    at_m = rng.uniform(-20.0, 20.0, (500, 3))
    candidates = Candidates(at_m, rng.integers(0, 3, 500).astype(np.int32), np.full(500, 1.7), 500)
    few = far_apart(candidates, 1.0, most=1)
    assert sorted(candidates.floor[few].tolist()) == [0, 1, 2]
    many = far_apart(candidates, 1.0, most=100)
    assert 30 < many.size <= 100
    moved = replace(candidates, position_m=at_m + np.array([1000.0, -250.0, 7.0]))
    assert far_apart(moved, 1.0, most=100).tolist() == many.tolist()


@pytest.fixture
def field() -> tuple[AllowedPositions, KnownObservations]:
    """40 rows of 40 candidates half a metre apart; every fifth of every fifth row is known, and number 77 a doorway."""
    column, row = np.tile(np.arange(40), 40), np.repeat(np.arange(40), 40)
    at_m = np.column_stack([0.5 * column, 0.5 * row, np.full(1600, 1.7)])
    kind = np.zeros(1600, dtype=np.int8)
    kind[77] = 1
    tripods = SimpleNamespace(grid_step_m=0.5, survey=SimpleNamespace(scene=SimpleNamespace(open_doors=())))
    candidates = Candidates(at_m, np.zeros(1600, dtype=np.int32), np.full(1600, 1.7), 1600)
    known = np.flatnonzero((column % 5 == 0) & (row % 5 == 0))
    observations = SimpleNamespace(rows=SimpleNamespace(seen=SimpleNamespace(n_entries=100 * known.size)))
    places = AllowedPositions(tripods, candidates, kind, reach=None, site=None, prior=(), warnings=())
    return places, KnownObservations(known, observations)


def test_where_candidates_are_far_apart_a_third_of_them_is_observed_from_first(
    field: tuple[AllowedPositions, KnownObservations], monkeypatch: pytest.MonkeyPatch
) -> None:
    places, known = field
    wide = replace(places, candidates=replace(places.candidates, position_m=2.5 * places.candidates.position_m))
    monkeypatch.setattr("planner_core.planning.first_plan.observe_candidates", lambda *_, **__: known.observations)
    monkeypatch.setattr("planner_core.planning.first_plan._MOST", 1600)
    first = observe_few(None, None, None, wide, silent)
    assert first is not None
    assert 77 in first.row
    assert 1600 // 6 < first.row.size <= 1600 // 3
    crowded = replace(wide, kind=np.where(np.arange(1600) < 534, 1, 0).astype(np.int8))
    assert observe_few(None, None, None, crowded, silent) is None


def test_of_a_large_site_the_first_few_stay_and_the_grid_around_what_is_worth_a_look(
    field: tuple[AllowedPositions, KnownObservations],
) -> None:
    places, known = field
    fewer, still_known, (line,) = as_needed(places, known, np.array([0, 822]))
    around = [822 + across + 40 * along for across in (-1, 0, 1) for along in (-1, 0, 1)]
    expected = sorted({77, 0, 1, 40, 41, *around, *known.row.tolist()})
    assert fewer.candidates.position_m.tolist() == places.candidates.position_m[expected].tolist()
    assert fewer.kind.tolist() == places.kind[expected].tolist()
    assert fewer.candidates.position_m[still_known.row].tolist() == places.candidates.position_m[known.row].tolist()
    assert f"{len(expected)} of 1600 valid positions" in line
    assert "lower bound" in line
    assert "memory" not in line


def test_all_candidates_stay_where_none_is_worth_more_than_others_or_memory_is_given(
    field: tuple[AllowedPositions, KnownObservations], monkeypatch: pytest.MonkeyPatch
) -> None:
    places, known = field
    assert as_needed(places, known, None) == (places, known, ())
    monkeypatch.setenv(VISIBILITY_VARIABLE, "1GB")
    assert as_needed(places, known, np.array([822])) == (places, known, ())


def test_what_is_worth_a_look_is_thinned_where_memory_does_not_hold_it(
    field: tuple[AllowedPositions, KnownObservations], monkeypatch: pytest.MonkeyPatch
) -> None:
    places, known = field
    monkeypatch.setattr("planner_core.planning.first_plan._MOST_ENTRIES", 100 * 400)
    fewer, still_known, (line,) = as_needed(places, known, np.arange(1600))
    assert known.row.size + 1 < fewer.candidates.floor.size <= 400
    assert "memory" in line
    assert fewer.candidates.position_m[still_known.row].tolist() == places.candidates.position_m[known.row].tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("role", "limit"), [(Role.LOCKED, "_LARGE"), (Role.KEPT, "_LARGE"), (Role.LOCKED, "_LARGE_AMONG_TRIANGLES")]
)
def test_a_large_site_is_planned_with_fewer_candidates_and_hardly_more_stations(
    comb: PlanSettings, role: Role, limit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes_synthetic.build("corridor-comb").scene
    prior = PriorStation("L1", tuple((np.array([0.8, 0.8, 1.5]) + scene.offset_m).tolist()), role)
    asked = replace(comb.requirements, min_probability=0.95)
    settings = replace(comb, site=Site(prior=(prior,)), requirements=asked)
    whole = make_plan(scene, settings)
    monkeypatch.setattr(f"planner_core.planning.first_plan.{limit}", 100)
    plan = make_plan(scene, settings)
    (line,) = (line for line in plan.warnings if line.startswith("candidates:"))
    assert plan.n_candidates == int(line.split()[1]) < 150
    assert all(result.met for result in plan.requirements)
    assert len(plan.stations) <= len(whole.stations) + 1
    assert plan.registration is not None and whole.registration is not None
    assert len(plan.registration.networks) == len(whole.registration.networks)
