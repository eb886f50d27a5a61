"""Simulated annealing: Eq. 8 with its sign set right, by statistics of moves against the closed form."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.stats import chi2

from planner_core.paper.search import SearchSettings, search
from planner_core.paper.search.annealing import acceptance

BOUNDS = np.array([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]])
SQUARE = SearchSettings(neighbourhood="cube", fixed_height=True)


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
