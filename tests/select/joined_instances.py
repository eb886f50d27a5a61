"""Small problems whose candidates see rows around them on a line, with links between some that share rows."""

import itertools

import networkx as nx
import numpy as np
from selection_instances import network_of, problem_of


def instance(seed, *, n=8, r=30, looks=1, linked=0.3, reach=0.25):
    """Candidates along a line see rows around them; some that share rows are linked, in one or several parts."""
    rng = np.random.default_rng(seed)
    at, row_at = np.sort(rng.random(n)), rng.random(r)
    sees = (np.abs(at[:, None] - row_at) < reach) & (rng.random((n, r)) < 0.9)
    shared = sees.astype(int) @ sees.T
    links = np.triu((shared > 0) & (rng.random((n, n)) < linked), 1)
    graph = nx.Graph(np.argwhere(links).tolist())
    graph.add_nodes_from(range(n))
    ticks = rng.integers(1, 20, r)
    counts_for = np.array([row_at < 0.5, np.ones(r, dtype=bool)]) & (sees.sum(axis=0) >= looks)
    required = ((counts_for * ticks).sum(axis=1) * int(rng.integers(60, 100)) // 100).astype(np.int64)
    problem = problem_of(sees, ticks, counts_for, required, seen_from=[looks, 1])
    return problem, network_of(graph), graph


def sparse_graph(rng, n, *, n_parts, more=0.4):
    """Trees with some more links."""
    graph = nx.empty_graph(n)
    home = rng.integers(0, n_parts, n)
    for i in range(n):
        before = np.flatnonzero(home[:i] == home[i])
        for j in rng.choice(before, min(before.size, 1 + (rng.random() < more)), replace=False):
            graph.add_edge(i, int(j))
    return graph


def random_problem(rng, n, *, seen_from=1, share=0.8, r=40):
    sees, ticks = rng.random((n, r)) < 0.2 * seen_from, rng.integers(1, 20, r)
    least = np.array([int(share * ticks[sees.sum(axis=0) >= seen_from].sum())])
    return problem_of(sees, ticks, np.ones((1, r), dtype=bool), least, seen_from=[seen_from])


def is_joined(graph, chosen):
    return all(
        nx.is_connected(graph.subgraph(part & set(chosen)))
        for part in map(set, nx.connected_components(graph))
        if part & set(chosen)
    )


def hangs_together(graph, chosen, *, loops):
    if not is_joined(graph, chosen):
        return False
    unavoidable = {frozenset(link) for link in nx.bridges(graph)}
    for part in map(set, nx.connected_components(graph)) if loops else ():
        links = {frozenset(link) for link in nx.bridges(graph.subgraph(part & set(chosen)))}
        if len(part & set(chosen)) > 2 and links - unavoidable:
            return False
    return True


def solutions(problem, graph, *, loops=False):
    """(S, N) of 0 and 1: all sets that are connected and meet the targets."""
    n = problem.n_candidates
    found = []
    for bits in itertools.product((0, 1), repeat=n):
        chosen = [i for i in range(n) if bits[i]]
        if (problem.covered(chosen) >= problem.least).all() and hangs_together(graph, chosen, loops=loops):
            found.append(bits)
    return np.array(found, dtype=np.int64).reshape(-1, n)


def points(rng, n):
    """Whole points, blurred ones, and any."""
    whole = (rng.random(n) < 0.4).astype(float)
    return [whole, np.clip(whole * rng.random(n) * 1.5, 0, 1), np.where(rng.random(n) < 0.5, 0.0, rng.random(n))]


def flats(seed, *, n=4, r=30, n_flats=2, n_constraints=1, shared=0, share=0.85, loops=False):
    """Flats of n candidates and r rows each; `shared` rows that all candidates of all flats see."""
    rng = np.random.default_rng(seed)
    sees = np.zeros((n_flats * n, n_flats * r + shared), dtype=bool)
    graph = nx.empty_graph(n_flats * n)
    for flat in range(n_flats):
        own = slice(flat * n, flat * n + n)
        sees[own, flat * r : flat * r + r] = rng.random((n, r)) < 0.4
        graph.add_edges_from((flat * n + int(rng.integers(i)), flat * n + i) for i in range(1, n))
    sees[:, n_flats * r :] = True
    ticks = rng.integers(50, 100, sees.shape[1])
    ticks[n_flats * r :] = 1
    counts_for = np.ones((n_constraints, ticks.size), dtype=bool)
    counts_for[1:] = rng.random((n_constraints - 1, ticks.size)) < 0.5
    least = (share * (counts_for & sees.any(axis=0)) @ ticks).astype(np.int64)
    problem = problem_of(sees, ticks, counts_for, least)
    network = network_of(graph, loops=loops)
    return problem, network
