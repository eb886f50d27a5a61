"""Small problems whose candidates see rows around them on a line, with links between some that share rows."""

import networkx as nx
import numpy as np

from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem


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
    problem = CoverProblem(
        starts=np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64),
        row=np.nonzero(sees)[1].astype(np.int64),
        ticks=ticks.astype(np.int64),
        counts_for=counts_for,
        required=required,
        least=required,
        seen_from=np.array([looks, 1]),
    )
    return problem, network_of(graph), graph


def network_of(graph):
    n = graph.number_of_nodes()
    rows = [sorted(graph[i]) for i in range(n)]
    part = np.empty(n, dtype=np.int32)
    for number, members in enumerate(sorted(nx.connected_components(graph), key=min)):
        part[list(members)] = number
    starts = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    return Network(starts, np.array([other for row in rows for other in row], dtype=np.int32), part)
