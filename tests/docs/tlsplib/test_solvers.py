"""The solvers that the page compares: on tiny problems all exact ones find what trying all sets finds."""

import math

import numpy as np
import pytest
from tiny_instances import fewest, meets, tiny
from tlsplib import solvers
from tlsplib.cp_sat import NO_ORTOOLS
from tlsplib.stop_watch import stopped_after

from planner_core.errors import MissingPackageError

SEEDS = range(4)


def solved(name, instance):
    found = solvers.solve(name, instance, limit_s=20.0, work=2.0)
    assert found.valid == (bool(found.chosen) and meets(instance, found.chosen))
    return found


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("name", ["highs", "proven"])
def test_exact_solvers_find_the_fewest_stations(name, linked):
    for seed in SEEDS:
        instance = tiny(seed, linked=linked)
        found, best = solved(name, instance), fewest(instance)
        assert (len(found.chosen), found.bound, found.ended) == (len(best), len(best), "proven"), seed
        assert found.valid, seed


def test_cp_sat_finds_the_fewest_stations():
    pytest.importorskip("ortools", reason="optional: requirements/tlsplib.lock")
    for seed, linked in ((0, False), (1, True), (2, True)):
        instance = tiny(seed, linked=linked, twice=True)
        found, best = solved("cp-sat", instance), fewest(instance)
        assert (len(found.chosen), found.bound, found.valid) == (len(best), len(best), True), seed


def test_cp_sat_without_its_package_says_what_to_install(monkeypatch):
    class Done:
        returncode = NO_ORTOOLS

    monkeypatch.setattr(solvers.subprocess, "run", lambda *_, **__: Done)
    with pytest.raises(MissingPackageError, match=r"tlsplib\.lock"):
        solvers.solve("cp-sat", tiny(0), limit_s=1.0, work=1.0)


@pytest.mark.parametrize("name", ["greedy", "greedy-links", "paper"])
def test_other_solvers_say_whether_their_plan_meets_everything(name):
    for seed in SEEDS:
        instance = tiny(seed)
        found = solved(name, instance)
        assert not found.valid or len(found.chosen) >= len(fewest(instance)), seed
        if name == "greedy-links":
            assert found.valid, seed


@pytest.mark.slow
def test_selection_of_large_problems_has_a_plan_and_a_bound_that_is_none_too_high():
    instance = tiny(1, linked=True)
    found = solvers.solve("large", instance, limit_s=1.0, work=0.01)
    assert found.valid
    assert found.bound <= len(fewest(instance)) <= len(found.chosen)


def test_a_solver_is_stopped_by_the_time_of_the_processor():
    stopped = []
    with stopped_after(0.0, lambda: stopped.append(True)):
        total = 0.0
        while not stopped:
            total += math.sqrt(float(np.ones(1000).sum()))
    assert stopped
