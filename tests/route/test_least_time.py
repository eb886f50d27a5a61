"""Plans of least time: exhaustive search over all sets and orders of tiny problems, and detours by definition."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import Visibility
from planner_core.route.exchange import Exchanges, exchange_detours_m, insertion_detours_m
from planner_core.route.least_time import GRAPH_DETOUR, LeastTimeSettings, WalkingDistances, least_time, lower_bound_s
from planner_core.select.check import SelectionCheckError
from planner_core.select.greedy import select_greedy
from planner_core.select.network import Network
from planner_core.select.problem import Constraint, CoverProblem, cover_problem

N = 9


class Rows:
    """Distances as a matrix."""

    def __init__(self, distance_m: np.ndarray) -> None:
        self.distance_m = distance_m
        self.asked: set[int] = set()

    def row(self, place: int) -> np.ndarray:
        self.asked.add(place)
        return np.array(self.distance_m[place])


def straight(place_m: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(place_m[:, None] - place_m[None], axis=2))


def random_problem(rng: np.random.Generator, *, seen_from: int = 1) -> CoverProblem:
    sees = rng.random((N, 40)) < 0.35
    starts = np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64)
    patch = np.nonzero(sees)[1].astype(np.int32)
    area_m2 = rng.uniform(0.1, 1.0, 40)
    half = np.arange(40) < 20
    constraints = (Constraint(half, 0.9), Constraint(~half, 0.8), Constraint(half, 0.4, seen_from=seen_from))
    return cover_problem(Visibility(starts, patch, 40), area_m2, constraints)


def random_network(rng: np.random.Generator) -> Network:
    linked = np.triu(rng.random((N, N)) < 0.45, 1)
    linked[np.arange(N - 1), np.arange(1, N)] = True
    linked |= linked.T
    starts = np.concatenate([[0], np.cumsum(linked.sum(axis=1))]).astype(np.int64)
    return Network(starts, np.nonzero(linked)[1].astype(np.int32), np.zeros(N, dtype=np.int32))


def shortest_m(distance_m: np.ndarray, stops: list[int], start: int | None, *, closed: bool) -> float:
    best = np.inf
    for order in itertools.permutations(stops):
        walk = list(order) if start is None else [start, *order]
        walk = [*walk, walk[0]] if closed else walk
        best = min(best, sum(distance_m[a, b] for a, b in itertools.pairwise(walk)))
    return float(best)


def joined(network: Network, chosen: list[int]) -> bool:
    found, todo = {chosen[0]}, [chosen[0]]
    while todo:
        for other in network.neighbours(todo.pop()).tolist():
            if other in chosen and other not in found:
                found.add(other)
                todo.append(other)
    return len(found) == len(chosen)


def all_sets(problem: CoverProblem, network: Network | None, given: tuple[int, ...]) -> list[list[int]]:
    sets = [list(s) for k in range(1, 7) for s in itertools.combinations(range(N), k)]
    sets = [s for s in sets if set(given) <= set(s) and (problem.covered(s) >= problem.required).all()]
    return [s for s in sets if network is None or joined(network, s)]


LATER = [
    *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3)),
    *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(4, 12)),
]


@pytest.mark.parametrize("seed", [0, 1, *LATER])
def test_least_time_finds_the_best_of_all_sets_of_tiny_problems(seed: int) -> None:
    """Every other problem with a network, every third with a closed walk, from the dearest set that is no superset."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, seen_from=1 + seed % 2)
    network = random_network(rng) if seed % 2 else None
    distance_m = straight(rng.uniform(0, 40, (N + 1, 2)))
    closed, given = seed % 3 == 0, (int(rng.integers(N)),) if seed % 4 == 3 else ()
    sets = all_sets(problem, network, given)
    assert sets, f"seed {seed}: no set of up to six"
    seconds = [90.0 * len(s) + shortest_m(distance_m, s, N, closed=closed) / 0.5 for s in sets if len(s) <= 5]
    fewest = min(len(s) for s in sets)
    walks = WalkingDistances(Rows(distance_m), np.zeros(N, dtype=np.int32), start=N, closed=closed)
    found = least_time(
        problem, sets[-1], walks, LeastTimeSettings(90.0, walking_m_per_s=0.5), fewest=fewest, given=given,
        network=network,
    )  # fmt: skip
    assert set(found.chosen) in [set(s) for s in sets]
    exact_m = shortest_m(distance_m, list(found.chosen), N, closed=closed)
    assert found.walk_m >= exact_m - 1e-9
    assert found.seconds == pytest.approx(90.0 * len(found.chosen) + 2.0 * found.walk_m)
    assert found.lower_bound_s - 1e-9 <= min(seconds) <= found.seconds + 1e-9
    assert found.seconds == pytest.approx(min(seconds)), f"seed {seed}"
    assert found.seconds <= found.started_s


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_least_time_never_lengthens_nor_breaks_what_it_was_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem, network = random_problem(rng), random_network(rng)
    distance_m = straight(rng.uniform(0, 40, (N, 2)))
    distance_m[:4, 4:] = distance_m[4:, :4] = np.inf  # two buildings
    floor = np.array([0, 0, 1, 1, 0, 0, 0, 1, 1], dtype=np.int32)
    whole = list(range(N))
    kept, scanned = (int(rng.integers(N)),), (int(rng.integers(N)),)
    walks = WalkingDistances(Rows(distance_m), floor)
    found = least_time(
        problem, whole, walks, LeastTimeSettings(20.0, n_kicks=3), given=kept, scanned=scanned, network=network
    )
    assert set(kept) | set(scanned) <= set(found.chosen)
    assert (problem.covered(list(found.chosen)) >= problem.required).all(), seed
    assert joined(network, list(found.chosen)), seed
    assert found.seconds <= found.started_s
    assert found.lower_bound_s <= found.seconds
    n_scans = len(set(found.chosen) - set(scanned))
    assert found.seconds == pytest.approx(20.0 * n_scans + found.walk_m)


