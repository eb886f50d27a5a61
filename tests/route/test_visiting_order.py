"""Visiting order: against all orders on small plans, against a lower bound (1-tree) on large ones."""

from itertools import groupby, pairwise, permutations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.route import visiting_order as tour_module
from planner_core.route.visiting_order import exact_tour, improved_tour, paths_through, tour_length_m, visiting_order


def plan_distances(points: np.ndarray) -> np.ndarray:
    return np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=2))


def walk_m(distance: np.ndarray, order: tuple[int, ...], *, closed: bool) -> float:
    legs = [distance[a, b] for a, b in pairwise(order)]
    return float(sum(legs)) + (float(distance[order[-1], order[0]]) if closed else 0.0)


def storeys_whole(floor: np.ndarray, order: tuple[int, ...]) -> bool:
    runs = [level for level, _ in groupby(floor[list(order)].tolist())]
    return len(runs) == len(set(runs))


def shortest_of_all(
    distance: np.ndarray, floor: np.ndarray, start: int | None, end: int | None, *, closed: bool
) -> float:
    """The shortest walk by looking at every order."""
    n = floor.size
    best = np.inf
    for order in permutations(range(n)):
        if (start is not None and order[0] != start) or (end is not None and order[-1] != end):
            continue
        if storeys_whole(floor, tuple(stop for stop in order if stop not in (start, end))):
            best = min(best, walk_m(distance, order, closed=closed))
    return best


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 7),
    st.integers(0, 10_000),
    st.integers(1, 3),
    st.sampled_from(["open", "start", "end", "both", "closed", "closed from start"]),
)
def test_small_plans_get_the_shortest_of_all_orders(n: int, seed: int, n_floors: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    distance = plan_distances(rng.random((n, 2)) * 20)
    floor = rng.integers(0, n_floors, n).astype(np.int32)
    start = 0 if kind in ("start", "both", "closed from start") else None
    end = n - 1 if kind in ("end", "both") and n > 1 else None
    closed = kind.startswith("closed")
    found = visiting_order(distance, floor, start=start, end=end, closed=closed)
    order = tuple(found.order.tolist())
    assert sorted(order) == list(range(n))
    assert found.exact
    assert start is None or order[0] == start
    assert end is None or order[-1] == end
    assert storeys_whole(floor, tuple(stop for stop in order if stop not in (start, end)))
    assert found.length_m == pytest.approx(walk_m(distance, order, closed=closed and n > 1))
    assert found.length_m == pytest.approx(shortest_of_all(distance, floor, start, end, closed=closed and n > 1))


def one_tree_bound_m(distance: np.ndarray, n_rounds: int = 300) -> float:
    """Held and Karp's bound of a closed tour: the best 1-tree found by subgradient steps on the stops' prices."""
    n = distance.shape[0]
    price, best, step = np.zeros(n), -np.inf, float(distance.mean())
    for _ in range(n_rounds):
        priced = distance + price[:, None] + price[None]
        graph = nx.Graph()
        graph.add_weighted_edges_from((i, j, priced[i, j]) for i in range(1, n) for j in range(i + 1, n))
        tree = nx.minimum_spanning_tree(graph)
        ends = np.argsort(priced[0, 1:])[:2] + 1
        degree = np.array([2, *(tree.degree(i) for i in range(1, n))], dtype=float)
        degree[ends] += 1
        bound = tree.size(weight="weight") + priced[0, ends].sum() - 2 * price.sum()
        best = max(best, float(bound))
        price += step * (degree - 2)
        step *= 0.98
    return best


@pytest.mark.slow
def test_large_plans_come_close_to_the_lower_bound() -> None:
    distance = plan_distances(np.random.default_rng(3).random((40, 2)) * 30)
    found = visiting_order(distance, np.zeros(40, np.int32), closed=True)
    bound = one_tree_bound_m(distance)
    assert not found.exact
    assert bound <= found.length_m <= 1.03 * bound


@pytest.mark.slow
def test_the_search_finds_the_proven_shortest_tours_of_twelve() -> None:
    for seed in range(8):
        distance = plan_distances(np.random.default_rng(seed).random((12, 2)))
        whole = [np.arange(12)]
        exact = tour_length_m(distance, exact_tour(distance, whole, [paths_through(distance)]))
        tour = improved_tour(distance, whole, n_kicks=60, rng=np.random.default_rng(0))
        assert sorted(tour.tolist()) == list(range(12))
        assert tour_length_m(distance, tour) == pytest.approx(exact, rel=1e-9)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.booleans())
