"""Greedy local search on landscapes whose ends are known.

Simulated annealing: Eq. 8 with its sign set right, by statistics of moves against the closed form.

Tabu search: no voxel twice, and a new beginning exactly when the rules say so.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.stats import chi2, chisquare

from planner_core.paper.search import SearchSettings, search
from planner_core.paper.search.methods import acceptance

BOUNDS = np.array([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]])
SQUARE = SearchSettings(neighbourhood="cube", fixed_height=True)
TABU_BOUNDS = np.array([[-1.0, -1.0, 0.5], [1.0, 1.0, 2.0]])
TABU_SQUARE = SearchSettings(neighbourhood="cube", fixed_height=True, seed=4)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    centre=st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(0.6, 1.4)),
    steps=st.tuples(st.integers(-15, 15), st.integers(-15, 15), st.integers(10, 25)),
    fixed_height=st.booleans(),
)
def test_a_bowl_ends_in_the_cell_of_its_minimum(centre, steps, fixed_height, make_terrain, make_bowl) -> None:
    options = SearchSettings(neighbourhood="cube", fixed_height=fixed_height, max_iterations=100)
    start = 0.05 * np.array(steps, dtype=float)
    found = search("ls", start[None], make_terrain(make_bowl(centre)), options, bounds_m=BOUNDS)
    off = np.abs(found.position_m[0] - centre)
    assert (off[:2] <= 0.025 + 1e-9).all(), found.position_m
    if fixed_height:
        assert found.position_m[0, 2] == pytest.approx(start[2])
    else:
        assert off[2] <= 0.025 + 1e-9


def test_the_way_down_a_bowl_is_the_shortest(make_terrain, make_bowl) -> None:
    # 8 and 3 steps off in the plane: 3 diagonal moves and 5 along x.
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", np.array([[0.4, 0.15, 1.0]]), make_terrain(make_bowl((0, 0, 1))), options, bounds_m=BOUNDS)
    assert found.history.n_iterations.tolist() == [9]  # eight moves, and the look round that finds nothing better
    assert (np.diff(found.history.f2[:9, 0]) < 0).all()


def test_the_move_that_undoes_the_last_one_is_not_even_looked_at(make_terrain, make_bowl) -> None:
    options = SearchSettings(neighbourhood="cube", fixed_height=True, memoised=False)
    terrain = make_terrain(make_bowl((1.0, 0, 1)))
    search("ls", np.array([[0.5, 0.0, 1.0]]), terrain, options, bounds_m=BOUNDS)
    assert [len(batch) for batch in terrain.asked] == [1, 8, *[7] * 10]
    for k, batch in enumerate(terrain.asked[2:]):
        behind = [0.5 + 0.05 * k, 0.0, 1.0]  # where the agent came from
        assert np.abs(batch - behind).max(axis=1).min() > 0.04


def test_a_plateau_is_left_for_more_patches_only(make_terrain) -> None:
    # F2 is the same everywhere; F1 grows to the east up to x = 0.3.
    terrain = make_terrain(
        lambda p: np.full(len(p), 7.0), f1=lambda p: np.minimum(np.rint(p[:, 0] * 20), 6).astype(np.int64)
    )
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", np.array([[0.0, 0.0, 1.0]]), terrain, options, bounds_m=BOUNDS)
    assert (found.f1[0], found.f2[0]) == (6, 7.0)
    assert found.position_m[0, 0] == pytest.approx(0.3)
    assert found.history.n_iterations[0] == 7


def test_an_invalid_start_goes_to_a_valid_neighbour_or_is_said_not_to_be_found(make_terrain, make_bowl) -> None:
    terrain = make_terrain(make_bowl((0.5, 0, 1)), valid=lambda p: p[:, 0] > 0.02)
    starts = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", starts, terrain, options, bounds_m=BOUNDS)
    assert found.found.tolist() == [True, False]
    np.testing.assert_allclose(found.position_m, [[0.5, 0.0, 1.0], [-1.0, 0.0, 1.0]], atol=1e-9)
    assert np.isinf(found.history.f2[0]).all() and np.isinf(found.f2[1]) and found.f1[1] == 0


def test_no_agents_are_no_trouble(make_terrain, make_bowl) -> None:
    for method in ("ls", "sa", "ts"):
        found = search(method, np.empty((0, 3)), make_terrain(make_bowl((0, 0, 0))), bounds_m=BOUNDS)
        assert found.position_m.shape == (0, 3) and found.history.f2.shape[1] == 0 and found.n_evaluations == 0


def chance_of_each(p: np.ndarray) -> np.ndarray:
    """Chances of being the first accepted of a sweep in random order, given each one's own; and of none, last.

    Give every neighbour a uniform time t. Neighbour d comes to be accepted at t if it is accepted itself and no other
    was accepted before, which each is with chance p t: the integral of p_d prod_(e != d) (1 - p_e t) over t.
    """
    chances = []
    for d in range(p.size):
        product = Polynomial([p[d]])
        for e in np.delete(p, d):
            product *= Polynomial([1.0, -e])
        chances.append(float(product.integ()(1.0)))
    return np.array([*chances, np.prod(1.0 - p)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_first_moves_have_the_frequencies_of_equation_8(seed: int, make_terrain) -> None:
    """All eight neighbours are worse, each by another amount; 6000 agents make one move each, at T = 2."""
    rise = {
        (-1, -1): 0.5,
        (-1, 0): 6.0,
        (-1, 1): 2.0,
        (0, -1): 1.0,
        (0, 1): 4.0,
        (1, -1): 9.0,
        (1, 0): 3.0,
        (1, 1): 0.2,
    }
    table = np.zeros((3, 3))
    for (x, y), value in rise.items():
        table[x + 1, y + 1] = value

    def f2(p):
        cell = np.rint(p[:, :2] / 0.05).astype(int) + 1
        return table[cell[:, 0], cell[:, 1]]

    n = 6000
    options = SearchSettings(
        seed=seed, max_iterations=1, initial_temperature=2.0, neighbourhood="cube", fixed_height=True
    )
    found = search("sa", np.tile([0.0, 0.0, 1.0], (n, 1)), make_terrain(f2), options, bounds_m=BOUNDS)
    cell = np.rint(found.history.position_m[1, :, :2] / 0.05).astype(int)
    counted = np.array([*((cell == key).all(axis=1).sum() for key in rise), (cell == 0).all(axis=1).sum()])
    expected = n * chance_of_each(np.exp(-np.array(list(rise.values())) / 2.0))
    assert counted.sum() == n
    statistic = float(((counted - expected) ** 2 / expected).sum())
    assert chi2.sf(statistic, df=8) > 1e-3, (seed, counted, expected)


def test_acceptance_is_certain_downhill_and_falls_with_the_rise_and_the_cold() -> None:
    new = np.array([-5.0, 0.0, 1.0, 2.0, np.inf])
    np.testing.assert_allclose(acceptance(new, np.zeros(5), temperature=2.0), [1, 1, np.exp(-0.5), np.exp(-1), 0])
    assert (acceptance(new[2:4], np.zeros(2), temperature=0.5) < acceptance(new[2:4], np.zeros(2), temperature=2)).all()
    np.testing.assert_array_equal(acceptance(np.array([3.0, np.inf]), np.full(2, np.inf), temperature=1.0), [1, 0])


def test_annealing_leaves_a_basin_that_local_search_stays_in(make_terrain, make_bowl) -> None:
    shallow, deep = make_bowl((0.0, 0.0, 1.0), per_m2=100.0), make_bowl((0.45, 0.0, 1.0), per_m2=100.0)
    terrain = make_terrain(lambda p: np.minimum(shallow(p) + 5.0, deep(p)))
    starts = np.tile([-0.1, 0.0, 1.0], (60, 1))
    options = SearchSettings(seed=3, neighbourhood="cube", fixed_height=True, initial_temperature=20.0)
    stayed = search("ls", starts, terrain, options, bounds_m=BOUNDS)
    left = search("sa", starts, terrain, options, bounds_m=BOUNDS)
    assert (stayed.f2 == 5.0).all()
    n_deep = int((left.f2 < 5.0).sum())
    assert n_deep > 5, f"{n_deep} of 60 agents found the deeper basin"
    assert left.f2.max() <= 5.0 + 100 * 0.1**2  # nobody's best is worse than its start


def test_it_cools_by_the_factor_and_stops_below_the_threshold(make_terrain, make_bowl) -> None:
    options = SearchSettings(initial_temperature=100.0, cooling=0.5, least_temperature=10.0, max_iterations=60)
    found = search("sa", np.array([[0.0, 0.0, 1.0]]), make_terrain(make_bowl((1, 1, 1))), options, bounds_m=BOUNDS)
    assert found.history.n_iterations.tolist() == [4]  # 100, 50, 25, 12.5
    assert found.history.f2.shape == (5, 1)


def test_when_it_is_cold_no_move_is_worse(make_rugged) -> None:
    options = SearchSettings(initial_temperature=1e-2, least_temperature=1e-9, seed=5, fixed_height=True)
    starts = np.random.default_rng(0).uniform([-1, -1, 1], [1, 1, 1], (30, 3))
    found = search("sa", starts, make_rugged((0.3, 0.1, 1.2)), options, bounds_m=BOUNDS)
    f2 = found.history.f2
    assert (f2[1:] <= f2[:-1]).all()  # F2 is whole: a rise of 1 at T = 0.01 has chance e-100


def test_in_a_blind_alley_an_agent_may_turn_back(make_terrain) -> None:
    # A corridor of four cells: at its end, only the move that undoes the last one is left.
    terrain = make_terrain(
        lambda p: np.zeros(len(p)), valid=lambda p: (np.abs(p[:, 1]) < 0.01) & (np.abs(p[:, 0] - 0.075) < 0.08)
    )
    found = search("sa", np.array([[0.0, 0.0, 1.0]]), terrain, SQUARE, bounds_m=BOUNDS)
    cell = np.rint(found.history.position_m[:, 0, 0] / 0.05).astype(int)
    assert cell.tolist()[:9] == [0, 1, 2, 3, 3, 2, 1, 0, 0]


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), fixed_height=st.booleans(), memoised=st.booleans())
def test_no_voxel_is_entered_twice(seed, fixed_height, memoised, make_rugged) -> None:
    options = SearchSettings(
        seed=seed,
        neighbourhood="cube",
        fixed_height=fixed_height,
        memoised=memoised,
        max_without_improvement=5,
        lattice_origin_m=(0.0, 0.0, 0.0),
    )
    starts = 0.05 * np.random.default_rng(seed).integers([-20, -20, 10], [20, 20, 40], (6, 3))
    history = search("ts", starts, make_rugged((0.1, 0.2, 1.2)), options, bounds_m=TABU_BOUNDS).history
    step = np.rint(history.position_m / 0.05).astype(int)
    voxel = (2 * step) // 3  # 1.5 steps a voxel, in whole numbers
    for agent in range(6):
        way = voxel[:, agent][np.r_[True, (step[1:, agent] != step[:-1, agent]).any(axis=1)]]
        assert len({tuple(v) for v in way.tolist()}) == len(way), f"seed {seed} agent {agent}"
    stayed = (step[1:] == step[:-1]).all(axis=2)
    assert not (stayed & history.restarted[1:]).any()


def test_in_its_minimum_an_agent_begins_anew_elsewhere(make_terrain, make_bowl) -> None:
    # Of voxels hardly longer than a step, this way enters a new one with every step.
    options = replace(TABU_SQUARE, tabu_voxel_steps=1.001)
    found = search(
        "ts", np.array([[-0.3, 0.0, 1.0]]), make_terrain(make_bowl((0, 0, 1))), options, bounds_m=TABU_BOUNDS
    )
    restarted = np.flatnonzero(found.history.restarted[:, 0])
    assert restarted[0] == 7  # six moves down, and every neighbour is worse
    assert found.f2[0] == pytest.approx(0.0, abs=1e-12)
    f2 = found.history.f2[:, 0]
    others = np.setdiff1d(np.arange(1, f2.size), restarted)
    assert (f2[others] <= f2[others - 1]).all()  # but for new beginnings it never goes up


def test_where_all_neighbours_are_tabu_or_invalid_an_agent_begins_anew(make_terrain) -> None:
    # Two islands of one cell each: no neighbour is ever valid, and the start is tabu.
    islands = np.array([[0.0, 0.0], [0.7, 0.7]])
    valid = lambda p: (np.abs(p[:, None, :2] - islands).max(axis=2) < 0.3).any(axis=1)  # noqa: E731
    one_cell = lambda p: (np.abs(p[:, None, :2] - islands).max(axis=2) < 0.01).any(axis=1)  # noqa: E731
    wide = search(
        "ts",
        np.array([[0.0, 0.0, 1.0]]),
        make_terrain(lambda p: np.zeros(len(p)), valid=valid),
        TABU_SQUARE,
        bounds_m=TABU_BOUNDS,
    )
    assert not wide.history.restarted[1:5].any()
    narrow = make_terrain(lambda p: np.zeros(len(p)), valid=one_cell)
    found = search("ts", np.array([[0.0, 0.0, 1.0]]), narrow, TABU_SQUARE, bounds_m=TABU_BOUNDS)
    restarted = np.flatnonzero(found.history.restarted[:, 0])
    assert restarted.size == 1  # the other island once, and then there is nowhere left that is not tabu
    np.testing.assert_allclose(found.history.position_m[-1, 0, :2], [0.7, 0.7], atol=1e-9)


@pytest.mark.parametrize("patience", [1, 3, 10])
def test_without_a_new_best_an_agent_begins_anew_after_so_many_iterations(patience, make_terrain) -> None:
    # A plateau: every move is no worse, none is a new best.
    options = SearchSettings(
        neighbourhood="cube", fixed_height=True, max_without_improvement=patience, max_iterations=5 * (patience + 1)
    )
    flat = make_terrain(lambda p: np.zeros(len(p)))
    found = search("ts", np.array([[0.0, 0.0, 1.0]]), flat, options, bounds_m=TABU_BOUNDS * [10, 10, 1])
    assert np.flatnonzero(found.history.restarted[:, 0]).tolist() == [k * (patience + 1) for k in range(1, 6)]


def test_new_beginnings_are_spread_evenly_over_the_bounds(make_terrain) -> None:
    # Nothing but new beginnings: every position is worse than all that were seen before, and none has a neighbour.
    valid = lambda p: np.rint(p / 0.05).astype(int).sum(axis=1) % 3 == 0  # noqa: E731
    options = SearchSettings(neighbourhood="cube", max_iterations=60, max_without_improvement=1, seed=9)
    starts = np.tile([0.0, 0.0, 1.05], (40, 1))
    bounds = np.array([[-1.0, -0.5, 0.5], [1.0, 0.5, 2.0]])
    history = search(
        "ts", starts, make_terrain(lambda p: np.zeros(len(p)), valid=valid), options, bounds_m=bounds
    ).history
    places = history.position_m[history.restarted]
    assert len(places) > 1000
    for axis in range(3):
        counted = np.bincount(np.rint((places[:, axis] - bounds[0, axis]) / 0.05).astype(int))
        assert counted.size == round((bounds[1] - bounds[0])[axis] / 0.05) + 1  # both ends included
        assert chisquare(counted).pvalue > 1e-3, (axis, counted)


def test_at_fixed_height_new_beginnings_keep_the_agents_height(make_rugged) -> None:
    starts = np.array([[0.0, 0.0, 0.93], [0.5, 0.5, 1.41]])
    options = SearchSettings(fixed_height=True, memoised=False, max_without_improvement=2)
    history = search("ts", starts, make_rugged((0, 0, 1)), options, bounds_m=TABU_BOUNDS).history
    assert history.restarted.any(axis=0).all()
    np.testing.assert_allclose(history.position_m[:, :, 2], np.tile([0.93, 1.41], (61, 1)), atol=1e-9)


def test_tabu_search_beats_local_search_where_pits_are_many(make_rugged) -> None:
    starts = np.random.default_rng(0).uniform([-1, -1, 0.6], [1, 1, 1.9], (40, 3))
    means = [search(m, starts, make_rugged((0, 0, 1)), TABU_SQUARE, bounds_m=TABU_BOUNDS).f2 for m in ("ls", "ts")]
    assert np.median(means[1]) < np.median(means[0])
