"""Planning again: what was planned stays where it can, with its ids, and a plan is never worse for it than told."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner_core.model import Plan, PlanSettings, PriorStation, Site

Planned = Callable[[str, PlanSettings], Plan]


def kept(plan: Plan) -> tuple[PriorStation, ...]:
    offset_m = plan.survey.scene.offset_m
    return tuple(PriorStation(s.id, tuple((s.position_m + offset_m).tolist()), "kept") for s in plan.stations)


@pytest.mark.slow
def test_planning_again_around_one_forbidden_station_moves_few(small: PlanSettings, planned: Planned) -> None:
    before = planned("corridor-comb", small)
    lost = before.stations[2]
    forbidden = PriorStation("forbidden-1", tuple(lost.position_m.tolist()), "forbidden", radius_m=0.5)
    after = planned("corridor-comb", replace(small, site=Site(prior=(*kept(before), forbidden))))
    assert all(result.met for result in after.requirements)
    at = {station.id: station.position_m for station in before.stations}
    stayed = [s.id for s in after.stations if s.id in at]
    assert all((s.position_m == at[s.id]).all() for s in after.stations if s.id in at)
    assert lost.id not in {station.id for station in after.stations}
    assert min(np.linalg.norm(s.position_m[:2] - lost.position_m[:2]) for s in after.stations) > 0.5 - 1e-9
    # One is gone; others change only to make up for it.
    assert len(before.stations) - len(stayed) <= 3
    assert any(lost.id in line and "dropped" in line for line in after.warnings)
    from_scratch = planned("corridor-comb", replace(small, site=Site(prior=(forbidden,))))
    if len(after.stations) > len(from_scratch.stations):
        assert any("from scratch" in line for line in after.warnings)


@pytest.mark.slow
def test_planning_again_without_a_change_changes_nothing(small: PlanSettings, planned: Planned) -> None:
    before = planned("corridor-comb", replace(small, refine=True))
    after = planned("corridor-comb", replace(small, refine=True, site=Site(prior=kept(before))))
    assert {(s.id, *s.position_m.tolist()) for s in after.stations} == {
        (s.id, *s.position_m.tolist()) for s in before.stations
    }
    # Nothing says at which end the walk begins.
    order = [s.id for s in before.stations]
    assert [s.id for s in after.stations] in (order, order[::-1])


@pytest.mark.slow
def test_new_stations_do_not_take_the_ids_of_kept_ones(small: PlanSettings, planned: Planned) -> None:
    before = planned("corridor-comb", small)
    some = kept(before)[1::2]
    after = planned("corridor-comb", replace(small, site=Site(prior=some)))
    ids = [station.id for station in after.stations]
    assert len(set(ids)) == len(ids)
    at = {station.id: station.position_m for station in some}
    assert set(at) <= set(ids)
    assert all(s.position_m == pytest.approx(at[s.id]) for s in after.stations if s.id in at)
    assert len(after.stations) <= len(before.stations) + 1