def test_same_seed_same_stations_and_few_rows_are_asked_for() -> None:
    rng = np.random.default_rng(3)
    problem = random_problem(rng)
    rows = Rows(straight(rng.uniform(0, 40, (N, 2))))
    start = list(select_greedy(problem).chosen)
    walks = WalkingDistances(rows, np.zeros(N, dtype=np.int32))
    first = least_time(problem, start, walks, LeastTimeSettings(90.0, n_kicks=0))
    assert len(rows.asked) < N
    assert least_time(problem, start, walks, LeastTimeSettings(90.0, n_kicks=0)) == first


@pytest.mark.slow
def test_no_time_is_saved_by_going_where_no_way_leads() -> None:
    """The second half of what is asked for is seen 30 m away, or in another building."""
    starts, patch = np.array([0, 1, 2, 3]), np.array([0, 1, 1], dtype=np.int32)
    problem = cover_problem(Visibility(starts, patch, 2), np.ones(2), (Constraint(np.ones(2, dtype=bool), 1.0),))
    distance_m = np.array([[0.0, 30.0, np.inf], [30.0, 0.0, np.inf], [np.inf, np.inf, 0.0]])
    for start in ([0, 1], [0, 2]):
        found = least_time(
            problem, start, WalkingDistances(Rows(distance_m), np.zeros(3, np.int32)), LeastTimeSettings(60.0)
        )
        assert set(found.chosen) == {0, 1}, start
        assert found.walk_m == 30.0


