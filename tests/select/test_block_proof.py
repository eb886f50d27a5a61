"""Proof by blocks against exhaustive search: bounds never pass the optimum and meet it, plans are connected."""

import contextlib
import itertools
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import flats
from waiting import until

from planner_core.executor import NotWantedError, spread_over
from planner_core.model import Proven
from planner_core.progress import ProgressEvent, silent
from planner_core.select import block_proof, proven
from planner_core.select.block_proof import BlockProof
from planner_core.select.blocks import BlockJob, blocks_of
from planner_core.select.check import check_selection
from planner_core.select.greedy import drop_redundant, select_greedy
from planner_core.select.network import connect
from planner_core.select.proven import select
from planner_core.select.search import Limits

from ..cluster.conftest import cluster_of

SEEDS = st.integers(0, 2**32 - 1)


def smallest(problem, network, *, pinned=()):
    for size in range(problem.n_candidates + 1):
        for chosen in itertools.combinations(range(problem.n_candidates), size):
            meets = (problem.covered(list(chosen)) >= problem.least).all()
            if set(pinned) <= set(chosen) and meets and network.n_violations(chosen) == 0:
                return size
    raise AssertionError("no set meets all")


def find(problem, network, pinned, start, work, progress):
    """Greedy selection alone: worse sets leave more to the proof."""
    chosen = connect(problem, network, select_greedy(problem, given=pinned).chosen)
    chosen = drop_redundant(problem, chosen, given=pinned, network=network)
    return tuple(chosen if start is None or len(chosen) < len(start) else start), work


def proof_of(problem, network, *, pinned=(), n_stations=None):
    blocks = blocks_of(problem, network, pinned)
    return BlockProof(problem, blocks, n_stations=n_stations or problem.n_candidates, find=find)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(SEEDS, st.integers(2, 3), st.integers(1, 2), st.integers(0, 2), st.sampled_from([0.6, 0.8, 0.95]))
def test_proof_by_blocks_ends_at_the_smallest_set_and_never_passes_it(seed, n_flats, n_constraints, shared, share):
    n = 10 // n_flats
    problem, network = flats(seed, n=n, n_flats=n_flats, n_constraints=n_constraints, shared=shared, share=share)
    optimum = smallest(problem, network)
    proof = proof_of(problem, network)
    while not proof.finished:
        proof.advance(work=1e-6)
        assert proof.lower_bound <= optimum, f"seed {seed}"
    # Rows that two blocks see may leave a bound short of the optimum: they count twice.
    assert proof.n_stations == problem.n_candidates or proof.best is not None
    assert proof.lower_bound == min(optimum, problem.n_candidates) or shared, f"seed {seed}"
    if proof.best is not None:
        check_selection(problem, proof.best, network=network)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(SEEDS, st.integers(1, 2), st.integers(0, 2))
def test_every_smaller_plan_lies_in_a_node_that_is_open(seed, n_constraints, shared):
    problem, network = flats(seed, n=4, n_constraints=n_constraints, shared=shared)
    plans = [
        chosen
        for size in range(9)
        for chosen in itertools.combinations(range(8), size)
        if (problem.covered(list(chosen)) >= problem.least).all() and network.n_violations(chosen) == 0
    ]
    proof = proof_of(problem, network, n_stations=9)
    while not proof.finished:
        proof.advance(work=1e-6)
        for plan in plans:
            ticks = np.array(
                [
                    block.problem.covered([at for at, c in enumerate(block.candidate.tolist()) if c in plan])
                    for block in proof._blocks
                ]
            )
            nodes = [node for _, _, _, node in proof._open]
            inside = any((node.low <= ticks).all() and (ticks <= node.high).all() for node in nodes)
            assert inside or len(plan) >= min(proof.n_stations, proof._given_up), f"seed {seed}: {plan}"


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(SEEDS, st.booleans())
def test_given_candidates_and_loops_hold_within_blocks(seed, loops):
    problem, network = flats(seed, n=5, loops=loops)
    pinned = tuple(np.random.default_rng(seed).choice(10, 2, replace=False).tolist())
    optimum = smallest(problem, network, pinned=pinned)
    proof = proof_of(problem, network, pinned=pinned, n_stations=11)
    while not proof.finished:
        proof.advance(work=1e-6)
    assert proof.lower_bound == optimum == len(proof.best), f"seed {seed}"
    check_selection(problem, proof.best, given=pinned, network=network)


