"""Polishing of a set: never worse, always the same, and what it is for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import problem_of, random_network

from planner_core.select.check import check_selection
from planner_core.select.network import connect
from planner_core.select.polish import polish

SEEDS = st.integers(0, 2**32 - 1)


def case(seed, *, with_network, n=14, r=40):
    """A problem, a set that meets it, its network, one candidate given and some to keep."""
    rng = np.random.default_rng(seed)
    sees, ticks = rng.random((n, r)) < 0.3, rng.integers(1, 20, r)
    counts_for, seen_from = rng.random((2, r)) < 0.7, np.array([1, 1 + seed % 2])
    counts_for &= sees.sum(axis=0) >= seen_from[:, None]
    order = [int(c) for c in rng.permutation(n)]
    network = random_network(seed, n, loops=bool(seed % 3 == 0)) if with_network else None
    everything = problem_of(sees, ticks, counts_for, [0, 0], seen_from=seen_from)
    chosen = order[:6] if network is None else connect(everything, network, order[:5])
    problem = problem_of(sees, ticks, counts_for, everything.covered(chosen) * 9 // 10, seen_from=seen_from)
    return problem, chosen, network, chosen[:1], [int(c) for c in rng.permutation(n)[:4]]


def worth(problem, chosen, keep):
    return len(set(chosen) & set(keep)), int(problem.covered(list(chosen)).sum())


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans())
def test_polished_set_is_as_large_meets_all_and_no_single_exchange_is_better(seed, with_network):
    problem, chosen, network, given_ones, keep = case(seed, with_network=with_network)
    best = polish(problem, chosen, network=network, given=given_ones, keep=keep)
    check_selection(problem, best, given=given_ones, network=network)
    assert len(best) == len(chosen) and best[0] == chosen[0]
    assert worth(problem, best, keep) >= worth(problem, chosen, keep), f"seed {seed}"
    assert polish(problem, best, network=network, given=given_ones, keep=keep) == best
    for place in range(1, len(best)):
        for other in set(range(problem.n_candidates)) - set(best):
            rest = [*best[:place], other, *best[place + 1 :]]
            meets = (problem.covered(rest) >= problem.required).all()
            if meets and (network is None or network.n_violations(rest) == 0):
                assert worth(problem, rest, keep) <= worth(problem, best, keep), f"seed {seed}: {place}, {other}"


def test_a_station_of_the_earlier_plan_comes_back_though_another_covers_more():
    # 0 or 1 with 2 meet the target; 1 sees more, 0 is to be kept.
    problem = problem_of([[1, 0, 0], [1, 1, 0], [0, 0, 1]], [4, 1, 4], [[1, 1, 1]], [8])
    assert polish(problem, [1, 2], keep=[0]) == (0, 2)
    assert polish(problem, [0, 2]) == (1, 2)
    assert polish(problem, [0, 2], given=[0]) == (0, 2)
