"""Blocks of a problem: what they see, and which parts are one."""

import itertools
from dataclasses import replace

import networkx as nx
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import flats
from selection_instances import network_of, problem_of

from planner_core.select.blocks import _apart, blocks_of

SEEDS = st.integers(0, 2**32 - 1)


def test_blocks_see_what_their_candidates_see():
    problem, network = flats(1, n=4, r=30, shared=1)
    blocks = blocks_of(problem, network, pinned=(5,))
    assert [block.candidate.tolist() for block in blocks] == [[0, 1, 2, 3], [4, 5, 6, 7]]
    assert [block.pinned for block in blocks] == [(), (1,)]
    for block in blocks:
        for chosen in itertools.combinations(range(4), 2):
            whole = [int(block.candidate[c]) for c in chosen]
            assert block.problem.covered(list(chosen)).tolist() == problem.covered(whole).tolist()
        assert block.ticks.tolist() == problem.covered(block.candidate.tolist()).tolist()
        assert block.network.n_candidates == 4


def test_parts_that_see_much_of_the_same_are_one_block():
    problem, network = flats(1, shared=1)
    assert len(blocks_of(problem, network)) == 2
    ticks = problem.ticks.copy()
    ticks[-1] = ticks.sum()
    assert blocks_of(replace(problem, ticks=ticks), network) == []


def test_shared_rows_that_need_two_looks_leave_one_block():
    problem, network = flats(1, shared=1)
    assert blocks_of(replace(problem, seen_from=np.array([2])), network) == []
    apart, network = flats(1)
    assert len(blocks_of(replace(apart, seen_from=np.array([2])), network)) == 2


def test_many_small_parts_are_merged_to_a_few_blocks():
    problem, network = flats(3, n=2, n_flats=9)
    blocks = blocks_of(problem, network)
    assert len(blocks) == 6
    assert sorted(np.concatenate([block.candidate for block in blocks]).tolist()) == list(range(18))


def merged_one_by_one(sees, ticks):
    """Groups of parts by looking at all pairs of them before every merge."""
    groups = [[part] for part in range(len(sees))]
    while len(groups) > 1:
        seen = [sees[group].any(axis=0) for group in groups]
        area = [int(ticks[one].sum()) for one in seen]
        most, b, a = max(
            (int(ticks[seen[a] & seen[b]].sum()) / max(1, min(area[a], area[b])), b, a)
            for a, b in itertools.combinations(range(len(groups)), 2)
        )
        if most <= 0.02:
            if len(groups) <= 6:
                break
            a, b = sorted(sorted(range(len(groups)), key=lambda g: (area[g], g))[:2])
        groups = [*(group for g, group in enumerate(groups) if g not in (a, b)), groups[a] + groups[b]]
    return groups


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(2, 14), st.integers(5, 40), st.sampled_from([0.01, 0.03, 0.05, 0.1, 0.3]), st.integers(1, 50))
def test_parts_are_merged_as_by_looking_at_all_pairs_each_time(seed, n_parts, n_rows, share, most_ticks):
    rng = np.random.default_rng(seed)
    sees = rng.random((n_parts, n_rows)) < share
    ticks = rng.integers(1, most_ticks, n_rows, endpoint=True)
    apart = _apart(sees.astype(np.float64), ticks)
    assert sorted(map(sorted, apart)) == sorted(map(sorted, merged_one_by_one(sees, ticks))), f"seed {seed}"


def test_more_parts_than_can_be_compared_are_proven_as_one():
    many = 1001
    problem = problem_of(
        np.eye(many, dtype=bool), np.ones(many, dtype=np.int64), np.ones((1, many), dtype=bool), [many]
    )
    assert blocks_of(problem, network_of(nx.empty_graph(many))) == []
