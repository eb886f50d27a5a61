"""Small problems and networks that the tests of this folder make, and what a network asks for, by networkx."""

import itertools

import networkx as nx
import numpy as np

from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem


def problem_of(sees, ticks, counts_for, required, *, slack=0, seen_from=None):
    """From (N, R) bool; `slack` ticks lie between what is required and what is the least."""
    sees, required = np.asarray(sees, dtype=bool), np.asarray(required, dtype=np.int64)
    return CoverProblem(
        starts=np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64),
        row=np.nonzero(sees)[1].astype(np.int64),
        ticks=np.asarray(ticks, dtype=np.int64),
        counts_for=np.asarray(counts_for, dtype=bool),
        required=required,
        least=np.maximum(required - slack, 0),
        **({} if seen_from is None else {"seen_from": np.asarray(seen_from, dtype=np.int64)}),
    )


def every_solution(problem):
    """All sets that meet the least, as (N,) of 0 and 1."""
    for bits in itertools.product((0, 1), repeat=problem.n_candidates):
        if (problem.covered([i for i, b in enumerate(bits) if b]) >= problem.least).all():
            yield np.array(bits)


def network_of(graph, *, loops=False):
    """From a graph of networkx, its nodes 0 .. N - 1."""
    n = graph.number_of_nodes()
    part = np.empty(n, dtype=np.int32)
    for number, nodes in enumerate(sorted(nx.connected_components(graph), key=min)):
        part[list(nodes)] = number
    rows = [sorted(graph[c]) for c in range(n)]
    return Network(
        starts=np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64),
        neighbour=np.array([c for row in rows for c in row], dtype=np.int32),
        part=part,
        loops=loops,
    )


def graph_of(network, chosen=None):
    """The links among some candidates, or all."""
    graph = nx.Graph()
    graph.add_nodes_from(range(network.n_candidates))
    graph.add_edges_from((a, int(b)) for a in graph.nodes for b in network.neighbours(a))
    return graph if chosen is None else graph.subgraph(chosen)


def random_network(seed, n, *, share=0.3, loops=False):
    """Each two candidates are linked by chance."""
    rng = np.random.default_rng(seed)
    graph = nx.empty_graph(n)
    graph.add_edges_from(pair for pair in itertools.combinations(range(n), 2) if rng.random() < share)
    return network_of(graph, loops=loops)


def hangs_together(network, chosen):
    """Whether it does, straight from the definition at the head of network.py."""
    if network is None:
        return True
    spared = {frozenset(link) for link in nx.bridges(graph_of(network))}
    for part in {int(network.part[c]) for c in chosen}:
        graph = graph_of(network, [c for c in chosen if network.part[c] == part])
        if not nx.is_connected(graph):
            return False
        if network.loops and len(graph) > 2 and any(frozenset(link) not in spared for link in nx.bridges(graph)):
            return False
    return True