def test_bound_counts_the_way_to_what_must_be_seen() -> None:
    """Candidates along a line; only the last, 30 m away, sees the second half of what is asked for."""
    sees = [[0, 1], [0, 1], [2, 3]]
    starts, patch = np.array([0, 2, 4, 6]), np.concatenate(sees).astype(np.int32)
    problem = cover_problem(Visibility(starts, patch, 4), np.ones(4), (Constraint(np.ones(4, dtype=bool), 1.0),))
    distance_m = straight(np.array([[5.0, 0.0], [10.0, 0.0], [30.0, 0.0], [0.0, 0.0]]))
    for closed, walk_m in ((False, 30.0), (True, 60.0)):
        walks = WalkingDistances(Rows(distance_m), np.zeros(3, dtype=np.int32), start=3, closed=closed)
        time = LeastTimeSettings(100.0, walking_m_per_s=2.0)
        assert lower_bound_s(problem, walks, time, fewest=2) == pytest.approx(200.0 + walk_m / GRAPH_DETOUR / 2.0)
        found = least_time(problem, [1, 2], walks, time, fewest=2)
        assert found.seconds == pytest.approx(200.0 + walk_m / 2.0), "both candidates on the way cost nothing more"
    assert lower_bound_s(problem, WalkingDistances(Rows(distance_m), np.zeros(3, np.int32)), time, fewest=2) == 200.0
    scanned = lower_bound_s(problem, walks, time, fewest=2, scanned=[2])
    assert scanned == pytest.approx(100.0 + 2 * 5.0 / GRAPH_DETOUR / 2.0), "what is scanned is not walked to"


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), seen_from=st.integers(1, 3))
def test_exchanges_are_allowed_where_all_targets_stay_met(seed: int, seen_from: int) -> None:
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, seen_from=seen_from)
    chosen = sorted(rng.choice(N, 6, replace=False).tolist())
    others = np.setdiff1d(np.arange(N), chosen)
    exchanges = Exchanges(problem)
    allowed = exchanges.allowed(chosen, others)
    for i, j in itertools.product(range(others.size), range(6)):
        swapped = [*chosen[:j], int(others[i]), *chosen[j + 1 :]]
        assert allowed[i, j] == (problem.covered(swapped) >= problem.required).all(), (seed, i, j)
    spare = exchanges.superfluous(chosen)
    for j in range(6):
        rest = chosen[:j] + chosen[j + 1 :]
        assert spare[j] == (problem.covered(rest) >= problem.required).all(), (seed, j)
    assert exchanges.met(chosen) == (problem.covered(chosen) >= problem.required).all()
    missing = np.maximum(problem.required - problem.covered(chosen), 0)
    for c in others.tolist():
        added = problem.covered([*chosen, c]) - problem.covered(chosen)
        assert exchanges.gains(chosen)[c] == np.minimum(added, missing).sum(), (seed, c)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 6))
def test_detours_are_the_change_in_length_of_the_best_place(seed: int, n: int) -> None:
    """One floor: the tour without a stop, and the candidate at each of its places."""
    rng = np.random.default_rng(seed)
    between = straight(rng.uniform(0, 40, (n + 4, 2)))
    stops, candidates = np.arange(n), np.arange(n, n + 4)
    floor, to = np.zeros(n, dtype=np.int32), np.zeros(4, dtype=np.int32)
    found = exchange_detours_m(between[:n, candidates], floor, between[:n, :n], to)
    inserted = insertion_detours_m(between[:n, candidates], floor, between[:n, :n], to)

    def length_m(tour: list[int]) -> float:
        return float(sum(between[a, b] for a, b in zip(tour, tour[1:] + tour[:1], strict=True)))

    whole_m = length_m(stops.tolist())
    for i, c in enumerate(candidates.tolist()):
        at_best = min(length_m([*range(k), c, *range(k, n)]) for k in range(n))
        assert inserted[i] == pytest.approx(at_best - whole_m)
        for out in range(n):
            rest = [s for s in range(n) if s != out]
            best = min(length_m([*rest[:k], c, *rest[k:]]) for k in range(n))
            assert found[i, out] == pytest.approx(best - whole_m), (seed, i, out)