def test_large_plans_keep_storeys_whole_and_are_no_longer_than_without_kicks(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    n = 30
    floor = np.sort(rng.integers(0, 2, n)).astype(np.int32)
    points = np.column_stack([rng.random((n, 2)) * 15, 30.0 * floor])
    distance = plan_distances(points)
    kicked = visiting_order(distance, floor, start=3, closed=closed, n_kicks=20)
    plain = visiting_order(distance, floor, start=3, closed=closed, n_kicks=0)
    for found in (kicked, plain):
        order = tuple(found.order.tolist())
        assert sorted(order) == list(range(n))
        assert order[0] == 3
        assert storeys_whole(floor, order[1:])
        assert found.length_m == pytest.approx(walk_m(distance, order, closed=closed))
    assert kicked.length_m <= plain.length_m + 1e-9


def test_no_2_opt_and_no_or_opt_move_is_left_in_a_large_plan() -> None:
    distance = plan_distances(np.random.default_rng(8).random((25, 2)) * 10)
    found = visiting_order(distance, np.zeros(25, np.int32), closed=True, n_kicks=0)
    order = found.order.tolist()
    for i in range(25):
        for j in range(i + 1, 25):
            turned = (*order[:i], *order[i : j + 1][::-1], *order[j + 1 :])
            assert walk_m(distance, turned, closed=True) >= found.length_m - 1e-6
        for size in (1, 2, 3):
            segment, rest = order[i : i + size], order[:i] + order[i + size :]
            for gap in range(len(rest)):
                for piece in (segment, segment[::-1]):
                    moved = (*rest[:gap], *piece, *rest[gap:])
                    assert walk_m(distance, moved, closed=True) >= found.length_m - 1e-6


def test_parts_that_no_way_joins_are_visited_one_after_the_other() -> None:
    points = np.array([[0.0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]])
    distance = plan_distances(points)
    island = np.array([0, 1, 0, 1, 0, 1], dtype=bool)
    distance[island[:, None] != island[None]] = np.inf
    found = visiting_order(distance, np.zeros(6, np.int32))
    assert found.n_unwalkable == 1
    legs = distance[found.order[:-1], found.order[1:]]
    assert found.length_m == pytest.approx(legs[np.isfinite(legs)].sum())


@pytest.mark.parametrize("n_each", [2, 14])
def test_flats_are_visited_one_after_the_other_and_each_floor_by_floor(n_each: int) -> None:
    rng = np.random.default_rng(1)
    flat, floor = np.repeat([0, 1, 0, 1], n_each), np.repeat([0, 0, 1, 1], n_each).astype(np.int32)
    distance = plan_distances(np.column_stack([rng.random((4 * n_each, 2)) * 5, 3.0 * floor]))
    distance[flat[:, None] != flat[None]] = np.inf
    found = visiting_order(distance, floor)
    assert found.n_unwalkable == 1
    runs = [key for key, _ in groupby(zip(flat[found.order].tolist(), floor[found.order].tolist(), strict=True))]
    assert len(runs) == 4


@pytest.mark.parametrize("n_flats", [4, 10])
def test_flats_of_one_floor_each_are_visited_from_the_lowest_floor_up(n_flats: int) -> None:
    """Whatever the order in which stations came: a crew does not go from the second floor to the first and up again."""
    floor_of_flat = np.random.default_rng(3).permutation(np.arange(n_flats) % 4).astype(np.int32)
    floor, flat = np.repeat(floor_of_flat, 3), np.repeat(np.arange(n_flats), 3)
    distance = plan_distances(np.random.default_rng(4).random((3 * n_flats, 2)) * 5)
    distance[flat[:, None] != flat[None]] = np.inf
    assert not (np.diff(floor) >= 0).all()
    order = visiting_order(distance, floor).order
    assert (np.diff(floor[order]) >= 0).all()
    assert len(list(groupby(flat[order].tolist()))) == n_flats


def test_many_storeys_are_taken_from_one_end_to_the_other() -> None:
    rng = np.random.default_rng(0)
    floor = np.repeat(np.arange(9), 3).astype(np.int32)
    distance = plan_distances(np.column_stack([rng.random((27, 2)) * 5, 40.0 * floor]))
    found = visiting_order(distance, floor, start=26)
    runs = [level for level, _ in groupby(floor[found.order].tolist())]
    assert runs == list(range(8, -1, -1))
    assert not found.exact


def test_nothing_and_one_stop_are_walks() -> None:
    assert visiting_order(np.zeros((0, 0)), np.zeros(0, np.int32)).order.size == 0
    one = visiting_order(np.zeros((1, 1)), np.zeros(1, np.int32), start=0, end=0)
    assert one.order.tolist() == [0]
    assert one.length_m == 0.0


@pytest.mark.slow
def test_the_same_seed_gives_the_same_order() -> None:
    distance = plan_distances(np.random.default_rng(4).random((60, 2)))
    floor = np.zeros(60, np.int32)
    assert np.array_equal(visiting_order(distance, floor).order, visiting_order(distance, floor).order)


def test_wrong_matrices_and_ends_are_refused() -> None:
    floor = np.zeros(3, np.int32)
    distance = plan_distances(np.random.default_rng(0).random((3, 2)))
    with pytest.raises(RequirementError, match="a row and a column a stop"):
        visiting_order(distance[:2], floor)
    with pytest.raises(RequirementError, match="symmetric"):
        visiting_order(np.triu(distance), floor)
    with pytest.raises(RequirementError, match="start: got stop 9"):
        visiting_order(distance, floor, start=9)
    with pytest.raises(RequirementError, match="closed route"):
        visiting_order(distance, floor, start=0, end=1, closed=True)


def descended_by_the_whole_matrix(distance: np.ndarray, tour: np.ndarray, block_of: np.ndarray) -> np.ndarray:
    """2-opt and Or-opt as they are defined: of all moves of the whole tour the best, the first of equals, again."""
    n = tour.size
    while True:
        length = tour_length_m(distance, tour)
        best, after = -1e-9, None
        moves = [
            ((0, i, j), np.concatenate([tour[:i], tour[i : j + 1][::-1], tour[j + 1 :]]))
            for i in range(n)
            for j in range(i + 1, n)
            if block_of[i] == block_of[j] and (i, j) != (0, n - 1)
        ]
        for size in range(1, min(3, n - 2) + 1):
            for i in range(n - size + 1):
                rest = np.concatenate([tour[:i], tour[i + size :]])
                if block_of[i] != block_of[i + size - 1]:
                    continue
                first, end = np.flatnonzero(block_of == block_of[i])[[0, -1]]
                for gap in range(first, end - size + 2):
                    for segment in (tour[i : i + size], tour[i : i + size][::-1]):
                        moves.append(((1, size, i), np.concatenate([rest[:gap], segment, rest[gap:]])))
        for _, moved in moves:
            change = tour_length_m(distance, moved) - length
            if change < best - 1e-12:
                best, after = change, moved
        if after is None:
            return tour
        tour = after


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.lists(st.integers(1, 6), min_size=1, max_size=4))
def test_blocks_looked_at_one_by_one_give_the_tour_of_the_whole_matrix(seed: int, sizes: list[int]) -> None:
    rng = np.random.default_rng(seed)
    distance = plan_distances(rng.random((sum(sizes), 2)) * 10)
    blocks = np.split(rng.permutation(sum(sizes)), np.cumsum(sizes)[:-1])
    block_of = np.repeat(np.arange(len(sizes)), sizes)
    start = tour_module._nearest_neighbours(distance, blocks)
    expected = descended_by_the_whole_matrix(distance, start, block_of) if start.size > 2 else start
    found = improved_tour(distance, blocks, n_kicks=0, rng=rng)
    assert tour_length_m(distance, found) == pytest.approx(tour_length_m(distance, expected), rel=1e-12)
    assert found.tolist() == expected.tolist(), f"seed {seed}, blocks {sizes}"


def test_a_search_that_remembers_blocks_finds_what_one_that_does_not_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    class Forgetful(tour_module._Moves):
        def look(self, tour, blocks):
            self._key = [b""] * self.n_blocks
            super().look(tour, range(self.n_blocks))

    rng = np.random.default_rng(4)
    distance = plan_distances(rng.random((60, 2)) * 20)
    blocks = np.split(rng.permutation(60), [9, 10, 31, 44])
    found = improved_tour(distance, blocks, n_kicks=20, rng=np.random.default_rng(1))
    monkeypatch.setattr(tour_module, "_Moves", Forgetful)
    assert improved_tour(distance, blocks, n_kicks=20, rng=np.random.default_rng(1)).tolist() == found.tolist()
