"""The memoised search, Fig. 15's optimised version: the same ways as the plain one, with fewer questions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.paper.search import SearchSettings, search

BOUNDS = np.array([[-1.0, -1.0, 0.5], [1.0, 1.0, 2.0]])
ORIGIN = (0.013, -0.021, 0.633)


def lattice_starts(seed: int, n: int) -> np.ndarray:
    return np.array(ORIGIN) + 0.05 * np.random.default_rng(seed).integers([-18, -18, 0], [18, 18, 25], (n, 3))


def assert_same(one, other) -> None:
    for name in ("position_m", "f1", "f2"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name in ("position_m", "f1", "f2", "restarted", "n_iterations"):
        np.testing.assert_array_equal(getattr(one.history, name), getattr(other.history, name))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ls", "sa", "ts"])
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**20), fixed_height=st.booleans(), cell=st.sampled_from([1.0, 0.5, 0.25]))
def test_it_goes_the_same_ways_as_the_plain_search_on_the_lattice(
    method, seed, fixed_height, cell, make_rugged
) -> None:
    plain_options = SearchSettings(
        seed=seed,
        neighbourhood="cube",
        fixed_height=fixed_height,
        initial_temperature=30.0,
        max_without_improvement=4,
        lattice_origin_m=ORIGIN,
        memoised=False,
        memo_cell_steps=cell,
    )
    starts = lattice_starts(seed, 8)
    plain_terrain, memo_terrain = make_rugged((0.1, 0, 1)), make_rugged((0.1, 0, 1))
    plain = search(method, starts, plain_terrain, plain_options, bounds_m=BOUNDS)
    memo = search(method, starts, memo_terrain, replace(plain_options, memoised=True), bounds_m=BOUNDS)
    assert_same(plain, memo)

    asked, asked_once = np.concatenate(plain_terrain.asked), np.concatenate(memo_terrain.asked)
    assert (plain.n_evaluations, plain.n_hits) == (len(asked), 0)
    assert (memo.n_evaluations, memo.n_hits) == (len(asked_once), len(asked) - len(asked_once))
    distinct = np.unique(asked, axis=0)
    np.testing.assert_array_equal(np.unique(asked_once, axis=0), distinct)
    assert len(asked_once) == len(distinct)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ls", "sa", "ts"])
@pytest.mark.parametrize("cell", [1.0, 0.3])
def test_off_the_lattice_positions_are_put_into_the_middle_of_their_cells(method, cell, make_rugged) -> None:
    options = SearchSettings(memo_cell_steps=cell, lattice_origin_m=ORIGIN, seed=3)
    starts = np.random.default_rng(1).uniform(BOUNDS[0], BOUNDS[1], (10, 3))
    history = search(method, starts, make_rugged((0, 0, 1)), options, bounds_m=BOUNDS).history
    cells = (history.position_m - np.array(ORIGIN)) / (0.05 * cell)
    np.testing.assert_allclose(cells, np.rint(cells), atol=1e-9)
    assert np.abs(history.position_m[0] - starts).max() <= 0.5 * 0.05 * cell + 1e-12
    moved = np.linalg.norm(np.diff(history.position_m, axis=0), axis=2)[~history.restarted[1:]]
    moved = moved[moved > 0]
    assert moved.size
    assert np.abs(moved - 0.05).max() <= np.sqrt(3) / 2 * 0.05 * cell + 1e-9  # half a cell's diagonal


def test_every_direction_of_the_sphere_leaves_its_cell(make_terrain, make_bowl) -> None:
    for n in (4, 16, 200):
        for fixed_height in (False, True):
            options = SearchSettings(n_directions=n, fixed_height=fixed_height, max_iterations=1)
            terrain = make_terrain(make_bowl((0, 0, 0)))
            search("ls", np.array([[0.0, 0.0, 1.0]]), terrain, options, bounds_m=BOUNDS)
            start, asked = terrain.asked[0][0], terrain.asked[1]
            assert np.abs(asked - start).max(axis=1).min() > 0.049, n


def test_it_asks_about_no_position_twice_whatever_the_agents_do(make_rugged) -> None:
    terrain = make_rugged((0, 0, 1))
    starts = np.repeat(lattice_starts(0, 5), 4, axis=0)  # four agents from each start
    found = search("sa", starts, terrain, SearchSettings(lattice_origin_m=ORIGIN), bounds_m=BOUNDS)
    asked = np.concatenate(terrain.asked)
    assert len(np.unique(asked, axis=0)) == len(asked) == found.n_evaluations
    assert found.n_hits > found.n_evaluations


def test_by_default_the_lattice_goes_through_the_middle_of_the_bounds_at_their_least_height(make_rugged) -> None:
    # There a grid of 0.5 x 0.5 x 0.4 m centred on a floor lies, as well as that of every multiple of two steps.
    bounds = np.array([[-3.21, 1.17, 0.513], [2.84, 6.05, 2.013]])
    x, y = bounds.mean(axis=0)[:2]
    grid = [(x + 0.25 * i, y + 0.5 * j, 0.513 + 0.4 * k) for i in (-3, 2) for j in (-1, 4) for k in (0, 3)]
    for memoised in (True, False):
        options = SearchSettings(memoised=memoised, max_iterations=1)
        history = search("ls", np.array(grid), make_rugged((0, 0, 1)), options, bounds_m=bounds).history
        np.testing.assert_allclose(history.position_m[0], grid, rtol=0, atol=1e-12)