def test_candidates_go_beside_stops_of_their_floor() -> None:
    """Stops of floors 0, 0, 1 and the seam of an open walk, all at one place but the second, 10 m away."""
    away = np.array([[0.0], [10.0], [0.0], [0.0]])
    between = np.array([[0.0, 10.0, 0, 0], [10.0, 0, 10.0, 0], [0.0, 10.0, 0, 0], [0.0, 0, 0, 0]])
    floor = np.array([0, 0, 1, -1], dtype=np.int32)
    above = exchange_detours_m(away, floor, between, np.array([1], dtype=np.int32))
    assert np.isfinite(above).all()
    assert insertion_detours_m(away, floor, between, np.array([1], dtype=np.int32)) == pytest.approx([0.0])
    new = insertion_detours_m(away, floor, between, np.array([7], dtype=np.int32))
    assert new == pytest.approx([0.0]), "a floor that has no stop yet: where floors change"


def test_a_closed_walk_without_stops_gets_no_longer_by_one() -> None:
    away, floor, to = np.empty((0, 4)), np.empty(0, dtype=np.int32), np.arange(4, dtype=np.int32)
    assert insertion_detours_m(away, floor, np.empty((0, 0)), to).tolist() == [0.0] * 4
    assert exchange_detours_m(away, floor, np.empty((0, 0)), to).shape == (4, 0)


def test_a_closed_walk_of_one_floor_is_left_for_another_one_anywhere() -> None:
    place_m = np.array([[0.0, 0.0], [8.0, 0.0], [0.0, 6.0], [4.0, 0.0]])
    between = straight(place_m)
    floor, above = np.zeros(3, dtype=np.int32), np.array([1], dtype=np.int32)
    assert insertion_detours_m(between[:3, 3:], floor, between[:3, :3], above) == pytest.approx([0.0])
    one = insertion_detours_m(between[:1, 3:], floor[:1], between[:1, :1], above)
    assert one == pytest.approx([8.0]), "there and back"


@pytest.mark.slow
@pytest.mark.parametrize("n_stations", [1, 2, 3])
def test_a_closed_walk_without_a_start_may_lose_all_its_stations_on_the_way(n_stations: int) -> None:
    """Three groups of alike candidates, of which a few suffice: whatever is taken out, another one can be put in."""
    sees = np.arange(N)[:, None] % n_stations == np.arange(12)[None] % n_stations
    starts = np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64)
    rows = Visibility(starts, np.nonzero(sees)[1].astype(np.int32), 12)
    problem = cover_problem(rows, np.ones(12), (Constraint(np.ones(12, dtype=bool), 1.0),))
    distance_m = straight(np.random.default_rng(n_stations).uniform(0, 40, (N, 2)))
    floor = (np.arange(N) // 5).astype(np.int32)
    walks = WalkingDistances(Rows(distance_m), floor, closed=True)
    found = least_time(problem, list(range(n_stations)), walks, LeastTimeSettings(60.0), fewest=n_stations)
    sets = itertools.combinations(range(N), n_stations)
    best_m = min(
        shortest_m(distance_m, list(s), None, closed=True) for s in sets if len({c % n_stations for c in s}) == len(s)
    )
    assert found.seconds == pytest.approx(60.0 * n_stations + best_m)


def test_a_set_that_misses_a_target_is_refused() -> None:
    problem = random_problem(np.random.default_rng(1))
    walks = WalkingDistances(Rows(np.zeros((N, N))), np.zeros(N, dtype=np.int32))
    with pytest.raises(SelectionCheckError):
        least_time(problem, [0], walks, LeastTimeSettings(60.0))


@pytest.mark.parametrize("bad", [{"per_station_s": -1.0}, {"walking_m_per_s": 0.0}, {"n_kicks": -1}])
def test_settings_that_make_no_sense_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(RequirementError):
        LeastTimeSettings(**{"per_station_s": 60.0, **bad})  # type: ignore[arg-type]
