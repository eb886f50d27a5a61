"""Networks of chosen candidates against networkx, and annealing for one against NumPy."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_annealer import NumpyAnnealer
from selection_instances import graph_of, network_of, problem_of, random_network

from planner_core.select.annealing import Annealer
from planner_core.select.annealing_problem import AnnealingProblem
from planner_core.select.problem import CoverProblem

SEEDS = st.integers(0, 2**32 - 1)


def violations_by_networkx(network, chosen):
    """Straight from the definition at the head of network.py."""
    graph, whole = graph_of(network, chosen), graph_of(network, range(network.n_candidates))
    violations = nx.number_connected_components(graph) - len({int(network.part[c]) for c in chosen})
    if not network.loops:
        return violations
    spared = {frozenset(link) for link in nx.bridges(whole)}
    for a, b in nx.bridges(graph):
        alone = sum(network.part[c] == network.part[a] for c in chosen) == 2
        violations += not alone and frozenset((a, b)) not in spared
    return violations


def random_problem(seed, *, n=40, r=120, seen_from=(1, 1)):
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < 0.15
    ticks, counts_for = rng.integers(0, 10**9, r), rng.random((len(seen_from), r)) < 0.6
    enough = sees.sum(axis=0) >= np.array(seen_from)[:, None]
    required = ((counts_for & enough) * ticks).sum(axis=1) * 8 // 10
    return problem_of(sees, ticks, counts_for & enough, required, seen_from=seen_from)


def first_sets(n, size, n_sets=3):
    rng = np.random.default_rng(1)
    return np.array([rng.permutation(n)[:size] for _ in range(n_sets)], dtype=np.int32)


def energy(annealed, chosen):
    """What a set misses, in Python's whole numbers and by networkx."""
    problem, missing = annealed.problem, 0
    looks = [sum(r in problem.rows_of(c) for c in chosen) for r in range(problem.n_rows)]
    for counted, required, enough in zip(problem.counts_for, problem.required, problem.seen_from, strict=True):
        for look in range(1, enough + 1):
            covered = sum(int(problem.ticks[r]) for r in range(problem.n_rows) if counted[r] and looks[r] >= look)
            missing += max(int(required) - covered, 0)
    network = annealed.network
    return missing + (0 if network is None else annealed.penalty * violations_by_networkx(network, chosen))


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([0.03, 0.1, 0.3]), st.booleans(), st.integers(0, 14))
def test_violations_of_a_set_are_what_networkx_counts(seed, share, loops, size):
    network = random_network(seed, 14, share=share, loops=loops)
    chosen = [int(c) for c in np.random.default_rng(seed).permutation(14)[:size]]
    assert network.n_violations(chosen) == violations_by_networkx(network, chosen), f"seed {seed}"
    whole = graph_of(network, range(14))
    assert network.bridges == {(min(link), max(link)) for link in nx.bridges(whole)}, f"seed {seed}"
    assert network.n_violations(range(14)) == 0


LOOKS = ((1, 1), (2, 1), (2, 3))
LINKS = ((None, False), (0.08, False), (0.08, True), (0.0, True), (0.6, True))
SIZES = ((40, 10, 0), (40, 35, 3), (90, 70, 2))
#: Every fourth has each of them.
CASES = [
    pytest.param(*case, marks=[pytest.mark.slow] if number % 4 else [])
    for number, case in enumerate(itertools.product(LOOKS, LINKS, SIZES))
]


@pytest.mark.slow
@pytest.mark.parametrize(("seen_from", "links", "sizes"), CASES)
def test_annealing_takes_the_steps_of_numpy_with_looks_and_links(seen_from, links, sizes):
    (share, loops), (n, size, n_pinned) = links, sizes
    problem = random_problem(7, n=n, seen_from=seen_from)
    network = None if share is None else random_network(5, n, share=share, loops=loops)
    annealed = AnnealingProblem(problem, seed=2**63 + 5, network=network)
    ours, theirs = first_sets(n, size), first_sets(n, size)
    pinned = ours[:, :n_pinned].copy()
    for steps in ((0, 40), (40, 90)):
        a = Annealer(annealed).anneal(ours, round_=3, steps=steps, n_steps=90, n_pinned=n_pinned)
        b = NumpyAnnealer(annealed).anneal(theirs, round_=3, steps=steps, n_steps=90, n_pinned=n_pinned)
        assert np.array_equal(ours, theirs)
        assert np.array_equal(a, b)
    assert np.array_equal(ours[:, :n_pinned], pinned)
    for chosen, missing in zip(ours.tolist(), a.tolist(), strict=True):
        assert len(set(chosen)) == size
        assert energy(annealed, chosen) == missing


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(SEEDS, st.booleans())
def test_long_annealing_reports_what_sets_miss(seed, loops):
    problem = random_problem(seed, n=20, r=30, seen_from=(2, 1))
    annealed = AnnealingProblem(problem, seed=seed, network=random_network(seed, 20, share=0.15, loops=loops))
    sets = first_sets(20, 9)
    missing = Annealer(annealed).anneal(sets, round_=0, steps=(0, 3000), n_steps=3000)
    for chosen, left in zip(sets.tolist(), missing.tolist(), strict=True):
        assert energy(annealed, chosen) == left, f"seed {seed}"


def test_a_set_of_pinned_candidates_alone_is_refused():
    annealed = AnnealingProblem(random_problem(1), seed=1)
    with pytest.raises(ValueError, match="pinned"):
        Annealer(annealed).anneal(first_sets(40, 3), round_=0, steps=(0, 5), n_steps=5, n_pinned=3)


def test_annealing_connects_what_coverage_alone_leaves_apart():
    # Rows of candidates 0, 1, 2 are all there is; 3 .. 8 see nothing, and only 3 - 4 joins all three.
    n = 9
    sees = np.zeros((n, 3), dtype=bool)
    sees[np.arange(3), np.arange(3)] = True
    problem = CoverProblem(
        starts=np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64),
        row=np.arange(3),
        ticks=np.full(3, 10),
        counts_for=np.ones((1, 3), dtype=bool),
        required=np.array([30]),
        least=np.array([30]),
    )
    graph = nx.empty_graph(n)
    graph.add_edges_from([(0, 3), (1, 3), (3, 4), (4, 2), (0, 5), (5, 6), (6, 1), (7, 8), (7, 0), (8, 1)])
    annealed = AnnealingProblem(problem, seed=4, network=network_of(graph))
    sets = np.array([[0, 1, 2, 7, 8]] * 4, dtype=np.int32)
    missing = Annealer(annealed).anneal(sets, round_=0, steps=(0, 2000), n_steps=2000)
    assert missing.min() == 0
    assert sorted(sets[int(np.argmin(missing))].tolist()) == [0, 1, 2, 3, 4]
