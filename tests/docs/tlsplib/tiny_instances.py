"""Problems small enough to try all sets of stations, and the fewest that do by trying them."""

import itertools

import networkx as nx
import numpy as np
from tlsplib.instance import Instance, Need


def tiny(seed, *, n=6, n_rows=8, linked=None, twice=None):
    """By chance: what is seen, one or two constraints, and a connected graph of links or none."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, n_rows)) < rng.uniform(0.2, 0.6)
    sees[rng.integers(n, size=n_rows), np.arange(n_rows)] = True
    ticks = rng.integers(1, 50, size=n_rows)
    needs = []
    for title, m in (("whole", 1), ("twice", 2)):
        rows = sees.sum(axis=0) >= m
        wanted = m == 1 or (bool(rng.random() < 0.5) if twice is None else twice)
        if wanted and rows.any():
            whole = int(ticks[rows].sum())
            needs.append(Need(title, rows, max(1, int(whole * rng.uniform(0.4, 1.0))), m))
    links = None
    if bool(rng.random() < 0.5) if linked is None else linked:
        links = rng.random((n, n)) < 0.25
        order = rng.permutation(n)
        links[order[:-1], order[1:]] = True
        links |= links.T
        np.fill_diagonal(links, False)
    places = rng.integers(0, 1000, size=(n, 3))
    return Instance("tiny", "tiny", {"range_cm": 500}, places, ticks, sees, tuple(needs), links)


def meets(instance, chosen):
    """Straight from the definition."""
    for need in instance.needs:
        seen = instance.sees[list(chosen)].sum(axis=0) >= need.seen_from
        if int(instance.ticks[seen & need.rows].sum()) < need.required:
            return False
    if instance.links is None:
        return True
    graph = nx.from_numpy_array(instance.links).subgraph(chosen)
    return nx.is_connected(graph)


def fewest(instance):
    """Smallest set that meets everything, by trying all."""
    for size in range(1, instance.n_candidates + 1):
        for chosen in itertools.combinations(range(instance.n_candidates), size):
            if meets(instance, chosen):
                return list(chosen)
    raise AssertionError("the set of all does")