@pytest.mark.parametrize("seed", range(3))
def test_selection_of_flats_is_proven_by_blocks(seed, monkeypatch):
    def never(self, tree):
        raise AssertionError("blocks leave nothing to be proven as one")

    monkeypatch.setattr(proven._ProvenSearch, "_blocks_are_due", lambda self, blocks, tree: not blocks.finished)
    monkeypatch.setattr(proven._ProvenSearch, "_proof_due", never)
    problem, network = flats(seed, n=5)
    found = select(problem, Proven(work_limit=5.0, n_walks=1), network=network)
    assert found.proven
    assert len(found.chosen) == smallest(problem, network), f"seed {seed}"


@pytest.fixture
def sent(monkeypatch):
    """Tasks sent to other processes, however small blocks are."""
    tasks, sound = [], BlockJob.answer
    monkeypatch.setattr(BlockJob, "answer", lambda self, task, *more: tasks.append(task) or sound(self, task, *more))
    monkeypatch.setattr(block_proof, "_WORTH_SPREADING", 1)
    return tasks


def test_blocks_searched_elsewhere_give_the_same_set_bound_and_work(sent, monkeypatch):
    """First turns of proofs end at once, so that what others began is gone on with here."""
    monkeypatch.setattr(block_proof, "_FIRST_PROOF_WORK", 1e-9)
    problem, network = flats(2, n=6, r=40)

    def proven():
        blocks = blocks_of(problem, network)
        proof = BlockProof(problem, blocks, n_stations=problem.n_candidates, find=find, sent_find=find)
        curve = []
        while not proof.finished:
            proof.advance(work=1e-6)
            curve.append((proof.work, proof.lower_bound, proof.n_stations, proof.n_nodes))
        return proof.best, curve

    alone = proven()
    assert sent == []
    with cluster_of(2) as (cluster, messages), spread_over(cluster):
        assert proven() == alone
    assert messages == []
    assert {task.number for task in sent if task.wanted == 0} == {0, 1}, "sets"
    assert {task.number for task in sent if task.work > 0} == {0, 1}, "proofs"


@pytest.mark.parametrize("n_done", [0, 3, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2, 4))])
def test_blocks_searched_elsewhere_end_at_the_same_work(sent, n_done, monkeypatch):
    """All work is done in the middle of a node, or before it: no task is sent any more."""
    monkeypatch.setattr(block_proof, "_FIRST_PROOF_WORK", 1e-5)
    problem, network = flats(5, n=6, r=40, share=0.9)

    def proven(limit):
        blocks = blocks_of(problem, network)
        proof = BlockProof(problem, blocks, n_stations=problem.n_candidates, find=find, sent_find=find)
        works = []
        while not proof.finished and not proof._stopped:
            proof.advance(work=1e-6, progress=lambda event: proof.stop() if proof.work >= limit else None)
            works.append(proof.work)
        return works, proof.best, proof.lower_bound, proof.n_nodes

    works = proven(float("inf"))[0]
    limit = sorted(set(works))[n_done] if n_done else 0.5
    alone = proven(limit)
    with cluster_of(2) as (cluster, messages), spread_over(cluster):
        assert proven(limit) == alone
    assert messages == []
    assert len(alone[0]) <= len(works)


@pytest.fixture
def held(monkeypatch):
    """Workers search blocks for ever, but for those of `held.passes`, until nobody waits for them."""
    monkeypatch.setattr(block_proof, "_WORTH_SPREADING", 1)
    sound, held = BlockJob.answer, SimpleNamespace(passes=lambda task: False, begun=[], ended=[])

    def answer(self, task, kept, progress=silent):
        is_probe = task.wanted > 0 and task.work == 0.0
        if is_probe or held.passes(task):
            return sound(self, task, kept, progress)
        held.begun.append(task.number)
        until_s = time.monotonic() + 60
        try:
            while time.monotonic() < until_s:
                progress(ProgressEvent("prove", 0, 0))
                time.sleep(0.01)
        except NotWantedError:
            held.ended.append(task.number)
            raise
        return sound(self, task, kept, progress)

    monkeypatch.setattr(BlockJob, "answer", answer)
    return held


@pytest.mark.parametrize(
    ("why", "what"),
    [
        ("time limit", "sets"),
        pytest.param("interrupted", "proofs", marks=pytest.mark.slow),
        pytest.param("time limit", "proofs", marks=pytest.mark.slow),
        pytest.param("interrupted", "sets", marks=pytest.mark.slow),
    ],
)
def test_others_are_not_waited_for_once_the_search_ends_and_end_too(why, what, held, monkeypatch):
    def interrupt(event):
        if held.begun and why == "interrupted":
            raise KeyboardInterrupt

    monkeypatch.setattr(proven._ProvenSearch, "_blocks_are_due", lambda self, blocks, tree: not blocks.finished)
    monkeypatch.setattr(Limits, "left_s", property(lambda self: 0.0 if held.begun and why == "time limit" else None))
    held.passes = lambda task: what == "proofs" and task.wanted == 0
    problem, network = flats(2, n=8, r=60)
    with cluster_of(2) as (cluster, messages), spread_over(cluster):
        found = select(problem, Proven(work_limit=5.0, n_walks=1), network=network, progress=interrupt)
        assert found.why_stopped == why
        check_selection(problem, found.chosen, network=network)
        assert found.lower_bound <= smallest(problem, network) <= len(found.chosen)
        until(lambda: sorted(held.ended) == sorted(held.begun))
    assert messages == []


@pytest.mark.slow
@pytest.mark.parametrize("by", [None, KeyboardInterrupt])
def test_what_others_had_found_when_the_search_ended_counts(by, held):
    """Of two proofs one is done, the other goes on for ever."""
    problem, network = flats(2, n=6, r=40)
    blocks = blocks_of(problem, network)
    proof = BlockProof(problem, blocks, n_stations=problem.n_candidates, find=find, sent_find=find)
    held.passes = lambda task: task.wanted == 0 or task.number == 0

    def end(event):
        if held.begun and event.done == 1:
            if by is not None:
                raise by
            proof.stop()

    # One worker, who takes them in order: of two in one process one waits for the other, maybe for the endless one.
    with cluster_of(1) as (cluster, _), spread_over(cluster):
        with contextlib.suppress(KeyboardInterrupt):
            while not held.begun:
                proof.advance(work=1e-6, progress=end)
        until(lambda: held.ended)
    (turn,) = proof._turns.values()
    task = turn.first
    problem = blocks[0].demanding(task.demand)
    proven = min(smallest(problem, blocks[0].network), task.wanted)
    nodes = [stations for stations, _, _, node in proof._open if (node.low[0] == task.demand).all()]
    assert (task.number, proof._known[0].bound(task.demand), nodes) == (0, proven, [proven])
    assert not proof.finished


@pytest.mark.slow
@pytest.mark.parametrize("n_workers", [2, *(pytest.param(n, marks=pytest.mark.campaign) for n in (1, 4))])
def test_selection_with_blocks_searched_elsewhere_is_the_same(n_workers, sent):
    problem, network = flats(2, n=8, r=60)

    def selected():
        return select(problem, Proven(work_limit=5.0, n_walks=1), network=network)

    alone = selected()
    assert (sent, alone.proven) == ([], True)
    with cluster_of(n_workers) as (cluster, _), spread_over(cluster):
        assert selected() == alone
    assert len(sent) > 4


def test_interrupted_proof_by_blocks_keeps_a_bound_that_holds(monkeypatch):
    problem, network = flats(4, n=5)
    proof = proof_of(problem, network)

    def interrupt(node, progress):
        raise KeyboardInterrupt

    proof.advance(work=1e-6)
    before = proof.lower_bound
    monkeypatch.setattr(proof, "_look_at", interrupt)
    with pytest.raises(KeyboardInterrupt):
        proof.advance(work=1.0)
    assert proof.lower_bound == before <= smallest(problem, network)
    assert not proof.finished


def test_blocks_go_on_while_their_bound_rises_until_either_is_done_or_most_work_is():
    search = proven._ProvenSearch.__new__(proven._ProvenSearch)
    search._settings, search._blocks_rose = Proven(work_limit=100.0), (0, 0.0)

    def are_due(work, bound, *, blocks_done=False, whole_done=False):
        blocks = SimpleNamespace(work=work, lower_bound=bound, finished=blocks_done)
        return search._blocks_are_due(blocks, SimpleNamespace(finished=whole_done))

    assert are_due(15.0, 0)
    assert are_due(15.1, 12)
    assert are_due(30.1, 12)
    assert not are_due(30.2, 12)
    assert are_due(30.2, 12, whole_done=True)
    assert are_due(40.0, 13)
    assert not are_due(40.0, 13, blocks_done=True)
    assert are_due(79.9, 14)
    assert not are_due(80.0, 15)
